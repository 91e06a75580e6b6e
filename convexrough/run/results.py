"""Results as a summary, as a proof and as files, and the folder to which they are written.

The new files are written to a temporary folder, which is then renamed, or, if the final folder
exists already, moved into it one by one, `files.json` last. Before the move, `files.json` of the
earlier run is deleted, then all files listed there. Other files stay. If the process dies during
the move, the folder contains only some of the new files, and no `files.json`.
"""

from __future__ import annotations

import csv
import json
import os
import platform
import shutil
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from convexrough.atomic import remove_unfinished, replacing, to_json, unfinished, write_text
from convexrough.errors import FileError, ProofError, file_errors
from convexrough.friction.shear import shear
from convexrough.progress import LOGGER
from convexrough.run.scene_file import SceneFile
from convexrough.run.stage import Result, Summary, limit
from convexrough.version import __version__

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from convexrough.proof import Proof

#: Version of the keys of summary.json and of the columns of tables; the largest number of rows of a
#: table that is not written as .npz.
SCHEMA, MOST_CSV_ROWS = 2, 100_000

#: The file that lists the files written and, for some commands, files read and versions.
MANIFEST = "files.json"

#: Results may depend on the versions of these packages.
NUMERICAL = ("numpy", "scipy", "clarabel", "cvxpy", "osqp")

#: The proof leaves out shear forces of at least this fraction of f P, the force of gross sliding.
BELOW_LIMIT = 1 - 1e-9


def headed(**contents: Any) -> Summary:
    """A summary: the versions of its keys (`SCHEMA`) and of the package, then these contents."""
    return {"schema": SCHEMA, "version": __version__, **contents}


def summarise(results: Iterable[Result]) -> Summary:
    """The contents of summary.json, which `--json` prints, in the scene's units."""
    return headed(**{result.name: result.summary() for result in results})


def prove_results(results: Sequence[Result], warn: Callable[[str], None]) -> Proof:
    """The proof of the contact and of its states under the shear forces of the results.

    Forces of 0 or of at least `BELOW_LIMIT` f P are left out, and states that are not proved; for
    each of these `warn` is called with the reason. Raises InputError for scenes too large for exact
    arithmetic, ProofError if the contact is not proved.
    """
    contact = results[0].contact
    most = BELOW_LIMIT * limit(contact) if contact.scene.friction else 0.0
    found = (force for result in results for force in result.proved_forces())
    # Of forces that differ only by rounding, one is enough.
    forces = sorted({f"{force:.12g}": force for force in found}.values())
    states = [shear(contact, force=it) for it in forces if 0 < it < most]
    with suppress(ProofError):
        return contact.proof(sheared=states)
    contact.proof()  # raises if it is the contact that is not proved
    good = []
    for state in states:
        try:
            contact.proof(sheared=[state])
            good.append(state)
        except ProofError as error:
            warn(f"proof.json leaves out the shear force {state.force:.6g}: {error}")
    return contact.proof(sheared=good)


@dataclass
class Writer:
    """A folder of results that receives files. All methods raise FileError."""

    folder: Path  # the final one
    path: Path  # the temporary folder
    formats: Sequence[str] = ("png",)  # file name extensions of figures
    dpi: int = 200  # pixels per inch of figures
    files: list[Path] = field(default_factory=list)  # those written so far

    def text(self, name: str, text: str | bytes) -> None:
        self.files.append(write_text(self.path / name, text))

    def summary(self, name: str, summary: Summary) -> None:
        self.text(name, to_json(summary) + "\n")

    def tables(self, tables: Mapping[str, Mapping[str, Any]]) -> None:
        """Write each table as NAME.csv, or as NAME.npz if it has many rows, with all digits."""
        for name, columns in tables.items():
            arrays = [np.asarray(values) for values in columns.values()]
            path = self.path / f"{name}.csv"
            if len(arrays[0]) > MOST_CSV_ROWS:
                path = path.with_suffix(".npz")
                with replacing(path) as temporary, temporary.open("wb") as file:
                    np.savez(file, **columns)
            else:
                write_rows(path, [columns, *zip(*(it.tolist() for it in arrays), strict=True)])
            self.files.append(path)

    def figures(self, figures: Mapping[str, Figure]) -> None:
        """Write each figure in each format. While one is compressed, the next is drawn."""
        from convexrough.plots.notebook import drawn  # imports matplotlib

        def write(name: str, content: Callable[[], bytes]) -> None:
            self.text(name, content())

        with ThreadPoolExecutor(1) as pool:
            writing: Future[Any] = pool.submit(bool)  # nothing yet
            for stem, figure in figures.items():
                for kind in self.formats:
                    content = drawn(figure, kind, self.dpi)
                    writing.result()
                    writing = pool.submit(write, f"{stem}.{kind}", content)
                    figure.set_layout_engine("none")  # the layout is the same in all formats
            writing.result()

    def results(
        self, results: Sequence[Result], *, figures: bool, more: Mapping[str, Any] | None = None
    ) -> None:
        """Compute all contents; write summary.json with `more`, tables and perhaps figures."""
        tables = [result.tables() for result in results]
        plotted = [result.figures() for result in results] if figures else []
        self.summary("summary.json", summarise(results) | dict(more or {}))
        for result, each in zip(results, tables, strict=True):
            LOGGER.info(f"writing {result.name}")
            self.tables(each)
        if figures:
            LOGGER.info("drawing")
            self.figures({stem: figure for some in plotted for stem, figure in some.items()})


