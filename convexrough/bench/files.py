"""Files of what was measured, each written whole or not at all."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from convexrough.bench.page import renewed_page
from convexrough.bench.suite import Bench
from convexrough.bench.summary import summarise, tables
from convexrough.errors import FileError
from convexrough.run.results import beside, write_figures, write_tables
from convexrough.run.summary import to_json

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: Folder for the figures of a page, beside it.
PAGE_FIGURES = "figures"


def write_bench(folder: Path, bench: Bench, *, figures: bool, page: Path | None) -> list[Path]:
    """Write bench.json, the tables and the figures; renew the page, if one is given.

    Returns the paths. Raises FileError; files already written stay.
    """
    written = write_tables(folder, tables(bench))
    drawn: Mapping[str, Figure] = {}
    if figures or page is not None:
        from convexrough.bench.figures import bench_figures  # matplotlib: only when it draws

        drawn = bench_figures(bench)
    if figures:
        written += write_figures(folder, drawn)
    path = folder / "bench.json"
    with beside(path) as temporary:
        temporary.write_text(to_json(summarise(bench)) + "\n", encoding="utf-8")
    if page is not None:
        written += _renew(page, bench, drawn)
    return [path, *written]


def _renew(page: Path, bench: Bench, figures: Mapping[str, Figure]) -> list[Path]:
    """The figures first, so that the page never shows what is not there."""
    text = renewed_page(page, bench, PAGE_FIGURES)
    folder = page.parent / PAGE_FIGURES
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise FileError(f"{folder}: cannot be made: {error.strerror or error}") from error
    written = []
    for stem, figure in figures.items():
        path = folder / f"{stem}.png"
        with beside(path) as temporary:
            figure.savefig(temporary, format="png", dpi=200)
        written.append(path)
    with beside(page) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return [*written, page]
