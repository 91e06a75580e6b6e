"""Materials, asperities, and bases that are no sphere: by independent means and 50 digits."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scenes import MATERIAL

import convexrough as cr
from convexrough.scene.asperities import CUT_DEVIATIONS, largest_tip_radius
from convexrough.scene.scene import reach
from convexrough.sphere import mindlin

BODIES = st.builds(cr.Material.from_youngs, st.floats(1e-3, 1e12), st.floats(0.0, 0.5))


@given(BODIES, BODIES)
def test_compliances_add_up(one: cr.Material, other: cr.Material) -> None:
    assert cr.Material.pair(one, one) == one
    both = cr.Material.pair(one, other)
    nu = np.array([one.poisson_ratio, other.poisson_ratio])
    E = 2 * (1 - nu**2) * [one.contact_modulus, other.contact_modulus]  # of a body on its like
    compliance, G = ((1 - nu**2) / E).sum(), E / (2 * (1 + nu))
    assert both.contact_modulus == pytest.approx(1 / compliance, rel=1e-14)
    tangential = both.contact_modulus / 4 * ((2 - nu) / G).sum()  # over the normal compliance
    assert mindlin.ratio(both.poisson_ratio) == pytest.approx(tangential, rel=1e-13)
    beta = ((1 - 2 * nu) / G) @ [0.5, -0.5] / ((1 - nu) / G).sum()
    assert both.mismatch == pytest.approx(beta, abs=1e-13)
    swapped = cr.Material.pair(other, one)
    assert swapped.mismatch == pytest.approx(-both.mismatch, abs=1e-15)
    assert swapped.contact_modulus == pytest.approx(both.contact_modulus, rel=1e-14)


def test_hexagonal_lattice() -> None:
    lattice = cr.Asperities.hexagonal(spacing=0.5, tip_radius=1, within=2.0)
    rings = {0: 1, 1: 6, 3: 6, 4: 6, 7: 12, 9: 6, 12: 6, 13: 12, 16: 6}
    squares = np.round((lattice.distances / 0.5) ** 2).astype(int)
    assert {s: int((squares == s).sum()) for s in set(squares)} == rings
    assert (np.diff(squares) >= 0).all()
    rough = cr.Asperities.hexagonal(spacing=0.5, tip_radius=2, within=2.0, height_std=0.1, seed=3)
    assert rough.layout is lattice.layout  # made once
    assert (rough.tip_radii == 2).all()


def test_random_heights_and_radii() -> None:
    options: dict[str, Any] = dict(spacing=1.0, tip_radius=2.0, within=60.0, seed=11)
    both = cr.Asperities.square(height_std=0.1, tip_radius_cv=0.3, **options)
    only_heights = cr.Asperities.square(height_std=0.1, **options)
    assert (both.heights == only_heights.heights).all()
    assert (only_heights.tip_radii == 2.0).all()
    n = len(both)
    assert both.heights.std() == pytest.approx(0.1, rel=4 / np.sqrt(n))
    assert abs(both.heights.mean()) < 0.4 / np.sqrt(n)
    assert both.tip_radii.mean() == pytest.approx(2.0, rel=1.5 / np.sqrt(n))
    assert both.tip_radii.std() / both.tip_radii.mean() == pytest.approx(0.3, rel=0.05)
    assert both.tip_radii.max() <= largest_tip_radius(2.0, 0.3)
    assert np.abs(both.heights).max() <= CUT_DEVIATIONS * 0.1


@pytest.mark.parametrize("geometry", ["summit", "closest"])
def test_reach(geometry: Any) -> None:
    """No asperity beyond it could touch, along the axis where the base bends away least."""
    given: Any = dict(tip_radius=0.1, height=1e-5, geometry=geometry)
    edge = reach(1e-4, sphere_radius=(0.5, 2.0), **given)
    for factor, sign in ((0.999, 1), (1.001, -1)):
        asperity = cr.Asperities([[0.0, edge * factor]], 0.1, 1e-5)
        scene = cr.Scene((0.5, 2.0), asperity, MATERIAL, geometry=geometry)
        assert np.sign(1e-4 + scene.offsets[0]) == sign
    assert reach(1e-4, sphere_radius=np.inf, **given) == np.inf
    assert reach(-1e-4, sphere_radius=(1.0, np.inf), **given) == 0
