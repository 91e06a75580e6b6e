"""The table [sweep] of a sweep file: keys of the scene file that vary, and the resulting scenes.

Scenes are numbered as in nested loops. The outermost loop takes the k-th values of all lists in
`together`. Inside it is one loop for each key in `over`, in their order. The innermost loop takes
the seeds. Memory does not grow with the number of scenes.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from convexrough.run.study import RANDOM
from convexrough.run.values import FileTable, Mistake, expected
from convexrough.scene.asperities import CUT_DEVIATIONS

#: Tables whose keys cannot be swept, because columns are named after the fractions in them.
FIXED = ("shear", "cycle", "history")

WHERE = ("together", "over", "draw")

#: The law of a random value, and its two parameters: for "uniform" the ends; for "normal" the mean
#: and the standard deviation; for "lognormal" the mean and the coefficient of variation.
Law = Literal["uniform", "normal", "lognormal"]


def _different(values: Any) -> bool:
    """True for a list in which no value is twice."""
    return 0 < len({*map(repr, values)}) == len(values)


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


class Grid(FileTable):
    """The table [sweep]: keys "table.key" of a scene file that vary, and numbers to measure.

    seeds : number of seeds (of random heights, tip radii and values), or a list of seeds
    together, over, draw : keys with lists of the same length; with lists that are combined in all
        ways; with laws of random values
    """

    measure: _Names = Field(default_factory=list)
    seeds: _Seeds | None = None
    together: Annotated[dict[str, _List], _KEYS] = Field(default_factory=dict)
    over: Annotated[dict[str, _Values], _KEYS] = Field(default_factory=dict)
    draw: Annotated[dict[str, _Laws], _KEYS] = Field(default_factory=dict)

    @classmethod
    def mistakes_between(cls, keys: Mapping[str, Any]) -> Iterator[Mistake]:
        yield from super().mistakes_between(keys)
        if "measure" not in keys:
            yield "measure", f"missing, expected {_NAMES}"
        first: dict[str, str] = {}
        for where, key in swept(keys):
            name, _, rest = key.partition(".")
            if not all(key.split(".")) or not rest:
                expects = 'expected a table and a key of it, such as "asperities.height_std"'
                yield f"{where}.{key}", expects
            elif name == "sweep":
                yield f"{where}.{key}", "expected a key of a scene"
            elif name in FIXED:
                yield f"{where}.{key}", f"columns are named after [{name}], which cannot vary"
            elif key == "asperities.seed" and "seeds" in keys:
                yield f"{where}.{key}", "swept twice, also by seeds"
            for other in first:  # a key, or a table that contains it
                if f"{key}.".startswith(f"{other}.") or other.startswith(f"{key}."):
                    yield f"{where}.{key}", f"swept twice, also in [sweep.{first[other]}] {other}"
            first[key] = where
        lists = table_in(keys, "together").values()
        if len(lengths := {len(each) for each in lists if isinstance(each, list)}) > 1:
            yield "together", f"found {sorted(lengths)} values, expected as many for every key"
        if keys.get("draw") and "seeds" not in keys:
            yield "seeds", "missing, needed with [sweep.draw]"

    def blame(self, mistakes: list[str], seed: int | None) -> list[str]:
        """The mistakes in a scene with this seed; those in random values name the seed."""
        random = tuple("[{}] {}:".format(*key.split(".", 1)) for key in self.draw)
        said = f", for seed {seed} of [sweep.draw]"
        return [each + said if each.startswith(random) else each for each in mistakes]

    @property
    def axes(self) -> dict[str, list[Any]]:
        """The keys in `together` and `over`, and their values."""
        return self.together | self.over

    @property
    def keys(self) -> list[str]:
        """All swept keys, in the order of the columns."""
        return [*self.axes, *self.draw]

    @property
    def numbered(self) -> Sequence[int | None]:
        """The seeds in their order; only None if nothing is random."""
        return range(self.seeds) if isinstance(self.seeds, int) else self.seeds or [None]

    @property
    def each(self) -> int:
        """The number of scenes that differ only in the seed."""
        return len(self.numbered)

    @property
    def count(self) -> int:
        """The number of scenes, which may exceed the range of `len`."""
        rows = len(next(iter(self.together.values()), [None]))
        return rows * math.prod(map(len, self.over.values())) * self.each

    def point(self, number: int) -> tuple[dict[str, Any], int | None]:
        """The values of the swept keys in scene `number`, counted from 0; and its seed, or None."""
        number, turn = divmod(number, self.each)
        seed = self.numbered[turn]
        found: dict[str, Any] = {}
        for key, values in reversed(self.over.items()):
            number, turn = divmod(number, len(values))
            found[key] = values[turn]
        found |= {key: values[number] for key, values in self.together.items()}
        if seed is not None:
            for key, laws in self.draw.items():
                [(law, parameters)] = laws.items()
                found[key] = random_value(key, seed, law, *parameters)
        return {key: found[key] for key in self.keys}, seed


def random_value(key: str, seed: int, law: Law, first: float, second: float) -> float:
    """The random value of a key for a seed, independent of the values of other keys. Normal values,
    and logarithms of lognormal values, are clipped at six standard deviations."""
    random = np.random.default_rng([seed, zlib.crc32(key.encode())])
    if law == "uniform":
        return float(random.uniform(first, second))
    normal = float(np.clip(random.standard_normal(), -CUT_DEVIATIONS, CUT_DEVIATIONS))
    if law == "normal":
        return first + second * normal
    width = math.sqrt(math.log1p(second**2))
    return first * math.exp(width * normal - width**2 / 2)


def with_values(
    tables: Mapping[str, Any], values: Mapping[str, Any], seed: int | None
) -> dict[str, dict[str, Any]]:
    """Copies of the tables of a scene file, with these values of keys and this seed."""
    made: dict[str, Any] = {name: {**table} for name, table in tables.items()}
    for key, value in values.items():
        *names, last = key.split(".")
        table = made
        for name in names:  # a table within a table is copied, too
            table[name] = {**table.get(name, {})}
            table = table[name]
        table[last] = value
    layout = made.get("asperities", {})
    is_random = layout.get("pattern") != "file" and not layout.keys().isdisjoint(RANDOM)
    if seed is not None and is_random:
        layout["seed"] = seed
    return made


def table_in(tables: Mapping[str, Any], name: str) -> dict[str, Any]:
    """The table of this name; {} if there is none, or if its value is not a table."""
    value = tables.get(name)
    return value if isinstance(value, dict) else {}


def swept(table: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Pairs (table in `WHERE`, key) of all swept keys of [sweep], which may contain mistakes."""
    return [(where, key) for where in WHERE for key in table_in(table, where)]
