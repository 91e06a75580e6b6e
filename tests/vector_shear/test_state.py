"""Vector friction: its own equations, its limits, two solvers, and the words under attack."""

import sys
from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scenes import MATERIAL, NAMED, PAPER_APPROACH, paper, random_scenes, scattered

import convexrough as cr
from convexrough import FrictionConic, FrictionNewton, VectorShearState, shear_vector
from convexrough.convex import cones
from convexrough.sphere import hertz, mindlin
from convexrough.vector_shear import cones as friction_cones
from convexrough.vector_shear.judgement import judge_vectors
from convexrough.vector_shear.problem import VectorProblem, VectorState

FRICTION = 0.5
FRACTIONS = [1e-9, 1e-3, 0.1, 0.3, 0.5, 0.8, 0.99]
NAMES = ["paper", "rough", "steel", "rough, closest"]


def with_friction(scene: cr.Scene, nu: float = 0.3) -> cr.Scene:
    material = cr.Material(scene.material.contact_modulus, nu)
    return cr.Scene(scene.sphere_radius, scene.asperities, material, FRICTION, scene.geometry)


@cache
def pressed(name: str, nu: float = 0.3) -> cr.Contact:
    scene, approach = NAMED[name]
    return cr.press(with_friction(scene, nu), approach=approach)


@cache
def found(name: str, nu: float, fraction: float, conic: bool = False) -> VectorShearState:
    contact = pressed(name, nu)
    solver = FrictionConic() if conic else None
    return shear_vector(contact, force=fraction * FRICTION * contact.load, solver=solver)


def lengths(vectors: np.ndarray) -> np.ndarray:
    return np.hypot(*vectors.T)


@cache
def cerruti(scene: cr.Scene) -> np.ndarray:
    """(n, n, 2, 2) T_ij for both bodies, entry by entry from physics."""
    G, nu = scene.material.shear_modulus, scene.material.poisson_ratio
    points = scene.contact_points
    T = np.zeros((len(points), len(points), 2, 2))
    for i, here in enumerate(points):
        for j, there in enumerate(points):
            if i != j:
                r = float(np.hypot(*(here - there)))
                d = (here - there) / r
                T[i, j] = ((1 - nu) * np.eye(2) + nu * np.outer(d, d)) / (np.pi * G * r)
    return T


def own_displacements(contact: cr.Contact, forces: np.ndarray) -> np.ndarray:
    """(n, 2) Mindlin: 3 (2 - nu) f P / (8 G a) [1 - (1 - |Q|/(f P))^(2/3)] along Q."""
    scene, G = contact.scene, contact.scene.material.shear_modulus
    own = np.zeros_like(forces)
    for i in np.flatnonzero(contact.loads):
        limit, size = FRICTION * contact.loads[i], float(np.hypot(*forces[i]))
        if size > 0:
            share = min(size / limit, 1.0)
            share = 1.0 if share > 1 - 1e-14 else share
            phi = -np.expm1(2 / 3 * np.log1p(-share)) if share < 1 else 1.0
            most = 3 * (2 - scene.material.poisson_ratio) * limit / (8 * G)
            own[i] = most / contact.contact_radii[i] * phi * (forces[i] / size)
    return own


def assert_solves(state: VectorShearState, tolerance: float) -> None:
    """Balance of displacements, the friction law and the direction of slip, from their formulas."""
    contact = state.contact
    loaded = contact.loads > 0
    limit = FRICTION * contact.loads
    size = lengths(state.forces)
    assert (size <= limit * (1 + 1e-14)).all()
    travel = np.hypot(*state.displacement)
    assert_allclose(state.forces.sum(axis=0), state.force, atol=tolerance * np.hypot(*state.force))
    moved = np.einsum("ijab,jb->ia", cerruti(contact.scene), state.forces)
    there = own_displacements(contact, state.forces) + moved + state.slips
    off = lengths(there - state.displacement)[loaded]
    assert off.max() <= tolerance * travel
    slides = lengths(state.slips) > 0
    assert_allclose(size[slides], limit[slides], rtol=tolerance)
    cross = state.slips[:, 0] * state.forces[:, 1] - state.slips[:, 1] * state.forces[:, 0]
    assert (np.abs(cross) <= tolerance * travel * size).all()
    assert ((state.slips * state.forces).sum(axis=1) >= 0).all()
    assert (state.stick_radii[slides] == 0).all()
    assert (state.forces[~loaded] == 0).all()


@pytest.mark.parametrize("fraction", [1e-40, *FRACTIONS, 0.9999, 1 - 1e-9, 1.0])
@pytest.mark.parametrize("name", NAMES)
def test_without_poissons_ratio_it_is_ciavarella_and_jaeger(name: str, fraction: float) -> None:
    contact = pressed(name, 0.0)
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


