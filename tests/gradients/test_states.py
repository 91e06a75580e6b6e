"""Derivatives of all numbers against differences of levels, of scenes, and in optimisers."""

import pickle
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from fractions import Fraction
from functools import cache
from operator import attrgetter
from typing import Any

import levels_reference as levels
import numpy as np
import pytest
from flint import arb, ctx
from friction_scenes import FRICTION, SCENES, pressed, shaded, with_friction
from levels_reference import DIGITS, NAMES, STEP, Judge, Setup, assert_slopes, judge_of, known
from multiprecision import exact, off, quotient, travel_of
from scenes import MATERIAL, NAMED, OPERATORS, hexagonal, scattered

import convexrough as cr
from convexrough.friction.curve import MemoryCurve

SHARP = 1e-13


@cache
def small(geometry: Any = "summit", holding: str = "load", within: float = 0.0051) -> cr.Contact:
    """Nineteen asperities, or seven, of which some are open."""
    scene = hexagonal(within=within, height_std=2e-6, tip_radius_cv=0.1, seed=7)
    scene = with_friction(replace(scene, geometry=geometry))
    contact = cr.press(scene, approach=1.2e-5)
    assert 3 < np.count_nonzero(contact.loads) <= len(scene)
    return contact if holding == "approach" else cr.press(scene, load=contact.load)


def weighted(weights: dict[str, Any]) -> Callable[[Any], Any]:
    """The sum of these fields of a state with these weights."""
    return lambda state: sum(exact(each) @ getattr(state, name) for name, each in weights.items())


@pytest.mark.sample(2)
@pytest.mark.parametrize("geometry", ["summit", "closest"])
@pytest.mark.parametrize("holding", ["load", "approach"])
def test_any_sum_of_loads_and_gaps(geometry: str, holding: Any) -> None:
    contact, rng = small(geometry, holding), np.random.default_rng(5)
    loads, gaps = rng.normal(size=(2, len(contact.scene)))
    weights = {"loads": loads, "gaps": contact.load / contact.approach * gaps}
    judge, gradient = judge_of(weighted(weights), contact, holding), contact.gradient(**weights)
    assert_slopes(judge, gradient, "control", sharp=SHARP)
    assert gradient.balance_defect < 1e-14


STATES = [("summit", "load", 1e-3), ("summit", "approach", 0.5), ("closest", "load", 0.95)]


@pytest.mark.sample(2)
@pytest.mark.parametrize(("geometry", "holding", "fraction"), STATES)
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_any_sum_of_forces_and_slips(
    geometry: str, holding: Any, fraction: float, sign: float
) -> None:
    contact, rng = small(geometry, holding), np.random.default_rng(11)
    force = fraction * FRICTION * contact.load
    forces, slips = rng.normal(size=(2, len(contact.scene)))
    weights = {"forces": forces, "slips": contact.load / contact.approach * slips}
    judge = judge_of(weighted(weights), contact, holding, force)
    state = cr.shear(contact, force=sign * force)
    gradient = state.gradient(**{name: sign * each for name, each in weights.items()})
    assert_slopes(judge, gradient, "control", sharp=SHARP)
    by_force, error = known(gradient, "force")
    true = judge.difference("forces", exact([1.0]))
    levels.assert_close(true, sign * by_force, error, "force", SHARP)


@pytest.mark.sample(1)
@pytest.mark.parametrize("holding", ["load", "approach"])
def test_onset(holding: Any) -> None:
    contact = small(holding=holding)
    asperity = int(np.flatnonzero(contact.loads)[-2])
    onset = float(cr.onset_of_sliding(contact, which=[asperity])[0])

    def value(setup: Setup, near: Any) -> tuple[Any, Any]:
        """The root in Q of the gap at L, by secants."""
        total = levels.Oracle(setup, contact).load

        def gap(Q: Any) -> Any:
            left = (total - Q / setup.friction).mid()
            start = cr.press(contact.scene, load=float(left))
            loads = start.loads.copy()
            loads[asperity] = 0.0  # its own load counts for nothing there
            there = replace(setup, control=left, by_load=True)
            lower = levels.Oracle(there, replace(start, loads=loads))
            return lower.approach + lower.offsets[asperity] - lower.A[asperity] @ lower.loads

        last, root = onset * (1 - arb("1e-12")), near or arb(onset)
        before, here = gap(last), gap(root)
        while abs(here) >= arb("1e-80"):
            slope = (here - before) / (root - last)
            last, before, root = root, here, (root - here / slope).mid()
            here = gap(root)
        return root, root

    judge = Judge(Setup.of(contact, holding), value)
    assert onset == pytest.approx(float(judge.at), rel=1e-13)
    gradient = cr.onset_gradient(contact, asperity, holding=holding)
    assert gradient.value == pytest.approx(onset, rel=1e-13)
    assert_slopes(judge, gradient, "control", sharp=1e-10)


