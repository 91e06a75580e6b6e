"""Result files of a run. Each is written beside its name and then renamed: whole, or not at all."""

from __future__ import annotations

import csv
import json
import platform
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from convexrough.errors import FileError
from convexrough.progress import Announce
from convexrough.run.page import slider_page
from convexrough.run.scene_file import SceneFile, digest
from convexrough.run.sensitivity import NUMBERS, Differentiated
from convexrough.run.stage_tables import stage_tables
from convexrough.run.stages import Findings
from convexrough.run.summary import Summary, to_json
from convexrough.tabular.units import UnitNames
from convexrough.version import __version__
from convexrough.whole import remove_unfinished, replacing

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Tables with more rows are written as .npz.
MOST_CSV_ROWS = 100_000

#: What was written, by name with its SHA-256, and from what.
MANIFEST = "files.json"

#: Packages whose versions results may depend on.
NUMERICAL = ("numpy", "scipy", "clarabel", "cvxpy", "osqp")


def claim_folder(folder: Path, *, force: bool) -> list[Path]:
    """Make the folder and prove that it can be written to, before anything is computed.

    What processes that were killed left unfinished there is removed.

    force : accept a folder that holds something. What an earlier run wrote there, and nobody has
        changed since, is removed; other files stay, unless new ones of the same names replace them

    Returns what stays of the earlier run, as it was changed. Raises FileError.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        remove_unfinished(folder)
        if any(folder.iterdir()) and not force:
            raise FileError(
                f"{folder}: not empty; --force replaces its results, --out takes another"
            )
        with tempfile.TemporaryFile(dir=folder):
            pass
        changed = []
        for name, known in _manifest(folder).get("files", {}).items():
            path = folder / Path(name).name  # inside the folder, whatever the manifest says
            if path.is_file() and not path.is_symlink():
                if digest(path) == known:
                    path.unlink()
                else:
                    changed.append(path)
        if _manifest(folder):
            (folder / MANIFEST).unlink()
    except OSError as error:
        raise FileError(f"{folder}: cannot hold results: {error.strerror or error}") from error
    return changed


def write_results(
    folder: Path,
    found: Findings,
    summary: Summary,
    *,
    figures: bool,
    html: bool = False,
    units: UnitNames | None = None,
    source: SceneFile | None = None,
    announce: Announce | None = None,
) -> list[Path]:
    """Write summary.json, a table per stage (.csv, or .npz if long), the figures and the page.

    html     : write the slider page
    source   : the scene file, for a copy of it, and of what else says where the results are from
    announce : told the name of each file

    Returns the paths. Raises FileError; files already written stay.
    """
    tell: Announce = announce or (lambda news: None)
    written = []
    _note(folder, {} if source is None else _origin(source))
    if source is not None:
        path = folder / "scene.toml"
        with beside(path) as temporary:
            temporary.write_text(source.text, encoding="utf-8")
        written.append(path)
    for name, columns in stage_tables(found):
        tell(name)
        written.append(_write_columns(folder / f"{name}.csv", columns))
    if figures:
        tell("figures")
        written += write_figures(folder, _draw(found, units or UnitNames()), tell)
    if html:
        tell("page")
        page = slider_page(found.contact, summary, units or UnitNames(), tell)
        path = folder / "slider.html"
        with beside(path) as temporary:
            temporary.write_text(page, encoding="utf-8")
        written.append(path)
    # Last, so that a summary says that the rest is there.
    path = folder / "summary.json"
    with beside(path) as temporary:
        temporary.write_text(to_json(summary) + "\n", encoding="utf-8")
    return [path, *written]


def _origin(source: SceneFile) -> Summary:
    """Where results are from: files read with their hashes, seed, and versions."""
    packages = {name: metadata.version(name) for name in NUMERICAL}
    return {
        "scene": str(source.path),
        "inputs": dict(source.inputs),
        "seed": source.seed,
        "versions": {"python": platform.python_version(), **packages},
    }


def _manifest(folder: Path) -> Summary:
    """What the earlier run says that it wrote; nothing where that cannot be read."""
    try:
        found = json.loads((folder / MANIFEST).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) and isinstance(found.get("files"), dict) else {}


def _note(folder: Path, entries: Mapping[str, Any]) -> None:
    """Add to what the manifest of a folder of results says; the first time, begin one."""
    said = _manifest(folder) or {"schema": 1, "version": __version__, "files": {}}
    with replacing(folder / MANIFEST) as temporary:
        temporary.write_text(to_json(said | dict(entries)) + "\n", encoding="utf-8")


def write_tables(folder: Path, tables: Mapping[str, Mapping[str, Any]]) -> list[Path]:
    """Write each table, name -> columns, as NAME.csv; return the paths."""
    _note(folder, {})
    return [_write_columns(folder / f"{name}.csv", table) for name, table in tables.items()]


def write_figures(
    folder: Path, figures: Mapping[str, Figure], announce: Announce | None = None
) -> list[Path]:
    """Write each figure as PNG and SVG; return the paths."""
    _note(folder, {})
    written = []
    for stem, figure in figures.items():
        if announce is not None:
            announce(stem)
        for kind in ("png", "svg"):
            path = folder / f"{stem}.{kind}"
            with beside(path) as temporary:
                figure.savefig(temporary, format=kind, dpi=200)
            written.append(path)
            figure.set_layout_engine("none")  # laid out once: the second file takes half the time
    return written


def _draw(found: Findings, units: UnitNames) -> dict[str, Figure]:
    from convexrough import plots  # matplotlib: only when it draws

    names: dict[str, Any] = dict(length_unit=units.length, force_unit=units.force)
    figures = plots.press_figures(found.contact, **names)
    if found.shear:
        figures |= plots.shear_figures([row.state for row in found.shear], **names)
    if found.cycles:
        figures |= plots.cycle_figures(
            [row.cycle for row in found.cycles],
            loops=[row.loop for row in found.cycles],
            **names,
        )
    if found.history is not None:
        figures |= plots.history_figures(found.history.history, **names)
    if isinstance(found.gradient, Differentiated):
        asked, gradient = found.gradient
        figures |= plots.gradient_figures(gradient, of=NUMBERS[asked.of], **names)
    varied = found.varying
    if varied.path is not None:
        figures |= plots.path_figures(varied.path, **names)
    if varied.steady is not None:
        figures |= plots.steady_figures(varied.steady, **names)
    if varied.phase_losses is not None:
        figures |= plots.phase_figures(varied.phase_losses, **names)
    if varied.shakedown is not None:
        figures |= plots.shakedown_figures(varied.shakedown, **names)
    return figures


@contextmanager
def beside(path: Path) -> Iterator[Path]:
    """A name beside `path` to write to, which takes its place if all goes well, or vanishes.

    The manifest says so, where the folder has one.
    """
    with replacing(path) as temporary:
        yield temporary
    listed(path)


def listed(path: Path) -> None:
    """Say in the manifest of a folder, where it has one, that this file is among the results."""
    files = _manifest(path.parent).get("files")
    if files is not None:
        _note(path.parent, {"files": {**files, path.name: digest(path)}})


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
