"""Scene files: TOML files that describe a scene and what to compute."""

from __future__ import annotations

import hashlib
import os
import re
import tomllib
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from io import BytesIO, TextIOWrapper
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from convexrough.arrays import Array
from convexrough.contact import Contact, assembled, solve
from convexrough.errors import FileError, InputError, SceneFileError, blamed_on, file_errors
from convexrough.influence import Kind
from convexrough.normal.load_control import all_that_could_touch
from convexrough.normal.problem import NormalProblem
from convexrough.record import Record
from convexrough.scene.asperities import CUT_DEVIATIONS, Asperities, largest_tip_radius
from convexrough.scene.base import checked
from convexrough.scene.scene import Scene, reach
from convexrough.solvers import Solver, named
from convexrough.tabular.arrays import reading
from convexrough.tabular.roles import AS_IT_IS, Reading, is_index, named_columns
from convexrough.tabular.table import few, read_table
from convexrough.tabular.toml_slips import explained
from convexrough.tabular.units import bare, parsed

if TYPE_CHECKING:
    from convexrough.run.stage import Result, Stage
    from convexrough.run.study import LatticeTable, Study

#: Names of columns with results, which are ignored in a table of asperities.
RESULTS = ("load", "contact_radius", "mean_pressure", "gap", "load_error", "force", "pressure",
           "area", "contact")  # fmt: skip

#: Relative rounding error up to which a last row counts as the means or sums of a table.
ROUNDED = 1e-3

#: Largest number of mistakes in a scene file that are listed; the other mistakes are counted.
MOST_MISTAKES = 50

#: [bytes] size of the largest accepted scene file.
MOST_BYTES = 2**25

#: Columns of a file of asperities, unless the scene file names others.
SUMMIT_COLUMNS = ("x", "y", "height", "tip_radius")

#: A dotted key must have fewer parts: the time and memory of tomllib grow with their square.
MOST_PARTS = 100

_DOTTED = re.compile(rf"(?<![\w\"'-])(?:[\w\"'-]++[ \t]*+\.[ \t]*+){{{MOST_PARTS}}}")


def unknown(column: str) -> bool:
    """True if a column may contain heights: its header is not a number, an index or a result."""
    return not (column.isdecimal() or is_index(column) or bare(column).lower() in RESULTS)


def read_summits(
    path: Path, *, tip_radius: ArrayLike | None, how: Reading = AS_IT_IS
) -> Asperities:
    """The asperities in a file with columns x and y, and perhaps height (or z) and tip_radius.

    tip_radius : [length] one number or (n,); None if the file has a column tip_radius

    Raises FileError, or InputError with the column or row, if the table is wrong.
    """
    table = read_table(path, required=("x", "y"), optional=("height", "tip_radius"), how=how)
    columns = table.columns
    unread = [it for it, cells in table.others.items() if cells.dtype.kind == "f" and unknown(it)]
    if "height" not in columns and unread:
        named = 'columns = {height = "' + unread[0] + '"} in [asperities], or no such column'
        raise InputError("columns", found=f"{', '.join(unread)}, but no height",
                         expected=f"a column height; {named}", where=str(path))  # fmt: skip
    for name, said in table.units.items():
        if parsed(said) and not how.units.length:
            expected = f'[units] length in the scene file, as "{said}"'
            raise InputError(f"column {name}", found=f"{said}, and a scene without units",
                             expected=expected, where=str(path))  # fmt: skip
    for name, cells in table.others.items():
        if is_index(name) and is_permuted(cells):
            found = f"{cells[0]:g}, {cells[1]:g}, ..."
            expected = "the rows in increasing order, or no such column"
            raise InputError(f"column {name}", found=found, expected=expected, where=str(path))
    if what := _summary_in_last_row([*columns.values()]):
        raise InputError(table.rows[-1], found=f"the {what} of the other rows",
                         expected="an asperity: remove this row", where=str(path))  # fmt: skip
    given = columns.get("tip_radius")
    if (given is None) == (tip_radius is None):
        found = "neither" if given is None else "both"
        expected = "either a column tip_radius or the key tip_radius in the scene file"
        raise InputError("tip radii", found=found, expected=expected, where=str(path))
    positions = np.column_stack((columns["x"], columns["y"]))
    radii = tip_radius if given is None else given
    assert radii is not None  # one of the two is given
    with blamed_on(f"{path} ({table.rows[0]} holds asperity 0)"):
        return Asperities(positions, radii, columns.get("height", 0.0))


def _summary_in_last_row(columns: list[Array]) -> str:
    """ "means" or "sums" if the last row contains those of the rows above; else ""."""
    own = columns[2:]
    if len(columns[0]) < 4 or not own or any(np.ptp(each[:-1]) == 0 for each in own):
        return ""  # the mean of a regular array is an asperity in its middle
    for what, of in (("means", np.mean), ("sums", np.sum)):
        if all(abs(each[-1] - of(each[:-1])) <= ROUNDED * np.ptp(each[:-1]) for each in columns):
            return what
    return ""


