"""The words and bounds of friction under attack: wrong states, and loads in doubt."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from flint import arb, ctx
from friction_scenes import FRICTION, KINDS, NAMES, exact, in_doubt, off, pressed
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import MATERIAL, scattered, solve_exactly, twins

import convexrough as cr
from convexrough.roundoff import ROUNDOFF
from convexrough.shearing.judgement import judge_states
from convexrough.shearing.load_errors import LoadErrors
from convexrough.shearing.problem import TangentialProblem
from convexrough.sphere import annulus, hertz


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
    bounds = judge_states(problem, wrong)
    truly_sliding = good.slips > 0
    assert not (bounds.sliding & ~truly_sliding).any()
    assert not (bounds.partial & truly_sliding).any()
    assert (np.abs(u - good.increments) <= bounds.increments * (1 + 1e-9)).all()
    assert (np.abs(wrong.rises - good.rises) <= bounds.rises * (1 + 1e-9)).all()


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
    known = LoadErrors.of(problem)
    missed = doubtful.loads[problem.touching] - contact.loads[problem.touching]
    missed[~known.sure] = 0.0
    weights = np.where(known.sure, known.stiffness, 0.0)
    distance = np.sqrt(np.sum(weights * (missed / problem.units.force) ** 2))
    assert distance <= known.distance * (1 + 1e-9) + 1e-13
    assert known.image_norm(np.ones(len(problem))) <= known.distance * (1 + 1e-9)
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
    known = LoadErrors.of(problem)
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


def test_the_law_keeps_its_digits_up_to_full_slip() -> None:
    """Read forwards, from a force to its deflection, and to the loss: roundoffs of the result."""
    problem = TangentialProblem.of(pressed("rough"))
    rng = np.random.default_rng(2)
    P = problem.loads
    for _ in range(20):
        u = P * (1 - 2.0 ** rng.uniform(-53, -1, len(P)))
        with ctx.workprec(300):
            for own, loss, ceiling, a, b in zip(
                problem.deflections(u), annulus.loss(problem.widths(u)), problem.ceilings, u, P,
                strict=True,
            ):  # fmt: skip
                t = arb(float(a)) / arb(float(b))
                s = (1 - t).root(3)
                true = arb(float(ceiling)) * (1 - s**2)
                assert abs(arb(float(own)) - true) <= 12 * ROUNDOFF * true
                lost = 1 - s**5 - 5 * t / 6 * (1 + s**2)
                assert abs(arb(float(loss)) - lost) <= 20 * ROUNDOFF * lost


def ring_of_six(turns: float = 0.0) -> cr.Scene:
    """Alike in all respects: at any shear force all of them slide, or none."""
    angles = 2 * np.pi * np.arange(6) / 6 + turns
    points = 3e-3 * np.column_stack((np.cos(angles), np.sin(angles)))
    return cr.Scene(1.0, cr.Asperities(points, 0.02), MATERIAL, FRICTION)


@pytest.mark.parametrize("control", ["approach", "load"])
def test_at_the_limit_not_all_are_said_to_slide(control: str) -> None:
    """f times the computed loads may lie below f times the true ones, where at least one sticks."""
    scene, below = ring_of_six(), 0
    for approach in np.linspace(3e-5, 9e-5, 12):
        contact = cr.press(scene, approach=approach)
        if control == "load":
            contact = cr.press(scene, load=contact.load)
        true = solve_exactly(scene, **{control: getattr(contact, control)}, start=contact.loads)
        below += bool(contact.load < true.load)
        limit = FRICTION * contact.load
        state = cr.shear(contact, force=limit)
        assert (state.status == "undecided").all()
        assert state.certificate.scope == "global"
        assert (off_each(state.forces, true.loads) <= state.certificate.force_errors).all()
        assert (cr.cycle(contact, maximum=limit).status == "undecided").all()
        assert np.isfinite(cr.history(contact, forces=[limit]).displacement_errors).all()
    assert control == "load" or below


def off_each(forces: Any, loads: Any) -> Any:
    return np.array([off(q, FRICTION * load) for q, load in zip(forces, loads, strict=True)])


def test_at_the_limit_of_loads_that_are_poor_but_certified() -> None:
    """Of a loosely pressed contact f P is short by a thousandth: the last ring does not slide."""
    scene = ring_of_six()
    true = cr.press(scene, approach=5e-5)
    loose = cr.solvers.Newton(tolerance=0.5)
    contact = cr.press(scene, approach=5e-5, solver=loose, start=0.999 * true.loads)
    assert contact.certificate.holds
    assert contact.load < true.load * (1 - 5e-4)
    state = cr.shear(contact, force=FRICTION * contact.load)
    truth = cr.shear(true, force=FRICTION * contact.load)
    assert (truth.status == "partial").all()
    assert not (state.status == "sliding").any()
    assert (np.abs(state.forces - truth.forces) <= state.certificate.force_errors).all()


def test_at_the_limit_with_one_that_may_not_touch() -> None:
    """A grazing asperity takes no word from those that are proved to slide."""
    points = [[0, 0], [2.5e-3, 0], [-2.5e-3, 0], [0, 6e-3]]

    def scene(height: float) -> cr.Scene:
        return cr.Scene(
            1.0, cr.Asperities(points, 0.02, [0, -2e-5, -2e-5, height]), MATERIAL, FRICTION
        )

    low = -1e-4
    contact = cr.press(scene(low + cr.press(scene(low), approach=5e-5).gaps[3]), approach=5e-5)
    assert contact.status[3] == "undecided"
    state = cr.shear(contact, force=FRICTION * contact.load)
    assert state.status.tolist() == ["undecided", "sliding", "sliding", "undecided"]


@pytest.mark.parametrize("seed", [0, 2, 6])
@pytest.mark.parametrize("fraction", [1e-9, 0.3, 0.7])
def test_a_crowded_contact_proved_by_cholesky(fraction: float, seed: int) -> None:
    """No shells prove its convexity; what proved the contact proves its friction."""
    scene, approach = scattered(seed, 8, 2.0, 0.1)
    contact = cr.press(replace(scene, friction=FRICTION), approach=approach, influence="dense")
    assert contact.crowding > 1
    assert contact.certificate.scope == "global"
    assert contact.certificate.convexity_number in (0.9, 0.999)
    state = cr.shear(contact, force=fraction * FRICTION * contact.load)
    assert state.certificate.holds
    truth = cr.shear_vector(with_poisson(contact, 0.0), force=fraction * FRICTION * contact.load)
    errors = state.certificate.force_errors + truth.certificate.force_errors
    assert (np.abs(state.forces - truth.forces[:, 0]) <= errors).all()
    assert errors.max() < 1e-8 * state.forces.max()


def with_poisson(contact: cr.Contact, nu: float) -> cr.Contact:
    material = cr.Material(contact.scene.material.contact_modulus, nu)
    return replace(contact, scene=replace(contact.scene, material=material))


def test_an_uncertified_contact_gets_no_word() -> None:
    scene, load = twins()
    contact = cr.press(scene, load=load)
    assert contact.certificate.scope == "none"
    state = cr.shear(contact, force=0.1 * FRICTION * contact.load)
    assert state.certificate.scope == "none"
    assert not state.certificate.holds
    assert (state.status == "undecided").all()
