"""The figures of a surface say what the surface says, and nothing in them collides."""

import pytest
from figure_checks import discs, fits, texts
from scenes import MATERIAL

import convexrough as cr
from convexrough.plots.surface import surface_figures

MAP = cr.surface.self_affine(0.8, 0.1, 32.0, seed=1, pixels=384, unit="µm")
MAXIMA = MAP.summits(0.0)


def press(asperities: cr.Asperities, load: float = 300.0) -> cr.Contact:
    return cr.press(cr.Scene(1e4, asperities, MATERIAL, geometry="closest"), load=load)


def said(figure: object) -> set[str]:
    return {text.get_text() for text in texts(figure)}  # type: ignore[arg-type]


@pytest.mark.sample(1)
@pytest.mark.parametrize("load", [1.0, 300.0, 1000.0])
def test_figures_fit(load: float) -> None:
    summits = MAXIMA.pruned(0.02)
    curve = cr.surface.provability(MAXIMA, lambda left: press(left, load))
    contact = press(summits, load)
    figures = surface_figures(MAP, MAXIMA, summits, curve, contact)
    assert set(figures) == {"map", "histograms", "provability"}
    fits(*figures.values())
    touching = int((contact.loads > 0).sum())
    chart = figures["map"].axes[0]
    assert discs(chart, "_contacts") == touching
    (dots,) = chart.lines
    shown, count = len(dots.get_xdata()), f"{len(summits):,}"
    some = count if shown == len(summits) else f"{shown:,} of {count}"
    named = {f"summits ({some})", f"contacts ({touching:,})", "smooth contact"}
    assert named <= said(figures["map"])
    pairs, _ = cr.surface.crowded(contact)
    named = {f"{i}, {j}" for i, j in pairs[:1]}
    assert named <= said(figures["map"])


def test_a_map_names_the_unit_of_its_numbers() -> None:
    """256 Å are 25.6 nm, of heights and of summits."""
    surface = cr.surface.self_affine(0.8, 0.1, 32.0, seed=1, unit="Å")
    for drawn in (surface.plot(), surface.summits().plot()):
        assert drawn.get_xlabel().endswith("[nm]")
        assert drawn.get_xlim()[1] == pytest.approx(12.8, rel=0.15)
