"""The figures say what contacts and states say, and nothing in them collides."""

import dataclasses
import re
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from figure_checks import discs, fits, texts
from friction_scenes import LARGEST, ONE, PAPER, follow
from matplotlib import rc_context, style
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from numpy.testing import assert_allclose
from scenes import PAPER_APPROACH, hexagonal, on_sphere, paper, rough, steel

import convexrough as cr
from convexrough import fields, plots
from convexrough.paper.example import PaperStates
from convexrough.paper.figures import paper_figures
from convexrough.plots.asperity_map import LOOKS, SLIDING, UNKNOWN
from convexrough.sphere.smooth import smooth
from convexrough.sweeps.figures import draw_quantiles

P = LARGEST["paper"]

#: Scenes and what is prescribed, if not the approach of the paper.
CASES: dict[str, tuple[cr.Scene, dict[str, float]]] = {
    "one": (on_sphere([[0.0, 0.0]]), {}),
    "paper": (paper(), {}),
    "rough": (rough(), {}),
    "steel": (steel(), {"approach": 0.5e-6}),
    "2200": (hexagonal(3e-4, tip_radius=2.4e-3, within=8.5e-3), {"load": 4.5e-7}),
    "4000": (hexagonal(2.2e-4, tip_radius=1.76e-3, within=8.5e-3), {"load": 4.5e-7}),
    "nothing": (paper(), {"approach": -1e-6}),
}


@cache
def contact(name: str) -> cr.Contact:
    bare, *named = name.split(" in ")
    scene, control = CASES[bare]
    scene = dataclasses.replace(scene, friction=0.5, units=("µm", "mN") if named else ("", ""))
    return cr.press(scene, **(control or {"approach": PAPER_APPROACH}))


def limit(name: str) -> float:
    return 0.5 * contact(name).load


def states(name: str, shares: list[float]) -> list[cr.ShearState]:
    return [cr.shear(contact(name), force=share * limit(name)) for share in shares]


def past(name: str, shares: Any) -> cr.LoadPath:
    return cr.history(contact(name), forces=np.multiply(shares, limit(name)))


@pytest.mark.sample(3)
@pytest.mark.parametrize("name", CASES)
def test_fit_to_print(name: str) -> None:
    pressed = contact(f"{name} in units")
    fits(pressed.plot().figure)
    for figure in plots.press_figures(pressed).values():
        fits(figure)
        for axes in figure.axes[:2] if pressed.loads.any() else ():
            assert axes.get_xlabel()
            assert axes.get_ylabel()


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    ("name", "shares"),
    [("paper", [0.9, -0.5, 0.6, -0.2, 0.4, 0.1, 0.8, 0.95]), ("paper", [-0.5, 0.1, 0.2, 1.0]),
     ("one", [0.5]), ("rough", [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7])],
)  # fmt: skip
def test_fit_to_print_when_sheared(name: str, shares: list[float]) -> None:
    name = f"{name} in units"
    ends = limit(name) * np.array([np.abs(shares), np.minimum(shares, -np.abs(shares) / 9)])
    fits(*plots.shear_figures(states(name, shares)).values())
    fits(*plots.path_figures(past(name, shares)).values())
    fits(*plots.cycle_figures(cr.cycles(contact(name), *ends)).values())


def test_figures_of_the_paper_fit_to_print() -> None:
    fits(*paper_figures(PaperStates(contact("paper"))).values())


def test_discs_have_the_radii_of_the_state() -> None:
    (state,) = states("rough", [0.5])
    (axes,) = plots.shear_figures([state])["stick_slip"].axes
    a_H = smooth(state.contact.scene, load=state.contact.load).contact_radius
    lines: Any = {each.get_label(): each for each in axes.collections}
    partial = state.status == "partial"
    assert_allclose(lines["stick"].get_widths(), 2 * state.stick_radii[partial] / a_H, rtol=1e-12)
    whole = state.contact.contact_radii[partial]
    assert_allclose(lines["partial"].get_widths(), 2 * whole / a_H, rtol=1e-12)
    assert_allclose(lines["sliding"].get_facecolor(), [to_rgba(SLIDING)])


