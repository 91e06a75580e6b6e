"""Time, products, memory and true error of one solver on one problem."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Literal, TypeVar, cast

import numpy as np

from convexrough.arrays import Array, Indices
from convexrough.bench.reference import Reference
from convexrough.bench.scenes import APPROACH
from convexrough.contact import press
from convexrough.errors import InputError, SolverError
from convexrough.influence import Influence, Kind
from convexrough.memory import MemoryRise
from convexrough.normal.certificate import judge
from convexrough.normal.problem import NormalProblem
from convexrough.scene.scene import Scene
from convexrough.solvers import Newton, Solver

MOST_REPEATS = 25

Outcome = Literal["answered", "refused", "failed", "left out"]
Result = TypeVar("Result")


@dataclass(frozen=True)
class Attempt:
    """One point of the diagram.

    solver    : which method, in words;  setting : how it is set, in words
    settings  : the solver itself;  influence : the coupling that is asked for
    growth    : time grows about with this power of the number of asperities; what would take too
        long is not tried. None: it always is
    """

    solver: str
    setting: str
    settings: Solver
    influence: Kind | None = None
    growth: float | None = 2.0

    @property
    def default(self) -> bool:
        return self.influence is None and self.settings == Newton()


@dataclass(frozen=True)
class Row:
    """What came of it.

    outcome : "answered"; "refused": the scene is not one for this solver; "failed"; or "left out"
    message : why, where it did not answer;  expected : [s] why it was left out
    influence : the coupling that was used
    error   : max |P - P_ref| / max P_ref
    assembling, solving, certifying : [s] the least of several
    products, single : applications of A in double and in single precision
    memory  : [bytes] by which that of the process rose at most, None where unknown
    certified : every asperity has a proved word
    frontier : no other point is both faster and more accurate

    The time that counts is `seconds`, of assembling and solving: what one method computes when it
    starts another does when it is made.
    """

    solver: str
    setting: str
    default: bool
    outcome: Outcome
    message: str = ""
    expected: float = np.nan
    influence: str = ""
    error: float = np.nan
    assembling: float = np.nan
    solving: float = np.nan
    certifying: float = np.nan
    iterations: int = 0
    products: int = 0
    single: int = 0
    memory: int | None = None
    certified: bool = False
    frontier: bool = False

    @property
    def seconds(self) -> float:
        return self.assembling + self.solving

    @property
    def known(self) -> bool:
        """An answer, and its error."""
        return self.outcome == "answered" and bool(np.isfinite(self.error))


@dataclass
class Tally:
    """Applications of A, in double and in single precision."""

    double: int = 0
    single: int = 0


class Counted:
    """An influence that counts its applications; everything else is the influence's own."""

    def __init__(self, influence: Influence, tally: Tally) -> None:
        self._influence, self._tally = influence, tally

    def __getattr__(self, name: str) -> Any:
        return getattr(self._influence, name)

    def __len__(self) -> int:
        return len(self._influence)

    def apply(self, loads: Array) -> Array:
        if loads.dtype == np.float32:
            self._tally.single += 1
        else:
            self._tally.double += 1
        return self._influence.apply(loads)

    def among(self, which: Indices) -> Influence:
        return counted(self._influence.among(which), self._tally)


def counted(influence: Influence, tally: Tally) -> Influence:
    """The same operator, which counts its applications."""
    return cast("Influence", Counted(influence, tally))


def measure(scene: Scene, attempt: Attempt, reference: Reference | None, *, patience: float) -> Row:
    """One run that is counted and judged, then more for the time, as long as that is short.

    patience : [s] to repeat for
    """
    blank = Row(attempt.solver, attempt.setting, attempt.default, "answered")
    try:
        return _measure(scene, attempt, reference, patience, blank)
    except (InputError, SolverError) as error:
        reason = str(error).removeprefix(f"{attempt.settings.name}: ")
        return replace(blank, outcome=outcome_of(error), message=reason)


def outcome_of(error: InputError | SolverError) -> Outcome:
    """What it is called that there is no answer."""
    return "refused" if isinstance(error, InputError) else "failed"


