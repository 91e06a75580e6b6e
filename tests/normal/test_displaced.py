"""Loads nearby, of which A P is known to many digits: what a certificate may be handed."""

from dataclasses import replace
from typing import Any

import multiprecision
import numpy as np
import pytest
from flint import arb, ctx

import convexrough as cr
from convexrough.normal.certificate import judge
from convexrough.normal.problem import NormalProblem
from convexrough.normal.residual import Displaced, fit
from convexrough.solvers import Newton

APPROACH = 5e-5


def scene(seed: int = 3, geometry: Any = "summit") -> cr.Scene:
    asperities = cr.Asperities.hexagonal(
        spacing=0.0012, tip_radius=0.01, within=0.0102, height_std=1e-6, seed=seed
    )
    moved = cr.Asperities(asperities.positions + 0.3e-3, 0.01, asperities.heights)
    return cr.Scene(1.0, moved, cr.Material(0.7, 0.3), geometry=geometry)


def assembled(pressed: cr.Scene) -> NormalProblem:
    return NormalProblem.assemble(pressed, approach=APPROACH, influence="lattice")


@pytest.mark.parametrize("far", [0.0, 1e-15, 1e-9, 1e-3, 1.0])
def test_a_product_of_the_difference(far: float) -> None:
    """A P of loads nearby, in ball arithmetic: within the bounds, whatever the distance."""
    problem, rng = assembled(scene()), np.random.default_rng(1)
    loads = np.where(rng.random(len(problem)) < 0.7, rng.random(len(problem)), 0.0)
    base = Displaced.of(problem, loads)
    assert base is not None
    others = loads * (1.0 + far * rng.uniform(-1, 1, len(problem)))
    others[loads == 0] = far * rng.random(int((loads == 0).sum()))  # they carry something now
    if far == 1.0:
        others[:9] = 0.0
    moved = base.moved_to(others)
    points = [[arb(float(x)) for x in row] for row in problem.influence.points]
    errors = []
    with ctx.workprec(250):
        force, length = arb(problem.units.force), arb(problem.units.length)
        scale = force / length / (arb.pi() * arb(0.7))
        for m in (0, len(problem) // 2, len(problem) - 1):
            exact = arb(0)
            for n in range(len(problem)):
                if n != m:
                    x, y = (points[m][c] - points[n][c] for c in (0, 1))
                    exact += arb(float(others[n])) / (x * x + y * y).sqrt()
            value = arb(float(moved.product.high[m])) + arb(float(moved.product.low[m]))
            off = abs(value - scale * exact)
            rounding = 1e-28 * float(moved.product.high.max())
            assert off <= arb(moved.error) + arb(rounding)
            errors.append(float(off.mid()))
    assert moved.norm >= moved.error
    if far < 1e-8:
        plain = problem.influence.rounding(others).of(problem.influence.apply(others))
        assert moved.error < 1e-4 * plain.min()
    if far >= 1e-9:  # what the bound counts is there
        assert max(errors) > 1e-5 * moved.error


def counted(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    made: list[int] = []
    of = Displaced.of.__func__  # type: ignore[attr-defined]

    def watched(cls: Any, problem: NormalProblem, loads: Any) -> Any:
        made.append(len(loads))
        return of(cls, problem, loads)

    monkeypatch.setattr(Displaced, "of", classmethod(watched))
    return made


@pytest.mark.parametrize("control", ["approach", "load"])
def test_one_sliced_product_for_a_press(control: str, monkeypatch: pytest.MonkeyPatch) -> None:
    pressed = scene()
    contact = cr.press(pressed, approach=APPROACH, influence="lattice")
    made = counted(monkeypatch)
    again = cr.press(pressed, **{control: getattr(contact, control)}, influence="lattice")
    assert len(made) == 1
    assert again.certificate.load_error < 1e-13 * again.loads.max()
    assert np.abs(again.loads - contact.loads).max() < 1e-13 * contact.loads.max()


def test_loads_far_away_or_of_another_problem_are_of_no_use(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """What is proved does not depend on what is handed over."""
    pressed = scene()
    problem = assembled(pressed)
    solution = Newton().solve(problem)
    assert solution.displaced is not None
    loads = problem.to_scene(solution.loads) * problem.units.force
    known = judge(problem, loads)
    far = Displaced.of(problem, solution.loads * 0.5)
    other = assembled(scene(seed=4))
    foreign = replace(solution.displaced, problem=other)
    made = counted(monkeypatch)
    for each, products in ((solution.displaced, 0), (far, 1), (foreign, 1)):
        made.clear()
        judged = judge(problem, loads, each)
        assert len(made) == products
        assert judged.scope == known.scope
        assert (judged.status == known.status).all()
        assert judged.load_errors == pytest.approx(known.load_errors, rel=0.05, abs=0)
    # A little off, they are still of use; and what is off is seen.
    wrong = loads * (1 + 1e-9)
    made.clear()
    judged = judge(problem, wrong, solution.displaced)
    assert len(made) == 0
    assert judged.load_error >= 0.9e-9 * loads.max()
    assert (np.abs(wrong - loads) <= judged.load_errors + known.load_errors).all()


def test_no_loads_at_all() -> None:
    problem = assembled(scene())
    base = Displaced.of(problem, np.zeros(len(problem)))
    assert base is not None
    found = fit(problem, np.zeros(len(problem)), None, base)
    assert found.displacement.max() == 0


@pytest.mark.parametrize("control", ["approach", "load"])
@pytest.mark.parametrize("seed", range(3))
def test_the_last_step_in_eighty_digits(seed: int, control: str) -> None:
    """The loads of the last step are good to the last digits, and the bounds hold."""
    pressed = scene(seed)
    some = np.hypot(*pressed.asperities.positions.T) < 0.0072
    asperities = cr.Asperities(
        pressed.asperities.positions[some], 0.01, pressed.asperities.heights[some]
    )
    pressed = replace(pressed, asperities=asperities)
    first = cr.press(pressed, approach=2e-5, influence="lattice")
    prescribed: Any = {control: getattr(first, control)}
    contact = cr.press(pressed, **prescribed, influence="lattice")
    exact = multiprecision.solve(
        asperities.positions,
        asperities.tip_radii,
        asperities.heights,
        sphere_radius=1.0,
        contact_modulus=0.7,
        digits=80,
        start=contact.loads,
        **prescribed,
    )
    truth = np.abs(multiprecision.errors(contact.loads, exact.loads))
    largest = contact.loads.max()
    assert (truth <= contact.certificate.load_errors).all()
    assert truth.max() <= 2e-14 * largest
    assert contact.certificate.load_error <= 5e-14 * largest
    gaps = np.abs(multiprecision.errors(contact.gaps, exact.gaps))
    assert (gaps <= contact.certificate.gap_errors).all()


@pytest.mark.parametrize("control", ["approach", "load"])
@pytest.mark.parametrize("rough", [0.0, 1e-6])
def test_bounds_of_some_thousand(rough: float, control: str) -> None:
    """An ordinary last step would leave ten times as much."""
    asperities = cr.Asperities.hexagonal(
        spacing=0.0025 / 15, tip_radius=0.02 / 15, within=0.01, height_std=rough, seed=1
    )
    pressed = cr.Scene(1.0, asperities, cr.Material(1.0, 0.3))
    contact = cr.press(pressed, approach=APPROACH)
    prescribed: Any = {control: getattr(contact, control)}
    problem = NormalProblem.assemble(pressed, **prescribed)
    solution = Newton().solve(problem)
    assert solution.residual <= 1e-15 * solution.approach
    judged = judge(problem, problem.to_scene(solution.loads) * problem.units.force)
    assert judged.load_error <= 1e-13 * contact.loads.max()
