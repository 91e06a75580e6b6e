"""Derivatives of the loss, against differences in 130 digits and the identities they obey."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from friction_scenes import FRICTION, with_friction
from gradient_oracle import Judge, Setup, Sheared, assert_slopes, close, exact, press, sheared
from scenes import NAMED

import convexrough as cr
from convexrough.sphere import mindlin

#: What float64 leaves, over the largest term; and close to gross sliding, where 1 - Q / (f P) is
#: itself known to a part in 1e13 only.
CLOSE, NEAR_GROSS = 2e-13, 1e-12
#: In a contact this crowded a roundoff of the approach moves derivatives by positions by 1.4e-13.
DRAGGED = 1e-12


def pressed(name: str, control: str) -> cr.Contact:
    scene, approach = NAMED[name]
    contact = cr.press(with_friction(scene), approach=approach)
    return contact if control == "approach" else cr.press(contact.scene, load=contact.load)


def judged(contact: cr.Contact, holding: str, force: float) -> Judge:
    """The loss of the cycle between +-Q, by (Q, -Q)."""
    solved = sheared(contact, holding, force)

    def value(setup: Setup, near: Any) -> tuple[Any, Any]:
        amplitude = (setup.forces[0] - setup.forces[1]) / 2
        state = solved(replace(setup, forces=np.array([amplitude])), near)
        return state.loss, state

    return Judge(Setup.of(contact, holding, [force, -force]), value)


CASES = [
    ("paper", "load", 1e-9),
    ("paper", "load", 0.5),
    ("paper", "approach", 0.1),
    ("paper, closest", "load", 0.99),
    ("rough", "load", 1e-3),
    ("rough", "approach", 0.9),
    ("rough", "load", 0.999),
    ("rough, closest", "approach", 1e-6),
    ("rough, closest", "load", 0.5),
    ("steel", "approach", 0.5),
]


@pytest.mark.parametrize(("name", "holding", "fraction"), CASES)
def test_every_derivative_of_the_loss(name: str, holding: str, fraction: float) -> None:
    contact = pressed(name, holding)
    force = fraction * FRICTION * contact.load
    judge = judged(contact, holding, force)
    gradient = cr.cycle(contact, maximum=force).gradient()
    assert gradient.holding == holding
    assert gradient.value == pytest.approx(float(judge.at), rel=2e-14)
    enough = CLOSE if fraction < 0.99 else NEAR_GROSS
    assert_slopes(judge, gradient, enough)
    for direction, slope in (([force, 0], gradient.maximum), ([0, force], gradient.minimum)):
        close(judge.slope("forces", exact(direction)), np.array([slope * force]), enough, "forces")


def test_each_height_by_itself() -> None:
    contact = pressed("rough", "load")
    force = 0.3 * FRICTION * contact.load
    judge, gradient = judged(contact, "load", force), cr.cycle(contact, maximum=force).gradient()
    worst = np.abs(gradient.heights).max()
    for i in np.flatnonzero(contact.loads)[::6]:
        one = np.zeros(len(contact.scene))
        one[i] = contact.approach
        found = judge.slope("heights", exact(one)) / contact.approach
        assert abs(found - gradient.heights[i]) <= 3e-14 * worst


#: Of the paper's scene at this load with f = 0.5: the asperities F, D, B, A, and the rest.
REFERENCE = {
    9e-8: {
        "value": 1.35549370702e-13,
        "heights": (5.85650309932e-10, 5.62555012938e-10, -7.53379944689e-10, -1.60288736774e-10),
        "tip": 1.05616394214e-13,
        "x": 4.01746346873e-12,
        "sphere_radius": -1.51922764098e-13,
        "contact_modulus": 6.48593171837e-15,
        "poisson_ratio": 1.13907034203e-13,
        "friction": -4.29159681105e-13,
        "load": -9.88254936336e-07,
        "amplitude": 5.39642868840e-06,
    },
    1.8e-13: {
        "value": 4.39309250870e-31,
        "heights": (1.50925535374e-27, 1.58643953664e-27, -4.25123930984e-28, -4.05505718737e-27),
        "tip": 3.10929713493e-31,
        "x": 2.98718616296e-29,
        "sphere_radius": -5.65993817341e-31,
        "contact_modulus": 8.78408654762e-32,
        "poisson_ratio": 3.69167437706e-31,
        "friction": -8.78619465915e-31,
        "load": -2.67826180594e-24,
        "amplitude": 7.32182352610e-18,
    },
}


@pytest.mark.parametrize("force", REFERENCE)
def test_reference_values(force: float) -> None:
    contact = cr.press(with_friction(NAMED["paper"][0]), load=3.60853389e-7)
    gradient, known = cr.cycle(contact, maximum=force).gradient(), dict(REFERENCE[force])
    found = {name: getattr(gradient, name) for name in known if hasattr(gradient, name)}
    found["heights"] = tuple(gradient.heights[[0, 7, 19, 31]])
    found["tip"], found["x"] = gradient.tip_radii[0], gradient.positions[31, 0]
    found["amplitude"] = gradient.maximum - gradient.minimum
    for name, value in known.items():
        assert found[name] == pytest.approx(value, rel=1e-11), name


@pytest.mark.parametrize("name", NAMED)
@pytest.mark.parametrize("holding", ["load", "approach"])
@pytest.mark.parametrize("fraction", [1e-9, 1e-3, 0.5, 0.99])
def test_identities(name: str, holding: Any, fraction: float) -> None:
    contact = pressed(name, "load")
    g = cr.cycle(contact, maximum=fraction * FRICTION * contact.load).gradient(holding=holding)
    scene, W = contact.scene, g.value
    assert g.balance_defect < 2e-14
    x, y = scene.asperities.positions.T
    turned = x * g.positions[:, 1] - y * g.positions[:, 0]
    assert abs(turned.sum()) <= 1e-13 * np.abs(turned).sum() + 1e-30 * W
    assert g.maximum is not None
    amplitude = g.maximum * fraction * FRICTION * contact.load
    sizes = (
        scene.asperities.heights @ g.heights
        + scene.asperities.tip_radii @ g.tip_radii
        + (scene.asperities.positions * g.positions).sum()
        + scene.sphere_radius * g.sphere_radius
    )
    if g.load is not None:
        assert abs(g.heights.sum()) <= 1e-13 * np.abs(g.heights).sum()
        # lengths by s and forces by s^2 leave all pressures: the loss grows by s^3
        assert sizes + 2 * contact.load * g.load + 4 * amplitude == pytest.approx(3 * W, rel=1e-11)
    else:
        assert g.approach is not None
        assert g.heights.sum() == pytest.approx(g.approach, rel=1e-12)
        sizes += contact.approach * g.approach
        assert sizes + 4 * amplitude == pytest.approx(3 * W, rel=1e-11)


def test_a_ring_of_a_symmetric_scene_has_one_gradient() -> None:
    contact = pressed("paper", "load")
    gradient = cr.cycle(contact, maximum=0.2 * contact.load).gradient()
    distances = contact.scene.asperities.distances.round(9)
    for ring in np.unique(distances[contact.loads > 0]):
        heights = gradient.heights[distances == ring]
        across = np.hypot(*gradient.positions[distances == ring].T)
        if len(heights) == 12:  # two mirrored halves
            continue
        np.testing.assert_allclose(heights, heights[0], rtol=1e-11)
        np.testing.assert_allclose(across, across[0], rtol=1e-10, atol=1e-25)


def test_a_cycle_that_does_not_move_costs_nothing_and_changes_nothing() -> None:
    contact = pressed("rough", "load")
    still = cr.cycle(contact, maximum=0.1 * contact.load, minimum=0.1 * contact.load).gradient()
    assert not still.heights.any()
    assert still.maximum == still.load == still.friction == still.balance_defect == 0.0
    assert (still.positions == 0).all()


def test_only_the_range_matters() -> None:
    contact = pressed("rough", "load")
    P = contact.load
    one = cr.cycle(contact, maximum=0.2 * P).gradient()
    other = cr.cycle(contact, maximum=0.3 * P, minimum=-0.1 * P).gradient()
    np.testing.assert_allclose(one.heights, other.heights, rtol=1e-9, atol=1e-20)
    assert other.minimum == -other.maximum  # type: ignore[operator]


def dragged(low: float) -> cr.Contact:
    """Six crowded asperities drag a lower one in the middle further than the deep points go."""
    angles = np.pi / 3 * np.arange(6)
    ring = 0.0025 * np.stack((np.cos(angles), np.sin(angles)), axis=1)
    heights = np.append(-low, 4e-7 * np.arange(6))
    asperities = cr.Asperities(np.vstack(([[0.0, 0.0]], ring)), 0.02, heights)
    return cr.press(
        with_friction(cr.Scene(1.0, asperities, cr.Material(1.0, 0.3))), approach=3.5e-4
    )


@pytest.mark.parametrize(
    ("low", "fraction", "slides"),
    [(4.5e-5, 0.02, False), (4.8e-5, 0.1, False), (4.86e-5, 0.1, True)],
)
@pytest.mark.parametrize("holding", ["load", "approach"])
def test_backward_increments(low: float, fraction: float, slides: bool, holding: Any) -> None:
    contact = dragged(low)
    force = fraction * FRICTION * contact.load
    state = cr.shear(contact, force=force)
    assert state.forces[0] < 0
    assert (state.slips[0] < 0) == slides
    judge = judged(contact, holding, force)
    gradient = cr.cycle(contact, maximum=force).gradient(holding=holding)
    # The trapezoid rule between P and P - T is not the loss here; the increments' energy is.
    assert gradient.value == pytest.approx(float(judge.at), rel=1e-12)
    assert_slopes(judge, gradient, DRAGGED)


def test_one_asperity_that_sticks() -> None:
    """All others slide, and what they feel must not be left out."""
    contact = pressed("paper", "load")
    force = cr.onset_of_sliding(contact, which=[1])[0] * 1.001
    assert (cr.shear(contact, force=force).slips == 0).sum() == 25
    judge = judged(contact, "load", force)
    assert_slopes(judge, cr.cycle(contact, maximum=force).gradient(), NEAR_GROSS)


def test_scope_none() -> None:
    """No certificate is needed, only that the state is a minimum: where nothing is proved of it."""
    asperities = cr.Asperities.hexagonal(spacing=0.0025, tip_radius=0.02, within=0.0051)
    scene = with_friction(cr.Scene(1.0, asperities, cr.Material(1.0, 0.3)))
    contact = cr.press(scene, approach=7e-4)
    assert contact.crowding > 1.6
    contact = replace(contact, certificate=replace(contact.certificate, scope="none"))
    force = 0.4 * FRICTION * contact.load
    judge = judged(contact, "approach", force)
    assert_slopes(judge, cr.cycle(contact, maximum=force).gradient(), NEAR_GROSS)


def test_gross_sliding_from_one_side() -> None:
    contact = pressed("rough", "load")
    force = FRICTION * contact.load
    gradient = cr.cycle(contact, maximum=force).gradient()
    assert (gradient.maximum, gradient.load, gradient.friction) == (np.inf, -np.inf, -np.inf)

    def value(setup: Setup, near: Any) -> tuple[Any, Any]:
        oracle = press(contact, setup, near)
        felt = oracle.inner @ oracle.P
        rise = max(oracle.ceilings + felt)
        gross = Sheared(oracle, oracle.P.sum(), rise - felt, oracle.P, rise)
        return gross.loss, oracle

    judge = Judge(Setup.of(contact, "load"), value)
    assert gradient.value == pytest.approx(float(judge.at), rel=1e-13)
    finite = replace(gradient, load=None, friction=None)
    assert_slopes(judge, finite, CLOSE)
    near = cr.cycle(contact, maximum=force * (1 - 1e-9)).gradient()
    np.testing.assert_allclose(gradient.heights, near.heights, atol=1e-3 * gradient.heights.max())


def test_no_derivative_in_gross_sliding() -> None:
    contact = pressed("rough", "load")
    force = FRICTION * contact.load
    with pytest.raises(cr.InputError, match="with the approach held f P may fall below"):
        cr.cycle(contact, maximum=force).gradient(holding="approach")
    pair = cr.Asperities([[0.0, 0.0], [0.003, 0.0]], 0.02, [0.0, 4.5e-6])
    even = with_friction(cr.Scene(1.0, pair, cr.Material(1.0, 0.3)))
    together = cr.press(even, load=1e-8)
    with pytest.raises(cr.InputError, match="several asperities slide last, together"):
        cr.cycle(together, maximum=FRICTION * together.load).gradient()
    with pytest.raises(cr.InputError, match="asperity: found 1, which slides last, together with"):
        cr.onset_gradient(together, 1)


def directly(contact: cr.Contact, fraction: float) -> tuple[Any, Any]:
    """The direct form: 8 c_t f^2 times -u + T (q(P) + q(P - T)) / 2, q = dP_i / dP.

    With u by two pressed states, and from the increments.
    """
    scene, P = contact.scene, contact.load
    left = cr.press(scene, load=P * (1 - fraction))
    shares = [-each.gradient(approach=1.0, holding="load").heights for each in (contact, left)]
    state = cr.shear(contact, force=fraction * FRICTION * P)
    unit = 8 * mindlin.ratio(scene.material.poisson_ratio) * FRICTION**2
    ends = fraction * P / 2 * (shares[0] + shares[1])
    return unit * (ends + left.loads - contact.loads), unit * (ends - state.forces / FRICTION)


def test_the_direct_form_cancels() -> None:
    """It is right, and loses digits as (f P / Q)^3 by two pressed states, ^2 by increments."""
    contact = pressed("rough", "load")
    one = np.zeros(len(contact.scene))
    for fraction in (0.5, 1e-2, 1e-4, 1e-6):
        force = fraction * FRICTION * contact.load
        heights = cr.cycle(contact, maximum=force).gradient().heights
        i = int(np.argmax(np.abs(heights)))
        one[:] = 0.0
        one[i] = contact.approach
        true = judged(contact, "load", force).slope("heights", exact(one)) / contact.approach
        by_states, by_increments = (abs(each[i] / true - 1) for each in directly(contact, fraction))
        assert abs(heights[i] / true - 1) < 1e-14
        if fraction == 0.5:
            assert by_states < 1e-14
            assert by_increments < 1e-14
        else:
            assert 1.0 < by_states / (2.0**-53 / fraction**3) < 100.0
            assert 1.0 < by_increments / (2.0**-53 / fraction**2) < 1000.0


def test_the_direct_form_is_not_that_of_backward_increments() -> None:
    contact, fraction = dragged(4.8e-5), 0.1
    gradient = cr.cycle(contact, maximum=fraction * FRICTION * contact.load).gradient(
        holding="load"
    )
    _, found = directly(contact, fraction)
    assert np.abs(found - gradient.heights).max() > 1e-4 * np.abs(gradient.heights).max()


@pytest.mark.parametrize("holding", ["load", "approach"])
def test_at_a_held_displacement(holding: Any) -> None:
    """dW|X = dW|Q - (W_Q / X_Q) dX|Q, against cycles of that displacement amplitude."""
    contact, moved = pressed("rough", holding), 6e-6
    cycle = cr.cycle(contact, displacement=moved)
    loss = cycle.gradient()
    far = cr.shear(contact, force=cycle.force_amplitude).gradient(displacement=1.0)
    assert loss.maximum is not None
    assert far.force is not None
    slopes = loss.heights - 2.0 * loss.maximum / far.force * far.heights
    scene, v = contact.scene, np.random.default_rng(5).normal(size=len(contact.scene))

    def lost(step: float) -> float:
        heights = scene.asperities.heights + step * v
        asperities = replace(scene.asperities, heights=heights)
        there = replace(scene, asperities=asperities)
        again = cr.press(there, load=contact.prescribed_load,
                         approach=None if holding == "load" else contact.approach)  # fmt: skip
        return cr.cycle(again, displacement=moved).energy

    h = 3e-10
    found = (lost(-2 * h) - 8 * lost(-h) + 8 * lost(h) - lost(2 * h)) / (12 * h)
    assert found == pytest.approx(slopes @ v, rel=1e-7)
    assert found != pytest.approx(loss.heights @ v, rel=1e-2)