@pytest.mark.parametrize(("scope", "count"), [("global", 4), ("none", 37)])
def test_doubt_is_marked(scope: Any, count: int) -> None:
    """Of the last of the asperities that touch."""
    (sure,) = states("paper", [0.5])
    status = sure.status.copy()
    status[np.flatnonzero(sure.contact.loads)[-count:]] = "undecided"
    certificate = dataclasses.replace(sure.certificate, scope=scope, status=status)
    state = dataclasses.replace(sure, certificate=certificate)
    (axes,) = plots.shear_figures([state])["stick_slip"].axes
    (marks,) = [line for line in axes.lines if line.get_marker() == "x"]
    assert len(np.asarray(marks.get_xdata())) == discs(axes, "undecided") == count
    assert axes.get_title().endswith("(not proved)" if scope == "none" else "(4 undecided)")
    fits(plots.shear_figures([state] * 3)["stick_slip"])


def test_the_path_passes_through_every_step() -> None:
    done = past("paper", [0.6, -0.2, 0.3, -0.6, 0.6])
    path, cost = plots.path_figures(done)["history"].axes
    sphere = smooth(done.contact.scene, load=done.contact.load)
    X0 = sphere.displacement(sphere.largest_force)
    ends, energies = (axes.lines[0].get_xydata() for axes in (path, cost))
    assert_allclose(ends[:, 0], done.displacements / X0, rtol=1e-9, atol=1e-15)
    assert_allclose(ends[:, 1], done.forces / limit("paper"), rtol=1e-12)
    assert_allclose(energies[:, 0], range(1, 6))
    assert_allclose(energies[:, 1], done.losses / sphere.energy_scale, rtol=1e-9)
    curve = np.concatenate([piece.vertices for piece in path.collections[0].get_paths()])
    assert all(np.abs(curve - end).sum(axis=1).min() < 1e-9 for end in ends)
    spent = np.concatenate([piece.vertices for piece in cost.collections[0].get_paths()])
    part, lost = spent[np.argmin(np.abs(spent[:, 0] - 0.75))]  # the force grows evenly in a step
    there = cr.history(done.contact, forces=[part * done.forces[0]])
    assert_allclose(lost, there.losses[0] / sphere.energy_scale, rtol=1e-9)
    assert {text.get_text() for text in path.texts} == {"1, 5", "2", "3", "4"}  # the loop closes


def test_what_cannot_be_drawn_is_refused() -> None:
    one, other = contact("paper"), contact("rough")
    two = cr.cycles(one, np.array([0.2, 0.4]) * one.load)
    loops = cr.loops(two, 40)
    assert plots.cycle_figures(two, loops=loops)
    figure: Any = Figure()
    five: Any = 5
    for call, said in [
        (lambda: plots.shear_figures([cr.shear(it, force=0) for it in (one, other)]),
         r"states\[1\]: found a result of another contact"),
        (lambda: plots.cycle_figures([two[0], cr.cycle(other, maximum=0)]), r"\[1\]: found a res"),
        (lambda: plots.cycle_figures(two, loops=[]), "loops: found others, expected"),
        (lambda: plots.cycle_figures(two, loops=loops[::-1]), "loops: found others"),
        (lambda: plots.shear_figures([five]), r"\[0\]: found type int, expected a ShearState or"),
        (lambda: plots.cycle_figures([five]), r"cycles\[0\]: found type int, expected a Cycle"),
        (lambda: plots.phase_figures(five), "found type int, expected PhaseLosses"),
        (lambda: plots.steady_figures(five), "found type int, expected a Cycle"),
        (lambda: plots.shakedown_figures(five), "found type int, expected a Shakedown"),
        (lambda: plots.surface_figures(five, five, five), "surface: found type int"),
        (lambda: draw_quantiles({}, "P", "R", [], five), "axes: found type int"),
        (lambda: plots.save(five, "a.png"), "figure: found type int"),
        (lambda: plots.save(figure, "a.jpg"), "path: found 'jpg', expected one of png, svg, pdf"),
        (lambda: plots.save(figure, "a.pdf", "png"), "form: found 'png', .* that of the path"),
        (lambda: plots.save(figure, "a.pdf", dpi=None), "dpi: found None"),  # type: ignore[arg-type]
    ]:  # fmt: skip
        with pytest.raises(cr.InputError, match=said):
            call()