def test_without_poissons_ratio_the_cones_agree_too() -> None:
    for fraction in FRACTIONS:
        assert found("paper", 0.0, fraction, True).disagreement < 1e-7


@pytest.mark.parametrize(
    ("nu", "fraction", "forces", "transverse", "travel", "sliding"),
    [
        (0.3, 1e-9, 0.0328, 2.5e-11, 1.21366, 0),
        (0.3, 0.3, 0.0293, 0.0068, 1.21374, 0),
        (0.3, 0.5, 0.0272, 0.0128, 1.21373, 6),
        (0.3, 0.8, 0.0228, 0.0169, 1.21375, 18),
        (0.5, 1e-9, 0.0638, 4.7e-11, 1.49719, 0),
        (0.5, 0.3, 0.0570, 0.0130, 1.49756, 0),
        (0.5, 0.5, 0.0526, 0.0245, 1.49751, 6),
        (0.5, 0.8, 0.0441, 0.0323, 1.49760, 18),
    ],
)
def test_the_error_of_the_papers_assumption(
    nu: float, fraction: float, forces: float, transverse: float, travel: float, sliding: int
) -> None:
    """The numbers of docs/theory/friction.md, for the paper's scene."""
    contact, state = pressed("paper", nu), found("paper", nu, fraction)
    assert state.disagreement == pytest.approx(forces, abs=6e-5)
    largest = FRICTION * contact.loads.max()
    assert np.abs(state.forces[:, 1]).max() / largest == pytest.approx(transverse, rel=0.02)
    reference = cr.shear(pressed("paper", 0.0), force=fraction * FRICTION * contact.load)
    assert state.displacement[0] / reference.displacement == pytest.approx(travel, abs=6e-6)
    assert abs(state.displacement[0] / reference.displacement - mindlin.ratio(nu)) < 3e-3
    assert (state.status == "sliding").sum() == sliding
    assert state.certificate.holds
    assert state.iterations <= 6
    scalar = cr.shear(contact, force=state.force[0])
    difference = state.forces - np.column_stack((scalar.forces, 0 * scalar.forces))
    norm = float(np.sqrt((difference**2).sum() / (scalar.forces**2).sum()))
    assert state.disagreement == pytest.approx(norm, rel=1e-9)


@pytest.mark.parametrize("fraction", FRACTIONS)
@pytest.mark.parametrize("name", NAMES)
def test_the_equations_hold(name: str, fraction: float) -> None:
    for nu in (0.3, 0.5):
        state = found(name, nu, fraction)
        assert_solves(state, 1e-11)
        assert state.residual < 1e-12
        words = np.where(lengths(state.slips) > 0, "sliding", "partial")
        words[state.contact.loads == 0] = "open"
        assert (state.status == words).all()


@pytest.mark.parametrize("nu", [0.3, 0.5])
@pytest.mark.parametrize("fraction", [0.99, 0.999, 0.9999, 1 - 1e-6, 1 - 1e-9, 1 - 1e-12])
def test_close_to_gross_sliding(fraction: float, nu: float) -> None:
    """All slide before Q = f P: then forces only turn, and the displacement grows as 1 / root."""
    state = found("paper", nu, fraction)
    assert state.residual < 1e-10
    assert_solves(state, 1e-10)
    if fraction >= 0.9999:
        assert (lengths(state.slips) > 0).sum() == 37
        assert (state.status[state.contact.loads > 0] == "undecided").all()
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
    assert state.certificate.holds
    finite = found("paper", 0.0, 1.0)
    scalar = cr.shear(pressed("paper", 0.0), force=finite.force[0])
    assert_allclose(finite.displacement[0], scalar.displacement, rtol=1e-13)
    assert_allclose(finite.slips[:, 0], scalar.slips, atol=1e-13 * scalar.displacement)
    assert finite.residual < 1e-13


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.5])
@pytest.mark.parametrize("fraction", [1e-12, 0.2, 0.9, 1.0])
def test_one_asperity_is_mindlins(fraction: float, nu: float) -> None:
    scene = cr.Scene(1.0, cr.Asperities([[0.0, 0.0]], 0.01), cr.Material(1.0, nu), FRICTION)
    contact = cr.press(scene, approach=1e-4)
    Q = fraction * FRICTION * contact.load
    for solver, tolerance in ((FrictionNewton(), 1e-13), (FrictionConic(), 1e-6)):
        state = shear_vector(contact, force=(-0.6 * Q, 0.8 * Q), solver=solver)
        G, a, P = scene.material.shear_modulus, contact.contact_radii[0], contact.load
        phi = -np.expm1(2 / 3 * np.log1p(-fraction)) if fraction < 1 else 1.0
        X = 3 * (2 - nu) * FRICTION * P / (8 * G * a) * phi
        assert_allclose(state.displacement, [-0.6 * X, 0.8 * X], rtol=tolerance)
        assert_allclose(state.forces, [[-0.6 * Q, 0.8 * Q]], rtol=1e-12)
        assert state.stick_radii[0] == pytest.approx(a * np.cbrt(1 - fraction), rel=1e-9)
        assert state.disagreement < 1e-12


