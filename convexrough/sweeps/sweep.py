"""`sweep`: compute many scenes in local processes or with any executor, and return a table."""

from __future__ import annotations

import hashlib
import os
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from datetime import timedelta
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from convexrough import checks
from convexrough.errors import InputError, MistakesError
from convexrough.progress import LOGGER
from convexrough.run.stage import Stage
from convexrough.scene.scene import Scene
from convexrough.sweeps.batch import Columns, table
from convexrough.sweeps.folder import make_folder
from convexrough.sweeps.measures import Stages
from convexrough.sweeps.plan import Plan, planned
from convexrough.sweeps.pool import Processes, computed
from convexrough.sweeps.scenes import Objects
from convexrough.sweeps.table import SweepTable
from convexrough.tabular.units import UnitNames

#: What `sweep` computes: a sweep file, the tables of one, or scenes.
What: TypeAlias = str | os.PathLike[str] | Mapping[str, Any] | Iterable[Scene]

#: Largest number of scenes that one call computes; larger sweeps are computed in parts.
MOST = 10**8


def sweep(
    what: What,
    *,
    measure: Sequence[str] | None = None,
    out: str | os.PathLike[str] | None = None,
    executor: Executor | None = None,
    workers: int | None = None,
    resume: bool = False,
    overwrite: bool = False,
    part: tuple[int, int] | None = None,
    approach: ArrayLike | None = None,
    load: ArrayLike | None = None,
    cycle: Sequence[float] = (),
    shear: Sequence[float] = (),
) -> SweepTable:
    """A table with a row for each of many scenes, and a column for each measured number.

    what     : a sweep file; or its tables, as a mapping; or scenes
    approach, load : only if `what` is scenes: either approaches [length] or loads [force], one
        number for all scenes or one for each
    cycle, shear : only if `what` is scenes: amplitudes of cycles and shear forces, as fractions of
        the friction limit (coefficient of friction times load)
    measure  : names of numbers in summary.json, such as "cycle.loss", or their last parts ("loss");
        replaces the list of a sweep file
    out      : folder for the results; default: they are only returned
    executor : any executor of `concurrent.futures`; default: processes
    workers  : number of processes; default: number of processors
    resume   : continue an interrupted sweep in the folder;  overwrite : compute it again
    part     : (k, n): compute only the k-th of n shares of the scenes, counted from 1

    The table is the same, bit for bit, for any executor, any order of computation and any number of
    interruptions. In the row of a failed scene `message` is the reason.

    Raises FileError and InputError for wrong input, before anything is computed; WorkerError if
    workers died twice while computing the same scenes, or if none is left.

    >>> scenes = [cr.Scene(R, scene.asperities, scene.material) for R in (0.9, 1.0, 1.1)]
    >>> table = cr.sweep(scenes, approach=5e-5, measure=["contact", "load"], workers=1)
    >>> print(table.read()["contact"])
    [37. 37. 43.]
    """
    given = {"approach": approach, "load": load, "cycle": cycle or None, "shear": shear or None}
    if isinstance(what, (str, os.PathLike, Mapping)):
        for name, value in given.items():
            if value is not None:
                raise InputError(name, found="given", expected="none: the sweep tables state it")
        from convexrough.sweeps.file import plan_of, read_sweep  # it loads pydantic

        if isinstance(what, Mapping):
            plan = plan_of(what, Path("sweep"), measure)
        else:
            plan = read_sweep(what, measure)
    else:
        plan = _of_scenes(what, measure, approach, load, _stages(cycle, shear))
    asked: Any = dict(out=out, resume=resume, overwrite=overwrite, part=part)
    if executor is not None:
        checks.instance("executor", executor, Executor)
        return run(plan, executor, **asked).table
    if workers is not None:
        checks.whole("workers", workers)
    with Processes(workers) as mine:
        return run(plan, mine, **asked).table


@dataclass(frozen=True)
class Done:
    """The result of `run`: a table, and how it was computed.

    found    : a message about rows that existed already, or ""
    computed : number of scenes that this call computed;  seconds : the time it took
    """

    table: SweepTable
    found: str
    computed: int
    seconds: float


