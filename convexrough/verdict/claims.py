"""Claimed loads and shear forces from files, one per asperity of a scene, and verdicts on them."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from shlex import quote
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from convexrough import checks
from convexrough.arrays import Array, Indices, frozen
from convexrough.contact import Contact
from convexrough.errors import InputError, MistakesError, SolverError, blamed_on
from convexrough.friction.verdict import claims_sliding, verify_shear
from convexrough.normal.claims import Claim, tolerance
from convexrough.normal.problem import NormalProblem
from convexrough.scene.neighbours import nearest_distances
from convexrough.scene.scene import Scene
from convexrough.surface.map_arrays import steps
from convexrough.tabular.columns import bound
from convexrough.tabular.roles import COLUMNS, Reading, shortened
from convexrough.tabular.table import ReadTable, read_table, refuse
from convexrough.tabular.units import bare, unit
from convexrough.verdict.placing import Placing, unused
from convexrough.verdict.verdict import verify_on

#: Negative loads up to SMALL times the largest load may be noise. Heights or tip radii may be
#: rounded if they differ by up to ROUNDED times the largest.
SMALL, ROUNDED = 1e-3, 1e-2

#: The status that a word in a column "status" or "contact", or a flag in "contact", claims.
WORDS = {"contact": "contact", "closed": "contact", "open": "open"}
FLAGS = {"1": "contact", "1.0": "contact", "true": "contact", "yes": "contact", "0": "open",
         "0.0": "open", "false": "open", "no": "open"}  # fmt: skip

#: The status that each entry of these columns claims.
CLAIMS = {
    "status": WORDS,
    "contact": WORDS | FLAGS,
    "no_contact": {flag: "open" if it == "contact" else "contact" for flag, it in FLAGS.items()},
}

#: A grid line is incomplete if it lacks more than GAPS times as many points as it has under
#: pressure. A grid is refused if such lines together lack more than FEW_GAPS times as many.
GAPS, FEW_GAPS = 0.5, 0.05

#: The statuses accepted in a file of shear forces. For "undecided" the force decides whether the
#: asperity is claimed to slide or to stick.
STATUSES = ("sliding", "partial", "sticking", "open", "undecided")

#: Words that mark a column as one of statuses, whatever its header.
OF_STATUS = {*WORDS, *STATUSES, "slip", "slipping", "stick", "stuck"}


@dataclass(frozen=True, kw_only=True)
class Manner(Reading):
    """How a file of forces is read."""

    sign: int = 1  # -1 if compression is negative
    tolerance: float | None = None  # [length] largest error of a position; default: 1 % of spacing
    missing_open: bool = False  # True if asperities without a row are open
    nodes: bool = False  # True if rows are nodes or pixels, summed by asperity
    floor: float = 0.0  # [force] loads up to this size count as 0
    scalable: bool = True

    def __post_init__(self) -> None:
        if self.tolerance is not None:
            checks.positive("--tolerance", self.tolerance)
        checks.between("--floor", self.floor, 0, checks.LARGEST)


class Claimed(NamedTuple):
    """Forces of a file, in the order of the scene's asperities."""

    path: Path
    values: Array
    status: NDArray[np.str_] | None  # (n,) the statuses in the file, if it has such a column
    note: str  # how the file was read, on one line
    explained: list[str]  # how each column was read
    numbers: list[str]  # the known names of the columns of numbers that were read


def judged(
    problem: NormalProblem,
    loads: Claimed,
    forces: Claimed | None = None,
    *,
    within: float,
    floor: float = 0.0,
    force: float = 0.0,
) -> list[Claim]:
    """The verdict on loads and, if any are given, that on shear forces with the sum `force`."""
    tolerance("--within", within)
    with blamed_on(loads.path):
        solved = forces is not None
        verdict = verify_on(problem, loads.values, within=within, floor=floor, solved=solved)
    if forces is None:
        return [verdict]
    if (contact := verdict.solution) is None:
        raise SolverError("no solution near the loads is found, so shear forces have no contact")
    sliding = _claimed_to_slide(forces, contact)
    with blamed_on("--shear-force"):
        sheared = verify_shear(contact, forces.values, force=force, within=within, sliding=sliding)
    alone = replace(verdict, solution=None)
    return [alone if alone.holds_by_default else verdict, sheared]


def _claimed_to_slide(forces: Claimed, contact: Contact) -> NDArray[np.bool_] | None:
    if forces.status is None:
        return None
    said, mistakes = np.char.lower(np.char.strip(forces.status)), list[str]()
    for each in np.unique(said[~np.isin(said, STATUSES)])[:10]:
        mistakes.append(f"column status: found {str(each)!r}, expected {', '.join(STATUSES)}")
    wrong = (contact.status == "contact") & (said == "open")
    wrong |= (contact.status == "open") & ~np.isin(said, ("open", "undecided"))
    for i in np.flatnonzero(wrong) if not mistakes else ():
        found = f'found "{said[i]}" at asperity {i}, which is proved {contact.status[i]}'
        mistakes.append(f"column status: {found}")
    refuse(forces.path, mistakes)
    by_force = claims_sliding(contact, forces.values)
    return np.where(said == "undecided", by_force, said == "sliding")


