"""Files that are written whole or not at all."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from convexrough.errors import FileError

#: What is left of a file by a process that was killed while it wrote: its name, and the process.
_UNFINISHED = re.compile(r"\.(?P<name>.+)\.(?P<process>\d+)\.unfinished", re.DOTALL)


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A name beside `path` to write to, which takes its place if all goes well, or vanishes.

    Raises FileError where it cannot be written. A process that is killed leaves the file beside it.
    """
    temporary = path.with_name(f".{path.name}.{os.getpid()}.unfinished")
    try:
        yield temporary
        os.replace(temporary, path)
    except OSError as error:
        raise FileError(f"{path}: cannot be written: {error.strerror or error}") from error
    finally:
        with suppress(OSError):  # a file system that became read-only has said so already
            temporary.unlink(missing_ok=True)


def remove_unfinished(folder: Path) -> None:
    """Remove what killed processes left in a folder; of one that still runs, nothing."""
    for path in folder.iterdir():
        found = _UNFINISHED.fullmatch(path.name)
        if found and path.is_file() and not path.is_symlink() and not _runs(int(found["process"])):
            path.unlink(missing_ok=True)


def _runs(process: int) -> bool:
    import psutil  # only asked when something is left

    return psutil.pid_exists(process)
