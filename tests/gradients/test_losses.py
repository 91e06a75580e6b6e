"""Derivatives of losses and displacements against differences of levels, and in optimisers."""

import pickle
from dataclasses import replace
from operator import attrgetter
from typing import Any

import numpy as np
import pytest
from flint import arb, ctx
from friction_scenes import FRICTION, SCENES, pressed, with_friction
from levels_reference import (
    DIGITS,
    NAMES,
    STEP,
    Setup,
    assert_close,
    judge_of,
    known,
    loss_and_displacement,
    of_setup,
)
from multiprecision import exact
from scenes import NAMED, OPERATORS, hexagonal, paper, scattered, stepped

import convexrough as cr

#: Of the largest entry of its kind: what bounds may be from Q / f P = 1e-2 to 0.999.
SHARP = 1e-14


def assert_both(
    contact: cr.Contact, force: float, holding: Any, sharp: float, seed: int = 0
) -> None:
    """Values and derivatives, of arrays along random signs and by two entries, and their bounds."""
    loss = cr.cycle(contact, maximum=force).gradient(holding=holding)
    moved = cr.shear(contact, force=force).gradient(displacement=1.0, holding=holding)
    assert max(loss.balance_defect, moved.balance_defect) < 1e-14
    judge = judge_of(loss_and_displacement, contact, holding, force)
    rng, both = np.random.default_rng(seed), ((loss, "maximum"), (moved, "force"))
    with ctx.workdps(DIGITS):
        for gradient, true in zip((loss, moved), judge.at, strict=True):
            assert abs(arb(gradient.value) - true) <= gradient.value_error
    for name in (*NAMES, "control", "forces"):
        signs = rng.choice([-1.0, 1.0], size=np.shape(getattr(judge.setup, name)))
        some = rng.choice(signs.size, min(2, signs.size), replace=False)
        for v in (signs, *np.eye(signs.size)[some].reshape(-1, *signs.shape)):
            true_slopes = judge.difference(name, exact(v)[()])
            for (gradient, own), true in zip(both, true_slopes, strict=True):
                one = {"control": holding, "forces": own}.get(name, name)
                slopes, errors = known(gradient, one)
                ends = 2.0 if one == "maximum" else 1.0  # that move
                parts = ends * slopes * v, ends * errors * np.abs(v)
                assert_close(true, *parts, name, sharp if v is signs else 0.0)


@pytest.mark.sample(3)
@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("fraction", [1e-2, 0.4, 0.999])
@pytest.mark.parametrize("holding", ["load", "approach"])
def test_every_derivative(name: str, fraction: float, holding: str) -> None:
    contact = pressed(name, control=holding)
    assert_both(contact, fraction * FRICTION * contact.load, holding, SHARP)


@pytest.mark.sample(1)
@pytest.mark.parametrize("fraction", [1e-9, 1e-6, 1e-4, 1 - 1e-7])
def test_bounds_are_honest_where_they_are_not_sharp(fraction: float) -> None:
    contact = pressed("rough", control="load")
    assert_both(contact, fraction * FRICTION * contact.load, "load", 0.0)


@pytest.mark.sample(5)
@pytest.mark.parametrize("seed", range(40))
def test_no_bound_is_too_small(seed: int) -> None:
    """Of one to eight asperities anywhere, of any sizes and friction."""
    rng = np.random.default_rng(seed)
    scene, approach = scattered(seed, int(rng.integers(1, 9)), rng.uniform(0.05, 0.8), 0.5)
    tips = scene.asperities.tip_radii * 10.0 ** rng.uniform(-0.7, 0.7, len(scene))
    scene = replace(scene, asperities=replace(scene.asperities, tip_radii=tips))
    scene = with_friction(scene, rng.uniform(0.1, 1.0), rng.uniform(0.0, 0.5))
    contact = cr.press(scene, approach=approach)
    if contact.certificate.scope == "none":
        return
    holding = "approach"
    if rng.uniform() < 0.5:
        contact, holding = cr.press(scene, load=contact.load), "load"
    fraction = float(rng.choice([1e-3, 0.1, 0.9, rng.uniform()]))
    force = fraction * (scene.friction or 0.0) * contact.load
    assert_both(contact, force, holding, 0.0, seed)


def test_gross_sliding_from_one_side() -> None:
    contact = pressed("rough", control="load")
    force = FRICTION * contact.load
    gradient = cr.cycle(contact, maximum=force).gradient()
    assert (gradient.maximum, gradient.load, gradient.friction) == (np.inf, -np.inf, -np.inf)
    near = cr.cycle(contact, maximum=force * (1 - 1e-12)).gradient()
    np.testing.assert_allclose(gradient.heights, near.heights, atol=1e-3 * gradient.heights.max())
    moved = cr.shear(contact, force=force).gradient(displacement=1.0)
    assert (moved.force, moved.load, moved.friction) == (np.inf, -np.inf, -np.inf)
    top = contact.gradient(approach=1.0).heights
    unit = 2.0 * gradient.poisson_ratio / gradient.value  # c_t by its derivative, and f
    assert unit > 0
    first = np.arange(len(top)) == np.argmax(contact.scene.offsets)
    ratio = (2 - 0.3) / (2 * 0.7) * FRICTION
    np.testing.assert_allclose(moved.heights, ratio * (top + first), rtol=1e-14)


