"""Claimed forces from a file, one per asperity of a scene, in the scene's order."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import permutations
from pathlib import Path
from shlex import quote
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from convexrough import checks
from convexrough.arrays import Array, Indices, frozen
from convexrough.errors import InputError, TableError
from convexrough.scene.neighbours import nearest_distances
from convexrough.scene.scene import Scene
from convexrough.surface.grid import steps
from convexrough.tabular.table import Reading, ReadTable, few, read_table
from convexrough.tabular.text import bare
from convexrough.verdict.verdict import rounded_up

#: Largest error of positions in a file, over the smallest spacing, unless a tolerance is given.
POSITION_TOLERANCE = 1e-2

#: Number of steps in which a shift of all nodes is estimated.
REFINEMENTS = 5

#: Largest number of shifts that are tried if rows are missing.
MOST_TRIED = 1000

#: Relative difference up to which the last row is the sum of the others.
TOTAL = 1e-4

#: Part of loaded nodes that may be far from all asperities, if not all positions are wrong.
FEW_FAR = 0.1

#: At most this many unread columns are compared with the positions of asperities.
MOST_UNREAD = 8

#: Largest accepted median distance of loaded nodes from the nearest asperities, over the spacing.
#: At random points the median is about 0.4.
BY_CHANCE = 0.25

#: Negative loads up to this fraction of the largest load may be noise.
SMALL = 1e-3

#: What a word in a column "status" or "contact" claims, and what a flag in "contact" does.
WORDS = {"contact": "contact", "closed": "contact", "open": "open"}
FLAGS = {"1": "contact", "1.0": "contact", "true": "contact", "yes": "contact", "0": "open",
         "0.0": "open", "false": "open", "no": "open"}  # fmt: skip

#: Words that are statuses of shear in a column of any name.
OF_SHEAR = {"sliding", "partial", "sticking", "slip", "slipping", "stick", "stuck", "undecided"}

#: Names of columns that can only be indices of asperities.
SURELY_INDEX = ("index", "asperity")


@dataclass(frozen=True, kw_only=True)
class Manner(Reading):
    """How a file of forces is read.

    sign      : -1 where compression is negative;  floor : [force] loads up to this are noise
    tolerance : [length] largest error of a position; default: 1 % of the smallest spacing
    missing_open : True if asperities without a row are open
    nodes     : True if rows are nodes or pixels, summed at the nearest asperity
    """

    sign: int = 1
    tolerance: float | None = None
    missing_open: bool = False
    nodes: bool = False
    floor: float = 0.0
    scalable: bool = True

    def __post_init__(self) -> None:
        if self.tolerance is not None:
            checks.positive("--tolerance", self.tolerance)
        checks.non_negative("--floor", self.floor)


class Claimed(NamedTuple):
    """Forces in the order of the scene's asperities.

    status : (n,) the statuses in the file, None without them
    note   : how the file was read, on one line;  explained : how each column was read
    """

    values: Array
    status: NDArray[np.str_] | None
    note: str
    explained: list[str]


def read_loads(path: Path, scene: Scene, how: Manner) -> Claimed:
    """Loads [force] from a file; noise up to the floor may be negative.

    Rows are matched by positions, else by an index, else by the scene's order. A column pressure,
    with areas or on a regular grid, is integrated over the points nearest to each asperity.

    Raises TableError with every mistake, and FileError.
    """
    return _read(path, scene, "load", how, how.floor)


def read_shear_forces(path: Path, scene: Scene, how: Manner) -> Claimed:
    """Shear forces [force] from the column `force` of a file, and statuses if it has them."""
    return _read(path, scene, "force", how, np.inf)


def _read(path: Path, scene: Scene, name: str, how: Manner, floor: float) -> Claimed:
    table = read_table(
        path,
        required=(name,),
        optional=("x", "y"),
        instead={"load": ("pressure", "area")},
        text=("status", "contact"),
        unnamed=((name,), ("x", "y", name)),
        how=how,
    )
    columns, mistakes = table.columns, list[str]()
    given, unused = [each for each in ("x", "y") if each in columns], _unused(table)
    if len(given) == 1:
        mistakes.append(f"columns: found only {given[0]}, expected x and y{unused}")
    mistakes += _unread_statuses(table)
    summed = how.nodes or name not in columns
    if summed and not given:
        expected = f"both, of nodes or pixels{unused}"
        mistakes.append(f"columns: found neither x nor y, expected {expected}")
    if mistakes:
        raise TableError(str(path), mistakes)
    areas = None if name in columns else _areas(path, columns)
    if areas is not None and "area" in columns:
        wrong = (areas < 0) | ((areas == 0) & (columns["pressure"] != 0))
        mistakes = [
            table.mistake(int(i), f", column area: found {areas[i]:g}, expected a positive number")
            for i in np.flatnonzero(wrong)
        ]
        if mistakes:
            raise TableError(str(path), few(mistakes))
    values = columns[name] if areas is None else columns["pressure"] * areas
    if name == "load":
        values = how.sign * values
    place = _Placing(scene, table, how, name if name in columns else "pressure")
    owners = place.nearest(values) if summed else place.owners()
    forces = np.bincount(owners, values, minlength=len(scene)).astype(np.float64)
    if summed:
        place.mistakes += _negative(
            forces, floor, how.sign, place.name, lambda i, what: f"load of asperity {i}{what}"
        )
    else:
        said = f", column {name}"
        place.mistakes += _negative(
            values, floor, how.sign, name, lambda i, what: table.mistake(i, said + what)
        )
        if name == "load":
            place.mistakes += _contradicted(columns, values, floor, table)
    if place.mistakes:
        raise TableError(str(path), few(place.mistakes))
    status = columns.get("status")
    if status is not None:
        status = frozen(_spread(status, owners, "open", len(scene)))
    if areas is not None and "area" not in columns:
        place.how += f", each of area {areas:.5g}"
    units = [f"{each} [{unit}]" for each, unit in table.units.items()]
    if name in columns and "pressure" in {bare(each).lower() for each in table.others}:
        units.append(f"column {name}, not pressure")
    note = ", ".join(filter(None, [table.style, *units, place.how]))
    return Claimed(frozen(forces), status, f"{path}: {note}", [*_explained(table), place.how])


def _negative(
    loads: Array, floor: float, sign: float, name: str, mistake: Callable[[int, str], str]
) -> Iterator[str]:
    """A message for each load below -floor, from a column; `mistake` adds its place."""
    if not len(bad := np.flatnonzero(loads < -floor)):
        return
    hint, largest, least = "", float(loads.max()), -float(loads[bad].min())
    if largest <= floor:
        advice = "without --sign -1" if sign < 0 else "--sign -1"
        yield f"column {name}: no {name} is positive, expected compression to be: {advice}"
        return
    if least <= SMALL * largest:
        hint = f"; --floor {rounded_up(least)} counts noise as 0"
    for i in bad:
        found = f": found {float(loads[i])!r}, expected a number that is not negative{hint}"
        yield mistake(int(i), found)


def _contradicted(
    columns: dict[str, NDArray[Any]], loads: Array, floor: float, table: ReadTable
) -> Iterator[str]:
    """A message for each row that is "contact" or "closed" without a load, or "open" with one."""
    touches = loads > floor
    for name, known in (("status", WORDS), ("contact", WORDS | FLAGS)):
        found = np.char.lower(np.char.strip(columns.get(name, np.full(len(loads), ""))))
        said = np.array([known.get(each, "") for each in found])
        for i in np.flatnonzero(said == np.where(touches, "open", "contact")):
            right = (("0", "1") if found[i] in FLAGS else ("open", "contact"))[int(touches[i])]
            expected = f'expected "{right}", as the load is {float(loads[i])!r}'
            yield table.mistake(int(i), f', column {name}: found "{found[i]}", {expected}')


def _spread(values: NDArray[Any], owners: Indices, rest: str, count: int) -> NDArray[Any]:
    result = np.full(count, rest, dtype=np.result_type(values, np.array(rest)))
    result[owners] = values
    return result


def _areas(path: Path, columns: dict[str, NDArray[Any]]) -> Any:
    """The areas of nodes, or the one area of a regular grid."""
    if "area" in columns:
        return columns["area"]
    try:
        (i, dx), (j, dy) = (steps(path, name, columns[name]) for name in ("x", "y"))
    except InputError as error:
        expected = f"a column 'area', or x and y on a regular grid: {error.what} {error.found}"
        mistake = f"columns: found pressure without areas, expected {expected}"
        raise TableError(str(path), [mistake]) from error
    return dx * dy * (1 if np.ptp((i + j) % 2) else 2)


def _explained(table: ReadTable) -> Iterator[str]:
    yield f"rows: {len(table.rows):,}{f', {table.style}' if table.style else ''}"
    for name, called in table.called.items():
        unit = f" in {table.units[name]}" if name in table.units else ""
        times = f", times {table.factors[name]:.15g}" if name in table.factors else ""
        yield f"{name}: column {bare(called)}{unit}{times}"
    if table.others:
        yield f"not looked at: {', '.join(table.others)}"


def _unused(table: ReadTable) -> str:
    """The end of a message, with the names of columns that are not read."""
    return f"; not used: {', '.join(table.others)}" if table.others else ""


def _unread_statuses(table: ReadTable) -> Iterator[str]:
    """A message for each column of statuses, or of flags of slip, that is not read."""
    for header, cells in table.others.items() if "status" not in table.columns else ():
        name, said = bare(header), {str(cell).strip().lower() for cell in cells.tolist()}
        known = {*WORDS, *OF_SHEAR}
        if said & known and said <= {*known, ""}:
            yield f"column {name}: found statuses, expected them in a column called status"
        elif re.fullmatch("(?i)(stick|slip|slid).*", name) and said <= FLAGS.keys():
            yield f"column {name}: found flags, expected a column status with words such as sliding"


def _unused_positions(others: Iterable[str]) -> Iterator[str]:
    """A message if unread columns have names similar to x and y."""
    found = {it[0].lower(): it for it in others if re.fullmatch(r"[xyXY][ _.(\[].*", it)}
    if len(found) == 2:
        x, y = found["x"], found["y"]
        yield f"columns {x}, {y}: found no x and y, expected --column x={x} --column y={y}"


class _Placing:
    """The asperity of each row of a table, how it was found, and mistakes."""

    def __init__(self, scene: Scene, table: ReadTable, manner: Manner, name: str) -> None:
        self.scene, self.table, self.manner, self.name = scene, table, manner, name
        self.mistakes: list[str] = []
        self.how = "in the scene's order"
        columns = table.columns
        self.points = np.column_stack((columns["x"], columns["y"])) if "x" in columns else None

    def owners(self) -> Indices:
        count, rows = len(self.scene), len(self.table.rows)
        found = np.arange(rows) if self.points is None else self._matched(self.points)
        by = "positions"
        if self.points is None:
            by = ""
            self.mistakes += _unused_positions(self.table.others)
            for name, index in {**self.table.indices, **self._permutations()}.items():
                if (numbered := self._numbered(name, index)) is not None:
                    found, by = numbered, f"column {name or 'without a name'}"
                    break
            if not by and not self.mistakes and rows == count:
                self.mistakes += self._unused_positions()
        known = by or self.mistakes
        if rows != count and not (rows < count and known and self.manner.missing_open):
            advice = "" if by else _unused(self.table)
            if rows > count and (
                self.points is None or len(np.unique(self.points, axis=0)) > count
            ):
                advice += "; --nodes adds up rows at their nearest asperity"
            if rows < count and by:
                advice = "; --missing-open takes the others for open"
            expected = f"expected {count}, one per asperity of the scene{advice}"
            if rows == count + 1 and self._totals:
                self.mistakes = [self._totals]
            else:
                self.mistakes.insert(0, f"rows: found {rows}, {expected}")
        return found

    def _permutations(self) -> dict[str, Indices]:
        """Unread columns that number all asperities, from 0 or from 1, in another order."""
        count, found = np.arange(len(self.scene)), dict[str, Indices]()
        for name, cells in self.table.others.items():
            if cells.dtype.kind == "f" and len(cells) == len(count) and (np.diff(cells) < 0).any():
                first = float(cells.min())
                if first in (0.0, 1.0) and (np.sort(cells) == count + first).all():
                    found[name] = cells.astype(np.intp)
        return found

    def _unused_positions(self) -> Iterator[str]:
        """A message if two unread columns are positions of the asperities in another order."""
        numbers = {bare(name): it for name, it in self.table.others.items() if it.dtype.kind == "f"}
        for (a, one), (b, other) in permutations([*numbers.items()][:MOST_UNREAD], 2):
            for angle, what in ((other, "polar coordinates (in radians)"),
                                (np.radians(other), "polar coordinates (in degrees)"),
                                (None, "positions")):  # fmt: skip
                points = np.column_stack(
                    (one, other) if angle is None else (one * np.cos(angle), one * np.sin(angle))
                )
                distances, owners = _nearest(self.scene.asperities.positions, points)
                if distances.max() > self._allowed or len(np.unique(owners)) < len(owners):
                    continue
                if (owners == np.arange(len(owners))).all():
                    return
                found = f"columns {a}, {b}: found {what} in another order than the scene's"
                named = f"--column x={quote(a)} --column y={quote(b)}"
                yield f"{found}, expected {'columns x and y' if angle is not None else named}"
                return

    def nearest(self, values: Array) -> Indices:
        """The nearest asperity of each node or pixel; a loaded one must be near its asperity."""
        assert self.points is not None
        distances, owners = _nearest(self.scene.contact_points, self.points)
        apart = np.full(len(self.scene), self.scene.sphere_radius)
        if len(self.scene) > 1:
            apart = nearest_distances(self.scene.asperities.positions)
        far = np.flatnonzero((values != 0) & (distances > apart[owners]))
        loaded, pressed = self.points[values != 0], np.abs(values[values != 0])

        def fits(points: Array) -> bool:
            """True if points are near to several asperities, and nearer than random points."""
            near, their = _nearest(self.scene.contact_points, points)
            parts = near / apart[their]
            return bool(parts.max() <= 1 and np.median(parts) < BY_CHANCE and np.ptp(their) > 0)

        closer = np.setdiff1d(np.flatnonzero(values), far)
        most = self.points[closer] if len(far) <= FEW_FAR * len(loaded) else loaded
        if len(loaded) and not fits(most):
            middle = np.average(loaded, axis=0, weights=pressed)
            for _ in range(REFINEMENTS):  # the mean distance from the nearest asperities
                places = self.scene.contact_points
                near = places[_nearest(places, loaded - middle)[1]]
                middle = np.average(loaded - near, axis=0, weights=pressed)
            moved = self._moved(loaded, fits) or (
                f"all are shifted by about {_pair(middle)}, expected them from the axis of the "
                "sphere" if fits(loaded - middle) else "")  # fmt: skip
            if moved:
                self.mistakes.append(f"positions: {moved}")
                return owners
        for i in far:
            found = (
                f"a load at {self.points[i].tolist()}, {distances[i]:g} from the nearest asperity"
            )
            self._refuse(i, found, f"less than to its neighbour, {apart[owners[i]]:.3g}")
        if self.name == "pressure":
            self._refuse_repeated(self.points @ [1, 1j], values != 0, "each node or pixel once")
        self.how = f"{len(owners):,} nodes summed at their nearest asperities"
        return owners

    def _refuse(self, row: Any, found: str, expected: str) -> None:
        self.mistakes.append(self.table.mistake(int(row), f": found {found}, expected {expected}"))

    def _refuse_repeated(
        self, places: NDArray[Any], chosen: NDArray[np.bool_], expected: str
    ) -> None:
        """Add a mistake for each row, of those chosen, with the place of an earlier one."""
        _, first, back = np.unique(places, return_index=True, return_inverse=True)
        for i in np.flatnonzero((first[back] != np.arange(len(places))) & chosen):
            self._refuse(i, f"the same position as in {self.table.rows[first[back[i]]]}", expected)

    def _numbered(self, name: str, index: NDArray[np.intp]) -> Indices | None:
        """The indices of asperities in a column that counts from 0 or 1; else None."""
        count, least, most = len(self.scene), int(index.min()), int(index.max())
        values, times = np.unique(index, return_counts=True)
        sure = bare(name).lower() in SURELY_INDEX or (bool(name) and self.manner.missing_open)
        # Increasing numbers may be those of nodes and are ignored. In another order, or if nearly
        # all fit, they are indices.
        if times.max() == 1:
            sure |= bool(name) and bool((np.diff(index) < 0).any())
        else:
            sure |= bool(name) and 2 * len(values) > len(index) and most - min(least, 1) < count
        wrong = ""
        if times.max() > 1:
            twice = values[times.argmax()]
            where = " and ".join(self.table.rows[i] for i in np.flatnonzero(index == twice)[:2])
            wrong = f"{twice} in {where}, expected each asperity once"
        elif least > 0 and most < count:
            wrong = f"{least} to {most}: from 0 or from 1? Expected x and y, or a row of asperity 0"
            wrong = wrong.replace(f"{least} to", f"numbers from {least} to")
        elif most - (first := min(least, 1)) >= count:
            wrong = f"{most}, expected at most {count - 1 + first}, the last asperity"
        else:
            self.how = f"in the order of column {name or '1'}, from {first}"
            return index - first
        if sure:
            self.mistakes.append(f"column {name}: found {wrong}")
        return None

    @property
    def _totals(self) -> str:
        """A message if the last row has the sum of the others; else ""."""
        *others, last = self.table.columns[self.name].tolist()
        if math.isclose(math.fsum(others), last, rel_tol=TOTAL):
            found = "found the sum of the others"
            return self.table.mistake(-1, f": {found}, expected only asperities: remove the row")
        return ""

    @cached_property
    def _spacing(self) -> float:
        """[length] the smallest distance of two asperities; the tip radius of a single one."""
        positions = self.scene.asperities.positions
        if len(positions) == 1:
            return float(self.scene.asperities.tip_radii[0])
        return float(nearest_distances(positions).min())

    @cached_property
    def _allowed(self) -> float:
        """[length] largest distance of a position from its asperity."""
        given, half = self.manner.tolerance, self._spacing / 2
        if given is not None and given > half and len(self.scene) > 1:
            expected = f"at most {half:.3g}, half the smallest distance of two asperities"
            raise InputError("--tolerance", found=given, expected=expected)
        return POSITION_TOLERANCE * self._spacing if given is None else given

    def _matched(self, points: Array) -> Indices:
        """The asperity at each point; no asperity may occur twice."""
        positions, allowed = self.scene.asperities.positions, self._allowed
        distances, owners = _nearest(positions, points)
        far, alone = distances > allowed, len(np.unique(owners)) == len(owners)
        self.how = f"matched by position (largest distance {distances.max():.2g})"
        doubtful = far.any() if len(points) == len(positions) else far.mean() > 0.5
        doubtful |= not alone

        def fits(points: Array) -> bool:
            distances, owners = _nearest(positions, points)
            return bool(distances.max() <= allowed) and len(np.unique(owners)) == len(owners)

        moved = (
            self._moved(points, fits) or self._shifted(points, allowed, fits) if doubtful else ""
        )
        if moved:
            self.mistakes.append(f"positions: {moved}")
            return owners
        most = float(distances.max())
        if far.any() and alone and float(rounded_up(most)) <= self._spacing / 2:
            found = f"found them up to {most:.3g} from the nearest asperities"
            advice = f"if they are rounded: --tolerance {rounded_up(most)}"
            self.mistakes.append(f"positions: {found}, expected at most {allowed:.3g}; {advice}")
            return owners
        for i in np.flatnonzero(far):
            found = f"position {points[i].tolist()}, {distances[i]:g} from the nearest asperity"
            self._refuse(i, found, f"a position of the scene to {allowed:.3g}")
        self._refuse_repeated(owners, ~far, "each asperity once")
        return owners

    def _moved(self, points: Array, fits: Callable[[Array], bool]) -> str:
        """A sentence on the exchange, sign or unit of x and y that makes all fit; else ""."""
        x, y = (self._called(name) for name in ("x", "y"))
        exchange = f"--column x={y} --column y={x}"
        held = {name: self.table.columns[name] for name in ("x", "y", self.name)}
        for a, b, c in permutations(held):
            if {a, b} != {"x", "y"} and fits(np.column_stack((held[a], held[b]))):
                pairs = zip(held, (a, b, c), strict=True)
                named = " ".join(f"--column {one}={self._called(other)}" for one, other in pairs)
                return f"the header names the columns in another order: {named}"
        if fits(points[:, ::-1]):
            return f"x and y are exchanged, or the array is turned: {exchange}"
        for signs, names in (([-1, 1], "x"), ([1, -1], "y"), ([-1, -1], "xy")):
            if fits(points * signs):
                ways = " ".join(f"--scale {name}=-1" for name in names)
                verb = "has" if len(names) == 1 else "have"
                return f"{' and '.join(names)} {verb} the other sign: {ways}"
        for power in (*range(-9, 0), *range(1, 10)):
            if fits(points * 10.0**-power):
                return _too_far_out(power)
        return ""

    def _called(self, name: str) -> str:
        return quote(bare(self.table.called[name]))

    def _shifted(self, points: Array, allowed: float, fits: Callable[[Array], bool]) -> str:
        """A sentence on the shift that makes all points fit; else ""."""
        positions = self.scene.asperities.positions
        tried: Sequence[Any] = positions[:MOST_TRIED] - points[0]
        if len(points) == len(positions):
            tried = [positions.mean(axis=0) - points.mean(axis=0)]
        for shift in tried:
            if fits(points[:20] + shift) and fits(points + shift):
                digit = 0.1 * min(allowed, float(np.abs(shift).max()))
                expected = f"expected them from the axis of the sphere, to {allowed:.3g}"
                return f"all are shifted by {_pair(np.round(-shift / digit) * digit)}, {expected}"
        return ""


def _pair(point: Array) -> str:
    return f"[{', '.join(f'{each + 0.0:.4g}' for each in point)}]"


def _too_far_out(power: int) -> str:
    ways = " ".join(f"--scale {name}={10.0**-power:g}" for name in "xy")
    return (
        f"found them 10^{power} times as far out as the scene's, expected the scene's "
        f"unit of length: {ways}"
    )


def _nearest(positions: Array, points: Array) -> tuple[Array, Indices]:
    from scipy.spatial import cKDTree  # takes 0.1 s to import

    distances, owners = cKDTree(positions).query(points)
    return np.asarray(distances), np.asarray(owners)
