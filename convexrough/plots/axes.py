"""The main picture of a result in axes of one's own, among other things."""

from __future__ import annotations

from collections.abc import Sequence
from functools import singledispatch
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from convexrough.arrays import Array
from convexrough.compare import Comparison
from convexrough.contact import Contact
from convexrough.errors import InputError
from convexrough.friction.curve import MemoryCurve
from convexrough.friction.cycle import Cycle
from convexrough.friction.path import History, LoadPath
from convexrough.friction.phases import PhaseLosses
from convexrough.friction.shear import ShearState
from convexrough.friction.side_by_side import PathComparison
from convexrough.gradients.gradient import Gradient
from convexrough.melan.shakedown import Shakedown
from convexrough.plots.closed_path import draw_losses
from convexrough.plots.cycle import few_ticks, smooth_loop
from convexrough.plots.gradient import draw_gradient
from convexrough.plots.history import between_steps
from convexrough.plots.load_plane import draw_closed, draw_curve, draw_path
from convexrough.plots.notebook import Figure
from convexrough.plots.press import draw_pressure, draw_pressure_bar
from convexrough.plots.shakedown import draw_factors
from convexrough.plots.shear import State, draw_state, legend_handles, state_title
from convexrough.plots.style import (
    DASHED,
    ROUGH,
    SINGLE,
    SMOOTH,
    TICK,
    UNSURE,
    Scale,
    ShearScale,
    label,
    literal,
    say_no_contact,
)
from convexrough.plots.surface import draw_provability, draw_summits, draw_surface
from convexrough.plots.verdict import draw_claim
from convexrough.surface.provability import Provability
from convexrough.surface.summits import Summits
from convexrough.surface.surface import Surface
from convexrough.vector_shear.state import VectorShearState
from convexrough.verdict import Verdict


def plot(
    result: object, axes: Axes | None = None, *, length_unit: str = "", force_unit: str = ""
) -> Axes:
    """Draw the main picture of a result, and return the axes it is in.

    result : a Contact: map of its pressure; ShearState, VectorShearState: map of stick and slip;
        Cycle: its loop, or the plane of loads where P varies; History: its path, Q against X;
        Gradient: map of who matters; Verdict: map of who is not as claimed; Comparison: what each
        solver took; LoadPath, MemoryCurve: the plane of loads; PhaseLosses: loss against phase;
        Shakedown: map of the factors; PathComparison: what each way took; Surface, Summits: map;
        Provability: contacts by pruning
    axes   : of matplotlib, to draw into; default: those of a new figure, which a notebook shows
    length_unit, force_unit : only said, never converted

    Raises InputError for anything else.
    """
    if _draw.dispatch(type(result)) is _draw.dispatch(object):
        expected = "a result that has a picture: a Contact, a state, a Cycle, History, ..."
        raise InputError("result", found=f"type {type(result).__name__}", expected=expected)
    if axes is None:
        axes = Figure(figsize=(SINGLE, 3.2), layout="constrained").subplots()
    _draw(result, axes, length_unit, force_unit)
    return axes


@singledispatch
def _draw(result: Any, axes: Axes, length_unit: str, force_unit: str) -> None:
    """What `plot` does for each kind of result."""


@_draw.register
def _(contact: Contact, axes: Axes, length_unit: str, force_unit: str) -> None:
    if not contact.loads.any():
        return say_no_contact(axes)
    scale = Scale.of(contact, length_unit, force_unit)
    colours, _ = draw_pressure(axes, contact, scale)
    label(axes, scale.length_label("x"), scale.short("y"))
    return draw_pressure_bar(axes, contact, colours, scale)


@_draw.register(ShearState)
@_draw.register(VectorShearState)
def _(state: State, axes: Axes, length_unit: str, force_unit: str) -> None:
    if not state.contact.loads.any():
        return say_no_contact(axes)
    scale = Scale.of(state.contact, length_unit, force_unit)
    friction = ShearScale.of(state.contact, length_unit, force_unit)
    draw_state(axes, state, scale)
    axes.set_title(state_title(state, friction, narrow=False), fontsize=TICK)
    label(axes, scale.length_label("x"), scale.short("y"))
    handles = legend_handles(state.contact, [state], scale)
    axes.legend(handles=handles, fontsize=TICK - 2, ncols=2, frameon=False,
                loc="upper center", bbox_to_anchor=(0.5, -0.2))  # fmt: skip
    return None


