"""Forces that somebody claims, from a file: one per asperity of a scene, in its order."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array, Indices, frozen
from convexrough.errors import TableError
from convexrough.run.tables import MOST_MISTAKES, Table, read_table
from convexrough.scene.neighbours import nearest_distances
from convexrough.scene.scene import Scene

#: Positions in a file may be off by this part of the least spacing, unless a tolerance is given:
#: five digits are enough, and every asperity still has one nearest row.
POSITION_TOLERANCE = 1e-2

#: A load so small beside the largest is taken for noise, in hints only.
NOISE = 1e-6


class Claimed(NamedTuple):
    """Forces in the order of the scene's asperities; `notes` say how they were read.

    status : (n,) what the file calls them, where it does;  unit : that its header names
    """

    values: Array
    status: NDArray[np.str_] | None
    unit: str
    notes: list[str]


def read_loads(
    path: Path,
    scene: Scene,
    *,
    columns: Mapping[str, str] | None = None,
    tolerance: float | None = None,
    floor: float = 0.0,
) -> Claimed:
    """Loads [force] from a file; negative ones only as far as noise up to the floor.

    columns   : what columns load, x and y are called in the file
    tolerance : [length] by which positions may be off; default: 1 % of the least spacing

    Rows with positions are matched by them, others are in the scene's order. Raises TableError with
    every mistake, and FileError.
    """
    table, owners = _read(path, scene, "load", columns, tolerance)
    loads = table.columns["load"]
    if len(bad := np.flatnonzero(loads < -floor)):
        hint, largest = "", float(loads.max())
        if (noise := -float(loads[bad].min())) <= NOISE * largest:
            hint = f"; --floor {rounded_up(noise)} counts noise as 0"
        expected = f"expected a number that is not negative{hint}"
        mistakes = [
            table.mistake(int(i), f", column load: found {float(loads[i])!r}, {expected}")
            for i in bad
        ]
        raise TableError(str(path), mistakes)
    return _claimed(path, table, "load", owners)


def read_shear_forces(
    path: Path,
    scene: Scene,
    *,
    columns: Mapping[str, str] | None = None,
    tolerance: float | None = None,
) -> Claimed:
    """The same for shear forces: a column force, and status where there is one."""
    table, owners = _read(path, scene, "force", columns, tolerance)
    return _claimed(path, table, "force", owners)


def rounded_up(value: float) -> str:
    """One digit, not below the value."""
    power = 10.0 ** math.floor(math.log10(value))
    return f"{math.ceil(value / power * (1 - 1e-12)) * power:.0e}"


def power_of_ten(ratio: float) -> int:
    """The power of ten that a ratio is to 1 %; 0 where it is none."""
    if not (ratio > 0 and math.isfinite(ratio)):
        return 0
    exact = math.log10(ratio)
    return round(exact) if abs(exact - round(exact)) < 0.005 else 0


def _read(
    path: Path,
    scene: Scene,
    name: str,
    columns: Mapping[str, str] | None,
    tolerance: float | None,
) -> tuple[Table, Indices]:
    """The table, and the asperity of each row."""
    table = read_table(
        path,
        required=(name,),
        optional=("x", "y"),
        text=("status",) if name == "force" else (),
        columns=columns,
        unnamed=((name,), ("x", "y", name)),
    )
    n, rows = len(scene), len(table.rows)
    mistakes = []
    if rows != n:
        mistakes.append(f"rows: found {rows}, expected {n}, one per asperity of the scene")
    given = [each for each in ("x", "y") if each in table.columns]
    if len(given) == 1:
        mistakes.append(f"columns: found only {given[0]}, expected x and y")
    owners = np.arange(rows)
    if len(given) == 2:
        points = np.column_stack((table.columns["x"], table.columns["y"]))
        owners, wrong = _match(scene, points, table, tolerance)
        mistakes += wrong
    if mistakes:
        more = len(mistakes) - MOST_MISTAKES
        rest = [f"and {more:,} more mistakes"] if more > 0 else []
        raise TableError(str(path), [*mistakes[:MOST_MISTAKES], *rest])
    return table, owners


def _claimed(path: Path, table: Table, name: str, owners: Indices) -> Claimed:
    def ordered(values: NDArray[Any]) -> NDArray[Any]:
        result = np.empty_like(values)
        result[owners] = values
        return frozen(result)

    status = table.columns.get("status")
    unit = table.units.get(name, "")
    how = [table.style] if table.style else []
    how += [f"{each} [{table.units[each]}]" for each in ("x", "y", name) if each in table.units]
    how.append("matched by position" if "x" in table.columns else "in the scene's order")
    return Claimed(
        ordered(table.columns[name]),
        None if status is None else ordered(status),
        unit,
        [f"{path}: {', '.join(how)}"],
    )


def _match(
    scene: Scene, points: Array, table: Table, tolerance: float | None
) -> tuple[Indices, list[str]]:
    """The asperity at each point, and what is wrong: each must be there once."""
    from scipy.spatial import cKDTree  # 0.1 s to import: only when rows have positions

    positions = scene.asperities.positions
    spacing = float(scene.asperities.tip_radii[0])
    if len(positions) > 1:
        spacing = float(nearest_distances(positions).min())
    allowed = POSITION_TOLERANCE * spacing if tolerance is None else tolerance
    distances, owners = map(np.asarray, cKDTree(positions).query(points))
    far = distances > allowed
    mistakes = []
    extents = [float(np.abs(each).max()) for each in (points, positions)]
    if far.mean() > 0.5 and extents[1] > 0 and (power := power_of_ten(extents[0] / extents[1])):
        mistakes.append(
            f"positions: found them 10^{power} times as far out as the scene's, expected the "
            "scene's unit of length"
        )
    for i in np.flatnonzero(far)[: 2 * MOST_MISTAKES]:
        found = f"position {points[i].tolist()}, {distances[i]:g} from the nearest asperity"
        expected = f"a position of the scene to {allowed:.3g}"
        mistakes.append(table.mistake(int(i), f": found {found}, expected {expected}"))
    _, first = np.unique(owners, return_index=True)
    for i in np.setdiff1d(np.arange(len(owners)), first)[: 2 * MOST_MISTAKES]:
        if not far[i]:
            j = int(np.flatnonzero(owners == owners[i])[0])
            found = f"the same position as in {table.rows[j]}"
            mistakes.append(table.mistake(int(i), f": found {found}, expected each asperity once"))
    return owners, mistakes
