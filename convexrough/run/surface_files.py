"""Files of `summits`: the table that a scene file reads, the curve, and the figures."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

from convexrough.errors import FileError
from convexrough.run.results import beside
from convexrough.run.surface_report import Scanned, curve_rows

#: Columns of summits.csv: x, y, height and tip_radius are those that a scene file reads.
COLUMNS = {
    "x": "x",
    "y": "y",
    "height": "heights",
    "tip_radius": "tip_radii",
    "prominence": "prominences",
    "largest_curvature": "largest_curvatures",
    "smallest_curvature": "smallest_curvatures",
    "eccentricity": "eccentricities",
    "elliptic_load": "elliptic_loads",
    "deviation": "deviations",
}

#: How the units of these columns follow from that of length.
LENGTHS = dict.fromkeys(("x", "y", "height", "tip_radius", "prominence"), "{}")
LENGTHS |= dict.fromkeys(("largest_curvature", "smallest_curvature"), "1/{}")


def write_summits(path: Path, scanned: Scanned, *, figures: bool) -> list[Path]:
    """Write the table that a scene file reads, the curve and the figures beside it; the paths."""
    summits = scanned.summits
    unit = summits.origin.unit
    columns = {
        f"{name} [{LENGTHS[name].format(unit)}]" if unit and name in LENGTHS else name: getattr(
            summits, field
        )
        for name, field in COLUMNS.items()
    }
    columns |= {"row": summits.pixels[:, 0], "column": summits.pixels[:, 1]}
    written = [_write_rows(path, [list(columns), *zip(*(each.tolist() for each in columns.values()),
                                                      strict=True)])]  # fmt: skip
    if scanned.curve is not None:
        rows = curve_rows(scanned.curve)
        curve = path.with_name(f"{path.stem}-provability.csv")
        written.append(_write_rows(curve, [list(rows[0]), *(row.values() for row in rows)]))
    if figures:
        from convexrough.plots.surface import surface_figures  # matplotlib: only when it draws

        drawn = surface_figures(scanned.surface, scanned.maxima, summits, scanned.curve,
                                scanned.contact)  # fmt: skip
        for stem, figure in drawn.items():
            for kind in ("png", "svg"):
                target = path.with_name(f"{path.stem}-{stem}.{kind}")
                with beside(target) as temporary:
                    figure.savefig(temporary, format=kind, dpi=200)
                written.append(target)
                figure.set_layout_engine("none")  # laid out once
    return written


def claim_table(path: Path, *, force: bool) -> None:
    """Refuse to replace a table unasked, before anything is computed."""
    if path.suffix.lower() != ".csv":
        raise FileError(f"{path}: found {path.suffix or 'no ending'}, expected .csv")
    if path.exists() and not force:
        raise FileError(f"{path}: is there already; --force replaces it, --out names another")
    if not path.parent.is_dir():
        raise FileError(f"{path}: no folder {path.parent}")


def _write_rows(path: Path, rows: list[Any]) -> Path:
    with beside(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows(rows)
    return path
