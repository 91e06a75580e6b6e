"""The list of measurements, a description of the machine, and the files with the results."""

from __future__ import annotations

import os
import platform
import time
from contextlib import suppress
from dataclasses import fields, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from convexrough.atomic import write_text
from convexrough.bench import measure
from convexrough.bench.measure import Attempt
from convexrough.bench.rows import Bench, Row, better_than_default, page_text
from convexrough.bench.scenes import APPROACH, REFINEMENTS, Family, scene
from convexrough.contact import press
from convexrough.errors import InputError, SolverError, file_errors
from convexrough.influence import Kind
from convexrough.normal.problem import NormalProblem
from convexrough.progress import LOGGER
from convexrough.run.results import Writer, versions
from convexrough.solvers import BristleQP, Conic, ConicCVXPY, Newton, Solver
from convexrough.threads import cores

Sizes = tuple[tuple[Family, int], ...]

#: The default solver and those that seem faster are timed again this many times.
ROUNDS = 4

#: Compliance operators for Newton's method, with the largest number of asperities for each.
COUPLINGS: dict[Kind | None, int] = {None: 10**9, "dense": 2_000, "lattice": 10**9,
                                     "scattered": 10**9}  # fmt: skip

#: Largest number of asperities for cone and quadratic programs, whose memory grows as the square of
#: this number.
PROGRAMS = 1_000


def _of(family: Family, *sizes: int) -> Sizes:
    return tuple((family, size) for size in sizes)


#: Families and sizes of the scenes on which all solvers are compared. Reference loads of large
#: scattered scenes are not proved accurate enough.
WORK = (*_of("lattice", 61, 700, 8_400), *_of("rough", 8_400))

#: Scenes on which a press with the default solver is timed.
PRESSES = (
    *_of("lattice", 61, 700, 13_000, 36_000, 120_000, 330_000, 1_300_000, 5_200_000),
    *_of("rough", 13_000, 36_000, 120_000, 330_000, 1_300_000),
    *_of("scattered", 13_000, 36_000, 120_000, 330_000),
)

#: Families and sizes of the scenes on which the tasks that follow a press are timed.
FOLLOWING = {
    "shear": _of("lattice", 61, 700, 36_000, 120_000, 330_000),
    "loss curve": _of("lattice", 61, 700, 120_000),
    "load path": (*_of("lattice", 61, 700, 120_000), *_of("rough", 120_000)),
    "gradient": _of("lattice", 700, 36_000, 330_000),
}

#: Sweeps: number of asperities in each scene, number of scenes, number of processes.
SWEEPS = ((61, 10_000, 1), (61, 10_000, 2), (700, 500, 1), (700, 500, 2))

#: A quick run leaves out presses of more than QUICK asperities, compares solvers on three scenes
#: only, and runs only the first sweep, with 1 / PART of its scenes.
QUICK, PART = 20_000, 20

#: Variables that limit the threads of linear algebra.
THREADS = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")


def attempts(quick: bool) -> list[Attempt]:
    """All solvers at several tolerances; others than Newton's with and without a Newton step."""
    found, every = [Attempt("default", Newton())], 2 if quick else 1
    solver: Solver
    for kind, most in COUPLINGS.items():
        for power in (2, 4, 8, 12)[::every]:
            solver = Newton(tolerance=10.0**-power)
            found.append(Attempt(f"tolerance 1e-{power}", solver, kind, most))
    for step in (True, False):
        for power in (3, 6, 9, 11)[::every]:
            for cones in (Conic, ConicCVXPY):
                solver = cones(10.0**-power, newton_step=step)
                found.append(Attempt(f"tolerance 1e-{power}", solver, most=PROGRAMS))
        for rows, power in ((16, 4), (16, 6), (64, 6), (256, 6))[::every]:
            solver = BristleQP(rows, newton_step=step, tolerance=10.0**-power)
            setting = f"{rows} bristles, tolerance 1e-{power}"
            found.append(Attempt(setting, solver, most=PROGRAMS))
    return found


