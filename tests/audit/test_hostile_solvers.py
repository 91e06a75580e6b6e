"""Solvers that lie: wrong, negative, missing or late answers with the status "optimal"."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from friction_scenes import FRICTION, PAPER, pressed
from numpy.testing import assert_allclose
from scenes import NAMED, PAPER_APPROACH, hexagonal, paper, reference
from status_audit import ATTACKS, assert_agree, assert_honest, attack

import convexrough as cr
from convexrough import FrictionNewton, shear_vector
from convexrough.normal.problem import NormalProblem
from convexrough.solvers import BristleQP, Newton

Spoil = Callable[[Any, np.random.Generator], Any]


@dataclass(frozen=True)
class Liar:
    """The answer of an honest solver, of which one field is spoiled."""

    spoil: Spoil
    field: str = "loads"
    seed: int = 0
    honest: Any = Newton
    more: tuple[tuple[str, Any], ...] = ()  # of other fields
    name: str = "liar"

    def solve(self, problem: Any, given: Any = None) -> Any:
        found, rng = self.honest().solve(problem, given), np.random.default_rng(self.seed)
        spoiled = self.spoil(np.copy(getattr(found, self.field)), rng)
        change = found._replace if hasattr(found, "_replace") else partial(replace, found)
        return change(**{self.field: spoiled}, **dict(self.more))


def unrefined(spoil: Callable[[Any], Any]) -> Liar:
    """Its loads are those of the contact."""
    return Liar(lambda loads, rng: spoil(loads), more=(("refine", False),))


def elsewhere(*factors: float) -> Any:
    """Newton's answers, with all their digits, for other loads or approaches from call to call."""
    remaining = iter(factors)

    def solve(problem: Any, start: Any = None) -> Any:
        control = problem.control * next(remaining, factors[-1])
        return Newton().solve(replace(problem, control=control), start)

    return SimpleNamespace(name="elsewhere", solve=solve)


@pytest.mark.parametrize("control", [{"approach": 3e-4}, {"load": 6e-6}], ids=["approach", "load"])
def test_digits_of_another_problem_are_not_used(control: Any) -> None:
    scene = replace(hexagonal(spacing=1e-3, tip_radius=5e-3, within=0.0302), friction=0.5)
    true = cr.press(scene, **control)
    found = cr.press(scene, **control, solver=elsewhere(0.9))
    assert (found.status == true.status).all()
    assert found.load == pytest.approx(true.load, rel=1e-14)
    other = cr.press(scene, **control, solver=elsewhere(1.0, 1 + 1e-6))
    assert_agree(*(cr.shear(it, force=0.1 * true.load) for it in (other, true)), "force")


def put(value: float) -> Spoil:
    def spoil(values: Any, rng: np.random.Generator) -> Any:
        values.flat[rng.integers(values.size)] = value
        return values

    return spoil


NO_LOADS: dict[str, Spoil] = {
    "nan": put(np.nan),
    "inf": put(np.inf),
    "negative": put(-1e-3),
    "a little negative": put(-1e-25),
    "one too few": lambda loads, rng: loads[:-1],
    "huge": lambda loads, rng: loads * 1e300,
    "complex": lambda loads, rng: loads * (1 + 1j),
}

CONTROLS = [{"approach": PAPER_APPROACH}, {"load": 2e-7}]


@pytest.mark.sample(3)
@pytest.mark.parametrize("control", CONTROLS, ids=["approach", "load"])
@pytest.mark.parametrize("kind", NO_LOADS)
def test_what_are_no_loads_is_an_error(kind: str, control: Any) -> None:
    """Nor are loads that are all zero under a total."""
    with pytest.raises(cr.SolverError, match="liar: no loads were found: loads"):
        cr.press(paper(), **control, solver=Liar(NO_LOADS[kind]))
    with pytest.raises(cr.SolverError, match="liar: all loads are 0, but a total is prescribed"):
        cr.press(paper(), load=2e-7, solver=Liar(lambda loads, rng: 0.0 * loads))


@pytest.mark.parametrize("control", CONTROLS, ids=["approach", "load"])
@pytest.mark.parametrize("kind", sorted({*ATTACKS} - {"zero"}))
@pytest.mark.parametrize("name", ["paper", "rough, closest"])
@pytest.mark.sample(3)
def test_wrong_loads_are_never_called_right(name: str, kind: str, control: Any) -> None:
    """By bounds that hold for them all the same, and not by luck: six each."""

    def spoil(loads: Any, rng: np.random.Generator) -> Any:
        spoiled = attack(kind, loads, rng)
        return spoiled.astype(np.float32) if kind == "single precision" else spoiled

    scene, _ = NAMED[name]
    for seed in range(6):
        contact = cr.press(scene, **control, solver=Liar(spoil, seed=seed))
        assert_honest(contact.certificate, contact.loads, reference(scene, **control))


