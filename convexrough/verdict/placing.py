"""The asperity of each row of a file: by position, by an index, or in the scene's order."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import chain, permutations
from shlex import quote
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array, Indices
from convexrough.contact import discs_of
from convexrough.errors import InputError
from convexrough.normal.claims import turned
from convexrough.scene.neighbours import nearest_distances
from convexrough.scene.scene import Scene
from convexrough.tabular.columns import bound
from convexrough.tabular.roles import is_index
from convexrough.tabular.table import ReadTable, in_sheet
from convexrough.tabular.units import bare

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

#: Default of the largest error of a position in a file, as a fraction of the smallest spacing.
POSITION_TOLERANCE = 1e-2

#: Iterations: that estimate a common shift of all nodes; that assign nodes to the discs of the last
#: assignment; and, if rows are missing, shifts that move the first row to another asperity.
REFINEMENTS, ROUNDS, MOST_TRIED = 5, 20, 1000

#: The last row counts as the sum of the others up to this relative difference.
TOTAL = 1e-4

#: Distances of loaded nodes from their nearest asperities, as fractions of those asperities'
#: distances from their neighbours: the largest accepted (at 1 the node may be an asperity that the
#: scene lacks), and the largest accepted median (about 0.4 for random points). If more than FEW_FAR
#: of the nodes are too far, all positions may be wrong, else only theirs.
REACH, BY_CHANCE, FEW_FAR = 0.9, 0.25, 0.1

#: At most this many unread columns are named, or compared with the positions of asperities.
MOST_UNREAD = 8

#: Numbers with signs of both kinds, of which the fewer reach this part of the others in size, are
#: positions rather than loads.
BOTH_SIGNS = 0.1

#: Names of columns that can only be indices of asperities.
SURELY_INDEX = ("index", "asperity")

#: Another way to interpret the positions: the message, and the points (m, 2).
Read = tuple[str, Array]


@dataclass
class Placing:
    """The assignment of the rows of a table to asperities; more fields are those of `Manner`."""

    scene: Scene
    table: ReadTable
    column: str  # the name of the column of loads, pressures or forces
    tolerance: float | None
    missing_open: bool
    summed: bool  # True if rows are nodes or pixels, each of which belongs to one asperity
    how: str = "in the scene's order"  # how rows were assigned, in words
    mistakes: list[str] = field(default_factory=list)  # messages about wrong rows

    @cached_property
    def points(self) -> Array:
        """(m, 2) [length] x and y of the rows."""
        return np.column_stack([self.table.columns[name] for name in "xy"])

    def owners(self, values: Array) -> Indices:
        """(m,) the index of the asperity of each row, with loads or forces `values`."""
        if self.summed:
            return self._nearest_to_each(values)
        placed = "x" in self.table.columns
        found, by = (self._matched(), True) if placed else self._numbered_or_in_order()
        count, rows = len(self.scene), len(self.table.rows)
        if rows == count or (rows < count and (by or self.mistakes) and self.missing_open):
            return found
        if said := (self._total() if rows == count + 1 else "") or self._several_tables():
            self.mistakes = [said]
            return found
        advice = "" if by else unused(self.table)
        if rows < count and (by or self._indices()):
            advice = f"{self.part}; --missing-open claims that the others are open"
        elif rows > count and (not placed or len(np.unique(self.points, axis=0)) > count):
            advice += "; --nodes sums rows by asperity"
        expected = f"expected {count}, one per asperity of the scene{advice}"
        where = in_sheet(self.table.style)
        self.mistakes.insert(0, f"rows: found {rows}{where}, {expected}")
        return found

    def _nearest_to_each(self, values: Array) -> Indices:
        """(m,) the asperity nearest to each node or pixel; `mistakes` names nodes that are far."""
        loaded = values != 0
        distances, owners = self._nearest(self.points)
        far = loaded & (distances > REACH * self._apart[owners])
        most = loaded & ~far if far.sum() <= FEW_FAR * loaded.sum() else loaded
        moved = ""
        if loaded.any() and not self._fits(self.points[most]):
            points, weights = self.points[loaded], np.abs(values[loaded])
            moved = self._misread(points, self._about_shifted(points, weights))
        if moved:
            self.mistakes.append(f"positions: {moved}")
            return owners
        for i in np.flatnonzero(far):
            place = self.points[i].tolist()
            found = f"a load at {place}, {distances[i]:g} from the nearest asperity"
            limit = f"{REACH * self._apart[owners[i]]:.3g}, {REACH:g} of that asperity's distance"
            self._refuse(i, found, f"at most {limit} from its neighbour")
        if self.column == "pressure":
            self._refuse_repeated(self.points @ [1, 1j], loaded, "each node or pixel once")
        elif any(map(is_index, self.table.others)):
            cells = *self.table.columns.values(), *self.table.others.values()
            rows = [*zip(*(each.tolist() for each in cells), strict=True)]
            first = {row: i for i, row in reversed([*enumerate(rows)])}
            self._refuse_repeated(np.array([first[row] for row in rows]), loaded, "each node once")
        self.how = f"{len(owners):,} nodes summed by asperity"
        if self.column == "force" or not loaded.any():
            return owners
        owners, radii = self._by_discs(values, owners)
        distances = np.hypot(*(self.points - self.scene.contact_points[owners]).T)
        held = loaded & (radii[owners] > 0)
        farthest = float((distances[held] / radii[owners[held]]).max(initial=0.0))
        self.how += f" (largest distance {farthest:.3g} contact radii)"
        return owners

    def _by_discs(self, values: Array, owners: Indices) -> tuple[Indices, Array]:
        """(m,) the asperity of each node, and (n,) the radii a_i of the discs under the sums.

        It has the least r_i^2 - a_i^2, with its distance r_i from the node. So discs that do not
        overlap keep all of their nodes. If one reaches beyond its neighbour, the nearest are taken.
        """
        from scipy.spatial import cKDTree  # takes 0.1 s to import

        def discs(owners: Indices) -> Array:
            loads = np.bincount(owners, values, minlength=len(self.scene)).clip(min=0.0)
            return discs_of(self.scene, loads)

        nodes, nearest = np.column_stack((self.points, np.zeros(len(owners)))), owners
        for _ in range(ROUNDS):
            radii, before = discs(owners), owners
            if (radii > self._apart).any():  # loads in a wrong unit
                break
            height = np.sqrt(np.maximum(radii.max() ** 2 - radii**2, 0.0))
            raised = cKDTree(np.column_stack((self.scene.contact_points, height)))
            owners = np.asarray(raised.query(nodes)[1])
            if np.array_equal(owners, before):
                return owners, radii
        return nearest, discs(nearest)

    @property
    def part(self) -> str:
        """A text if rows are on one side of an axis only, and asperities on both; else ""."""
        own, near = self.scene.contact_points, POSITION_TOLERANCE * self._spacing
        points = self.points if "x" in self.table.columns else own
        ways = (("x >=", (1, 0)), ("x <=", (-1, 0)), ("y >=", (0, 1)), ("y <=", (0, -1)))
        sides = [f"{side} 0" for side, along in ways
                 if (points @ along).min() >= -near > (own @ along).min()
                 and (points @ along).max() > near]  # fmt: skip
        return f"; rows only at {', '.join(sides)}: part of a symmetric array?" if sides else ""

    # By an index, or in order

    def _numbered_or_in_order(self) -> tuple[Indices, bool]:
        """(m,) the asperity of each row; True if a column gives it, False if the order does."""
        headers = self.table.others
        places = {it[0].lower(): it for it in headers if re.fullmatch(r"[xyXY][ _.(\[].*", it)}
        if len(places) == 2:
            x, y = places["x"], places["y"]
            expected = f"expected --column x={x} --column y={y}"
            self.mistakes.append(f"columns {x}, {y}: found no x and y, {expected}")
        for name, index in (indices := self._indices()).items():
            if (numbered := self._numbered(name, index)) is not None:
                self.mistakes += self._doubts(name, numbered, indices)
                return numbered, True
        rows = len(self.table.rows)
        if nameless := [name for name in self.table.others if name.isdecimal()]:
            self.how += f" (not used: columns {', '.join(nameless)})"
        if not self.mistakes and rows == len(self.scene):
            self.mistakes += self._unread_positions()
        return np.arange(rows), False

    def _indices(self) -> dict[str, Indices]:
        """Unread columns that may be indices, by header; first those whose header says so, of which
        a row number comes last."""
        count = np.arange(len(self.scene))
        named, others = dict[str, Indices](), dict[str, Indices]()
        held = self.table.others
        held = {"index": held["index"]} if "index" in self.table.called else held
        for name, cells in held.items():
            whole = np.char.isdecimal(cells.astype(str))
            if cells.dtype.kind == "f":
                whole = (np.floor(cells) == cells) & (cells >= 0) & (cells < 2**53)
            if cells.dtype.kind != "f" or not whole.all():
                if bare(name).lower() in SURELY_INDEX and len(cells) == len(count):
                    first = int(np.argmin(whole))
                    found = f"{cells[first]} in {self.table.rows[first]}"
                    right = "whole numbers from 0 or 1; rename the column if rows are in order"
                    self.mistakes.append(f"column {name}: found {found}, expected {right}")
                continue
            index = cells.astype(np.intp)
            least, falls = index.min(), (np.diff(index) < 0).any()
            if is_index(name):
                named[name] = index
            elif falls and least <= 1 and np.array_equal(np.sort(index), count + least):
                others[name] = index

        def doubt(name: str) -> tuple[bool, bool]:
            return bare(name).lower() not in SURELY_INDEX, bool((np.diff(named[name]) == 1).all())

        return {name: named[name] for name in sorted(named, key=doubt)} | others

    def _doubts(
        self, name: str, numbered: Indices, indices: Mapping[str, Indices]
    ) -> Iterator[str]:
        """A message if the header of the index `name` does not say so, or another one differs."""
        if not is_index(name):
            expected = f"the scene's order and no such column, or --column index={quote(name)}"
            yield f"column {name}: found each index once, expected {expected}"
        for other, index in indices.items():
            index = index - min(int(index.min()), 1)
            differs = (np.diff(index) < 0).any() and (index != numbered).any()
            if is_index(other) and differs and np.array_equal(np.sort(index), np.sort(numbered)):
                found = f"found asperities {numbered[0]}, ... and {index[0]}, ..."
                yield f"columns {name}, {other}: {found}, expected one index: --column index=NAME"

    def _numbered(self, name: str, index: Indices) -> Indices | None:
        """(m,) indices from 0, from a column that counts from 0 or 1; None for other columns."""
        count, least, most = len(self.scene), int(index.min()), int(index.max())
        values, times = np.unique(index, return_counts=True)
        sure = bare(name).lower() in SURELY_INDEX or (bool(name) and self.missing_open)
        # Distinct increasing numbers may be numbers of nodes, so mistakes in them are ignored.
        # Numbers are surely indices if they decrease somewhere. They also are if all are in the
        # range of indices, and some of them, but less than half, are repetitions.
        if times.max() == 1:
            sure |= bool(name) and bool((np.diff(index) < 0).any())
        else:
            sure |= bool(name) and 2 * len(values) > len(index) and most - min(least, 1) < count
        if times.max() > 1:
            twice = values[times.argmax()]
            where = " and ".join(self.table.rows[i] for i in np.flatnonzero(index == twice)[:2])
            wrong = f"{twice} in {where}, expected each asperity once"
        elif least > 0 and most < count:
            more = f"0, if they count from 0, or {count}, if they count from 1"
            wrong = f"numbers from {least} to {most}, expected also {more}"
            wrong += f": add this row with {self.column} 0"
        elif most - (first := min(least, 1)) >= count:
            last = f"{count - 1 + first}, the last asperity"
            wrong = f"{most}, expected at most {last}; or columns x and y"
        else:
            self.how = f"in the order of column {name or '1'}, from {first}"
            return index - first
        if sure:
            self.mistakes.append(f"column {name}: found {wrong}")
        return None

    def _unread_positions(self) -> Iterator[str]:
        """A message if unread columns are Cartesian or polar positions in another order."""
        numbers = {
            bare(name): cells
            for name, cells in self.table.others.items()
            if cells.dtype.kind == "f" and np.isfinite(cells).all()
        }
        for (a, one), (b, other) in permutations([*numbers.items()][:MOST_UNREAD], 2):
            for what, points in {
                "polar coordinates (in radians)": _polar(one, other),
                "polar coordinates (in degrees)": _polar(one, np.radians(other)),
                "positions": np.column_stack((one, other)),
            }.items():
                if not self._fits(points):
                    continue
                if (self._nearest(points)[1] != np.arange(len(points))).any():
                    named = f"--column x={quote(a)} --column y={quote(b)}"
                    expected = named if what == "positions" else "columns x and y"
                    found = f"found {what} in another order than the scene's"
                    yield f"columns {a}, {b}: {found}, expected {expected}"
                return

    def _several_tables(self) -> str:
        """A message if the values of a column divide the rows into several tables; else ""."""
        count = len(self.scene)
        for name, cells in self.table.others.items():
            values, times = np.unique(cells, return_counts=True)
            if len(values) > 1 and (times == count).all():
                some = ", ".join(map(str, values[:3].tolist())) + ", ..." * (len(values) > 3)
                found = f"found {len(values)} values ({some}) in {count} rows each"
                return f"column {name}: {found}, expected the rows of one value"
        return ""

    def _total(self) -> str:
        """A message if the last row holds the sum of all other rows; else ""."""
        *others, last = self.table.columns[self.column].tolist()
        if math.isclose(math.fsum(others), last, rel_tol=TOTAL):
            found = "found the sum of the others"
            return self.table.mistake(-1, f": {found}, expected only asperities: remove the row")
        return ""

    # By position

    @cached_property
    def _tree(self) -> cKDTree:
        from scipy.spatial import cKDTree  # takes 0.1 s to import

        tops, contact_points = self.scene.asperities.positions, self.scene.contact_points
        if self.summed or "x" not in self.table.columns:
            return cKDTree(contact_points if self.summed else tops)
        of_tops, others = cKDTree(tops), cKDTree(contact_points)
        far = [float(np.median(tree.query(self.points)[0])) for tree in (of_tops, others)]
        # With the closest-point geometry, files can have the tops or the contact points.
        return others if far[1] <= self._allowed < far[0] else of_tops

    def _nearest(self, points: Array) -> tuple[Array, Indices]:
        """(m,) [length], (m,) the distance of the nearest asperity to each point, and its index."""
        distances, owners = self._tree.query(points)
        return np.asarray(distances), np.asarray(owners)

    @cached_property
    def _apart(self) -> Array:
        """(n,) [length] the distance of each asperity from its nearest neighbour, if it has one."""
        if len(self.scene) == 1:
            return np.array([np.min(self.scene.sphere_radius)])
        return nearest_distances(self.scene.asperities.positions)

    @cached_property
    def _spacing(self) -> float:
        """[length] the smallest distance of two asperities, or the tip radius of the only one."""
        alone = len(self.scene) == 1
        return float(self.scene.asperities.tip_radii[0] if alone else self._apart.min())

    @cached_property
    def _allowed(self) -> float:
        """[length] the tolerance, or its default. Raises InputError if it is too large."""
        given, half = self.tolerance, self._spacing / 2
        if given is not None and given > half and len(self.scene) > 1:
            expected = f"at most {half:.3g}, half the smallest distance of two asperities"
            raise InputError("--tolerance", found=given, expected=expected)
        return POSITION_TOLERANCE * self._spacing if given is None else given

    def _fits(self, points: Array) -> bool:
        """True if each point is at an asperity, and no two points are at the same one; or if nodes
        are nearer to asperities than random points, and not all near the same."""
        distances, owners = self._nearest(points)
        if not self.summed:
            return bool(distances.max() <= self._allowed) and len(np.unique(owners)) == len(owners)
        parts = distances / self._apart[owners]
        return bool(parts.max() <= REACH and np.median(parts) < BY_CHANCE and np.ptp(owners) > 0)

    def _matched(self) -> Indices:
        """(m,) the asperity at each point; `mistakes` names points at none, or two at the same."""
        points, allowed = self.points, self._allowed
        distances, owners = self._nearest(points)
        far, alone = distances > allowed, len(np.unique(owners)) == len(owners)
        most = float(distances.max())
        self.how = f"matched by position (largest distance {most:.2g})"
        doubtful = far.any() if len(points) == len(self.scene) else far.mean() > 0.5
        if doubtful or not alone:
            if moved := self._misread(points, self._shifted(points)):
                self.mistakes.append(f"positions: {moved}")
                return owners
            placed = len(np.unique(owners[~far]))
            if 2 * placed < len(points) and [*self._called.values()] == ["1", "2", "3"]:
                found = f"found {placed} positions of asperities in {len(points)} rows"
                forces = "if the columns are forces along x, y and z: --column load=3"
                self.mistakes.append(f"columns 1, 2: {found}, expected x, y, load; {forces}")
                return owners
        if far.any() and alone and float(bound(most, 1)) <= self._spacing / 2:
            found = f"found them up to {most:.3g} from the nearest asperities"
            advice = f"if they are rounded: --tolerance {bound(most, 1)}"
            self.mistakes.append(f"positions: {found}, expected at most {allowed:.3g}; {advice}")
            return owners
        for i in np.flatnonzero(far):
            found = f"position {points[i].tolist()}, {distances[i]:g} from the nearest asperity"
            self._refuse(i, found, f"a position of the scene, to within {allowed:.3g}")
        self._refuse_repeated(owners, ~far, "each asperity once")
        return owners

    def _misread(self, points: Array, shifted: Iterator[Read]) -> str:
        """A message on columns, signs, units or a shift with which points fit; "" if none do."""
        orders, named = self._orders(), chain(self._readings(points), shifted)
        ways = chain(named, orders) if self._may_be_loads(self.column) else chain(orders, named)
        return next((said for said, points in ways if self._fits(points)), "")

    def _may_be_loads(self, name: str) -> bool:
        low, high = (float(each(self.table.columns[name])) for each in (np.min, np.max))
        return min(-low, high) <= BOTH_SIGNS * max(-low, high)

    @cached_property
    def _called(self) -> dict[str, str]:
        """The headers of x, y and the loads, quoted; numbers if there is no header."""
        return {name: quote(bare(self.table.called[name])) for name in ("x", "y", self.column)}

    @property
    def _headed(self) -> bool:
        return not all(map(str.isdecimal, self._called.values()))

    def _orders(self) -> Iterator[Read]:
        """The columns in each order in which the column of loads holds positions."""
        held, start = self.table.columns, "the header names" if self._headed else "no header, and"
        for order in permutations(self._called):
            if order[2] != self.column and self._may_be_loads(order[2]):
                named = dict(zip(self._called, map(self._called.__getitem__, order), strict=True))
                said = f"{start} the columns in another order: {_options('column', named)}"
                yield said, np.column_stack([held[name] for name in order[:2]])

    def _readings(self, points: Array) -> Iterator[Read]:
        """Other axes, turns, signs and units of x and y."""
        called = self._called
        exchanged = {"x": called["y"], "y": called["x"]}
        exchange = _options("column", exchanged if self._headed else called | exchanged)
        turns = [it for it in (30, -30, 45, -45, 90, -90) if self._fits(turned(points, -it))]
        turn = f"the array is turned by {' or '.join(map(str, turns))} degrees: turn it back"
        yield f"x and y are exchanged: {exchange}{f'; or {turn}' * bool(turns)}", points[:, ::-1]
        yield from ((turn, turned(points, -each)) for each in turns[:1])
        for names, verb in (("x", "has"), ("y", "has"), ("xy", "have")):
            factors = {name: -self.table.factors.get(name, 1.0) for name in names}
            ways = _options("scale", {name: f"{each:.15g}" for name, each in factors.items()})
            signs = [-1 if name in names else 1 for name in "xy"]
            yield f"{' and '.join(names)} {verb} the other sign: {ways}", points * signs
        for power in (*range(-9, 0), *range(1, 10)):
            found = f"found x, y 10^{power} times as large as the scene's"
            ways = _options("scale", dict.fromkeys("xy", f"{10.0**-power:g}"))
            if any(bare(self.table.called[name]) != self.table.called[name] for name in "xy"):
                nameless = f"{ways}, as the scene names no units"
                ways = "correct their units in the header" if self.scene.units.length else nameless
            yield f"{found}, expected the scene's unit of length: {ways}", points * 10.0**-power

    def _shifted(self, points: Array) -> Iterator[Read]:
        """Shifts after which the first points fit."""
        positions = self.scene.asperities.positions
        tried: Sequence[Any] = positions[:MOST_TRIED] - points[0]
        if len(points) == len(positions):
            tried = [positions.mean(axis=0) - points.mean(axis=0)]
        for shift in tried:
            if self._fits(points[:20] + shift):
                yield self._moved(points, shift)

    def _about_shifted(self, points: Array, weights: Array) -> Iterator[Read]:
        """The shift from the axis that is likely for loaded nodes."""
        places, shift = self.scene.contact_points, np.average(points, axis=0, weights=weights)
        for _ in range(REFINEMENTS):  # the weighted mean vector from the nearest asperities
            near = places[self._nearest(points - shift)[1]]
            shift = np.average(points - near, axis=0, weights=weights)
        yield self._moved(points, -shift)

    def _moved(self, points: Array, shift: Array) -> Read:
        size = min(self._allowed, float(np.abs(shift).max())) * (0.1 if self.summed else 0.01)
        digit = 10.0 ** math.floor(math.log10(size or 1.0))
        by = f"[{', '.join(f'{each + 0.0:.4g}' for each in np.round(-shift / digit) * digit)}]"
        by = f"about {by}" if self.summed else f"{by}, to within {self._allowed:.3g}"
        expected = "expected x, y relative to the sphere's axis: subtract the shift in the file"
        return f"all are shifted by {by}, {expected}", points + shift

    def _refuse(self, row: Any, found: str, expected: str) -> None:
        self.mistakes.append(self.table.mistake(int(row), f": found {found}, expected {expected}"))

    def _refuse_repeated(
        self, places: NDArray[Any], chosen: NDArray[np.bool_], expected: str
    ) -> None:
        """Add a mistake for each chosen row that has the same place as an earlier row."""
        _, first, back = np.unique(places, return_index=True, return_inverse=True)
        for i in np.flatnonzero((first[back] != np.arange(len(places))) & chosen):
            self._refuse(i, f"the same position as in {self.table.rows[first[back[i]]]}", expected)


def unused(table: ReadTable) -> str:
    """The end of a message: the names of at most `MOST_UNREAD` unread columns."""
    names = [*filter(None, table.others)]
    more = f" and {len(names) - MOST_UNREAD} more" if len(names) > MOST_UNREAD else ""
    return f"; not used: {', '.join(names[:MOST_UNREAD])}{more}" if names else ""


def _options(option: str, values: Mapping[str, str]) -> str:
    return " ".join(f"--{option} {name}={value}" for name, value in values.items())


def _polar(radii: Array, angles: Array) -> Array:
    return np.column_stack((radii * np.cos(angles), radii * np.sin(angles)))
