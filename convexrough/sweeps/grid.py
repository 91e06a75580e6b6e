"""Which scenes a sweep has, one after the other: lists, a grid, draws, seeds.

Scene number i has the values of a mixed-radix count: the lists taken together turn slowest, then
the keys of the grid, the last fastest, and the seeds fastest of all. Nothing of the length of the
sweep is ever stored.
"""

from __future__ import annotations

import math
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np

from convexrough.scene.patterns import CUT_DEVIATIONS

#: A key of a scene file, "table.key", and its values.
Axis = tuple[str, tuple[Any, ...]]

Law = Literal["uniform", "normal", "lognormal"]


class Draw(NamedTuple):
    """A random value, the same for every scene of one seed.

    uniform: from `first` to `second`;  normal: mean and standard deviation;  lognormal: mean and
    coefficient of variation. The last two are cut at six deviations, as random heights are.
    """

    key: str
    law: Law
    first: float
    second: float

    def value(self, seed: int) -> float:
        """Each key has a stream of its own, so that another draw leaves this one as it was."""
        random = np.random.default_rng([seed, zlib.crc32(self.key.encode())])
        if self.law == "uniform":
            return float(random.uniform(self.first, self.second))
        normal = float(np.clip(random.standard_normal(), -CUT_DEVIATIONS, CUT_DEVIATIONS))
        if self.law == "normal":
            return self.first + self.second * normal
        width = math.sqrt(math.log1p(self.second**2))
        return self.first * math.exp(width * normal - width**2 / 2)


class Point(NamedTuple):
    """What distinguishes one scene: its values by key, and its seed, None where there is none."""

    values: dict[str, Any]
    seed: int | None


@dataclass(frozen=True)
class Grid:
    """The points of a sweep.

    tables : of the scene file, without what is swept
    together : keys whose values, as many of each, are taken one after the other
    over   : keys whose values are combined in every way
    draws  : keys whose values are random
    seeds  : of random heights, tip radii and draws; None where nothing is random
    """

    tables: Mapping[str, Mapping[str, Any]]
    together: tuple[Axis, ...] = ()
    over: tuple[Axis, ...] = ()
    draws: tuple[Draw, ...] = ()
    seeds: Sequence[int] | None = None

    @property
    def keys(self) -> tuple[str, ...]:
        """All that is swept, in the order of the columns."""
        return (*(key for key, _ in (*self.together, *self.over)), *(it.key for it in self.draws))

    def is_number(self, key: str) -> bool:
        """Whether every value of a key is one number."""
        axes = dict((*self.together, *self.over))
        return all(isinstance(value, (int, float)) for value in axes.get(key, ()))

    @property
    def each(self) -> int:
        """Scenes that differ by their seed alone."""
        return 1 if self.seeds is None else len(self.seeds)

    @property
    def count(self) -> int:
        """How many scenes there are; `len` could not say 10^20."""
        tuples = len(self.together[0][1]) if self.together else 1
        return tuples * math.prod(len(values) for _, values in self.over) * self.each

    def point(self, number: int) -> Point:
        """That of scene `number`, from 0."""
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
            table, _, name = key.partition(".")
            tables.setdefault(table, {})[name] = value
        if seed is not None and tables.get("asperities", {}).get("pattern") != "file":
            tables.setdefault("asperities", {})["seed"] = seed
        return tables
