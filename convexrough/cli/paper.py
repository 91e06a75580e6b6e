"""`paper`: the source paper's example."""

from __future__ import annotations

from pathlib import Path

import click

from convexrough.cli.options import figure_options, html_option, output_options
from convexrough.cli.speech import progress, say, written


@click.command()
@html_option
@figure_options
@output_options
def paper(
    out: Path | None,
    no_figures: bool,
    force: bool,
    as_json: bool,
    html: bool,
    formats: tuple[str, ...],
    dpi: int,
) -> int:
    """Reproduce the example of Dini and Hills (2009).

    Tables and figures go to the folder paper-results unless --out names another.
    """
    from convexrough.atomic import write_text
    from convexrough.paper import example
    from convexrough.paper.figures import figure_data, paper_figures
    from convexrough.paper.states import PaperStates
    from convexrough.run.results import (
        results_folder,
        slider_page,
        write_figures,
        write_results,
        write_tables,
    )

    folder = out or Path("paper-results")
    with results_folder(folder, force=force) as new, progress("reproducing the paper"):
        found = example.results()
        for result in found:
            result.prepare(figures=False)
        contact = found[0].contact
        comparison = example.compare(found)
        states = PaperStates(contact)
        files = write_tables(new, figure_data(states))
        if not no_figures:
            files += write_figures(new, paper_figures(contact, states), formats=formats, dpi=dpi)
        if html:
            page = slider_page(found[0])
            files.append(write_text(new / "slider.html", page))
        more = {"paper": comparison}
        files += write_results(new, found, figures=False, more=more)
    lines = ["", *example.table(comparison), *written(folder, files)]
    return say(found, as_json, lines, more=more)
