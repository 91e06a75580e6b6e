"""Many scenes at once against the same ones one by one: status by status, digit by digit."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from scenes import NAMED, on_sphere

import convexrough as cr
from convexrough import rows

F = 0.5
PAPER = replace(NAMED["paper"][0], friction=F)


def rough(count: int, *, tips: float = 0.0, geometry: Any = "summit") -> list[cr.Scene]:
    flat, spread = PAPER.asperities, {"height_std": 1e-6, "tip_radius_cv": tips}
    sampled = [flat.roughened(**spread, seed=k) for k in range(count)]
    return [replace(PAPER, asperities=each, geometry=geometry) for each in sampled]


def scattered(count: int) -> list[cr.Scene]:
    rng, grid = np.random.default_rng(5), 0.0026 * (np.indices((9, 9)).reshape(2, -1).T - 4)
    places = [grid + rng.uniform(-2e-4, 2e-4, grid.shape) for _ in range(count)]
    return [on_sphere(each, friction=F) for each in places]


BASES: list[Any] = [1.0, 2.0, (1.0, 1.5)]

#: What differs from scene to scene -> (scenes, approaches).
SETS = {
    "heights": (rough(6), 5e-5),
    "approaches": (rough(4), [5e-5, 1e-5, 2e-6, 7e-5]),
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
    assert len(contacts.alone) == 0
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
    limits = F * lifted.loads
    ends = lifted.cycles(limits * np.array([0.0, 1.0, 0.0]))  # nothing, gross sliding, no range
    for k in range(3):
        assert ends.losses[k] == ends[k].loss
        assert_array_equal(ends.status[k], ends[k].status)
    monkeypatch.setattr(rows, "MOST", 60)
    assert cr.press_many(scenes, approach=5e-5).alone.tolist() == [0, 1, 2]


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
