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

    Results go to the folder bench-results unless --out names another. With --page, what was found
    also goes between the markers of that page, and the figures into the folder figures beside it.
    """
    from convexrough.bench import page as pages
    from convexrough.bench import suite
    from convexrough.run.results import claim_folder
    from convexrough.run.summary import to_json

    if page is not None:
        pages.split_page(page)  # a page without markers is refused before anything is computed
    folder = out or Path("bench-results")
    claim_folder(folder, force=force)
    with progress("measuring") as show:
        found = suite.run(quick=quick, announce=show)
        files = pages.write_bench(folder, found, figures=not no_figures, page=page)
    if as_json:
        click.echo(to_json(found.summary()))
    else:
        click.echo("\n".join([*pages.describe(found), *written(folder, files)]))
    return DONE
