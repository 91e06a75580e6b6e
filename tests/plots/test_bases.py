"""Figures of bases that are no sphere: an ellipse beside the contact, or no smooth reference."""

from typing import Any

import numpy as np
import pytest
from matplotlib.patches import Ellipse
from numpy.testing import assert_allclose
from scenes import MATERIAL, paper

import convexrough as cr
from convexrough.plots.cycle import cycle_figures
from convexrough.plots.measure import Scale
from convexrough.plots.press import press_figures
from convexrough.plots.shear import shear_figures


def pressed(base: Any) -> cr.Contact:
    return cr.press(
        cr.Scene(base, paper().asperities, MATERIAL, friction=0.5, geometry="summit"), load=3e-7
    )


def texts(figure: Any) -> str:
    return " ".join(text.get_text() for text in figure.findobj(lambda it: hasattr(it, "get_text")))


def all_figures(contact: cr.Contact) -> dict[str, Any]:
    forces = 0.3 * 0.5 * contact.load, 0.6 * 0.5 * contact.load
    return {
        **press_figures(contact),
        **shear_figures([cr.shear(contact, force=force) for force in forces]),
        **cycle_figures([cr.cycle(contact, maximum=force) for force in forces]),
    }


def test_an_ellipse_beside_the_contact() -> None:
    contact = pressed((1.0, 2.5))
    figures = all_figures(contact)
    smooth = cr.smooth(contact.scene, load=contact.load)
    assert isinstance(smooth, cr.SmoothEllipsoid)
    axes = np.array(smooth.semi_axes) / smooth.contact_radius
    (contour,) = figures["pressure"].axes[0].findobj(Ellipse)
    assert_allclose([contour.width, contour.height], 2 * axes)
    whole, stick = figures["stick_slip"].axes[1].findobj(Ellipse)
    assert_allclose(stick.width / whole.width, np.cbrt(1 - 0.6))
    profile = next(
        line for line in figures["pressure"].axes[1].lines if line.get_label() == "smooth ellipsoid"
    )
    assert_allclose(profile.get_xdata().max(), axes[0])
    assert "smooth sphere" not in "".join(map(texts, figures.values()))


@pytest.mark.sample(1)
@pytest.mark.parametrize("base", [np.inf, (1.0, np.inf)])
def test_no_smooth_reference(base: Any) -> None:
    contact = pressed(base)
    figures = all_figures(contact)
    said = "".join(map(texts, figures.values()))
    assert "smooth sphere" not in said
    assert "a_H" not in said
    assert "r_c" in said
    assert "no smooth reference" in said
    assert not figures["stick_slip"].axes[0].findobj(Ellipse)
    X0 = Scale(contact).travel
    nearly = cr.shear(contact, force=0.5 * contact.load * (1 - 1e-9)).displacement
    assert pytest.approx(X0, rel=1e-5) == nearly
