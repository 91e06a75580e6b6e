"""Maps of friction states: asperities that slide, and those that slip in part."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D

from convexrough import checks
from convexrough.friction.shear import ShearState
from convexrough.plots import asperity_map as maps
from convexrough.plots import style
from convexrough.plots.notebook import Figures, no_contact, one_contact
from convexrough.plots.style import DASHED, DOTTED, FAINT, Scale, ink
from convexrough.scene.rings import evenly_chosen
from convexrough.vector_shear.state import VectorShearState

State: TypeAlias = ShearState | VectorShearState

MOST_PANELS = 12


def shear_figures(states: Sequence[ShearState]) -> Figures:
    """The maps of friction states of one contact, at most 12, evenly chosen.

    Raises InputError for states of several contacts.

    "stick_slip" : contact discs with stick discs inside, sliding asperities, open ones; and
        contact and stick disc of the smooth sphere under the same forces

    >>> states = [cr.shear(contact, force=part * contact.load) for part in (0.1, 0.25)]
    >>> print(*cr.plots.shear_figures(states))
    stick_slip
    """
    checks.sequence("states", states, "a list of states")
    states = list(states)
    if not states:
        return Figures()
    contact = one_contact("states", states, ShearState, VectorShearState)
    if not contact.loads.any():
        return no_contact("stick_slip")
    scale, shown = Scale(contact), evenly_chosen(states, MOST_PANELS)
    narrow = len(shown) > 3
    lines = 1 + narrow + any(style.not_proved(state) for state in shown)
    figure, places = maps.tiles(len(shown), lines)
    for axes, state in zip(places, shown, strict=True):
        draw_state(axes, state, scale, "\n" if narrow else " ")
    x = f"{scale.length.label('x')}    ($fP$ = {style.quantity(scale.limit, scale.units.force)})"
    maps.label_tiles(figure, places, x, scale.length.short("y"))
    how = {"loc": "outside upper center", "ncols": min(2 * len(shown), 4)}
    style.legend(figure, "outside", handles=legend_handles(shown, scale), **how)
    return Figures({"stick_slip": figure})


def draw_one_state(axes: Axes, state: State) -> None:
    """Draw the map of a state with a legend."""
    scale = Scale(state.contact)
    draw_state(axes, state, scale)
    style.legend(axes, "below", handles=legend_handles([state], scale))


def draw_state(axes: Axes, state: State, scale: Scale, space: str = " ") -> None:
    """Draw discs, dots and outlines of the smooth contact; `space` is a blank of the title."""
    look: Any = {"stick": state.stick_radii, "outline": scale.axes}
    radii = state.contact.contact_radii
    maps.draw_statuses(axes, scale.points, scale.length, state.status, radii, **look)
    force = state.force if isinstance(state, ShearState) else np.hypot(*state.force)
    left = max(1.0 - abs(float(force)) / scale.limit, 0.0)
    if 0 < left < 1:
        stick = [scale.length.of(np.cbrt(left) * each) for each in scale.axes]
        maps.draw_outline(axes, stick, DOTTED)
    unsure = scale.points[style.doubtful(state)]
    if len(unsure):
        size = float(np.clip(60.0 / np.sqrt(len(unsure)), 1.0, 4.0))
        axes.plot(*scale.length.of(unsure).T, "x", ms=size, mew=0.8, color=ink(),
                  path_effects=style.halo(), label="_undecided")  # fmt: skip
    touching = state.contact.loads > 0
    share = f"{force / scale.limit:.4g}".replace("-", "\u2212")
    slide = f"{np.count_nonzero(touching & (state.status == 'sliding')):,}"
    doubt = style.not_proved(state).replace(" ", "\n", 1)
    said = f"$Q/(fP)$ = {share}:{space}{slide} of {np.count_nonzero(touching):,} slide{doubt}"
    style.title(axes, said, "center")


def legend_handles(states: Sequence[State], scale: Scale) -> list[Artist]:
    """Legend entries for the colours and marks that occur."""
    loads = states[0].contact.loads
    occur = np.concatenate([state.status[loads > 0] for state in states])
    marks: list[Any] = maps.status_handles(occur[occur != "undecided"])
    if "partial" in occur:
        marks.insert(0, style.disc_handle(maps.STICK, "stick disc"))
    if any(style.doubtful(state).any() for state in states):
        marks.append(Line2D([], [], ls="", marker="x", ms=4, color=ink(), label="undecided"))
    if (loads == 0).any() and np.count_nonzero(loads) < maps.CROWDED:
        marks.append(Line2D([], [], ls="", marker="o", ms=2, mew=0, color=FAINT, label="open"))
    outlines = {"contact": DASHED}
    if any(np.any(state.force != 0) for state in states):
        outlines["stick"] = DOTTED
    for what, dashes in outlines.items() if scale.sphere else ():
        said = f"{scale.name}: {what}"
        marks.append(Line2D([], [], ls=dashes, lw=0.9, color=ink(), label=said))
    return marks
