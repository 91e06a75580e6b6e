"""The folder of a sweep: a manifest that never changes, and parts, each written once and whole.

A part is some rows that follow each other. Its name says which and what is in it: the numbers of
the first and the last scene, and the beginning of the SHA-256 of the file.
"""

from __future__ import annotations

import hashlib
import io
import json
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from convexrough.errors import ExtraError, FileError
from convexrough.run.summary import to_json
from convexrough.sweeps.batch import Columns, Rows, different
from convexrough.whole import replacing as beside

MANIFEST, PARTS = "manifest.json", "parts"

#: Letters of the hash in a name.
SHORT = 16

NAME = re.compile(rf"(\d{{12,}})-(\d{{12,}})-([0-9a-f]{{{SHORT}}})\.(parquet|npz)")


class Part(NamedTuple):
    """Rows of scenes `first` to `stop` - 1, in a file whose name ends in `hash`."""

    path: Path
    first: int
    stop: int
    hash: str


@dataclass(frozen=True)
class Folder:
    """A folder of results. format : of its parts, "parquet" or "npz" """

    path: Path
    manifest: Mapping[str, Any]

    @property
    def format(self) -> str:
        return str(self.manifest["format"])

    def parts(self) -> list[Part]:
        """In the order of their scenes; other files are not looked at."""
        try:
            names = [each.name for each in (self.path / PARTS).iterdir()]
        except OSError as error:
            raise _unreadable(self.path / PARTS, error) from error
        found = []
        for name in sorted(names):
            if match := NAME.fullmatch(name):
                first, last, short, _ = match.groups()
                found.append(Part(self.path / PARTS / name, int(first), int(last) + 1, short))
        return found

    def write(self, rows: Rows) -> Path:
        """Write a part, whole or not at all."""
        data = _packed(rows.columns, self.format)
        short = hashlib.sha256(data).hexdigest()[:SHORT]
        name = f"{rows.first:012d}-{rows.stop - 1:012d}-{short}.{self.format}"
        with beside(self.path / PARTS / name) as temporary:
            temporary.write_bytes(data)
        return self.path / PARTS / name

    def clear(self, numbers: range) -> tuple[int, int]:
        """Remove what of these scenes is damaged, and what was not written to its end.

        Returns how many files there were of each.
        """
        damaged = [part for part in self.parts() if _meets(part, numbers) and not _whole(part)]
        unfinished = [
            each
            for each in (self.path / PARTS).glob(".*")
            if (match := NAME.match(each.name[1:])) and int(match[1]) in numbers
        ]
        for path in (*(part.path for part in damaged), *unfinished):
            path.unlink(missing_ok=True)
        return len(damaged), len(unfinished)


def open_folder(path: Path) -> Folder:
    """A folder that holds a sweep; FileError if it does not."""
    try:
        manifest = json.loads((path / MANIFEST).read_text(encoding="utf-8"))
        if not isinstance(manifest, dict) or "sweep" not in manifest:
            raise ValueError("no sweep")
    except FileNotFoundError as error:
        raise FileError(f"{path}: no sweep: there is no {MANIFEST}") from error
    except (OSError, ValueError) as error:
        raise _unreadable(path / MANIFEST, error) from error
    return Folder(path, manifest)


def make_folder(path: Path, manifest: Mapping[str, Any]) -> Folder:
    """The folder of this sweep, made where it is not there.

    Raises FileError where it holds another sweep, or other things, or cannot be written.
    """
    if not (path / MANIFEST).exists():
        try:
            (path / PARTS).mkdir(parents=True, exist_ok=True)
            # A manifest may come while this looks: of another process, of the same sweep or not.
            strangers = [each.name for each in path.iterdir() if each.name not in (PARTS, MANIFEST)]
        except OSError as error:
            raise FileError(f"{path}: cannot hold results: {error.strerror or error}") from error
        if strangers := [name for name in strangers if not name.startswith(f".{MANIFEST}")]:
            raise FileError(f"{path}: holds {strangers[0]}, and no sweep; --out takes another")
        if not (path / MANIFEST).exists():
            with beside(path / MANIFEST) as temporary:
                temporary.write_text(to_json(dict(manifest)) + "\n", encoding="utf-8")
    folder = open_folder(path)
    there, asked = folder.manifest, manifest
    if there["sweep"] != asked["sweep"]:
        raise FileError(
            f"{path}: holds another sweep, {_named(there)}; this is {_named(asked)}; "
            f"--out takes another folder"
        )
    if other := different(there["versions"]):
        raise FileError(f"{path}: was begun with {other}; rows would not be of one kind")
    return folder