def test_no_contact_is_said() -> None:
    name = "nothing in units"
    figures = plots.shear_figures(states(name, [0.0, 0.0]))
    figures |= plots.cycle_figures(cr.cycles(contact(name), [0.0, 0.0]))
    figures |= plots.path_figures(past(name, [0.0, 0.0]))
    assert len(figures) == 3
    for figure in figures.values():
        assert "no contact" in {text.get_text() for text in texts(figure)}
        fits(figure)


def test_the_path_and_its_memory_are_drawn() -> None:
    path = follow("paper", ONE)
    figures = plots.path_figures(path)
    fits(*figures.values())
    plane, loop, cost = figures["path"].axes
    lines = {line.get_label(): line.get_xydata() for line in plane.lines}
    last = path.curves[-1]
    vertices = np.array([[float(each) for each in row] for row in (last.levels, last.heights)])
    assert_allclose(lines["memory at 7"], vertices.T / P)
    assert loop.lines[-1].get_ydata()[-1] == pytest.approx(path.forces[-1] / (0.5 * P))
    W0 = cr.smooth(PAPER, load=P).energy_scale
    assert cost.lines[0].get_ydata()[-1] == pytest.approx(path.losses[-1] / W0)
    place = figures["path_stick_slip"].axes[3]
    assert discs(place, "sliding") == int((path.status[3] == "sliding").sum())
    said = [text.get_text() for text in texts(figures["path_stick_slip"])]
    assert "4: $P$ = 1 $P_m$\n$Q$ = \u22120.075 $P_m$\n6 of 37 slide" in said
    assert [text.count("P_m$ = ") for text in said if text.startswith("$x")] == [1]
    assert said.count("\u22121") == 2 + 4


@pytest.mark.parametrize("radius", [1.0, (1.0, np.inf)])
def test_maps_of_many_digits(radius: Any) -> None:
    """Titles fit above four maps in a row, and raw lengths below them have room."""
    scene = dataclasses.replace(PAPER, sphere_radius=radius)
    loads, forces = np.array([[1, 1.2, 0.8, 1, 1], [0, 0.1, 0.15, -0.1, 0.05]]) * 3e-7
    maps = plots.path_figures(cr.load_path(scene, loads=loads, forces=forces))["path_stick_slip"]
    fits(maps)
    assert max(len(each.get_text()) for each in maps.axes[3].get_xticklabels()) <= 4


def test_what_limits_shakedown_is_said() -> None:
    swing = P * np.array([-0.4, 0.4])
    for part, kept in ((0.0, "open in every cycle"), (1.0, "keep sliding")):
        p, q = (1 - part) * swing, part * swing
        found = cr.shakedown(PAPER, load=P, load_amplitudes=p, force_amplitudes=q)
        fits(figure := plots.shakedown_figures(found)["shakedown"])
        assert figure.axes[0].get_title("left").endswith(f"\nringed: the first to {kept}")
        assert ("opens" in figure.axes[1].get_ylabel()) == ("open" in kept)


def test_what_a_closed_path_settles_to() -> None:
    named = dataclasses.replace(PAPER, units=("µm", "mN"))
    found = cr.steady(named, loads=[0.9 * P, 0.5 * P], forces=[0.2 * P, -0.2 * P])
    fits(figure := plots.steady_figures(found)["steady"])
    plane, place = figure.axes
    pico = 1e-9  # of mN
    expected = [[found.level / pico, found.force_level / (0.5 * pico)]]
    assert_allclose(plane.lines[-1].get_xydata(), expected, rtol=1e-12, atol=1e-9)
    for status in LOOKS:
        assert discs(place, status) == int((found.status == status).sum())


