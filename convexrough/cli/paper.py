"""`paper`: the source paper's example."""

from __future__ import annotations

from pathlib import Path

import click

from convexrough.cli.output import Output, html_option, output_options, progress, written


@click.command()
@html_option
@output_options()
def paper(output: Output, html: bool) -> int:
    """Reproduce the example of Dini and Hills (2009).

    Tables and figures go to the folder paper-results unless --out names another.
    """
    from convexrough.paper import example
    from convexrough.paper.figure_data import figure_data
    from convexrough.paper.states import PaperStates
    from convexrough.run.results import slider_page

    with output.folder(Path("paper-results")) as new, progress("reproducing the paper"):
        found = example.results()
        contact = found[0].contact
        comparison = example.compare(found)
        states = PaperStates.of(contact)
        new.tables(figure_data(states))
        if not output.no_figures:
            from convexrough.paper.figures import paper_figures

            new.figures(paper_figures(contact, states))
        if html:
            new.text("slider.html", slider_page(found[0]))
        more = {"paper": comparison}
        new.results(found, figures=False, more=more)
    return output.say_results(found, ["", *example.table(comparison), *written(new)], more)
