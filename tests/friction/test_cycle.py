"""Cycles, histories, fretting: memory, energies counted in independent ways, many at once."""

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from friction_scenes import FRICTION, KINDS, PAPER, pressed
from hypothesis import given, settings
from hypothesis import strategies as st
from levels_reference import Bristles
from numpy.testing import assert_allclose, assert_array_equal
from scenes import NAMED, complementary_energy, on_sphere

import convexrough as cr
from convexrough import fields, rows
from convexrough.friction.fretting import rim_gap
from convexrough.sphere import mindlin


def limit_of(contact: cr.Contact) -> float:
    return FRICTION * contact.load


def test_reference_losses_of_the_papers_example() -> None:
    contact = pressed("paper")
    limit = limit_of(contact)
    half = cr.cycle(contact, maximum=0.5 * limit)
    assert half.loss_normalised == pytest.approx(0.00621, abs=5e-6)
    assert half.smooth_normalised == pytest.approx(0.00587, abs=5e-6)
    assert (half.status == "sliding").sum() == 6
    tiny = cr.cycle(contact, maximum=1e-6 * limit)
    assert tiny.loss_normalised == pytest.approx(2.0110718711e-20, rel=1e-10)
    below, above = cr.cycles(contact, np.array([0.387, 0.389]) * limit)
    assert below.loss_normalised < below.smooth_normalised
    assert above.loss_normalised > above.smooth_normalised


@pytest.mark.parametrize("name", NAMED)
def test_three_ways_to_the_energy(name: str) -> None:
    """Asperity by asperity; the trapezoid error of the indentation curve; the area of the loop."""
    contact = pressed(name)
    scene, limit = contact.scene, limit_of(contact)
    ratio = mindlin.ratio(scene.material.poisson_ratio)
    for fraction in (0.2, 0.5, 0.9):
        cycle = cr.cycle(contact, maximum=fraction * limit)
        assert cycle.balance_defect < 1e-12
        assert cycle.asperity_losses.sum() == pytest.approx(cycle.loss, rel=1e-14)
        # The closed form: two normal solutions, their optimal values V and multipliers D0.
        reduced = cr.press(scene, load=(1 - fraction) * contact.load)
        middle = (contact.load - reduced.load) * (contact.approach + reduced.approach) / 2
        error = complementary_energy(contact) - complementary_energy(reduced) - middle
        closed = 8 * ratio * FRICTION**2 * error
        assert cycle.loss == pytest.approx(closed, rel=1e-13 / fraction**3)
        # The polygon through the loop's points converges on it from inside, at second order.
        errors = np.array([1 - cycle.loop(n).area / cycle.loss for n in (40, 80, 160)])
        assert 0 < errors[0] < 0.05
        assert errors[1:] / errors[:-1] == pytest.approx(0.25, abs=0.03)


@settings(max_examples=12, deadline=None)
@given(st.lists(st.floats(-0.95, 0.95), min_size=1, max_size=25))
def test_histories_against_springs_with_sliders(fractions: list[float]) -> None:
    """Bristles in steps, which remember by construction, and what they lose in slip."""
    contact = pressed("paper")
    forces = [fraction * limit_of(contact) for fraction in fractions]
    past, state, true = cr.history(contact, forces=forces), Bristles(contact, 300), []
    for before, after in pairwise([0.0, *forces]):
        state.to(np.linspace(before, after, 11)[1:])
        true.append((state.displacement, state.lost))
    most = cr.cycle(contact, maximum=0.95 * limit_of(contact))
    moved, lost = np.abs(np.column_stack((past.displacements, past.losses)) - true).T
    assert (moved <= 1e-4 * most.displacement_amplitude).all()
    assert (lost <= 1e-4 * np.maximum(most.loss, past.losses)).all()


