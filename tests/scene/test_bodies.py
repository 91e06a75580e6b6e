"""Two bodies that differ: sums over both, the equal case bit for bit."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scenes import paper

import convexrough as cr
from convexrough.sphere import mindlin
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