def read_forces(path: Path, scene: Scene, how: Manner, name: str = "load") -> Claimed:
    """Loads or shear forces [force] from the column "load" or "force" of a file. Its rows are
    assigned to asperities by position, else by an index, else in order; nodes are summed."""
    floor = how.floor if name == "load" else np.inf  # shear forces have any sign
    table = read_table(
        path,
        required=(name,),
        optional=("x", "y", *CLAIMS),
        instead=("pressure", "area") if name == "load" else (),
        unnamed=([name], ["x", "y", name]),
        line=0 if how.missing_open else len(scene),
        how=how,
    )
    columns, mistakes = table.columns, list[str]()
    given = [each for each in ("x", "y") if each in columns]
    if len(given) == 1:
        mistakes.append(f"columns: found only {given[0]}, expected x and y{unused(table)}")
    mistakes += _unread_statuses(table)
    summed = how.nodes or name not in columns
    if summed and not given:
        expected = f"both, of nodes or pixels{unused(table)}"
        mistakes.append(f"columns: found neither x nor y, expected {expected}")
    refuse(path, mistakes)
    read = name if name in columns else "pressure"
    areas = _areas(path, table, len(scene)) if read == "pressure" else 1.0
    values = columns[read] * areas * (how.sign if name == "load" else 1)
    place = Placing(scene, table, read, how.tolerance, how.missing_open, summed)
    owners = place.owners(values)
    forces = np.bincount(owners, values, minlength=len(scene)).astype(np.float64)

    def mistake(i: int, what: str) -> str:
        if summed:
            return f"load of asperity {i}{what}"
        return table.mistake(i, f", column {name}{what}")

    place.mistakes += _negative(forces if summed else values, floor, how.sign, read, mistake)
    if name == "load" and not summed:
        place.mistakes += _contradicted(values, floor, table)
    refuse(path, place.mistakes)
    status = None
    if "status" in columns:
        status = np.full(len(scene), "open", dtype=np.result_type(columns["status"], "U4"))
        status[owners] = columns["status"]
    if read == "pressure" and "area" not in columns:
        place.how += f", each of area {areas:.5g}"
    units = [f"{each} [{unit}]" for each, unit in table.units.items()]
    if name in columns and "pressure" in {bare(each).lower() for each in table.others}:
        units.append(f"column {name}, not pressure")
    read_how = [*(_not_compared(table, values > floor) if name == "load" else ()), place.how]
    read_how += () if summed else _of_another_scene(table, scene, owners)
    comments = f"comments not used: {shortened(' '.join(table.comments))}" if table.comments else ""
    note = ", ".join(filter(None, [table.style, *units, *read_how, comments]))
    explained, numbers = [*_explained(table), *read_how], [it for it in columns if COLUMNS[it].kind]
    return Claimed(path, frozen(forces), status, f"{path}: {note}", explained, numbers)


def _negative(
    loads: Array, floor: float, sign: float, name: str, mistake: Callable[[int, str], str]
) -> Iterator[str]:
    """A message, in which `mistake` names the row, for each load below -floor; or one for the
    column `name` if no load is positive."""
    if not len(bad := np.flatnonzero(loads < -floor)):
        return
    hint, largest, least = "", float(loads.max()), -float(loads[bad].min())
    if largest <= max(floor, SMALL * least):
        advice = "without --sign -1" if sign < 0 else "--sign -1"
        found = f"no {name} is positive"
        if largest > floor:
            found = f"no {name} is above {largest:.2g}, and the least is {-least:.4g}"
            advice += f" and --floor {bound(largest, 1)}"
        yield f"column {name}: {found}, expected positive compression: {advice}"
        return
    if least <= SMALL * largest:
        hint = f"; --floor {bound(least, 1)} counts noise as 0"
    for i in bad:
        found = f": found {float(loads[i])!r}, expected a number that is not negative{hint}"
        yield mistake(int(i), found)


def _statuses(table: ReadTable) -> Iterator[tuple[str, NDArray[np.str_], Mapping[str, str]]]:
    """For each column that says which asperities touch: its header, entries and `CLAIMS`."""
    for name, known in CLAIMS.items():
        if name in table.columns:
            yield bare(table.called[name]).lower(), np.char.strip(table.columns[name]), known


def _contradicted(loads: Array, floor: float, table: ReadTable) -> Iterator[str]:
    """A message for each row whose status or flag contradicts its load."""
    for header, entries, known in _statuses(table):
        found = np.char.lower(entries)
        said = np.array([known.get(each, "") for each in found])
        for i in np.flatnonzero(said == np.where(loads > floor, "open", "contact")):
            right = next(each for each, it in known.items()
                         if it != said[i] and (each in FLAGS) == (found[i] in FLAGS))  # fmt: skip
            expected = f'expected "{right}", as the load is {float(loads[i])!r}'
            expected += f", at most the --floor {floor:g}" if 0 < loads[i] <= floor else ""
            yield table.mistake(int(i), f', column {header}: found "{found[i]}", {expected}')


