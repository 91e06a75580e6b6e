"""The general step: what the memory curve finds where indentations are ordered, and where not.

The brute force is the tests' own: contacts are cut into bristles (Popov's dimensional reduction,
exact for Hertz and Mindlin), which stick or slip one by one.
"""

from dataclasses import replace
from fractions import Fraction
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from path_scenes import LARGEST, PAPER, shaded
from scenes import MATERIAL, random_scenes

import convexrough as cr
from convexrough.arrays import Array
from convexrough.friction.curve import MemoryCurve
from convexrough.friction.general_step import followed
from convexrough.friction.levels import FrictionLevels
from convexrough.influence import couple

#: c_t f of the scenes here.
TRAVEL = 0.5 * (2 - 0.3) / (2 * (1 - 0.3))


def agree(a: cr.LoadPath, b: cr.LoadPath, within: float) -> None:
    P, X = a.loads.max(), np.abs(a.asperity_displacements).max()
    assert_allclose(a.displacements, b.displacements, atol=within * X)
    assert_allclose(a.asperity_forces, b.asperity_forces, atol=within * 0.5 * P)
    assert_allclose(a.asperity_displacements, b.asperity_displacements, atol=within * X)
    assert_allclose(a.drifts, b.drifts, atol=within * X)


@settings(max_examples=5, deadline=None)
@given(random_scenes(crowding=0.7, most=10), st.integers(0, 2**32 - 1))
def test_random_paths(sampled: tuple[cr.Scene, float], seed: int) -> None:
    scene, approach = sampled
    largest = cr.press(scene, approach=approach).load
    if largest == 0:
        return
    rng = np.random.default_rng(seed)
    P = rng.uniform(0.1, 1.0, 6) * largest
    Q = 0.5 * P * rng.uniform(-0.95, 0.95, 6)
    scene = replace(scene, friction=0.5)
    path = cr.load_path(scene, loads=P, forces=Q)
    if path.order == "fails":
        return
    agree(path, cr.load_path(scene, loads=P, forces=Q, general_steps=1), 1e-12)


@pytest.mark.sample(1)
@pytest.mark.parametrize("seed", [1, 5])
def test_losses_of_the_steps_are_good_to_a_thousandth(seed: int) -> None:
    """Or none are given: against those of the memory curve, which are proved."""
    tips = cr.Asperities([[0.0, 0.0], [0.0025, 0.0], [0.0, 0.003]], 0.02)
    contact = cr.press(cr.Scene(1.0, tips, MATERIAL, friction=0.5, geometry="summit"), load=1e-6)
    rng = np.random.default_rng(seed)
    P = np.r_[1.0, rng.uniform(0.2, 1.0, 4)] * contact.load
    Q = 0.5 * P * np.r_[0.0, rng.uniform(-0.95, 0.95, 4)]
    path = cr.load_path(contact.scene, start=contact, loads=P, forces=Q)
    assert path.order == "proved"
    levels = contact.cached(FrictionLevels)
    points = [(Fraction(p), Fraction(q) / Fraction(0.5)) for p, q in zip(P, Q, strict=True)]
    found = followed(levels, MemoryCurve.pressed(levels.load), points).losses
    known = ~np.isnan(found)
    assert known.sum() >= 4
    within = 1e-3 * path.losses + 1e-6 * path.losses.max()
    assert (np.abs(found - path.losses) <= within)[known].all()


def test_where_order_fails() -> None:
    """The memory curve is not used, and the steps converge to the bristles."""
    scene = shaded()
    largest = cr.press(scene, approach=1.4).load
    P = np.array([0.8, 0.8, 1.0]) * largest
    Q = 0.5 * np.array([0.0, 0.3, 0.6]) * largest
    path = cr.load_path(scene, loads=P, forces=Q)
    assert path.order == "fails"
    assert np.isinf(path.displacement_errors).all()
    assert set(path.status.ravel()) == {"undecided"}
    fine = cr.load_path(scene, loads=P, forces=Q, general_steps=32)
    X = np.abs(path.displacements).max()
    assert_allclose(path.displacements, fine.displacements, atol=2e-3 * X)
    bristles = Bristles(scene, largest, count=200)
    for load, force, X_step, Q_step in zip(
        P, Q, fine.displacements, fine.asperity_forces, strict=True
    ):
        bristles.go(load, force / 0.5, steps=40)
        assert TRAVEL * bristles.displacement == pytest.approx(X_step, abs=5e-3 * X)
        assert_allclose(0.5 * bristles.carried, Q_step, atol=5e-3 * Q.max())


def test_bad_input() -> None:
    with pytest.raises(cr.InputError, match="steps"):
        cr.load_path(PAPER, loads=[LARGEST["paper"]], forces=[0.0], general_steps=0)


@cache
def loads_at(scene: cr.Scene, load: float) -> Array:
    return cr.press(scene, load=load).loads


class Bristles:
    """Each contact cut into springs side by side; displacements over c_t f, forces over f."""

    def __init__(self, scene: cr.Scene, largest: float, count: int) -> None:
        self.scene, self.load, self.height, self.displacement = scene, 0.0, 0.0, 0.0
        n, E = len(scene), scene.material.contact_modulus
        radii = cr.press(scene, load=largest).contact_radii * 1.3
        self.dx = radii / count
        x = (np.arange(count) + 0.5) * self.dx[:, None]
        self.shape = x**2 / scene.relative_radii[:, None]
        self.stiffness = np.broadcast_to(2 * E * self.dx[:, None], x.shape)
        self.held = np.zeros(x.shape)
        self.A = couple(scene, np.arange(n), 1 / (np.pi * E), "dense").matrix
        self.k = np.cbrt(9 / (16 * E**2 * scene.relative_radii))

    @property
    def carried(self) -> Array:
        return np.asarray(self.held.sum(axis=1))

    def go(self, load: float, height: float, steps: int) -> None:
        before = self.load, self.height
        for k in range(1, steps + 1):
            part = (k / steps) ** (3 if before[0] == 0 else 1)  # graded where contact begins
            now = [a + part * (b - a) for a, b in zip(before, (load, height), strict=True)]
            self._step(*now)
        self.load, self.height = load, height

    def _step(self, load: float, height: float) -> None:
        """Return mapping: every bristle sticks, or slips at its bound; Newton on what is moved."""
        own = self.k * np.cbrt(loads_at(self.scene, load)) ** 2
        bound = self.stiffness * np.maximum(own[:, None] - self.shape, 0.0)
        n, old = len(own), self.carried
        moved, displacement = np.full(n, 1e-3 * np.sign(height - old.sum()) * own.max()), 0.0
        for _ in range(200):
            trial = self.held + self.stiffness * moved[:, None]
            held = np.clip(trial, -bound, bound)
            slopes = (self.stiffness * (np.abs(trial) < bound)).sum(axis=1)
            matrix = np.zeros((n + 1, n + 1))
            matrix[:n, :n] = np.eye(n) + self.A * slopes
            matrix[:n, n], matrix[n, :n] = -1.0, slopes
            defect = moved + self.A @ (held.sum(axis=1) - old) - displacement
            excess = held.sum() - height
            if max(np.abs(defect).max() / own.max(), abs(excess) / load) < 1e-11:
                break
            change = np.linalg.solve(matrix, -np.append(defect, excess))
            moved, displacement = moved + change[:n], displacement + change[n]
        else:
            raise AssertionError("the bristles do not settle")
        self.held, self.displacement = held, self.displacement + displacement
