"""Who slides, and who sticks in part: the map of a friction state."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, TypeAlias

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import to_rgba
from matplotlib.lines import Line2D

from convexrough import checks
from convexrough.arrays import Array
from convexrough.contact import Contact
from convexrough.friction.shear import ShearState
from convexrough.plots.notebook import Figure, Figures
from convexrough.plots.style import (
    CROWDED,
    DASHED,
    DENSE,
    DOUBLE,
    FAINT,
    LABEL,
    SINGLE,
    SMOOTH,
    TICK,
    Scale,
    ShearScale,
    doubt,
    draw_discs,
    draw_mosaic,
    draw_open,
    draw_smooth,
    frame_map,
    literal,
    map_edge,
    no_contact_figure,
    quantity,
    round_ticks,
    smooth_name,
)
from convexrough.scene.rings import evenly_chosen
from convexrough.vector_shear.state import VectorShearState

State: TypeAlias = ShearState | VectorShearState

#: The more slip, the darker, also in grey.
STICK, SLIP, SLIDING = "#b9d0e5", "#e0842a", "#701c05"
UNKNOWN = "white"
DOTTED = (0, (1, 1.5))
MOST_PANELS = 12


def shear_figures(
    states: Sequence[ShearState], *, length_unit: str = "", force_unit: str = ""
) -> Figures:
    """The map of each friction state of one contact, at most 12 of them, evenly chosen.

    "stick_slip" : contact discs with their stick discs inside, sliding asperities, open ones; and
        the smooth sphere's contact and stick discs under the same forces
    """
    if not states:
        return Figures()
    if not states[0].contact.loads.any():
        unit = f"  [{literal(length_unit)}]" if length_unit else ""
        labels = (f"$x${unit}", f"$y${unit}")
        return Figures({"stick_slip": no_contact_figure(labels, width=SINGLE)})
    contact = states[0].contact
    scale = Scale.of(contact, length_unit, force_unit)
    friction = ShearScale.of(contact, length_unit, force_unit)
    shown = evenly_chosen(states, MOST_PANELS)
    columns = len(shown) if len(shown) <= 4 else 3 if len(shown) in (5, 6, 9) else 4
    rows = -(-len(shown) // columns)
    width = SINGLE if columns == 1 else DOUBLE
    doubted = any(doubt(state.certificate.scope, state.status) for state in shown)
    title = 0.17 * (1 + (columns == 4) + doubted)
    height = rows * ((width - 0.5) / columns + title) + (0.95 if columns == 1 else 0.75)
    figure = Figure(figsize=(width, height), layout="constrained")
    panels = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False).ravel()
    for axes, state in zip(panels, shown, strict=False):
        draw_state(axes, state, scale)
        axes.set_title(state_title(state, friction, narrow=columns == 4), fontsize=TICK)
        if columns == 4:
            axes.xaxis.set_major_locator(round_ticks(4))
    for axes in panels[len(shown) :]:
        axes.remove()
    for axes in panels[len(shown) - columns : len(shown)]:
        axes.tick_params(labelbottom=True)
    words = f"{scale.length_label('x')[:-1]},  $fP$ = {quantity(friction.force, force_unit)})"
    figure.supxlabel(words, fontsize=LABEL)
    figure.supylabel(scale.short("y"), fontsize=LABEL)
    figure.legend(
        handles=legend_handles(contact, shown, scale),
        loc="outside upper center",
        ncols=2 if columns == 1 else 4,
        fontsize=TICK,
        frameon=False,
        handletextpad=0.5,
        columnspacing=1.4,
    )
    return Figures({"stick_slip": figure})


def draw_state(axes: Axes, state: State, scale: Scale) -> None:
    """Contact discs, stick discs, open dots; and those of the smooth sphere, for comparison."""
    contact = state.contact
    limit = checks.friction(contact.scene.friction) * contact.load
    share = float(np.linalg.norm(state.force)) / limit
    stick = float(np.cbrt(max(1.0 - share, 0.0)))  # over the contact
    points = contact.scene.contact_points / scale.length
    touching = contact.loads > 0
    edge = map_edge(contact, scale)
    draw_smooth(axes, scale)
    if 0 < stick < 1:
        draw_smooth(axes, scale, stick, DOTTED)
    if int(touching.sum()) >= CROWDED:
        draw_mosaic(axes, points, _mean_shades(state), touching, edge, 320)
    else:
        draw_open(axes, points[~touching & (np.abs(points).max(axis=1) < edge)])
        _draw_words(axes, state, points, scale)
    doubtful = _doubtful(state)
    if doubtful.any():
        size = float(np.clip(60.0 / np.sqrt(doubtful.sum()), 1.0, 4.0))
        axes.plot(*points[doubtful].T, "x", ms=size, mew=0.8, color=SMOOTH, label="_undecided")
    frame_map(axes, edge)


def _mean_shades(state: State) -> Array:
    """(n, 4) the mean colour of each contact disc: its stick disc's and its annulus' by area."""
    radii = state.contact.contact_radii
    inside = np.divide(state.stick_radii, radii, out=np.zeros(len(radii)), where=radii > 0)
    part = inside[:, None] ** 2
    shades = part * to_rgba(STICK) + (1.0 - part) * to_rgba(SLIP)
    shades[state.status == "sliding"] = to_rgba(SLIDING)
    shades[state.status == "undecided"] = to_rgba(UNKNOWN)
    return np.asarray(shades)


def _draw_words(axes: Axes, state: State, points: Array, scale: Scale) -> None:
    """Every contact disc in true size, its stick disc inside."""
    touching, radii = state.contact.loads > 0, state.contact.contact_radii
    many = int(touching.sum()) >= DENSE
    rim: dict[str, Any] = {"edgecolors": SMOOTH, "linewidths": 0.0 if many else 0.4}
    sure = touching & (state.status != "undecided")
    sliding, partial = sure & (state.status == "sliding"), sure & (state.status == "partial")
    for word, chosen, across, colour in (
        ("slip", partial, radii, SLIP),
        ("stick", partial, state.stick_radii, STICK),
        ("sliding", sliding, radii, SLIDING),
        ("undecided", touching & ~sure, radii, UNKNOWN),
    ):
        if chosen.any():
            look = rim | {
                "facecolors": colour,
                "linewidths": 0.4 * (word == "undecided" or not many),
            }
            draw_discs(axes, points[chosen], across[chosen] / scale.length, word, **look)


def legend_handles(contact: Contact, states: Sequence[State], scale: Scale) -> list[Artist]:
    """What each look means, of those that occur."""
    words = {word for state in states for word in np.unique(state.status[contact.loads > 0])}
    entries = [
        ("partial slip: stick disc", "o", STICK, "partial"),
        ("its slip annulus", "o", SLIP, "partial"),
        ("sliding", "o", SLIDING, "sliding"),
    ]
    handles: list[Artist] = [
        Line2D([], [], ls="", marker=marker, ms=6, mew=0.4, mec=SMOOTH, mfc=colour, label=text)
        for text, marker, colour, word in entries
        if word in words
    ]
    if any(_doubtful(state).any() for state in states):
        handles.append(Line2D([], [], ls="", marker="x", ms=4, color=SMOOTH, label="undecided"))
    if (contact.loads == 0).any() and np.count_nonzero(contact.loads) < CROWDED:
        handles.append(Line2D([], [], ls="", marker="o", ms=2, mew=0, color=FAINT, label="open"))
    if scale.smooth is None:
        return handles
    line: dict[str, Any] = {"lw": 0.9, "color": SMOOTH}
    handles.append(Line2D([], [], ls=DASHED, label=f"{smooth_name(contact)}: contact", **line))
    if any(np.any(state.force != 0) for state in states):
        handles.append(Line2D([], [], ls=DOTTED, label=f"{smooth_name(contact)}: stick", **line))
    return handles


def _doubtful(state: State) -> Any:
    """(n,) which asperities to mark; where nothing is proved, those with a load."""
    unsure = state.status == "undecided"
    return unsure & (state.contact.loads > 0) if state.certificate.scope == "none" else unsure


def state_title(state: State, scale: ShearScale, *, narrow: bool) -> str:
    """The shear force, of a vector its size, and how many slide."""
    touching = state.contact.loads > 0
    slide = int((touching & (state.status == "sliding")).sum())
    force = state.force if isinstance(state, ShearState) else np.hypot(*state.force)
    share = f"{force / scale.force:.4g}".replace("-", "\u2212")
    words = f"{slide:,} of {int(touching.sum()):,} slide"
    unsure = doubt(state.certificate.scope, state.status)
    return f"$Q/(fP)$ = {share}:{chr(10) if narrow else ' '}{words}" + unsure.replace(" ", "\n", 1)
