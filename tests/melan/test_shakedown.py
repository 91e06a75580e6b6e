"""Limits of shakedown: values of the prototypes, and histories a little below and above each."""

from dataclasses import replace
from fractions import Fraction
from itertools import product
from typing import Any

import multiprecision
import numpy as np
import pytest
from flint import arb
from friction_scenes import LARGEST, PAPER, SCENES, ring, shaded
from multiprecision import solve_linear, tangential_kernel
from numpy.testing import assert_allclose
from scenes import on_sphere, solve_exactly, twins
from scipy.sparse import csc_array

import convexrough as cr
from convexrough.arrays import Array
from convexrough.melan import program as melan
from convexrough.solvers.programs import ConeProgram, RawAnswer, run_clarabel
from convexrough.vector_shear.problem import FrictionProblem

P, RADIUS = LARGEST["paper"], 0.5 * LARGEST["paper"]
SWING = RADIUS * np.array([1.0, -1.0])

#: An asperity of the rings B and A: the last but one and the last to touch.
B, A = 19, 31


def turned(angle: float, chords: int = 96) -> tuple[Array, Array]:
    """The amplitudes of an ellipse: 0.1 and 0.2 of the mean load, which is 0.9 of the largest."""
    return cr.elliptic_path(
        load=0.0, load_amplitude=0.09 * P, force_amplitude=0.5 * 0.18 * P, phase=np.radians(angle),
        friction=0.5, chords=chords,
    )  # fmt: skip


def swung(kind: str, size: float, along: int = 0) -> Array:
    """To and fro, as this kind of limit takes amplitudes of the force."""
    swing = size * np.array([1.0, -1.0])
    return np.outer(swing, np.eye(2)[along]) if kind == "vector" else swing


def test_exact_limits_at_constant_load() -> None:
    found = cr.shakedown(PAPER, load=P, force_amplitudes=SWING)
    assert found.factor == pytest.approx(0.351719571750, rel=1e-11)
    assert found.factors[B] == pytest.approx(0.616512127452, rel=1e-11)
    assert found.lower <= found.factor <= found.upper
    assert found.gap < 1e-10
    assert found.order == "proved"
    assert found.gross == pytest.approx(1.0)
    # The same as the onset of sliding on first loading.
    contact = cr.press(PAPER, load=P)
    onset = cr.onset_of_sliding(contact)
    loaded = contact.loads > 0
    assert_allclose(found.factors[loaded], onset[loaded] / RADIUS, rtol=1e-9)
    assert np.isnan(found.factors[~loaded]).all()
    assert np.flatnonzero(found.mechanism > 0.5).tolist() == list(range(31, 37))


def test_exact_limits_around_an_ellipse() -> None:
    p, q = turned(45)
    found = cr.shakedown(PAPER, load=0.9 * P, load_amplitudes=p, force_amplitudes=q)
    assert found.factor == pytest.approx(1.309538047714, rel=1e-11)
    assert found.factors[B] == pytest.approx(2.687086579329, rel=1e-11)
    assert found.lower * (1 - 1e-12) <= 1.309538047714 <= found.upper * (1 + 1e-12)


@pytest.mark.sample(1)
@pytest.mark.parametrize("angle", [None, 0, 45, 90])
def test_paths_below_and_above_the_limit(angle: float | None) -> None:
    """1 % below no asperity of a ring slides in a later cycle; 1 % above all do, as L* says."""
    p, q = (np.zeros(2), SWING) if angle is None else turned(angle, chords=8)
    mean, m = P if angle is None else 0.9 * P, len(p)
    limit = cr.shakedown(PAPER, load=mean, load_amplitudes=p, force_amplitudes=q)
    for asperity, part in product((A, B), (0.99, 1.01)):
        slides = part > 1
        factor = part * limit.factors[asperity]
        loads, forces = mean + factor * p, factor * q
        found = cr.steady(PAPER, loads=loads, forces=forces)
        assert found.status[asperity] == ("sliding" if slides else "partial")
        path = cr.load_path(PAPER, loads=np.tile(loads, 2), forces=np.tile(forces, 2))
        drift, slip = path.drifts[m:, asperity], found.slips[asperity]
        assert np.ptp(drift) == pytest.approx(slip, abs=1e-12 * path.displacements.max())
        assert (slip > 0) == slides
    assert limit.limited_by == "sliding"


