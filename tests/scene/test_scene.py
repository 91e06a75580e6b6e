"""Material, asperities, scene: geometry by independent means, two bodies, and bad values."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scenes import MATERIAL, hexagonal, paper

import convexrough as cr
from convexrough.scene.asperities import CUT_DEVIATIONS, largest_tip_radius
from convexrough.sphere import mindlin
from convexrough.vector_shear.problem import FrictionProblem

STEEL, ALUMINIUM = cr.Material.from_youngs(210e9, 0.3), cr.Material.from_youngs(70e9, 0.33)
BODIES = st.builds(cr.Material.from_youngs, st.floats(1e-3, 1e12), st.floats(0.0, 0.5))


@given(BODIES)
def test_two_bodies_of_one_kind_are_that_kind(body: cr.Material) -> None:
    assert cr.Material.pair(body, body) == body


@given(BODIES, BODIES)
def test_compliances_add_up(one: cr.Material, other: cr.Material) -> None:
    both, E, G, nu = cr.Material.pair(one, other), *_constants(one, other)
    compliance = ((1 - nu**2) / E).sum()
    assert both.contact_modulus == pytest.approx(1 / compliance, rel=1e-14)
    tangential = both.contact_modulus / 4 * ((2 - nu) / G).sum()  # over the normal compliance
    assert mindlin.ratio(both.poisson_ratio) == pytest.approx(tangential, rel=1e-13)
    beta = ((1 - 2 * nu) / G) @ [0.5, -0.5] / ((1 - nu) / G).sum()
    assert both.mismatch == pytest.approx(beta, abs=1e-13)
    swapped = cr.Material.pair(other, one)
    assert swapped.mismatch == pytest.approx(-both.mismatch, abs=1e-15)
    assert swapped.contact_modulus == pytest.approx(both.contact_modulus, rel=1e-14)


def _constants(*bodies: cr.Material) -> tuple[Any, Any, Any]:
    nu = np.array([body.poisson_ratio for body in bodies])
    E = np.array([2 * (1 - body.poisson_ratio**2) * body.contact_modulus for body in bodies])
    return E, E / (2 * (1 + nu)), nu


def test_tangential_kernel_is_the_sum_of_both_bodies() -> None:
    """Cerruti: [(1 - nu) + nu cos^2] / (2 pi G r) of each body."""
    pair = cr.Material.pair(STEEL, ALUMINIUM)
    contact = cr.press(replace(paper(), material=pair, friction=0.5), load=2e4)
    problem = contact.cached(FrictionProblem)
    _, G, nu = _constants(STEEL, ALUMINIUM)
    apart = np.subtract(*contact.scene.contact_points[problem.touching[[3, 17]]])
    r = np.hypot(*apart)
    cosine = apart[0] / r
    along = (((1 - nu) + nu * cosine**2) / (2 * np.pi * G * r)).sum()
    ratio = mindlin.ratio(pair.poisson_ratio) * problem.units.length / problem.units.force
    assert ratio * problem.kernel[2 * 3, 2 * 17] == pytest.approx(along, rel=1e-13)


def test_hexagonal_lattice() -> None:
    lattice = cr.Asperities.hexagonal(spacing=0.5, tip_radius=1, within=2.0)
    rings = {0: 1, 1: 6, 3: 6, 4: 6, 7: 12, 9: 6, 12: 6, 13: 12, 16: 6}
    squares = np.round((lattice.distances / 0.5) ** 2).astype(int)
    assert {s: int((squares == s).sum()) for s in set(squares)} == rings
    assert (np.diff(squares) >= 0).all()
    apart = np.hypot(*(lattice.positions[:, None] - lattice.positions).T)
    np.fill_diagonal(apart, np.inf)
    assert_allclose(apart.min(axis=0), 0.5)
    assert ((apart < 0.5001).sum(axis=0)[:7] == 6).all()


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


BAD = [
    (lambda: cr.Material(0.0, 0.3), "contact_modulus: found 0.0, expected a positive number"),
    (lambda: cr.Material(1.0, 0.51), "poisson_ratio: found 0.51, expected a number from 0.0 to 0"),
    (lambda: cr.Asperities([], 1.0), "positions: found no asperity"),
    (lambda: cr.Asperities([[0, 0, 0]], 1.0), r"positions: found shape \(1, 3\)"),
    (lambda: cr.Asperities([[0, 0], [0, np.nan]], 1.0), r"positions\[1\]: found"),
    (lambda: cr.Asperities([[0, 1], [2, 3], [0, 1]], 1.0),
     r"asperities 0 and 2 \(from 0\) at a distance of 0"),
    (lambda: cr.Asperities.square(spacing=1, tip_radius=1, within=1, height_std=1),
     "seed: found None"),
    (lambda: cr.press(paper(), approach=1e-80), "choose other units"),
    (lambda: cr.Asperities.hexagonal(spacing=1e-9, tip_radius=1, within=1),
     r"within / spacing = 1e\+09: found 3.63e\+18 asperities .* memory"),
    (lambda: paper("tip"), "geometry: found 'tip'"),
    (lambda: cr.Scene(1.0, cr.Asperities([[2, 0], [3, 0]], [1.0, 2.0]), MATERIAL),
     "asperities 0 and 1"),
    (lambda: cr.press(paper(), load=0.0), "load: found 0.0, expected a positive number"),
    (lambda: cr.press(paper()), "approach, load: found neither"),
    (lambda: cr.press(paper(), approach=1e-5, load=1e-5), "approach, load: found both"),
    # Memory is asked for so many before it is taken.
    (lambda: cr.press(hexagonal(2e-5, 1e-4), approach=5e-5, influence="dense"),
     r"could touch: found 9\.07e\+05"),
    (lambda: cr.certify(paper(), np.zeros(61)), "exactly one of the two"),
    (lambda: cr.certify(paper(), np.zeros(60), approach=5e-5), "expected 61 values"),
    (lambda: cr.certify(paper(), -np.ones(61), approach=5e-5), r"loads\[0\]: found -1.0"),
    (lambda: cr.certify(paper(), np.full(61, np.inf), approach=5e-5), r"loads\[0\]: found inf"),
]  # fmt: skip


@pytest.mark.sample(16)
@pytest.mark.parametrize(("call", "message"), BAD)
def test_bad_values(call: Any, message: str) -> None:
    with pytest.raises(cr.InputError, match=message) as caught:
        call()
    assert isinstance(caught.value, ValueError)
    assert isinstance(caught.value, cr.ConvexroughError)