def run(
    plan: Plan,
    executor: Executor,
    *,
    out: str | os.PathLike[str] | None = None,
    resume: bool = False,
    overwrite: bool = False,
    part: tuple[int, int] | None = None,
) -> Done:
    """Compute what is missing in the table of a plan; arguments as for `sweep`."""
    began, folder, found = time.monotonic(), None, ""
    todo = _share(plan, part)
    if out is not None:
        folder = make_folder(Path(out), plan.manifest, overwrite=overwrite)
        todo, found = folder.missing(todo, resume)
        LOGGER.info(found)
    count = sum(map(len, todo))
    parts = [table(plan.batch(range(0)), [])]  # no rows, all columns
    for columns in _report_progress(computed(map(plan.batch, todo), executor), count):
        if folder is None:
            parts.append(columns)
        else:
            folder.write(columns)
    seconds = time.monotonic() - began
    if folder is not None:
        return Done(SweepTable(folder.manifest, folder), found, count, seconds)
    joined = {name: np.concatenate([each[name] for each in parts]) for name in parts[0]}
    order = np.argsort(joined["scene"])
    rows = {name: values[order] for name, values in joined.items()}
    return Done(SweepTable(plan.manifest, None, rows), found, count, seconds)


def _share(plan: Plan, part: tuple[int, int] | None) -> list[range]:
    """The parts that job k of n computes, each as a range of scenes; without `part`, all."""
    given: Any = (1, 1) if part is None else part
    if not isinstance(given, tuple) or len(given) != 2:
        raise InputError("part", found=repr(part), expected="(K, N) with K from 1 to N")
    k, n = given
    if not 1 <= k <= n:
        raise InputError("part", found=f"{k}/{n}", expected="K/N with K from 1 to N")
    first, stop = plan.parts * (k - 1) // n, plan.parts * k // n
    if (count := (stop - first) * plan.size) > MOST:
        expected = f"at most {MOST:,} at once: compute the sweep in parts (K/N)"
        where = str(plan.manifest["source"])
        raise InputError("scenes", found=f"about {count:,}", expected=expected, where=where)
    return [plan.part(number) for number in range(first, stop)]


def _report_progress(found: Iterator[Columns], count: int) -> Iterator[Columns]:
    """Yield `found` unchanged, and log the progress."""
    began, done, failed = time.monotonic(), 0, 0
    for columns in found:
        yield columns
        done += len(columns["status"])
        failed += int(np.count_nonzero(columns["status"] == "failed"))
        rate = done / max(time.monotonic() - began, 1e-9)
        left = timedelta(seconds=round((count - done) / rate))
        said = f"{done:,} of {count:,} scenes, {rate:,.3g} per second, {left} left"
        LOGGER.info(said + (f", {failed:,} failed" if failed else ""))


def _stages(cycle: Sequence[float], shear: Sequence[float]) -> Stages:
    from convexrough.run.stages import CycleStage, NormalStage, ShearStage
    from convexrough.run.study import validate_table

    found: dict[str, Stage] = {"normal": NormalStage(approach=0.0)}
    mistakes: list[str] = []
    models: tuple[tuple[type[Stage], str, Sequence[float]], ...]
    models = ((ShearStage, "fractions", shear), (CycleStage, "maximum_fraction", cycle))
    for model, key, values in models:
        checks.sequence(model.name, values, "a list of fractions of f P")
        if len(values):
            table, wrong = validate_table(model.name, {key: [*map(float, values)]}, model)
            mistakes += wrong
            if table is not None:
                found[model.name] = table
    if mistakes:
        raise MistakesError("sweep", mistakes)
    return found


def _of_scenes(
    what: Iterable[Scene],
    measure: Sequence[str] | None,
    approach: ArrayLike | None,
    load: ArrayLike | None,
    stages: Stages,
) -> Plan:
    checks.sequence("scenes", what, "a list of scenes, or a sweep file")
    scenes = tuple(what)
    for i, scene in enumerate(scenes):
        checks.instance(f"scenes[{i}]", scene, Scene)
    if not scenes:
        raise InputError("scenes", found="none", expected="at least one")
    checks.exactly_one("approach", approach, "load", load)
    name, control = ("approach", approach) if load is None else ("load", load)
    assert control is not None  # exactly_one
    controls = checks.array(name, control, length=len(scenes), one="scene")
    expected = 'a list of numbers of a summary, such as ["load"]'
    checks.sequence("measure", measure, expected)
    if not measure:
        raise InputError("measure", found=measure, expected=expected)
    content = hashlib.sha256()
    for scene in scenes:
        layout, material = scene.asperities, scene.material
        for values in (layout.positions, layout.tip_radii, layout.heights):
            content.update(values.tobytes())
        content.update(repr((scene.sphere_radius, material, scene.friction)).encode())
        content.update(f"{scene.geometry} {len(scene)}".encode())
    given = {"scenes": content.hexdigest(), name: controls.tolist(), "stages": repr(stages)}
    source = Objects(scenes, controls, load is not None, stages)
    return planned(source, measure, {"source": "scenes made in Python"}, UnitNames(), **given)