def test_unknown_wear_is_grey() -> None:
    worn = cr.fretting(cr.steady(PAPER, loads=[P, 0.02 * P], forces=[0.2 * P, -0.005 * P]))
    fits(figure := plots.fretting_figures(worn)["fretting"])
    legend: Any = figure.axes[0].get_legend()
    assert [text.get_text() for text in legend.texts] == ["not known"]
    (drawn,) = figure.axes[0].collections
    unknown = np.isnan(worn.slip_amplitudes[worn.contact.loads > 0])
    grey = (np.asarray(drawn.get_facecolor()) == to_rgba(UNKNOWN)).all(axis=1)
    assert (grey == unknown).all()
    figure = dataclasses.replace(worn, slip_amplitudes=np.full(len(PAPER), np.nan)).plot().figure
    assert len(figure.axes) == 1  # no colour bar
    assert [text.get_text() for text in texts(figure)].count("not known") == 1


def test_dark_styles_stay_legible() -> None:
    pressed = contact("paper")
    with style.context("dark_background"):
        path = plots.path_figures(past("paper", [0.6, -0.2]))["history"].axes[0]
        verdict = plots.verdict_figures(cr.verify(pressed.scene, 0 * pressed.loads, load=1.0))
        dashed = pressed.plot().patches[0]
    assert path.texts[0].get_color() == "white"
    assert path.texts[0].get_bbox_patch().get_facecolor() == to_rgba("black")
    assert verdict["verdict"].axes[0].texts[0].get_color() == "black"  # in a white box
    assert dashed.get_edgecolor() == to_rgba("white")


def test_one_phase_is_a_dot() -> None:
    around: Any = dict(load=P, load_amplitude=0.2 * P, force_amplitude=0.1 * P, chords=6)
    found = cr.phase_losses(PAPER, **around, phases=[1.5])
    assert [line.get_marker() for line in found.plot().lines[:2]] == [".", "."]


def test_the_colours_and_the_profile_show_the_pressure() -> None:
    pressed = contact("rough")
    chart, profile, bar = plots.press_figures(pressed)["pressure"].axes
    p0, a_H = np.cbrt([6 * pressed.load / np.pi**3, 3 * pressed.load / 4])  # E* = R = 1
    assert_allclose(bar.get_ylim(), (0, fields.peak_pressures(pressed).max() / p0), rtol=1e-12)
    x, y = profile.collections[0].get_paths()[0].vertices.T  # type: ignore[union-attr]
    row = np.column_stack((x * a_H, np.zeros_like(x)))
    shown = y > 1e-3
    assert shown.sum() > 400
    assert_allclose(y[shown], fields.pressure(pressed, row)[shown] / p0, rtol=1e-3)
    (smooth,) = profile.lines
    assert_allclose(np.hypot(*smooth.get_data()), 1, rtol=1e-12)
    assert chart.get_xlim() == profile.get_xlim()


def test_the_curve_of_the_smooth_sphere_uses_the_area_of_a_cell() -> None:
    """That of the lattice, if the points were made on one; else the median of Voronoi's cells."""
    given = cr.Asperities(PAPER.asperities.positions, PAPER.asperities.tip_radii)
    few: Any = dict(spacing=0.0025, tip_radius=0.02, within=0.0025)  # hardly a cell is inside
    small = cr.Asperities.hexagonal(**few), cr.Asperities.square(**few)
    drawn = []
    for each in (PAPER.asperities, given, *small):
        pressed = cr.press(dataclasses.replace(PAPER, asperities=each), approach=PAPER_APPROACH)
        drawn.append(plots.press_figures(pressed)["loads"].axes[0].lines)
    assert_allclose(drawn[0][0].get_ydata(), drawn[1][0].get_ydata(), rtol=1e-12)
    assert [*map(len, drawn[2:])] == [1, 1]


def test_files_keep_their_text_and_pixels(tmp_path: Path) -> None:
    figure = Figure(figsize=(1, 1))
    figure.subplots().set_xlabel("load [mN]")
    names = ("a.svg", "a.pdf", "a.png", "b.svg", "b.png")
    for name, origin in zip(names, ["upper"] * 4 + ["lower"], strict=True):
        with rc_context({"image.origin": origin}):
            plots.save(figure, tmp_path / name, name[2:], 600)
    svg, pdf, png, *again = ((tmp_path / name).read_bytes() for name in names)
    assert again == [svg, png]  # no date inside; not upside down
    assert re.search(rb"<text[^>]*>load \[mN\]</text>", svg)
    assert (pdf[:4], png[16:24]) == (b"%PDF", 2 * (600).to_bytes(4, "big"))  # width and height
