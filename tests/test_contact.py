"""The solved contact: reference values, symmetries, 50-digit solutions; results in any order."""

import re
from collections.abc import Iterator
from dataclasses import fields, replace
from typing import Any, Literal

import numpy as np
import pytest
import scenes
from hypothesis import given, settings
from hypothesis import strategies as st
from multiprecision import off
from numpy.testing import assert_allclose
from status_audit import assert_agree, assert_honest

import convexrough as cr
from convexrough.contact import levels_of
from convexrough.influence import Kind
from convexrough.scene import layout

#: What is proved of the loads, over their error. Rounding of transforms is bounded in the 2-norm of
#: all loads together, and the bound of each pass is far above what it loses: 750 to 2600 on these
#: scenes, and 250 to 700 for matrices.
LOOSE = {"dense": 1e4, "lattice": 3e4, "scattered": 3e4}


@pytest.mark.sample(9)
@pytest.mark.parametrize("control", ["approach", "load"])
@pytest.mark.parametrize(("name", "kind"), scenes.CASES)
def test_fifty_digits(name: str, kind: Kind, control: str) -> None:
    """Loads and gaps against a proved multiprecision solution, and the bounds against the truth."""
    scene, approach = scenes.EVERY[name]
    given = scenes.prescribed(scene, approach, control)
    contact = cr.press(scene, **given, influence=kind)
    certificate, exact = contact.certificate, scenes.reference(scene, **given)
    assert contact.influence == kind
    assert (certificate.scope, certificate.all_proved) == ("global", True)
    assert_honest(certificate, contact.loads, exact)
    truth = off(contact.loads, exact.loads)
    assert (truth <= 1e-13 * contact.loads).all()
    assert truth.max() < 1e-14 * contact.loads.max()
    assert off(contact.gaps, exact.gaps).max() < 1e-13 * contact.gaps.max()
    assert certificate.load_error <= LOOSE[kind] * truth.max()
    assert certificate.load_error <= 1e-11 * contact.loads.max()
    assert off(contact.approach, exact.approach) <= 1e-14 * contact.approach
    rounded = np.array([float(load) for load in exact.loads])
    known = cr.certify(scene, rounded, **given, influence=kind)
    assert known.all_proved
    assert_honest(known, rounded, exact)
    if kind != "scattered":  # known to half a unit in the last place
        half = 2.0**-53 * rounded * (1 + 1e-9) + 1e-24 * rounded.max()
        assert (known.load_errors <= half).all()


@pytest.mark.sample(3)
@pytest.mark.parametrize("name", scenes.NAMED)
def test_statuses_do_not_depend_on_the_operator(name: str) -> None:
    """Nor do loads, to within what is proved of each, whichever operator found them."""
    scene, approach = scenes.NAMED[name]
    kinds = scenes.operators(scene)
    first, *others = (cr.press(scene, approach=approach, influence=kind) for kind in kinds)
    for other in others:
        again = cr.certify(scene, other.loads, approach=approach, influence=other.influence)
        known, least = other.certificate.load_errors, 1e-300 * other.load
        assert_allclose(again.load_errors, known, rtol=0.02, atol=least)
        assert (other.status == first.status).all()
        assert_agree(first, other, "load")
        assert np.abs(other.loads - first.loads).max() <= 1e-14 * first.loads.max()
        assert other.crowding == pytest.approx(first.crowding, rel=1e-12)
        assert other.model_error == pytest.approx(first.model_error, rel=0.01)
        for solved, kind in ((first, other.influence), (other, first.influence)):
            judged = cr.certify(scene, solved.loads, approach=approach, influence=kind)
            assert judged.scope == "global"
            assert (judged.status == first.status).all()


@settings(max_examples=15, deadline=None)
@given(scenes.random_cases(), st.floats(-3, 3), st.floats(-3, 3))
def test_units_do_not_matter(sampled: scenes.Case, length: float, force: float) -> None:
    """Lengths times lambda and moduli times mu: loads times lambda^2 mu, the same statuses."""
    scene, approach, kind = sampled
    lam, mu = 10**length, 10**force
    first = cr.press(scene, approach=approach)
    second = cr.press(scenes.scaled(scene, lam, mu), approach=approach * lam, influence=kind)
    top = first.loads.max()
    assert_allclose(second.loads / (lam**2 * mu), first.loads, rtol=1e-11, atol=1e-12 * top)
    sure = (first.status != "undecided") & (second.status != "undecided")
    assert (first.status == second.status)[sure].all()


