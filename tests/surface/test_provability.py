"""How strongly to prune: the curve, what trust needs, and the figures of a surface."""

from typing import Any

import numpy as np
import pytest
from figure_checks import discs, fits, texts
from numpy.testing import assert_allclose
from scenes import MATERIAL

import convexrough as cr
from convexrough.plots.surface import surface_figures
from convexrough.surface import Provability, crowded, provability

MAP = cr.surface.self_affine(0.8, 0.1, 32.0, seed=1, pixels=384, unit="µm")
MAXIMA = MAP.summits(0.0)


def press(asperities: cr.Asperities, load: float = 300.0) -> cr.Contact:
    return cr.press(cr.Scene(1e4, asperities, MATERIAL, geometry="closest"), load=load)


def test_each_level_is_a_press(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level("INFO", logger="convexrough")
    curve = provability(MAXIMA, press, levels=[0.2, 0.0, 0.05, 0.05])
    assert curve.prune.tolist() == [0.0, 0.05, 0.2]
    assert sum(line.startswith("pruning") for line in caplog.messages) == 3
    for i, prune in enumerate(curve.prune):
        left = MAP.summits(float(prune))
        contact = press(left)
        assert curve.summits[i] == len(left)
        assert curve.heights[i] == prune * MAP.max_height
        assert curve.scope[i] == contact.certificate.scope
        assert_allclose(curve.crowding[i], contact.crowding, rtol=1e-9)
        assert_allclose(curve.model_error[i], contact.model_error, rtol=1e-6)
        assert_allclose(curve.approaches[i], contact.approach, rtol=1e-9)
        _, values = crowded(contact, above=0.1)
        assert_allclose(values[0], contact.crowding, rtol=1e-12)
        if contact.certificate.all_proved:
            assert curve.contacts[i] == (contact.status == "contact").sum()
            assert curve.undecided[i] == 0


def curve_of(**changed: Any) -> Provability:
    """One that is to be trusted, but for what is changed."""
    good = dict(prune=0.1, heights=0.1, summits=9, contacts=5, undecided=0, scope="global",
                crowding=0.999, model_error=0.0499, approaches=1.0, loads=1.0)  # fmt: skip
    size = np.shape(changed.get("prune", [0.1]))
    return Provability(**{name: np.resize(it, size) for name, it in (good | changed).items()})


def test_what_trust_needs() -> None:
    fine = {}, {"scope": "local"}
    wrong = ({"contacts": 4}, {"scope": "none"}, {"undecided": 1}, {"crowding": 1.001},
             {"model_error": 0.0501}, {"crowding": np.nan})  # fmt: skip
    for change in (*fine, *wrong):
        trusted, curve = change in fine, curve_of(**change)
        assert (curve.trusted.tolist(), curve.trusted_from == 0.1) == ([trusted], trusted)


def test_prunings_that_leave_few_contacts_are_not_advised() -> None:
    """Neither alone, on a crowded map, nor as a reason to doubt weaker prunings."""
    for crowding, first in (([1.2, 1.1, 0.1, 0.0], np.nan), ([1.2, 0.9, 0.1, 0.0], 0.1)):
        curve = curve_of(prune=[0.0, 0.1, 0.3, 0.5], contacts=[30, 20, 4, 1], crowding=crowding)
        assert_allclose(curve.trusted_from, first)
        assert curve.doubts[0] == "discs overlap"
        assert curve.doubts[-1] == "fewer than 5 contacts"


def said(figure: Any) -> set[str]:
    return {text.get_text() for text in texts(figure)}


@pytest.mark.sample(1)
@pytest.mark.parametrize("load", [1.0, 300.0, 1000.0])
def test_figures_fit(load: float) -> None:
    summits = MAXIMA.pruned(0.02)
    curve = provability(MAXIMA, lambda left: press(left, load))
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
    pairs, _ = crowded(contact)
    named = {f"{i}, {j}" for i, j in pairs[:1]}
    assert named <= said(figures["map"])


def test_a_map_names_the_unit_of_its_numbers() -> None:
    """256 Å are 25.6 nm, of heights and of summits."""
    surface = cr.surface.self_affine(0.8, 0.1, 32.0, seed=1, unit="Å")
    for drawn in (surface.plot(), surface.summits().plot()):
        assert drawn.get_xlabel().endswith("[nm]")
        assert drawn.get_xlim()[1] == pytest.approx(12.8, rel=0.15)
