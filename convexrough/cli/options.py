"""Options that several commands take."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import click

Command = TypeVar("Command", bound=Callable[..., Any])
PATH = click.Path(path_type=Path)
proof_option = click.option(
    "--proof", is_flag=True, help="Write proof.json, which `convexrough check` verifies."
)
#: Formats of figures.
FORMATS = ("png", "svg", "pdf")
solver_option = click.option(
    "--solver", "solvers", metavar="NAME", multiple=True, callback=lambda *given: _from_here(given),
    help="A solver of the package, or the import path of your class, such as mine.Solver; may be "
    "repeated.",
)  # fmt: skip
html_option = click.option(
    "--html",
    is_flag=True,
    help="Also write slider.html, an interactive page.",
)
force_option = click.option(
    "--force", is_flag=True, help="Overwrite the results of an earlier run."
)
out_option = click.option("--out", metavar="DIR", type=PATH, help="Folder for the results.")
json_option = click.option(
    "--json", "as_json", is_flag=True, help="Print one JSON object instead of text."
)


def _from_here(given: tuple[Any, ...]) -> Any:
    """The solvers of --solver. This call makes modules of the current folder importable."""
    if given[-1] and "" not in sys.path:
        sys.path.insert(0, "")
    return given[-1]


def _together(*options: Callable[[Command], Command]) -> Callable[[Command], Command]:
    """A decorator that adds several options; the help shows them in this order."""

    def add(command: Command) -> Command:
        for option in reversed(options):
            command = option(command)
        return command

    return add


def _formats(given: str) -> tuple[str, ...]:
    formats = tuple(dict.fromkeys(each.strip().lower() for each in given.split(",")))
    if unknown := [each for each in formats if each not in FORMATS]:
        raise click.BadParameter(f"found {unknown[0]!r}, expected {', '.join(FORMATS)}")
    return formats


#: The options for figures: `formats`, a tuple, and `dpi`.
figure_options = _together(
    click.option("--formats", metavar="LIST", default="png", show_default=True,
                 callback=lambda *given: _formats(given[-1]),
                 help="Formats of figures: png, svg, pdf."),
    click.option("--dpi", type=click.IntRange(50, 600), default=200, show_default=True,
                 help="Pixels per inch of figures."),
)  # fmt: skip
#: The options of every command that writes a folder of results.
output_options = _together(
    out_option,
    click.option("--no-figures", is_flag=True, help="Do not write figures."),
    force_option,
    json_option,
)
