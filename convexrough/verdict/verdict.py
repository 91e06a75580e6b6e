"""`verify`: compare claimed loads with what is proved about the solution.

Unless the certificate of the loads proves the whole claim, with errors of at most 1 %, Newton's
method computes a solution. Its certificate shows which loads are wrong. If there may be several
solutions, both certificates must be about the same one. `friction.verdict` compares shear forces
with a solution.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from convexrough import checks
from convexrough.arrays import Array, Indices, frozen
from convexrough.contact import Contact, solve
from convexrough.errors import InputError, SolverError
from convexrough.influence.coupling import Kind
from convexrough.normal.certificate import Certificate, certificate_of, proved_near
from convexrough.normal.claims import WITHIN, Claim, tolerance
from convexrough.normal.level import Level
from convexrough.normal.problem import NormalProblem
from convexrough.plottable import Plottable
from convexrough.record import Along, Table
from convexrough.roundoff import SAFETY
from convexrough.scene.scene import Scene
from convexrough.tabular.columns import bound

#: A hint proposes --floor if the loads of all asperities that are claimed to touch, but proved
#: open, are at most this fraction of the largest load.
NOISE = 1e-6


@dataclass(frozen=True, eq=False, repr=False)
class Verdict(Claim, Table, Plottable):
    """Comparison of claimed loads with what is proved. Indices refer to the scene's asperities.

    scene, loads, floor, within : as in `verify`
    total_prescribed : [force] the prescribed total load; None if the approach is prescribed
    certificate : certificate of the given loads, with 0 for loads up to the floor
    solution    : the contact that Newton's method finds near the given loads or, if it fails, from
        its default start; None if it finds none, if this may be another solution than that of
        `certificate`, or if `certificate` proves the whole claim, with errors of at most 1 %

    >>> verdict = cr.verify(scene, contact.loads, approach=5e-5)
    >>> verdict.holds, verdict.decided_alone, list(verdict.hints()), verdict.nearby()
    (True, True, [], None)
    """

    one = "load"
    many = "loads"
    proved = "contact set"
    kinds: ClassVar[Mapping[str, str]] = {
        "wrongly_open": "claimed open, proved to touch",
        "wrongly_loaded": "claimed to touch, proved open",
    }
    claims = ("contact", "open")
    _shown = ("holds", "error", "wrongly_open", "wrongly_loaded", "undecided", "suspects")
    _along: ClassVar[Along] = {("asperity",): ("status", "claimed", "loads", "errors")}

    scene: Scene
    loads: Array
    floor: float
    within: float
    total_prescribed: float | None
    certificate: Certificate
    solution: Contact | None = None

    @property
    def values(self) -> Array:
        """(n,) [force] the loads."""
        return self.loads

    @cached_property
    def claimed(self) -> NDArray[np.bool_]:
        """(n,) True where the asperity is claimed to touch."""
        return frozen(self.loads > self.floor)

    @cached_property
    def wrongly_open(self) -> Indices:
        """(m,) indices of asperities that are claimed to be open, and proved to touch."""
        return frozen(np.flatnonzero(~self.claimed & (self.status == "contact")))

    @cached_property
    def wrongly_loaded(self) -> Indices:
        """(m,) indices of asperities that are claimed to touch, and proved to be open."""
        return frozen(np.flatnonzero(self.claimed & (self.status == "open")))

    @property
    def of(self) -> Scene:
        """The scene of the loads."""
        return self.scene

    @property
    def errors_alone(self) -> Array:
        """(n,) [force] error bounds of the given loads that follow from `certificate` alone."""
        ignored = np.where(self.claimed, 0.0, np.abs(self.loads))
        errors = self.certificate.load_errors + ignored
        return frozen(np.where(ignored > 0, np.nextafter(errors, np.inf), errors))

    def nearby(self) -> tuple[Array, Array] | None:
        """(n,), (n,) [force] the loads of `solution` and their error bounds; None without one."""
        found = self.solution
        return None if found is None else (found.loads, found.certificate.load_errors)

    def hints(self) -> Iterator[str]:
        """Lines that suggest where wrong loads may come from."""
        small = self.loads[self.wrongly_loaded]
        if len(small) and 0 < (noise := float(small.max())) <= NOISE * self.largest:
            yield (
                f"{len(small):,} of the given loads, on asperities proved open, are at most "
                f"{noise:.2g} ({noise / self.largest:.1g} of the largest load): "
                f"--floor {bound(noise, 1)} counts them as 0"
            )
        if 0 < (largest := float(self.loads.max())) <= self.floor:
            yield f"--floor {self.floor:g} counts every load as 0: the largest is {largest:.4g}"
        yield from super().hints()


def verify(
    scene: Scene,
    loads: ArrayLike,
    *,
    approach: float | None = None,
    load: float | None = None,
    within: float = WITHIN,
    floor: float = 0.0,
    influence: Kind | None = None,
) -> Verdict:
    """The verdict on loads from any source: which statuses they imply wrongly, and their errors.

    scene : the scene whose asperities carry the loads
    loads : (n,) [force] the loads in the order of the scene's asperities
    approach [length] or load [force] : the prescribed quantity, exactly one
    within : largest error allowed: of a load, as a fraction of the largest load; of the sum, as a
        fraction of a prescribed total. `within=1` checks little more than which asperities touch
    floor  : [force] a load from -floor to floor counts as 0: its asperity is claimed to be open
    influence : compliance operator, as for `press`

    The errors are bounded by certificates (docs/theory/certificate.md, "The bound"). Raises
    InputError if the number of loads is wrong, if a load is not finite, or if a load is less than
    -floor.

    >>> claimed = contact.loads.copy()
    >>> claimed[3] = 0.0
    >>> verdict = cr.verify(scene, claimed, approach=5e-5)
    >>> verdict.holds, verdict.wrongly_open.tolist()
    (False, [3])
    """
    checks.instance("scene", scene, Scene)
    problem = NormalProblem.assemble(scene, approach=approach, load=load, influence=influence)
    return verify_on(problem, loads, within=within, floor=floor)


def verify_on(
    problem: NormalProblem,
    loads: ArrayLike,
    *,
    within: float = WITHIN,
    floor: float = 0.0,
    solved: bool = False,
) -> Verdict:
    """The verdict of `verify` for an assembled problem; if `solved`, with a `solution` even if the
    certificate proves the whole claim."""
    floor = checks.between("floor", floor, 0, checks.LARGEST)
    within = tolerance("within", within)
    given = checks.array("loads", loads, length=len(problem.scene))
    if (given < -floor).any():
        first = int(np.argmax(given < -floor))
        expected = "a load that is not negative; a floor lets noise below it count as 0"
        if given.max() <= floor:
            expected = "compression to be positive; no load is positive: is the sign reversed?"
        raise InputError(f"loads[{first}]", found=given[first], expected=expected)
    claimed = np.where(given > floor, given, 0.0)
    total = None if problem.load is None else problem.load * problem.units.force
    level, trial = proved_near(problem, claimed)
    certificate = certificate_of(level, claimed, trial)
    verdict = Verdict(problem.scene, given, floor, within, total, certificate)
    if verdict.holds_by_default and not solved:
        return verdict
    near = claimed
    if level.box is not None:
        near = problem.to_scene(level.loads.value * problem.units.force)
    for start in (near, None):  # Newton's method may diverge from inaccurate loads
        try:
            found = solve(problem, start=start)
        except SolverError:
            continue
        if certificate.scope != "local" or _is_solution_of(level, found):
            return replace(verdict, solution=found)
    return verdict  # without a solution, only the certificate of the loads proves statuses


def _is_solution_of(level: Level, contact: Contact) -> bool:
    """True if the contact is proved to lie in the box of the level, which has one solution."""
    problem, box, judged = level.problem, level.box, contact.certificate
    if box is None or judged.scope == "none":
        return False
    most = ((contact.loads + judged.load_errors) * (1 + SAFETY))[problem.candidates]
    inside = most <= box.loads * problem.units.force * (1 - SAFETY)
    is_open = judged.status[problem.candidates] == "open"
    return bool((is_open | (inside & ~box.fixed_open)).all())
