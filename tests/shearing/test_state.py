"""Friction states: against 80 digits, against their own equations, and the words under attack."""

from dataclasses import replace
from functools import cache
from typing import Any, NamedTuple

import numpy as np
import pytest
from flint import arb, ctx
from friction_scenes import DIGITS, FRACTIONS, FRICTION, KINDS, NAMES, pressed, with_friction
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scenes import MATERIAL, PAPER_APPROACH, paper, random_scenes, solve_exactly

import convexrough as cr
from convexrough.influence.coupling import inverse_distances
from convexrough.shearing.certificate import judge_states
from convexrough.shearing.load_errors import Known
from convexrough.shearing.problem import TangentialProblem
from convexrough.sphere import hertz, mindlin


class Exact(NamedTuple):
    """A friction state in 80 digits; lists of arb."""

    forces: list[Any]
    displacement: Any
    slips: list[Any]
    energy: Any  # of the cycle between +-Q
    loads: list[Any]


@cache
def exact(name: str, fraction: float, control: str = "approach") -> Exact:
    """Ciavarella-Jaeger by definition: Q_i = f (P_i - p_i(L)), L = P - Q / f, by the normal oracle.

    Nothing of the increment form is used. The differences lose digits as Q -> 0: 80 can afford it.
    """
    contact = pressed(name)
    scene, E, nu = contact.scene, arb(contact.scene.material.contact_modulus), arb(0.3)
    with ctx.workdps(DIGITS + 30):
        f, force = arb(FRICTION), arb(fraction * FRICTION * contact.load)
        given = {control: getattr(contact, control)}
        full = solve_exactly(scene, **given, digits=DIGITS, start=contact.loads)
        near = cr.press(scene, load=(1 - fraction) * contact.load).loads
        left = (full.load - force / f).mid()
        reduced = solve_exactly(scene, load=left, digits=DIGITS, start=near)
        travel = f * (2 - nu) / (2 * (1 - nu))
        forces = [f * (a - b) for a, b in zip(full.loads, reduced.loads, strict=True)]
        slips = [
            travel * gap if load > 0 else arb(0)
            for load, gap in zip(full.loads, reduced.gaps, strict=True)
        ]
        energy = arb(0)
        rho = scene.asperities.tip_radii
        for i, (load, q, slip) in enumerate(zip(full.loads, forces, slips, strict=True)):
            if load > 0:
                t = q / (f * load)
                left = 1 - t if not slip > 0 else arb(0)
                e = 1 - root(left) ** 5 - 5 * t / 6 * (1 + root(left) ** 2)
                R = 1 / (1 / arb(scene.sphere_radius) + 1 / arb(float(rho[i])))
                a = (3 * load * R / (4 * E)).root(3)
                G = E * (1 - nu)
                energy += 9 * (2 - nu) * f * f * load * load / (5 * G * a) * e + 4 * f * load * slip
        displacement = travel * (full.approach - reduced.approach)
        return Exact(forces, displacement, slips, energy, list(full.loads))


def root(x: Any) -> Any:
    return arb(0) if x == 0 else x.root(3)


def off(value: float, true: Any) -> float:
    """|value - true|."""
    with ctx.workdps(DIGITS):
        return abs(float(arb(float(value)) - true))


@pytest.mark.parametrize("fraction", FRACTIONS)
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("influence", KINDS)
def test_eighty_digits(influence: str, name: str, fraction: float) -> None:
    """Every force to 1e-11 of itself, the loss to 1e-10, at any shear force; and every bound.

    Transforms round the largest and the smallest alike: their forces are good to 1e-11 of the
    largest.
    """
    contact, truth = pressed(name, influence), exact(name, fraction)
    force = fraction * FRICTION * contact.load
    state = cr.shear(contact, force=force)
    certificate = state.certificate
    for i, true in enumerate(truth.forces):
        size = float(true) if influence == "dense" else state.forces.max()
        assert off(state.forces[i], true) <= 1e-11 * size
        assert off(state.forces[i], true) <= certificate.force_errors[i]
        assert off(state.slips[i], truth.slips[i]) <= certificate.slip_errors[i]
        if truth.slips[i] > 0:
            assert certificate.status[i] == "sliding"
        else:
            assert certificate.status[i] == ("partial" if truth.loads[i] > 0 else "open")
    assert certificate.holds
    assert off(state.displacement, truth.displacement) <= 1e-12 * state.displacement
    assert off(state.displacement, truth.displacement) <= certificate.displacement_error
    assert certificate.force_errors.max() <= 1e-9 * state.forces.max()
    cycle = cr.cycle(contact, maximum=force)
    assert off(cycle.energy, truth.energy) <= 1e-10 * float(truth.energy)
    assert cycle.balance_defect < 1e-10