def run(*, quick: bool) -> Bench:
    """The results of all measurements or, if `quick`, of a part of them."""
    patience = 0.1 if quick else 1.0
    began, machine, rows = time.perf_counter(), describe_machine(), list[Row]()
    for solver in (Newton(), Conic(), ConicCVXPY(), BristleQP()):  # excludes imports from times
        with suppress(InputError, SolverError):  # `_panel` reports such errors
            press(scene("lattice", 1.0), approach=APPROACH, solver=solver)
    for family, size in WORK[:3] if quick else WORK:
        rows += _panel(family, size, quick, patience)
    for task, sizes in {"press": PRESSES, "from nothing": PRESSES, **FOLLOWING}.items():
        for family, size in sizes:
            if size <= QUICK or not quick:
                LOGGER.info(f"{task}: {family}, about {size:,}")
                rows.append(measure.measure_task(task, family, size, patience))
    for size, scenes, workers in SWEEPS[:1] if quick else SWEEPS:
        LOGGER.info(f"sweep: scenes of about {size:,}")
        rows.append(measure.measure_sweep(size, scenes // PART if quick else scenes, workers))
    return Bench(machine, quick, tuple(rows), time.perf_counter() - began)


def _panel(family: Family, size: int, quick: bool, patience: float) -> list[Row]:
    """The rows of the attempts on one scene; apparently faster attempts are timed again."""
    LOGGER.info(f"{family}, about {size:,}: reference")
    each, rows = scene(family, REFINEMENTS[size]), list[Row]()
    usual = NormalProblem.assemble(each, approach=APPROACH).influence.name
    right = measure.reference(each)
    fitting = [attempt for attempt in attempts(quick) if len(each) <= attempt.most]
    tried = [attempt for attempt in fitting if attempt.influence != usual]  # it is that of None
    for attempt in tried:
        LOGGER.info(f"{family}, about {size:,}: {attempt.solver}, {attempt.setting}")
        rows.append(measure.measure_attempt(family, each, attempt, right, patience))
    for _ in range(ROUNDS):
        better = better_than_default(rows)
        for i, row in enumerate(rows):
            if better and (row.default or row in better):
                again = measure.measure_attempt(family, each, tried[i], None, patience)
                if again.outcome == "answered":
                    rows[i] = replace(row, seconds=min(row.seconds, again.seconds))
    return rows


def describe_machine() -> dict[str, Any]:
    """Processor, memory [bytes], threads, versions, date, and current load of the machine."""
    import psutil

    cpu, named = Path("/proc/cpuinfo"), list[str]()
    with suppress(OSError):
        lines = cpu.read_text().splitlines()
        named = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    limits = [f"{name}={os.environ[name]}" for name in THREADS if name in os.environ]
    return {
        "processor": named[0] if named else platform.processor() or "unknown",
        "cores": cores(),
        "memory": psutil.virtual_memory().total,
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        "versions": versions(),
        "linear_algebra_threads": ", ".join(limits) or "not limited",
        "date": datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC"),
        "load_average": os.getloadavg()[0] if hasattr(os, "getloadavg") else None,
    }


def write_bench(new: Writer, bench: Bench, *, figures: bool, page: Path | None) -> None:
    """Write bench.json, rows.csv and the figures, and the results into `page`, if one is given."""
    new.summary("bench.json", bench.summary())
    new.tables({"rows": {it.name: [getattr(row, it.name) for row in bench.rows]
                         for it in fields(Row)}})  # fmt: skip
    if not figures and page is None:
        return
    from convexrough.bench.figures import cost_figure, work_figure  # matplotlib: only when it draws

    both = {"work-precision": work_figure(bench), "cost": cost_figure(bench)}
    if figures:
        new.figures(both)
    if page is not None:
        text = page_text(page, bench)
        with file_errors(pictures := page.parent / "figures", "be made"):
            pictures.mkdir(exist_ok=True)
        pictured = Writer(pictures, pictures)
        pictured.figures(both)
        new.files += [*pictured.files, write_text(page, text)]
