"""The main picture of a result, drawn into given axes."""

from __future__ import annotations

from importlib import import_module

import numpy as np
from matplotlib.axes import Axes

from convexrough import checks
from convexrough.contact import Contact
from convexrough.errors import InputError
from convexrough.friction.cycle import Cycle
from convexrough.friction.path import LoadPath
from convexrough.plots.asperity_map import draw_contact, status_handles, status_layers
from convexrough.plots.measure import Scale
from convexrough.plots.notebook import image_tag, new_axes, panels
from convexrough.plots.style import SINGLE, legend_below, say_nothing

#: The module and the function that draw a result into axes, by the name of the result's class. A
#: module is imported only when its function is needed.
PICTURES = {
    "Contact": "press.draw_pressure",
    "ShearState": "shear.draw_one_state",
    "VectorShearState": "shear.draw_one_state",
    "Cycle": "cycle.draw_cycle",
    "Fretting": "values.draw_slip",
    "LoadPath": "path.draw_loop_or_plane",
    "MemoryCurve": "load_plane.draw_curve",
    "PhaseLosses": "load_plane.draw_losses",
    "Shakedown": "shakedown.draw_factors",
    "Gradient": "values.draw_gradient",
    "Verdict": "verdict.draw_claim",
    "Comparison": "times.draw_times",
    "PathComparison": "times.draw_times",
    "Surface": "surface.draw_surface",
    "Summits": "surface.draw_summit_map",
    "Provability": "surface.draw_provability",
}


def plot(result: object, axes: Axes | None = None) -> Axes:
    """Draw the main picture of a result; return the axes.

    result : a Contact: map of pressure; ShearState, VectorShearState: map of stick and slip;
        Cycle: loop, or the plane of loads if the normal load varies; Fretting: map of slip
        amplitudes; LoadPath: shear force against displacement, or the plane of loads if the load
        varies; MemoryCurve: the plane of loads; Gradient: map of derivatives; Verdict: map of
        proved statuses with marks on wrong claims; Comparison, PathComparison: times of the solvers
        or methods; PhaseLosses: loss against phase; Shakedown: map of factors, or of slips for the
        kind "vector"; Surface, Summits: map; Provability: contacts against pruning
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
        scale, radii = Scale(result.contact), result.contact.contact_radii
        draw_contact(axes, scale, status_layers(status, radii))
        legend_below(axes, handles=status_handles(np.unique(status)))
    else:
        plot(result, axes)
    return image_tag(type(result).__name__, figure, 80)