def is_permuted(cells: NDArray[Any]) -> bool:
    """True if the cells are the numbers 0, 1, ... or 1, 2, ... in another order."""
    if cells.dtype.kind != "f" or len(cells) < 2:
        return False
    ordered = np.sort(cells)
    counts = ordered[0] in (0, 1) and (np.diff(ordered) == 1).all()
    return bool(counts and (ordered != cells).any())


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
        """The normal contact problem."""
        return NormalProblem.assemble(
            self.scene,
            approach=self.approach,
            load=self.load,
            influence=self.influence,
            highest=self.highest_approach,
        )

    def press(self) -> Contact:
        """The contact under the prescribed approach or load. Raises the errors of `press`."""
        given = self.approach, self.load, self.influence, self.highest_approach
        return solve(assembled(self.solver, self.scene, *given), self.solver)

    def cautions(self, contact: Contact) -> Iterator[str]:
        """Warnings about stages that do not fit the contact, before they are computed."""
        return (each for stage in self.stages.values() for each in stage.cautions(contact))

    def compute(self, contact: Contact) -> list[Result]:
        """The results of all stages; the first is the pressed contact."""
        return [stage.compute(contact) for stage in self.stages.values()]


@dataclass(frozen=True, eq=False, kw_only=True, repr=False)
class SceneFile(Task):
    """The contents of a scene file: the scene, and the stages to compute.

    approach [length] or load [force] : what is prescribed; the other is None
    highest_approach : [length] upper bound on the approach under the prescribed load; the pattern
        has all asperities that can touch up to this approach. None if the pattern is limited in
        another way, or if the asperities are not in a pattern
    influence : how the compliance matrix is stored; None for the cheapest way
    stages : the tables of the file that request results, by name; the first table is [normal]
    text   : text of the file;  seed : seed of its random heights and radii, or None
    convert : True to convert columns in other units than those of the scene, False to refuse them
    inputs : the SHA-256 of each file that was read, by the path of the file

    >>> file = cr.read_scene(new_scene)
    >>> contact = file.press()
    >>> [result.certified for result in file.compute(contact)]
    [True, True, True, True]
    """

    path: Path
    text: str
    seed: int | None
    inputs: Mapping[str, str]
    convert: bool


def read_scene(path: str | os.PathLike[str], *, asperities: Asperities | None = None) -> SceneFile:
    """The contents of a scene file, checked.

    asperities : asperities that replace those of the file

    Raises FileError if a file cannot be read or is not TOML, SceneFileError with every mistake in
    the tables, and InputError for mistakes found when the scene is built.

    >>> file = cr.read_scene(new_scene)  # what `convexrough new` writes
    >>> len(file.scene)
    61
    """
    if not isinstance(path, (str, os.PathLike)):
        raise InputError("path", found=repr(path)[:60], expected="the name of a scene file")
    path = Path(path)
    study, text = read_study(path)
    if asperities is not None:
        from convexrough.surface.summits import Summits  # only for maps

        if isinstance(asperities, Summits):
            _one_unit(path, asperities.origin.unit, study.units.names.length)
    task = task_of(path, study, asperities=asperities)
    layout, sources = study.asperities, [path]
    if layout.pattern == "file" and asperities is None:
        sources.append(path.parent / layout.path)
    for stage in study.stages.values():
        with blamed_on(path):
            stage.fits(len(task.scene))
    return SceneFile(
        **vars(task),
        path=path,
        text=text,
        seed=None if layout.pattern == "file" or asperities is not None else layout.seed,
        inputs={str(each): digest(each) for each in sources},
        convert=study.units.convert,
    )


def read_study(path: Path) -> tuple[Study, str]:
    """The checked tables of a scene file, and its text. Raises FileError and SceneFileError."""
    from convexrough.run.study import validate

    text = read_text(path)
    study, mistakes = validate(tables_of(path, text))
    if study is None:
        raise SceneFileError(str(path), few(mistakes, MOST_MISTAKES))
    return study, text


def _one_unit(path: Path, own: str, named: str) -> None:
    """Raise InputError unless `own`, the unit of a map's summits, is the scene's unit `named`."""
    if own != named:
        found = f"summits of a map {f'in {own}' if own else 'without a unit'}"
        expected = f'{named}, as in {path}: surface.to_unit("{named}")'
        if not own:
            expected = f'a map with a unit, as {path} is in {named}: unit="...", or --unit'
        if not named:
            expected = f"a unit of length in {path} ([units] length), or a map without a unit"
        raise InputError("asperities", found=found, expected=expected)


