"""Pressure anywhere: quadrature, and none outside the discs."""

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from scenes import NAMED

import convexrough as cr
from convexrough import fields


def pressed(name: str) -> cr.Contact:
    scene, approach = NAMED[name]
    return cr.press(scene, approach=approach)


@pytest.fixture(params=sorted(NAMED))
def contact(request: pytest.FixtureRequest) -> cr.Contact:
    return pressed(request.param)


def on_circles(contact: cr.Contact, fraction: float, angles: int = 7) -> Any:
    """Points on a circle about each touching asperity, of a fraction of its contact radius."""
    touching = contact.loads > 0
    centres, a = contact.scene.contact_points[touching], contact.contact_radii[touching]
    phi = 0.1 + 2 * np.pi * np.arange(angles) / angles
    circle = fraction * np.stack((np.cos(phi), np.sin(phi)), axis=-1)
    return centres[:, None] + a[:, None, None] * circle


@pytest.mark.sample(2)
def test_no_pressure_outside_the_discs(contact: cr.Contact) -> None:
    assert (fields.pressure(contact, on_circles(contact, 1 - 1e-6)) > 0).all()
    assert_array_equal(fields.pressure(contact, on_circles(contact, 1 + 1e-6)), 0.0)
    far = 10 * np.abs(contact.scene.contact_points).max()
    assert fields.pressure(contact, [far, 0.0]) == 0.0
    open_ = contact.scene.contact_points[contact.loads == 0]
    assert_array_equal(fields.pressure(contact, open_), 0.0)