@pytest.mark.parametrize("conic", [False, True])
@pytest.mark.parametrize("fraction", [1e-6, 0.5, 0.95])
def test_turning_the_force_turns_the_answer(fraction: float, conic: bool) -> None:
    """By 60 degrees on the hexagonal array; and by any angle if the asperities turn too."""
    contact, state = pressed("paper"), found("paper", 0.3, fraction, conic)
    Q = fraction * FRICTION * contact.load
    solver = FrictionConic() if conic else FrictionNewton()
    tolerance = 1e-6 if conic else 1e-11
    points = contact.scene.asperities.positions
    for angle, scene in ((np.pi / 3, None), (1.0, "turned")):
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        other, same = contact, np.zeros(len(points), dtype=int)
        if scene is None:
            off = np.abs(points[None] - (points @ turn.T)[:, None]).max(axis=2)
            same = off.argmin(axis=1)  # where each asperity is turned to
            assert off.min(axis=1).max() < 1e-12
        else:
            asperities = cr.Asperities(points @ turn.T, 0.02)
            other = cr.press(cr.Scene(1.0, asperities, MATERIAL, FRICTION), approach=PAPER_APPROACH)
            same = np.arange(len(points))
        turned = shear_vector(other, force=turn @ [Q, 0.0], solver=solver)
        size = lengths(state.forces).max()
        assert_allclose(turned.forces[same], state.forces @ turn.T, atol=tolerance * size)
        travel = np.hypot(*state.displacement)
        assert_allclose(turned.slips[same], state.slips @ turn.T, atol=tolerance * travel)
        assert_allclose(turned.displacement, turn @ state.displacement, atol=tolerance * travel)
        assert (turned.status[same] == state.status).all()


@pytest.mark.parametrize("fraction", [1e-40, *FRACTIONS, 0.9999])
@pytest.mark.parametrize("nu", [0.0, 0.3, 0.5])
def test_cones_and_newton_agree(nu: float, fraction: float) -> None:
    """On the paper's scene; and the multipliers of the friction cones are the slips."""
    newton, conic = found("paper", nu, fraction), found("paper", nu, fraction, True)
    size = lengths(newton.forces).max()
    assert lengths(newton.forces - conic.forces).max() < 1e-6 * size
    travel = newton.displacement[0]
    tolerance = 1e-10 if 0.6 < fraction < 0.9 else 1e-7
    assert lengths(newton.slips - conic.slips).max() < tolerance * travel
    assert_allclose(newton.displacement, conic.displacement, rtol=1e-7, atol=1e-7 * travel)
    assert (newton.status == conic.status).all()
    assert_solves(conic, 1e-6)
    assert newton.solver == "newton"
    assert conic.solver == "conic"


def test_small_forces_keep_their_digits() -> None:
    """Elastic: the linear system, by its own formulas; every force to 1e-11 of itself."""
    contact = pressed("rough")
    touching = np.flatnonzero(contact.loads)
    G, nu = contact.scene.material.shear_modulus, 0.3
    stiffness = cerruti(contact.scene)[np.ix_(touching, touching)]
    own = (2 - nu) / (4 * G * contact.contact_radii[touching])
    stiffness[range(len(touching)), range(len(touching))] = own[:, None, None] * np.eye(2)
    n = len(touching)
    matrix = stiffness.transpose(0, 2, 1, 3).reshape(2 * n, 2 * n)
    both = np.linalg.solve(matrix, np.tile(np.eye(2), (n, 1)))
    per_travel = both.reshape(n, 2, 2).sum(axis=0)
    for fraction in (1e-40, 1e-25, 1e-16):
        Q = fraction * FRICTION * contact.load * np.array([0.8, 0.6])
        X = np.linalg.solve(per_travel, Q)
        state = shear_vector(contact, force=Q)
        expected = (both @ X).reshape(n, 2)
        size = lengths(expected)
        assert (lengths(state.forces[touching] - expected) <= 1e-11 * size).all()
        assert_allclose(state.displacement, X, rtol=1e-11)


