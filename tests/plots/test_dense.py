"""Figures of many asperities and of many cycles, and figures in a notebook."""

from functools import cache
from typing import Any

import numpy as np
import pytest
from figure_checks import discs, fits
from matplotlib.colors import to_rgba
from scenes import MATERIAL, PAPER_APPROACH, paper

import convexrough as cr
from convexrough import plots
from convexrough.plots.asperity_map import SLIDING


@cache
def dense() -> cr.Contact:
    asperities = cr.Asperities.hexagonal(
        spacing=2e-4, tip_radius=1.6e-3, within=8.5e-3, height_std=2e-7, seed=3
    )
    return cr.press(
        cr.Scene(1.0, asperities, MATERIAL, 0.5, geometry="summit", units=("mm", "N")),
        approach=PAPER_APPROACH,
    )


@cache
def few() -> cr.Contact:
    scene = paper()
    return cr.press(
        cr.Scene(1.0, scene.asperities, MATERIAL, friction=0.5, geometry="summit"),
        approach=PAPER_APPROACH,
    )


def test_a_dense_stick_slip_map_is_a_mosaic() -> None:
    contact = dense()
    state = cr.shear(contact, force=0.25 * contact.load)
    figure = plots.shear_figures([state])["stick_slip"]
    fits(figure)
    (axes,) = figure.axes
    assert not any(discs(axes, status) for status in ("sliding", "stick", "partial"))
    (image,) = axes.images
    colours = np.asarray(image.get_array())
    shown = colours[..., 3] > 0.5
    dark = np.abs(colours - to_rgba(SLIDING)).max(axis=-1) < 0.02
    sliding = (state.status == "sliding").sum() / np.count_nonzero(contact.loads)
    assert dark.sum() / shown.sum() == pytest.approx(sliding, abs=0.05)  # cells of one size


def test_figures_show_themselves_in_a_notebook() -> None:
    figures = plots.press_figures(few())
    page: Any = figures._repr_html_()
    assert page.count('src="data:image/png;base64,') == 2
    assert figures["pressure"]._repr_png_().startswith(b"\x89PNG")  # type: ignore[attr-defined]
