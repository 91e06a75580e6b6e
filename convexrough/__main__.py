"""The entry point of `python -m convexrough` and of the command `convexrough`.

`main` contains all imports, so that an interrupt during an import also prints only one line.
"""

from __future__ import annotations

import os
import sys

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

INTERRUPTED = 130


def main() -> int:
    """Run the command line and return its exit status."""
    try:
        sys.unraisablehook = _unraisable
        from convexrough.cli import main as run

        status = run()
        if status == INTERRUPTED:
            os._exit(status)  # a normal exit can abort in compiled code that was interrupted
        import signal

        signal.signal(signal.SIGINT, signal.SIG_IGN)  # Python only has to exit
        return status
    except KeyboardInterrupt:
        os.write(2, b"convexrough: interrupted\n")
        return INTERRUPTED


def _unraisable(unraised: Any) -> None:
    """Send an interrupt again that Python ignores, as one that arrives while it frees an object."""
    if issubclass(unraised.exc_type, KeyboardInterrupt):
        import _thread
        from threading import Timer

        Timer(0.01, _thread.interrupt_main).start()
    else:
        sys.__unraisablehook__(unraised)


if __name__ == "__main__":
    sys.exit(main())
