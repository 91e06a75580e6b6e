"""What commands say, where they say it, and the exit status that it deserves."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import click

from convexrough.errors import InputError

if TYPE_CHECKING:
    from convexrough.run.summary import Summary
    from convexrough.tabular.units import UnitNames

DONE, UNHEARD, WRONG_INPUT, NOT_CERTIFIED, SOLVER_FAILED, INTERRUPTED = 0, 1, 2, 3, 4, 130


def written(folder: Path, files: Sequence[Path]) -> list[str]:
    place = "here" if folder == Path() else f"to {folder}"
    return ["", f"written {place}: {', '.join(path.name for path in files)}"]


def say(
    summary: Summary, as_json: bool, lines: Sequence[str] = (), units: UnitNames | None = None
) -> int:
    """Print the summary, then `lines`, and return the exit status that it deserves."""
    from convexrough.run.report import describe, warnings
    from convexrough.run.summary import proved, to_json

    length, force = units or ("", "")
    if as_json:
        click.echo(to_json(summary))
    else:
        described = describe(summary, length_unit=length, force_unit=force)
        click.echo("\n".join([*described, *lines]))
    for warning in warnings(summary, length_unit=length, force_unit=force):
        say_aside("warning", warning)
    return DONE if proved(summary) else NOT_CERTIFIED


def say_aside(*parts: str) -> None:
    click.echo(": ".join(("convexrough", *parts)), err=True)


@contextmanager
def blamed_on(path: Path) -> Iterator[None]:
    """Mistakes that show only in computing, with the file named."""
    try:
        yield
    except InputError as error:
        raise error.within(str(path)) from error


@contextmanager
def progress(message: str) -> Iterator[Callable[[str], object]]:
    """A moving line on standard error while the body runs, if that is a terminal.

    Yields what changes the message.
    """
    if not sys.stderr.isatty():
        yield lambda message: None
        return
    from rich.console import Console

    with Console(stderr=True).status(message) as status:
        yield status.update
