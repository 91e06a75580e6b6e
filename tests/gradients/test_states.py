"""Derivatives of sums of loads, gaps, forces and slips, of onsets, histories and paths."""

import itertools
from collections.abc import Callable
from dataclasses import replace
from fractions import Fraction
from functools import cache
from typing import Any

import numpy as np
import pytest
from flint import arb, ctx
from friction_scenes import FRICTION, shaded, with_friction
from levels_reference import (
    DIGITS,
    Judge,
    Oracle,
    Setup,
    assert_close,
    assert_slopes,
    judge_of,
    known,
    level,
)
from multiprecision import exact, quotient, travel_of
from scenes import hexagonal

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


@pytest.mark.sample(2)
@pytest.mark.parametrize("geometry", ["summit", "closest"])
@pytest.mark.parametrize("holding", ["load", "approach"])
def test_any_sum_of_loads_and_gaps(geometry: str, holding: Any) -> None:
    contact, rng = small(geometry, holding), np.random.default_rng(5)
    n = len(contact.scene)
    loads, gaps = rng.normal(size=n), contact.load / contact.approach * rng.normal(size=n)

    def number(oracle: Any) -> Any:
        return exact(loads) @ oracle.loads + exact(gaps) @ oracle.gaps

    gradient = contact.gradient(loads=loads, gaps=gaps)
    judge = judge_of(number, contact, holding)
    assert_slopes(judge, gradient, "control", sharp=SHARP)
    assert abs(gradient.value - float(judge.at)) <= gradient.value_error * 1.01
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
    forces = rng.normal(size=len(contact.scene))
    slips = rng.normal(size=len(contact.scene)) * contact.load / contact.approach

    def number(state: Any) -> Any:
        return exact(forces) @ state.forces + exact(slips) @ state.slips

    judge = judge_of(number, contact, holding, force)
    state = cr.shear(contact, force=sign * force)
    gradient = state.gradient(forces=sign * forces, slips=sign * slips)
    assert_slopes(judge, gradient, "control", sharp=SHARP)
    by_force, error = known(gradient, "force")
    assert_close(judge.difference("forces", exact([1.0])), sign * by_force, error, "force", SHARP)
    assert abs(gradient.value - float(judge.at)) <= gradient.value_error * 1.01


@pytest.mark.sample(1)
@pytest.mark.parametrize("holding", ["load", "approach"])
def test_onset(holding: Any) -> None:
    contact = small(holding=holding)
    asperity = int(np.flatnonzero(contact.loads)[-2])
    onset = float(cr.onset_of_sliding(contact, which=[asperity])[0])

    def value(setup: Setup, near: Any) -> tuple[Any, Any]:
        """The root in Q of the gap at L, by secants."""
        total = Oracle(setup, contact).load

        def gap(Q: Any) -> Any:
            left = (total - Q / setup.friction).mid()
            start = cr.press(contact.scene, load=float(left))
            loads = start.loads.copy()
            loads[asperity] = 0.0  # its own load counts for nothing there
            there = replace(setup, control=left, by_load=True)
            lower = Oracle(there, replace(start, loads=loads))
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


