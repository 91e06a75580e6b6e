"""`gallery`: hard scenes with their answers, listed or written for other solvers."""

from __future__ import annotations

from pathlib import Path

import click

from convexrough.cli.options import PATH, json_option, solver_option
from convexrough.cli.speech import DONE, progress


@click.command()
@click.option(
    "--list", "listed", is_flag=True, help="List the cases: what is done without options."
)
@click.option("--export", metavar="DIR", type=PATH, help="Folder for programs and answers.")
@click.option("--force", is_flag=True, help="Replace results in a folder in use.")
@click.option("--profile", is_flag=True, help="Time every solver, and judge its answers.")
@solver_option
@click.argument("names", nargs=-1)
@json_option
def gallery(
    listed: bool,
    export: Path | None,
    force: bool,
    profile: bool,
    solvers: tuple[str, ...],
    names: tuple[str, ...],
    as_json: bool,
) -> int:
    """Hard scenes with answers to 50 digits, for the developers of solvers.

    NAMES are of cases or of families; all, if none is given. --export writes each as a quadratic
    program (.npz of qpsolvers) and as a cone program (JSON of Clarabel, and CBF), with an index.
    --profile is a performance profile, of all our solvers or of those that --solver names.
    """
    from convexrough import gallery as wing
    from convexrough.compare import solver_named
    from convexrough.run.columns import aligned
    from convexrough.run.gallery_files import write_gallery
    from convexrough.run.results import claim_folder
    from convexrough.run.summary import to_json

    wanted = wing.names(*names)
    if profile or solvers:
        rivals = [solver_named(each) for each in solvers]
        from convexrough.bench.profile import profile_of

        with progress("timing") as show:
            table = profile_of(
                rivals or None, cases=wanted, announce=lambda name: show(f"timing: {name}")
            ).rows()
        found = [dict(zip(table[0], row, strict=True)) for row in table[1:]]
        click.echo(to_json({"profile": found}) if as_json else "\n".join(aligned(table, left=1)))
        return DONE
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