@pytest.mark.parametrize("fraction", [*FRACTIONS, 1 - 1e-12, 1.0])
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("influence", KINDS)
def test_the_displacements_balance(influence: str, name: str, fraction: float) -> None:
    """X = displacement_i + sum_j c_t A_ij Q_j at every loaded asperity; the forces add up to Q."""
    contact = pressed(name, influence)
    scene = contact.scene
    state = cr.shear(contact, force=fraction * FRICTION * contact.load)
    assert state.forces.sum() == pytest.approx(state.force, rel=1e-14)
    ratio = mindlin.ratio(0.3)
    coupling = inverse_distances(scene.contact_points, scene.contact_points) / np.pi
    there = state.displacements + ratio * coupling @ state.forces / scene.material.contact_modulus
    assert_allclose(there[contact.loads > 0], state.displacement, rtol=1e-12)
    # Johnson's formula for the own deflection of those that stick in part.
    sticks = state.status == "partial"
    P, a = contact.loads[sticks], contact.contact_radii[sticks]
    t = state.forces[sticks] / (FRICTION * P)
    G = scene.material.shear_modulus
    if fraction > 1e-2:
        own = 3 * (2 - 0.3) * FRICTION * P / (8 * G * a) * (1 - (1 - t) ** (2 / 3))
        assert_allclose(state.displacements[sticks], own, rtol=1e-10)
    assert_allclose(state.stick_radii[sticks], a * (1 - t) ** (1 / 3), rtol=1e-9)
    assert (state.stick_radii[state.status == "sliding"] == 0).all()


def test_the_paper_at_half_the_limit() -> None:
    """Exactly the six asperities of ring A slide; A starts near 0.352, B near 0.616."""
    contact = pressed("paper")
    ring = np.round((contact.scene.asperities.distances / 0.0025) ** 2)
    limit = FRICTION * contact.load
    state = cr.shear(contact, force=0.5 * limit)
    assert set(ring[state.status == "sliding"]) == {9}
    assert (state.status == "sliding").sum() == 6
    onsets = cr.onset_of_sliding(contact) / limit
    assert_allclose(onsets[ring == 9], 0.352, atol=5e-4)
    assert_allclose(onsets[ring == 7], 0.616, atol=1e-3)
    assert np.ptp(onsets[ring == 7]) < 1e-13  # symmetric rings slide together
    assert np.nanmax(onsets) == pytest.approx(1.0, abs=1e-12)
    assert np.isnan(onsets[contact.loads == 0]).all()


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("influence", KINDS)
def test_onsets_are_where_sliding_starts(influence: str, name: str) -> None:
    contact = pressed(name, influence)
    some = np.flatnonzero(contact.loads)[::7]
    onsets = dict(zip(some, cr.onset_of_sliding(contact, which=some), strict=True))
    for i in some:
        if onsets[i] < 0.999 * FRICTION * contact.load:
            before = cr.shear(contact, force=onsets[i] * (1 - 1e-9))
            after = cr.shear(contact, force=onsets[i] * (1 + 1e-9))
            assert before.slips[i] == 0
            assert after.slips[i] > 0
            # ... and nothing less would do: the slip is first order in the excess.
            assert after.slips[i] < 1e-8 * after.displacement