@settings(max_examples=8, deadline=None)
@given(st.lists(st.floats(-0.5, 0.5), min_size=0, max_size=12))
def test_return_point_memory_and_wiping_out(inner: list[float]) -> None:
    """Whatever happens inside +-0.5, coming back to a turning point beyond restores the state."""
    contact = pressed("paper", "lattice" if len(inner) % 2 else "dense")
    limit = limit_of(contact)
    before = cr.history(contact, forces=np.array([0.6, -0.6, 0.6]) * limit)
    path = np.array([0.6, -0.6, *inner, 0.6, 0.8]) * limit
    after = cr.history(contact, forces=path)
    assert_allclose(after.asperity_forces[-2], before.asperity_forces[-1], atol=1e-12 * limit)
    assert after.displacements[-2] == pytest.approx(before.displacements[-1], rel=1e-11)
    fresh = cr.shear(contact, force=0.8 * limit)
    assert_allclose(after.asperity_forces[-1], fresh.forces, atol=1e-12 * limit)
    assert after.displacements[-1] == pytest.approx(fresh.displacement, rel=1e-12)


@pytest.mark.parametrize("influence", KINDS)
@pytest.mark.parametrize(("high", "low"), [(0.6, -0.6), (0.6, 0.2), (0.2, -0.8), (-0.3, -0.3)])
def test_loops_are_the_history_that_they_stand_for(influence: str, high: float, low: float) -> None:
    contact, chosen = pressed("rough", influence), [40, 3, 90]
    limit = limit_of(contact)
    cycle = cr.cycle(contact, maximum=high * limit, minimum=low * limit)
    loop = cycle.loop(24, asperities=chosen)
    first = [cycle.minimum] if abs(low) > abs(high) else []
    past = cr.history(contact, forces=np.concatenate((first, loop.forces)))
    body = slice(len(first), None)
    scale = np.abs(loop.displacements).max()
    assert_allclose(loop.displacements, past.displacements[body], atol=1e-11 * scale)
    assert_allclose(loop.asperity_forces, past.asperity_forces[body][:, chosen], atol=1e-11 * limit)
    loaded = contact.loads[chosen] > 0
    theirs = np.where(loaded, past.asperity_displacements[body][:, chosen], 0.0)
    assert_allclose(loop.asperity_displacements, theirs, atol=1e-11 * scale)
    assert loop.asperities.tolist() == chosen
    if high > low:
        force, moved = (np.ptp(values) / 2 for values in (loop.forces, loop.displacements))
        assert cycle.secant_stiffness == pytest.approx(force / moved, rel=1e-12)
        # The energy over 2 pi times that of the triangle under the tip of the loop.
        assert cycle.loss_factor == pytest.approx(cycle.loss / (np.pi * force * moved), rel=1e-12)


def test_a_loop_remembers_how_the_cycle_began() -> None:
    """Pressed and sheared at once, forces differ below L* from those of a pressed contact."""
    contact = pressed("paper")
    scene, P = contact.scene, contact.load
    forces = FRICTION * P * np.array([0.4, 0.1])
    cycles = [cr.steady(scene, loads=[load] * 2, forces=forces) for load in (P, 0.7 * P)]
    for cycle, loop in zip(cycles, cr.loops(cycles, points=4), strict=True):
        path = cr.load_path(scene, loads=[cycle.contact.load] * 5, forces=forces[[0, 1, 0, 1, 0]])
        touching = path.asperity_loads[-1] > 0
        assert_allclose(loop.asperity_forces[0], path.asperity_forces[-1], rtol=1e-13, atol=1e-30)
        assert loop.displacements[0] == pytest.approx(path.displacements[-1], rel=1e-13)
        own = path.asperity_displacements[-1][touching]
        assert_allclose(loop.asperity_displacements[0][touching], own, rtol=1e-12)
    turn = 2 * np.pi * np.arange(60) / 60
    round_trip = cr.steady(scene, loads=[P] * 60, forces=0.2 * P * np.cos(turn))
    assert 200 < len(round_trip.loop(200).forces) < 200 + 60  # not 200 behind each point
    with pytest.raises(cr.InputError, match=r"cycles\[1\]: found type int"):
        cr.loops([cycles[0], 3])  # type: ignore[list-item]


