"""Ways along a load path: the memory curve, the general step, and the step as a cone program."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from levels_reference import Bristles
from numpy.testing import assert_allclose
from path_scenes import ONE, TWO, path_of, shaded
from scenes import random_scenes

import convexrough as cr
from convexrough.arrays import Array


def differs(path: cr.LoadPath, known: cr.LoadPath) -> float:
    """The largest difference of shear forces and displacements, relative to their largest."""
    forces = np.abs(path.asperity_forces - known.asperity_forces).max()
    found = float(forces / (0.5 * known.asperity_loads.max()))
    for name in ("displacements", "asperity_displacements", "drifts"):
        moved = np.abs(getattr(path, name) - getattr(known, name)).max()
        found = max(found, float(moved / np.abs(known.displacements).max()))
    return found


@st.composite
def random_paths(draw: st.DrawFn, least: float, share: float) -> tuple[cr.Scene, Array, Array]:
    """A scene, loads from this part of the largest, and forces up to this share of f P."""
    scene, approach = draw(random_scenes(crowding=0.7, most=10))
    largest = cr.press(scene, approach=approach).load
    assume(largest > 0)
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    P = rng.uniform(least, 1.0, 5) * largest
    return replace(scene, friction=0.5), P, 0.5 * P * rng.uniform(-share, share, 5)


@settings(max_examples=5, deadline=None)
@given(random_paths(0.1, 0.95), st.booleans())
def test_random_paths(sampled: tuple[cr.Scene, Array, Array], ties: bool) -> None:
    """With ties: either comes back or does not change, and on one step neither does."""
    scene, P, Q = sampled
    if ties:
        P, Q = P[[0, 0, 1, 1, 2, 0]], Q[[0, 1, 1, 1, 2, 0]] * (P.min() / P.max())
    path = cr.load_path(scene, loads=P, forces=Q)
    assume(path.order != "fails")
    assert differs(cr.load_path(scene, loads=P, forces=Q, general_steps=1), path) <= 1e-12


def test_where_order_fails() -> None:
    """The memory curve is not used, and the steps converge to the bristles."""
    contact = cr.press(shaded(), approach=1.4)
    P = np.array([0.8, 0.8, 1.0]) * contact.load
    Q = 0.5 * np.array([0.0, 0.3, 0.6]) * contact.load
    path = cr.load_path(contact.scene, loads=P, forces=Q)
    assert path.order == "fails"
    assert np.isinf(path.displacement_errors).all()
    assert set(path.status.ravel()) == {"undecided"}
    fine = cr.load_path(contact.scene, loads=P, forces=Q, general_steps=32)
    X = np.abs(path.displacements).max()
    cycle = cr.cycle(contact, displacement=X / 2)
    assert (cycle.order, cycle.displacement_error) == ("fails", np.inf)
    assert cycle.displacement_amplitude == pytest.approx(X / 2, rel=1e-4)
    assert_allclose(path.displacements, fine.displacements, atol=2e-3 * X)
    bristles = Bristles(contact, count=260, reach=1.3)
    for k in (1, 2):
        (P_k, Q_k) = (np.linspace(each[k - 1], each[k], 41)[1:] for each in (P, Q))
        bristles.to(Q_k, P_k)
        assert bristles.displacement == pytest.approx(fine.displacements[k], abs=5e-3 * X)
        assert_allclose(bristles.forces, fine.asperity_forces[k], atol=5e-3 * Q.max())


@pytest.mark.parametrize("given", [{"load": 2.8}, {"approach": 1.25}, {"approach": 0.5}])
def test_a_displacement_at_gross_sliding_or_just_below(given: dict[str, float]) -> None:
    """Order fails but for the last contact. The shear force is f P up to rounding."""
    contact = cr.press(shaded(), **given)
    gross = cr.shear(contact, force=0.5 * contact.load)
    assert gross.order == ("proved" if contact.load < 2 else "fails")
    for part in (1.0, 1.0 - 1e-14, 1.0 - 1e-12):
        state = cr.shear(contact, displacement=-part * gross.displacement)
        assert state.displacement == pytest.approx(-part * gross.displacement, rel=1e-14)
        assert state.force == pytest.approx(-gross.force, rel=1e-15)
        assert_allclose(state.forces, -gross.forces, rtol=1e-9)
    with pytest.raises(cr.InputError, match="gross sliding, expected at most X"):
        cr.shear(contact, displacement=1.001 * gross.displacement)


@pytest.mark.sample(1)
@pytest.mark.parametrize("points", [ONE, TWO])
def test_three_ways_to_one_path(points: list[tuple[float, float]]) -> None:
    scene, P, Q = path_of("paper", points)
    curve, step, conic = three_ways(scene, P, Q)
    assert curve.order == "proved"
    assert differs(step, curve) <= 1e-12
    assert 0 < differs(conic, curve) <= 1e-5


@settings(max_examples=4, deadline=None)
@given(random_paths(0.2, 0.9))
def test_random_paths_as_cone_programs(sampled: tuple[cr.Scene, Array, Array]) -> None:
    try:
        _, step, conic = three_ways(*sampled)
    except cr.SolverError as error:
        if "dense" not in str(error):
            raise
        return
    assert differs(conic, step) < 1e-4


def test_without_order_steps_as_cone_programs_agree() -> None:
    scene = shaded()
    largest = cr.press(scene, approach=1.0).load
    P, Q = np.array([0.8, 1.0]) * largest, 0.5 * np.array([0.2, 0.5]) * largest
    curve, step, conic = three_ways(scene, P, Q)
    assert curve.order == "fails"
    assert differs(conic, step) < 1e-4


def three_ways(scene: cr.Scene, P: Array, Q: Array) -> tuple[cr.LoadPath, ...]:
    """By the memory curve, a general step for each segment, and this step as a cone program."""
    ways: list[Any] = [{}, {"general_steps": 1}, {"general_steps": 1, "solver": "conic"}]
    return tuple(cr.load_path(scene, loads=P, forces=Q, **way) for way in ways)