@settings(max_examples=60, deadline=None)
@given(
    random_scenes(crowding=0.9),
    st.one_of(st.floats(1e-6, 0.999), st.floats(-12, -2).map(lambda x: 1 - 10**x)),
    st.floats(0, 0.5),
    st.floats(0, 2 * np.pi),
    st.integers(0, 2**32 - 1),
)
def test_random_scenes(
    drawn: tuple[cr.Scene, float], fraction: float, nu: float, angle: float, seed: int
) -> None:
    """The law holds at every asperity, and no other forces that friction bears cost less energy."""
    scene, approach = drawn
    contact = cr.press(with_friction(scene, nu), approach=approach)
    if contact.load == 0 or contact.certificate.scope == "none":
        return
    Q = fraction * FRICTION * contact.load
    state = shear_vector(contact, force=(Q * np.cos(angle), Q * np.sin(angle)))
    assert state.residual < 1e-10
    assert_solves(state, 1e-9 if fraction < 0.9999 else 1e-5)

    problem = VectorProblem.of(contact)
    force = problem.scalar.units.force * FRICTION
    q, P = state.forces[problem.scalar.touching] / force, problem.scalar.loads
    least = problem.energy(q, problem.couple(q))
    rng = np.random.default_rng(seed)
    for size in (1e-3, 0.1, 1.0):
        trial = q + size * P[:, None] * rng.standard_normal(q.shape)
        trial /= np.maximum(lengths(trial) / P, 1.0)[:, None]
        # Projected on the total and on the discs in turn, until both hold.
        excess = trial.sum(axis=0) - q.sum(axis=0)
        for _ in range(50):
            trial -= excess / len(P)
            trial /= np.maximum(lengths(trial) / P, 1.0)[:, None]
            excess = trial.sum(axis=0) - q.sum(axis=0)
        rise = np.hypot(*state.displacement) / problem.scalar.units.length / FRICTION
        slack = np.hypot(*excess) * rise / mindlin.ratio(nu) + 1e-12 * least
        assert problem.energy(trial, problem.couple(trial)) >= least - slack


@settings(max_examples=40, deadline=None)
@given(random_scenes(crowding=0.9), st.floats(1e-3, 0.999), st.floats(0, 0.5))
def test_the_duality_gap_bounds_what_forces_cost_too_much(
    drawn: tuple[cr.Scene, float], fraction: float, nu: float
) -> None:
    scene, approach = drawn
    contact = cr.press(with_friction(scene, nu), approach=approach)
    if contact.load == 0 or contact.certificate.scope == "none":
        return
    problem = VectorProblem.of(contact)
    total = np.array([fraction * problem.scalar.loads.sum(), 0.0])
    best = FrictionNewton().solve(problem, total)
    least = problem.energy(best.increments, problem.couple(best.increments))
    assert 0 <= problem.duality_gap(best) <= 1e-11 * least
    short = best._replace(increments=0.99 * best.increments)
    assert problem.duality_gap(short) > 5e-3 * least  # 1 % of the total is missing
    # Forces in proportion to the loads are borne too, and have the right total.
    other = best._replace(increments=fraction * np.outer(problem.scalar.loads, [1.0, 0.0]))
    for scale in (0.5, 1.0, 2.0):
        moved = other._replace(rise=scale * best.rise)
        excess = problem.energy(other.increments, problem.couple(other.increments)) - least
        assert problem.duality_gap(moved) >= excess * (1 - 1e-9) - 1e-11 * least


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(2, 40), st.floats(0, 0.5))
def test_the_shift_makes_the_kernel_semidefinite(seed: int, count: int, nu: float) -> None:
    """T + diag(c) >= 0 with the c of the neighbours' distances, over random layouts."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(-1, 1, (count, 2))
    if rng.random() < 0.5:  # rows and clusters
        points = np.round(points * 3) / 3 + 1e-2 * rng.standard_normal(points.shape)
    scene = cr.Scene(1.0, cr.Asperities(points, 0.01), cr.Material(1.0, nu), FRICTION)
    T = cerruti(scene).transpose(0, 2, 1, 3).reshape(2 * count, 2 * count)
    apart = np.hypot(*(points[:, None] - points).T)
    np.fill_diagonal(apart, np.inf)
    shells = apart.min(axis=1) / 2
    c = (9 / 4 * (1 - 2 * nu / 3) if nu > 0 else 1.0) / (
        np.pi * scene.material.shear_modulus * shells
    )
    root = np.repeat(1 / np.sqrt(c), 2)
    lowest = np.linalg.eigvalsh(T * root * root[:, None] + np.eye(2 * count))[0]
    assert lowest >= -1e-12


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.5])
def test_the_shift_that_the_cones_use(nu: float) -> None:
    """0.34, 0.71, 0.67 on the paper's scene: the distances of neighbours; it is not the least."""
    problem = VectorProblem.of(pressed("paper", nu))
    values, shares = problem.shift
    assert shares.max() == pytest.approx({0.0: 0.335, 0.3: 0.709, 0.5: 0.670}[nu], abs=1e-3)
    matrix = problem.kernel + np.diag(np.repeat(values, 2))
    assert np.linalg.eigvalsh(matrix)[0] >= 0
    assert problem.least_share < shares.max()
    least = problem.kernel + np.diag(np.repeat(problem.least_share * problem.stiffness, 2))
    assert abs(np.linalg.eigvalsh(least)[0]) < 1e-12 * np.abs(least).max()