def walked(contact: cr.Contact, steps: Any, start: Any, weights: Any) -> Callable[[Any, Any], Any]:
    """From loads and forces, rational, to losses and displacements, in many digits."""

    def value(setup: Setup, P: list[Fraction], Q: list[Fraction]) -> Any:
        @cache
        def at(load: Fraction) -> tuple[Any, Any]:
            """V and D0; the highest asperity just touches at the load 0."""
            if load == 0:
                return arb(0), -level(setup, contact).offsets[np.argmax(contact.scene.offsets)]
            there = replace(setup, control=quotient(load), by_load=True)
            found = level(there, near_to(contact.scene, float(load)))
            return found.energy, found.approach

        travel = travel_of(setup.friction, setup.poisson_ratio)
        curve, total = MemoryCurve.pressed(start), arb(0)
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
    """Every derivative of a path against differences of it."""
    P, Q = ([Fraction(float(each)) for each in values] for values in (P, Q))
    setup = Setup.of(contact, "load")
    judge = Judge(setup, lambda there, _: (value(there, P, Q), None))
    assert abs(gradient.value - float(judge.at)) <= gradient.value_error * 1.01 + 1e-25
    assert_slopes(judge, gradient, seed=3, sharp=SHARP)
    h = Fraction(1, 10**25) * max(P)
    for name, along in (("forces", Q), ("loads", P)):
        if getattr(gradient, name) is None:
            continue
        found, errors = known(gradient, name)
        for k in range(len(P)):
            ends = []
            for s in (1, -1):
                there = list(along)
                there[k] += s * h
                both = (P, there) if name == "forces" else (there, Q)
                try:
                    with ctx.workdps(DIGITS):
                        ends.append((value(setup, *both) - judge.at) / (s * arb(float(h))))
                except cr.InputError:
                    ends.append(None)
            if None in ends:
                assert np.isnan(found[k])
                continue
            sides = [float(end) for end in ends]
            one = gradient.force_sides if name == "forces" else gradient.load_sides
            assert one is not None
            scale = max(map(abs, sides))
            np.testing.assert_allclose(one[k], sides[::-1], rtol=0, atol=1e-9 * scale + 1e-40)
            if np.isfinite(found[k]):
                assert abs(found[k] - sum(sides) / 2) <= errors[k] + 1e-9 * scale + 1e-40


@pytest.mark.sample(1)
@pytest.mark.parametrize(
    ("name", "number"),
    [
        *itertools.product(PATHS, ["displacement", "losses"]),
        ("P varies", "losses of the steady cycle"),
        ("dragged by the load", "losses of the steady cycle"),
    ],
)
def test_paths(name: str, number: str) -> None:
    contact = small(within=0.0026)
    P, Q = np.array(PATHS[name]) * contact.load
    m = len(P)
    if number == "losses of the steady cycle":
        order = [*range(m), 0, *range(1, m), 0]
        weights = [(0, 0)] * (m + 1) + [(1, 0)] * m
        gradient = cr.steady(contact.scene, loads=P, forces=Q).gradient()
        assert_path(gradient, contact, P, Q, walked(contact, order, 0, weights))
        return
    path = cr.load_path(contact.scene, loads=P, forces=Q)
    if number == "displacement":
        last = np.arange(m) == m - 1
        gradient, weights = path.gradient(displacements=last), [(0, 0)] * (m - 1) + [(0, 1)]
        assert gradient.value == pytest.approx(path.displacements[-1], rel=1e-13)
    else:
        gradient, weights = path.gradient(), [(1, 0)] * m
        assert gradient.value == pytest.approx(path.losses[-1], rel=1e-13)
    assert_path(gradient, contact, P, Q, walked(contact, range(m), 0, weights))


def test_histories_are_paths_whose_load_is_one() -> None:
    contact = small()
    Q = contact.load * np.array([0.3, -0.3, 0.3, -0.1, 0.45])
    m, rng = len(Q), np.random.default_rng(2)
    losses, far = rng.normal(size=m), rng.normal(size=m) * contact.load
    past = cr.history(contact, forces=Q)
    found = past.gradient(losses=losses, displacements=far)
    assert found.value == pytest.approx(losses @ past.losses + far @ past.displacements, rel=1e-13)
    path = cr.load_path(contact.scene, loads=np.full(m, contact.load), forces=Q, start=contact)
    last = past.gradient()
    same = path.gradient(losses=np.arange(m) == m - 1)
    for name in ("heights", "tip_radii", "forces"):
        one, off = known(last, name)
        two, by = known(same, name)
        assert (np.abs(one - two) <= off + by).all(), name
    assert same.friction == last.friction


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
