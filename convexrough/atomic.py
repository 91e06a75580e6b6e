"""Writing of files that replace earlier ones only when complete, and of JSON without infinities."""

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

#: The name of an unfinished file contains its final name and the number of the process.
_UNFINISHED = re.compile(r"\.(?P<name>.+)\.(?P<process>\d+)\.unfinished", re.DOTALL)


def unfinished(path: Path) -> Path:
    """The path under which this process writes the file `path` until the file is complete."""
    return path.with_name(f".{path.name}.{os.getpid()}.unfinished")


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A context manager: the body writes to the path it gets, which then replaces `path`. A file
    that is not complete is removed, except if the process is killed."""
    temporary = unfinished(path)
    try:
        with file_errors(path, "be written"):
            yield temporary
            os.replace(temporary, path)
    finally:
        with suppress(OSError):  # an earlier error is already being raised
            temporary.unlink(missing_ok=True)


def write_text(path: Path, text: str | bytes) -> Path:
    """Write a text (as UTF-8) or bytes to a file; return the path of the file."""
    with replacing(path) as temporary:
        temporary.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def to_json(contents: Any) -> str:
    """The contents as valid JSON, with null for infinities and nan."""
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
    """Remove the unfinished files and folders of processes that no longer run."""
    for path in folder.iterdir():
        found = _UNFINISHED.fullmatch(path.name)
        if not found or path.is_symlink():
            continue
        import psutil  # imported only when an unfinished file is found

        if psutil.pid_exists(int(found["process"])):
            continue
        if path.is_dir():
            shutil.rmtree(path, ignore_errors=True)
        elif path.is_file():
            path.unlink(missing_ok=True)