@cache
def blunt(tip_radius: float) -> cr.Contact:
    lattice = cr.Asperities.hexagonal(spacing=0.0025, tip_radius=tip_radius, within=0.0102)
    scene = cr.Scene(1.0, lattice, cr.Material(1.0, 0.5), FRICTION)
    return cr.press(scene, approach=PAPER_APPROACH)


@pytest.mark.parametrize("fraction", [1e-6, 0.2, 0.5, 0.9])
@pytest.mark.parametrize("tip_radius", [0.3, 0.5])
def test_five_cones(tip_radius: float, fraction: float) -> None:
    contact = blunt(tip_radius)
    assert 21 / 25 < VectorProblem.of(contact).shift.shares.max() < 1
    force = fraction * FRICTION * contact.load
    newton = shear_vector(contact, force=force)
    conic = shear_vector(contact, force=force, solver=FrictionConic())
    assert lengths(newton.forces - conic.forces).max() < 1e-6 * lengths(newton.forces).max()
    assert_solves(newton, 1e-11)


def test_too_dense_for_a_convex_program() -> None:
    contact = blunt(5.0)
    assert contact.certificate.scope == "none"
    force = 0.1 * FRICTION * contact.load
    expected = r"too dense.* is 1\.\d+ of the local stiffness.*\d+ \(\d\.\d+\), \d+ \("
    with pytest.raises(cr.SolverError, match=expected):
        shear_vector(contact, force=force, solver=FrictionConic())


@pytest.mark.parametrize("form", ["four", "five"])
def test_the_cones_in_increments_are_those_of_cones(form: str) -> None:
    """Same determinants x y - w^2 for any lift, and the same energy, not only on the curve."""
    lift = friction_cones.FOUR if form == "four" else friction_cones.FIVE
    theirs = cones.FOUR_CONES if form == "four" else cones.FIVE_CONES
    rng = np.random.default_rng(1)
    nodes, weights = rng.uniform(0, 1, 9), rng.dirichlet(np.ones(9))  # any measure on [0, 1]
    u, t = 1 - nodes, nodes
    moments = [1 + 0 * t, t, t**2, t**3, t**4, t**5, t**5 - t**6]
    if form == "four":
        powers = [1 + 0 * t, (1 - t**2) ** 2, t**2 * u, t**2 * u**2, t**2 * u**3, t**3 * u**3]
    else:
        powers = [u**k for k in range(6)] + [t**3 * u**3]
    values, other = (np.array(each) @ weights for each in (powers, moments))

    def determinants(forms: np.ndarray, at: np.ndarray) -> np.ndarray:
        x, y, w = np.moveaxis(forms @ at, 1, 0)
        return np.asarray(x * y - w * w)

    mine, known = determinants(lift.cones, values), determinants(theirs, other)
    assert (known > 1e-6).all()
    assert_allclose(np.sort(mine), np.sort(known), rtol=1e-10)
    assert lift.share @ values == pytest.approx(1 - other[3], rel=1e-12)
    for S in (0.0, 0.4, 0.84):
        energy = (3 / 5 - S / 3) * other[5] + S / 3 * other[6] - (1 - 2 * S / 3) * other[3]
        energy += 2 / 5 - S / 3
        assert (lift.energy[0] + S * lift.energy[1]) @ values == pytest.approx(energy, rel=1e-10)
    # Each variable is of the order it is said to be of.
    u, t = 1e-4, 1 - 1e-4
    single = [1, (1 - t**2) ** 2, t**2 * u, t**2 * u**2, t**2 * u**3, t**3 * u**3]
    if form == "five":
        single = [1, u, u**2, u**3, u**4, u**5, t**3 * u**3]
    assert_allclose(np.log(single) / np.log(u), lift.orders, atol=0.2)