@_draw.register
def _(cycle: Cycle, axes: Axes, length_unit: str, force_unit: str) -> None:
    if not cycle.contact.loads.any():
        return say_no_contact(axes)
    if np.ptp(cycle.loads) > 0:
        return draw_closed(axes, cycle, force_unit)
    scale = ShearScale.of(cycle.contact, length_unit, force_unit)
    loop = cycle.loop(asperities=[])
    _against(axes, scale, loop.displacements, loop.forces, color=ROUGH, label="asperities")
    if scale.sphere is not None:
        look = {"color": SMOOTH, "ls": DASHED, "label": scale.name}
        _against(axes, scale, smooth_loop(scale.sphere, loop.forces), loop.forces, **look)
    axes.legend(fontsize=TICK, frameon=False, loc="upper left")
    return None


@_draw.register
def _(past: History, axes: Axes, length_unit: str, force_unit: str) -> None:
    if not past.contact.loads.any():
        return say_no_contact(axes)
    scale = ShearScale.of(past.contact, length_unit, force_unit)
    x, q, _ = between_steps(past)[1:]
    return _against(axes, scale, x, q, color=ROUGH)


@_draw.register
def _(gradient: Gradient, axes: Axes, length_unit: str, force_unit: str) -> None:
    draw_gradient(axes, gradient, Scale.of(gradient.contact, length_unit, force_unit))


@_draw.register
def _(verdict: Verdict, axes: Axes, length_unit: str, force_unit: str) -> None:
    draw_claim(axes, verdict, verdict.scene.asperities.positions, length_unit)


@_draw.register
def _(comparison: Comparison, axes: Axes, length_unit: str, force_unit: str) -> None:
    """Solvers from above in the order of their entries; those without an answer say so."""
    for place, entry in enumerate(comparison.entries):
        if entry.contact is None:
            axes.text(0.02, place, entry.outcome, transform=axes.get_yaxis_transform(),
                      va="center", fontsize=TICK, color=UNSURE)  # fmt: skip
        else:
            axes.plot(entry.contact.seconds, place, "o", color=ROUGH)
    _name_rows(axes, [entry.solver for entry in comparison.entries])


def _name_rows(axes: Axes, names: Sequence[str]) -> None:
    axes.set(xscale="log", ylim=(len(names) - 0.5, -0.5))
    axes.set_yticks(range(len(names)), names, fontsize=TICK)
    few_ticks(axes.xaxis)
    label(axes, "time [s]", "")


@_draw.register
def _(path: LoadPath, axes: Axes, length_unit: str, force_unit: str) -> None:
    draw_path(axes, path, force_unit)


@_draw.register
def _(curve: MemoryCurve, axes: Axes, length_unit: str, force_unit: str) -> None:
    draw_curve(axes, curve, force_unit)


@_draw.register
def _(losses: PhaseLosses, axes: Axes, length_unit: str, force_unit: str) -> None:
    draw_losses(axes, losses, length_unit, force_unit)


@_draw.register
def _(comparison: PathComparison, axes: Axes, length_unit: str, force_unit: str) -> None:
    """What each way took, from above; those without an answer say so."""
    for place, entry in enumerate(comparison.entries):
        if entry.path is None:
            axes.text(0.02, place, entry.outcome, transform=axes.get_yaxis_transform(),
                      va="center", fontsize=TICK, color=UNSURE)  # fmt: skip
        else:
            axes.plot(entry.seconds, place, "o", color=ROUGH)
    _name_rows(axes, [entry.way for entry in comparison.entries])


@_draw.register
def _(limit: Shakedown, axes: Axes, length_unit: str, force_unit: str) -> None:
    draw_factors(axes, limit, length_unit)


@_draw.register
def _(surface: Surface, axes: Axes, length_unit: str, force_unit: str) -> None:
    draw_surface(axes, surface)


@_draw.register
def _(summits: Summits, axes: Axes, length_unit: str, force_unit: str) -> None:
    draw_summits(axes, summits.positions)
    unit = f"  [{literal(summits.origin.unit)}]" if summits.origin.unit else ""
    label(axes, f"$x${unit}", f"$y${unit}")
    axes.set_aspect("equal")


@_draw.register
def _(curve: Provability, axes: Axes, length_unit: str, force_unit: str) -> None:
    draw_provability(axes, curve)


def _against(axes: Axes, scale: ShearScale, x: Array, q: Array, **look: Any) -> None:
    """Q against X, as parts of f P and X0."""
    axes.plot(x / scale.displacement, q / scale.force, lw=1.2, **look)
    label(axes, scale.displacement_label(), f"$Q\\,/\\,(fP)$  ({scale.limit()})")
