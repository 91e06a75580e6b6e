"""Where the scenes of a sweep come from, and how each is pressed: tables of a file, or objects."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array
from convexrough.contact import Contact, press, solve
from convexrough.errors import SceneFileError
from convexrough.normal.problem import NormalProblem
from convexrough.run.scene_file import READ, Layouts, build_scene
from convexrough.scene.scene import Scene
from convexrough.solvers import named
from convexrough.sweeps.grid import Grid

if TYPE_CHECKING:
    from convexrough.run.study import Study

#: Layouts of asperities that are kept for the scenes to come.
KEPT = 8

#: From the number of a scene to its contact.
Press = Callable[[int], Contact]

#: What stands in the column of seeds where nothing is random.
NO_SEED = -1


class Source(Protocol):
    """The scenes of a sweep, by their numbers from 0."""

    @property
    def count(self) -> int: ...

    def labels(self, numbers: range) -> dict[str, NDArray[Any]]:
        """The columns that say which scenes these are: what is swept, and the seed."""
        ...

    def part(self, numbers: range) -> Source:
        """What a worker needs to know for these numbers, which stay the same."""
        ...

    def opened(self) -> Press:
        """How to press them, with what scenes one after the other share."""
        ...


@dataclass(frozen=True)
class Tables:
    """Scenes of a grid over the keys of a scene file.

    path : of the file, for messages and for what paths in it are relative to
    """

    grid: Grid
    path: Path

    @property
    def count(self) -> int:
        return self.grid.count

    def labels(self, numbers: range) -> dict[str, NDArray[Any]]:
        points = [self.grid.point(number) for number in numbers]
        known = self.grid.tables.get("asperities", {}).get("seed", NO_SEED)
        seeds = [known if each.seed is None else each.seed for each in points]
        swept: dict[str, NDArray[Any]] = {}
        for key in self.grid.keys:
            values = [each.values[key] for each in points]
            if self.grid.is_number(key):
                swept[key] = np.array(values, dtype=np.float64)
            else:  # lists as they stand in the file
                swept[key] = np.array([it if isinstance(it, str) else repr(it) for it in values])
        return swept | {"seed": np.array(seeds, dtype=np.int64)}

    def part(self, numbers: range) -> Tables:
        return self

    def opened(self) -> Press:
        layouts = Layouts(*map(lru_cache(KEPT), READ))
        document = _Documents(self)

        def press_one(number: int) -> Contact:
            tables = document.at(number)
            scene, highest = build_scene(self.path, tables, layouts)
            problem = NormalProblem.assemble(
                scene,
                approach=tables.normal.approach,
                load=tables.normal.load,
                influence=tables.solver.influence,
                highest=highest,
            )
            return solve(problem, named(tables.solver.name))

        return press_one


class _Documents:
    """The checked tables of one scene after the other: those that differ by a seed, once."""

    def __init__(self, source: Tables) -> None:
        self._source = source
        self._last: tuple[dict[str, Any], Study] | None = None

    def at(self, number: int) -> Study:
        """Raises SceneFileError."""
        from convexrough.run.study import Lattice, validate

        point = self._source.grid.point(number)
        if self._last is not None and self._last[0] == point.values:
            known = self._last[1]
            layout = known.asperities
            if isinstance(layout, Lattice):
                layout = layout.model_copy(update={"seed": point.seed})
            return known.model_copy(update={"asperities": layout})
        tables, mistakes = validate(self._source.grid.with_values(*point))
        if tables is None:
            raise SceneFileError(str(self._source.path), mistakes)
        self._last = (point.values, tables)
        return tables


@dataclass(frozen=True)
class Objects:
    """Scenes made in Python, each with its approach [length] or load [force].

    first : the number of the first of them
    """

    scenes: Sequence[Scene]
    controls: Array
    by_load: bool
    first: int = 0

    @property
    def count(self) -> int:
        return len(self.scenes)

    def labels(self, numbers: range) -> dict[str, NDArray[Any]]:
        key = "normal.load" if self.by_load else "normal.approach"
        given = [self.controls[number - self.first] for number in numbers]
        seeds = np.full(len(numbers), NO_SEED, dtype=np.int64)
        return {key: np.array(given, dtype=np.float64), "seed": seeds}

    def part(self, numbers: range) -> Objects:
        places = slice(numbers.start - self.first, numbers.stop - self.first)
        return Objects(self.scenes[places], self.controls[places], self.by_load, numbers.start)

    def opened(self) -> Press:
        def press_one(number: int) -> Contact:
            place = number - self.first
            scene, control = self.scenes[place], float(self.controls[place])
            return press(scene, load=control) if self.by_load else press(scene, approach=control)

        return press_one
