"""The folder of a sweep: a manifest and parts.

The manifest describes the sweep. A part is a Parquet file of consecutive rows, written once and
named by its first scene and a hash of its sweep, so that parts of another sweep are never read.
All parts except the last have the same number of rows, which the manifest states. A complete part
is never changed. Another sweep replaces the manifest and removes all parts; the earlier sweep, if
it still runs, then stops.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from convexrough.atomic import to_json, write_text
from convexrough.errors import FileError, file_errors, needed
from convexrough.run.results import remove_earlier
from convexrough.sweeps.batch import Columns, different

MANIFEST, PARTS, SCHEMA = "manifest.json", "parts", 3

#: Advice in messages: an argument in Python, and the option of the command in brackets.
RESUME, OVERWRITE, OUT = "resume=True (--resume)", "overwrite=True (--force)", "`out` (--out)"


def part_from(manifest: Mapping[str, Any], first: int) -> range:
    """The scenes of the part of a sweep's table that begins with scene `first`."""
    return range(first, min(first + manifest["batch"], manifest["scenes"]))


@dataclass(frozen=True)
class Folder:
    """The folder of a sweep on disk."""

    path: Path
    manifest: Mapping[str, Any]

    @property
    def ending(self) -> str:
        """The end of the names of parts: a hash of the sweep and of the versions of packages."""
        said = json.dumps([self.manifest["sweep"], self.manifest["versions"]], sort_keys=True)
        return f"-{hashlib.sha256(said.encode()).hexdigest()[:12]}.parquet"

    def parts(self) -> list[range]:
        """The range of scenes of each part in the folder, in order; other files are ignored."""
        with file_errors(self.path / PARTS, "be read"):
            files = (self.path / PARTS).glob(f"*{self.ending}")
            names = [each.name.removesuffix(self.ending) for each in files]
        firsts = sorted(int(name) for name in names if name.isdecimal())
        return [part_from(self.manifest, first) for first in firsts]

    def file(self, first: int) -> Path:
        return self.path / PARTS / f"{first:012d}{self.ending}"

    def write(self, columns: Columns) -> None:
        """Write the columns of a part. An interruption leaves no incomplete part. Raises FileError
        if it cannot be written, or if another sweep replaced this one meanwhile."""
        folder_of(self.path, self.manifest)
        pyarrow, parquet = arrow()
        whole = BytesIO()
        parquet.write_table(pyarrow.table(columns), whole, write_page_checksum=True)
        try:
            write_text(self.file(int(columns["scene"][0])), whole.getvalue())
        except FileError as error:
            said = f"{error}; the finished parts are kept; {RESUME} computes the rest"
            raise FileError(said) from error

    def read(self, part: range, names: Sequence[str] | None = None) -> Columns:
        """Some columns of a part, by default all. Raises FileError if the part is damaged."""
        pyarrow, parquet = arrow()
        path = self.file(part.start)
        wanted = list(self.manifest["columns"] if names is None else names)
        try:
            # Threads of pyarrow could outlive the interpreter and abort the process.
            how = dict(use_threads=False, pre_buffer=False, page_checksum_verification=True)
            found = parquet.read_table(path, columns=list({"scene", *wanted}), **how)
        except (OSError, pyarrow.ArrowException) as error:
            why = " ".join(str(error).split())
            advice = f"remove this file; {RESUME} then computes it again"
            raise FileError(f"{path}: damaged ({why}); {advice}") from error
        if not np.array_equal(found["scene"].to_numpy(), part):
            raise FileError(f"{path}: has rows of other scenes; remove this file")
        arrays = {name: found[name].to_numpy() for name in wanted}
        return {  # pyarrow returns text as objects
            name: values.astype(np.str_) if values.dtype == object else values
            for name, values in arrays.items()
        }

    def missing(self, wanted: list[range], resume: bool) -> tuple[list[range], str]:
        """The parts of `wanted` that are not yet computed, and a message on what was found. Their
        unfinished files are removed. Raises FileError if a part must not exist."""
        known = {part.start for part in self.parts()}
        todo = [part for part in wanted if part.start not in known]
        count = sum(map(len, wanted))
        found = count - sum(map(len, todo))
        if found and not resume:
            raise FileError(
                f"{self.path}: holds {found:,} of these {count:,} scenes already; {RESUME} computes"
                f" the rest, {OVERWRITE} replaces them, {OUT} names another folder"
            )
        mine = {f".{self.file(part.start).name}" for part in todo}
        for path in (self.path / PARTS).glob(".*.unfinished"):
            if path.name.rsplit(".", 2)[0] in mine:
                path.unlink(missing_ok=True)
        return todo, f"found {found:,} scenes of an earlier run"