def test_many_asperities_by_every_operator() -> None:
    scene = with_friction(hexagonal(2.5e-4, 2e-3, 2.5e-3, height_std=3e-8, seed=1))
    contacts = {kind: cr.press(scene, load=1e-8, influence=kind) for kind in OPERATORS}
    found = {kind: cr.cycle(each, maximum=2e-9).gradient() for kind, each in contacts.items()}
    for kind, each in found.items():
        for name in NAMES[:5]:
            values, errors = known(each, name)
            true, known_to = known(found["dense"], name)
            assert (np.abs(values - true) <= errors + known_to).all(), (kind, name)
            most = SHARP if kind == "dense" else 1e-6
            assert (errors <= most * np.abs(true).max()).all(), (kind, name)


@pytest.mark.sample(1)
@pytest.mark.parametrize("holding", ["load", "approach"])
@pytest.mark.parametrize("name", ["rough", "rough, closest"])
def test_normalised(name: str, holding: Any) -> None:
    """Against differences of W / W0 in float64, by everything at once."""
    contact = pressed(name, control=holding)
    force = 0.3 * contact.load
    gradient = cr.cycle(contact, maximum=force).gradient().normalised
    scene, rng = contact.scene, np.random.default_rng(2)
    n, E = len(scene), scene.material.contact_modulus
    steps = {"heights": 1e-8 * rng.normal(size=n), "positions": 1e-4 * rng.normal(size=(n, 2))}
    steps["tip_radii"] = scene.asperities.tip_radii * rng.normal(size=n)

    def normalised(h: float) -> float:
        material, radius = cr.Material(E + 0.4 * h, 0.3), scene.sphere_radius + 0.7 * h
        there = replace(stepped(scene, h, steps), material=material, sphere_radius=radius)
        pressed = cr.press(there, **{holding: getattr(contact, holding)})
        return cr.cycle(pressed, maximum=force).loss_normalised

    slope = sum(np.sum(getattr(gradient, name) * step) for name, step in steps.items())
    slope += 0.7 * gradient.sphere_radius + 0.4 * gradient.contact_modulus
    assert slope == pytest.approx((normalised(1e-4) - normalised(-1e-4)) / 2e-4, rel=1e-4)
    errors = np.abs(gradient.height_errors).max()
    assert 0 < errors <= SHARP * np.abs(gradient.heights).max()


def test_a_pickled_cycle_keeps_the_force_of_its_displacement() -> None:
    """It was rounded to float64, so that the loss was outside its bounds."""
    cycle = cr.cycle(pressed("rough"), displacement=3e-6)
    one, two = (each.gradient() for each in (cycle, pickle.loads(pickle.dumps(cycle))))
    assert abs((one.number.value - two.number.value).value) <= one.value_error


def test_weights_along_a_history() -> None:
    """Weights that cancel lose no digit; at held load the displacement has a derivative by it."""
    contact = cr.press(with_friction(paper()), load=3e-7)
    force = 0.3 * FRICTION * contact.load
    path = cr.history(contact, forces=[force] * 3)
    cancelled = path.gradient(losses=[1e16 + 2, 1.0, -1e16])
    assert cancelled.value == pytest.approx(3 * path.losses[-1], rel=1e-15)
    moved = path.gradient(displacements=[0.0, 0.0, 1.0], holding="load")
    once = cr.shear(contact, force=force).gradient(displacement=1.0, holding="load")
    assert moved.load == pytest.approx(once.load, rel=1e-14)


def direction(contact: cr.Contact, holding: str, force: float, seed: int = 0) -> cr.Direction:
    """A change of everything at once, each by about its own size."""
    rng, scene = np.random.default_rng(seed), contact.scene
    n, f = len(scene), scene.friction or 1.0
    control: Any = {holding: getattr(contact, holding) * 0.7}
    return cr.Direction(
        heights=contact.approach * rng.normal(size=n),
        tip_radii=scene.asperities.tip_radii * rng.normal(size=n),
        positions=0.0025 * rng.normal(size=(n, 2)) * (np.ptp(scene.asperities.positions) / 0.02),
        sphere_radius=-0.3 * scene.sphere_radius,
        contact_modulus=0.4 * scene.material.contact_modulus, poisson_ratio=0.2, friction=-0.6 * f,
        force=0.8 * force, **control,
    )  # fmt: skip


CASES = [
    ("paper", "load", 0.5), ("rough", "approach", 1e-6), ("rough, closest", "load", 0.3),
    ("rough, closest", "approach", 0.9), ("steel", "approach", 0.5),
]  # fmt: skip

CHANGED = ["pressed.loads", "pressed.gaps", "pressed.load", "pressed.approach"]
CHANGED += ["forces", "slips", "displacement"]


