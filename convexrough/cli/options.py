"""Options that several commands take."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import click

Command = TypeVar("Command", bound=Callable[..., Any])
PATH = click.Path(path_type=Path)
proof_option = click.option(
    "--proof", is_flag=True, help="Write proof.json, which `convexrough check` verifies."
)
html_option = click.option("--html", is_flag=True, help="Write slider.html, an interactive page.")
json_option = click.option(
    "--json", "as_json", is_flag=True, help="Print one JSON object instead of text."
)


def output_options(command: Command) -> Command:
    """The options of every command that writes a folder of results."""
    for option in (
        json_option,
        click.option("--force", is_flag=True, help="Overwrite the results of an earlier run."),
        click.option("--no-figures", is_flag=True, help="Do not write figures."),
        click.option("--out", metavar="DIR", type=PATH, help="Folder for the results."),
    ):
        command = option(command)
    return command
