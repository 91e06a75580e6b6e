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
        _say_interrupted()
        return INTERRUPTED


def _unraisable(unraised: Any) -> None:
    """Exit on an interrupt that cannot be raised, such as one in a callback of a library."""
    if issubclass(unraised.exc_type, KeyboardInterrupt):
        _say_interrupted()
        os._exit(INTERRUPTED)
    sys.__unraisablehook__(unraised)


def _say_interrupted() -> None:
    os.write(2, b"convexrough: interrupted\n")


if __name__ == "__main__":
    sys.exit(main())
