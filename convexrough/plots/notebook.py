"""Figures and axes that notebooks display, and `save`."""

from __future__ import annotations

import sys
from base64 import b64encode
from io import BytesIO
from pathlib import Path
from typing import Any

from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backend_bases import get_registered_canvas_class
from matplotlib.figure import Figure as MatplotlibFigure

from convexrough.errors import InputError

#: Formats of files, with options for matplotlib: a level of compression that takes two thirds of
#: the usual time, for files that are 5 % larger; and no dates, so that files can be compared.
FORMATS: dict[str, dict[str, Any]] = {
    "png": {"pil_kwargs": {"compress_level": 3}},
    "svg": {"metadata": {"Date": None}},
    "pdf": {"metadata": {"CreationDate": None}},
}

#: Limits of the resolution [pixels per inch].
LEAST_DPI, MOST_DPI = 50, 600

#: Settings that keep text as text in SVG and PDF, and use fixed ids, so that files can be compared.
REAL_TEXT: Any = {"svg.fonttype": "none", "pdf.fonttype": 42, "svg.hashsalt": "convexrough"}


class Figure(MatplotlibFigure):
    """A matplotlib figure that notebooks display, without pyplot."""

    def _repr_png_(self) -> bytes:
        return as_png(self)


def panels(
    width: float, height: float, rows: int = 1, columns: int = 1, **how: Any
) -> tuple[Figure, list[Axes]]:
    """A new figure of this size [inches], and its axes, row by row."""
    figure = Figure(figsize=(width, height), layout="constrained")
    return figure, figure.subplots(rows, columns, squeeze=False, **how).ravel().tolist()


class ShownAxes(Axes):
    """Axes whose figure notebooks display, without pyplot."""

    def _repr_png_(self) -> bytes:
        figure = self.get_figure(root=True)
        assert figure is not None
        return as_png(figure)


def new_axes(size: tuple[float, float]) -> Axes:
    """The axes of a new figure of this size [inches]; `pyplot.show` shows it if pyplot is used."""
    if pyplot := sys.modules.get("matplotlib.pyplot"):
        axes: Axes = pyplot.figure(figsize=size, layout="constrained").subplots()
        return axes
    return Figure(figsize=size, layout="constrained").add_subplot(axes_class=ShownAxes)


class Figures(dict[str, MatplotlibFigure]):
    """Figures by stems of file names; notebooks display all of them."""

    def _repr_html_(self) -> str:
        return "<br>".join(image_tag(stem, figure) for stem, figure in self.items())


def as_png(figure: MatplotlibFigure, dpi: int = 100) -> bytes:
    figure.savefig(file := BytesIO(), format="png", dpi=dpi)
    return file.getvalue()


def image_tag(name: str, figure: MatplotlibFigure, dpi: int = 100) -> str:
    """The figure as an image inside HTML."""
    picture = b64encode(as_png(figure, dpi)).decode()
    return f'<img alt="{name}" src="data:image/png;base64,{picture}">'


def save(figure: MatplotlibFigure, path: Path, form: str = "png", dpi: int = 200) -> None:
    """Write a figure as PNG, SVG or PDF, with text kept as text; `dpi` is its resolution.

    Raises InputError for another format, or a `dpi` that is not from 50 to 600.

    >>> cr.plots.save(contact.plot().figure, folder / "pressure.png", dpi=100)
    """
    if form not in FORMATS:
        raise InputError("form", found=repr(form), expected=f"one of {', '.join(FORMATS)}")
    if not LEAST_DPI <= dpi <= MOST_DPI:
        raise InputError("dpi", found=dpi, expected=f"from {LEAST_DPI} to {MOST_DPI}")
    canvas: Any = get_registered_canvas_class(form)(figure)
    before, figure.dpi = figure.dpi, dpi
    try:
        with rc_context(REAL_TEXT):  # `savefig` draws everything twice
            getattr(canvas, f"print_{form}")(path, **FORMATS[form])
    finally:
        figure.dpi = before
