"""Time, memory and true error of one task on one scene."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
import scipy  # its parts are imported when they are used

from convexrough.arrays import Array
from convexrough.bench.rows import Row
from convexrough.bench.scenes import APPROACH, REFINEMENTS, Family, scene
from convexrough.contact import Contact, press
from convexrough.errors import InputError, SolverError
from convexrough.friction.path import load_path
from convexrough.friction.shear import shear
from convexrough.friction.steady import cycle, cycles
from convexrough.influence import Kind
from convexrough.memory import MemoryRise
from convexrough.normal.problem import NormalProblem
from convexrough.run.stage import limit
from convexrough.scene.scene import Scene
from convexrough.solvers import Solution, Solver
from convexrough.threads import cores

#: Largest accepted error bound of reference loads, divided by the largest load: two roundoffs.
ACCURATE = 2.0**-52

#: Least and largest number of runs, of which the fastest counts. Between these limits, a further
#: run starts if all runs together have taken less than `patience` [s].
LEAST_RUNS, MOST_RUNS = 3, 25

#: Number of timed products (`plain_product`), of which the fastest is the unit of time.
PRODUCTS = 8

#: P and Q / f at the vertices of a load path, divided by the load at the paper's approach.
CORNERS = np.array([(0.6, 0.6, 1, 1, 0.7, 0.7, 0.5), (0, 0.3, 0.3, -0.15, -0.15, 0.2, 0.1)])

#: Amplitudes of a loss curve, divided by the friction limit.
PARTS_OF_LIMIT = np.linspace(0.02, 0.98, 49)

Make = Callable[[], Scene]


@dataclass(frozen=True)
class Attempt:
    """One point of the diagram of time against error.

    setting   : description of the settings;  settings : the solver object
    influence : compliance operator; None for the cheapest
    most      : the attempt is made for at most this many asperities
    """

    setting: str
    settings: Solver
    influence: Kind | None = None
    most: int = 10**9

    @property
    def solver(self) -> str:
        """The name of the method."""
        return ", ".join(filter(None, (self.settings.name, self.influence)))


_pressed = partial(press, approach=APPROACH)


#: The tasks that are timed at many sizes, by name: the preparation of an argument from a function
#: that makes the scene, and the function of this argument that is timed.
TASKS: dict[str, tuple[Callable[[Make], Any], Callable[[Any], object]]] = {
    "press": (lambda make: make(), _pressed),
    "from nothing": (lambda make: make, lambda make: _pressed(make())),
    "shear": (lambda make: _pressed(make()), lambda it: shear(it, force=0.5 * limit(it))),
    "loss curve": (
        lambda make: _pressed(make()),
        lambda it: cycles(it, limit(it) * PARTS_OF_LIMIT),
    ),
    "load path": (
        lambda make: _pressed(make()),
        lambda it: load_path(it.scene, loads=it.load * CORNERS[0], forces=limit(it) * CORNERS[1]),
    ),
    "gradient": (
        lambda make: cycle(it := _pressed(make()), maximum=0.5 * limit(it)),
        lambda it: it.gradient(holding="load"),
    ),
}


def reference(scene: Scene) -> Array | None:
    """(n,) [force] accurate loads; None if they are not proved accurate."""
    with suppress(SolverError):
        contact = _pressed(scene)
        if contact.certificate.load_errors.max() <= ACCURATE * contact.loads.max():
            return contact.loads
    return None


def measure_attempt(
    family: Family, scene: Scene, attempt: Attempt, right: Array | None, patience: float
) -> Row:
    """The row of an attempt, timed for `patience` [s]; without reference loads of unknown error."""
    row = Row("solve", family, len(scene), solver=attempt.solver, setting=attempt.setting)

    def solved(_: object = None) -> tuple[NormalProblem, Solution]:
        """A new problem (operators cache what they compute), and its solution."""
        problem = NormalProblem.assemble(scene, approach=APPROACH, influence=attempt.influence)
        return problem, attempt.settings.solve(problem)

    row, found = _timed(row, lambda: None, solved, patience)
    if found is None:
        return row
    problem, solution = found
    loads = np.zeros(len(scene))
    loads[problem.candidates] = solution.loads * problem.units.force  # exact, by a power of two
    error = math.nan if right is None else float(np.abs(loads - right).max() / right.max())
    touching = int(np.count_nonzero(loads))
    return replace(row, touching=touching, iterations=solution.iterations, error=error)


def measure_task(name: str, family: Family, size: int, patience: float) -> Row:
    """The row of the task `name` of `TASKS`, on a scene with about `size` asperities."""
    make, (prepare, work) = partial(scene, family, REFINEMENTS[size]), TASKS[name]
    row = Row(name, family, len(make()), product=plain_product(make()))
    row, found = _timed(row, lambda: prepare(make), work, patience)
    if isinstance(found, Contact):
        touching, largest = int(np.count_nonzero(found.loads)), float(found.loads.max())
        row = replace(row, touching=touching, bound=found.certificate.load_error / largest)
    return row


def measure_sweep(size: int, scenes: int, workers: int) -> Row:
    """The row of a sweep over random heights with a cycle of each scene; the time is per scene."""
    from convexrough.sweeps.sweep import sweep

    a = 1.0 / REFINEMENTS[size]
    lattice = {"pattern": "hexagonal", "spacing": 0.0025 * a, "tip_radius": 0.02 * a}
    file = {
        "sphere": {"radius": 1.0},
        "material": {"contact_modulus": 1.0, "poisson_ratio": 0.3},
        "asperities": {**lattice, "within": 0.0102, "height_std": 1e-6 * a},
        "normal": {"load": 3.6e-7},
        "friction": {"coefficient": 0.5},
        "cycle": {"maximum_fraction": [0.37]},
        "sweep": {"seeds": scenes, "measure": ["contact", "loss"]},
    }
    began = time.perf_counter()
    statuses = sweep(file, workers=workers).read(["status"])["status"]
    seconds = (time.perf_counter() - began) / scenes
    said = f"{scenes:,} scenes, {np.sum(statuses == 'certified'):,} certified, processes: {workers}"
    return Row("sweep", "rough", size, message=said, seconds=seconds, runs=1)


def _timed(
    row: Row, prepare: Callable[[], Any], work: Callable[[Any], Any], patience: float
) -> tuple[Row, Any]:
    """The row with the time [s] of the fastest run, and what the first run found."""
    memory, times = MemoryRise(), list[float]()
    try:
        found = work(prepare())
        risen = memory.risen()
        while len(times) < LEAST_RUNS or (sum(times) < patience and len(times) < MOST_RUNS):
            given = prepare()
            began = time.perf_counter()
            work(given)
            times.append(time.perf_counter() - began)
    except (InputError, SolverError) as error:
        outcome: Any = "refused" if isinstance(error, InputError) else "failed"
        return replace(row, outcome=outcome, message=str(error)), None
    return replace(row, seconds=min(times), runs=len(times), memory=risen), found


def plain_product(scene: Scene) -> float:
    """[s] the time of the transforms of one product with the lattice operator; nan without one.

    They are scipy's, in float64 on all cores, on a grid twice as wide and high as the lattice.
    """
    if scene.asperities.layout.sites is None:
        return math.nan
    shape = np.ptp(scene.asperities.layout.sites, axis=0) + 1
    size = [scipy.fft.next_fast_len(2 * int(length) - 1, real=True) for length in shape]
    field, spectrum = np.ones(shape), np.ones((size[0], size[1] // 2 + 1))

    def product() -> float:
        began = time.perf_counter()
        waves = scipy.fft.rfft2(field, size, workers=cores())
        waves *= spectrum
        scipy.fft.irfft2(waves, size, workers=cores())
        return time.perf_counter() - began

    product()
    return min(product() for _ in range(PRODUCTS))