def test_zero_and_the_limit() -> None:
    contact = pressed("paper")
    limit = FRICTION * contact.load
    rest = cr.shear(contact, force=0.0)
    assert (rest.forces == 0).all()
    assert rest.displacement == 0
    assert rest.certificate.holds
    assert (rest.status[contact.loads > 0] == "partial").all()
    gross = cr.shear(contact, force=limit)
    assert_allclose(gross.forces, FRICTION * contact.loads, rtol=1e-15)
    assert gross.certificate.holds
    assert (gross.status[contact.loads > 0] == "sliding").all()
    nearly = cr.shear(contact, force=limit * (1 - 1e-12))
    assert_allclose(nearly.forces, FRICTION * contact.loads, rtol=1e-9)
    assert nearly.displacement < gross.displacement
    back = cr.shear(contact, force=-0.3 * limit)
    forth = cr.shear(contact, force=0.3 * limit)
    assert (back.forces == -forth.forces).all()
    assert back.displacement == -forth.displacement


def test_gross_sliding_is_refused() -> None:
    contact = pressed("paper")
    limit = FRICTION * contact.load
    for force in (1.01 * limit, -1.01 * limit):
        with pytest.raises(cr.InputError, match=r"gross sliding, 0\.01 beyond it"):
            cr.shear(contact, force=force)
    with pytest.raises(cr.InputError, match="found nan, expected at most f P"):
        cr.shear(contact, force=float("nan"))
    frictionless = cr.press(paper(), approach=PAPER_APPROACH)
    with pytest.raises(cr.InputError, match="coefficient of friction"):
        cr.shear(frictionless, force=1e-9)


def test_nothing_loaded() -> None:
    scene = with_friction(cr.Scene(1.0, cr.Asperities([[1e-3, 0], [2e-3, 0]], 0.01), MATERIAL))
    contact = cr.press(scene, approach=1e-7)
    state = cr.shear(contact, force=0.0)
    assert (state.forces == 0).all()
    assert (state.status == "open").all()
    with pytest.raises(cr.InputError, match="gross sliding"):
        cr.shear(contact, force=1e-9)


@settings(max_examples=40, deadline=None)
@given(random_scenes(crowding=0.9), st.floats(1e-6, 0.999), st.floats(0, 0.5))
def test_random_scenes(drawn: tuple[cr.Scene, float], fraction: float, nu: float) -> None:
    """The friction law holds, and where loads only fall it is the reduced normal contact."""
    scene, approach = drawn
    contact = cr.press(with_friction(scene, nu=nu), approach=approach)
    if contact.load == 0 or contact.certificate.scope == "none":
        return
    force = fraction * FRICTION * contact.load
    state = cr.shear(contact, force=force)
    assert state.forces.sum() == pytest.approx(force, rel=1e-12)
    assert (np.abs(state.forces) <= FRICTION * contact.loads * (1 + 1e-14)).all()
    reduced = cr.press(scene, load=contact.load * (1 - fraction))
    if (reduced.loads <= contact.loads).all():
        difference = FRICTION * (contact.loads - reduced.loads)
        assert_allclose(state.forces, difference, rtol=1e-9, atol=1e-11 * FRICTION * contact.load)
        for i, word in enumerate(state.status):
            if word == "sliding":
                assert reduced.status[i] != "contact"
            if word == "partial":
                assert reduced.status[i] != "open"


@settings(max_examples=100, deadline=None)
@given(
    st.sampled_from(NAMES),
    st.floats(1e-6, 0.999),
    st.sampled_from(["swap", "perturb", "drop", "zero"]),
    st.integers(0, 2**32 - 1),
    st.sampled_from(KINDS),
)
def test_attacks_on_the_words(
    name: str, fraction: float, kind: str, seed: int, influence: str
) -> None:
    """States that are wrong must not be given a wrong word, nor a bound that is too small."""
    contact = pressed(name, influence)
    problem = TangentialProblem.of(contact)
    good = problem.solve(np.array([fraction * problem.loads.sum()]))
    rng = np.random.default_rng(seed)
    u = good.increments.copy()
    if kind == "swap":
        i, j = rng.integers(u.shape[1], size=2)
        u[0, [i, j]] = u[0, [j, i]]
    elif kind == "perturb":
        u *= 1 + 10.0 ** rng.uniform(-14, -1) * rng.standard_normal(u.shape)
    elif kind == "drop":
        u[0, rng.integers(u.shape[1])] = 0.0
    else:
        u[:] = 0.0
    u = np.clip(u, -problem.loads, problem.loads)
    eta = np.where(u < problem.loads, problem.deflections(u), good.deflections)
    wrong = good._replace(
        increments=u, deflections=eta, slips=np.maximum(eta - problem.ceilings, 0)
    )
    bounds = judge_states(problem, contact, wrong)
    truly_sliding = good.slips > 0
    assert not (bounds.sliding & ~truly_sliding).any()
    assert not (bounds.partial & truly_sliding).any()
    assert (np.abs(u - good.increments) <= bounds.increments * (1 + 1e-9)).all()
    assert (np.abs(wrong.rises - good.rises) <= bounds.rises * (1 + 1e-9)).all()


