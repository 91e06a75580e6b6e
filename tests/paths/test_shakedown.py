"""Limits of shakedown: values of the prototypes, and histories a little below and above each."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from path_scenes import LARGEST, PAPER, ROUGH

import convexrough as cr
from convexrough.arrays import Array

P, RADIUS = LARGEST["paper"], 0.5 * LARGEST["paper"]
SWING = RADIUS * np.array([1.0, -1.0])

#: An asperity of the rings B and A: the last but one and the last to touch.
B, A = 19, 31


def turned(angle: float) -> tuple[Array, Array]:
    """The amplitudes of an ellipse: 0.1 and 0.2 of the mean load, which is 0.9 of the largest."""
    return cr.elliptic_path(
        load=0.0,
        load_amplitude=0.09 * P,
        force_amplitude=0.5 * 0.18 * P,
        phase=np.radians(angle),
        friction=0.5,
    )


def test_exact_limits_at_constant_load() -> None:
    found = cr.shakedown(PAPER, loads=P, force_amplitudes=SWING)
    assert found.factor == pytest.approx(0.351719571750, rel=1e-11)
    assert found.factors[B] == pytest.approx(0.616512127452, rel=1e-11)
    assert found.lower <= found.factor <= found.upper
    assert found.gap < 1e-10
    assert found.order == "proved at the levels used"
    assert found.gross == pytest.approx(1.0)
    # The same as the onset of sliding on first loading.
    contact = cr.press(PAPER, load=P)
    onset = cr.onset_of_sliding(contact)
    loaded = contact.loads > 0
    assert_allclose(found.factors[loaded], onset[loaded] / RADIUS, rtol=1e-9)
    assert np.isnan(found.factors[~loaded]).all()
    assert np.flatnonzero(found.mechanism > 0.5).tolist() == list(range(31, 37))


@pytest.mark.parametrize(
    ("angle", "a", "b"),
    [
        (0, 1.250804608223, 2.566569395968),
        (45, 1.309538047714, 2.687086579329),
        (90, 1.398442065278, 2.869511819177),
    ],
)
def test_exact_limits_around_ellipses(angle: float, a: float, b: float) -> None:
    p, q = turned(angle)
    found = cr.shakedown(PAPER, loads=0.9 * P, load_amplitudes=p, force_amplitudes=q)
    assert found.factor == pytest.approx(a, rel=1e-11)
    assert found.factors[B] == pytest.approx(b, rel=1e-11)
    assert found.lower <= a * (1 + 1e-12)
    assert found.upper >= a * (1 - 1e-12)


@pytest.mark.parametrize("angle", [None, 0, 45, 90])
def test_paths_below_and_above_the_limit(angle: float | None) -> None:
    """1 % below no asperity slides in a later cycle; 1 % above ring A does, by what L* says."""
    p, q = (np.zeros(2), SWING) if angle is None else turned(angle)
    mean = P if angle is None else 0.9 * P
    limit = cr.shakedown(PAPER, loads=mean, load_amplitudes=p, force_amplitudes=q)
    for factor, slides in ((0.99 * limit.factor, False), (1.01 * limit.factor, True)):
        loads, forces = mean + factor * p, factor * q
        found = cr.steady(PAPER, loads=loads, forces=forces)
        ring = found.status[A]
        assert ring == ("sliding" if slides else "partial")
        twice = [np.tile(each, 3) for each in (loads, forces)]
        path = cr.load_path(PAPER, loads=twice[0], forces=twice[1])
        m = len(loads)
        drift = path.drifts[m : 2 * m, A]
        assert np.ptp(drift) == pytest.approx(found.slips[A], abs=1e-12 * path.displacements.max())
        assert (found.slips[A] > 0) == slides


@pytest.mark.parametrize(("name", "exact", "elastic"), [("rough", 0.3101185108701, 0.2238120185)])
def test_rough(name: str, exact: float, elastic: float) -> None:
    swing = 0.5 * LARGEST[name] * np.array([1.0, -1.0])
    found = cr.shakedown(ROUGH, loads=LARGEST[name], force_amplitudes=swing)
    assert found.factor == pytest.approx(exact, rel=1e-9)
    assert found.lower <= found.factor <= found.upper
    below = cr.shakedown(ROUGH, loads=LARGEST[name], force_amplitudes=swing, kind="elastic")
    assert below.factor == pytest.approx(elastic, rel=1e-9)


def test_elastic_limit() -> None:
    """Lower than the exact one, as the edge of a light contact is soft once it slips."""
    found = cr.shakedown(PAPER, loads=P, force_amplitudes=SWING, kind="elastic")
    assert found.factor == pytest.approx(0.2571338521083, rel=1e-11)
    assert found.witness.sum() == pytest.approx(0.0, abs=1e-12 * P)
    contact = cr.press(PAPER, load=P)
    assert (np.abs(found.witness) <= 0.5 * contact.loads * (1 + 1e-9)).all()


@pytest.mark.parametrize(
    ("ratio", "along", "across"),
    [
        (0.0, 0.2571338521, 0.2571338521),
        (0.3, 0.2492494516, 0.2419789620),
        (0.5, 0.2429058344, 0.2305870527),
    ],
)
def test_vector_limits(ratio: float, along: float, across: float) -> None:
    scene = replace(PAPER, material=cr.Material(1.0, ratio))
    for direction, limit in ((0, along), (1, across)):
        swing = np.zeros((2, 2))
        swing[:, direction] = SWING
        found = cr.shakedown(scene, loads=P, force_amplitudes=swing, kind="vector")
        assert found.factor == pytest.approx(limit, rel=1e-9)
        assert found.lower <= found.upper
        assert found.gap < 1e-8


def test_vector_limits_of_other_paths() -> None:
    def limit(path: Array, mean: tuple[float, float] = (0.0, 0.0)) -> float:
        return cr.shakedown(
            PAPER,
            loads=P,
            forces=RADIUS * np.array(mean),
            force_amplitudes=RADIUS * path,
            kind="vector",
        ).factor

    angles = 2 * np.pi * np.arange(24) / 24
    circle = np.column_stack((np.cos(angles), np.sin(angles)))
    assert limit(circle) == pytest.approx(0.2419789620, rel=1e-8)
    assert limit(np.array([[0, 0], [1.0, 0]])) == pytest.approx(0.49849890, rel=1e-8)
    assert limit(np.array([[0, 0], [1.0, 0], [1, 1]])) == pytest.approx(0.34487646, rel=1e-7)
    across = np.array([[0, 1.0], [0, -1.0]])
    assert limit(across, (0.5, 0.0)) == pytest.approx(0.24197896, rel=1e-7)


def test_the_mechanism_proves_the_upper_bound() -> None:
    """Its slips, closed over a cycle, evaluated here once more with the package's kernel only."""
    swing = np.column_stack((SWING, 0 * SWING))
    found = cr.shakedown(PAPER, loads=P, force_amplitudes=swing, kind="vector")
    net = found.mechanism.sum(axis=0)
    touching = cr.press(PAPER, load=P).loads > 0
    assert_allclose(net[touching], np.broadcast_to(net[0], (37, 2)), atol=1e-9)
    assert np.hypot(*found.mechanism.T).max() == pytest.approx(1.0)