near_to = cache(lambda scene, load: cr.press(scene, load=load))


def rational(x: arb) -> Fraction:
    mantissa, exponent = x.mid().man_exp()
    return Fraction(int(mantissa)) * Fraction(2) ** int(exponent)


def walked(contact: cr.Contact, steps: Any, weights: Any) -> Callable[[Any, Any], Any]:
    """From loads and forces, rational, to losses and displacements, in many digits."""

    def value(setup: Setup, P: list[Fraction], Q: list[Fraction]) -> Any:
        @cache
        def at(load: Fraction) -> tuple[Any, Any]:
            """V and D0; the highest asperity just touches at the load 0."""
            if load == 0:
                highest = np.argmax(contact.scene.offsets)
                return arb(0), -levels.level(setup, contact).offsets[highest]
            there = replace(setup, control=quotient(load), by_load=True)
            found = levels.level(there, near_to(contact.scene, float(load)))
            return found.energy, found.approach

        travel = travel_of(setup.friction, setup.poisson_ratio)
        curve, total = MemoryCurve(), arb(0)
        for point, (lost, moved) in zip(steps, weights, strict=True):
            curve, pieces = curve.go(P[point], Q[point] / rational(setup.friction))
            for piece in pieces:
                (V0, D0), (V1, D1) = at(piece.top), at(piece.bottom)
                before, after = piece.load_before, piece.load_after
                run, fall = quotient(piece.top - piece.bottom), quotient(before - after)
                (VP, DP), (VQ, _) = at(before), at(after)
                mean = DP if fall == 0 else (VP - VQ) / fall
                each = quotient(before - piece.top) * D0 - quotient(after - piece.bottom) * D1
                each += (2 - fall / run) * (V0 - V1) - run * mean
                share = quotient(1 - piece.sign * piece.slope)
                total += lost * travel * setup.friction * share * each
            if moved:
                total += moved * travel * sum(quotient(b) * at(s)[1] for s, b in curve.bends)
        return total

    return value


PATHS = {
    "history": ([1, 1, 1, 1, 1], [0.3, -0.3, 0.25, -0.1, 0.45]),
    "P varies": ([0.6, 1, 0.7, 0.7, 0.5], [0, 0.3, -0.15, 0.2, 0.12]),
    "dragged by the load": ([0.3, 0.9, 0.9, 0.05, 0.8], [-0.1, 0.17, -0.3, 0.0, 0.3]),
}


def assert_path(gradient: cr.Gradient, contact: cr.Contact, P: Any, Q: Any, value: Any) -> None:
    P, Q = ([Fraction(float(each)) for each in values] for values in (P, Q))
    setup = Setup.of(contact, "load")
    judge = Judge(setup, lambda there, _: (value(there, P, Q), None))
    assert_slopes(judge, gradient, seed=3, sharp=SHARP)
    h = Fraction(1, 10**25) * max(P)
    for which, (name, one) in enumerate((("loads", "load_sides"), ("forces", "force_sides"))):
        if getattr(gradient, name) is None:
            continue
        found, errors = known(gradient, name)
        for k in range(len(P)):
            sides = []
            for step in (-h, h):
                there = [list(P), list(Q)]
                there[which][k] += step
                with ctx.workdps(DIGITS), suppress(cr.InputError):  # a force above f P
                    sides.append(float((value(setup, *there) - judge.at) / quotient(step)))
            if len(sides) < 2:
                assert np.isnan(found[k])
                continue
            off = 1e-9 * max(map(abs, sides)) + 1e-40
            np.testing.assert_allclose(getattr(gradient, one)[k], sides, rtol=0, atol=off)
            if np.isfinite(found[k]):
                assert abs(found[k] - sum(sides) / 2) <= errors[k] + off