@pytest.mark.sample(2)
@pytest.mark.parametrize(("name", "holding", "fraction"), CASES)
def test_everything_that_changes(name: str, holding: str, fraction: float) -> None:
    contact = pressed(name, control=holding)
    force = fraction * FRICTION * contact.load
    along = direction(contact, holding, force)
    change = cr.shear(contact, force=force).change(along)
    setup = Setup.of(contact, holding, [force])
    steps = {name: exact(getattr(along, name))[()] for name in NAMES}
    steps |= {"control": arb(getattr(along, holding)), "forces": exact([along.force])}
    with ctx.workdps(DIGITS):
        h = arb(STEP)
        there = (setup.moved(**{name: s * h * it for name, it in steps.items()}) for s in (1, -1))
        up, down = (of_setup(each, contact) for each in there)

        for name in CHANGED:
            number = attrgetter(name)
            true = np.array((number(up) - number(down)) / (2 * h), dtype=float)
            most = np.abs(true).max()
            np.testing.assert_allclose(number(change), true, rtol=0, atol=2e-13 * most)


def test_both_prescriptions_are_held_unless_told_otherwise() -> None:
    by_load, by_approach = pressed("rough", control="load"), pressed("rough")
    raised = cr.Direction(heights=1e-9)
    assert by_load.change(raised).approach == pytest.approx(-1e-9, rel=1e-12)
    assert abs(by_load.change(raised).load) < 1e-12 * by_approach.change(raised).load
    same = by_load.change(replace(raised, approach=0.0))
    np.testing.assert_allclose(same.loads, by_approach.change(raised).loads, rtol=1e-10, atol=1e-25)
    alone = cr.press(replace(by_approach.scene, friction=None), approach=by_approach.approach)
    np.testing.assert_array_equal(alone.change(raised).gaps, by_approach.change(raised).gaps)


def of_loss(by: Any = ("heights",), **changes: Any) -> cr.Objective:
    scene = with_friction(NAMED["rough"][0])
    given: dict[str, Any] = dict(of="loss", by=by, load=3.6e-7, force=0.4 * FRICTION * 3.6e-7)
    return cr.Objective(scene=scene, **given | changes)


EVERYTHING = (
    *("heights", "tip_radii", "positions", "sphere_radius", "friction"),
    *("contact_modulus", "poisson_ratio", "load", "force"),
)
OBJECTIVES = {
    "loss": of_loss(EVERYTHING),
    "displacement": of_loss(EVERYTHING, of="displacement"),
    "approach": of_loss(("heights", "load", "sphere_radius"), of="approach", force=None),
    "load": of_loss(("approach", "positions"), of="load", load=None, approach=5e-5, force=None),
}


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", OBJECTIVES)
def test_its_gradient(name: str) -> None:
    objective = OBJECTIVES[name]
    x, rng = objective.start, np.random.default_rng(1)
    value, slopes = objective(x)
    places = np.cumsum([np.size(objective._own(each)) for each in objective.by])
    assert places[-1] == len(x)
    for each, part in zip(objective.by, np.split(np.arange(len(x)), places[:-1]), strict=True):
        v, scale = np.zeros(len(x)), 5e-5 if each == "heights" else np.abs(x[part]).max()
        v[part] = scale * rng.choice([-1.0, 1.0], size=len(part))
        ends = [objective(x + s * 1e-6 * v)[0] for s in (-2, -1, 1, 2)]
        found = (ends[0] - 8 * ends[1] + 8 * ends[2] - ends[3]) / 12e-6  # of fourth order
        assert found == pytest.approx(slopes @ v, rel=1e-5, abs=1e-9 * abs(value)), each


@pytest.mark.parametrize("package", ["jax", "torch", "autograd"])
def test_in_other_packages(package: str) -> None:
    """Bit by bit; torch only where it is installed: its wheel is as large as all that is needed."""
    library = pytest.importorskip(package, reason=f"needs the extra {package}")
    objective = of_loss(("heights", "friction"))
    function, x = getattr(objective, f"to_{package}")(), objective.start
    value, slopes = objective(x)
    if package == "torch":
        given = library.tensor(x.copy(), requires_grad=True)
        (2.0 * function(given)).backward()
        assert function(given).item() == value
        np.testing.assert_array_equal(given.grad.numpy(), 2.0 * slopes)
        return
    if package == "jax":
        library.config.update("jax_enable_x64", True)
        several = np.stack([x, x * 1.001])
        both = library.vmap(library.value_and_grad(function))(several)
        np.testing.assert_array_equal(both[0], [objective(each)[0] for each in several])
        np.testing.assert_array_equal(both[1][1], objective(several[1])[1])
        np.testing.assert_array_equal(library.jit(library.grad(function))(x), slopes)
    assert float(function(x)) == value
    np.testing.assert_array_equal(library.grad(function)(x), slopes)
    squared = library.grad(lambda y: function(y) ** 2)(x)
    np.testing.assert_allclose(squared, 2 * value * slopes, rtol=1e-14)


def test_a_force_without_use_is_refused() -> None:
    with pytest.raises(cr.InputError, match=r"force: found .*, expected none, as the load does"):
        of_loss(of="load", load=None, approach=5e-5)