def in_doubt(contact: cr.Contact, digits: int, control: str) -> cr.Contact:
    """The contact with rounded loads, and the certificate of those."""
    rounded = np.array([float(f"{load:.{digits - 1}e}") for load in contact.loads])
    # Not symmetric: every other load is off the other way.
    rounded[1::2] += 10.0 ** (-digits) * rounded[1::2]
    given: Any = {control: getattr(contact, control)}
    return replace(
        contact,
        loads=rounded,
        load=float(rounded.sum()),
        contact_radii=hertz.contact_radius(rounded, 1.0, contact.scene.relative_radii),
        certificate=cr.certify(contact.scene, rounded, **given, influence=contact.influence),
    )


@pytest.mark.parametrize("digits", [3, 5, 8, 12])
@pytest.mark.parametrize("fraction", [1e-6, 0.1, 0.37, 0.6, 0.999])
@pytest.mark.parametrize("control", ["approach", "load"])
@pytest.mark.parametrize("influence", KINDS)
def test_doubt_about_the_loads_is_counted(
    influence: Any, control: str, fraction: float, digits: int
) -> None:
    """Starting from rounded loads, with the certificate of those, the bounds cover the truth."""
    contact, truth = pressed("paper", influence, control), exact("paper", fraction, control)
    doubtful = in_doubt(contact, digits, control)
    problem = TangentialProblem.of(doubtful)
    known = Known.of(problem, doubtful)
    missed = doubtful.loads[problem.touching] - contact.loads[problem.touching]
    missed[~known.sure] = 0.0
    weights = np.where(known.sure, known.stiffness, 0.0)
    distance = np.sqrt(np.sum(weights * (missed / problem.units.force) ** 2))
    assert distance <= known.distance * (1 + 1e-9) + 1e-13
    assert known.scaled(np.ones(len(problem))) <= known.distance * (1 + 1e-9)
    state = cr.shear(doubtful, force=fraction * FRICTION * contact.load)
    certificate = state.certificate
    for i, true in enumerate(truth.forces):
        assert off(state.forces[i], true) <= certificate.force_errors[i]
        assert off(state.slips[i], truth.slips[i]) <= certificate.slip_errors[i]
        assert certificate.status[i] != ("partial" if truth.slips[i] > 0 else "sliding")
    assert off(state.displacement, truth.displacement) <= certificate.displacement_error


