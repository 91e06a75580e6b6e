"""`gallery`: hard scenes with their answers, listed or written for other solvers."""

from __future__ import annotations

from pathlib import Path

import click

from convexrough.cli.options import PATH, json_option
from convexrough.cli.speech import DONE, progress


@click.command()
@click.option(
    "--list", "listed", is_flag=True, help="List the cases: what is done without options."
)
@click.option("--export", metavar="DIR", type=PATH, help="Folder for programs and answers.")
@click.option("--force", is_flag=True, help="Replace results in a folder in use.")
@click.argument("names", nargs=-1)
@json_option
def gallery(
    listed: bool, export: Path | None, force: bool, names: tuple[str, ...], as_json: bool
) -> int:
    """Hard scenes with answers to 50 digits, for the developers of solvers.

    NAMES are of cases or of families; all, if none is given. --export writes each as a quadratic
    program (.npz of qpsolvers) and as a cone program (JSON of Clarabel, and CBF), with an index.
    """
    from convexrough import gallery as wing
    from convexrough.run.columns import aligned
    from convexrough.run.gallery_files import write_gallery
    from convexrough.run.results import claim_folder
    from convexrough.run.summary import to_json

    wanted = wing.names(*names)
    cases = [wing.case(name) for name in wanted]
    lines = []
    if listed or export is None:
        heading = ["case", "family", "what is hard", "asperities", "touching"]
        rows = [
            [case.name, case.family, case.why, str(len(case)), str(case.touching.sum())]
            for case in cases
        ]
        lines = aligned([heading, *rows], left=3)
    summary = {case.name: {"family": case.family, "why": case.why} for case in cases}
    if export is not None:
        claim_folder(export, force=force)
        with progress("writing") as show:
            files = write_gallery(export, wanted, lambda name: show(f"writing: {name}"))
        lines += [f"{len(wanted)} cases, {len(files)} files, written to {export}"]
    click.echo(to_json({"cases": summary}) if as_json else "\n".join(lines))
    return DONE
