"""The certificate: bounds on the errors of given loads, proved for the exact solution of the scene.

`refine` evaluates the contact law in balls, `proved` proves that a solution exists near the refined
loads, and this module bounds the distance from the given loads to that solution.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from convexrough import checks
from convexrough.arithmetic.balls import Ball
from convexrough.arrays import Array, Indices, frozen
from convexrough.influence import Kind, couple
from convexrough.normal.boxes import Box, Scope, highest_by_rates
from convexrough.normal.level import Level
from convexrough.normal.problem import ALL_SHARP, NormalProblem
from convexrough.normal.proved import proved
from convexrough.normal.refine import Trial, refined, trial_of
from convexrough.record import Along, Proved
from convexrough.roundoff import ROUNDOFF, SAFETY
from convexrough.scene.scene import Scene
from convexrough.sphere import hertz

#: Statuses by their codes.
STATUSES = np.array(["undecided", "contact", "open"])
TOUCHING, OPEN = 1, 2

#: For at most this many asperities that can touch, a contact keeps the operator for friction, and a
#: certificate for the gaps. In place of a larger matrix a certificate keeps another operator.
MOST_KEPT = {"dense": ALL_SHARP, "lattice": 2**21, "scattered": 2**16}

#: If no contact radius of a solution exceeds this fraction of the distance to the nearest
#: neighbour, every other solution has a contact disc that covers the summit of the nearest
#: neighbour: in (1) of docs/theory/crowded.md, a = ROOMY and b = 1 give m <= pi / 4.
ROOMY = 0.52


@dataclass(frozen=True, eq=False, repr=False)
class Certificate(Proved):
    """What is proved near given loads. Arrays are (n,), in the order of the loads.

    Statuses are those of the solution, and not those that the given loads imply.

    scope : "global": the scene has exactly one solution; "local": the bounds hold for one solution
        near these loads, but others are not excluded (`meaning` describes which are possible);
        "none": nothing is proved, every bound is infinite and every asperity is undecided
    convexity_number : if below 1, the energy is strictly convex on the box of loads that the proof
        uses: its Hessian is at least (1 - convexity_number) H, with the diagonal matrix H of the
        local compliances at the upper ends of the box
    codes : index of each status in `STATUSES`
    load_errors : [force] bounds on |load - load in the solution|
    gaps : [length] gaps under these loads; 0 where an asperity touches. Gaps of asperities that
        cannot touch are computed when they are first asked for
    gap_errors : [length] bounds on |gap - gap in the solution|
    approach : [length] the prescribed approach; under a prescribed load, that at which a weighted
        mean of the gaps of loaded asperities is 0
    approach_error : [length] bound on |approach - approach of the solution|; 0 if prescribed
    duality_gap : [force length] upper bound on the energy of these loads minus that of the
        solution, which has the least energy if the scope is "global". The bound is infinite if
        nothing is proved, or if the energy is not proved convex between the loads and the solution.
        If the total load is prescribed, the energy is that of the loads scaled to the total, and
        the bound is infinite if asperities that cannot touch have loads
    fixed_open : number of asperities that the proof assumes to be open, and then proves to be open
        in the solution that it finds. Where this is not 0 (crowded contacts), nearby solutions in
        which one of these asperities touches are not excluded
    other_solutions_crowding : lower bound on the crowding of every other solution. The
        crowding is the largest (a_i + a_j) / r_ij of all pairs of asperities that can touch, with
        their distance r_ij and the contact radii a, which are 0 where open. The bound is
        infinite if there is no other solution, and 0 if nothing is proved
    other_solutions_cover : True if, in every other solution, the contact disc of some asperity
        covers the summit of its nearest neighbour
    in_the_way : (m,) indices of asperities that prevent a proof; empty if there is a proof
    obstacle : a sentence that says why these asperities prevent a proof

    >>> judged = contact.certificate
    >>> judged.scope, judged.all_proved, judged.load_error < 1e-12 * contact.load
    ('global', True, True)
    """

    _shown = ("all_proved", "meaning", "status", "load_error", "gap_error", "gaps", "gap_errors")
    _along: ClassVar[Along] = {("asperity",): ("status", "load_errors", "gaps", "gap_errors")}

    scope: Scope
    convexity_number: float
    codes: NDArray[np.int8] = field(repr=False)
    load_errors: Array
    #: The indentations [length] of all asperities, minus the gap where open, and their errors.
    _depths: Callable[[], tuple[Array, ...]] = field(repr=False)
    approach: float
    approach_error: float
    duality_gap: float
    fixed_open: int = 0
    other_solutions_crowding: float = 0.0
    other_solutions_cover: bool = False
    in_the_way: Indices = field(default_factory=lambda: frozen(np.zeros(0, dtype=np.intp)))
    obstacle: str = ""

    def __getstate__(self) -> dict[str, Any]:
        self._known_depths  # noqa: B018, a pickle has no operator
        return super().__getstate__()

    @cached_property
    def _known_depths(self) -> tuple[Array, ...]:
        found = self._depths()
        object.__setattr__(self, "_depths", partial(tuple, found))  # and no longer the operator
        return found

    @cached_property
    def gaps(self) -> Array:
        return frozen(np.maximum(-self._known_depths[0], 0.0))

    @property
    def gap_errors(self) -> Array:
        return frozen(self._known_depths[1])

    @cached_property
    def status(self) -> NDArray[np.str_]:
        """(n,) "contact": load proved positive; "open": gap proved positive; else "undecided"."""
        return frozen(STATUSES[self.codes])

    @property
    def meaning(self) -> str:
        """A text on the scope: which other solutions are possible, or why nothing is proved.

        >>> contact.certificate.meaning
        'the only solution'
        """
        if self.scope == "global":
            return "the only solution"
        if self.scope == "none":
            count = len(self.in_the_way)
            where = f" (asperities in the way: {count:,})" if count else ""
            return ": ".join(filter(None, ("nothing is proved", self.obstacle))) + where
        others = []
        if self.other_solutions_cover:
            others.append("a contact disc that covers the summit of its nearest neighbour")
        if self.other_solutions_crowding > 0:
            least = math.floor(self.other_solutions_crowding * 100) / 100
            others.append(f"(a_i + a_j) / r_ij above {least:.2f} (a = 0 where open)")
        if others:
            return f"any other solution has {' and '.join(others)}"
        count = self.fixed_open
        which = "asperity" if count == 1 else f"{count:,} asperities"
        fixed_open = f" with the same {which} fixed open" if count else ""
        return f"the only solution near these loads{fixed_open}"

    @property
    def all_proved(self) -> bool:
        """True if the status of every asperity is proved.

        It does not judge the loads, which may be wrong: see `load_error`, or use `verify`.
        """
        return self.scope != "none" and bool(self.codes.all())

    @property
    def load_error(self) -> float:
        """[force] The largest of `load_errors`."""
        return float(self.load_errors.max())

    @property
    def gap_error(self) -> float:
        """[length] The largest of `gap_errors`."""
        return float(self.gap_errors.max())


def certify(
    scene: Scene,
    loads: ArrayLike,
    *,
    approach: float | None = None,
    load: float | None = None,
    influence: Kind | None = None,
) -> Certificate:
    """The certificate of given loads, from any source.

    loads : (n,) [force], not negative, in the order of the scene's asperities
    approach, load : [length], [force] the prescribed quantity, exactly one of the two. If the load
        is prescribed, gaps and energy are those of the loads scaled to this total; `load_errors`
        are those of the given loads
    influence : compliance operator "dense", "lattice" or "scattered"; None for the cheapest

    Raises InputError for loads that are negative, not finite or not of the shape (n,).

    >>> judged = cr.certify(scene, contact.loads.round(12), approach=5e-5)
    >>> judged.all_proved, judged.load_error < 1e-11
    (True, True)
    """
    checks.instance("scene", scene, Scene)
    values = checks.array("loads", loads, length=len(scene), sign="not negative")
    problem = NormalProblem.assemble(scene, approach=approach, load=load, influence=influence)
    level, start = proved_near(problem, values)
    return certificate_of(level, values, start)


def proved_near(problem: NormalProblem, loads: Array) -> tuple[Level, Trial]:
    """The level proved near given loads (N,) [force], and the trial of these loads."""
    given = loads[problem.candidates] / problem.units.force
    if problem.load is not None and not given.any():
        given = np.ones(len(given))
    start = trial_of(problem, given)
    level = proved(problem, start)
    if len(problem):
        better = proved(problem, refined(problem, start))
        level = level if better.box is None else better
    return level, start


def certificate_of(level: Level, loads: Array, start: Trial) -> Certificate:
    """The certificate of `loads` (N,) [force] of all asperities, from the `level` proved near them.

    start : the loads of the asperities that can touch, scaled to a prescribed total
    """
    problem, box = level.problem, level.box
    length, force = problem.units.length, problem.units.force
    scaled, P = loads[problem.candidates] / force, start.loads.high  # tiny loads underflow
    moved = _apart(P, level.loads) + np.abs(start.loads.low)
    shift = float(_apart(start.approach.value, level.approach))
    here = start is level.trial
    known = level.indentation if here else start.indentation
    approach = float(start.approach.value)
    if box is None:  # finite loads in place of `moved` give finite displacements
        moved, shift, off = P, np.inf, np.full(len(P), np.inf)
    else:
        off = level.indentation.error if here else (level.indentation - known.value).size
    depths = Depths(problem, P, moved, approach, shift, known.value, off * (1 + SAFETY))
    approach_error = 0.0 if problem.load is None else shift * (1 + SAFETY) * length
    if box is None:
        reason, which = level.obstacle or ("", np.zeros(0, dtype=np.intp))
        return Certificate(
            scope="none",
            convexity_number=max(1.0, problem.convexity_number(P)),
            codes=frozen(np.zeros(len(loads), dtype=np.int8)),
            load_errors=frozen(np.full(len(loads), np.inf)),
            _depths=depths.kept(),
            approach=approach * length,
            approach_error=approach_error,
            duality_gap=np.inf,
            in_the_way=frozen(problem.candidates[which]),
            obstacle=reason,
        )
    # These two need most memory, so they come first.
    possible, crowding, cover = _other_solutions(level, box)
    energy = _energy_error(level, box, start, moved)
    load_errors = loads.copy()  # the bound for an asperity that cannot touch
    load_errors[problem.candidates] -= scaled * force
    np.abs(load_errors, out=load_errors)
    load_errors[problem.candidates] += _apart(scaled, level.loads) * force
    codes = depths.codes()
    codes[problem.candidates[level.touching]] = TOUCHING
    codes[problem.candidates[level.open]] = OPEN
    energy += _screened_energy(depths, loads)
    return Certificate(
        scope="local" if possible else "global",
        convexity_number=box.convexity_number,
        codes=frozen(codes),
        load_errors=frozen(load_errors),
        _depths=depths.kept(),
        approach=approach * length,
        approach_error=approach_error,
        duality_gap=energy * (force * length),
        fixed_open=int(box.fixed_open.sum()),
        other_solutions_crowding=crowding,
        other_solutions_cover=cover,
    )


@dataclass(frozen=True, eq=False)
class Depths:
    """Indentations under given loads, minus gaps where open, with bounds on their errors.

    Arrays are (n,), for the asperities that can touch, and in scaled units.
    """

    problem: NormalProblem
    loads: Array
    moved: Array  # error bounds of the loads
    approach: float
    shift: float  # error bound of the approach
    value: Array  # the indentations, minus gaps where open
    error: Array  # error bounds of these; infinite if nothing is proved

    def kept(self) -> Callable[[], tuple[Array, ...]]:
        """These depths, without a large matrix; if another operator is large, a function that has
        them."""
        problem, kind = self.problem, self.problem.influence.name
        if len(problem) <= MOST_KEPT[kind]:
            return self
        if kind == "dense":
            return replace(self, problem=problem.unstored())
        return partial(tuple, self())

    def __call__(self) -> tuple[Array, ...]:
        """(N,) [length] indentations of all asperities of the scene, and their error bounds."""
        with self.problem.one_thread():
            beyond = self.of_screened()
        whole = tuple(self.problem.to_scene(each) for each in (self.value, self.error))
        for each, outer in zip(whole, beyond, strict=True):
            each[self.problem.screened] = outer
            each *= self.problem.units.length
        return whole

    def of_screened(self) -> tuple[Array, Array]:
        """(m,) indentations D0 + d - A P of the asperities `screened`, and their error bounds."""
        problem, which, unit = self.problem, self.problem.screened, self.problem.units.length
        n = self.approach + problem.scene.offsets[which] / unit
        size = np.abs(n) + abs(self.approach)
        errors = problem.scene.offset_errors[which] / unit
        if len(which):
            coupling = problem.onto_screened
            product, moved = coupling.apply(self.loads), coupling.apply(self.moved)
            n, size = n - product, size + np.abs(product)
            errors += self.shift + coupling.rounding(self.loads).of(product)
            errors += moved + coupling.rounding(self.moved).of(moved)
        return n, (errors + 16 * ROUNDOFF * size) * (1 + SAFETY)

    def codes(self) -> NDArray[np.int8]:
        """(N,) the codes of statuses that follow from the indentations alone."""
        codes = np.where(self.problem.to_scene(self.value < -self.error), np.int8(OPEN), np.int8(0))
        which = self.problem.screened
        # Asperities with a negative sum of approach and offset are open; others with the sum 0 are
        # if a load displaces them.
        level = (self.problem.scene.offsets[which] == 0) & (self.problem.highest == 0)
        codes[which[~level]] = OPEN
        if level.any():
            n, errors = self.of_screened()
            codes[which[n < -errors]] = OPEN
        return codes


def _apart(values: Array, found: Ball) -> Array:
    """(n,) bounds on the distances of `values` from the numbers of the balls `found`."""
    return np.asarray(np.abs(values - found.value) * (1 + SAFETY) + found.error)


def _energy_error(found: Level, box: Box, start: Trial, moved: Array) -> float:
    """Bound on Phi(P) - Phi(P*), the energy of the loads P minus that of the solution P*.

    It is e'|P - P*| with the violations e of the contact law at P and |P - P*| <= `moved`, if Phi
    is proved convex between P and P*; else infinite. Loads q on asperities fixed open add at most
    e'q; without them, residuals change by A q.
    """
    problem, loads, excess = found.problem, start.loads.high, start.excess
    if start is found.trial:  # P: these loads, rounded and perhaps rescaled to the total
        excess = excess + 2 * ROUNDOFF * (start.local + start.product.size)
        moved = moved + ROUNDOFF * loads
    most = np.maximum(loads * (1 + SAFETY), box.loads)
    excess = np.where(box.fixed_open & (loads == 0), 0.0, excess)
    if (q := np.where(box.fixed_open, most, 0.0)).any():
        displacement, most = problem.influence.apply(q), most - q
        excess = excess + displacement + problem.influence.rounding(q).of(displacement)
    if (most > box.loads).any():  # on the box A >= -theta H, theta = box.convexity_number
        # Up to `most`, H is at least cbrt(part) times its value at the upper ends of the box.
        part = np.divide(box.loads, most, out=np.ones(len(most)), where=most > 0).min()
        convex = np.cbrt(part) > box.convexity_number * (1 + SAFETY)
        if not (convex or box.convexity_at(problem.compliance(most)) < 1):
            return np.inf
    missing = float(start.missing.size * max(found.approach.size, start.approach.size))
    return (float(excess @ moved) + missing) * (1 + SAFETY + len(moved) * ROUNDOFF)


def _screened_energy(depths: Depths, loads: Array) -> float:
    """Bound on sum (3/5) k s^(5/3) + g's + s'A s / 2, the energy of loads s on asperities that
    cannot touch, with their gaps g; infinite if there are such loads under load control.
    """
    problem, screened = depths.problem, loads > 0
    screened[problem.candidates] = False
    which = np.flatnonzero(screened)
    if len(which) == 0:
        return 0.0
    if problem.load is not None:  # these loads change the scaling of the others
        return np.inf
    # Loads that underflow in scaled units count as the smallest positive number.
    s = np.maximum(loads[which] / problem.units.force, checks.SMALLEST)
    modulus, radii = problem.scene.material.contact_modulus, problem.scene.relative_radii[which]
    coefficients = hertz.local_coefficient(modulus, radii)
    coupling = couple(problem.scene, which, problem.influence.scale, None)
    moved = coupling.apply(s)
    moved += coupling.rounding(s).of(moved)
    local = 0.6 * hertz.indentation(s, coefficients * problem.units.local)
    indentation, errors = (each[screened[problem.screened]] for each in depths.of_screened())
    energy = float(s @ (local + (errors - indentation) + 0.5 * np.maximum(moved, 0.0))) * (
        1 + SAFETY
    )
    return max(energy, checks.SMALLEST)


def _other_solutions(level: Level, box: Box) -> tuple[bool, float, bool]:
    """False if there is no solution but that of `level`; and `Certificate`'s bound on the crowding
    and statement on the cover of all others: docs/theory/crowded.md, "Other solutions"."""
    none = False, np.inf, True
    if box.scope == "global":
        return none
    assert level.trial is not None
    problem, A = level.problem, level.problem.influence

    def radii(loads: Array) -> Array:
        return problem.radii(problem.compliance(loads)) * (1 + SAFETY)

    perturbed, loads = 1.0 + SAFETY + 2.0 * A.entry_error, level.trial.loads.high
    a = radii(level.loads.upper)

    def excluded(highest: float) -> bool:
        """True if no other solution has an approach up to this."""
        t = 2.0 / np.pi * _mean(a, radii(problem.bounds(highest)))
        return A.crowding(t) * perturbed <= 1 or A.semidefinite_with(float(t.max(initial=0.0)))

    # No bound is below the approach. `overhang` needs weights and exactly their displacement.
    if not problem.by_load or excluded(float(level.approach.lower)):
        if excluded(problem.overhang(loads, level.trial.product)):
            return none
        if problem.by_load and excluded(highest_by_rates(problem, loads)):
            return none
    crowding = 0.75 * np.pi * (1.0 - SAFETY) - A.crowding(a) * perturbed
    return True, max(crowding, 0.0), bool((a <= ROOMY * A.separations()).all())


def _mean(a: Array, b: Array) -> Array:
    """(n,) upper bounds on m of (1) in docs/theory/crowded.md, which increases with a and b."""
    total = a + b
    product = np.divide(a * b, total, out=np.zeros_like(total), where=total > 0)
    return np.asarray(2.0 / 3.0 * (total - product) * (1 + SAFETY))
