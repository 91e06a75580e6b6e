"""Figures and axes that notebooks display; `plot`, `thumbnail` and `save`."""

from __future__ import annotations

import sys
from base64 import b64encode
from collections.abc import Callable, Sequence
from functools import partial
from importlib import import_module
from io import BytesIO
from pathlib import Path
from typing import Any

from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.backend_bases import get_registered_canvas_class
from matplotlib.figure import Figure as MatplotlibFigure
from matplotlib.image import imsave

from convexrough import checks
from convexrough.contact import Contact
from convexrough.errors import InputError
from convexrough.friction.cycle import Cycle
from convexrough.friction.path import LoadPath
from convexrough.plots.style import SINGLE, Scale, few_ticks, legend, say_nothing

#: The module and the function that draw a result into axes, by the name of the result's class. A
#: module is imported only when its function is needed.
PICTURES = {
    "Contact": "press.draw_pressure",
    "ShearState": "shear.draw_one_state",
    "VectorShearState": "shear.draw_one_state",
    "Cycle": "cycle.draw_cycle",
    "Fretting": "cycle.draw_slip",
    "LoadPath": "path.draw_loop_or_plane",
    "MemoryCurve": "steady.draw_curve",
    "PhaseLosses": "steady.draw_losses",
    "Shakedown": "shakedown.draw_factors",
    "Gradient": "gradient.draw_gradient",
    "Verdict": "verdict.draw_claim",
    "Comparison": "verdict.draw_times",
    "Surface": "surface.draw_surface",
    "Summits": "surface.draw_summit_map",
    "Provability": "surface.draw_provability",
}

