"""The results folder, which is written under a temporary name and then renamed.

If the folder exists already, the complete new files are moved into it one by one, `files.json`
last. A folder with contents is accepted only with `force`. Before the move, `files.json` of
the earlier run is deleted, and then the files that it lists. Other files stay. If the process dies
while files are moved, the folder has only some of the new files, and no `files.json`.
"""

from __future__ import annotations

import csv
import json
import os
import platform
import shutil
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from convexrough.atomic import remove_unfinished, replacing, to_json, unfinished, write_text
from convexrough.errors import FileError, file_errors
from convexrough.progress import LOGGER
from convexrough.run.scene_file import SceneFile
from convexrough.run.stage import Result, Summary
from convexrough.run.summary import headed, summarise

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Tables with more rows are written as .npz.
MOST_CSV_ROWS = 100_000

#: The file that lists the files written, the files read, and the versions of the packages.
MANIFEST = "files.json"

#: Results may depend on the versions of these packages.
NUMERICAL = ("numpy", "scipy", "clarabel", "cvxpy", "osqp")


@contextmanager
def results_folder(
    folder: Path, *, force: bool, reads: Iterable[str | Path] = (), **said: Any
) -> Iterator[Path]:
    """A temporary folder; if the body succeeds, it becomes `folder`, or its files move there.

    force : accept a folder with contents
    reads : files that the body reads; none of them may be in `folder`
    said  : entries of `files.json` in addition to the names of the files written

    Raises FileError, before the body runs, if `folder` cannot be written or replaced.
    """
    new = unfinished(folder / "results" if folder.is_dir() else folder)
    parents = [each for each in folder.parents if not each.exists()]
    with file_errors(folder, "hold results"):
        folder.parent.mkdir(parents=True, exist_ok=True)
        remove_unfinished(folder if folder.is_dir() else folder.parent)
        if folder.exists() and not folder.is_dir():
            raise FileExistsError(17, "File exists")
        for each in reads:
            if Path(each).resolve().parent == folder.resolve():
                raise FileError(f"{folder}: holds {Path(each).name}, an input; name another folder")
        if folder.is_dir() and any(folder.iterdir()) and not force:
            advice = "--force replaces its results; or name another folder"
            raise FileError(f"{folder}: not empty; {advice}")
        new.mkdir()
        try:
            yield new
            names = sorted(path.name for path in new.iterdir())
            write_json(new / MANIFEST, headed(files=names, **said))
            _moved(new, folder)
        finally:
            shutil.rmtree(new, ignore_errors=True)
            for each in parents:
                with suppress(OSError):  # not empty: it holds results
                    each.rmdir()


def _moved(new: Path, folder: Path) -> None:
    if not folder.is_dir():
        os.replace(new, folder)
        return
    for name in _earlier(folder):
        path = folder / Path(name).name  # only the name: inside the folder, even for "../x"
        if path.is_file() or path.is_symlink():
            path.unlink()
    for path in sorted(new.iterdir(), key=lambda path: path.name == MANIFEST):
        os.replace(path, folder / path.name)


def _earlier(folder: Path) -> list[str]:
    try:
        files = json.loads((folder / MANIFEST).read_text(encoding="utf-8"))["files"]
        return [MANIFEST, *map(str, files)]
    except (OSError, ValueError, KeyError, TypeError):
        return []


def origin(source: SceneFile) -> Summary:
    """The origin of results: hashes of the files read, the seed, and the versions of packages."""
    return {
        "scene": str(source.path),
        "inputs": dict(source.inputs),
        "seed": source.seed,
        "versions": {"python": platform.python_version(), **versions()},
    }


def versions() -> dict[str, str]:
    """The versions of the packages in `NUMERICAL`, by name."""
    return {name: metadata.version(name) for name in NUMERICAL}


def write_results(
    folder: Path,
    results: Sequence[Result],
    *,
    figures: bool,
    more: Mapping[str, Any] | None = None,
    **saved: Any,
) -> list[Path]:
    """Write all tables, figures and summary.json; return the paths.

    more  : further entries of summary.json
    saved : `formats` and `dpi` of figures, as for `write_figures`

    Raises FileError if a file cannot be written.
    """
    written = []
    for result in results:
        LOGGER.info(f"writing {result.name}")
        written += write_tables(folder, result.tables())
    if figures:
        for result in results:
            LOGGER.info(f"drawing {result.name}")
            written += write_figures(folder, result.figures(), **saved)
    path = folder / "summary.json"
    write_json(path, summarise(results) | dict(more or {}))
    return [path, *written]


def slider_page(pressed: Result) -> str:
    """An HTML page with a slider for the shear force, and the friction states computed for it.

    Raises InputError if the scene has no friction, or another shape than a sphere.
    """
    from convexrough.plots.slider import slider_html  # matplotlib: only when it draws

    return slider_html(pressed.contact, pressed.lines())


def write_json(path: Path, summary: Summary) -> Path:
    """Write a summary; return the path."""
    return write_text(path, to_json(summary) + "\n")


def write_tables(folder: Path, tables: Mapping[str, Mapping[str, Any]]) -> list[Path]:
    """Write each table of columns as NAME.csv; return the paths."""
    return [_write_columns(folder / f"{name}.csv", table) for name, table in tables.items()]


def write_figures(
    folder: Path,
    figures: Mapping[str, Figure],
    *,
    formats: Sequence[str] = ("png",),
    dpi: int = 200,
) -> list[Path]:
    """Write each figure in each format; return the paths."""
    from convexrough.plots import save  # matplotlib: only when it draws

    written = []
    for stem, figure in figures.items():
        for kind in formats:
            path = folder / f"{stem}.{kind}"
            with replacing(path) as temporary:
                save(figure, temporary, kind, dpi)
            written.append(path)
            figure.set_layout_engine("none")  # the layout is the same in all formats: saves time
    return written


def _write_columns(path: Path, columns: Mapping[str, Any]) -> Path:
    """Write columns as CSV, or as .npz if there are many rows, without loss; return the path."""
    arrays = [np.asarray(values) for values in columns.values()]
    if len(arrays[0]) > MOST_CSV_ROWS:
        path = path.with_suffix(".npz")
        with replacing(path) as temporary, temporary.open("wb") as file:
            np.savez(file, **columns)
        return path
    write_rows(path, [list(columns), *zip(*(each.tolist() for each in arrays), strict=True)])
    return path


def write_rows(path: Path, rows: Sequence[Sequence[Any]]) -> Path:
    """Write rows as CSV, with floats in full precision; return the path."""
    with replacing(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows(rows)
    return path
