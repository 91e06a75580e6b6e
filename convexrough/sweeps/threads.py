"""Linear algebra in one thread: two add up in another order, and workers share the cores anyway."""

from __future__ import annotations

import threading
from contextlib import ContextDecorator
from types import TracebackType

import scipy.linalg  # noqa: F401  what is not loaded yet cannot be told
from threadpoolctl import OpenBLASController, threadpool_limits


class OneThread(ContextDecorator):
    """While any thread of this process is inside; the last to leave gives the others back."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._inside = 0
        self._limits: threadpool_limits | None = None

    def __enter__(self) -> OneThread:
        with self._lock:
            self._inside += 1
            if self._limits is None:
                _free()
                self._limits = threadpool_limits(1)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        with self._lock:
            self._inside -= 1
            if self._inside == 0 and self._limits is not None:
                _free()
                self._limits.restore_original_limits()
                self._limits = None
                _free()


def _free() -> None:
    """Let this thread set limits: threadpoolctl 3.8 heeds only the thread that was first."""
    if hasattr(OpenBLASController, "clear_controlling_thread"):
        OpenBLASController.clear_controlling_thread(force=True)


one_thread = OneThread()