def _measure(
    scene: Scene, attempt: Attempt, reference: Reference | None, patience: float, blank: Row
) -> Row:
    tally, memory = Tally(), MemoryRise()
    problem = NormalProblem.assemble(scene, approach=APPROACH, influence=attempt.influence)
    solution = attempt.settings.solve(replace(problem, influence=counted(problem.influence, tally)))
    certificate = judge(problem, problem.to_scene(solution.loads * problem.units.force))
    risen = memory.risen()

    times: list[tuple[float, float, float]] = []
    began = time.perf_counter()
    assemble = partial(
        NormalProblem.assemble, scene, approach=APPROACH, influence=attempt.influence
    )
    while not times or (time.perf_counter() - began < patience and len(times) < MOST_REPEATS):
        # A problem of its own each time: an operator keeps what it has computed once.
        fresh, assembling = timed(assemble)
        solution, solving = timed(partial(attempt.settings.solve, fresh))
        loads = fresh.to_scene(solution.loads * fresh.units.force)
        _, certifying = timed(partial(judge, fresh, loads))
        times.append((assembling, solving, certifying))
    assembling, solving, certifying = (min(each) for each in zip(*times, strict=True))
    return replace(
        blank,
        influence=problem.influence.name,
        error=np.nan if reference is None else reference.error(solution.loads),
        assembling=assembling,
        solving=solving,
        certifying=certifying,
        iterations=solution.iterations,
        products=tally.double,
        single=tally.single,
        memory=risen,
        certified=certificate.holds,
    )


@dataclass(frozen=True)
class CostRow:
    """A press of the default solver.

    outcome, message : as those of `Row`
    seconds  : [s] the whole of it, the least of several
    first    : [s] making the scene from nothing, and its first press
    product  : [s] a plain product with the coupling, `plain_product`: what times can be counted in
    assembling, solving, certifying : [s] its parts
    load_error : proved bound on the error of a load, over the largest load
    """

    family: str
    asperities: int
    outcome: Outcome
    message: str = ""
    touching: int = 0
    influence: str = ""
    seconds: float = np.nan
    first: float = np.nan
    product: float = np.nan
    assembling: float = np.nan
    solving: float = np.nan
    certifying: float = np.nan
    iterations: int = 0
    products: int = 0
    single: int = 0
    memory: int | None = None
    certified: bool = False
    scope: str = "none"
    load_error: float = np.inf


def measure_cost(family: str, make: Callable[[], Scene], *, patience: float) -> CostRow:
    """Time and memory of a scene's first `press` and of later ones; its parts; products counted."""
    scene, making = timed(make)
    try:
        return _measure_cost(family, scene, making, patience)
    except (InputError, SolverError) as error:
        return CostRow(family, len(scene), outcome_of(error), str(error))


def _measure_cost(family: str, scene: Scene, making: float, patience: float) -> CostRow:
    memory = MemoryRise()
    contact, first = timed(lambda: press(scene, approach=APPROACH))
    risen = memory.risen()
    seconds, spent, repeats = first, first, 1
    while repeats < 3 or (spent < patience and repeats < MOST_REPEATS):
        _, again = timed(lambda: press(scene, approach=APPROACH))
        seconds, spent, repeats = min(seconds, again), spent + again, repeats + 1
    row = measure(scene, Attempt("newton", "", Newton(), growth=None), None, patience=0.0)
    return CostRow(
        family=family,
        asperities=len(scene),
        outcome="answered",
        touching=int(np.count_nonzero(contact.loads)),
        influence=contact.influence,
        seconds=seconds,
        first=making + first,
        product=plain_product(scene),
        assembling=row.assembling,
        solving=row.solving,
        certifying=row.certifying,
        iterations=contact.iterations,
        products=row.products,
        single=row.single,
        memory=risen,
        certified=contact.certificate.holds,
        scope=contact.certificate.scope,
        load_error=contact.certificate.load_error / float(contact.loads.max()),
    )


def plain_product(scene: Scene) -> float:
    """[s] nothing but the transforms of a product: of float64, by all cores, as scipy has them.

    On the box of sites that holds all asperities, padded to twice its size; nan off a lattice.
    """
    from scipy import fft

    if scene.asperities.layout.sites is None:
        return np.nan
    shape = np.ptp(scene.asperities.layout.sites, axis=0) + 1
    size = [fft.next_fast_len(2 * int(length) - 1, real=True) for length in shape]
    field, spectrum = np.ones(shape), np.ones((size[0], size[1] // 2 + 1))

    def product() -> None:
        waves = fft.rfft2(field, size, workers=-1)
        waves *= spectrum
        fft.irfft2(waves, size, workers=-1)

    return min(timed(product)[1] for _ in range(3))


def timed(work: Callable[[], Result]) -> tuple[Result, float]:
    """What it returns, and the seconds it took."""
    began = time.perf_counter()
    result = work()
    return result, time.perf_counter() - began
