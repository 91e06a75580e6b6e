"""The scenes of a sweep with their stages, from the tables of a file or from objects."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array
from convexrough.errors import SceneFileError
from convexrough.run.scene_file import READ, Layouts, Task, task_of
from convexrough.scene.scene import Scene
from convexrough.solvers import Newton
from convexrough.sweeps.grid import Grid
from convexrough.sweeps.measures import Stages

if TYPE_CHECKING:
    from convexrough.run.study import Study

#: Number of layouts (exact positions) of asperities that the cache keeps.
KEPT = 8


#: A function from the number of a scene to the scene and its stages.
Ask = Callable[[int], Task]

#: The entry of the column `seed` if nothing is random.
NO_SEED = -1


@dataclass(frozen=True)
class Tables:
    """Scenes of a grid over keys of a scene file at `path`, to which other paths are relative."""

    grid: Grid
    path: Path

    @property
    def count(self) -> int:
        return self.grid.count

    def labels(self, numbers: range) -> dict[str, NDArray[Any]]:
        """The columns that identify scenes: the swept keys, and the seed."""
        points = [self.grid.point(number) for number in numbers]
        known = self.grid.tables.get("asperities", {}).get("seed", NO_SEED)
        seeds = [known if each.seed is None else each.seed for each in points]
        swept: dict[str, NDArray[Any]] = {}
        for key in self.grid.keys:
            values = [each.values[key] for each in points]
            if self.grid.is_number(key):
                swept[key] = np.array(values, dtype=np.float64)
            else:  # text of lists
                swept[key] = np.array([it if isinstance(it, str) else repr(it) for it in values])
        return swept | {"seed": np.array(seeds, dtype=np.int64)}

    def part(self, numbers: range) -> Tables:
        """The source of the scenes with these numbers, for a worker."""
        return self

    def opened(self) -> Ask:
        """A function that makes the scene of a number; consecutive scenes share common data."""
        layouts = Layouts(*map(lru_cache(KEPT), READ))
        last: dict[str, Any] = {}

        def ask(number: int) -> Task:
            return task_of(self.path, self._study(number, last), layouts)

        return ask

    def _study(self, number: int, last: dict[str, Any]) -> Study:
        """The checked tables of a scene. Scenes that differ only in the seed are checked once."""
        from convexrough.run.study import LatticeTable, validate

        point = self.grid.point(number)
        if last.get("values") != point.values:
            study, mistakes = validate(self.grid.with_values(*point))
            if study is None:
                raise SceneFileError(str(self.path), mistakes)
            last.update(values=point.values, study=study)
        known: Study = last["study"]
        if point.seed is None or not isinstance(known.asperities, LatticeTable):
            return known
        layout = known.asperities.model_copy(update={"seed": point.seed})
        return known.model_copy(update={"asperities": layout})


@dataclass(frozen=True)
class Objects:
    """Scenes made in Python, each with its approach [length] or load [force].

    first : number of the first scene
    """

    scenes: Sequence[Scene]
    controls: Array
    by_load: bool
    stages: Stages
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
        scenes, controls = self.scenes[places], self.controls[places]
        return replace(self, scenes=scenes, controls=controls, first=numbers.start)

    def opened(self) -> Ask:
        def ask(number: int) -> Task:
            scene = self.scenes[number - self.first]
            control = float(self.controls[number - self.first])
            approach, load = (None, control) if self.by_load else (control, None)
            return Task(
                scene=scene, approach=approach, load=load, stages=self.stages, solver=Newton()
            )

        return ask


#: The scenes of a sweep, by their numbers from 0.
Source: TypeAlias = Tables | Objects
