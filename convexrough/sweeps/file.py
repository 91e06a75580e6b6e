"""Sweep files: scene files with a table [sweep] of keys that vary."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field

from convexrough.errors import SceneFileError
from convexrough.run.scene_file import MOST_BYTES, digest, parsed
from convexrough.run.study import Study, validate, validate_table
from convexrough.run.tables import read_text
from convexrough.run.values import FileTable, Mistake, expected
from convexrough.sweeps.grid import Axis, Draw, Grid, Law
from convexrough.sweeps.plan import Plan, planned
from convexrough.sweeps.scenes import Tables

#: Tables whose keys cannot be swept, because columns are named after the fractions in them.
FIXED = ("shear", "cycle", "history")

WHERE = ("together", "over", "draw")


def _different(values: Any) -> bool:
    return bool(values) and len({repr(value) for value in values}) == len(values)


def _are_seeds(seeds: int | list[int]) -> bool:
    if isinstance(seeds, int):
        return 1 <= seeds < 2**63
    return _different(seeds) and 0 <= min(seeds) <= max(seeds) < 2**63


def _is_law(table: dict[Law, list[float]]) -> bool:
    if len(table) != 1 or not all(len(pair) == 2 for pair in table.values()):
        return False
    [(law, (first, second))] = table.items()
    if law == "lognormal":
        return first > 0 and 0 < second <= 1
    return first < second if law == "uniform" else second > 0


_NAMES = 'a list of numbers of summary.json, none of them twice, such as ["load"]'
_Names = Annotated[list[str], expected(_NAMES, _different)]
_Seeds = Annotated[
    int | list[int],
    expected("how many (1 or more), or a list of whole numbers, none of them twice", _are_seeds),
]
_Values = Annotated[list[Any], expected("a list of values, none of them twice", _different)]
_List = Annotated[list[Any], expected("a list of values", bool)]
_Laws = Annotated[
    dict[Law, list[float]],
    expected(
        "one of: uniform = [low, high] with low < high, normal = [mean, deviation > 0], "
        "lognormal = [mean > 0, coefficient of variation from 0 to 1: not in per cent]",
        _is_law,
    ),
]
_KEYS = expected('a table of keys of the scene file, such as "asperities.height_std"')


class Keys(FileTable):
    """The table [sweep]: keys that vary, and numbers to measure."""

    measure: _Names = Field(default_factory=list)
    seeds: _Seeds | None = None
    together: Annotated[dict[str, _List], _KEYS] = Field(default_factory=dict)
    over: Annotated[dict[str, _Values], _KEYS] = Field(default_factory=dict)
    draw: Annotated[dict[str, _Laws], _KEYS] = Field(default_factory=dict)

    @classmethod
    def mistakes_between(cls, keys: Mapping[str, Any]) -> Iterator[Mistake]:
        """Mistakes: keys that cannot be swept, or are swept twice, and unequal lengths of lists."""
        yield from super().mistakes_between(keys)
        if "measure" not in keys:
            yield "measure", f"missing, expected {_NAMES}"
        first: dict[str, str] = {}
        for where, key in _swept(keys):
            name, _, rest = key.partition(".")
            if not all(key.split(".")) or not rest:
                expects = 'expected a table and a key of it, such as "asperities.height_std"'
                yield f"{where}.{key}", expects
            elif name == "sweep":
                yield f"{where}.{key}", "expected a key of a scene"
            elif name in FIXED:
                yield f"{where}.{key}", f"values of [{name}] name columns, so they cannot vary"
            elif key == "asperities.seed" and "seeds" in keys:
                yield f"{where}.{key}", "swept twice, by seeds too"
            for other in first:  # a key, or a table that contains it
                if f"{key}.".startswith(f"{other}.") or other.startswith(f"{key}."):
                    yield f"{where}.{key}", f"swept twice, in [sweep.{first[other]}] {other} too"
            first[key] = where
        lists = _dict(keys.get("together")).values()
        if len(lengths := {len(each) for each in lists if isinstance(each, list)}) > 1:
            yield "together", f"found {sorted(lengths)} values, expected as many for every key"
        if keys.get("draw") and "seeds" not in keys:
            yield "seeds", "missing, needed with [sweep.draw]"

    def grid(self, tables: Mapping[str, Any]) -> Grid:
        def axes(table: Mapping[str, list[Any]]) -> tuple[Axis, ...]:
            return tuple((key, tuple(values)) for key, values in table.items())

        laws = ((key, law, pair) for key, it in self.draw.items() for law, pair in it.items())
        seeds = range(self.seeds) if isinstance(self.seeds, int) else self.seeds
        draws = tuple(Draw(key, law, *pair) for key, law, pair in laws)
        return Grid(tables, axes(self.together), axes(self.over), draws, seeds)


def read_sweep(path: str | os.PathLike[str], measure: Sequence[str] | None = None) -> Plan:
    """The plan of a sweep file, whose contents are checked.

    measure : names of numbers, which replace the list in the file

    Raises FileError if the file cannot be read or is not TOML; SceneFileError with every mistake.
    """
    path = Path(path)
    text = read_text(path, MOST_BYTES)
    return plan_of(parsed(path, text), path, measure, text)


def plan_of(
    contents: Mapping[str, Any], path: Path, measure: Sequence[str] | None = None, text: str = ""
) -> Plan:
    """The plan of a sweep, from the tables of a sweep file.

    path : the sweep file, for messages; paths in the tables are relative to its folder

    Raises SceneFileError with every mistake.
    """
    tables = {name: table for name, table in contents.items() if name != "sweep"}
    table = contents.get("sweep")
    if measure is not None and isinstance(table, dict):
        table = {**table, "measure": list(measure)}
    if table is None:
        known = ", ".join(Keys.model_fields)
        raise SceneFileError(str(path), [f"[sweep]: missing table; its keys are: {known}"])
    keys, mistakes = validate_table("sweep", table, Keys)
    mistakes += _nothing_random(_dict(table), tables)
    if keys is None or mistakes:
        varied = {key.partition(".")[0] for _, key in _swept(_dict(table))}  # checked later
        others = validate({name: it for name, it in tables.items() if name not in varied})[1]
        rest = [each for each in others if "missing table" not in each]
        raise SceneFileError(str(path), [*mistakes, *rest])
    grid = keys.grid(tables)
    study, mistakes = _of_values(grid)
    if study is None or mistakes:
        raise SceneFileError(str(path), mistakes)
    inputs = {each: digest(path.parent / each) for each in sorted(_summit_files(grid))}
    said = {"source": str(path), "text": text, "inputs": inputs}
    swept = [list(getattr(keys, where).items()) for where in WHERE]  # in order
    given = {"tables": tables, "swept": swept, "seeds": keys.seeds, "inputs": inputs}
    return planned(Tables(grid, path), keys.measure, said, study.units.names, **given)


def _dict(value: Any) -> dict[str, Any]:
    return value if isinstance(value, dict) else {}


def _swept(table: Mapping[str, Any]) -> list[tuple[str, str]]:
    return [(where, key) for where in WHERE for key in _dict(table.get(where))]


def _nothing_random(table: Mapping[str, Any], tables: Mapping[str, Any]) -> Iterable[str]:
    """A mistake if there are seeds but nothing is random, so that scenes would be the same."""
    given = {*_dict(tables.get("asperities"))}
    given |= {key.removeprefix("asperities.") for _, key in _swept(table)}
    rough = not given.isdisjoint({"height_std", "tip_radius_cv"})
    if "seeds" in table and not table.get("draw") and not rough:
        yield (
            "[sweep] seeds: nothing is random: expected height_std or tip_radius_cv in "
            "[asperities], or a table [sweep.draw]"
        )


def _of_values(grid: Grid) -> tuple[Study | None, list[str]]:
    """The checked tables of the first scene, or None; and the mistakes in all swept values."""
    first = grid.point(0)
    study, mistakes = validate(grid.with_values(*first))
    for where, axes in (("together", grid.together), ("over", grid.over)):
        for key, values in axes if study else ():
            for i, value in enumerate(values[1:], 1):
                point = first._replace(values={**first.values, key: value})
                _, wrong = validate(grid.with_values(*point))
                mistakes += [f"[sweep] {where}.{key}[{i}]: {mistake}" for mistake in wrong]
    return study, mistakes


def _summit_files(grid: Grid) -> set[str]:
    key = "asperities.path"
    swept = [values for each, values in (*grid.together, *grid.over) if each == key]
    paths = swept[0] if swept else [grid.tables.get("asperities", {}).get("path")]
    return {str(path) for path in paths if path is not None}
