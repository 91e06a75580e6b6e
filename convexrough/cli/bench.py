"""`bench`: speed against error."""

from __future__ import annotations

from pathlib import Path

import click

from convexrough.cli.options import PATH, output_options
from convexrough.cli.speech import DONE, progress, written


@click.command()
@output_options
@click.option("--quick", is_flag=True, help="Fewer and smaller sizes: less than a minute.")
@click.option("--page", metavar="FILE", type=PATH, help="A Markdown page to renew, too.")
def bench(
    out: Path | None, no_figures: bool, force: bool, as_json: bool, quick: bool, page: Path | None
) -> int:
    """Speed against error: every solver, many sizes, the true error of each answer.

    Results go to the folder bench-results unless --out names another. With --page, the tables also
    go between the markers of that page, and the figures into the folder figures beside it.
    """
    from convexrough.bench import suite
    from convexrough.bench.files import write_bench
    from convexrough.bench.page import describe, split_page
    from convexrough.bench.plan import full_plan, quick_plan
    from convexrough.bench.summary import summarise
    from convexrough.run.results import claim_folder
    from convexrough.run.summary import to_json

    if page is not None:
        split_page(page)  # a page without markers is refused before anything is computed
    folder = out or Path("bench-results")
    claim_folder(folder, force=force)
    plan = quick_plan() if quick else full_plan()
    with progress("measuring") as show:
        found = suite.run(plan, announce=show)
        files = write_bench(folder, found, figures=not no_figures, page=page)
    lines = [to_json(summarise(found))] if as_json else describe(found)
    click.echo("\n".join(lines if as_json else [*lines, *written(folder, files)]))
    return DONE
