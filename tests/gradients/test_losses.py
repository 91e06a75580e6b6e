"""Derivatives of losses and displacements: every entry against levels in 100 digits."""

from typing import Any

import numpy as np
import pytest
from flint import arb, ctx
from friction_scenes import FRICTION, with_friction
from gradient_oracle import DIGITS, known
from levels_reference import SCENES, Friction, Holding, Slopes, friction_state, pressed, reference

import convexrough as cr

#: Of the largest entry of its kind: what bounds may be from Q / f P = 1e-2 to 0.999.
SHARP = 1e-14


def assert_entries(gradient: cr.Gradient, slopes: Slopes, sharp: float | None) -> None:
    """Every derivative is within its bound, which is sharp."""
    for name in Slopes._fields:
        mine = gradient.holding if name == "control" else name
        found, errors = known(
            gradient, "maximum" if name == "force" and gradient.force is None else mine
        )
        twice = 2.0 if name == "force" and gradient.force is None else 1.0  # both ends move
        true = np.reshape(np.array(getattr(slopes, name), dtype=object), found.shape)
        for k in np.ndindex(found.shape):
            off = abs(arb(twice * float(found[k])) - true[k])
            assert off <= twice * float(errors[k]), (name, k)
        if sharp is not None:
            assert errors.max() <= sharp * np.abs(found).max(), name


def assert_both(
    contact: cr.Contact, state: Friction, force: float, holding: Holding, sharp: Any
) -> None:
    with ctx.workdps(DIGITS):
        loss = cr.cycle(contact, maximum=force).gradient(holding=holding)
        assert_entries(loss, state.loss_slopes(holding), sharp)
        assert abs(arb(loss.value) - state.energy) <= loss.value_error
        moved = cr.shear(contact, force=force).gradient(displacement=1.0, holding=holding)
        assert_entries(moved, state.displacement_slopes(holding), sharp)
        assert abs(arb(moved.value) - state.displacement) <= moved.value_error
        assert max(loss.balance_defect, moved.balance_defect) < 1e-14


@pytest.mark.sample(3)
@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("fraction", [1e-2, 0.4, 0.999])
def test_every_derivative(name: str, fraction: float) -> None:
    holding: Holding
    for holding in ("load", "approach"):
        contact, state = pressed(name, holding), reference(name, fraction, holding)
        assert_both(contact, state, fraction * FRICTION * contact.load, holding, SHARP)


@pytest.mark.sample(2)
@pytest.mark.parametrize("fraction", [1e-9, 1e-6, 1e-4, 1 - 1e-7])
def test_bounds_are_honest_where_they_are_not_sharp(fraction: float) -> None:
    contact, state = pressed("rough", "load"), reference("rough", fraction, "load")
    assert_both(contact, state, fraction * FRICTION * contact.load, "load", None)


def random_scene(rng: np.random.Generator) -> tuple[cr.Scene, float]:
    """One to eight asperities anywhere, of any sizes, and an approach that presses some."""
    n = int(rng.integers(1, 9))
    spacing = 10.0 ** rng.uniform(-3, -1)
    points = np.stack(np.divmod(rng.permutation(16)[:n], 4), axis=1) * spacing
    points += rng.uniform(-0.2, 0.2, size=(n, 2)) * spacing
    tips = spacing * 10.0 ** rng.uniform(-0.5, 1.0, size=n)
    approach = tips.min() * 10.0 ** rng.uniform(-4, -2)
    heights = approach * rng.normal(size=n) * 10.0 ** rng.uniform(-2, 0)
    geometry: Any = rng.choice(["summit", "closest"])
    material = cr.Material(10.0 ** rng.uniform(-1, 12), rng.uniform(0.0, 0.5))
    asperities = cr.Asperities(points, tips, heights)
    radius = spacing * 10.0 ** rng.uniform(1, 4)
    scene = cr.Scene(radius, asperities, material, rng.uniform(0.1, 1.0), geometry)
    return scene, float(approach - scene.offsets.max())


@pytest.mark.sample(5)
@pytest.mark.parametrize("seed", range(40))
def test_no_bound_is_too_small(seed: int) -> None:
    rng = np.random.default_rng(seed)
    scene, approach = random_scene(rng)
    contact = cr.press(scene, approach=approach)
    if contact.certificate.scope == "none":
        return
    holding: Holding = "approach"
    if rng.uniform() < 0.5:
        contact, holding = cr.press(scene, load=contact.load), "load"
    fraction = float(rng.choice([1e-3, 0.1, 0.9, rng.uniform()]))
    force = fraction * (scene.friction or 0.0) * contact.load
    assert_both(contact, friction_state(contact, force, holding), force, holding, None)


def test_gross_sliding_from_one_side() -> None:
    contact = pressed("rough", "load")
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
    first = int(np.argmax(contact.scene.offsets))
    ratio = (2 - 0.3) / (2 * 0.7) * FRICTION
    expected = ratio * top
    expected[first] += ratio
    np.testing.assert_allclose(moved.heights, expected, rtol=1e-14)


def test_no_derivative_in_gross_sliding() -> None:
    contact = pressed("rough", "load")
    force = FRICTION * contact.load
    with pytest.raises(cr.InputError, match="at constant approach f P may fall below"):
        cr.cycle(contact, maximum=force).gradient(holding="approach")
    pair = cr.Asperities([[-0.0015, 0.0], [0.0015, 0.0]], 0.02)
    even = with_friction(cr.Scene(1.0, pair, cr.Material(1.0, 0.3), geometry="summit"))
    together = cr.press(even, load=1e-8)
    with pytest.raises(cr.InputError, match="several asperities slide last"):
        cr.cycle(together, maximum=FRICTION * together.load).gradient()
    with pytest.raises(cr.InputError, match="asperity: found 1, which slides last, together with"):
        cr.onset_gradient(together, 1)


def test_many_asperities_by_every_operator() -> None:
    asperities = cr.Asperities.hexagonal(
        spacing=2.5e-4, tip_radius=2e-3, within=2.5e-3, height_std=3e-8, seed=1
    )
    scene = with_friction(cr.Scene(1.0, asperities, cr.Material(1.0, 0.3), geometry="summit"))
    found = {}
    for kind in ("dense", "lattice", "scattered"):
        contact = cr.press(scene, load=1e-8, influence=kind)  # type: ignore[arg-type]
        found[kind] = cr.cycle(contact, maximum=0.2 * contact.load).gradient()
    for kind, each in found.items():
        for name in ("heights", "tip_radii", "positions", "sphere_radius", "contact_modulus"):
            values, errors = known(each, name)
            true, known_to = known(found["dense"], name)
            assert (np.abs(values - true) <= errors + known_to).all(), (kind, name)
            most = SHARP if kind == "dense" else 1e-6
            assert (errors <= most * np.abs(true).max()).all(), (kind, name)