def _named(manifest: Mapping[str, Any]) -> str:
    return (
        f"{manifest['scenes']:,} scenes of {manifest['source']} by version {manifest['version']}, "
        f"hash {manifest['sweep'][:SHORT]}"
    )


def best_format() -> str:
    """Parquet where pyarrow is installed."""
    return "parquet" if find_spec("pyarrow") else "npz"


def length(numbers: range) -> int:
    """`len` that can say 10^20."""
    return max(0, numbers.stop - numbers.start)


def missing(parts: Iterable[Part], numbers: range) -> list[range]:
    """The scenes that are in no part."""
    gaps, reached = [], numbers.start
    for part in sorted(parts, key=lambda each: each.first):
        if part.first > reached:
            gaps.append(range(reached, min(part.first, numbers.stop)))
        reached = max(reached, part.stop)
    gaps.append(range(reached, numbers.stop))
    return [gap for gap in gaps if gap.start < gap.stop]


def once(parts: Iterable[Part]) -> Iterator[tuple[Part, range]]:
    """Each scene once: two runs at the same time may have computed the same."""
    reached = 0
    for part in sorted(parts, key=lambda each: (each.first, each.stop)):
        if part.stop > reached:
            yield part, range(max(part.first, reached), part.stop)
            reached = part.stop


def read_part(part: Part, numbers: range, names: Sequence[str] | None = None) -> Columns:
    """Some columns of some scenes of a part; FileError where it is damaged."""
    try:
        data = part.path.read_bytes()
    except OSError as error:
        raise _unreadable(part.path, error) from error
    if hashlib.sha256(data).hexdigest()[:SHORT] != part.hash:
        raise FileError(f"{part.path}: damaged: not what was written; --resume computes it again")
    rows = slice(numbers.start - part.first, numbers.stop - part.first)
    columns = _unpacked(data, part.path.suffix[1:], names)
    return {name: values[rows] for name, values in columns.items()}


def _packed(columns: Columns, format: str) -> bytes:
    sink = io.BytesIO()
    if format == "parquet":
        pyarrow, parquet = _arrow()
        parquet.write_table(pyarrow.table(columns), sink)
    else:
        np.savez(sink, **columns)  # type: ignore[arg-type]
    return sink.getvalue()


def _unpacked(data: bytes, format: str, names: Sequence[str] | None) -> Columns:
    source = io.BytesIO(data)
    if format == "parquet":
        _, parquet = _arrow()
        # Threads of its own could outlive the interpreter, which ends the process by an abort.
        wanted = None if names is None else list(names)
        table = parquet.read_table(source, columns=wanted, use_threads=False, pre_buffer=False)
        # Text of pyarrow comes as objects.
        arrays = {name: table[name].to_numpy() for name in table.column_names}
        arrays = {
            name: values.astype(np.str_) if values.dtype == object else values
            for name, values in arrays.items()
        }
    else:
        with np.load(source) as file:
            arrays = {name: file[name] for name in (file.files if names is None else names)}
    return arrays if names is None else {name: arrays[name] for name in names}


def _arrow() -> tuple[Any, Any]:
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError as error:
        raise ExtraError("parquet") from error
    return pyarrow, pyarrow.parquet


def _meets(part: Part, numbers: range) -> bool:
    return part.first < numbers.stop and numbers.start < part.stop


def _whole(part: Part) -> bool:
    try:
        return hashlib.sha256(part.path.read_bytes()).hexdigest()[:SHORT] == part.hash
    except OSError as error:
        raise _unreadable(part.path, error) from error


def _unreadable(path: Path, error: Exception) -> FileError:
    return FileError(f"{path}: cannot be read: {getattr(error, 'strerror', None) or error}")
