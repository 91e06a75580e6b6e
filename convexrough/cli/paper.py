"""`paper`: the source paper's example."""

from __future__ import annotations

from pathlib import Path

import click

from convexrough.cli.options import html_option, output_options
from convexrough.cli.speech import progress, say, written


@click.command()
@html_option
@output_options
def paper(out: Path | None, no_figures: bool, force: bool, as_json: bool, html: bool) -> int:
    """Reproduce the source paper's example (Dini and Hills 2009)."""
    from convexrough.paper import example
    from convexrough.paper.figure_data import figure_data
    from convexrough.run import results
    from convexrough.run.summary import summarise

    folder = out or Path("paper-results")
    results.claim_folder(folder, force=force)
    with progress("reproducing the paper"):
        found = example.findings()
        comparison = example.compare(found)
        summary = summarise(found) | {"paper": comparison}
        files = results.write_tables(folder, figure_data(found.contact))
        if not no_figures:
            from convexrough.paper.figures import paper_figures

            files += results.write_figures(folder, paper_figures(found.contact))
        files += results.write_results(folder, found, summary, figures=False, html=html)
    lines = ["", *example.table(comparison), *written(folder, files)]
    return say(summary, as_json, lines)