@settings(max_examples=15, deadline=None)
@given(scenes.random_cases(), st.integers(0, 2**32 - 1), st.floats(0, 6.28))
def test_order_and_orientation_do_not_matter(sampled: scenes.Case, seed: int, angle: float) -> None:
    scene, approach, kind = sampled
    a, order = scene.asperities, np.random.default_rng(seed).permutation(len(scene))
    points = scenes.turned(a.positions, angle)[order]
    turned = cr.Asperities(points, a.tip_radii[order], a.heights[order])
    first = cr.press(scene, approach=approach)
    second = cr.press(replace(scene, asperities=turned), approach=approach, influence=kind)
    top = first.loads.max()
    assert_allclose(second.loads, first.loads[order], rtol=1e-10, atol=1e-12 * top)


@pytest.mark.parametrize("influence", scenes.operators(scenes.NAMED["paper"][0]))
def test_a_solver_that_stops_says_what_where_and_what_to_try(influence: Any) -> None:
    """Its last loads come in the scene's units and order, and are a start for the next attempt."""
    (scene, approach), hasty = scenes.NAMED["rough"], cr.solvers.Newton(max_iterations=2)
    with pytest.raises(cr.SolverError) as caught:
        cr.press(scene, approach=approach, solver=hasty, influence=influence)
    error = caught.value
    assert error.solver == "newton"
    said = r"residual \S+ of the approach after 2 steps, at most 1e-12 needed"
    assert re.fullmatch(said, error.what)
    assert "convexity number 0." in error.advice
    assert str(error) == f"newton: {error.what}; {error.advice}"
    contact = cr.press(scene, approach=approach)
    assert error.iterate.shape == contact.loads.shape
    assert np.abs(error.iterate - contact.loads).max() < 0.01 * contact.loads.max()
    again = cr.press(scene, approach=approach, start=error.iterate)
    assert again.iterations < contact.iterations


@pytest.mark.parametrize("tolerance", [0.0, 1e-6])
def test_steps_are_too_few_only_if_the_residual_is_too_large(tolerance: float) -> None:
    scene, approach = scenes.NAMED["rough"]
    for most in range(1, 9):
        hasty = cr.solvers.Newton(tolerance=tolerance, max_iterations=most)
        try:
            cr.press(scene, approach=approach, solver=hasty, influence="lattice")
        except cr.SolverError as error:
            ((residual, needed),) = re.findall(r"residual (\S+) of .*most (\S+) needed", error.what)
            assert float(residual) > float(needed)


def results(geometry: Literal["summit", "closest"]) -> Iterator[Any]:
    """One result of each kind, of an array of which all asperities could touch."""
    scene = replace(scenes.hexagonal(height_std=2e-7, seed=1), friction=0.5, geometry=geometry)
    contact = cr.press(scene, approach=5.5e-5)
    load, force, n = contact.load, 0.2 * contact.load, len(scene)
    weights = np.arange(n) - 0.4 * n
    assert contact.candidates == n
    yield from (contact, contact.certificate, cr.onset_of_sliding(contact))
    yield cr.onset_gradient(contact, int(np.argmin(np.where(contact.loads > 0, contact.loads, 9))))
    yield from (contact.gradient(loads=weights), contact.gradient(gaps=weights))
    state, cycle = cr.shear(contact, force=force), cr.cycle(contact, maximum=force)
    yield from (state, state.gradient(forces=weights, slips=weights))
    yield from (cycle, cycle.loop(20), cycle.gradient(), cr.fretting(cycle))
    yield cr.certify_shear(contact, state.forces * (1 + 1e-9), force=force)
    yield cr.shear_vector(contact, force=force)
    for kind in ("exact", "elastic"):
        amplitudes = [0.05 * load, -0.05 * load]
        yield cr.shakedown(scene, load=load, force_amplitudes=amplitudes, kind=kind)
    loads, forces = [load, 0.8 * load], [0.0, 0.15 * load]
    for steps in (None, 2):
        yield cr.load_path(scene, loads=loads, forces=forces, general_steps=steps)
    yield cr.steady(scene, loads=loads, forces=[0.1 * load, -0.1 * load])


@pytest.mark.parametrize("geometry", ["summit", "closest"])
def test_results_do_not_depend_on_the_order_of_candidates(monkeypatch: Any, geometry: Any) -> None:
    usual = list(results(geometry))
    monkeypatch.setattr(layout, "MANY", 0)  # as on large lattices, whose points have another order
    other = list(results(geometry))
    assert (np.diff(levels_of(other[0]).problem.candidates) < 0).any()
    for one, two in zip(usual, other, strict=True):
        if isinstance(one, np.ndarray):
            assert_allclose(one, two, rtol=1e-9)
            continue
        for name in (each.name for each in fields(one)):
            left, right = getattr(one, name), getattr(two, name)
            if isinstance(left, np.ndarray) and "err" not in name:
                if left.dtype.kind != "f":
                    assert (left == right).all(), (type(one), name)
                    continue
                largest = np.abs(left[np.isfinite(left)]).max(initial=0.0)
                assert_allclose(left, right, rtol=0, atol=1e-9 * largest, err_msg=name)