def test_a_limit_is_at_most_gross_sliding() -> None:
    """No part of the contact lets go on these paths; the first leaves |Q| <= f P."""
    rises = np.array([0.0, 1.3 * P])
    limit = cr.shakedown(PAPER, load=P, load_amplitudes=rises, force_amplitudes=[0.03 * P] * 2)
    assert limit.factor == limit.gross == pytest.approx(0.5 / 0.03)
    assert limit.lower <= limit.factor <= limit.upper
    assert limit.limited_by == "sliding"
    limit = cr.shakedown(PAPER, load=P, load_amplitudes=rises, force_amplitudes=[0.0, 0.0])
    assert (limit.factor, limit.limited_by) == (np.inf, None)
    equal = replace(PAPER, sphere_radius=np.inf)  # all open at the load 0
    for forces, what in (([0.0, 0.0], "opening"), ([0.0, 0.05 * P], "sliding")):
        swing = {"load_amplitudes": [0.1 * P, -0.1 * P], "force_amplitudes": forces}
        limit = cr.shakedown(equal, load=P, **swing)
        assert (limit.factor == limit.gross, limit.limited_by) == (True, what)
    swing = {"load_amplitudes": [0.1 * P, 0.0], "force_amplitudes": [0.02 * P, 0.0]}
    assert cr.shakedown(PAPER, load=P, **swing).factor == np.inf


@pytest.mark.parametrize("kind", ["exact", "elastic"])
def test_bounds_near_gross_sliding_hold_for_the_given_numbers(kind: Any) -> None:
    """The room that the mean shear force leaves is a small difference of two numbers."""
    mean, swing = 0.5 * P * (1 - 1e-6), 0.3e-6 * 0.5 * P
    found = cr.shakedown(PAPER, load=P, force=mean, force_amplitudes=[swing, -swing], kind=kind)
    exact = (Fraction(P) - 2 * Fraction(mean)) / (2 * Fraction(swing))  # f = 1/2
    assert found.lower <= exact <= found.upper


def test_an_asperity_that_only_opens_is_told() -> None:
    """In phase and flatter than friction: above the limit a ring opens, and nothing slides."""
    for part, what in ((0.2, "opening"), (0.05, "sliding")):
        p, q = part * P * np.array([1.0, -1.0]), 0.05 * P * np.array([1.0, -1.0])
        limit = cr.shakedown(PAPER, load=P, load_amplitudes=p, force_amplitudes=q)
        assert limit.limited_by == what
        above = 1.01 * limit.factor
        found = cr.steady(PAPER, loads=P + above * p, forces=above * q)
        assert (found.loss > 0) == ((found.status == "sliding").any()) == (what == "sliding")


#: What interior-point answers leave of a slip that has died out, over one that has not.
LEFT = 1e-5


class Stuck:
    """Asperities that stick until they slide, at constant load: |q_i| <= P_i, step by step."""

    def __init__(self, stiffness: Array, limits: Array) -> None:
        self.K, self.P, self.q = stiffness, limits, np.zeros(2 * len(limits))
        self.slip = np.zeros(len(limits))

    def go(self, total: Array) -> None:
        n, scale, unit = len(self.P), np.abs(self.K).max(), self.P.max()
        bounded = np.kron(np.eye(n), [[0.0, 0.0], [-1.0, 0.0], [0.0, -1.0]])
        program = ConeProgram(
            csc_array(np.triu(self.K) / scale),
            -self.K @ (self.q / unit) / scale,
            csc_array(np.vstack((np.tile(np.eye(2), n), bounded))),
            np.append(total, np.kron(self.P, [1.0, 0.0, 0.0])) / unit,
            2,
        )
        raw = run_clarabel(program, "stuck", 1e-11)
        self.q = raw.x * unit
        self.slip = raw.multipliers[2::3] * unit * scale


@pytest.mark.sample(1)
@pytest.mark.parametrize("kind", ["elastic", "vector"])
def test_cycles_below_and_above_melans_limit(kind: Any) -> None:
    """From a first loading that slides: slip dies out 1 % below, and goes on 1 % above."""
    contact = cr.press(PAPER, load=P)
    problem, vector = contact.cached(FrictionProblem), kind == "vector"
    assert len(problem) == 37
    mean, swing = np.array([0.3, 0.1 if vector else 0.0]) * P, np.array([P, 0.0])
    given = {"force": 0.5 * (mean if vector else mean[0]), "kind": kind}
    limit = cr.shakedown(PAPER, load=P, force_amplitudes=swung(kind, 0.5 * P), **given)
    kernel = problem.kernel if vector else np.kron(problem.influence.matrix, np.eye(2))
    slid: dict[float, list[float]] = {0.99: [], 1.01: []}
    for part, slips in slid.items():
        state = Stuck(kernel + np.diag(np.repeat(problem.compliance, 2)), problem.loads)
        for _ in range(40):
            slips.append(0.0)
            for turn in (swing, -swing):
                state.go((mean + part * limit.factor * turn) / problem.units.force)
                slips[-1] += float(np.abs(state.slip).max())
    assert slid[0.99][0] > 1e-3 * slid[1.01][-1]  # something slides at first
    assert slid[0.99][-1] < 0.03 * slid[1.01][-1]
    assert slid[0.99][-1] < 0.5 * slid[0.99][19] + LEFT * slid[1.01][-1]
    assert slid[1.01][-1] == pytest.approx(slid[1.01][-2], rel=0.05)