def test_a_path_that_follows_never_slides() -> None:
    found = cr.shakedown(
        PAPER, loads=P, load_amplitudes=[0.1 * P, 0.0], force_amplitudes=[0.02 * P, 0.0]
    )
    assert found.factor == np.inf


def test_bad_input() -> None:
    with pytest.raises(cr.InputError, match="force_amplitudes"):
        cr.shakedown(PAPER, loads=P, force_amplitudes=[0.0, 0.0])
    with pytest.raises(cr.InputError, match="kind"):
        cr.shakedown(PAPER, loads=P, force_amplitudes=SWING, kind="plastic")  # type: ignore[arg-type]
    with pytest.raises(cr.InputError, match=r"load_amplitudes.*only .exact."):
        cr.shakedown(
            PAPER, loads=P, load_amplitudes=0.1 * P, force_amplitudes=SWING, kind="elastic"
        )
    with pytest.raises(cr.InputError, match="forces"):
        cr.shakedown(PAPER, loads=P, forces=P, force_amplitudes=SWING)
    with pytest.raises(cr.InputError, match="shape"):
        cr.shakedown(PAPER, loads=P, force_amplitudes=SWING, kind="vector")
    with pytest.raises(cr.InputError, match="loads"):
        cr.shakedown(PAPER, loads=-P, force_amplitudes=SWING)
