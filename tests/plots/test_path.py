"""Figures of load paths: they show the numbers of the results, and nothing in them collides."""

from dataclasses import replace

import numpy as np
import pytest
from figure_checks import discs, fits
from numpy.testing import assert_allclose
from path_scenes import LARGEST, ONE, PAPER, follow

import convexrough as cr
from convexrough import plots
from convexrough.plots.asperity_map import LOOKS

P = LARGEST["paper"]
NAMED = replace(PAPER, units=("µm", "mN"))


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
