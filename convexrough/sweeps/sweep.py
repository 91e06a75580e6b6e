"""`sweep`: every scene of a plan measured, by whoever computes, into one table."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import Any, TypeAlias

from numpy.typing import ArrayLike

from convexrough import checks
from convexrough.errors import InputError, MistakesError
from convexrough.progress import Announce
from convexrough.scene.scene import Scene
from convexrough.sweeps.engines import Given, processes
from convexrough.sweeps.measures import Stages
from convexrough.sweeps.running import run
from convexrough.sweeps.sources import Objects
from convexrough.sweeps.sweep_file import (
    Plan,
    identified,
    mistakes_of_measures,
    plan_of,
    read_sweep,
)
from convexrough.sweeps.sweep_schema import of_measures
from convexrough.sweeps.table import SweepTable

#: A file, its contents, or scenes.
What: TypeAlias = str | os.PathLike[str] | Mapping[str, Any] | Iterable[Scene]


def sweep(
    what: What,
    *,
    measure: Sequence[str] | None = None,
    out: str | os.PathLike[str] | None = None,
    executor: Executor | None = None,
    workers: int | None = None,
    resume: bool = False,
    part: tuple[int, int] | None = None,
    approach: ArrayLike | None = None,
    load: ArrayLike | None = None,
    cycle: Sequence[float] = (),
    shear: Sequence[float] = (),
    announce: Announce | None = None,
) -> SweepTable:
    """Measure many scenes.

    what     : a sweep file; or the tables of one, as a mapping; or scenes, with `approach` [length]
        or `load` [force], one for all or one for each, and the amplitudes of `cycle` and forces of
        `shear` as fractions of f P
    measure  : what to measure, by name; of a file, instead of what it says
    out      : folder for the results; default: they are returned only
    executor : who computes, any executor of `concurrent.futures`; default: processes
    workers  : how many processes; default: as many as there are processors
    resume   : go on with what is in the folder
    part     : (k, n), the k-th of n parts of the sweep, from 1
    announce : told in a line how far the work has come

    The table is the same, bit for bit, whoever computes it in whatever order and in how many
    sittings. A scene that fails has a row that says why.

    Raises FileError and InputError for what is wrong before anything is computed, and WorkerError
    where nobody is left to compute.

    >>> scenes = [cr.Scene(R, scene.asperities, scene.material) for R in (0.9, 1.0, 1.1)]
    >>> table = cr.sweep(scenes, approach=5e-5, measure=["contacts", "load"], workers=1)
    >>> print(table.read()["contacts"])
    [37. 37. 43.]
    """
    given = {"approach": approach, "load": load, "cycle": cycle or None, "shear": shear or None}
    if isinstance(what, (str, os.PathLike, Mapping)):
        for name, value in given.items():
            if value is not None:
                raise InputError(name, found="given", expected="in the tables of the sweep")
        plan = _of_tables(what, measure)
    else:
        plan = _of_scenes(what, measure, approach, load, _stages(cycle, shear))
    asked: Any = dict(out=out, resume=resume, part=part, announce=announce)
    if executor is not None:
        checks.instance("executor", executor, Executor)
        return run(plan, Given(executor), **asked).table
    if workers is not None and workers < 1:
        raise InputError("workers", found=workers, expected="at least one process")
    with processes(workers) as engine:
        return run(plan, engine, **asked).table


def _of_tables(what: str | os.PathLike[str] | Mapping[str, Any], measure: Any) -> Plan:
    if isinstance(what, Mapping):
        return plan_of(what, Path("sweep"), measure)
    return read_sweep(what, measure)


def _stages(cycle: Sequence[float], shear: Sequence[float]) -> Stages:
    amplitudes = checks.array("cycle", cycle, sign="positive").tolist()
    forces = checks.array("shear", shear, sign="not negative").tolist()
    for name, values in (("cycle", amplitudes), ("shear", forces)):
        for i, value in enumerate(values):
            checks.between(f"{name}[{i}]", value, 0.0, 1.0)
    return Stages(tuple((-value, value) for value in amplitudes), tuple(forces))


def _of_scenes(
    what: Iterable[Scene],
    measure: Sequence[str] | None,
    approach: ArrayLike | None,
    load: ArrayLike | None,
    stages: Stages,
) -> Plan:
    scenes = tuple(what)
    for i, scene in enumerate(scenes):
        checks.instance(f"scenes[{i}]", scene, Scene)
    if not scenes:
        raise InputError("scenes", found="none", expected="at least one")
    checks.exactly_one("approach", approach, "load", load)
    by_load = load is not None
    name, given = ("load", load) if by_load else ("approach", approach)
    assert given is not None  # exactly_one
    controls = checks.array(name, given, length=len(scenes), one="scene")
    names = tuple(measure or ())
    tables = {"cycle": stages.cycle, "shear": stages.shear, "friction": True}
    asked = {key for key, value in tables.items() if value}
    mistakes = [*of_measures(names)] or [*mistakes_of_measures(names, stages, asked)]
    if mistakes:
        raise MistakesError("sweep", mistakes)
    content = hashlib.sha256()
    for scene in scenes:
        layout, material = scene.asperities, scene.material
        for values in (layout.positions, layout.tip_radii, layout.heights):
            content.update(values.tobytes())
        content.update(repr((scene.sphere_radius, material, scene.friction)).encode())
        content.update(f"{scene.geometry} {len(scene)}".encode())
    identity = identified(
        scenes=content.hexdigest(),
        **{name: controls.tolist()},
        measure=names,
        stages=[stages.cycle, stages.shear],
    )
    source = Objects(scenes, controls, by_load)
    return Plan(source, names, stages, identity, {"source": "scenes made in Python"})
