"""Measurement of the memory that a computation needs."""

from __future__ import annotations

import ctypes
from contextlib import suppress
from pathlib import Path


class MemoryRise:
    """The increase of the resident memory of this process since the object was made.

    Memory that an allocator reuses is not counted.
    """

    def __init__(self) -> None:
        self._before: int | None = None
        with suppress(AttributeError, OSError, TypeError):  # only glibc can release freed memory
            ctypes.CDLL(None).malloc_trim(0)
        with suppress(OSError):
            Path("/proc/self/clear_refs").write_text("5")
            self._before = self._level("VmRSS")

    def risen(self) -> int | None:
        """[bytes] the largest increase so far; None if the system does not report it."""
        peak = self._level("VmHWM")
        if self._before is None or peak is None:
            return None
        return max(0, peak - self._before)

    @staticmethod
    def _level(name: str) -> int | None:
        with suppress(OSError):
            for line in Path("/proc/self/status").read_text().splitlines():
                if line.startswith(f"{name}:"):
                    return 1024 * int(line.split()[1])
        return None