@contextmanager
def results_folder(
    folder: Path,
    *,
    force: bool,
    reads: Iterable[str | Path] = (),
    command: str = "",
    formats: Sequence[str] = ("png",),
    dpi: int = 200,
    **said: Any,
) -> Iterator[Writer]:
    """A context manager that yields a writer; its files are in `folder` if the body succeeds.

    force : True to accept a folder with contents
    reads : files that the block reads; they must not be in `folder`
    formats, dpi : as for `Writer`;  command, said : entries of `files.json`

    Raises FileError, before the block runs, if `folder` cannot be written or replaced, or if it has
    a damaged `files.json`.
    """
    there = folder.is_dir()
    new = unfinished(folder / "results" if there else folder)
    with file_errors(folder, "hold results"):
        folder.parent.mkdir(parents=True, exist_ok=True)
        remove_unfinished(folder if there else folder.parent)
        if folder.exists() and not there:
            raise FileExistsError(17, "File exists")
        for each in reads:
            # For a link these are its own folder and that of its target.
            places = {Path(each).resolve().parent, Path(each).parent.resolve()}
            if folder.resolve() in places:
                raise FileError(f"{folder}: holds {Path(each).name}, an input; name another folder")
        if there and any(folder.iterdir()) and not force:
            advice = "--force replaces its results; or name another folder"
            raise FileError(f"{folder}: not empty; {advice}")
        _listed(folder)
        new.mkdir()
        try:
            yield Writer(folder, new, formats, dpi)
            names = sorted(path.name for path in new.iterdir())
            write_text(new / MANIFEST, to_json(headed(files=names, command=command, **said)) + "\n")
            if folder.is_dir():
                remove_earlier(folder)
                for path in sorted(new.iterdir(), key=lambda path: path.name == MANIFEST):
                    os.replace(path, folder / path.name)
            else:
                os.replace(new, folder)
        finally:
            shutil.rmtree(new, ignore_errors=True)


def remove_earlier(folder: Path) -> None:
    """Remove `files.json` from the folder, and then the files that it lists."""
    for name in [MANIFEST, *_listed(folder)]:
        path = folder / name
        if path.is_file() or path.is_symlink():
            path.unlink()


def _listed(folder: Path) -> list[str]:
    """The names of the files that `files.json` lists, without folders such as "../"; [] without it.
    Raises FileError if `files.json` is damaged, because then the earlier files are unknown."""
    path = folder / MANIFEST
    if not path.exists():
        return []
    with file_errors(path, "be read"):
        try:
            names = json.loads(path.read_text(encoding="utf-8"))["files"]
            return [Path(name).name for name in names]
        except (ValueError, KeyError, TypeError) as error:
            expected = "expected a list of files; remove it or name another folder"
            raise FileError(f"{path}: damaged, {expected}") from error


def origin(source: SceneFile) -> Summary:
    """The origin of results: scene file, hashes of the files read, seed, versions of packages."""
    return {
        "scene": str(source.path),
        "inputs": dict(source.inputs),
        "seed": source.seed,
        "versions": {"python": platform.python_version(), **versions()},
    }


def copied(source: SceneFile) -> str:
    """The text for a copy of a scene file; the first line says where to run it if it has a path."""
    folder = str(source.path.parent.absolute())
    said = f"# A copy; to run it, move it to {folder!r}: `path` is relative to that folder.\n"
    return said * (len(source.inputs) > 1) + source.text


def versions() -> dict[str, str]:
    """The versions of the packages in `NUMERICAL`, by name."""
    return {name: metadata.version(name) for name in NUMERICAL}


def write_rows(path: Path, rows: Iterable[Iterable[Any]]) -> None:
    """Write rows as CSV, with floats in full precision."""
    with replacing(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        csv.writer(file, lineterminator="\n").writerows(rows)
