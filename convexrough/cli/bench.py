"""`bench`: measure the time and error of every solver."""

from __future__ import annotations

from pathlib import Path

import click

from convexrough.cli.output import DONE, PATH, Output, output_options, progress, written


@click.command()
@output_options("out", "no_figures", "force", "as_json")
@click.option("--quick", is_flag=True, help="Use fewer and smaller scenes.")
@click.option("--page", metavar="FILE", type=PATH, help="Also update this Markdown page.")
def bench(output: Output, quick: bool, page: Path | None) -> int:
    """Measure time and error of solvers for many scene sizes.

    Results go to the folder bench-results unless --out names another. With --page, the command also
    replaces the text of the page FILE between the markers "bench: begin" and "bench: end", and the
    figures of the page in the folder "figures" next to FILE.
    """
    from convexrough.bench import page as pages
    from convexrough.bench import suite

    if page is not None:
        pages.split_page(page)  # a page without markers is refused before anything is computed
    with output.folder(Path("bench-results")) as new, progress("measuring"):
        found = suite.run(quick=quick)
        pages.write_bench(new, found, figures=not output.no_figures, page=page)
    output.say(found.summary(), [*pages.describe(found), *written(new)])
    return DONE