def test_amplitudes_of_forces_that_differ_by_a_last_bit() -> None:
    contact = pressed("paper")
    limit = limit_of(contact)
    stiffness = cr.cycle(contact, maximum=1e-6 * limit).secant_stiffness
    for q in (limit * np.linspace(0.2, 0.4, 30)).tolist():
        cycle = cr.cycle(contact, maximum=q, minimum=np.nextafter(q, 0.0))
        assert cycle.secant_stiffness == pytest.approx(stiffness, rel=1e-3)
        forces = [q, -0.5 * q, q, np.nextafter(-0.5 * q, -1.0)]
        many, two = (
            cr.steady(contact.scene, loads=[contact.load] * len(each), forces=each)
            for each in (forces, forces[2:])
        )
        apart = abs(many.displacement_amplitude - two.displacement_amplitude)
        assert apart <= many.displacement_error + two.displacement_error


@pytest.mark.parametrize(("high", "low"), [(0.3, -0.3), (0.6, -0.6), (0.2, -0.7), (0.8, 0.1)])
def test_tractions_are_those_of_the_field_and_slip_costs_the_energy(
    high: float, low: float
) -> None:
    """Each asperity loses 4 times the integral of f p times the amplitude of slip."""
    contact, f = pressed("rough"), FRICTION
    limit, scene = limit_of(contact), contact.scene
    cycle = cr.cycle(contact, maximum=high * limit, minimum=low * limit)
    found, c_t = cr.fretting(cycle), float(mindlin.ratio(scene.material.poisson_ratio))
    state = cr.shear(contact, force=max(high, low, key=abs) * limit)
    for i in np.flatnonzero(contact.loads)[::6]:
        a, c, R = contact.contact_radii[i], cycle.stick_radii[i], scene.relative_radii[i]
        r = np.sort(np.append(np.linspace(0.0, a, 20_001), state.stick_radii[i]))
        points = scene.contact_points[i] + np.column_stack((r, 0.0 * r))
        q = np.abs(fields.traction(state, points))
        assert found.largest_tractions[i] == pytest.approx(q.max(), rel=1e-7)
        if 0 < state.stick_radii[i] < a:
            assert r[q.argmax()] == pytest.approx(state.stick_radii[i], rel=1e-3)
        mean = np.trapezoid(q * 2 * r, r) / a**2
        assert found.mean_tractions[i] == pytest.approx(mean, rel=1e-5)
        s = 1.0 - np.linspace(0.0, np.sqrt(1.0 - c / a), 4001) ** 2  # r / a, close at the rim
        slip = f * c_t * (a * s) ** 2 / R * rim_gap(np.minimum(c / (a * np.maximum(s, 1e-9)), 1.0))
        slip += found.gross_slip_amplitudes[i]
        p = fields.peak_pressures(contact)[i] * np.sqrt(1.0 - s**2)
        lost = -4.0 * np.trapezoid(f * p * slip * 2.0 * np.pi * a**2 * s, s)
        assert cycle.asperity_losses[i] == pytest.approx(lost, rel=1e-4)
        assert found.slip_amplitudes[i] == pytest.approx(slip[0], rel=1e-12)
    assert_array_equal(found.losses, cycle.asperity_losses)


