"""`gallery`: hard scenes with their answers, listed or written for other solvers."""

from __future__ import annotations

from pathlib import Path

import click

from convexrough.cli.options import PATH, force_option, json_option, solver_option
from convexrough.cli.speech import DONE, echo, progress


@click.command()
@click.option("--list", "show_list", is_flag=True, help="List the cases (default).")
@click.option("--export", metavar="DIR", type=PATH, help="Folder for programs and answers.")
@force_option
@click.option("--profile", is_flag=True, help="Time every solver and check its solutions.")
@solver_option
@click.argument("names", nargs=-1)
@json_option
def gallery(
    show_list: bool,
    export: Path | None,
    force: bool,
    profile: bool,
    solvers: tuple[str, ...],
    names: tuple[str, ...],
    as_json: bool,
) -> int:
    """List, export or time hard scenes with 50-digit answers.

    A case is a scene; a family has cases that are hard in the same way. NAMES are names of cases or
    families; default: all cases. --export writes each case as a quadratic program (.npz for
    qpsolvers) and as a cone program (JSON for Clarabel, and CBF), with an index. --profile prints
    how often each solver is right, and how fast; with --solver it times only Newton's method and
    the named solvers. Loads are right if all errors are at most 0.1 % of the largest load; the
    contact set is right if exactly the asperities that touch have a load.
    """
    from convexrough import gallery as wing
    from convexrough.atomic import write_text
    from convexrough.compare import solver_named
    from convexrough.gallery.export import exported
    from convexrough.run.results import results_folder
    from convexrough.tabular.columns import aligned

    if export is not None and (profile or solvers):
        raise click.UsageError("--export excludes --profile and --solver.")
    wanted = wing.names(*names)
    if profile or solvers:
        chosen = [solver_named(each) for each in solvers]
        from convexrough.bench.profile import profile_of

        with progress("timing"):
            found = profile_of(chosen or None, cases=wanted)
        rows, reported = found.rows(), []
        cells: list[list[str]] = [list(rows[0])]
        for row, each in zip(rows, found.outcomes, strict=True):
            cells.append([f"{x:.0%}" if isinstance(x, float) else str(x) for x in row.values()])
            outcomes = dict(zip(found.cases, each.tolist(), strict=True))
            reported.append({**row, "outcomes": outcomes})
        echo({"profile": reported}, aligned(cells, left=1), as_json)
        return DONE
    cases = [wing.case(name) for name in wanted]
    lines = []
    if show_list or export is None:
        heading = ["case", "family", "what is hard", "asperities", "touching"]
        lines_of_cases = [
            [case.name, case.family, case.why, str(len(case)), str(case.touching.sum())]
            for case in cases
        ]
        lines = aligned([heading, *lines_of_cases], left=3)
    summary = {case.name: {"family": case.family, "why": case.why} for case in cases}
    if export is not None:
        with results_folder(export, force=force) as new, progress("writing"):
            files = [write_text(new / name, text) for name, text in exported(wanted)]
        lines += [f"{len(wanted)} cases, {len(files)} files, written to {export}"]
    echo({"cases": summary}, lines, as_json)
    return DONE
