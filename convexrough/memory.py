"""How much memory work takes."""

from __future__ import annotations

import ctypes
from contextlib import suppress
from pathlib import Path


class MemoryRise:
    """How far the resident memory of this process has risen above its level at the start.

    Linux keeps the highest level and forgets it on request, whatever language asked for the memory.
    An allocator that reuses what it holds hides some.
    """

    def __init__(self) -> None:
        self._before: int | None = None
        with suppress(AttributeError, OSError, TypeError):  # glibc: give back what is freed
            ctypes.CDLL(None).malloc_trim(0)
        with suppress(OSError):
            Path("/proc/self/clear_refs").write_text("5")
            self._before = self._level("VmRSS")

    def risen(self) -> int | None:
        """[bytes] None where the system does not say."""
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
