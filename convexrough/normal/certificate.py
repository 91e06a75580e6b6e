"""The certificate: what is proved of given loads, for whoever reads it.

`judgement` has the mathematics. Every bound holds for the exact solution of the scene whose data
are the given float64 numbers, and includes the rounding of everything computed there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from convexrough import checks
from convexrough.arrays import Array, Indices, frozen
from convexrough.influence import Kind, couple
from convexrough.normal.boxes import Scope
from convexrough.normal.judgement import Judgement
from convexrough.normal.problem import NormalProblem
from convexrough.normal.residual import Displaced
from convexrough.record import Along, Table
from convexrough.roundoff import SAFETY
from convexrough.scene.scene import Scene
from convexrough.sphere import hertz

WORDS = np.array(["undecided", "contact", "open"])


@dataclass(frozen=True, eq=False, repr=False)
class Certificate(Table):
    """What is proved of given loads. Arrays are (n,), in the caller's order.

    scope : "global": the scene has one solution, and the bounds are on the distance to it;
        "local": it has a solution, the only one with contacts of about these sizes (`meaning` says
        what others there could be), and the bounds are on the distance to that;
        "none": nothing is proved, every bound is infinite and every asperity undecided
    convexity_number : where below 1, the energy is strictly convex on the box used: the smallest
        eigenvalue of its Hessian, scaled by its local part, is at least 1 - convexity_number
    status : "contact" (its load is proved positive), "open" (its gap is proved positive) or
        "undecided"
    load_errors : [force] bounds on |load - solution|
    gaps : [length] gaps these loads leave: max(0, (A P)_i - D_i)
    gap_errors : [length] bounds on |gap - solution|
    approach : [length] prescribed, or the one that fits the loads best
    approach_error : [length] bound on |approach - solution|; 0 where prescribed
    duality_gap : [force length] bound on the energy of these loads above that of the solution, by
        a dual point made from the loads alone, or by the slope of a convex energy; 0 to rounding
        at a solution, infinite where nothing is proved. Under load control of the loads as they
        are judged: scaled, and none on asperities that cannot touch

    held : how many asperities had to be taken as open, which in this solution they are; 0 unless
        contacts are crowded. The solution is then the only one near it with these open
    rival_crowding : any other solution has a larger crowding, the largest (a_i + a_j) / r_ij over
        all asperities that could touch, open ones with a = 0; infinite where there is no other, 0
        where nothing is known
    rival_covers : any other solution has a disc that covers its nearest neighbour's summit
    in_the_way : (m,) asperities that no proof can pass; none where there is one
    obstacle : in words, what is wrong with them

    >>> judged = contact.certificate
    >>> judged.scope, judged.holds, judged.load_error < 1e-12 * contact.load
    ('global', True, True)
    """

    _shown = ("holds", "meaning", "load_error", "gap_error")
    _along: ClassVar[Along] = {("asperity",): ("status", "load_errors", "gaps", "gap_errors")}

    scope: Scope
    convexity_number: float
    status: NDArray[np.str_]
    load_errors: Array
    gaps: Array
    gap_errors: Array
    approach: float
    approach_error: float
    duality_gap: float
    held: int = 0
    rival_crowding: float = 0.0
    rival_covers: bool = False
    in_the_way: Indices = field(default_factory=lambda: frozen(np.zeros(0, dtype=np.intp)))
    obstacle: str = ""

    @property
    def meaning(self) -> str:
        """The scope in words: what other solutions there could be.

        >>> contact.certificate.meaning
        'the only solution'
        """
        if self.scope == "global":
            return "the only solution"
        if self.scope == "none":
            why = f"; {self.obstacle}" if self.obstacle else ""
            return f"nothing is proved, {len(self.in_the_way):,} asperities in the way{why}"
        rivals = []
        if self.rival_covers:
            rivals.append("a disc that covers its nearest neighbour's summit")
        if self.rival_crowding > 0:
            rivals.append(f"crowding above {math.floor(self.rival_crowding * 100) / 100:.2f}")
        if rivals:
            return f"any other solution has {' and '.join(rivals)}"
        held = f" with the same {self.held:,} asperities held open" if self.held else ""
        return f"the only solution near these loads{held}"

    @property
    def holds(self) -> bool:
        """Every asperity is proved to touch or proved to be open."""
        return self.scope != "none" and not bool((self.status == "undecided").any())

    @property
    def load_error(self) -> float:
        """[force] the largest of `load_errors`."""
        return float(self.load_errors.max())

    @property
    def gap_error(self) -> float:
        """[length] the largest of `gap_errors`."""
        return float(self.gap_errors.max())


def certify(
    scene: Scene,
    loads: ArrayLike,
    *,
    approach: float | None = None,
    load: float | None = None,
    influence: Kind | None = None,
) -> Certificate:
    """Judge loads that came from anywhere.

    loads : (n,) [force], not negative, in the order of the scene's asperities
    approach [length] or load [force] : what is prescribed, exactly one. Under load control the
        loads are judged after scaling them to the prescribed total; the bounds include that.
    influence : how to couple the asperities: "dense", "lattice", "scattered"; None for the cheapest

    Raises InputError for loads of the wrong length, negative or not finite.

    >>> judged = cr.certify(scene, contact.loads.round(12), approach=5e-5)
    >>> judged.holds, judged.load_error < 1e-11
    (True, True)
    """
    checks.instance("scene", scene, Scene)
    values = checks.array("loads", loads, length=len(scene), sign="not negative")
    problem = NormalProblem.assemble(scene, approach=approach, load=load, influence=influence)
    return judge(problem, values)


def judge(
    problem: NormalProblem, scene_loads: Array, nearby: Displaced | None = None
) -> Certificate:
    """`certify` for a problem already assembled; loads (n,) [force] of the whole scene.

    nearby : loads (of the candidates, in the problem's units) near these, of which A P is known to
        many digits: this saves work where they are of this problem, and proves the same
    """
    length, force = problem.units.length, problem.units.force
    given = scene_loads[problem.candidates]
    found = Judgement.of(problem, given / force, nearby)
    # The screened asperities carry nothing: a load there is off by all of it.
    load_errors = scene_loads if found.scope != "none" else np.full(len(scene_loads), np.inf)
    load_errors = load_errors.copy()
    lost = np.abs(given - given / force * force)  # too small for own units
    load_errors[problem.candidates] = found.load_errors * force + lost
    words = np.where(found.indentation < -found.errors, np.int8(2), np.int8(0))
    words[problem.candidates[found.touches]] = 1
    return Certificate(
        scope=found.scope,
        convexity_number=found.convexity_number,
        status=frozen(WORDS[words]),
        load_errors=frozen(load_errors),
        gaps=frozen(np.maximum(-found.indentation, 0.0) * length),
        gap_errors=frozen(found.errors * length),
        approach=found.approach * length,
        approach_error=found.approach_error * length,
        held=found.held,
        rival_crowding=found.rivals.crowding,
        rival_covers=found.rivals.cover,
        in_the_way=frozen(problem.candidates[found.obstacle.which]),
        obstacle=found.obstacle.reason,
        duality_gap=(found.duality_gap + _screened_energy(problem, scene_loads, found))
        * (force * length),
    )


def _screened_energy(problem: NormalProblem, scene_loads: Array, found: Judgement) -> float:
    """Bound on what loads on screened asperities add to the energy, in own units.

    Of loads s besides P:  sum (3/5) k s^(5/3) + (A P - D)'s + s'A s / 2,  where A P - D >= 0.
    """
    screened = scene_loads.copy()
    screened[problem.candidates] = 0.0
    which = np.flatnonzero(screened)
    if len(which) == 0 or problem.load is not None:
        return 0.0
    scene, s = problem.scene, scene_loads[which] / problem.units.force
    coefficients = hertz.local_coefficient(
        scene.material.contact_modulus, scene.relative_radii[which]
    )
    coupling = couple(scene, which, problem.influence.scale, None)
    moved = coupling.apply(s)
    moved += coupling.rounding(s).of(moved)
    local = 0.6 * hertz.indentation(s, coefficients * problem.units.local)
    outside = found.errors[which] - found.indentation[which]
    return float(s @ (local + outside + 0.5 * np.maximum(moved, 0.0))) * (1 + SAFETY)
