"""The scenes of a sweep: combinations of listed values, random values and seeds.

Scenes are numbered as in nested loops. The outermost loop takes the k-th values of all lists in
`together`. Inside it is one loop for each key in `over`, in their order. The innermost loop takes
the seeds. Memory does not grow with the number of scenes.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np

from convexrough.scene.asperities import CUT_DEVIATIONS

#: A key of a scene file, "table.key" or "table.table.key", and its values.
Axis = tuple[str, tuple[Any, ...]]

Law = Literal["uniform", "normal", "lognormal"]


class Draw(NamedTuple):
    """The law of a random value.

    first, second : for "uniform" the two ends; for "normal" the mean and the standard deviation;
        for "lognormal" the mean and the coefficient of variation. "normal", and the logarithm of
        "lognormal", are clipped at six standard deviations
    """

    key: str
    law: Law
    first: float
    second: float

    def value(self, seed: int) -> float:
        """The random value for a seed, which is independent of the values of other keys."""
        random = np.random.default_rng([seed, zlib.crc32(self.key.encode())])
        if self.law == "uniform":
            return float(random.uniform(self.first, self.second))
        normal = float(np.clip(random.standard_normal(), -CUT_DEVIATIONS, CUT_DEVIATIONS))
        if self.law == "normal":
            return self.first + self.second * normal
        width = math.sqrt(math.log1p(self.second**2))
        return self.first * math.exp(width * normal - width**2 / 2)


class Point(NamedTuple):
    """The values of the swept keys in one scene, by key; and its seed, or None."""

    values: dict[str, Any]
    seed: int | None


@dataclass(frozen=True)
class Grid:
    """The points of a sweep: the values of the swept keys in each scene.

    tables : tables of the scene file, without swept keys
    together : keys with lists of the same length, whose k-th values belong together
    over   : keys whose values are combined in every way
    draws  : keys with random values, and their laws
    seeds  : seeds of random heights, tip radii and values; None if nothing is random
    """

    tables: Mapping[str, Mapping[str, Any]]
    together: tuple[Axis, ...] = ()
    over: tuple[Axis, ...] = ()
    draws: tuple[Draw, ...] = ()
    seeds: Sequence[int] | None = None

    @property
    def keys(self) -> tuple[str, ...]:
        """All swept keys, in the order of the columns."""
        return (*(key for key, _ in (*self.together, *self.over)), *(it.key for it in self.draws))

    def is_number(self, key: str) -> bool:
        """True if every listed value of a key is a single number."""
        axes = dict((*self.together, *self.over))
        return all(isinstance(value, (int, float)) for value in axes.get(key, ()))

    @property
    def each(self) -> int:
        """The number of scenes that differ only in the seed."""
        return 1 if self.seeds is None else len(self.seeds)

    @property
    def count(self) -> int:
        """The number of scenes, which may exceed the range of `len`."""
        tuples = len(self.together[0][1]) if self.together else 1
        return tuples * math.prod(len(values) for _, values in self.over) * self.each

    def point(self, number: int) -> Point:
        """The point of scene `number`, counted from 0."""
        number, turn = divmod(number, self.each)
        seed = None if self.seeds is None else int(self.seeds[turn])
        found: dict[str, Any] = {}
        for key, values in reversed(self.over):
            number, turn = divmod(number, len(values))
            found[key] = values[turn]
        found |= {key: values[number] for key, values in self.together}
        if seed is not None:
            found |= {draw.key: draw.value(seed) for draw in self.draws}
        return Point({key: found[key] for key in self.keys}, seed)

    def with_values(self, values: Mapping[str, Any], seed: int | None) -> dict[str, dict[str, Any]]:
        """The tables of a scene file with these values and this seed."""
        tables = {name: {**table} for name, table in self.tables.items()}
        for key, value in values.items():
            *names, last = key.split(".")
            table: dict[str, Any] = tables
            for name in names:  # a table within a table is copied, too
                table[name] = {**table.get(name, {})}
                table = table[name]
            table[last] = value
        if seed is not None and tables.get("asperities", {}).get("pattern") != "file":
            tables.setdefault("asperities", {})["seed"] = seed
        return tables