@pytest.mark.parametrize("kind", ["approach", "load", "random", "one", "fringe"])
@pytest.mark.parametrize("fraction", [1e-6, 0.1, 0.3, 0.6, 0.95])
@pytest.mark.parametrize("influence", KINDS)
def test_all_that_wrong_loads_can_do_is_counted(influence: Any, fraction: float, kind: str) -> None:
    """A certificate that leaves the loads no room beyond what they are off by."""
    contact = pressed("rough", influence, "load" if kind == "load" else "approach")
    off_by, loaded, approach = 1e-6, contact.loads > 0, contact.approach
    if kind in ("approach", "load"):
        near = cr.press(contact.scene, approach=approach * (1 + off_by), influence=influence)
        loads, approach = near.loads, near.approach
    else:
        size = np.random.default_rng(5).choice([-1, 1], len(loaded)).astype(float)
        if kind != "random":
            order = np.argsort(np.where(loaded, contact.loads, np.inf))
            chosen = order[:6] if kind == "fringe" else order[int(loaded.sum()) - 1 :]
            size = np.isin(np.arange(len(loaded)), chosen).astype(float)
        loads = contact.loads * (1 + off_by * size)
    wrong = replace(
        contact,
        loads=loads,
        load=float(loads.sum()),
        contact_radii=hertz.contact_radius(loads, 1.0, contact.scene.relative_radii),
        certificate=replace(
            contact.certificate,
            load_errors=np.abs(loads - contact.loads) * (1 + 1e-9) + 1e-14 * contact.loads,
            approach=approach if kind == "load" else contact.approach,
            approach_error=abs(approach - contact.approach) if kind == "load" else 0.0,
        ),
    )
    problem = TangentialProblem.of(wrong)
    known = Known.of(problem, wrong)
    missed = (loads - contact.loads)[problem.touching] / problem.units.force
    distance = np.sqrt(known.stiffness @ missed**2)
    assert distance <= known.distance * (1 + 1e-9)
    assert known.distance < 2 * distance
    force = fraction * FRICTION * contact.load
    state, truth = cr.shear(wrong, force=force), cr.shear(contact, force=force)
    proof = state.certificate
    assert (np.abs(state.forces - truth.forces) <= proof.force_errors).all()
    assert (np.abs(state.slips - truth.slips) <= proof.slip_errors).all()
    assert abs(state.displacement - truth.displacement) <= proof.displacement_error
    assert proof.force_errors.max() < 1e-3 * state.forces.max()
    assert (state.status == truth.status).all()


@pytest.mark.parametrize("ulps", [0, 2, -2, 8, -8])
@pytest.mark.parametrize("fraction", [1e-12, 1e-9, 0.25, 0.9])
def test_an_asperity_that_may_or_may_not_touch(fraction: float, ulps: int) -> None:
    """Its slip is unknown, and what it could carry is in the bounds of the other."""
    spacing, approach = 0.0025, 5e-5

    def scene(height: float) -> cr.Scene:
        asperities = cr.Asperities([[0, 0], [spacing, 0]], 0.02, [0, height])
        return cr.Scene(1.0, asperities, MATERIAL, FRICTION)

    alone = cr.press(scene(-1.0), approach=approach).loads[0]
    height = alone / (np.pi * spacing) - approach + spacing**2 / 2
    contact = cr.press(scene(height + ulps * np.spacing(height)), approach=approach)
    state = cr.shear(contact, force=fraction * FRICTION * contact.load)
    if contact.status[1] == "undecided":
        assert state.status[1] == "undecided"
        assert np.isinf(state.certificate.slip_errors[1])
        lost = FRICTION * contact.certificate.load_errors[1]
        assert state.certificate.force_errors[1] >= lost
        assert state.certificate.force_errors[0] >= 0.5 * lost


def test_just_before_gross_sliding_the_last_one_sticks() -> None:
    contact = pressed("paper")
    state = cr.shear(contact, force=FRICTION * contact.load * (1 - 1e-11))
    assert (state.status == "sliding").sum() == 36
    assert state.status[0] == "partial"
    assert state.certificate.holds


@pytest.mark.parametrize("force", [[1e-8, 2e-8], "a", None, 1 + 1j])
def test_a_force_is_a_number(force: object) -> None:
    with pytest.raises(cr.InputError):
        cr.shear(pressed("paper"), force=force)  # type: ignore[arg-type]


def test_an_uncertified_contact_gets_no_word() -> None:
    lattice = cr.Asperities.hexagonal(spacing=0.0025, tip_radius=5.0, within=0.0102)
    contact = cr.press(cr.Scene(1.0, lattice, MATERIAL, 0.5), approach=PAPER_APPROACH)
    assert contact.certificate.scope == "none"
    state = cr.shear(contact, force=0.1 * FRICTION * contact.load)
    assert state.certificate.scope == "none"
    assert not state.certificate.holds
    assert (state.status == "undecided").all()
