"""Fretting: tractions against the field, slip against the energy that it costs."""

import numpy as np
import pytest
from friction_scenes import pressed
from numpy.testing import assert_array_equal

import convexrough as cr
from convexrough import fields
from convexrough.friction.fretting import rim_gap
from convexrough.sphere import mindlin


def worn(high: float, low: float) -> tuple[cr.Cycle, cr.Fretting]:
    contact = pressed("rough")
    limit = 0.5 * contact.load
    cycle = cr.cycle(contact, maximum=high * limit, minimum=low * limit)
    return cycle, cr.fretting(cycle)


@pytest.mark.sample(2)
@pytest.mark.parametrize(("high", "low"), [(0.3, -0.3), (0.6, -0.6), (0.2, -0.7), (0.8, 0.1)])
def test_tractions_are_those_of_the_field(high: float, low: float) -> None:
    _, found = worn(high, low)
    contact = found.contact
    state = cr.shear(contact, force=max(high, low, key=abs) * 0.5 * contact.load)
    for i in np.flatnonzero(contact.loads)[::6]:
        a = contact.contact_radii[i]
        r = np.sort(np.append(np.linspace(0.0, a, 20_001), state.stick_radii[i]))
        points = contact.scene.contact_points[i] + np.column_stack((r, 0.0 * r))
        q = np.abs(fields.traction(state, points))
        assert found.largest_tractions[i] == pytest.approx(q.max(), rel=1e-7)
        if 0 < state.stick_radii[i] < a:
            assert r[q.argmax()] == pytest.approx(state.stick_radii[i], rel=1e-3)
        mean = np.trapezoid(q * 2 * r, r) / a**2
        assert found.mean_tractions[i] == pytest.approx(mean, rel=1e-5)


def test_progress_on_a_long_path_is_told(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level("INFO", logger="convexrough")
    P = pressed("paper").load
    ellipse = {"load": P, "load_amplitude": 0.4 * P, "force_amplitude": 0.2 * P, "friction": 0.5}
    loads, forces = cr.elliptic_path(**ellipse, chords=24)
    cr.fretting(cr.steady(pressed("paper").scene, loads=loads, forces=forces))
    assert any(said.startswith("normal problems 1 to ") for said in caplog.messages)
    assert f"tractions at point {len(loads)} of {len(loads)}" in caplog.messages


@pytest.mark.sample(2)
@pytest.mark.parametrize(("high", "low"), [(0.3, -0.3), (0.6, -0.6), (0.8, 0.1)])
def test_slip_against_friction_costs_the_energy(high: float, low: float) -> None:
    """Each asperity loses 4 times the integral of f p times the amplitude of slip."""
    cycle, found = worn(high, low)
    scene, f = cycle.scene, 0.5
    c_t = float(mindlin.ratio(scene.material.poisson_ratio))
    for i in np.flatnonzero(cycle.contact.loads)[::6]:
        a, c, R = cycle.contact.contact_radii[i], cycle.stick_radii[i], scene.relative_radii[i]
        s = 1.0 - np.linspace(0.0, np.sqrt(1.0 - c / a), 4001) ** 2  # r / a, close at the rim
        slip = f * c_t * (a * s) ** 2 / R * rim_gap(np.minimum(c / (a * np.maximum(s, 1e-9)), 1.0))
        slip += found.gross_slip_amplitudes[i]
        p = fields.peak_pressures(cycle.contact)[i] * np.sqrt(1.0 - s**2)
        lost = -4.0 * np.trapezoid(f * p * slip * 2.0 * np.pi * a**2 * s, s)
        assert cycle.asperity_losses[i] == pytest.approx(lost, rel=1e-4)
        assert found.slip_amplitudes[i] == pytest.approx(slip[0], rel=1e-12)
    assert_array_equal(found.losses, cycle.asperity_losses)