def _not_compared(table: ReadTable, loaded: NDArray[np.bool_]) -> Iterator[str]:
    """A note on each column with unknown words: some of them, in rows with and without a load."""
    for header, entries, known in _statuses(table):
        other = ~np.isin(np.char.lower(entries), (*known, "", "undecided"))
        if other.any():
            here, there = (sorted(set(entries[other & rows]))[:3] for rows in (loaded, ~loaded))
            with_load, without = (" or ".join(each) or "nothing" for each in (here, there))
            yield f"column {header} not compared ({with_load} with a load, {without} without)"


def _of_another_scene(table: ReadTable, scene: Scene, owners: Indices) -> Iterator[str]:
    """A note on each column of heights or tip radii that differ from those of the scene."""
    own = {"height": scene.asperities.heights, "tip_radius": scene.asperities.tip_radii}
    for header, cells in table.others.items():
        name = bare(header).lower()
        if name in own and cells.dtype.kind == "f" and unit(header) in ("", scene.units.length):
            allowed = ROUNDED * float(np.abs(own[name]).max())
            if (np.abs(cells - own[name][owners]) > allowed).any():
                yield f"column {name} differs from the scene's: loads of another scene?"


def _areas(path: Path, table: ReadTable, count: int) -> Any:
    """(m,) the areas of the nodes, or the area of one pixel of a regular grid."""
    columns = table.columns
    if "area" in columns:
        areas = columns["area"]
        wrong = np.flatnonzero((areas < 0) | ((areas == 0) & (columns["pressure"] != 0)))
        said = ", column area: found {:g}, expected a positive number"
        refuse(path, [table.mistake(i, said.format(areas[i])) for i in wrong.tolist()])
        return areas
    try:
        (i, dx), (j, dy) = (steps(name, columns[name]) for name in ("x", "y"))
        if len(i) < (i.max() + 1) * (j.max() + 1):  # not a full grid
            pixels = np.column_stack((i, j))
            # Up to `count` may be alone: the contact of each asperity may be one pixel large.
            alone = pixels[nearest_distances(pixels.astype(np.float64)) > 1.5]
            if len(alone) > count and (np.gcd.reduce(alone - alone[0]) > 1).all():
                raise InputError("x, y", found="pixels of several sizes", expected="one size")
        _check_whole(i, j, columns["pressure"] != 0)
    except InputError as error:
        expected = f"a column 'area', or x and y on a regular grid: {error.what} {error.found}"
        mistake = f"columns: found pressure without areas, expected {expected}"
        raise MistakesError(path, [mistake]) from error
    return dx * dy * (1 if np.ptp((i + j) % 2) else 2)


def _check_whole(i: Indices, j: Indices, loaded: NDArray[np.bool_]) -> None:
    """Raise InputError if a grid lacks points under pressure, as a coarser mesh does."""
    # A missing point with pressure on both sides can be a gap between two contacts (see GAPS).
    if not np.ptp((i + j) % 2):  # a hexagonal or diagonal grid: lines along its diagonals
        i, j = (i + j) // 2, (i - j - (i - j).min()) // 2
    missing = 0
    for line, place in ((i, j), (j, i)):
        width = int(place.max()) + 1
        points = line * width + place
        under = points[loaded]
        between = under[np.isin(under + 2 * width, under)] + width
        absent = np.bincount(between[~np.isin(between, points)] // width, minlength=line.max() + 1)
        present = np.bincount(line[loaded], minlength=line.max() + 1)
        missing += int(absent[absent > GAPS * present].sum())
    if missing > FEW_GAPS * np.count_nonzero(loaded):
        found = f"without {missing:,} points between points under pressure"
        raise InputError("x, y", found=found, expected="all points")


def _explained(table: ReadTable) -> Iterator[str]:
    yield f"rows: {len(table.rows):,}{f', {table.style}' if table.style else ''}"
    for name, called in table.called.items():
        unit = f" in {table.units[name]}" if name in table.units else ""
        times = f", times {table.factors[name]:.15g}" if name in table.factors else ""
        yield f"{name}: column {bare(called)}{unit}{times}"
    if left := [name for name in table.others if name and name not in table.called]:
        yield f"not looked at: {', '.join(left)}"


def _unread_statuses(table: ReadTable) -> Iterator[str]:
    """A message for each unread column that contains statuses, or flags that mean slip or stick."""
    for header, cells in table.others.items() if "status" not in table.columns else ():
        name, said = bare(header)[:60], {str(cell).strip().lower() for cell in cells.tolist()}
        if said & OF_STATUS and said <= {*OF_STATUS, ""}:
            named = f"--column status={quote(name)}"
            yield f"column {name}: found statuses, expected them in a column called status: {named}"
        elif re.fullmatch("(?i)(stick|slip|slid).*", name) and said <= FLAGS.keys():
            yield f"column {name}: found flags, expected a column status with words such as sliding"
