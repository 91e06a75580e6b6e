"""Two bodies that differ: sums over both, published values, limits, the equal case bit for bit."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scenes import paper

import convexrough as cr
from convexrough.sphere import mindlin, surface_shear
from convexrough.vector_shear.problem import VectorProblem

STEEL, ALUMINIUM = cr.Material.from_youngs(210e9, 0.3), cr.Material.from_youngs(70e9, 0.33)
BODIES = st.builds(cr.Material.from_youngs, st.floats(1e-3, 1e12), st.floats(0.0, 0.5))


def pressed(material: cr.Material, load: float) -> cr.Contact:
    scene = cr.Scene(1.0, paper().asperities, material, friction=0.5, geometry="summit")
    return cr.press(scene, load=load)


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


@pytest.mark.parametrize(
    ("G", "nu", "beta"),
    [(0.97, 0.38, 0.19), (22, 0.25, 0.21), (28, 0.32, 0.12), (45, 0.25, 0.12)],
    ids=["Perspex", "glass", "duralumin", "cast iron"],
)
def test_mismatch_on_steel_as_published(G: float, nu: float, beta: float) -> None:
    """Johnson, Contact Mechanics (1985), table 5.1; G in GPa."""
    body, steel = (cr.Material.from_youngs(2 * g * (1 + n), n) for g, n in ((G, nu), (80, 0.3)))
    assert cr.Material.pair(body, steel).mismatch == pytest.approx(beta, abs=0.005)


def test_tangential_kernel_is_the_sum_of_both_bodies() -> None:
    """Cerruti: [(1 - nu) + nu cos^2] / (2 pi G r) of each body."""
    contact = pressed(cr.Material.pair(STEEL, ALUMINIUM), load=2e4)
    problem = VectorProblem.of(contact)
    _, G, nu = _constants(STEEL, ALUMINIUM)
    apart = np.subtract(*contact.scene.contact_points[problem.touching[[3, 17]]])
    r = np.hypot(*apart)
    cosine = apart[0] / r
    along = (((1 - nu) + nu * cosine**2) / (2 * np.pi * G * r)).sum()
    units = problem.units
    ratio = mindlin.ratio(contact.scene.material.poisson_ratio) * units.length / units.force
    assert ratio * problem.kernel[2 * 3, 2 * 17] == pytest.approx(along, rel=1e-13)


def test_surface_displacement_is_the_mean_of_two_like_pairs() -> None:
    both, (_, G, nu) = cr.Material.pair(STEEL, ALUMINIUM), _constants(STEEL, ALUMINIUM)
    x, y = np.random.default_rng(3).uniform(-3, 3, (2, 50))

    def moved(G: float, nu: float) -> Any:
        return surface_shear.surface_displacement(x, y, 1.0, 0.4, 1e6, G, nu)

    mean = (moved(G[0], nu[0]) + moved(G[1], nu[1])) / 2
    assert_allclose(moved(both.shear_modulus, both.poisson_ratio), mean, rtol=1e-12)


def test_bad_bodies() -> None:
    both = cr.Material.pair(STEEL, ALUMINIUM)
    with pytest.raises(cr.InputError, match="base: found a pair, expected one body"):
        cr.Material.pair(STEEL, both)
    with pytest.raises(cr.InputError, match="sphere: found type float, expected a Material"):
        cr.Material.pair(210e9, STEEL)  # type: ignore[arg-type]
