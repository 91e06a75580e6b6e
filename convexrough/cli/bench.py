"""`bench`: measure the time and error of every solver."""

from __future__ import annotations

from pathlib import Path

import click

from convexrough.cli.options import PATH, output_options
from convexrough.cli.speech import DONE, echo, progress, written


@click.command()
@output_options
@click.option("--quick", is_flag=True, help="Use fewer and smaller scenes.")
@click.option("--page", metavar="FILE", type=PATH, help="Also update this Markdown page.")
def bench(
    out: Path | None, no_figures: bool, force: bool, as_json: bool, quick: bool, page: Path | None
) -> int:
    """Measure time and error of solvers for many scene sizes.

    Results go to the folder bench-results unless --out names another. With --page, the command also
    replaces the text of the page FILE between the markers "bench: begin" and "bench: end", and the
    figures of the page in the folder "figures" next to FILE.
    """
    from convexrough.bench import rows, suite
    from convexrough.run.results import results_folder

    if page is not None:
        rows.split_page(page)  # a page without markers is refused before anything is computed
    folder = out or Path("bench-results")
    with results_folder(folder, force=force) as new, progress("measuring"):
        found = suite.run(quick=quick)
        files = rows.write_bench(new, found, figures=not no_figures, page=page)
    echo(found.summary(), [*rows.describe(found), *written(folder, files)], as_json)
    return DONE
