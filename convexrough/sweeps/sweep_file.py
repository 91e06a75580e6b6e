"""Sweep files: a scene file and a table of what varies in it, checked value by value."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Container, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from convexrough.errors import SceneFileError
from convexrough.run.scene_file import MOST_BYTES, digest, parsed
from convexrough.run.tables import read_text
from convexrough.sweeps.grid import Draw, Grid
from convexrough.sweeps.measures import MEASURES, Stages, columns
from convexrough.sweeps.sources import Source, Tables
from convexrough.version import __version__

#: Tables of a scene file that no measure of a sweep is from.
LEFT_OUT = ("history", "path", "steady", "shakedown", "gradient")


@dataclass(frozen=True)
class Plan:
    """What a sweep computes.

    identity : the SHA-256 of all that its numbers depend on
    said     : what it was read from, for its manifest
    """

    source: Source
    measures: tuple[str, ...]
    stages: Stages
    identity: str
    said: Mapping[str, Any]

    @property
    def columns(self) -> list[str]:
        """Those of the table."""
        labels = list(self.source.labels(range(0)))
        return ["scene", *labels, "status", "message", *columns(self.measures, self.stages)]


def read_sweep(path: str | os.PathLike[str], measure: Sequence[str] | None = None) -> Plan:
    """Read and check a sweep file.

    measure : instead of what the file measures

    Raises FileError where it cannot be read or is no TOML, and SceneFileError with every mistake.
    """
    path = Path(path)
    text = read_text(path, MOST_BYTES)
    return plan_of(parsed(path, text), path, measure, text)


def plan_of(
    contents: Mapping[str, Any], path: Path, measure: Sequence[str] | None = None, text: str = ""
) -> Plan:
    """The plan of the tables of a sweep file.

    path : of the file, for messages and for what paths in it are relative to

    Raises SceneFileError.
    """
    from convexrough.sweeps.sweep_schema import checked

    tables = {name: table for name, table in contents.items() if name != "sweep"}
    keys, mistakes = checked(contents.get("sweep"), measure)
    if keys is None:
        raise SceneFileError(str(path), mistakes)
    grid = Grid(
        tables=tables,
        together=tuple((key, tuple(values)) for key, values in keys.together.items()),
        over=tuple((key, tuple(values)) for key, values in keys.over.items()),
        draws=tuple(Draw(key, *law) for key, law in keys.laws()),
        seeds=keys.all_seeds(),
    )
    mistakes = [
        *_mistakes_of_tables(tables),
        *_mistakes_of_values(grid),
        *_mistakes_of_seeds(grid),
    ]
    if mistakes:
        raise SceneFileError(str(path), mistakes)
    stages = _stages(tables)
    mistakes = list(mistakes_of_measures(keys.measure, stages, tables))
    if mistakes:
        raise SceneFileError(str(path), mistakes)
    inputs = {each: digest(path.parent / each) for each in sorted(_summit_files(grid))}
    said = {"source": str(path), "text": text, "inputs": inputs}
    swept = [list(each.items()) for each in (keys.together, keys.over, keys.draw)]  # in order
    identity = identified(
        tables=tables, swept=swept, seeds=keys.seeds, measure=list(keys.measure), inputs=inputs
    )
    return Plan(Tables(grid, path), tuple(keys.measure), stages, identity, said)


def identified(**contents: Any) -> str:
    """The SHA-256 of all that the numbers of a sweep depend on; this package is part of it."""
    text = json.dumps({"version": __version__, **contents}, sort_keys=True, default=repr)
    return hashlib.sha256(text.encode()).hexdigest()


def _mistakes_of_tables(tables: Mapping[str, Any]) -> Iterator[str]:
    """Nothing that a file asks for is left out in silence."""
    for name in LEFT_OUT:
        if name in tables:
            yield f"[{name}]: not computed in a sweep; `convexrough run` computes it of one scene"


def _mistakes_of_values(grid: Grid) -> Iterator[str]:
    """Every value is checked among the first ones of all other keys, so once."""
    from convexrough.run.study import validate

    first = grid.point(0)
    _, mistakes = validate(grid.with_values(*first))
    if mistakes:
        yield from mistakes
        return
    for where, axes in (("together", grid.together), ("over", grid.over)):
        for key, values in axes:
            for i, value in enumerate(values[1:], 1):
                point = first._replace(values={**first.values, key: value})
                _, mistakes = validate(grid.with_values(*point))
                yield from (f'[sweep.{where}] "{key}"[{i}]: {mistake}' for mistake in mistakes)


def _mistakes_of_seeds(grid: Grid) -> Iterator[str]:
    """Seeds of nothing random would compute one scene many times."""
    rough = {"height_std", "tip_radius_cv"}
    table = grid.tables.get("asperities", {})
    swept = {key.partition(".")[2] for key in grid.keys if key.startswith("asperities.")}
    random = bool(grid.draws) or bool(rough & (set(table) | swept))
    if grid.seeds is not None and not random:
        yield "[sweep] seeds: nothing is random: no height_std, no tip_radius_cv, no [sweep.draw]"


def _stages(tables: Mapping[str, Any]) -> Stages:
    """Those of tables that have been checked."""
    cycle, shear = tables.get("cycle"), tables.get("shear")
    pairs: tuple[tuple[float, float], ...] = ()
    if cycle is not None:
        maxima = [float(value) for value in cycle["maximum"]]
        minima = [float(value) for value in cycle.get("minimum", [-value for value in maxima])]
        pairs = tuple(zip(minima, maxima, strict=True))
    return Stages(pairs, tuple(map(float, shear["fractions"])) if shear else ())


def mistakes_of_measures(
    measures: Sequence[str], stages: Stages, tables: Container[str]
) -> Iterator[str]:
    """Tables that are not there, and columns of one name."""
    for name in measures:
        needed = MEASURES[name].stage
        if needed and needed not in tables:
            yield f"[{needed}]: missing table, needed to measure {name}"
    names = columns(measures, stages)
    for name in sorted({each for each in names if names.count(each) > 1}):
        yield f"[sweep] measure: two columns would be named {name}"


def _summit_files(grid: Grid) -> set[str]:
    """The paths of all files of asperities."""
    key = "asperities.path"
    swept = [values for each, values in (*grid.together, *grid.over) if each == key]
    if swept:
        return {str(value) for values in swept for value in values}
    path = grid.tables.get("asperities", {}).get("path")
    return set() if path is None else {str(path)}
