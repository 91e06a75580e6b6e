"""The main picture of a result, drawn into given axes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from convexrough.compare import Comparison
from convexrough.contact import Contact
from convexrough.errors import InputError
from convexrough.friction.curve import MemoryCurve
from convexrough.friction.cycle import Cycle
from convexrough.friction.fretting import Fretting
from convexrough.friction.path import LoadPath
from convexrough.friction.phases import PhaseLosses
from convexrough.friction.shear import ShearState
from convexrough.friction.side_by_side import PathComparison, PathEntry
from convexrough.gradients.gradient import Gradient
from convexrough.melan.shakedown import Shakedown
from convexrough.plots.asperity_map import (
    draw_contact,
    status_handles,
    status_layers,
)
from convexrough.plots.between import between
from convexrough.plots.cycle import draw_loop, smooth_loop
from convexrough.plots.fretting import draw_slip
from convexrough.plots.gradient import draw_gradient
from convexrough.plots.load_plane import draw_closed, draw_curve, draw_losses, draw_path
from convexrough.plots.measure import Scale
from convexrough.plots.notebook import Figure, image_tag, new_axes
from convexrough.plots.path import draw_loop as draw_path_loop
from convexrough.plots.press import draw_pressure
from convexrough.plots.shakedown import draw_factors
from convexrough.plots.shear import State, draw_state, legend_handles, state_title
from convexrough.plots.style import (
    ROUGH,
    SINGLE,
    TICK,
    UNSURE,
    few_ticks,
    label,
    legend_below,
    say_nothing,
)
from convexrough.plots.verdict import draw_claim
from convexrough.vector_shear.state import VectorShearState
from convexrough.verdict import Verdict


def plot(result: object, axes: Axes | None = None) -> Axes:
    """Draw the main picture of a result; return the axes.

    result : a Contact: map of pressure; ShearState, VectorShearState: map of stick and slip;
        Cycle: loop, or the plane of loads if the normal load varies; Fretting: map of slip
        amplitudes; LoadPath: shear force against displacement, or the plane of loads if the load
        varies; MemoryCurve: the plane of loads; Gradient: map of derivatives; Verdict: map of
        wrongly claimed asperities; Comparison, PathComparison: times of the solvers or methods;
        PhaseLosses: loss against phase; Shakedown: map of factors; Surface, Summits: map;
        Provability: contacts against pruning
    axes   : matplotlib axes; default: those of a new figure, which notebooks and `pyplot.show` show

    Raises InputError for anything else.
    """
    kinds = PICTURES
    if type(result).__module__.startswith("convexrough.surface."):
        from convexrough.plots import surface  # parts of SciPy: only for measured surfaces

        kinds = surface.PICTURES
    draw = next((draw for kind, draw in kinds.items() if isinstance(result, kind)), None)
    if draw is None:
        expected = "a result that has a picture: a Contact, a state, a Cycle, LoadPath, ..."
        raise InputError("result", found=f"type {type(result).__name__}", expected=expected)
    if axes is None:
        axes = new_axes((SINGLE, 3.2))
    contact = getattr(result, "contact", result)
    if isinstance(contact, Contact) and not contact.loads.any():
        say_nothing(axes)
    else:
        draw(result, axes)
    return axes


def thumbnail(result: object) -> str:
    """A small picture of a result as an HTML image; for a cycle or path it is a map of statuses."""
    figure = Figure(figsize=(SINGLE, 3.0), layout="constrained")
    axes = figure.subplots()
    if isinstance(result, (Cycle, LoadPath)) and result.contact.loads.any() and len(result.forces):
        status = result.status if isinstance(result, Cycle) else result.status[-1]
        scale, radii = Scale(result.contact), result.contact.contact_radii
        draw_contact(axes, scale, status_layers(status, radii))
        legend_below(axes, handles=status_handles(np.unique(status)))
    else:
        plot(result, axes)
    return image_tag(type(result).__name__, figure, 80)


def _draw_state(state: State, axes: Axes) -> None:
    scale = Scale(state.contact)
    draw_state(axes, state, scale)
    axes.set_title(state_title(state, scale, narrow=False), fontsize=TICK)
    legend_below(axes, handles=legend_handles([state], scale))


def _draw_cycle(cycle: Cycle, axes: Axes) -> None:
    if np.ptp(cycle.loads) > 0:
        return draw_closed(axes, cycle)
    scale = Scale(cycle.contact)
    loop = cycle.loop(asperities=[])
    draw_loop(axes, scale, loop.displacements, loop.forces)
    if scale.sphere is not None:
        draw_loop(axes, scale, smooth_loop(scale.sphere, loop.forces), loop.forces, smooth=True)
    axes.legend(fontsize=TICK, frameon=False, loc="upper left")
    return label(axes, scale.displacement.label("X"), scale.force.label("Q"))


def _draw_path(path: LoadPath, axes: Axes) -> None:
    if path.load_constant:
        draw_path_loop(axes, path, Scale(path.contact), between(path))
    else:
        draw_path(axes, path)


def _draw_times(comparison: Comparison | PathComparison, axes: Axes) -> None:
    rows = [_took(entry) for entry in comparison.entries]
    for place, (_, seconds, outcome) in enumerate(rows):
        if seconds is None:
            axes.text(0.02, place, outcome, transform=axes.get_yaxis_transform(),
                      va="center", fontsize=TICK, color=UNSURE)  # fmt: skip
        else:
            axes.plot(seconds, place, "o", color=ROUGH)
    axes.set(xscale="log", ylim=(len(rows) - 0.5, -0.5))
    axes.set_yticks(range(len(rows)), [name for name, *_ in rows], fontsize=TICK)
    few_ticks(axes.xaxis)
    label(axes, "time [s]", "")


def _took(entry: Any) -> tuple[str, float | None, str]:
    if isinstance(entry, PathEntry):
        return entry.way, entry.seconds if entry.path else None, entry.outcome
    return entry.solver, entry.contact.seconds if entry.contact else None, entry.outcome


#: The function that draws each kind of result.
PICTURES: dict[type, Callable[..., Any]] = {
    Contact: lambda it, axes: draw_pressure(axes, Scale(it)),
    ShearState: _draw_state,
    VectorShearState: _draw_state,
    Cycle: _draw_cycle,
    Fretting: lambda it, axes: draw_slip(axes, it, Scale(it.contact)),
    LoadPath: _draw_path,
    MemoryCurve: lambda it, axes: draw_curve(axes, it),
    PhaseLosses: lambda it, axes: draw_losses(axes, it),
    Shakedown: lambda it, axes: draw_factors(axes, it),
    Gradient: lambda it, axes: draw_gradient(axes, it, Scale(it.contact)),
    Verdict: lambda it, axes: draw_claim(axes, it, it.scene),
    Comparison: _draw_times,
    PathComparison: _draw_times,
}
