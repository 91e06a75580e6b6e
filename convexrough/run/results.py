"""Result files of a run. Each is written beside its name and then renamed: whole, or not at all."""

from __future__ import annotations

import csv
import os
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from convexrough.contact import Contact
from convexrough.errors import FileError
from convexrough.run.scene_file import UnitNames
from convexrough.run.stages import Cycled, Findings, Sheared
from convexrough.run.summary import SHEAR, Summary, counts, to_json
from convexrough.run.tables import ASPERITY_COLUMNS
from convexrough.scene.rings import one_of_each_ring

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Tables with more rows are written as .npz.
MOST_CSV_ROWS = 100_000

#: Asperities whose loops are written, at most.
MOST_LOOPS = 12


def claim_folder(folder: Path, *, force: bool) -> None:
    """Make the folder and prove that it can be written to, before anything is computed.

    force : accept a folder that holds something; files of the same names will be replaced

    Raises FileError.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        occupied = any(folder.iterdir())
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise FileError(f"{folder}: cannot hold results: {error.strerror or error}") from error
    if occupied and not force:
        raise FileError(f"{folder}: not empty; --force replaces its results, --out takes another")


def write_results(
    folder: Path,
    found: Findings,
    summary: Summary,
    *,
    figures: bool,
    units: UnitNames | None = None,
) -> list[Path]:
    """Write summary.json, a table per stage (.csv, or .npz if long) and the figures.

    Returns the paths. Raises FileError; files already written stay.
    """
    written = [_write_columns(folder / "asperities.csv", _asperity_columns(found.contact))]
    if found.shear:
        written.append(_write_columns(folder / "shear.csv", _shear_columns(found.shear)))
    if found.cycles:
        written.append(_write_columns(folder / "cycle.csv", _cycle_columns(found.cycles)))
        written.append(_write_columns(folder / "loop.csv", _loop_columns(found)))
    if found.history is not None:
        past = found.history.history
        columns = {
            "fraction": np.array(found.history.fractions),
            "force": past.applied,
            "displacement": past.displacements,
            "energy": past.energy,
        }
        written.append(_write_columns(folder / "history.csv", columns))
    if figures:
        written += write_figures(folder, _draw(found, units or UnitNames()))
    # Last, so that a summary says that the rest is there.
    path = folder / "summary.json"
    with beside(path) as temporary:
        temporary.write_text(to_json(summary) + "\n", encoding="utf-8")
    return [path, *written]


def write_tables(folder: Path, tables: Mapping[str, Mapping[str, Any]]) -> list[Path]:
    """Write each table, name -> columns, as NAME.csv; return the paths."""
    return [_write_columns(folder / f"{name}.csv", table) for name, table in tables.items()]


def write_figures(folder: Path, figures: Mapping[str, Figure]) -> list[Path]:
    """Write each figure as PNG and SVG; return the paths."""
    written = []
    for stem, figure in figures.items():
        for kind in ("png", "svg"):
            path = folder / f"{stem}.{kind}"
            with beside(path) as temporary:
                figure.savefig(temporary, format=kind, dpi=200)
            written.append(path)
    return written


def _draw(found: Findings, units: UnitNames) -> dict[str, Figure]:
    from convexrough import plots  # matplotlib: only when it draws

    names: dict[str, Any] = dict(length_unit=units.length, force_unit=units.force)
    figures = plots.press_figures(found.contact, **names)
    if found.shear:
        figures |= plots.shear_figures([row.state for row in found.shear], **names)
    if found.cycles:
        figures |= plots.cycle_figures([row.cycle for row in found.cycles], **names)
    if found.history is not None:
        figures |= plots.history_figures(found.history.history, **names)
    return figures


@contextmanager
def beside(path: Path) -> Iterator[Path]:
    """A name beside `path` to write to, which takes its place if all goes well, or vanishes."""
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        yield temporary
        os.replace(temporary, path)
    except OSError as error:
        raise FileError(f"{path}: cannot be written: {error.strerror or error}") from error
    finally:
        temporary.unlink(missing_ok=True)


def _asperity_columns(contact: Contact) -> dict[str, NDArray[Any]]:
    asperities = contact.scene.asperities
    x, y = asperities.positions.T
    values = (
        x,
        y,
        asperities.heights,
        asperities.tip_radii,
        contact.loads,
        contact.contact_radii,
        contact.gaps,
        contact.status,
        contact.certificate.load_errors,
    )
    return dict(zip(ASPERITY_COLUMNS, values, strict=True))


def _shear_columns(rows: tuple[Sheared, ...]) -> dict[str, NDArray[Any]]:
    """One row for each fraction and asperity."""
    states = [row.state for row in rows]
    count = len(states[0].forces)
    x, y = states[0].contact.scene.asperities.positions.T
    fields = {
        "force": "forces",
        "stick_radius": "stick_radii",
        "slip": "slips",
        "displacement": "displacements",
        "status": "status",
    }
    return {
        "fraction": np.repeat([row.fraction for row in rows], count),
        "x": np.tile(x, len(rows)),
        "y": np.tile(y, len(rows)),
        **{
            name: np.concatenate([getattr(state, field) for state in states])
            for name, field in fields.items()
        },
    }


def _cycle_columns(rows: tuple[Cycled, ...]) -> dict[str, NDArray[Any]]:
    """One row per cycle; energies are those of both bodies, per steady cycle."""
    cycles = [row.cycle for row in rows]
    names = ("energy", "energy_normalised", "smooth_normalised", "balance_defect")
    return {
        "maximum": np.array([row.maximum for row in rows]),
        "minimum": np.array([row.minimum for row in rows]),
        **{name: np.array([getattr(cycle, name) for cycle in cycles]) for name in names},
        "partial_slip_energy": np.array([each.partial_slip_energies.sum() for each in cycles]),
        "sliding_energy": np.array([each.sliding_energies.sum() for each in cycles]),
        "sliding": np.array([counts(each.status, SHEAR)["sliding"] for each in cycles]),
    }


def _loop_columns(found: Findings) -> dict[str, NDArray[Any]]:
    """Force-displacement points of each cycle: macroscopic ("total"), and of some asperities."""
    contact = found.contact
    distances = contact.scene.asperities.distances
    chosen = one_of_each_ring(distances, contact.loads, MOST_LOOPS)
    parts: dict[str, list[NDArray[Any]]] = {
        name: [] for name in ("maximum", "minimum", "curve", "force", "displacement")
    }
    for maximum, minimum, cycle in found.cycles:
        loop = cycle.loop(200)
        curves = [("total", loop.forces, loop.displacements)]
        curves += [
            (str(i), loop.asperity_forces[:, i], loop.asperity_displacements[:, i]) for i in chosen
        ]
        for name, forces, displacements in curves:
            points = len(forces)
            parts["maximum"].append(np.full(points, maximum))
            parts["minimum"].append(np.full(points, minimum))
            parts["curve"].append(np.full(points, name))
            parts["force"].append(forces)
            parts["displacement"].append(displacements)
    return {name: np.concatenate(part) for name, part in parts.items()}


def _write_columns(path: Path, columns: Mapping[str, Any]) -> Path:
    """Write CSV whose numbers read back the same, or .npz where there are many rows."""
    arrays = [np.asarray(values) for values in columns.values()]
    if len(arrays[0]) > MOST_CSV_ROWS:
        path = path.with_suffix(".npz")
        with beside(path) as temporary, temporary.open("wb") as file:
            np.savez(file, **columns)
        return path
    with beside(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows(
            zip(*(array.tolist() for array in arrays), strict=True)
        )  # repr of each float
    return path
