"""Figures like Figs. 3 to 9 of the source paper (Dini and Hills 2009), and their numbers."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle

from convexrough import checks, fields
from convexrough.arrays import Array
from convexrough.friction.cycle import Loop
from convexrough.friction.path import LoadPath
from convexrough.friction.shear import ShearState
from convexrough.paper.example import AMPLITUDES, READ_CROSSING, SHARE, PaperStates
from convexrough.plots import style
from convexrough.plots.asperity_map import SLIDING, STICK, draw_values
from convexrough.plots.cycle import loops_figure, ring_colour, smooth_loop
from convexrough.plots.notebook import Figure, Figures, panels
from convexrough.plots.press import TOWARDS_RIM, abscissae, map_and_profile, pressure_figure
from convexrough.plots.shear import draw_state, legend_handles
from convexrough.plots.style import DASHED, DOTTED, DOUBLE, ROUGH, SMOOTH, TICK, UNSURE, Scale
from convexrough.run.stage import Columns
from convexrough.sphere.smooth import smooth


def paper_figures(found: PaperStates) -> Figures:
    """The figures of the paper's example, without units. States are those at Q / (f P) = 0.5."""
    scale, loops = Scale(found.contact), ([found.steady], [found.loop])
    return Figures(
        fig3_pressure=pressure_figure(scale),
        fig4_rings=_rings_figure(found, scale),
        fig5_traction=_traction_figure(found, scale),
        fig6_section=_section_figure(found, scale),
        fig7_asperities=_forces_figure(found, scale),
        fig8_loops=loops_figure(*loops, found.firsts.items(), "ring", scale),
        fig9_energy=_loss_figure(found, scale),
    )


def _rings_figure(found: PaperStates, scale: Scale) -> Figure:
    """Rings; those that slide; the forces at which the first asperity of each starts to slide."""
    contact, named, onsets = found.contact, found.named, found.onsets
    how = {"width_ratios": [1.0, 0.9], "gridspec_kw": {"wspace": 0.06}}
    figure, (chart, bars) = panels(DOUBLE, 3.4, 1, 2, **how)
    draw_state(chart, found.half, scale)
    left, right = chart.get_xlim()
    chart.set(xlim=(1.08 * left, 1.08 * right), ylim=(1.08 * left, 1.08 * right))  # for letters
    shifted = contact.scene.contact_points + np.array([0.015 * scale.typical, 0.0])
    for name, ring in named.items():
        for i in ring:
            x, y = scale.length.of(shifted[i] + np.array([contact.contact_radii[i], 0.0]))
            chart.text(x, y, name, va="center", fontsize=7, path_effects=style.halo(), clip_on=True)
    slides = [name for name, ring in named.items() if (found.half.status[ring] == "sliding").any()]
    style.title(chart, f"slide at $Q/(fP)$ = {SHARE:g}: {', '.join(slides)}", "center")

    rows = np.arange(len(named))
    start = np.array([onsets[ring].min() for ring in named.values()])
    look: dict[str, Any] = {"height": 0.62, "ec": SMOOTH, "lw": 0.4}
    bars.barh(rows, start, color=STICK, **look)
    bars.barh(rows, 1.0 - start, left=start, color=SLIDING, **look)
    bars.axvline(SHARE, ls=DASHED, lw=1.0, color=SMOOTH)
    bars.set_yticks(rows, [f"{name} ({len(ring)})" for name, ring in named.items()])
    bars.set(xlim=(0.0, 1.0), ylim=(len(rows) - 0.4, -0.6))
    bars.tick_params(axis="y", length=0)
    for row, value in zip(rows, start, strict=True):
        bars.text(1.02, float(row), f"{value:.4f}", fontsize=TICK, va="center")
    limit = f"$fP$ = {style.quantity(scale.limit, '')}"
    style.label(bars, f"$Q\\,/\\,(fP)$  ({limit})", "ring (asperities)")
    style.title(bars, "light: stick in part; dark: slide")
    style.note(bars, "from", (1.02, 1.0), (0, 6), va="baseline", xycoords="axes fraction")
    handles = legend_handles([found.half], scale)
    style.legend(figure, "outside", handles=handles, loc="outside upper center", ncols=4)
    return figure


