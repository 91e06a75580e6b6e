"""Scene files: TOML files that describe a scene and what to compute."""

from __future__ import annotations

import hashlib
import os
import re
import tomllib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from convexrough import checks
from convexrough.contact import Contact, assembled, solve
from convexrough.errors import FileError, InputError, MistakesError, blamed_on, file_errors
from convexrough.influence import Kind
from convexrough.normal.load_control import all_that_could_touch
from convexrough.normal.problem import NormalProblem
from convexrough.progress import LOGGER
from convexrough.record import Record
from convexrough.run.asperity_file import read_summits
from convexrough.scene.asperities import CUT_DEVIATIONS, Asperities, largest_tip_radius
from convexrough.scene.base import checked
from convexrough.scene.scene import Scene, reach
from convexrough.solvers import Solver, named
from convexrough.tabular.arrays import reading
from convexrough.tabular.roles import Reading, named_columns
from convexrough.tabular.table import few
from convexrough.tabular.toml_slips import explained

if TYPE_CHECKING:
    from convexrough.run.stage import Result, Stage
    from convexrough.run.study import LatticeTable, Study

#: Largest number of mistakes in a scene file that are listed, largest size of the file in bytes,
#: and largest number of parts of a dotted key: time and memory of tomllib grow with its square.
MOST_MISTAKES, MOST_BYTES, MOST_PARTS = 50, 2**25, 100

#: Columns of a file of asperities, unless the scene file names others.
SUMMIT_COLUMNS = ("x", "y", "height", "tip_radius")

_DOTTED = re.compile(rf"(?<![\w\"'-])(?:[\w\"'-]++[ \t]*+\.[ \t]*+){{{MOST_PARTS}}}")


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class Task(Record):
    """A scene, its prescribed approach or load, and the stages to compute, such as [cycle]."""

    scene: Scene
    approach: float | None
    load: float | None
    highest_approach: float | None = None
    stages: Mapping[str, Stage]
    solver: Solver
    influence: Kind | None = None

    def problem(self) -> NormalProblem:
        """The normal contact problem, which solvers take. Raises InputError."""
        how: Any = {"influence": self.influence, "highest": self.highest_approach}
        return NormalProblem.assemble(self.scene, approach=self.approach, load=self.load, **how)

    def press(self) -> Contact:
        """The contact under the prescribed approach or load, as found by `solver`. Raises
        InputError and SolverError, as `press` does."""
        given = self.approach, self.load, self.influence, self.highest_approach
        return solve(assembled(self.solver, self.scene, *given), self.solver)

    def cautions(self, contact: Contact) -> Iterator[str]:
        """Yield warnings about stages that do not fit the contact, before they are computed."""
        from convexrough.run.stage import cautions  # which imports what draws

        return cautions(self.stages.values(), contact)

    def compute(self, contact: Contact) -> list[Result]:
        """The results of all stages, in the order of `stages`; the first is that of [normal].

        contact : the result of `press()`

        The methods `summary`, `tables`, `lines` and `figures` of a result return what the command
        `run` writes and prints. Further members are `plot`, `to_dataframe` and `certified`.

        Raises InputError and SolverError.
        """
        results: list[Result] = []
        for name, stage in self.stages.items():
            LOGGER.info(f"[{name}]")
            results.append(stage.compute(contact))
        return results


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class SceneFile(Task):
    """The contents of a scene file: the scene, and the stages to compute.

    scene, solver : the scene, and the solver of the normal problem
    approach [length], load [force] : the prescribed quantity; the other is None
    highest_approach : [length] upper bound on the approach under the prescribed load; the pattern
        has all asperities that can touch up to this approach. None if the pattern is limited in
        another way, or if the asperities are not in a pattern
    influence : kind of the compliance operator; None for the default
    stages : the tables of the file that request results, by name; the first is [normal]
    path, text : name and text of the file;  seed : seed of random heights and radii, or None
    convert : True if columns in other units are converted, False if they are an error
    inputs : the SHA-256 of each file that was read, by the path of the file

    >>> file = cr.read_scene(new_scene)
    >>> contact = file.press()
    >>> [*file.cautions(contact)], [result.certified for result in file.compute(contact)]
    ([], [True, True, True, True])
    """

    path: Path
    text: str
    seed: int | None
    inputs: Mapping[str, str]
    convert: bool


def read_scene(path: str | os.PathLike[str], *, asperities: Asperities | None = None) -> SceneFile:
    """The contents of a scene file, checked.

    path : name of the file, in the format of docs/reference/scene-file.md
    asperities : asperities that replace those of the file, such as the summits of a map

    Raises FileError if a file cannot be read or is not TOML, MistakesError with every mistake in
    the tables, and InputError for mistakes found when the scene is built.

    >>> file = cr.read_scene(new_scene)  # what `convexrough new` writes
    >>> len(file.scene)
    61
    """
    path = checks.path("path", path, "the name of a scene file")
    study, text = read_study(path)
    named, origin = study.units.names.length, getattr(asperities, "origin", None)  # of a map
    if origin and bool(origin.unit) != bool(named):  # `Scene` compares units that are both named
        found = f"summits of a map in {origin.unit}"
        expected = f"a unit of length in {path} ([units] length), or a map without a unit"
        if named:
            found = "summits of a map without a unit"
            expected = f'a map with a unit, as {path} is in {named}: unit="...", or --unit'
        raise InputError("asperities", found=found, expected=expected)
    task = tasks_of(path, study, asperities=asperities)(None)
    layout, sources = study.asperities, [path]
    if layout.pattern == "file" and asperities is None:
        sources.append(path.parent / layout.path)
    return SceneFile(
        **vars(task),
        path=path,
        text=text,
        seed=None if layout.pattern == "file" or asperities is not None else layout.seed,
        inputs={str(each): digest(each) for each in sources},
        convert=study.units.convert,
    )