@pytest.mark.sample(1)
@pytest.mark.parametrize("number", ["displacement", "losses", "losses of the steady cycle"])
@pytest.mark.parametrize("name", PATHS)
def test_paths(name: str, number: str) -> None:
    contact = small(within=0.0026)
    P, Q = np.array(PATHS[name]) * contact.load
    m = len(P)
    path = cr.load_path(contact.scene, loads=P, forces=Q)
    points, weights, gradient = [*range(m)], [(1, 0)] * m, path.gradient()
    if number == "displacement":
        weights = [(0, 0)] * (m - 1) + [(0, 1)]
        gradient = path.gradient(displacements=np.eye(m)[-1])
    elif number == "losses of the steady cycle":
        points, weights = [*points, 0, *points[1:], 0], [(0, 0)] * (m + 1) + weights
        gradient = cr.steady(contact.scene, loads=P, forces=Q).gradient()
    assert_path(gradient, contact, P, Q, walked(contact, points, weights))


def test_where_order_fails_there_is_no_sum_of_levels() -> None:
    contact = cr.press(shaded(), load=2.96)
    cycle = cr.cycle(contact, maximum=0.25 * contact.load)
    assert cycle.order == "fails"
    with pytest.raises(cr.InputError, match='order: found "fails", expected a result whose'):
        cycle.gradient()
    assert contact.gradient(approach=1.0).height_errors.max() < 1e-15


@pytest.mark.parametrize("off", [-1, 1])
def test_a_path_that_misses_a_tie_by_rounding_has_the_same_sides(off: int) -> None:
    contact = small()
    unit = 2.0 ** np.floor(np.log2(contact.load))  # products with whole numbers / 64 are exact
    loads = unit * np.array([64, 58, 51, 58, 64, 64, 58]) / 64
    forces = FRICTION * unit * np.array([8, 14, 20, 14, 8, 20, 14]) / 64

    def gradient(loads: Any, forces: Any) -> cr.Gradient:
        return cr.load_path(contact.scene, loads=loads, forces=forces).gradient()

    tied = gradient(loads, forces)
    for name in ("loads", "forces"):
        moved = {"loads": loads.copy(), "forces": forces.copy()}
        moved[name][4:] = np.nextafter(moved[name][4:], off * np.inf)
        missed = gradient(**moved)
        for one in ("force", "load"):
            sides, there = (getattr(each, f"{one}_sides") for each in (tied, missed))
            np.testing.assert_allclose(there, sides, rtol=0, atol=1e-8 * np.abs(sides).max())
            gone = np.isnan(getattr(tied, f"{one}s"))
            assert 0 < gone.sum() < len(gone)
            np.testing.assert_array_equal(np.isnan(getattr(missed, f"{one}s")), gone)


#: Of the largest entry of its kind: what bounds may be from Q / f P = 1e-2 to 0.999.
SHARPER = 1e-14


def assert_both(
    contact: cr.Contact, force: float, holding: Any, sharp: float, seed: int = 0
) -> None:
    """Values and derivatives, of arrays along random signs and by two entries, and their bounds."""
    loss = cr.cycle(contact, maximum=force).gradient(holding=holding)
    moved = cr.shear(contact, force=force).gradient(displacement=1.0, holding=holding)
    assert max(loss.balance_defect, moved.balance_defect) < 1e-14
    judge = judge_of(levels.loss_and_displacement, contact, holding, force)
    rng, both = np.random.default_rng(seed), ((loss, "maximum"), (moved, "force"))
    errors = [loss.value_error, moved.value_error]
    assert (off([loss.value, moved.value], judge.at) <= errors).all()
    for name in (*NAMES, "control", "forces"):
        if getattr(loss, name, 0) is None:  # by the radius of a base that is no sphere
            continue
        signs = rng.choice([-1.0, 1.0], size=np.shape(getattr(judge.setup, name)))
        some = rng.choice(signs.size, min(2, signs.size), replace=False)
        for v in (signs, *np.eye(signs.size)[some].reshape(-1, *signs.shape)):
            true_slopes = judge.difference(name, exact(v)[()])
            for (gradient, own), true in zip(both, true_slopes, strict=True):
                one = {"control": holding, "forces": own}.get(name, name)
                slopes, errors = known(gradient, one)
                ends = 2.0 if one == "maximum" else 1.0  # that move
                parts = ends * slopes * v, ends * errors * np.abs(v)
                levels.assert_close(true, *parts, name, sharp if v is signs else 0.0)