def _tractions(scale: Scale) -> tuple[float, style.Measure]:
    """The coefficient of friction f, and the measure of tractions, f p0."""
    f = checks.friction(scale.contact.scene.friction)
    return f, style.measure(f * scale.peak, "", "(fp_0)")


def _traction_figure(found: PaperStates, scale: Scale) -> Figure:
    """Shear traction of all asperities, and on the central one."""
    state, contact, (f, unit) = found.half, found.contact, _tractions(scale)
    centre = found.firsts["F"]
    figure, (chart, profile) = map_and_profile()
    _draw_tractions(chart, state, scale, unit)
    style.title(chart, f"$Q/(fP)$ = {SHARE:g}")

    a, c = contact.contact_radii[centre], state.stick_radii[centre]
    x = np.unique(np.concatenate((a * TOWARDS_RIM, c * TOWARDS_RIM)))
    line = contact.scene.contact_points[centre] + np.column_stack((x, np.zeros_like(x)))
    profile.axvspan(-c / a, c / a, fc=STICK, alpha=0.5, lw=0, label="stick disc")
    fp = unit.of(f * fields.pressure(contact, line))
    profile.plot(x / a, fp, ls=DASHED, lw=1.2, color=SMOOTH, label="$fp$")
    profile.plot(x / a, unit.of(fields.traction(state, line)), lw=1.4, color=ROUGH, label="$q$")
    profile.set(xlim=(-1.08, 1.08), ylim=(0.0, 1.06 * fp.max()))
    style.title(profile, "central asperity")
    across = f"$x\\,/\\,a_i$  ($a_i$ = {style.quantity(a, '')})"
    style.label(profile, across, unit.label("q"))
    style.legend(profile, "above")
    return figure


def _draw_tractions(axes: Axes, state: ShearState, scale: Scale, unit: style.Measure) -> None:
    """Draw each traction as a stack of discs, from the rim to the stick disc and to the centre."""
    a, c = state.contact.contact_radii, state.stick_radii
    slip = np.sqrt(1.0 - np.divide(c, a, out=np.zeros(len(a)), where=a > 0) ** 2)

    def radii(s: Any) -> Any:
        return np.concatenate((a * np.sqrt(1.0 - (slip * s) ** 2), c * np.sqrt(1.0 - s**2)))

    steps = 24
    s = np.arange(steps)[:, None] / steps
    middle = radii(s + 0.5 / steps)[..., None] * (1.0, 0.0) + scale.points
    tractions = unit.of(np.abs(fields.traction(state, middle)))
    draw_values(axes, scale, tractions, unit.short("q"), radii=radii(s))


def _section_figure(found: PaperStates, scale: Scale) -> Figure:
    """Traction and f * pressure along y = 0, also of the smooth sphere."""
    state, contact, (f, unit) = found.half, found.contact, _tractions(scale)
    sphere = smooth(contact.scene, load=contact.load)
    figure, (axes,) = panels(DOUBLE, 2.9)
    points, radii = contact.scene.contact_points, contact.contact_radii
    edge = 1.06 * max(scale.typical, float((np.hypot(*points.T) + radii)[contact.loads > 0].max()))
    x = np.union1d(abscissae(points, radii, edge), abscissae(points, state.stick_radii, edge))
    line = np.column_stack((x, np.zeros_like(x)))
    fp, q = unit.of(f * fields.pressure(contact, line)), unit.of(fields.traction(state, line))
    across = scale.length.of(x)
    axes.fill_between(across, fp, fc=(ROUGH, 0.15), ec=ROUGH, lw=0.8, label="asperities: $fp$")
    axes.fill_between(across, q, fc=(ROUGH, 0.65), ec=ROUGH, lw=0.8, label="asperities: $q$")
    s = scale.typical * TOWARDS_RIM
    s = np.union1d(s, TOWARDS_RIM * sphere.stick_radius(state.force))
    smooth_fp, smooth_q = f * sphere.pressure(np.abs(s)), sphere.traction(np.abs(s), state.force)
    for values, ls, name in ((smooth_fp, DASHED, "$fp$"), (smooth_q, DOTTED, "$q$")):
        axes.plot(scale.length.of(s), unit.of(values), ls=ls, lw=1.4, color=SMOOTH,
                  label=f"smooth sphere: {name}")  # fmt: skip
    most = max(float(unit.of(f * scale.peak)), float(fp.max()))
    axes.set(xlim=(-scale.length.of(edge), scale.length.of(edge)), ylim=(0.0, 1.05 * most))
    style.label(axes, scale.length.label("x"), unit.label("q"))
    style.title(axes, f"$y$ = 0, $Q/(fP)$ = {SHARE:g}")
    style.legend(axes, "above", ncols=4)
    return figure