def digest(path: Path) -> str:
    """The SHA-256 of a file."""
    with file_errors(path, "be read"):
        return hashlib.sha256(path.read_bytes()).hexdigest()


def read_text(path: Path) -> str:
    """The text of a UTF-8 file, with or without a byte-order mark. Raises FileError."""
    with reading(path), path.open("rb") as file:
        contents = file.read(MOST_BYTES + 1)
        if len(contents) > MOST_BYTES:
            raise FileError(f"{path}: more than {MOST_BYTES / 2**20:g} MiB")
        return TextIOWrapper(BytesIO(contents), encoding="utf-8-sig").read()


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
    text = read_text(path)
    return bool(re.search(r"^\s*\[\s*sweep\b", text, re.M)) and "sweep" in tables_of(path, text)


def regular(
    pattern: str, spacing: float, tip_radius: float | tuple[float, ...], within: float
) -> Asperities:
    """Asperities in the pattern "hexagonal" or "square", without random heights or tip radii."""
    make = Asperities.hexagonal if pattern == "hexagonal" else Asperities.square
    return make(spacing=spacing, tip_radius=tip_radius, within=within)


def task_of(
    path: Path,
    study: Study,
    *,
    asperities: Asperities | None = None,
    summits: Callable[..., Asperities] = read_summits,
    lattice: Callable[..., Asperities] = regular,
) -> Task:
    """The scene and the stages described by tables that have been checked.

    path    : the scene file, for messages; paths in the tables are relative to its folder
    asperities : asperities that replace those of the tables
    summits, lattice : functions that make the asperities, with the arguments of `read_summits` and
        `regular`

    Raises InputError for mistakes that the tables alone do not show.
    """
    with _blamed_on(path, "material"):
        stuff = study.material.made()

    def press_on(asperities: Asperities) -> Scene:
        return Scene(
            checked(study.sphere.radius),
            asperities,
            stuff,
            friction=study.friction.coefficient if study.friction else None,
            geometry=study.asperities.geometry,
            units=study.units.names,
        )

    layout, highest = study.asperities, None
    with _blamed_on(path, "asperities"):
        if asperities is not None:
            scene = press_on(asperities)
        elif layout.pattern == "file":
            how = Reading(
                columns=named_columns("columns", layout.columns, SUMMIT_COLUMNS),
                units=study.units.names,
                convert=study.units.convert,
            )
            place = path.parent / layout.path
            scene = press_on(summits(place, tip_radius=layout.tip_radius, how=how))
        else:
            scene, highest = _lattice(layout, study, press_on, lattice)
    return Task(
        scene=scene,
        approach=study.normal.approach,
        load=study.normal.load,
        highest_approach=highest,
        stages=study.stages,
        solver=named(study.solver.name),
        influence=study.solver.influence,
    )


def _lattice(
    layout: LatticeTable,
    study: Study,
    press_on: Callable[[Asperities], Scene],
    lattice: Callable[..., Asperities],
) -> tuple[Scene, float | None]:
    """The scene with asperities in a pattern, and `highest_approach` of the task.

    The pattern extends to the distance `within` or, without this key, to all asperities that could
    touch: at the approach or load in [normal], or at the largest load that another stage names.
    """
    tips = layout.tip_radius
    tip_radius = tuple(tips) if isinstance(tips, list) else tips

    def scene(within: float) -> Scene:
        asperities = lattice(layout.pattern, layout.spacing, tip_radius, within)
        rough = asperities.roughened(
            height_std=layout.height_std, tip_radius_cv=layout.tip_radius_cv, seed=layout.seed
        )
        return press_on(rough)

    def farthest(approach: float) -> float:
        return reach(
            approach,
            sphere_radius=checked(study.sphere.radius),
            tip_radius=largest_tip_radius(layout.tip_radius, layout.tip_radius_cv),
            height=CUT_DEVIATIONS * layout.height_std,
            geometry=layout.geometry,
        )

    if layout.within is not None:
        return scene(layout.within), None
    approach, load = study.normal.approach, study.normal.load or 0.0
    found: list[tuple[Scene, float | None]] = []
    if approach is not None:
        found.append((scene(farthest(approach)), None))
    else:
        found.append(all_that_could_touch(scene, farthest, load))
    most = max((stage.highest_load for stage in study.stages.values()), default=0.0)
    if most > load:
        found.append((all_that_could_touch(scene, farthest, most)[0], None))
    return max(found, key=lambda each: len(each[0]))


@contextmanager
def _blamed_on(path: Path, table: str) -> Iterator[None]:
    """Name the file and the table in InputErrors of the body."""
    try:
        yield
    except InputError as error:
        if error.where:  # the error names another file
            raise
        what = f"[{table}] {error.what}"
        where = str(path)
        raise InputError(what, found=error.found, expected=error.expected, where=where) from error