@pytest.mark.sample(5)
@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("fraction", [1e-2, 0.4, 0.999])
@pytest.mark.parametrize("holding", ["load", "approach"])
def test_every_derivative(name: str, fraction: float, holding: str) -> None:
    contact = pressed(name, control=holding)
    assert_both(contact, fraction * FRICTION * contact.load, holding, SHARPER)


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
    assert gradient.poisson_ratio > 0
    first = np.arange(len(top)) == np.argmax(contact.scene.offsets)
    ratio = (2 - 0.3) / (2 * 0.7) * FRICTION
    np.testing.assert_allclose(moved.heights, ratio * (top + first), rtol=1e-14)
    weights = np.eye(len(top))[0]  # derivatives of forces are finite
    borne, close = (cr.shear(contact, force=it).gradient(forces=weights)
                    for it in (force, force * (1 - 1e-12)))  # fmt: skip
    for name in ("force", "load", "friction"):
        (value, error), (beside, off) = known(borne, name), known(close, name)
        assert abs(value - beside) <= error + off + 1e-6 * abs(value)
        assert error < 1e-10 * abs(value)
    state = cr.shear(contact, force=force)
    slid = np.flatnonzero(state.slips)[:2]  # both rates are infinite, but their difference is not
    unsure = state.gradient(slips=np.eye(len(top))[slid[0]] - np.eye(len(top))[slid[1]])
    assert np.isnan(unsure.force)
    assert unsure.force_error == np.inf


def test_weights_that_are_added_are_not_rounded() -> None:
    weight = 0.1 + 2.0**-56
    alone = cr.Scene(1.0, cr.Asperities([[0.0, 0.0]], 0.02), MATERIAL)
    gradient = cr.press(alone, load=1e-7).gradient(load=1.0, loads=[weight])
    slope, error = known(gradient, "load")
    assert abs(Fraction(float(slope)) - 1 - Fraction(weight)) <= Fraction(float(error))


def test_slips_of_an_asperity_that_may_be_open() -> None:
    """Its slip, and the derivative of this, may be 0 or not: bounds hold for both."""
    side = np.linspace(-0.01, 0.01, 45)
    points = np.stack(np.meshgrid(side, side), -1).reshape(-1, 2)
    points += np.random.default_rng(0).uniform(-1e-4, 1e-4, points.shape)
    array = cr.Asperities(points, 1e-4)

    def contact_of(heights: Any) -> cr.Contact:
        scene = with_friction(cr.Scene(1.0, array.with_tips(1e-4, heights), MATERIAL))
        return cr.press(scene, approach=5e-5, influence="scattered")

    contact = contact_of(0.0)
    k, heights = int(np.argmin(np.where(contact.loads == 0, contact.gaps, 9.0))), np.zeros(2025)
    for _ in range(4):
        heights[k] += contact.gaps[k]
        contact = contact_of(heights)
    assert contact.status[k] == "undecided"
    touching = contact_of(heights + 1e-18 * (np.arange(2025) == k))
    assert touching.status[k] == "contact"
    weights = (np.arange(2025) == k) * 1.0
    unsure, sure = (cr.shear(each, force=0.15 * contact.load).gradient(slips=weights)
                    for each in (contact, touching))  # fmt: skip
    for true in (0.0, sure.value):
        assert abs(unsure.value - true) <= unsure.value_error * 1.001
    for true in (0.0, sure.heights[k]):
        assert abs(unsure.heights[k] - true) <= unsure.height_errors[k] * 1.001


