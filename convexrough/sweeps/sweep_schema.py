"""The table [sweep] of a sweep file: what each key may hold, and every mistake in words."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, get_args

from pydantic import Field

from convexrough.checks import nearest
from convexrough.run.study import validate_table
from convexrough.run.values import Table
from convexrough.sweeps.grid import Law
from convexrough.sweeps.measures import MEASURES

LAWS: tuple[Law, ...] = get_args(Law)

#: Tables whose fractions name columns of the result: they are the same for every scene.
FIXED = ("cycle", "shear")

MEANT = 'expected a table and a key of the scene file, such as "asperities.height_std"'


class SweepKeys(Table):
    """What varies, and what is measured."""

    measure: Any = ()
    seeds: Any = None
    together: Any = Field(default_factory=dict)
    over: Any = Field(default_factory=dict)
    draw: Any = Field(default_factory=dict)

    def all_seeds(self) -> Sequence[int] | None:
        """A number of seeds stands for those from 0."""
        return range(self.seeds) if isinstance(self.seeds, int) else self.seeds

    def laws(self) -> Iterator[tuple[str, tuple[Law, float, float]]]:
        """What is drawn, from what."""
        for key, table in self.draw.items():
            for law, (first, second) in table.items():
                yield key, (law, float(first), float(second))

    def mistakes_within(self) -> Iterator[tuple[str, str]]:
        yield from (("", each) for each in self.wrong())

    def wrong(self) -> Iterator[str]:
        """Every mistake, with its key."""
        yield from of_measures(self.measure)
        yield from _of_seeds(self.seeds)
        named: dict[str, str] = {}
        for where in ("together", "over", "draw"):
            table = getattr(self, where)
            if not isinstance(table, Mapping):
                yield f"{where}: found {table!r}, expected a table of keys of the scene file"
                continue
            for key, values in table.items():
                yield from (f'{where}: "{key}": {each}' for each in _of_key(key, self.seeds))
                if key in named:
                    yield f'{where}: "{key}": swept twice, in [sweep.{named[key]}] too'
                named[key] = where
                check = _of_draw if where == "draw" else _of_values
                yield from (f'{where}: "{key}": {each}' for each in check(values))
        if self.draw and self.seeds is None:
            yield "seeds: missing, needed with [sweep.draw]"
        if isinstance(self.together, Mapping):
            lengths = {len(it) for it in self.together.values() if isinstance(it, list)}
            if len(lengths) > 1:
                yield f"together: found {sorted(lengths)} values, expected as many of each key"


def checked(table: Any, measure: Sequence[str] | None) -> tuple[SweepKeys | None, list[str]]:
    """The table, or None and everything that is wrong in it.

    measure : instead of what it says
    """
    if not isinstance(table, dict):
        found = "missing table" if table is None else f"found {table!r}, expected a table"
        return None, [f"[sweep]: {found}; its keys are: {', '.join(SweepKeys.model_fields)}"]
    if measure is not None:
        table = {**table, "measure": list(measure)}
    return validate_table("sweep", table, SweepKeys)


def of_measures(names: Any) -> Iterator[str]:
    """What is wrong with names of measures."""
    known = ", ".join(MEASURES)
    if not isinstance(names, (list, tuple)) or not names:
        yield f"measure: found {names!r}, expected a list of some of: {known}"
        return
    for name in dict.fromkeys(map(str, names)):
        if name not in MEASURES:
            yield f'measure: "{name}" is not known, {nearest(name, MEASURES)}'
        elif [*map(str, names)].count(name) > 1:
            yield f'measure: "{name}" is named twice'


def _of_seeds(seeds: Any) -> Iterator[str]:
    def whole(value: Any, least: int) -> bool:
        return isinstance(value, int) and not isinstance(value, bool) and least <= value < 2**63

    if seeds is None or whole(seeds, 1):
        return
    if not isinstance(seeds, list) or not seeds or not all(whole(each, 0) for each in seeds):
        yield f"seeds: found {seeds!r}, expected how many (1 or more), or a list of whole numbers"
    elif len(set(seeds)) < len(seeds):
        yield "seeds: one is there twice"


def _of_key(key: str, seeds: Any) -> Iterator[str]:
    table, _, name = key.partition(".")
    if not name or "." in name:
        yield MEANT
    elif table in FIXED:
        yield f"cannot be swept: the values of [{table}] are columns, the same for every scene"
    elif key == "asperities.seed" and seeds is not None:
        yield "swept twice, by seeds too"


def _of_values(values: Any) -> Iterator[str]:
    if not isinstance(values, list) or not values:
        yield f"found {values!r}, expected a list of values"
    elif len({repr(value) for value in values}) < len(values):
        yield "a value is there twice"


def _of_draw(table: Any) -> Iterator[str]:
    expected = "one of: uniform = [low, high], normal = [mean, deviation], lognormal = [mean, cv]"
    if not isinstance(table, dict) or len(table) != 1 or next(iter(table)) not in LAWS:
        yield f"found {table!r}, expected {expected}"
        return
    [(law, pair)] = table.items()
    numbers = isinstance(pair, list) and len(pair) == 2
    if not numbers or not all(
        isinstance(each, (int, float)) and not isinstance(each, bool) and math.isfinite(each)
        for each in pair
    ):
        yield f"{law}: found {pair!r}, expected two numbers"
    elif law == "uniform" and not pair[0] < pair[1]:
        yield f"uniform: found {pair!r}, expected the lower one first"
    elif (law != "uniform" and not pair[1] > 0) or (law == "lognormal" and not pair[0] > 0):
        yield f"{law}: found {pair!r}, expected positive numbers"