def exact_limit(scene: cr.Scene, load: float, vector: bool, along: int) -> arb:
    """min P_i / |Y_i|, the forces Y_i under a unit force along x or y, without the package."""
    exact, size = solve_exactly(scene, load=load).loads, 2 if vector else 1
    touching = [i for i, each in enumerate(exact) if each > 0]
    P, nu = np.array([exact[i] for i in touching]), arb(scene.material.poisson_ratio)
    points, _, law = (each[touching] for each in multiprecision.of_scene(scene))
    stiffness = multiprecision.coupling(points, arb(scene.material.contact_modulus))
    if vector:
        stiffness = tangential_kernel(points, stiffness, nu / (2 - nu))
    own = np.repeat(2 * law / (3 * multiprecision.cube_root(P)), size)
    stiffness[np.diag_indices(len(own))] = own
    together = multiprecision.exact(np.tile(np.eye(size), (len(P), 1)))
    moved = np.column_stack([solve_linear(stiffness, each) for each in together.T])
    share = solve_linear(together.T @ moved, multiprecision.exact(np.eye(size)[along]))
    forces = (moved @ share).reshape(-1, size)
    return min(P / np.sqrt((forces * forces).sum(axis=1)), key=float)


@pytest.mark.sample(3)
@pytest.mark.parametrize(("kind", "along"), [("elastic", 0), ("vector", 0), ("vector", 1)])
@pytest.mark.parametrize(("name", "ratio"), [("paper", 0.0), ("paper", 0.5), ("rough", 0.3)])
def test_enclosures_hold_the_limit_in_ball_arithmetic(
    kind: Any, along: int, name: str, ratio: float
) -> None:
    """Under a force to and fro the state at rest is 0 by symmetry: lambda = min P_i / |q_i|."""
    scene, load = replace(SCENES[name][0], material=cr.Material(1.0, ratio)), LARGEST[name]
    amplitudes = swung(kind, 0.5 * load, along)
    found = cr.shakedown(scene, load=load, force_amplitudes=amplitudes, kind=kind)
    least = exact_limit(scene, load, kind == "vector", along) / arb(load)
    assert arb(found.lower) < least < arb(found.upper)
    assert found.proved
    assert found.gap < 1e-9


@pytest.mark.sample(2)
@pytest.mark.parametrize("lie", ["nothing", "noise", "doubled", "backwards"])
def test_a_solver_that_lies_does_not_move_the_limit(lie: str, monkeypatch: Any) -> None:
    """The bounds get worse, and stay true; or the answer is refused."""
    swing = np.array([[0.0, 1.0], [0.3, -0.8], [-0.6, 0.1]]) * RADIUS
    honest = melan.run_clarabel
    truth = cr.shakedown(PAPER, load=P, force_amplitudes=swing, kind="vector")
    assert list(truth.to_dataframe().columns)[-2:] == ["witness_x", "witness_y"]
    assert truth.to_xarray()["force_amplitude"].shape == (3, 2)
    rng = np.random.default_rng(5)

    def liar(*arguments: object) -> RawAnswer:
        raw = honest(*arguments)
        x, z = raw.x, raw.multipliers
        noise = [rng.standard_normal(len(each)) for each in (x, z)]
        x, z = {
            "nothing": (0 * x, 1e-3 * noise[1]),
            "noise": (x * (1 + 0.05 * noise[0]), z * (1 + 0.05 * noise[1])),
            "doubled": (2 * x, 2 * z),
            "backwards": (-x, -z),
        }[lie]
        return raw._replace(x=x, multipliers=z)

    monkeypatch.setattr(melan, "run_clarabel", liar)
    found = cr.shakedown(PAPER, load=P, force_amplitudes=swing, kind="vector")
    assert found.lower <= truth.upper
    assert found.upper >= truth.lower
    assert found.gap > truth.gap or lie == "doubled"


