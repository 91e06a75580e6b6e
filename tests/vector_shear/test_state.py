"""Vector friction: states without Poisson's ratio, near gross sliding and at it."""

import numpy as np
import pytest
from friction_scenes import FRICTION, VECTOR_FRACTIONS, VECTOR_NAMES, found, lengths, pressed
from numpy.testing import assert_allclose

import convexrough as cr
from convexrough import shear_vector
from convexrough.sphere import mindlin


@pytest.mark.sample(3)
@pytest.mark.parametrize("fraction", [*VECTOR_FRACTIONS, 0.9999, 1 - 1e-9, 1.0])
@pytest.mark.parametrize("name", VECTOR_NAMES)
def test_without_poissons_ratio_it_is_ciavarella_and_jaeger(name: str, fraction: float) -> None:
    contact = pressed(name, nu=0.0)
    force = fraction * FRICTION * contact.load
    state, scalar = shear_vector(contact, force=force), cr.shear(contact, force=force)
    assert_allclose(state.forces[:, 0], scalar.forces, rtol=1e-10)
    assert (state.forces[:, 1] == 0).all()
    assert state.disagreement < 1e-10
    assert_allclose(state.displacement, [scalar.displacement, 0.0], rtol=1e-10)
    atol = 1e-10 * scalar.displacement
    assert_allclose(state.slips[:, 0], scalar.slips, rtol=1e-9, atol=atol)
    assert_allclose(state.stick_radii, scalar.stick_radii, rtol=1e-6)
    assert set(state.status[contact.loads == 0]) == {"open"}


@pytest.mark.sample(2)
@pytest.mark.parametrize(
    ("nu", "fraction", "forces", "transverse", "travel", "sliding"),
    [
        (0.3, 0.5, 0.0272, 0.0128, 1.21373, 6),
        (0.3, 0.8, 0.0228, 0.0169, 1.21375, 18),
        (0.5, 0.5, 0.0526, 0.0245, 1.49751, 6),
        (0.5, 0.8, 0.0441, 0.0323, 1.49760, 18),
    ],
)
def test_the_error_of_the_papers_assumption(
    nu: float, fraction: float, forces: float, transverse: float, travel: float, sliding: int
) -> None:
    """The numbers of docs/theory/vector-friction.md, for the paper's scene."""
    contact, state = pressed("paper", nu=nu), found("paper", nu, fraction)
    assert state.disagreement == pytest.approx(forces, abs=6e-5)
    largest = FRICTION * contact.loads.max()
    assert np.abs(state.forces[:, 1]).max() / largest == pytest.approx(transverse, rel=0.02)
    reference = cr.shear(pressed("paper", nu=0.0), force=fraction * FRICTION * contact.load)
    assert state.displacement[0] / reference.displacement == pytest.approx(travel, abs=6e-6)
    assert abs(state.displacement[0] / reference.displacement - mindlin.ratio(nu)) < 3e-3
    assert (state.status == "sliding").sum() == sliding
    assert state.certificate.all_proved
    assert state.iterations <= 6
    scalar = cr.shear(contact, force=state.force[0]).forces
    off = np.linalg.norm(state.forces - np.outer(scalar, [1, 0])) / np.linalg.norm(scalar)
    assert state.disagreement == pytest.approx(off, rel=1e-9)


@pytest.mark.sample(2)
@pytest.mark.parametrize("nu", [0.3, 0.5])
@pytest.mark.parametrize("fraction", [0.99, 0.999, 0.9999, 1 - 1e-6, 1 - 1e-9, 1 - 1e-12])
def test_close_to_gross_sliding(fraction: float, nu: float) -> None:
    """All slide before Q = f P: then forces only turn, and the displacement grows as 1 / root."""
    state = found("paper", nu, fraction)
    assert state.residual < 1e-10
    if fraction >= 0.9999:
        assert (lengths(state.slips) > 0).sum() == 37
        assert not (state.status == "partial").any()
        assert (state.status == "sliding").sum() >= 30
    if fraction == 1 - 1e-9:
        farther = found("paper", nu, 1 - 1e-11)
        ratio = farther.displacement[0] / state.displacement[0]
        assert ratio == pytest.approx(10.0, rel=1e-2)


def test_gross_sliding() -> None:
    """At f P itself only a displacement without bounds would turn all forces along Q."""
    contact = pressed("paper")
    state = found("paper", 0.3, 1.0)
    assert_allclose(state.forces[:, 0], FRICTION * contact.loads, rtol=1e-14)
    assert (state.forces[:, 1] == 0).all()
    assert state.displacement[0] == np.inf
    assert state.displacement[1] == 0
    assert state.residual == state.duality_gap == np.inf
    assert (state.status[contact.loads > 0] == "sliding").all()
    assert state.certificate.all_proved
    finite = found("paper", 0.0, 1.0)
    scalar = cr.shear(pressed("paper", nu=0.0), force=finite.force[0])
    assert_allclose(finite.displacement[0], scalar.displacement, rtol=1e-13)
    assert_allclose(finite.slips[:, 0], scalar.slips, atol=1e-13 * scalar.displacement)
    assert finite.residual < 1e-13
