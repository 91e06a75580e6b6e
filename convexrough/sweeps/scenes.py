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
from convexrough.contact import Contact, solve
from convexrough.errors import SceneFileError
from convexrough.influence import Kind
from convexrough.normal.problem import NormalProblem
from convexrough.run.scene_file import READ, Layouts, build_scene
from convexrough.scene.scene import Scene
from convexrough.solvers import named
from convexrough.sweeps.grid import Grid
from convexrough.sweeps.measures import Stages

if TYPE_CHECKING:
    from convexrough.run.study import Study

#: Number of layouts of asperities in the cache.
KEPT = 8


@dataclass(frozen=True)
class Asked:
    """A scene, its prescribed approach or load, and the stages to compute.

    approach [length], load [force], solver, influence, highest : as in `SceneFile`
    """

    scene: Scene
    approach: float | None
    load: float | None
    stages: Stages
    solver: str = "newton"
    influence: Kind | None = None
    highest: float | None = None

    @property
    def plain(self) -> bool:
        """True if the solver and the compliance operator are the defaults of `press`."""
        return self.solver == "newton" and self.influence in (None, "dense")

    def pressed(self) -> Contact:
        """The contact. Raises the errors of `press`."""
        problem = NormalProblem.assemble(
            self.scene,
            approach=self.approach,
            load=self.load,
            influence=self.influence,
            highest=self.highest,
        )
        return solve(problem, named(self.solver))


#: A function from the number of a scene to the scene and its stages.
Ask = Callable[[int], Asked]

#: The entry of the column `seed` if nothing is random.
NO_SEED = -1


@dataclass(frozen=True)
class Tables:
    """Scenes of a grid over the keys of a scene file; `path` is for messages and relative paths."""

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
        """A function that makes scenes by number; consecutive scenes share common data."""
        layouts = Layouts(*map(lru_cache(KEPT), READ))
        last: dict[str, Any] = {}

        def ask(number: int) -> Asked:
            study = self._study(number, last)
            scene, highest = build_scene(self.path, study, layouts)
            normal, solver = study.normal, study.solver
            return Asked(
                scene,
                normal.approach,
                normal.load,
                study.stages,
                solver.name,
                solver.influence,
                highest,
            )

        return ask

    def _study(self, number: int, last: dict[str, Any]) -> Study:
        """The tables of a scene; those of scenes that differ only in the seed are checked once."""
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
        def ask(number: int) -> Asked:
            scene = self.scenes[number - self.first]
            control = float(self.controls[number - self.first])
            approach, load = (None, control) if self.by_load else (control, None)
            return Asked(scene, approach, load, self.stages)

        return ask


#: The scenes of a sweep, by their numbers from 0.
Source: TypeAlias = Tables | Objects