def test_progress_on_a_long_path_is_told(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level("INFO", logger="convexrough")
    P = pressed("paper").load
    ellipse = {"load": P, "load_amplitude": 0.4 * P, "force_amplitude": 0.2 * P, "friction": 0.5}
    loads, forces = cr.elliptic_path(**ellipse, chords=24)
    cr.fretting(cr.steady(pressed("paper").scene, loads=loads, forces=forces))
    assert any(said.startswith("normal problems 1 to ") for said in caplog.messages)
    assert f"tractions at point {len(loads)} of {len(loads)}" in caplog.messages


def rough(count: int, *, tips: float = 0.0, geometry: Any = "summit") -> list[cr.Scene]:
    flat, spread = PAPER.asperities, {"height_std": 1e-6, "tip_radius_cv": tips}
    sampled = [flat.roughened(**spread, seed=k) for k in range(count)]
    return [replace(PAPER, asperities=each, geometry=geometry) for each in sampled]


def scattered(count: int) -> list[cr.Scene]:
    rng, grid = np.random.default_rng(5), 0.0026 * (np.indices((9, 9)).reshape(2, -1).T - 4)
    places = [grid + rng.uniform(-2e-4, 2e-4, grid.shape) for _ in range(count)]
    return [on_sphere(each, friction=FRICTION) for each in places]


BASES: list[Any] = [1.0, 2.0, (1.0, 1.5)]

#: What differs from scene to scene -> (scenes, approaches).
SETS = {
    "heights and approaches": (rough(4), [5e-5, 1e-5, 2e-6, 7e-5]),
    "tips": (rough(4, tips=0.1), 5e-5),
    "places by tips": (rough(3, tips=0.1, geometry="closest"), 5e-5),
    "places": (scattered(4), 5e-5),
    "bases": ([replace(rough(3)[k], sphere_radius=R) for k, R in enumerate(BASES)], 5e-5),
    "frictions": ([replace(each, friction=0.1 * k + 0.2) for k, each in enumerate(rough(3))], 5e-5),
    "one": (rough(1), 5e-5),
}


def assert_same(contacts: cr.Contacts, k: int, one: cr.Contact) -> None:
    """Words and digits; and bounds that are as good, each as it is said of one contact."""
    assert_array_equal(contacts.status[k], one.status)
    assert_array_equal(contacts.asperity_loads[k], one.loads)
    proof, ulp = one.certificate, 2.0**-53
    assert contacts.approaches[k] == one.approach
    assert contacts.loads[k] == one.load
    assert (contacts.asperity_load_errors[k] <= 2 * proof.load_errors + 1e-28 * one.load).all()
    assert contacts.approach_errors[k] <= 2 * proof.approach_error + ulp * abs(one.approach)
    assert contacts.load_errors[k] <= 1.1 * proof.load_errors.sum() + 8 * ulp * one.load + 1e-300


@pytest.mark.sample(2)
@pytest.mark.parametrize("by_load", [False, True])
@pytest.mark.parametrize("name", SETS)
def test_scenes_together_are_those_alone(name: str, by_load: bool) -> None:
    scenes, approaches = SETS[name]
    apart = np.broadcast_to(approaches, len(scenes))
    alone = [cr.press(each, approach=a) for each, a in zip(scenes, apart, strict=True)]
    if by_load:
        alone = [cr.press(each.scene, load=each.load) for each in alone]
        contacts = cr.press_many(scenes, load=[each.prescribed_load for each in alone])
    else:
        contacts = cr.press_many(scenes, approach=approaches)
    assert sum(len(each.places) for each in contacts._together) == len(scenes)
    limits = np.array([each.scene.friction * each.load for each in alone])
    for share in (1e-3, 0.37, 0.999):
        cycles = contacts.cycles(share * limits, -0.4 * share * limits)
        for k, one in enumerate(alone):
            assert_same(contacts, k, one)
            cycle = cr.cycle(one, maximum=share * limits[k], minimum=-0.4 * share * limits[k])
            assert cycles.order[k] == cycle.order == "proved"
            assert_array_equal(cycles.status[k], cycle.status)
            assert cycles.losses[k] == cycle.loss
            assert cycles.loss_errors[k] <= 2 * cycle.loss_error
            assert cycles.displacement_amplitudes[k] == cycle.displacement_amplitude
            assert cycles.displacement_errors[k] <= 2 * cycle.displacement_error


def test_what_rows_do_not_prove_is_done_one_by_one(monkeypatch: pytest.MonkeyPatch) -> None:
    scenes = rough(3)
    lifted = cr.press_many(scenes, approach=[-1.0, 5e-5, 5e-5])
    assert_same(lifted, 0, cr.press(scenes[0], approach=-1.0))
    limits = FRICTION * lifted.loads
    ends = lifted.cycles(limits * np.array([0.0, 1.0, 0.0]))  # nothing, gross sliding, no range
    for k in range(3):
        assert ends.losses[k] == ends[k].loss
        assert_array_equal(ends.status[k], ends[k].status)
    monkeypatch.setattr(rows, "MOST", 60)
    assert cr.press_many(scenes, approach=5e-5)._together == []


def test_one_force_at_the_limit_counts_as_the_limit() -> None:
    scene = replace(PAPER, friction=0.3)
    load, limit = 3.5e-7, 0.3 * 3.5e-7
    contacts, alone = cr.press_many([scene, scene], load=load), cr.press(scene, load=load)
    for low in (limit * np.linspace(-0.9, 0.3, 20)).tolist():
        many, one = contacts.cycles(limit, low), cr.cycle(alone, maximum=limit, minimum=low)
        assert abs(many.losses[0] - one.loss) <= many.loss_errors[0] + one.loss_error


def test_warnings_of_many() -> None:
    soft = replace(PAPER.material, hardness=1e-4)
    scenes = [*rough(2), *(replace(each, material=soft) for each in rough(2))]
    contacts = cr.press_many(scenes, approach=5e-5)
    (yielding,), (one,) = contacts.warnings, contacts[2].warnings
    assert yielding == f"scenes[2], the first of 2: {one}"
    assert contacts.cycles(1e-9).warnings == contacts.warnings
    assert repr(contacts).count("warning") == 1
    assert "warning" not in repr(cr.press_many(scenes[2:] * 51, approach=5e-5))


def test_more_problems_than_a_chunk_of_numbers() -> None:
    """Two asperities each, so that one stack has more than 2^14 rows."""
    scene = on_sphere([[0.0, 0.0], [2.5e-3, 0.0]])
    loads = np.linspace(1e-8, 3e-7, 2**14 + 16)
    found = cr.press_many([scene] * len(loads), load=loads)
    np.testing.assert_allclose(found.asperity_loads.sum(axis=1), loads, rtol=1e-12)


def test_a_loop_within_the_loop() -> None:
    """Slip, loss and derivatives are those of the whole path, not of its outer loop."""
    scene, P = on_sphere([[0, 0], [1, 0]], 1.0, [0, -0.002], np.inf, FRICTION), 1e-3
    forces = FRICTION * P * np.array([0.95, -0.95, 0.94, -0.94])

    def settled(scene: cr.Scene) -> cr.Cycle:
        return cr.steady(scene, loads=[P] * 4, forces=forces)

    cycle = settled(scene)
    past = cr.history(cr.press(scene, load=P), forces=np.tile(forces, 3))
    slips = past.slips[3:8, 1]
    forward, span = np.maximum(np.diff(slips), 0.0).sum(), np.ptp(slips)
    assert [*cycle.status] == ["partial", "sliding"]
    assert cycle.slips[1] == pytest.approx(forward, rel=1e-13)
    assert 2 * cr.fretting(cycle).gross_slip_amplitudes[1] == pytest.approx(span, rel=1e-13)
    assert np.isnan([cycle.smooth_normalised, cycle.balance_defect]).all()
    assert 0 < 1 - cycle.loop(400).area / cycle.loss < 1e-4
    gradient = cycle.gradient()
    assert gradient.value == pytest.approx(cycle.loss, rel=1e-15)
    less, more = (settled(replace(scene, friction=FRICTION * s)).loss for s in (1 - 1e-6, 1 + 1e-6))
    assert gradient.friction == pytest.approx((more - less) / (2e-6 * FRICTION), rel=1e-8)