def _forces_figure(found: PaperStates, scale: Scale) -> Figure:
    """Force and displacement of the first asperity of each ring, for Q = 0 to f P."""
    figure, (left, right) = panels(DOUBLE, 3.2, 1, 2, gridspec_kw={"wspace": 0.06})
    firsts, path, share = found.firsts, found.path, found.fractions
    force = 100.0 * path.asperity_forces / found.limit
    moved = scale.displacement.of(path.asperity_displacements)
    own = moved - scale.displacement.of(path.slips)
    for order, i in enumerate(firsts.values()):
        start = min(found.onsets[i], 1.0)
        look: dict[str, Any] = {"color": ring_colour(order, len(firsts)), "lw": 1.2}
        slid = np.searchsorted(share, start)
        left.plot(share, force[:, i], **look)
        right.plot(share, moved[:, i], **look)
        right.plot(share[slid:], own[slid:, i], **(look | {"lw": 0.9, "ls": DOTTED}))
        for axes, values in ((left, force), (right, moved)):
            axes.plot(start, values[slid, i], "o", ms=4, mec=SMOOTH, mew=0.4, mfc=look["color"],
                      clip_on=False, zorder=3, label="_onset")  # fmt: skip
    for axes, values in ((left, force), (right, moved)):
        axes.set(xlim=(0.0, 1.0))
        axes.set_ylim(0.0, 1.04 * float(values.max()))
        _letters(axes, list(firsts), values[-1, list(firsts.values())])
    style.label(left, "$Q\\,/\\,(fP)$", "$Q_i\\,/\\,(fP)$  [%]")
    style.title(left, "an asperity of each ring; dot: starts to slide")
    style.label(right, "$Q\\,/\\,(fP)$", scale.displacement.short("(X_i + s_i)"))
    style.title(right, "with gross slip; dotted: without")
    figure.supxlabel(scale.footnote(), fontsize=TICK)
    return figure


def _letters(axes: Axes, names: list[str], heights: Array) -> None:
    """Write the name of each curve to the right of its end, higher where names would overlap."""
    low, high = axes.get_ylim()
    order, steps = np.argsort(heights), 0.055 * (high - low) * np.arange(len(heights))
    placed = np.maximum.accumulate(heights[order] - steps) + steps
    for k, y in zip(order, placed, strict=True):
        style.note(axes, names[k], (1.0, y), (6, 0), va="center", annotation_clip=False)


