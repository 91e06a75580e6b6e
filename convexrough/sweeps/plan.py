"""What a sweep computes: its scenes, the columns of its table, and the manifest of its folder."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from numpy.typing import ArrayLike

from convexrough import checks
from convexrough.errors import InputError, MistakesError, blamed_on
from convexrough.run.scene_file import Task, digest, read_text, tables_of
from convexrough.run.stage import Stage
from convexrough.run.stages import CycleStage, NormalStage, ShearStage
from convexrough.run.study import RANDOM, Study, validate, validate_table
from convexrough.scene.scene import Scene
from convexrough.solvers import Newton
from convexrough.sweeps.batch import VERSIONS, Batch, Source, Tables, Tasks
from convexrough.sweeps.folder import SCHEMA
from convexrough.sweeps.grid import WHERE, Grid, swept, table_in, with_values
from convexrough.sweeps.measures import FAILURES, MEASURE, Column, Stages, chosen, unit
from convexrough.tabular.units import UnitNames
from convexrough.version import __version__

#: A batch has at most MOST_SCENES scenes and about MOST_ASPERITIES asperities. There are about
#: LEAST_BATCHES batches or more, if there are enough scenes. At most TRIED scenes, the
#: first and the last among them, are tried until each number to be measured is found.
MOST_SCENES, MOST_ASPERITIES, LEAST_BATCHES, TRIED = 1000, 100_000, 32, 5


@dataclass(frozen=True)
class Plan:
    """What a sweep computes: scenes from `source`, and the numbers in `columns` for each scene."""

    source: Source
    columns: tuple[Column, ...]
    manifest: Mapping[str, Any]  # the contents of manifest.json

    def batch(self, part: range) -> Batch:
        return Batch(self.source.part(part), self.columns, part)


def plan_of(
    what: Mapping[str, Any] | str | os.PathLike[str],
    path: Path = Path("sweep"),
    measure: Sequence[str] | None = None,
) -> Plan:
    """The plan of a sweep file, or of the tables of the sweep file at `path`; a list `measure`
    replaces that of the file.

    Raises FileError, MistakesError, InputError; and the last error if `TRIED` scenes all fail.
    """
    contents, text = what, ""
    if not isinstance(contents, Mapping):
        path = Path(contents)
        text = read_text(path)
        contents = tables_of(path, text)
    tables = {name: table for name, table in contents.items() if name != "sweep"}
    table = contents.get("sweep")
    if table is None:
        known = ", ".join(Grid.model_fields)
        raise MistakesError(path, [f"[sweep]: missing table; its keys are: {known}"])
    if measure is not None and isinstance(table, dict):
        table = {**table, "measure": list(measure)}
    grid, mistakes = validate_table("sweep", table, Grid)
    random = [*_nothing_random(contents)]
    if grid is None:
        varied = {key.partition(".")[0] for _, key in swept(table_in(contents, "sweep"))}
        others = validate({name: it for name, it in tables.items() if name not in varied})[1]
        unknown = ["missing table"]
        if "seeds" in table_in(contents, "sweep"):
            unknown.append("[asperities] seed: missing")
        rest = [each for each in others if not any(it in each for it in unknown)]
        raise MistakesError(path, [*mistakes, *random, *rest])
    study, mistakes = _of_values(grid, tables)
    if study is None or mistakes or random:
        raise MistakesError(path, [*mistakes, *random])
    own = [tables.get("asperities", {}).get("path")]
    files = {str(each) for each in grid.axes.get("asperities.path", own) if each is not None}
    inputs = {each: digest(path.parent / each) for each in sorted(files)}
    said = {"source": str(path), "text": text, "inputs": inputs}
    lists = [list(getattr(grid, where).items()) for where in WHERE]  # in order
    given = {"tables": tables, "swept": lists, "seeds": grid.seeds, "inputs": inputs}
    return _planned(
        Tables(grid, tables, path, inputs), grid.measure, said, study.units.names, **given
    )


def _nothing_random(contents: Mapping[str, Any]) -> Iterator[str]:
    """Yield a mistake if there are seeds, but nothing is random."""
    table = table_in(contents, "sweep")
    given = {*table_in(contents, "asperities")}
    given |= {key.removeprefix("asperities.") for _, key in swept(table)}
    if "seeds" in table and not table.get("draw") and given.isdisjoint(RANDOM):
        yield (
            "[sweep] seeds: nothing is random: expected height_std or tip_radius_cv in "
            "[asperities], or a table [sweep.draw]"
        )


def _of_values(grid: Grid, tables: Mapping[str, Any]) -> tuple[Study | None, list[str]]:
    """The checked tables of the first scene (None if wrong), and all mistakes in swept values."""
    first, seed = grid.point(0)
    study, mistakes = validate(with_values(tables, first, seed))
    axes = [("together", grid.together), *(("over", {key: it}) for key, it in grid.over.items())]
    for where, lists in axes:
        mistakes = [_placed(each, where, lists, 0) for each in mistakes]
        rows = list(zip(*lists.values(), strict=True)) if study else []
        for i, row in enumerate(rows[1:], 1):
            values = {**first, **dict(zip(lists, row, strict=True))}
            _, wrong = validate(with_values(tables, values, seed))
            mistakes += [_placed(each, where, lists, i) for each in wrong]
    return study, grid.blame(mistakes, seed)


def _placed(mistake: str, where: str, keys: Iterable[str], i: int) -> str:
    """The mistake with its place in [sweep]: the i-th value of the key that it names, or of all
    keys; for i = 0, unchanged if it names none."""
    names = {key: "[{}] {}".format(*key.split(".", 1)) for key in keys}
    own = [key for key, it in names.items() if mistake.startswith((f"{it}:", f"{it}[", f"{it}."))]
    places = ", ".join(f"{where}.{key}[{i}]" for key in own or (keys if i else ()))
    return f"[sweep] {places}: {mistake}" if places else mistake


def plan_of_scenes(
    scenes: Iterable[Scene],
    measure: Sequence[str] | None,
    approach: ArrayLike | None,
    load: ArrayLike | None,
    cycle: Sequence[float],
    shear: Sequence[float],
) -> Plan:
    """The plan for scenes made in Python; arguments as for `sweep`. Raises InputError."""
    stages = _stages(cycle, shear)
    checks.sequence("scenes", scenes, "a list of scenes, or a sweep file")
    scenes = tuple(scenes)
    for i, scene in enumerate(scenes):
        checks.instance(f"scenes[{i}]", scene, Scene)
    checks.some("scenes", scenes)
    name, control = checks.exactly_one("approach", approach, "load", load)
    controls = checks.array(name, control, length=len(scenes), one="scene").tolist()
    expected = 'a list of numbers of a summary, such as ["load"]'
    checks.sequence("measure", measure, expected)
    measures = [] if measure is None else [*measure]
    if not measures or not all(isinstance(name, str) for name in measures):
        raise InputError("measure", found=checks.shown(measures), expected=expected)
    measures = list(dict.fromkeys(measures))
    content, tasks = hashlib.sha256(), dict[int, Task]()
    common: Any = {"approach": None, "load": None, "stages": stages, "solver": Newton()}
    for number, (scene, control) in enumerate(zip(scenes, controls, strict=True)):
        layout = scene.asperities
        for values in (layout.positions, layout.tip_radii, layout.heights):
            content.update(values.tobytes())
        numbers = (scene.sphere_radius, scene.material, scene.friction)
        content.update(f"{numbers}{scene.geometry} {len(scene)}".encode())
        tasks[number] = Task(scene=scene, **common | {name: control})
    given = {"scenes": content.hexdigest(), name: controls, "stages": repr(stages)}
    said = {"source": "scenes made in Python"}
    return _planned(Tasks(tasks, name), measures, said, UnitNames(), **given)


def _stages(cycle: Sequence[float], shear: Sequence[float]) -> Stages:
    found: dict[str, Stage] = {"normal": NormalStage(approach=0.0)}
    models: list[tuple[type[Stage], str, Sequence[float]]]
    models = [(ShearStage, "fractions", shear), (CycleStage, "maximum_fraction", cycle)]
    for model, key, values in models:
        checks.sequence(model.name, values, "a list of fractions of f P")
        if len(values):
            given = checks.array(model.name, values).tolist()
            table, mistakes = validate_table(model.name, {key: given}, model)
            if table is None:
                raise MistakesError("sweep", mistakes)
            found[model.name] = table
    return found


def _planned(
    source: Source, measures: Sequence[str], said: Mapping[str, Any], units: UnitNames, **given: Any
) -> Plan:
    """The plan for the scenes of `source`. Scenes that are tried show which numbers exist.

    said  : entries of the manifest that describe the origin of the sweep
    given : all input on which the measured numbers depend, except `measures` and the version
    """
    tried = sorted({(source.count - 1) * k // (TRIED - 1) for k in range(TRIED)})
    ask = source.opened()
    wrong: Exception | None = None
    with blamed_on(said["source"], unless_known=True):
        for number in tried:
            try:
                asked = ask(number)
                contact = asked.press()
                columns = chosen(contact, asked.stages, measures)
                break
            except FAILURES as error:
                if wrong is None or getattr(error, "what", "") == MEASURE:
                    wrong = error
        else:
            assert wrong is not None  # `tried` is not empty
            raise wrong
    few = -(-source.count // LEAST_BATCHES)
    contents = {"version": __version__, "measure": list(measures), **given}
    inputs = hashlib.sha256(json.dumps(contents, sort_keys=True, default=repr).encode())
    grid = source.grid if isinstance(source, Tables) else None
    labels = list(source.labels(range(0)))
    columns = tuple(it for it in columns if it.name not in labels)  # a swept key has a column
    numbers = {key: key for key in labels} | {it.name: it.number for it in columns}
    used = {"normal", *(column.stage for column in columns)}
    manifest = {
        "schema": SCHEMA,
        "version": __version__,
        "sweep": inputs.hexdigest(),
        "scenes": source.count,
        "each": grid.each if grid else 1,  # number of scenes that differ only in the seed
        "batch": max(1, min(MOST_SCENES, MOST_ASPERITIES // len(contact.scene), few)),
        "columns": ["scene", *labels, "status", "message", *(it.name for it in columns)],
        "drawn": [*grid.draw] if grid else [],
        "not_measured": [name for name in asked.stages if name not in used],
        "units": {name: it for name, end in numbers.items() if (it := unit(end, units))},
        **said,
        "versions": VERSIONS,
    }
    return Plan(source, columns, manifest)