def test_many_asperities_by_every_operator() -> None:
    scene = with_friction(hexagonal(2.5e-4, 2e-3, 2.5e-3, height_std=3e-8, seed=1))
    contacts = {kind: cr.press(scene, load=1e-8, influence=kind) for kind in OPERATORS}
    found = {kind: cr.cycle(each, maximum=2e-9).gradient() for kind, each in contacts.items()}
    for kind, each in found.items():
        for name in NAMES[:5]:
            values, errors = known(each, name)
            true, known_to = known(found["dense"], name)
            assert (np.abs(values - true) <= errors + known_to).all(), (kind, name)
            most = SHARPER if kind == "dense" else 1e-6
            assert (errors <= most * np.abs(true).max()).all(), (kind, name)


@pytest.mark.sample(1)
@pytest.mark.parametrize("holding", ["load", "approach"])
@pytest.mark.parametrize("name", ["rough", "rough, closest"])
def test_normalised(name: str, holding: Any) -> None:
    """The loss over W0 = (24/5) f P X0, X0 = f c_t times the approach of a smooth sphere."""
    contact = pressed(name, control=holding)
    force = 0.3 * contact.load

    def number(state: Any) -> Any:
        s, P = state.held.setup, state.pressed.load
        approach = (9 * (P / s.contact_modulus) ** 2 / (16 * s.sphere_radius)).root(3)
        scale = 24 * s.friction * P * travel_of(s.friction, s.poisson_ratio) * approach / 5
        return state.energy / scale

    gradient = cr.cycle(contact, maximum=force).gradient().normalised
    assert_slopes(judge_of(number, contact, holding, force), gradient, "control")
    assert 0 < gradient.height_errors.max() <= SHARPER * np.abs(gradient.heights).max()


def test_a_pickled_cycle_keeps_the_force_of_its_displacement() -> None:
    cycle = cr.cycle(pressed("rough"), displacement=3e-6)
    again = pickle.loads(pickle.dumps(cycle))
    assert "balance_defect" in vars(again)  # so that printing it does not press again
    one, two = cycle.gradient(), again.gradient()
    assert abs((one.number.value - two.number.value).value) <= one.value_error


def test_weights_along_a_history() -> None:
    """Weights that cancel lose no digit; at held load the displacement has a derivative by it."""
    contact, rng = small(), np.random.default_rng(2)
    past = cr.history(contact, forces=contact.load * np.array([0.3, -0.3, 0.3, -0.1, 0.45]))
    losses, far = rng.normal(size=5), rng.normal(size=5) * contact.load
    found = past.gradient(losses=losses, displacements=far)
    assert found.value == pytest.approx(losses @ past.losses + far @ past.displacements, rel=1e-13)
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
        sphere_radius=0.0 if isinstance(scene.sphere_radius, tuple) else -0.3 * scene.sphere_radius,
        contact_modulus=0.4 * scene.material.contact_modulus, poisson_ratio=0.2, friction=-0.6 * f,
        force=0.8 * force, **control,
    )  # fmt: skip


CASES = [
    ("paper", "load", 0.5), ("rough", "approach", 1e-6), ("rough, closest", "load", 0.3),
    ("rough, closest", "approach", 0.9), ("steel", "approach", 0.5),
    ("rough on cylinder, closest", "load", 0.3), ("rough on ellipsoid, summit", "approach", 0.3),
]  # fmt: skip

CHANGED = ["pressed.loads", "pressed.gaps", "pressed.load", "pressed.approach"]
CHANGED += ["forces", "slips", "displacement"]


@pytest.mark.sample(3)
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
        up, down = (levels.of_setup(each, contact) for each in there)

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
        with pytest.raises(RuntimeError, match="no second derivatives"):
            library.autograd.functional.hessian(function, given)
        with pytest.raises(cr.InputError, match="expected a tensor of floating-point numbers"):
            function(given.detach().to(library.int64))
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
    if package == "autograd":
        with pytest.raises(cr.InputError, match="parameters: found shape"):
            function(x[:, None])


def test_an_objective_of_a_small_force_is_the_loss() -> None:
    """The difference of two energies loses digits; the bound of the loss tells."""
    objective = of_loss(("friction",), force=1e-11 * FRICTION * 3.6e-7)
    cycle = cr.cycle(cr.press(objective.scene, load=3.6e-7), maximum=objective.force)
    assert objective(objective.start)[0] == pytest.approx(cycle.loss, rel=1e-6)
