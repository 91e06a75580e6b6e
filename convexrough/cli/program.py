"""The program: its commands, exit statuses and error messages. Each command imports slow modules
only when it runs."""

from __future__ import annotations

import errno
import os
import signal
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from threading import current_thread, main_thread
from types import FrameType

import click
from click.shell_completion import shell_complete

from convexrough.cli import common
from convexrough.cli.run import check, new, run, sweep
from convexrough.cli.solvers import bench, compare, export, gallery, paper
from convexrough.cli.summits import summits
from convexrough.cli.verify import verify
from convexrough.errors import ConvexroughError, SolverError, WorkerError
from convexrough.version import __version__

#: Environment variable by which a shell requests a completion script, or completions of a line.
COMPLETE = "_CONVEXROUGH_COMPLETE"


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(__version__, prog_name="convexrough")
def program() -> None:
    """Compute rough frictional contact, with a proof of which asperities touch.

    Exit status: 0 done, everything proved; 1 standard output was closed or full, or `check` refused
    a proof file; 2 wrong input; 3 done, but a result is not proved, or a checked claim is wrong or
    not proved; 4 a solver or a scene of a sweep failed; 130 interrupted.
    """


for command in (run, verify, check, compare, export, sweep, new, summits, paper, bench, gallery):
    program.add_command(command)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit status. Errors give a message, not a traceback."""
    with _interrupts() as interrupts:
        try:
            return _status(arguments)
        except click.exceptions.Exit as end:
            return end.exit_code
        except click.ClickException as error:
            error.show()
            if "unexpected extra argument" in error.message:
                common.say_aside(
                    "hint", "quote names that contain spaces, as in --column 'x=X coordinate'"
                )
            return error.exit_code
        except (click.Abort, KeyboardInterrupt):
            common.say_aside("interrupted")
            return common.INTERRUPTED
        except ConvexroughError as error:
            for line in str(error).splitlines():
                common.say_aside("error", line)
            stopped = isinstance(error, (SolverError, WorkerError))
            return common.SOLVER_FAILED if stopped else common.WRONG_INPUT
        except OSError as error:  # of standard output: errors of files are FileError
            return _unheard(error)
        except Exception:
            if not interrupts:
                raise
            common.say_aside("interrupted")  # compiled code raised another error
            return common.INTERRUPTED


def _status(arguments: Sequence[str] | None) -> int:
    if arguments is None and (asked := os.environ.get(COMPLETE)):
        return shell_complete(program, {}, "convexrough", COMPLETE, asked)
    given = sys.argv[1:] if arguments is None else list(arguments)
    with program.make_context("convexrough", given) as context:
        status = int(program.invoke(context) or common.DONE)
    if sys.stdout is not None:  # it is None where a shell closed it
        sys.stdout.flush()
    return status


@contextmanager
def _interrupts() -> Iterator[list[int]]:
    """A list of the Ctrl-C signals during the body; each also raises KeyboardInterrupt."""
    seen: list[int] = []
    handler = signal.getsignal(signal.SIGINT)
    if handler is not signal.default_int_handler or current_thread() is not main_thread():
        yield seen
        return

    def interrupt(number: int, frame: FrameType | None) -> None:
        seen.append(number)
        raise KeyboardInterrupt

    signal.signal(signal.SIGINT, interrupt)
    try:
        yield seen
    finally:
        signal.signal(signal.SIGINT, handler)


def _unheard(error: OSError) -> int:
    """The exit status if standard output is closed or full. Result files are complete then."""
    if error.errno != errno.EPIPE:
        common.say_aside("error", f"standard output: {error.strerror or error}")
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)  # unwritten output is dropped at exit
    os.close(nowhere)
    return common.UNHEARD