@pytest.mark.sample(2)
@pytest.mark.parametrize("control", CONTROLS, ids=["approach", "load"])
@pytest.mark.parametrize("approach", [0.0, 1.0, np.nan, np.inf, -1e300])
def test_an_approach_that_the_loads_exclude_is_not_reported(approach: float, control: Any) -> None:
    far = Liar(lambda found, rng: approach, "approach")
    honest, contact = (cr.press(paper(), **control, solver=each) for each in (None, far))
    assert contact.approach == pytest.approx(honest.approach, rel=1e-12)


@pytest.mark.sample(2)
@pytest.mark.parametrize("field", ["increments", "slips", "displacement"])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_what_are_no_forces_is_an_error(field: str, value: float) -> None:
    contact, liar = pressed("paper"), Liar(put(value), field, honest=FrictionNewton)
    with pytest.raises(cr.SolverError, match=r"liar: no .* were found"):
        shear_vector(contact, force=0.3 * FRICTION * contact.load, solver=liar)


@pytest.mark.parametrize("field", ["increments", "slips", "displacement", "total"])
@pytest.mark.sample(1)
def test_wrong_forces_are_never_called_right(field: str) -> None:
    contact = pressed("paper")
    force = 0.5 * FRICTION * contact.load
    truth = shear_vector(contact, force=force)
    sliding = truth.slips.any(axis=1)

    def spoil(values: Any, rng: np.random.Generator) -> Any:
        return values * (1 + 10.0 ** rng.uniform(-14, 1) * rng.standard_normal(values.shape))

    for seed in range(12):
        liar = Liar(spoil, field, seed, FrictionNewton)
        state = shear_vector(contact, force=force, solver=liar)
        assert_agree(state, truth, "force", "slip")
        assert not (state.status[~sliding] == "sliding").any()
        assert not (state.status[sliding] == "partial").any()


def test_a_solver_cannot_change_what_the_proof_uses() -> None:
    """Such a change in place gave a bound of 5e-17 for loads that were 1.3 % off."""

    def solve(problem: Any, start: Any = None) -> Any:
        problem.influence.points[...] *= 1.02
        return Newton().solve(problem, start)

    scaling: Any = SimpleNamespace(name="scaling", solve=solve)
    for kind in ("dense", "scattered"):  # a lattice computes its points anew
        with pytest.raises(ValueError, match="read-only"):
            cr.press(paper("closest"), approach=PAPER_APPROACH, solver=scaling, influence=kind)
    problem = NormalProblem.assemble(paper(), approach=PAPER_APPROACH)
    for each in (problem.offsets, problem.coefficients, problem.shells, problem.influence.matrix):
        assert not each.flags.writeable


def test_friction_after_small_loads_on_open_asperities() -> None:
    """Such loads, as interior-point methods leave them, gave open asperities a slip."""
    given, residue = CONTROLS[0], unrefined(lambda loads: loads + 1e-9 * loads.max())
    contact, true = cr.press(PAPER, **given, solver=residue), pressed("paper")
    assert (contact.loads > 0).all()
    state, known = (cr.shear(each, force=0.1 * true.load) for each in (contact, true))
    assert_agree(state, known, "slip")
    assert not state.displacements[state.status == "open"].any()
    onsets, right = cr.onset_of_sliding(contact), cr.onset_of_sliding(true)
    assert_allclose(onsets, right, rtol=1e-12)  # nan where open
    assert_allclose(cr.onset_of_sliding(cr.press(PAPER, **given, solver=BristleQP())), right)
    for control in (given, {"load": 3e-7}):
        nothing = cr.press(PAPER, **control, solver=unrefined(lambda loads: loads[::-1]))
        onsets, right = (cr.onset_of_sliding(it) for it in (nothing, cr.press(PAPER, **control)))
        known = np.isfinite(onsets)  # where nothing is proved about the first touch they are nan
        assert not known[:7].any()
        assert_allclose(onsets[known], right[known], rtol=1e-12)


def test_limits_and_derivatives_are_those_of_the_solution() -> None:
    """No derivatives, where nothing is proved to touch."""
    contact = cr.press(PAPER, load=3e-7, solver=unrefined(lambda loads: 2 * loads))
    for call, name in ((cr.shear, "force"), (cr.cycle, "maximum")):
        with pytest.raises(cr.InputError, match=r"1\.6 f P: gross sliding\), expected at most f P"):
            call(contact, **{name: 0.4 * contact.load})
    turned = cr.press(PAPER, approach=PAPER_APPROACH, solver=unrefined(lambda loads: loads[::-1]))
    with pytest.raises(cr.SolverError, match="no asperity is proved to touch"):
        turned.gradient(load=1.0)
