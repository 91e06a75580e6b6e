"""Sweep files: a scene file and a table of what varies in it, checked value by value."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, ValidationError
from pydantic_core import ErrorDetails

from convexrough.checks import nearest
from convexrough.errors import SceneFileError
from convexrough.run.scene_file import MOST_BYTES, digest, parsed
from convexrough.run.schema import validate
from convexrough.run.tables import read_text
from convexrough.run.values import Table, expected
from convexrough.sweeps.grid import Axis, Draw, Grid, Law
from convexrough.sweeps.plan import Plan, identified, planned
from convexrough.sweeps.scenes import Tables

#: Tables whose fractions name columns of the result: they are the same for every scene.
FIXED = ("shear", "cycle", "history")

WHERE = ("together", "over", "draw")


def _different(values: Any) -> bool:
    return bool(values) and len({repr(value) for value in values}) == len(values)


def _are_seeds(seeds: int | list[int]) -> bool:
    if isinstance(seeds, int):
        return 1 <= seeds < 2**63
    return _different(seeds) and 0 <= min(seeds) <= max(seeds) < 2**63


def _is_law(table: dict[Law, list[float]]) -> bool:
    """One law of two numbers that it takes."""
    if len(table) != 1 or not all(len(pair) == 2 for pair in table.values()):
        return False
    [(law, (first, second))] = table.items()
    return first < second if law == "uniform" else second > 0 and (law == "normal" or first > 0)


_Keys = expected('a table of keys of the scene file, such as "asperities.height_std"')
_Values = Annotated[list[Any], expected("a list of values, none of them twice", _different)]
_Laws = Annotated[
    dict[Law, list[float]],
    expected(
        "one of: uniform = [low, high] with low < high, normal = [mean, deviation > 0], "
        "lognormal = [mean > 0, coefficient of variation > 0]",
        _is_law,
    ),
]
_Seeds = Annotated[
    int | list[int],
    expected("how many (1 or more), or a list of whole numbers, none of them twice", _are_seeds),
]
_Names = Annotated[
    list[str], expected('a list of numbers of summary.json, such as ["load"]', _different)
]


class Keys(Table):
    """The table [sweep]: what varies, and what is measured."""

    measure: _Names
    seeds: _Seeds | None = None
    together: Annotated[dict[str, _Values], _Keys] = Field(default_factory=dict)
    over: Annotated[dict[str, _Values], _Keys] = Field(default_factory=dict)
    draw: Annotated[dict[str, _Laws], _Keys] = Field(default_factory=dict)

    def grid(self, tables: Mapping[str, Any]) -> Grid:
        def axes(table: Mapping[str, list[Any]]) -> tuple[Axis, ...]:
            return tuple((key, tuple(values)) for key, values in table.items())

        laws = ((key, law, pair) for key, it in self.draw.items() for law, pair in it.items())
        seeds = range(self.seeds) if isinstance(self.seeds, int) else self.seeds
        draws = tuple(Draw(key, law, *pair) for key, law, pair in laws)
        return Grid(tables, axes(self.together), axes(self.over), draws, seeds)


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
    tables = {name: table for name, table in contents.items() if name != "sweep"}
    keys, mistakes = _checked(contents.get("sweep"), measure, tables)
    if keys is None:
        raise SceneFileError(str(path), mistakes)
    grid = keys.grid(tables)
    if mistakes := list(_of_values(grid)):
        raise SceneFileError(str(path), mistakes)
    inputs = {each: digest(path.parent / each) for each in sorted(_summit_files(grid))}
    swept = [list(getattr(keys, where).items()) for where in WHERE]  # in order
    identity = identified(
        tables=tables, swept=swept, seeds=keys.seeds, measure=keys.measure, inputs=inputs
    )
    said = {"source": str(path), "text": text, "inputs": inputs}
    return planned(Tables(grid, path), keys.measure, tables, identity, said)


def _checked(
    table: Any, measure: Sequence[str] | None, tables: Mapping[str, Any]
) -> tuple[Keys | None, list[str]]:
    """The table [sweep]; or None and everything that is wrong, in it and in the other tables."""
    if not isinstance(table, dict):
        found = "missing table" if table is None else f"found {table!r}, expected a table"
        return None, [f"[sweep]: {found}; its keys are: {', '.join(Keys.model_fields)}"]
    if measure is not None:
        table = {**table, "measure": list(measure)}
    swept = [(where, key) for where in WHERE for key in _dict(table.get(where))]
    mistakes = [*_between(table, swept, tables)]
    keys = None
    try:
        keys = Keys.model_validate(table)
    except ValidationError as error:
        mistakes = [*map(_phrase, error.errors()), *mistakes]
    if not mistakes:
        return keys, []
    known = {key.partition(".")[0] for _, key in swept}  # their values are not checked yet
    others = {name: it for name, it in tables.items() if name not in known}
    mistakes += [each for each in validate(others)[1] if "missing table" not in each]
    return None, mistakes


def _dict(value: Any) -> dict[str, Any]:
    return value if isinstance(value, dict) else {}


def _phrase(error: ErrorDetails) -> str:
    """One mistake: the key, what was found, what is expected."""
    name, *inner = error["loc"]
    place = f'[sweep.{name}] "{inner[0]}"' if inner and name in WHERE else f"[sweep] {name}"
    if error["type"] == "extra_forbidden":
        return f"{place}: unknown key, {nearest(str(name), Keys.model_fields)}"
    if error["type"] == "missing":
        return f'{place}: missing, expected a list of numbers of summary.json, such as ["load"]'
    return f"{place}: found {error['input']!r}, expected {error['msg']}"


def _between(
    table: dict[str, Any], swept: Iterable[tuple[str, str]], tables: Mapping[str, Any]
) -> Iterator[str]:
    """Mistakes in which keys are given together, whatever their values."""
    first: dict[str, str] = {}
    for where, key in swept:
        place, (name, _, rest) = f'[sweep.{where}] "{key}"', key.partition(".")
        if not rest or "." in rest:
            yield f'{place}: expected a table and a key of it, such as "asperities.height_std"'
        elif name in FIXED:
            yield f"{place}: the values of [{name}] are columns, the same for every scene"
        elif key in first or (key == "asperities.seed" and "seeds" in table):
            also = f"in [sweep.{first[key]}]" if key in first else "by seeds"
            yield f"{place}: swept twice, {also} too"
        first[key] = where
    lists = _dict(table.get("together")).values()
    lengths = {len(each) for each in lists if isinstance(each, list)}
    if len(lengths) > 1:
        yield f"[sweep] together: found {sorted(lengths)} values, expected as many of each key"
    drawn = bool(table.get("draw"))
    if drawn and "seeds" not in table:
        yield "[sweep] seeds: missing, needed with [sweep.draw]"
    given = {*_dict(tables.get("asperities"))}
    given |= {key.removeprefix("asperities.") for key in first}
    if "seeds" in table and not drawn and given.isdisjoint({"height_std", "tip_radius_cv"}):
        yield (
            "[sweep] seeds: nothing is random: expected height_std or tip_radius_cv in "
            "[asperities], or a table [sweep.draw]"
        )


def _of_values(grid: Grid) -> Iterator[str]:
    """Every value is checked among the first ones of all other keys, so once."""
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


def _summit_files(grid: Grid) -> set[str]:
    """The paths of all files of asperities."""
    key = "asperities.path"
    swept = [values for each, values in (*grid.together, *grid.over) if each == key]
    paths = swept[0] if swept else [grid.tables.get("asperities", {}).get("path")]
    return {str(path) for path in paths if path is not None}