def read_study(path: Path) -> tuple[Study, str]:
    """The checked tables of a scene file, and its text. Raises FileError and MistakesError."""
    from convexrough.run.study import validate

    text = read_text(path)
    study, mistakes = validate(tables_of(path, text))
    if study is None:
        raise MistakesError(path, few(mistakes, MOST_MISTAKES))
    return study, text


def digest(path: Path) -> str:
    """The SHA-256 of a file."""
    with file_errors(path, "be read"):
        return hashlib.sha256(path.read_bytes()).hexdigest()


def read_text(path: Path) -> str:
    """The text of a UTF-8 file, with or without a byte-order mark. Raises FileError."""
    with reading(path), path.open(encoding="utf-8-sig") as file:
        text = file.read(MOST_BYTES + 1)  # from a device there may be no end
        if len(text) > MOST_BYTES:
            raise FileError(f"{path}: more than {MOST_BYTES / 2**20:g} MiB")
        return text


def tables_of(path: Path, text: str) -> dict[str, Any]:
    """The tables of a file with this text. Raises FileError if it is not TOML, or empty."""
    if key := _DOTTED.search(text):
        line = text.count("\n", 0, key.start()) + 1
        raise FileError(f"{path}: line {line}: a key of more than {MOST_PARTS} parts")
    try:
        contents = tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # ValueError: for a number of 5000 digits, too
        raise FileError(explained(path, text, error)) from error
    if not contents:
        raise FileError(f"{path}: empty; `convexrough new` writes a scene to start from")
    return contents


def has_sweep(path: Path) -> bool:
    """True if a scene file has a table [sweep]."""
    return "sweep" in tables_of(path, read_text(path))


def regular(pattern: str, spacing: float, tip_radius: Any, within: float) -> Asperities:
    """Asperities in the pattern "hexagonal" or "square", without random heights or tip radii."""
    make = Asperities.hexagonal if pattern == "hexagonal" else Asperities.square
    return make(spacing=spacing, tip_radius=tip_radius, within=within)


def tasks_of(
    path: Path,
    study: Study,
    *,
    asperities: Asperities | None = None,
    summits: Callable[..., Asperities] = read_summits,
    lattice: Callable[..., Asperities] = regular,
) -> Callable[[int | None], Task]:
    """A function that returns the scene and the stages described by the checked tables of the scene
    file at `path`, for a seed of asperities in a pattern; for None, with the seed of the tables.

    asperities : asperities that replace those of the tables
    summits, lattice : functions like `read_summits` and `regular`, which make the asperities

    Raises InputError, as the function does, for mistakes that the tables alone do not show.
    """
    layout, units = study.asperities, study.units
    with blamed_on(path, "material", unless_known=True):
        stuff = study.material.made()
    how: Any = {"friction": study.friction.coefficient if study.friction else None}
    how |= {"geometry": layout.geometry, "units": units.names, "material": stuff}
    press_on: Callable[[Asperities], Scene] = partial(Scene, checked(study.sphere.radius), **how)

    given: Any = {"approach": study.normal.approach, "load": study.normal.load}
    given |= {"stages": study.stages, "solver": named(study.solver.name)}
    given |= {"influence": study.solver.influence}

    def task(seed: int | None) -> Task:
        highest = None
        with blamed_on(path, "asperities", unless_known=True):
            if asperities is not None:
                scene = press_on(asperities)
            elif layout.pattern == "file":
                names = named_columns("columns", layout.columns, SUMMIT_COLUMNS)
                read = Reading(columns=names, units=units.names, convert=units.convert, keyed=True)
                place = path.parent / layout.path
                scene = press_on(summits(place, tip_radius=layout.tip_radius, how=read))
            else:
                own = layout.seed if seed is None else seed
                scene, highest = _lattice(layout, own, study, press_on, lattice)
        return Task(scene=scene, highest_approach=highest, **given)

    return task


def _lattice(
    layout: LatticeTable,
    seed: int | None,
    study: Study,
    press_on: Callable[[Asperities], Scene],
    lattice: Callable[..., Asperities],
) -> tuple[Scene, float | None]:
    """The scene with asperities in a pattern, and `highest_approach` of the task. Without the key
    `within`, it has all that could touch in [normal], or at the largest load in another table."""
    tips, deviation, variation = layout.tip_radius, layout.height_std, layout.tip_radius_cv
    rough: Any = {"height_std": deviation, "tip_radius_cv": variation, "seed": seed}
    tip_radius = tuple(tips) if isinstance(tips, list) else tips

    def scene(within: float) -> Scene:
        asperities = lattice(layout.pattern, layout.spacing, tip_radius, within)
        return press_on(asperities.roughened(**rough))

    def farthest(approach: float) -> float:
        return reach(
            approach,
            sphere_radius=checked(study.sphere.radius),
            tip_radius=largest_tip_radius(tips, variation),
            height=CUT_DEVIATIONS * deviation,
            geometry=layout.geometry,
        )

    if layout.within is not None:
        return scene(layout.within), None
    approach, load = study.normal.approach, study.normal.load or 0.0
    found: tuple[Scene, float | None]
    if approach is not None:
        found = scene(farthest(approach)), None
    else:
        found = all_that_could_touch(scene, farthest, load)
    most = max(stage.highest_load for stage in study.stages.values())
    if most > load:
        larger, _ = all_that_could_touch(scene, farthest, most)
        found = (larger, None) if len(larger) > len(found[0]) else found
    return found