def _loss_figure(found: PaperStates, scale: Scale) -> Figure:
    """Energy per cycle against amplitude, rough and smooth, with a zoom on their crossing."""
    figure, (whole, zoom) = panels(DOUBLE, 3.0, 1, 2, gridspec_kw={"wspace": 0.06})
    energy = scale.energy(max(each.loss for each in found.cycles))
    rough = np.array([energy.of(each.loss) for each in found.cycles])
    smooth = energy.of(scale.work) * np.array([each.smooth_normalised for each in found.cycles])
    for axes in (whole, zoom):
        axes.plot(AMPLITUDES, rough, lw=1.3, color=ROUGH, label="asperities")
        axes.plot(AMPLITUDES, smooth, ls=DASHED, lw=1.1, color=SMOOTH, label=scale.name)
    window = found.crossing + np.array([-0.07, 0.07])
    energies = np.array([np.interp(window, AMPLITUDES, each) for each in (rough, smooth)])
    margin = 0.04 * float(np.ptp(energies))
    low, high = float(energies.min()) - margin, float(energies.max()) + margin
    whole.set(xlim=(0.0, 1.0), ylim=(0.0, 1.04 * float(max(rough.max(), smooth.max()))))
    zoom.set(xlim=tuple(window), ylim=(low, high))
    box = Rectangle((window[0], low), np.ptp(window), high - low, fill=False, ec=SMOOTH, lw=0.8)
    whole.add_patch(box)
    style.note(whole, "zoom", (float(window[1]), high), (-2, 3), ha="right", va="bottom")
    crossing = found.crossing, float(np.interp(found.crossing, AMPLITUDES, smooth))
    zoom.axvline(READ_CROSSING, ls=DOTTED, lw=1.0, color=SMOOTH, label="_read")
    zoom.plot(*crossing, "o", ms=5, mfc="white", mec=UNSURE, mew=1.3, label="_crossing")
    style.note(zoom, f"curves cross at {found.crossing:.3f}", crossing, (10, -14), color=UNSURE)
    said = f"read off the paper's\ngraph: about {READ_CROSSING:g}"
    style.note(zoom, said, (READ_CROSSING, low), (4, 4), va="bottom")
    style.label(whole, "amplitude of $Q\\,/\\,(fP)$", energy.label("W"))
    style.label(zoom, "amplitude of $Q\\,/\\,(fP)$", energy.short("W"))
    style.legend(whole, "inside")
    style.title(whole, "energy lost per cycle")
    style.title(zoom, "zoom")
    return figure


def figure_data(found: PaperStates) -> dict[str, Columns]:
    """The numbers behind the paper's Figs. 3 to 9: names of tables, with their columns."""
    contact, half, path, loop = found.contact, found.half, found.path, found.loop
    f = checks.friction(contact.scene.friction)
    sphere = smooth(contact.scene, load=contact.load)
    x = np.linspace(-1.3, 1.3, 2001) * sphere.contact_radius
    line = np.column_stack((x, np.zeros_like(x)))
    close = np.linspace(0.0, 1.2, 241) * contact.contact_radii[0]
    radial = np.column_stack((close, np.zeros_like(close)))
    places = dict(zip("xy", contact.scene.asperities.positions.T, strict=True))
    letters = np.full(len(contact.loads), "", dtype="<U1")
    for name, ring in found.named.items():
        letters[ring] = name

    def tractions(points: Array) -> Columns:
        most = f * fields.pressure(contact, points)
        return {"friction_limit": most, "traction": fields.traction(half, points)}

    def of_each_ring(states: LoadPath | Loop) -> Columns:
        """Forces and displacements of the first asperity of each ring."""
        forces, moved = states.asperity_forces, states.asperity_displacements
        columns = {f"force_{name}": forces[:, i] for name, i in found.firsts.items()}
        return columns | {f"displacement_{name}": moved[:, i] for name, i in found.firsts.items()}

    return {
        "fig3_pressure": dict(
            x=x, pressure=fields.pressure(contact, line), smooth_pressure=sphere.pressure(abs(x))
        ),
        "fig4_rings": dict(**places, ring=letters, load=contact.loads, status_at_half=half.status),
        "fig5_traction": {
            **(places | contact.columns("contact_radii") | half.columns("stick_radii")),
            **(contact.columns("loads") | half.columns("forces")),
        },
        "fig5_centre": dict(r=close, **tractions(radial)),
        "fig6_section": dict(
            x=x, **tractions(line), smooth_traction=sphere.traction(abs(x), half.force)
        ),
        "fig7_asperities": dict(
            fraction=found.fractions, displacement=path.displacements, **of_each_ring(path)
        ),
        "fig8_loops": dict(
            force=loop.forces,
            displacement=loop.displacements,
            smooth_displacement=smooth_loop(sphere, loop.forces),
            **of_each_ring(loop),
        ),
        "fig9_energy": dict(
            fraction=AMPLITUDES,
            loss=np.array([cycle.loss_normalised for cycle in found.cycles]),
            smooth_loss=np.array([cycle.smooth_normalised for cycle in found.cycles]),
            balance_defect=np.array([cycle.balance_defect for cycle in found.cycles]),
        ),
    }
