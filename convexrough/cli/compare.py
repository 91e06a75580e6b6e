"""`compare`: the results of every solver on one scene."""

from __future__ import annotations

from pathlib import Path

import click

from convexrough.cli.output import (
    DONE,
    NOT_CERTIFIED,
    PATH,
    SOLVER_FAILED,
    Output,
    output_options,
    progress,
    solver_option,
)
from convexrough.errors import FileError, blamed_on


@click.command()
@click.argument("scene", type=PATH)
@solver_option
@click.option(
    "--within",
    metavar="PART",
    type=click.FloatRange(0, min_open=True),
    default=1e-3,
    show_default=True,
    help="Largest difference allowed, as a fraction of the largest load.",
)
@click.option(
    "--log",
    metavar="FILE",
    type=PATH,
    help="Write the iterations of Newton's method and Clarabel to a CSV file.",
)
@output_options("as_json")
def compare(
    output: Output, scene: Path, solvers: tuple[str, ...], within: float, log: Path | None
) -> int:
    """Solve a scene with all solvers; compare loads, proofs, times.

    SCS and QOCO also solve the cone program if they are installed. With --solver, only the named
    solvers are compared with Newton's method.

    Exit status: 0 if all results agree; 2 wrong input; 3 if a certified result
    contradicts another that is proved to be the only solution; else 4 if a solver failed; else 3
    if no result is certified, if a load differs from Newton's by more than --within, or if a
    solver does not accept the scene. A contradiction would reveal a mistake in the mathematics
    or the code.
    """
    from convexrough.compare import compare as compare_solvers
    from convexrough.compare import solver_named
    from convexrough.run import comparison as report
    from convexrough.run.results import write_rows
    from convexrough.run.scene_file import read_scene

    chosen = [solver_named(name) for name in solvers] or None
    if log is not None and log.exists():
        raise FileError(f"{log}: exists already; name another file")
    file = read_scene(scene)
    with blamed_on(scene), progress(f"pressing on {len(file.scene)} asperities"):
        comparison = compare_solvers(
            file.scene,
            approach=file.approach,
            load=file.load,
            influence=file.influence,
            solvers=chosen,
            log=log is not None,
        )
    if log is not None:
        write_rows(log, report.steps(comparison))
    summary = report.comparison_summary(comparison, within)
    lines = report.describe_comparison(summary, file.scene.units)
    output.say(summary, lines, report.comparison_warnings(summary))
    outcomes = {entry.outcome for entry in comparison.entries}
    if "failed" in outcomes and not comparison.contradictions:
        return SOLVER_FAILED
    wrong = comparison.contradictions or summary["disagreeing"]
    if wrong or "refused" in outcomes or not comparison.certified:
        return NOT_CERTIFIED
    return DONE
