"""The entry point of `python -m convexrough` and of the command `convexrough`.

`main` does all imports itself, so that an interrupt prints one line at any time.
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
            os._exit(status)  # compiled code that was interrupted can abort when Python ends
        import signal

        signal.signal(signal.SIGINT, signal.SIG_IGN)  # only the exit is left
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
