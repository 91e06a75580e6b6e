"""Shear forces from anywhere: no wrong ones get a wrong status or bound."""

from typing import Any

import numpy as np
import pytest
from attacks import ATTACKS, attack
from friction_scenes import FRACTIONS, FRICTION, KINDS, NAMES, in_doubt, pressed, with_friction
from hypothesis import given, settings
from hypothesis import strategies as st
from levels_reference import reference as exact
from multiprecision import off
from scenes import paper, twins

import convexrough as cr


def spoiled(contact: cr.Contact, force: float, kind: str, seed: int) -> Any:
    """Forces with something wrong; "full" are the largest that friction bears."""
    if kind == "full":
        return FRICTION * contact.loads
    rng = np.random.default_rng(seed)
    return rng.choice([1, 1, -1]) * attack(kind, cr.shear(contact, force=force).forces, rng)


def assert_covers(judged: cr.ShearCertificate, forces: Any, name: str, fraction: float) -> None:
    """No bound is too small and no status is wrong, by 80 digits."""
    truth = exact(name, fraction)
    assert (off(forces, truth.forces) <= judged.force_errors).all()
    assert (judged.status != np.where(truth.slips > 0, "partial", "sliding")).all()
    assert not (truth.loads > 0)[judged.status == "open"].any()


@settings(max_examples=10, deadline=None)
@given(
    st.sampled_from(NAMES),
    st.sampled_from(FRACTIONS),
    st.sampled_from([*ATTACKS, "full"]),
    st.integers(0, 2**32 - 1),
    st.sampled_from(KINDS),
)
def test_attacks(name: str, fraction: float, kind: str, seed: int, influence: Any) -> None:
    contact = pressed(name, influence)
    force = fraction * FRICTION * contact.load
    forces = spoiled(contact, force, kind, seed)
    assert_covers(cr.certify_shear(contact, forces, force=force), forces, name, fraction)


@pytest.mark.sample(3)
@pytest.mark.parametrize("digits", [3, 5, 8])
@pytest.mark.parametrize("fraction", [0.1, 0.37, 0.999])
@pytest.mark.parametrize("kind", ["rounded", "perturbed", "dropped", "full"])
def test_doubt_about_the_loads_is_counted(kind: str, fraction: float, digits: int) -> None:
    contact = pressed("paper")
    force = fraction * FRICTION * contact.load
    forces = spoiled(contact, force, kind, digits)
    judged = cr.certify_shear(in_doubt(contact, digits), forces, force=force)
    assert_covers(judged, forces, "paper", fraction)


def test_where_nothing_touches() -> None:
    apart = cr.press(with_friction(paper()), approach=-1e-6)
    judged = cr.certify_shear(apart, np.full(61, 1e-9), force=0.0)
    np.testing.assert_allclose(judged.force_errors, np.full(61, 1e-9), rtol=1e-11)
    assert (judged.status == "open").all()


def test_an_uncertified_contact_gets_no_status() -> None:
    scene, load = twins()
    contact = cr.press(scene, load=load)
    assert contact.certificate.scope == "none"
    limit = FRICTION * contact.load
    force = 0.1 * limit
    state, cycle = cr.shear(contact, force=force), cr.cycle(contact, maximum=force)
    vectors = [cr.shear_vector(contact, force=each).certificate for each in (force, limit)]
    judged = cr.certify_shear(contact, 0.1 * contact.loads, force=force)
    for known in (state.certificate, judged, *vectors):
        assert known.scope == "none"
        assert not known.all_proved
        assert (known.status == "undecided").all()
    assert np.isinf(state.certificate.force_errors).all()
    assert np.isinf([cycle.loss_error, state.certificate.displacement_error]).all()
    assert state.forces.sum() == pytest.approx(force, rel=1e-12)
    assert cycle.loss > 0
