"""Figures of load paths: they show the numbers of the results, and nothing in them collides."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from figure_checks import discs, fits, texts
from numpy.testing import assert_allclose
from path_scenes import LARGEST, ONE, PAPER, follow

import convexrough as cr
from convexrough import plots
from convexrough.plots.asperity_map import LOOKS

P = LARGEST["paper"]
UNITS = ("µm", "mN")
NAMED = replace(PAPER, units=UNITS)


def limit(name: str) -> cr.Shakedown:
    swing = 0.5 * P * np.array([1.0, -1.0])
    if name == "ellipse":
        p, q = cr.elliptic_path(
            load=0.0, load_amplitude=0.09 * P, force_amplitude=0.09 * P, phase=0.8, friction=0.5
        )
        return cr.shakedown(PAPER, loads=0.9 * P, load_amplitudes=p, force_amplitudes=q)
    given: Any = {
        "constant": {"force_amplitudes": swing},
        "about a mean": {"forces": 0.1 * P, "force_amplitudes": swing},
        "elastic": {"force_amplitudes": swing, "kind": "elastic"},
        "vector": {"force_amplitudes": np.column_stack((swing, 0 * swing)), "kind": "vector"},
    }[name]
    return cr.shakedown(NAMED, loads=P, **given)


def test_the_path_and_its_memory_are_drawn() -> None:
    path = follow("paper", ONE)
    figures = plots.path_figures(path)
    for figure in figures.values():
        fits(figure)
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


def test_what_a_closed_path_settles_to() -> None:
    found = cr.steady(NAMED, loads=[0.9 * P, 0.5 * P], forces=[0.2 * P, -0.2 * P])
    figure = plots.steady_figures(found)["steady"]
    fits(figure)
    plane, place = figure.axes
    pico = 1e-9  # of mN
    dot = plane.lines[-1].get_xydata()
    expected = [[found.level / pico, found.force_level / (0.5 * pico)]]
    assert_allclose(dot, expected, rtol=1e-12, atol=1e-9)
    for status in LOOKS:
        assert discs(place, status) == int((found.status == status).sum())


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", ["constant", "about a mean", "ellipse", "elastic", "vector"])
def test_limits_are_drawn(name: str) -> None:
    found = limit(name)
    figures = plots.shakedown_figures(found)
    assert set(figures) == {"shakedown"} | ({"shakedown_map"} if found.kind == "exact" else set())
    for figure in figures.values():
        fits(figure)
    (said,) = [text for text in texts(figures["shakedown"]) if ":" in text.get_text()][:1]
    assert f"{found.kind}: {found.factor:.5g}" in said.get_text()
