"""Files that are written whole or not at all, and JSON without infinities."""

from __future__ import annotations

import json
import math
import os
import re
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from convexrough.errors import file_errors

#: What is left of a file by a process that was killed while it wrote: its name, and the process.
_UNFINISHED = re.compile(r"\.(?P<name>.+)\.(?P<process>\d+)\.unfinished", re.DOTALL)


def unfinished(path: Path) -> Path:
    """A name beside `path` for what is not whole yet."""
    return path.with_name(f".{path.name}.{os.getpid()}.unfinished")


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A name beside `path` to write to, which takes its place if all goes well, or vanishes.

    Raises FileError where it cannot be written. A process that is killed leaves the file beside it.
    """
    temporary = unfinished(path)
    try:
        with file_errors(path, "be written"):
            yield temporary
            os.replace(temporary, path)
    finally:
        with suppress(OSError):  # a file system that became read-only has said so already
            temporary.unlink(missing_ok=True)


def write_text(path: Path, text: str | bytes) -> Path:
    """Write a file; the path."""
    with replacing(path) as temporary:
        temporary.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def to_json(contents: Any) -> str:
    """Valid JSON, in which infinities and nan are null."""
    return json.dumps(_finite(contents), indent=2, allow_nan=False)


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(each) for key, each in value.items()}
    if isinstance(value, list):
        return [_finite(each) for each in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def remove_unfinished(folder: Path) -> None:
    """Remove what killed processes left in a folder; of one that still runs, nothing."""
    for path in folder.iterdir():
        found = _UNFINISHED.fullmatch(path.name)
        if not found or path.is_symlink() or _runs(int(found["process"])):
            continue
        if path.is_dir():
            shutil.rmtree(path, ignore_errors=True)
        elif path.is_file():
            path.unlink(missing_ok=True)


def _runs(process: int) -> bool:
    import psutil  # only asked when something is left

    return psutil.pid_exists(process)