def test_a_solver_that_is_missing_or_fails_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    contact = pressed("paper")
    force = 0.5 * FRICTION * contact.load
    with pytest.raises(cr.SolverError, match=r"friction \(conic\): clarabel stopped after .*"):
        shear_vector(contact, force=force, solver=FrictionConic(accepted=1e-18))
    with pytest.raises(cr.SolverError, match=r"friction \(newton\): residual .* after 2 steps"):
        shear_vector(contact, force=force, solver=FrictionNewton(max_iterations=2))
    monkeypatch.setitem(sys.modules, "clarabel", None)
    with pytest.raises(cr.SolverError, match=r"friction \(conic\).*pip install clarabel"):
        shear_vector(contact, force=force, solver=FrictionConic())


def test_an_answer_is_judged_and_not_the_word_of_its_solver(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    import clarabel

    class Boastful:
        def __init__(self, *data: object) -> None:
            self.real = clarabel.DefaultSolver(*data)

        def solve(self) -> SimpleNamespace:
            answer = self.real.solve()
            x = np.array(answer.x) * 1.01
            return SimpleNamespace(x=x, z=answer.z, status="Solved", iterations=1)

    names = ("DefaultSettings", "ZeroConeT", "SecondOrderConeT")
    fake = SimpleNamespace(
        DefaultSolver=Boastful, **{each: getattr(clarabel, each) for each in names}
    )
    monkeypatch.setitem(sys.modules, "clarabel", fake)
    contact = pressed("paper")
    with pytest.raises(cr.SolverError, match="with Solved"):
        shear_vector(contact, force=0.5 * FRICTION * contact.load, solver=FrictionConic())


def test_bad_input() -> None:
    contact = pressed("paper")
    limit = FRICTION * contact.load
    for force in (1.01 * limit, -1.01 * limit, (limit, 0.2 * limit)):
        with pytest.raises(cr.InputError, match=r"force: found .*gross sliding, 0\.0.* beyond it"):
            shear_vector(contact, force=force)
    for force in (float("nan"), (0.0, float("inf")), "much", None):
        with pytest.raises(cr.InputError, match="force"):
            shear_vector(contact, force=force)
    for force in ([1e-9], [1e-9, 0.0, 0.0], [[1e-9, 0.0]]):
        with pytest.raises(cr.InputError, match=r"force: found .* expected"):
            shear_vector(contact, force=force)
    frictionless = cr.press(paper(), approach=PAPER_APPROACH)
    with pytest.raises(cr.InputError, match="coefficient of friction"):
        shear_vector(frictionless, force=1e-9)


def test_rest_and_nothing_loaded() -> None:
    contact = pressed("paper")
    rest = shear_vector(contact, force=(0.0, 0.0))
    assert (rest.forces == 0).all()
    assert (rest.displacement == 0).all()
    assert (rest.status[contact.loads > 0] == "partial").all()
    assert rest.certificate.holds
    assert rest.disagreement == rest.residual == rest.duality_gap == 0
    assert_allclose(rest.stick_radii, contact.contact_radii)
    with pytest.raises(ValueError, match="read-only"):
        rest.forces[0, 0] = 1.0
    scene = cr.Scene(1.0, cr.Asperities([[1e-3, 0], [2e-3, 0]], 0.01), MATERIAL, FRICTION)
    empty = shear_vector(cr.press(scene, approach=1e-7), force=0.0)
    assert (empty.status == "open").all()
    assert empty.forces.shape == (2, 2)
    with pytest.raises(cr.InputError, match="gross sliding"):
        shear_vector(cr.press(scene, approach=1e-7), force=1e-9)


@settings(max_examples=80, deadline=None)
@given(
    st.sampled_from(["paper", "rough"]),
    st.floats(1e-6, 0.999),
    st.sampled_from(["swap", "perturb", "turn", "drop", "zero", "rise", "slip"]),
    st.integers(0, 2**32 - 1),
)
def test_attacks_on_the_words(name: str, fraction: float, kind: str, seed: int) -> None:
    """States that are wrong must not be given a wrong word, nor a bound that is too small."""
    contact = pressed(name, 0.5)
    problem = VectorProblem.of(contact)
    total = np.array([0.8, 0.6]) * fraction * problem.scalar.loads.sum()
    good = FrictionNewton().solve(problem, total)
    rng = np.random.default_rng(seed)
    q, rise, slips = good.increments.copy(), good.rise, good.slips.copy()
    size = 10.0 ** rng.uniform(-14, -1)
    if kind == "swap":
        i, j = rng.integers(len(q), size=2)
        q[[i, j]] = q[[j, i]]
    elif kind == "perturb":
        q *= 1 + size * rng.standard_normal(q.shape)
    elif kind == "turn":
        q += size * rng.standard_normal((len(q), 1)) * q[:, ::-1] * [-1, 1]
    elif kind == "drop":
        q[rng.integers(len(q))] = 0.0
    elif kind == "zero":
        q[:] = 0.0
    elif kind == "slip":
        slips[rng.integers(len(q))] += size * rise
    else:
        rise = rise * (1 + size * rng.standard_normal(2))
    q /= np.maximum(lengths(q) / problem.scalar.loads, 1.0)[:, None]
    wrong = good._replace(increments=q, rise=rise, slips=slips)
    bounds = judge_vectors(problem, wrong, gross=False)
    sliding = lengths(good.slips) > 0
    assert not (bounds.sliding[0] & ~sliding).any()
    assert not (bounds.partial[0] & sliding).any()
    assert (lengths(q - good.increments) <= bounds.increments[0] * (1 + 1e-9)).all()
    assert (lengths(wrong.slips - good.slips) <= bounds.slips[0] * (1 + 1e-9)).all()
    assert np.hypot(*(rise - good.rise)) <= bounds.rises[0] * (1 + 1e-9)


def test_the_residual_sees_every_fault() -> None:
    """The judge itself is judged: one asperity that slides, one condition broken in its turn."""
    scene = cr.Scene(1.0, cr.Asperities([[0.0, 0.0]], 0.01), cr.Material(1.0, 0.5), FRICTION)
    problem = VectorProblem.of(cr.press(scene, approach=1e-4))
    P, ceiling = problem.scalar.loads[0], problem.scalar.ceilings[0]
    along_x = np.array([[1.0, 0.0]])

    def residual(share: float, slip: tuple[float, float], off: float = 0.0) -> float:
        """Of a state with displacements that balance, but for `off` across."""
        q, slips = share * P * along_x, ceiling * np.array([slip])
        rise = (problem.own(q) + slips)[0] + [0.0, off * ceiling]
        return problem.residual(VectorState(q[0], q, rise, slips, 1))

    assert residual(1.0, (0.5, 0.0)) < 1e-14
    assert residual(0.7, (0.0, 0.0)) < 1e-14
    assert residual(1.0, (0.5, 0.0), off=1e-3) > 1e-4  # balance
    assert residual(1.0, (0.5, 1e-3)) > 1e-4  # slip across the force
    assert residual(1.0, (-0.5, 0.0)) > 1e-4  # slip against it
    assert residual(0.7, (1e-3, 0.0)) > 1e-4  # slip, though friction is left
    assert residual(1.001, (0.5, 0.0)) > 1e-4  # more than friction
    q = P * along_x
    short = VectorState(1.001 * q[0], q, problem.own(q)[0], 0 * q, 1)
    assert problem.residual(short) > 1e-4  # total


def test_gross_sliding_of_two_that_pull_each_other_aside_alike() -> None:
    """Then a finite displacement, with a part across the force, slides both along it."""
    points = [[-2e-3, -2e-3], [2e-3, 2e-3]]
    scene = cr.Scene(1.0, cr.Asperities(points, 0.01), cr.Material(1.0, 0.5), FRICTION)
    contact = cr.press(scene, approach=1e-4)
    state = shear_vector(contact, force=FRICTION * contact.load)
    assert 0.01 < state.displacement[1] / state.displacement[0] < 0.1
    assert state.residual < 1e-13
    assert_solves(state, 1e-12)
    assert (state.status == "sliding").all()


@pytest.mark.parametrize("size", [1e-9, 1e-4, 1e-2])
def test_the_bounds_are_needed(size: float) -> None:
    """Two asperities, and an error of their forces that changes neither total nor symmetry.

    What the normal map makes of such a state is off too, by less than the state itself.
    """
    scene = cr.Scene(1.0, cr.Asperities([[-2e-3, 0], [2e-3, 0]], 0.01), cr.Material(1, 0.5), 0.5)
    contact = cr.press(scene, approach=1e-4)
    problem = VectorProblem.of(contact)
    good = FrictionNewton().solve(problem, np.array([0.3, 0.1]) * problem.scalar.loads.sum())
    error = size * problem.scalar.loads[:, None] * np.array([[1.0, 0.5], [-1.0, -0.5]])
    wrong = good._replace(increments=good.increments + error)
    bounds = judge_vectors(problem, wrong, gross=False)
    assert bounds.proved[0]
    assert (lengths(error) <= bounds.increments[0]).all()
    assert bounds.increments[0].max() < 4 * lengths(error).max()


@pytest.mark.parametrize("size", [1e-6, 1e-3, 1e-2])
@pytest.mark.parametrize("fraction", [1e-6, 0.3, 0.6, 0.9])
def test_bounds_from_loads_that_are_just_as_far_off_as_said(fraction: float, size: float) -> None:
    contact = pressed("rough")
    loaded = contact.loads > 0
    rng = np.random.default_rng(5)
    off = np.where(loaded, size * rng.choice([-1.0, 1.0], len(loaded)), 0.0)
    loads = contact.loads * (1 + off)
    known = replace(contact.certificate, load_errors=1.001 * np.abs(loads - contact.loads))
    doubtful = replace(
        contact,
        loads=loads,
        load=float(loads.sum()),
        contact_radii=hertz.contact_radius(loads, 1.0, contact.scene.relative_radii),
        certificate=known,
    )
    force = fraction * FRICTION * contact.load
    truth, state = shear_vector(contact, force=force), shear_vector(doubtful, force=force)
    assert (lengths(state.forces - truth.forces) <= state.certificate.force_errors).all()
    assert (lengths(state.slips - truth.slips) <= state.certificate.slip_errors).all()
    travel = np.hypot(*(state.displacement - truth.displacement))
    assert travel <= state.certificate.displacement_error
    sliding = lengths(truth.slips) > 0
    assert not (state.status[sliding] == "partial").any()
    assert not (state.status[~sliding] == "sliding").any()
    if size < 1e-5:
        assert state.certificate.holds


@pytest.mark.parametrize("digits", [3, 5, 8, 12])
@pytest.mark.parametrize("fraction", [1e-6, 0.1, 0.37, 0.6, 0.99])
def test_doubt_about_the_loads_is_counted(fraction: float, digits: int) -> None:
    """Starting from rounded loads, with the certificate of those, the bounds cover the truth."""
    contact = pressed("paper")
    rounded = np.array([float(f"{load:.{digits - 1}e}") for load in contact.loads])
    rounded[1::2] += 10.0 ** (-digits) * rounded[1::2]
    doubtful = replace(
        contact,
        loads=rounded,
        load=float(rounded.sum()),
        contact_radii=hertz.contact_radius(rounded, 1.0, contact.scene.relative_radii),
        certificate=cr.certify(contact.scene, rounded, approach=contact.approach),
    )
    force = fraction * FRICTION * contact.load
    truth, state = shear_vector(contact, force=force), shear_vector(doubtful, force=force)
    known = state.certificate
    assert (lengths(state.forces - truth.forces) <= known.force_errors).all()
    assert (lengths(state.slips - truth.slips) <= known.slip_errors).all()
    assert np.hypot(*(state.displacement - truth.displacement)) <= known.displacement_error
    sliding = lengths(truth.slips) > 0
    assert not (state.status[sliding] == "partial").any()
    assert not (state.status[~sliding] == "sliding").any()
    if digits >= 8:
        assert known.holds
        assert known.force_errors.max() < 10.0 ** (4 - digits) * lengths(truth.forces).max()


def test_an_uncertified_contact_gets_no_word() -> None:
    contact = replace(
        pressed("paper"), certificate=replace(pressed("paper").certificate, scope="none")
    )
    for fraction in (0.1, 1.0):
        state = shear_vector(contact, force=fraction * FRICTION * contact.load)
        loaded = contact.loads > 0
        assert (state.status[loaded] == "undecided").all()
        assert state.certificate.scope == "none"
        assert not state.certificate.holds


def test_scattered_contacts_by_both_solvers() -> None:
    """Twelve random scenes, any force, any direction: cones against Newton."""
    rng = np.random.default_rng(3)
    for seed in range(12):
        scene, approach = scattered(seed, 12, 0.7, 0.3)
        contact = cr.press(with_friction(scene, rng.uniform(0, 0.5)), approach=approach)
        fraction, angle = 10.0 ** rng.uniform(-6, -0.01), rng.uniform(0, 2 * np.pi)
        Q = fraction * FRICTION * contact.load * np.array([np.cos(angle), np.sin(angle)])
        newton = shear_vector(contact, force=Q)
        conic = shear_vector(contact, force=Q, solver=FrictionConic())
        assert lengths(newton.forces - conic.forces).max() < 1e-6 * lengths(newton.forces).max()
        assert lengths(newton.slips - conic.slips).max() < 1e-6 * np.hypot(*newton.displacement)
        assert newton.duality_gap <= 1e-3 * conic.duality_gap + 1e-14 * np.hypot(*Q) * np.hypot(
            *newton.displacement
        )
