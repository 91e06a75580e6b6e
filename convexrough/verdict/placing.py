"""The asperity of each row of a file: by position, by an index, or in the scene's order."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from shlex import quote
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy  # its parts are imported when they are used
from numpy.typing import NDArray

from convexrough import checks
from convexrough.arrays import Array, Indices
from convexrough.contact import discs_of
from convexrough.errors import InputError
from convexrough.scene.scene import Scene
from convexrough.tabular.columns import bound
from convexrough.tabular.roles import is_index
from convexrough.tabular.table import ReadTable, in_sheet
from convexrough.tabular.units import bare

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

#: Default of the largest error of a position in a file, as a fraction of the smallest spacing.
POSITION_TOLERANCE = 1e-2

#: Iterations that estimate a common shift of all nodes, and that assign nodes to the discs of the
#: last assignment.
REFINEMENTS, ROUNDS = 5, 20

#: Distances of loaded nodes from their nearest asperities, as fractions of those asperities'
#: distances from their neighbours: the largest accepted (at 1 the node may be an asperity that the
#: scene lacks), and the largest accepted median (about 0.4 for random points). If more than FEW_FAR
#: of the nodes are too far, all positions may be wrong, else only theirs.
REACH, BY_CHANCE, FEW_FAR = 0.9, 0.25, 0.1

#: At most this many unread columns are named.
MOST_UNREAD = 8

#: Names of columns that are indices of asperities.
SURELY_INDEX = ["index", "asperity"]


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
        found = self._matched() if placed else self._numbered()
        count, rows, by = len(self.scene), len(self.table.rows), placed or found is not None
        if found is None:
            found = np.arange(rows)
        if rows == count or (rows < count and (by or self.mistakes) and self.missing_open):
            return found
        advice = "" if by else unused(self.table)
        if rows < count and (by or self.mistakes):
            advice = "; --missing-open claims that the others are open"
        elif rows > count and (not placed or len(np.unique(self.points, axis=0)) > count):
            advice += "; --nodes sums rows by asperity"
        where = in_sheet(self.table.style)
        expected = f"expected {count}, one per asperity of the scene{advice}"
        self.mistakes.insert(0, f"rows: found {rows}{where}, {expected}")
        return found

    def _nearest_to_each(self, values: Array) -> Indices:
        """(m,) the asperity nearest to each node or pixel; `mistakes` names nodes that are far."""
        loaded = values != 0
        distances, owners = self._nearest(self.points)
        far = loaded & (distances > REACH * self._apart[owners])
        most = loaded & ~far if far.sum() <= FEW_FAR * loaded.sum() else loaded
        if loaded.any() and not self._fits(self.points[most]):
            points, weights = self.points[loaded], np.abs(values[loaded])
            if self._misread(points, self._shift(points, weights)):
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
        """(m,) the asperity of each node, the one with the least r_i^2 - a_i^2 at the distance r_i;
        and (n,) the radii a_i of the discs under the sums. So discs that do not overlap keep all of
        their nodes. If one reaches beyond its neighbour, the nearest are taken."""

        def discs(owners: Indices) -> Array:
            loads = np.bincount(owners, values, minlength=len(self.scene)).clip(min=0.0)
            return discs_of(self.scene, loads)

        nodes, nearest = np.column_stack((self.points, np.zeros(len(owners)))), owners
        for _ in range(ROUNDS):
            radii, before = discs(owners), owners
            if (radii > self._apart).any():  # loads in a wrong unit
                break
            height = np.sqrt(np.maximum(radii.max() ** 2 - radii**2, 0.0))
            raised = scipy.spatial.cKDTree(np.column_stack((self.scene.contact_points, height)))
            owners = np.asarray(raised.query(nodes)[1])
            if np.array_equal(owners, before):
                return owners, radii
        return nearest, discs(nearest)

    # By an index

    def _numbered(self) -> Indices | None:
        """(m,) the asperity of each row, from an index; None if rows are in the scene's order."""
        held, found = self.table.others, dict[str, Indices]()
        sure = ["index"] if "index" in self.table.called else SURELY_INDEX
        indexed = any(bare(name).lower() in sure for name in held)
        for name, cells in held.items():
            if bare(name).lower() in sure:
                found |= self._indices(name, cells)
            elif is_index(name) or not indexed:
                falls = cells.dtype.kind == "f" and (np.diff(cells) < 0).any()
                if not (falls if is_index(name) else checks.is_permuted(cells)):
                    continue
                found_it = f"column {name or '1'}: found {cells[0]:g}, {cells[1]:g}, ..."
                right = f"increasing numbers, or --column index={quote(name or '1')}"
                self.mistakes.append(f"{found_it}, expected {right}")
        if len({tuple(index.tolist()) for index in found.values()}) > 1:
            said = f"columns {', '.join(found)}: found other asperities in each"
            self.mistakes.append(f"{said}, expected one index: --column index=NAME")
        for name, index in found.items():
            self.how = f"in the order of column {name}, from {int(held[name].min() > 0)}"
            return index
        if placed := {it[0].lower(): it for it in held if re.fullmatch(r"[xyXY][ _.(\[].*", it)}:
            ways = " ".join(f"--column {axis}={quote(it)}" for axis, it in sorted(placed.items()))
            found_them = f"columns {', '.join(placed.values())}: found no x and y"
            self.mistakes.append(f"{found_them}, expected {ways}")
        self.how += unused(self.table, " (not used: {})")
        return None

    def _indices(self, name: str, cells: NDArray[Any]) -> dict[str, Indices]:
        """The index (m,) from 0 in a column that counts from 0 or 1; {} with a mistake if wrong."""
        rows, count = self.table.rows, len(self.scene)
        if cells.dtype.kind != "f":
            whole = np.array([str(cell).isdecimal() for cell in cells])
            whole &= not whole.all()  # texts in a file of arrays
        else:
            whole = (np.floor(cells) == cells) & (cells >= 0) & (cells <= count)
        values, times = np.unique(cells, return_counts=True)
        if not whole.all():
            first = int(np.argmin(whole))
            wrong = f"{cells[first]:g}" if cells.dtype.kind == "f" else repr(str(cells[first]))
            wrong += f" in {rows[first]}, expected whole numbers up to {count}, from 0 or 1"
        elif times.max() > 1:
            twice = cells == values[times.argmax()]
            where = " and ".join(rows[i] for i in np.flatnonzero(twice)[:2])
            wrong = f"{values[times.argmax()]:g} in {where}, expected each asperity once"
        elif (values[0] == 0) == (values[-1] == count):
            wrong = f"numbers from {values[0]:g} to {values[-1]:g}, expected either 0, if they "
            wrong += f"count from 0, or {count}, if they count from 1: add this row with "
            wrong += f"{self.column} 0"
        else:
            return {name: cells.astype(np.intp) - int(values[0] > 0)}
        self.mistakes.append(f"column {name}: found {wrong}")
        return {}

    # By position

    @cached_property
    def _tree(self) -> cKDTree:
        tops, contacts = self.scene.asperities.positions, self.scene.contact_points
        if self.summed:
            return scipy.spatial.cKDTree(contacts)
        # With the closest-point geometry, files can have the tops or the contact points.
        trees = scipy.spatial.cKDTree(tops), scipy.spatial.cKDTree(contacts)
        return min(trees, key=lambda tree: np.median(tree.query(self.points)[0]) > self._allowed)

    def _nearest(self, points: Array) -> tuple[Array, Indices]:
        """(m,) [length], (m,) the distance of the nearest asperity to each point, and its index."""
        distances, owners = self._tree.query(points)
        return np.asarray(distances), np.asarray(owners)

    @cached_property
    def _apart(self) -> Array:
        """(n,) [length] the distance of each asperity from its nearest neighbour, if it has one."""
        if len(self.scene) == 1:
            return np.array([np.min(self.scene.sphere_radius)])
        return self.scene.asperities.layout.nearest

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
            shift = points.mean(axis=0) - self.scene.asperities.positions.mean(axis=0)
            if self._misread(points, shift):
                return owners
        if far.any() and alone and float(bound(most, 1)) <= self._spacing / 2:
            found = f"found them up to {most:.3g} from the nearest asperities"
            advice = f"if they are rounded: --tolerance {bound(most, 1)}"
            self.mistakes.append(f"positions: {found}, expected at most {allowed:.3g}; {advice}")
            return owners
        most_far = far.mean() > 0.5  # then one row is enough to show it
        for i in np.flatnonzero(far)[: 1 if most_far else None]:
            found = f"position {points[i].tolist()}, {distances[i]:g} from the nearest asperity"
            self._refuse(i, found, f"a position of the scene, to within {allowed:.3g}")
        self._refuse_repeated(owners, ~far, "each asperity once")
        return owners

    def _misread(self, points: Array, shift: Array) -> bool:
        """True, and a mistake, if points fit with other signs or units, exchanged or shifted."""
        size = min(self._allowed, float(np.abs(shift).max())) * (0.1 if self.summed else 0.01)
        digit = 10.0 ** math.floor(math.log10(size or 1.0))
        by = f"[{', '.join(f'{each + 0.0:.4g}' for each in np.round(shift / digit) * digit)}]"
        by = f"about {by}" if self.summed else f"{by}, to within {self._allowed:.3g}"
        moved = f"all are shifted by {by}, expected x, y relative to the sphere's axis"
        for said, others in *self._readings(points), (moved, points - shift):
            if self._fits(others):
                self.mistakes.append(f"positions: {said}")
                return True
        return False

    def _readings(self, points: Array) -> Iterator[tuple[str, Array]]:
        """Exchanged x and y, and other signs and units: the message, and the points (m, 2)."""
        x, y, load = (quote(bare(self.table.called[name])) for name in ("x", "y", self.column))
        also = f" --column {self.column}={load}" * load.isdecimal()  # without a header
        yield f"x and y are exchanged: --column x={y} --column y={x}{also}", points[:, ::-1]
        for names, verb in (("x", "has"), ("y", "has"), ("xy", "have")):
            factors = [-self.table.factors.get(name, 1.0) for name in names]
            ways = " ".join(
                f"--scale {it[0]}={it[1]:.15g}" for it in zip(names, factors, strict=True)
            )
            signs = [-1 if name in names else 1 for name in "xy"]
            yield f"{' and '.join(names)} {verb} the other sign: {ways}", points * signs
        for power in (*range(-9, 0), *range(1, 10)):
            found = f"found x, y 10^{power} times as large as the scene's"
            ways = " ".join(f"--scale {name}={10.0**-power:g}" for name in "xy")
            if any(name in self.table.units for name in "xy"):
                nameless = f"{ways}, as the scene names no units"
                ways = "correct their units in the header" if self.scene.units.length else nameless
            yield f"{found}, expected the scene's unit of length: {ways}", points * 10.0**-power

    def _shift(self, points: Array, weights: Array) -> Array:
        """The shift from the axis that is likely for loaded nodes."""
        places, shift = self.scene.contact_points, np.average(points, axis=0, weights=weights)
        for _ in range(REFINEMENTS):  # the weighted mean vector from the nearest asperities
            near = places[self._nearest(points - shift)[1]]
            shift = np.average(points - near, axis=0, weights=weights)
        return shift

    def _refuse(self, row: Any, found: str, expected: str) -> None:
        self.mistakes.append(self.table.mistake(int(row), f": found {found}, expected {expected}"))

    def _refuse_repeated(
        self, places: NDArray[Any], chosen: NDArray[np.bool_], expected: str
    ) -> None:
        """Add a mistake for each chosen row that has the same place as an earlier row."""
        _, first, back = np.unique(places, return_index=True, return_inverse=True)
        for i in np.flatnonzero((first[back] != np.arange(len(places))) & chosen):
            self._refuse(i, f"the same position as in {self.table.rows[first[back[i]]]}", expected)


def unused(table: ReadTable, how: str = "; not used: {}") -> str:
    """A part of a message: the names of at most `MOST_UNREAD` unread columns, if there are any."""
    names = [f"column {name}" if name.isdecimal() else name for name in filter(None, table.others)]
    more = f" and {len(names) - MOST_UNREAD} more" if len(names) > MOST_UNREAD else ""
    return how.format(", ".join(names[:MOST_UNREAD]) + more) if names else ""