#: Formats of files, with options for matplotlib: no dates, so that files can be compared.
FORMATS: dict[str, dict[str, Any]] = {
    "png": {},
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


class ShownAxes(Axes):
    """Axes whose figure notebooks display, without pyplot."""

    def _repr_png_(self) -> bytes:
        figure: Any = self.get_figure()
        return as_png(figure)


class Figures(dict[str, MatplotlibFigure]):
    """Figures by stems of file names; notebooks display all of them."""

    def _repr_html_(self) -> str:
        return "<br>".join(image_tag(stem, figure) for stem, figure in self.items())


def panels(
    width: float, height: float, rows: int = 1, columns: int = 1, **how: Any
) -> tuple[Figure, list[Axes]]:
    """A new figure of this size [inches], and its axes, row by row."""
    figure = Figure(figsize=(width, height), layout="constrained")
    places = figure.subplots(rows, columns, squeeze=False, **how).ravel().tolist()
    for axes in places:
        few_ticks(axes)
    return figure, places


def new_axes(size: tuple[float, float]) -> Axes:
    """The axes of a new figure of this size [inches]; `pyplot.show` shows it if pyplot is used."""
    axes: Axes
    if pyplot := sys.modules.get("matplotlib.pyplot"):
        axes = pyplot.figure(figsize=size, layout="constrained").subplots()
    else:
        axes = Figure(figsize=size, layout="constrained").add_subplot(axes_class=ShownAxes)
    few_ticks(axes)
    return axes


def no_contact(*stems: str) -> Figures:
    """Figures under these names, each with the text that nothing touches."""
    figures = Figures()
    for stem in stems:
        figures[stem], (axes,) = panels(SINGLE, 2.6)
        say_nothing(axes)
    return figures


def one_contact(what: str, results: Sequence[Any], *kinds: Any) -> Contact:
    """The contact of all results; raises InputError for another one, or a result of other kinds."""
    for k, each in enumerate(results):
        if not isinstance(each, kinds):
            expected = " or ".join(f"a {kind.__name__}" for kind in kinds)
            raise InputError(f"{what}[{k}]", found=f"type {type(each).__name__}", expected=expected)
        if each.contact is not results[0].contact:
            expected = f"one of the same contact as {what}[0]"
            raise InputError(f"{what}[{k}]", found="a result of another contact", expected=expected)
    contact: Contact = results[0].contact
    return contact


def as_png(figure: MatplotlibFigure) -> bytes:
    figure.savefig(file := BytesIO(), format="png", dpi=100)
    return file.getvalue()


def image_tag(name: str, figure: MatplotlibFigure) -> str:
    """The figure as an image inside HTML."""
    return f'<img alt="{name}" src="data:image/png;base64,{b64encode(as_png(figure)).decode()}">'


def plot(result: object, axes: Axes | None = None) -> Axes:
    """Draw the main picture of a result; return the axes.

    result : an object of a class in `PICTURES`; docs/how-to/results.md, "Plots", lists the pictures
    axes   : matplotlib axes; default: those of a new figure, which notebooks and `pyplot.show` show

    Raises InputError for anything else.

    >>> axes = cr.plots.plot(cr.shear(contact, force=0.25 * contact.load))
    >>> print(axes.get_title())
    $Q/(fP)$ = 0.5: 6 of 37 slide
    """
    kinds = [kind for kind in type(result).__mro__ if kind.__module__.startswith("convexrough.")]
    where = next((PICTURES[it.__name__] for it in kinds if it.__name__ in PICTURES), None)
    if where is None:
        expected = "a result that has a picture: a Contact, a state, a Cycle, LoadPath, ..."
        raise InputError("result", found=f"type {type(result).__name__}", expected=expected)
    if axes is None:
        axes = new_axes((SINGLE, 3.2))
    checks.instance("axes", axes, Axes)
    contact = getattr(result, "contact", result)
    if isinstance(contact, Contact) and not contact.loads.any():
        say_nothing(axes)
    else:
        module, function = where.split(".")
        getattr(import_module(f"convexrough.plots.{module}"), function)(axes, result)
    return axes


def thumbnail(result: object) -> str:
    """A small picture of a result, as an HTML image; of a cycle or path, the map of statuses.

    >>> print(cr.plots.thumbnail(contact)[:36])
    <img alt="Contact" src="data:image/p
    """
    figure, (axes,) = panels(SINGLE, 3.0)
    if isinstance(result, (Cycle, LoadPath)) and result.contact.loads.any() and len(result.forces):
        status = result.status if isinstance(result, Cycle) else result.status[-1]
        maps, scale = import_module("convexrough.plots.asperity_map"), Scale(result.contact)
        radii = result.contact.contact_radii
        maps.draw_statuses(axes, scale.points, scale.length, status, radii, outline=scale.axes)
        legend(axes, "below", handles=maps.status_handles(status))
    else:
        plot(result, axes)
    return image_tag(type(result).__name__, figure)


def save(
    figure: MatplotlibFigure, path: str | Path, form: str | None = None, dpi: float = 200
) -> None:
    """Write a figure as PNG, SVG or PDF, with text kept as text; `dpi` is its resolution.

    form : "png", "svg" or "pdf"; default: as the suffix of the path says, or PNG without a suffix

    Raises InputError for another format, a suffix that names another than `form`, or a `dpi` that
    is not from 50 to 600.

    >>> cr.plots.save(contact.plot().figure, folder / "pressure.png", dpi=100)
    """
    checks.instance("figure", figure, MatplotlibFigure)
    suffix = checks.path("path", path, "the path of a file").suffix[1:].lower()
    what, form = ("path", suffix or "png") if form is None else ("form", form)
    if form not in FORMATS or (suffix in FORMATS and suffix != form):
        expected = f"one of {', '.join(FORMATS)}, that of the path if it has a suffix"
        raise InputError(what, found=repr(form), expected=expected)
    content = drawn(figure, form, checks.between("dpi", dpi, LEAST_DPI, MOST_DPI))()
    Path(path).write_bytes(content)


def drawn(figure: MatplotlibFigure, form: str, dpi: float) -> Callable[[], bytes]:
    """Draw a figure. The result, which another thread may call, returns the content of a file."""
    canvas: Any = get_registered_canvas_class(form)(figure)
    before, figure.dpi = figure.dpi, dpi
    try:
        with rc_context(REAL_TEXT):  # `savefig` draws everything twice
            if form == "png":
                canvas.draw()
                return partial(_png, canvas.buffer_rgba(), dpi)
            getattr(canvas, f"print_{form}")(file := BytesIO(), **FORMATS[form])
            return file.getvalue
    finally:
        figure.dpi = before


def _png(pixels: Any, dpi: float) -> bytes:
    """The content of a file, compressed in two thirds of the usual time, and 5 % larger."""
    options: Any = {"compress_level": 3}
    imsave(file := BytesIO(), pixels, format="png", origin="upper", dpi=dpi, pil_kwargs=options)
    return file.getvalue()