def grazing() -> tuple[cr.Scene, float]:
    """Three of which the last touches by an indentation of 2e-34, and slides in every cycle."""
    positions, heights = [[0, 0], [2.0, 0.5], [-1.5, 1.0]], [0, -0.001, -0.02836162543917945]
    return on_sphere(positions, 1.0, heights, 2.1243957803714115e17, 0.5), 0.0129


def dragged() -> tuple[cr.Scene, float]:
    """The shaded asperity is pushed back by a shear force on all."""
    return shaded(), cr.press(shaded(), approach=1.4).load


@pytest.mark.parametrize(
    ("make", "kinds"),
    [(dragged, "exact elastic"), (twins, "elastic vector"), (grazing, "exact elastic vector")],
)
def test_what_is_not_proved_proves_no_limit(make: Any, kinds: str) -> None:
    """Neither order, nor a contact at no least of the energy, nor a status."""
    scene, load = make()
    undecided = cr.press(scene, load=load).status == "undecided"
    assert undecided.any() == (make != dragged)
    for kind in kinds.split():
        amplitudes: Any = swung(kind, 0.045 * load)
        found = cr.shakedown(scene, load=load, force_amplitudes=amplitudes, kind=kind)
        assert (found.lower, found.proved) == (0.0, False)
        assert found.upper == np.inf or make == grazing
        assert found.factor > 0
        assert found.order == "fails" or make != dragged or kind == "elastic"
    if make == grazing:
        cycle = cr.steady(scene, loads=[load] * 2, forces=[0.003, -0.003])
        assert cycle.slip_errors[undecided] > 0.01  # it may slide


@pytest.mark.parametrize("kind", ["exact", "elastic", "vector"])
def test_one_asperity_slides_on_only_as_all_do(kind: Any) -> None:
    alone, amplitudes = on_sphere([[0.0, 0.0]], 1.0, friction=0.5), swung(kind, 1e-7)
    found = cr.shakedown(alone, load=1e-6, force_amplitudes=amplitudes, kind=kind)
    assert [found.factor, found.gross] == pytest.approx([5.0, 5.0])
    assert found.proved
    assert found.gap < 1e-10


def test_an_asperity_that_opens_as_the_load_rises() -> None:
    """The asperity amid three others touches at the mean load, and is open at the largest."""
    tips, heights = [0.01, 1.0, 1.0, 1.0], [-0.24150756515, 0.0, 0.0, 0.0]
    scene = on_sphere(ring(3), tips, heights, np.inf, friction=0.5)
    load, most = 4 * 0.8495**3, 4 * 0.8655**3
    assert [cr.press(scene, load=P).status[0] for P in (load, most)] == ["contact", "open"]
    forces, loads = [0.005 * load, -0.005 * load, 0.0], [0.0, 0.0, most - load]
    found = cr.shakedown(scene, load=load, force_amplitudes=forces, load_amplitudes=loads)
    assert (found.order, found.lower, found.upper) == ("fails", 0.0, np.inf)


@pytest.mark.parametrize("kind", ["exact", "elastic", "vector"])
def test_witnesses_respect_friction_and_carry_the_mean_force(kind: Any) -> None:
    contact = cr.press(PAPER, load=3.5e-7)
    limits, mean = 0.5 * contact.loads, 0.8 * 0.5 * contact.load
    forces = swung(kind, 0.05 * contact.load)
    force = [mean, 0.0] if kind == "vector" else mean
    found = cr.shakedown(PAPER, load=contact.load, force=force, force_amplitudes=forces, kind=kind)
    witness = found.witness.reshape(len(PAPER), -1)
    assert found.proved
    assert found.factor == pytest.approx(found.gross)
    assert (np.linalg.norm(witness, axis=1) <= limits).all()
    assert witness.sum(axis=0)[0] == pytest.approx(mean)
    if kind == "exact":  # the load rises above the mean, until the whole contact slides
        q = 0.5 * contact.load * np.array([-2.0, -2.1])
        rise = {"load_amplitudes": contact.load, "force_amplitudes": q}
        found = cr.shakedown(PAPER, load=contact.load, **rise)
        assert found.factor == found.gross
        assert (np.abs(found.witness) <= limits * (1 + 1e-15)).all()
        assert found.witness.sum() == pytest.approx(-limits.sum())
    tiny = np.multiply(forces, 1e-310 / np.max(forces))
    with pytest.raises(cr.InputError, match="force_amplitudes: found up to 2e-310"):
        cr.shakedown(PAPER, load=contact.load, force_amplitudes=tiny, kind=kind)