def open_folder(path: Path) -> Folder:
    """The folder of an existing sweep. Raises FileError if there is none."""
    try:
        with file_errors(path / MANIFEST, "be read"):
            if not (path / MANIFEST).exists():
                raise FileError(f"{path}: not a sweep: there is no {MANIFEST}")
            manifest = json.loads((path / MANIFEST).read_text(encoding="utf-8"))
        if not (isinstance(manifest, dict) and {"schema", "sweep", "versions"} <= manifest.keys()):
            raise ValueError("not a sweep")
        if (found := manifest["schema"]) != SCHEMA:
            raise ValueError(f"a sweep of another version: found schema {found}, expected {SCHEMA}")
    except ValueError as error:
        raise FileError(f"{path / MANIFEST}: cannot be read: {error}") from error
    return Folder(path, manifest)


def make_folder(path: Path, manifest: Mapping[str, Any], *, overwrite: bool = False) -> Folder:
    """The folder of a sweep, created if it does not exist.

    overwrite : replace another sweep, and remove files of `sweep --summary`; other files stay

    Raises FileError if the folder cannot be written, or contains files but no manifest, or another
    sweep, or one begun with other versions of packages; ExtraError if pyarrow is not installed.
    """
    arrow()
    with file_errors(path, "hold results"):
        path.mkdir(parents=True, exist_ok=True)
        if not (there := (path / MANIFEST).exists()):
            # Meanwhile another process may begin this sweep.
            names = (each.name for each in path.iterdir())
            if other := next((it for it in names if it != PARTS and MANIFEST not in it), ""):
                raise FileError(f"{path}: holds {other}, but no sweep; {OUT} names another folder")
        elif overwrite:
            open_folder(path)  # raises FileError if it is not a sweep
            remove_earlier(path)  # of `sweep --summary`
        if overwrite or not there:
            write_text(path / MANIFEST, to_json(manifest) + "\n")
        (path / PARTS).mkdir(exist_ok=True)
        folder = folder_of(path, manifest)
        for file in (path / PARTS).glob("*-????????????.parquet*") if overwrite and there else ():
            of_another = folder.ending not in file.name
            if of_another and file.suffix in (".parquet", ".unfinished"):
                file.unlink(missing_ok=True)
    return folder


def folder_of(path: Path, manifest: Mapping[str, Any]) -> Folder:
    """The folder of this sweep. Raises FileError if it holds another sweep, or one begun with
    other versions of packages."""
    folder = open_folder(path)
    there = folder.manifest
    if there["sweep"] != manifest["sweep"]:
        named = [f"{it['scenes']:,} scenes of {it['source']} by version {it['version']}, "
                 f"hash {it['sweep'][:16]}" for it in (there, manifest)]  # fmt: skip
        raise FileError(
            f"{path}: holds another sweep, {named[0]}; this is {named[1]}; "
            f"{OVERWRITE} replaces it, {OUT} names another folder"
        )
    if other := different(there["versions"]):
        raise FileError(f"{path}: was begun with {other}; rows could differ")
    return folder


def arrow() -> tuple[Any, Any]:
    """The modules pyarrow and pyarrow.parquet. Raises ExtraError if they are not installed."""
    return needed("pyarrow", "parquet"), needed("pyarrow.parquet", "parquet")
