"""Output of commands, and their exit statuses."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from convexrough.run.stage import Result

DONE, UNHEARD, WRONG_INPUT, NOT_CERTIFIED, SOLVER_FAILED, INTERRUPTED = 0, 1, 2, 3, 4, 130


def written(folder: Path, files: Sequence[Path]) -> list[str]:
    place = "here" if folder == Path() else f"to {folder}"
    return ["", f"written {place}: {', '.join(path.name for path in files)}"]


def say(
    results: Iterable[Result],
    as_json: bool,
    lines: Sequence[str] = (),
    more: dict[str, Any] | None = None,
) -> int:
    """Print the summary with `more`, or results and `lines`; print warnings; return exit status."""
    from convexrough.run.summary import describe, summarise, warnings

    results = list(results)
    summary = summarise(results) | (more or {})
    echo(summary, [*describe(results), *lines], as_json, warnings(results))
    return DONE if all(result.certified for result in results) else NOT_CERTIFIED


def echo(
    summary: dict[str, Any], lines: Iterable[str], as_json: bool, warnings: Iterable[str] = ()
) -> None:
    """Print the summary as a JSON object, or the lines; print warnings on standard error."""
    from convexrough.run.summary import to_json

    click.echo(to_json(summary) if as_json else "\n".join(lines))
    for warning in warnings:
        say_aside("warning", warning)


def say_aside(*parts: str) -> None:
    click.echo(": ".join(("convexrough", *parts)), err=True)


@contextmanager
def progress(message: str) -> Iterator[Callable[[str], object]]:
    """Show a status line on standard error while the body runs, if that is a terminal.

    The line also shows records of the logger `convexrough`. Yields a function that changes it.
    """
    if not sys.stderr.isatty():
        yield lambda message: None
        return
    from rich.console import Console

    from convexrough.progress import logged

    with (
        Console(stderr=True).status(message) as status,
        logged(lambda record: status.update(f"{message}: {record.getMessage()}")),
    ):
        yield status.update
