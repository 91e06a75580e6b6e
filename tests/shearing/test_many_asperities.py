"""Friction of many asperities: state after state by an operator, against matrices and limits."""

import gc
import re
import weakref
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from flint import arb, ctx
from friction_scenes import FRICTION, NAMES, pressed, with_friction
from numpy.testing import assert_allclose
from scenes import MATERIAL, PAPER_APPROACH, paper

import convexrough as cr
from convexrough.influence.lattice import LatticeInfluence
from convexrough.run.stages import Stages, compute
from convexrough.shearing.first_loading import FirstLoading
from convexrough.shearing.judgement import judge_in_turn, judge_states
from convexrough.shearing.many_states import by_matrices, solve_together
from convexrough.shearing.newton import solve_in_turn
from convexrough.shearing.problem import TangentialProblem
from convexrough.sphere import annulus


@cache
def refined(influence: Any = None, times: int = 3, heights: float = 3e-7) -> cr.Contact:
    """The paper's example with asperities `times` as dense and as sharp, of random heights."""
    asperities = cr.Asperities.hexagonal(
        spacing=0.0025 / times,
        tip_radius=0.02 / times,
        within=0.01,
        height_std=heights,
        seed=11,
    )
    scene = cr.Scene(1.0, asperities, MATERIAL, FRICTION)
    return cr.press(scene, approach=PAPER_APPROACH, influence=influence)


@pytest.mark.parametrize("fraction", [1e-9, 1e-3, 0.2, 0.5, 0.9, 0.999, 1.0])
def test_the_same_states_by_matrices_and_by_transforms(fraction: float) -> None:
    """Forces to 1e-11 of the largest, words, and bounds that cover the difference."""
    one, other = (
        cr.shear(contact, force=fraction * FRICTION * contact.load)
        for contact in (refined("dense"), refined("lattice"))
    )
    for state in (one, other):  # at f P the last one slides if f P of the true loads is no more
        assert (state.status == "undecided").sum() == (fraction == 1.0)
    assert (one.status == other.status).all()
    assert one.displacement == pytest.approx(other.displacement, rel=1e-12)
    errors = one.certificate.force_errors + other.certificate.force_errors
    assert (np.abs(one.forces - other.forces) <= errors).all()
    assert_allclose(one.forces, other.forces, rtol=0, atol=1e-11 * one.forces.max())
    errors = one.certificate.slip_errors + other.certificate.slip_errors
    assert (np.abs(one.slips - other.slips) <= errors).all()
    assert_allclose(one.slips, other.slips, rtol=0, atol=1e-11 * one.displacement)
    assert errors.max() <= 1e-5 * one.displacement


def test_the_same_cycles_by_matrices_and_by_transforms() -> None:
    dense, lattice = refined("dense"), refined("lattice")
    fractions = np.array([0.7, 1e-9, 0.3, 1e-4, 0.7, 1.0])  # in no order, one twice
    ours = cr.cycles(lattice, fractions * FRICTION * lattice.load)
    theirs = cr.cycles(dense, fractions * FRICTION * dense.load)
    for one, other in zip(ours, theirs, strict=True):
        assert one.energy == pytest.approx(other.energy, rel=1e-10)
        assert one.balance_defect < 1e-11
        assert (one.status == other.status).all()
        assert_allclose(one.energies, other.energies, rtol=0, atol=1e-10 * other.energies.max())
    assert (ours[0].status == "sliding").sum() > (ours[2].status == "sliding").sum() > 0
    assert (ours[0].status == "open").any()


def test_the_same_history_by_matrices_and_by_transforms() -> None:
    dense, lattice = refined("dense"), refined("lattice")
    path = np.array([0.5, -0.2, 0.3, -0.5, 0.8, 0.8, 0.0]) * FRICTION * dense.load
    one, other = cr.history(dense, forces=path), cr.history(lattice, forces=path)
    assert_allclose(one.forces, other.forces, rtol=0, atol=1e-11 * one.forces.max())
    assert_allclose(one.displacements, other.displacements, rtol=1e-11)
    assert_allclose(one.slips, other.slips, rtol=0, atol=1e-11 * one.displacements.max())
    assert_allclose(one.energy, other.energy, rtol=1e-10)
    deep = one.asperity_displacements
    assert_allclose(deep, other.asperity_displacements, rtol=0, atol=1e-11 * deep.max())


@pytest.mark.parametrize("name", NAMES)
def test_in_turn_and_together(name: str) -> None:
    """With a matrix, too, states in turn are those found together, each force to 1e-11 of itself.

    From those nearest to them, in whatever order, and down to any shear force.
    """
    problem = TangentialProblem.of(pressed(name))
    assert by_matrices(problem)
    parts = np.array([0.5, 1e-30, 0.0, 1e-290, 0.9, 1e-12, 0.501, 1.0, 0.2, 1e-5, 0.5])
    totals = problem.limited(parts * problem.limit)
    together = solve_together(problem, totals)
    lines: list[str] = []
    first = problem.as_on_a_smooth_sphere
    in_turn = solve_in_turn(problem, totals, first, announce=lines.append)
    again = solve_in_turn(problem, totals, first, known=in_turn)
    for states in in_turn, again:
        assert_allclose(states.increments, together.increments, rtol=1e-11)
        assert_allclose(states.rises, together.rises, rtol=1e-12)
        assert_allclose(states.slips, together.slips, atol=1e-12 * together.rises.max())
        assert_allclose(states.increments.sum(axis=1), totals, rtol=1e-14)
    assert len(lines) == np.count_nonzero(totals)


def test_judged_in_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    """A block of states or all of them at once: the same bounds."""
    contact = refined("lattice")
    problem = TangentialProblem.of(contact)
    states = problem.solve(np.linspace(0, 1, 7) * problem.limit)
    whole = judge_states(problem, states)
    monkeypatch.setattr("convexrough.shearing.judgement.BLOCK", 2 * len(problem))
    assert len(list(judge_in_turn(problem, states))) == 4
    for all_at_once, in_blocks in zip(whole, judge_states(problem, states), strict=True):
        assert_allclose(all_at_once, in_blocks, rtol=1e-12)


def test_elastic_shares_to_rounding() -> None:
    """Through the operator as through a factorisation; (H + A) q is the same everywhere."""
    by_matrix, by_operator = (TangentialProblem.of(refined(kind)) for kind in ("dense", "lattice"))
    q = by_operator.elastic
    level = q / by_operator.stiffest + by_operator.couple(q)
    assert_allclose(level, level.mean(), rtol=1e-13)
    assert_allclose(q, by_matrix.elastic, rtol=0, atol=1e-13 * q.max())
    assert q.sum() == pytest.approx(1.0, rel=1e-14)


@pytest.mark.parametrize("fraction", [1e-3, 0.5])
def test_one_wrong_load_among_many_is_counted(fraction: float) -> None:
    """What it does to its neighbours is in the bounds, as far as its certificate lets it be off."""
    contact = refined("lattice", times=5)
    off = 1e-6 * contact.loads * (np.arange(len(contact.loads)) == np.argmax(contact.loads))
    proof = replace(contact.certificate, load_errors=off + 1e-14 * contact.loads)
    loads = contact.loads + off
    wrong = replace(contact, loads=loads, load=float(loads.sum()), certificate=proof)
    force = fraction * FRICTION * contact.load
    state, truth = cr.shear(wrong, force=force), cr.shear(contact, force=force)
    difference = np.abs(state.forces - truth.forces)
    assert (difference <= state.certificate.force_errors).all()
    assert np.sort(difference)[-7] > 0.01 * difference.max()  # the neighbours feel it
    error = state.certificate.displacement_error
    assert abs(state.displacement - truth.displacement) <= error
    assert state.certificate.holds


@pytest.mark.parametrize("fraction", [1e-12, 1e-8, 1e-5])
def test_small_forces_keep_their_digits(fraction: float) -> None:
    """As Q -> 0: the displacement is elastic, and the loss of third order with the elastic shares.

    w = (1/6) f''(...) T^3 comes from the local laws alone: sum P ceiling e(u / P), e = 5 t^3 / 162.
    """
    loading = FirstLoading(refined("lattice"))
    problem, q = loading.problem, loading.problem.elastic
    total = fraction * problem.limit
    states, _ = loading.states(np.array([total]))
    t = q * total / problem.loads
    expected = 0.6 * float(problem.loads * problem.ceilings @ t**3) * 5 / 162
    near = 300 * fraction  # the next order, at the least loaded asperities
    elastic = float(q @ (q / problem.stiffest + problem.couple(q))) * total
    assert states.rises[0] == pytest.approx(elastic, rel=1e-12 + near)
    assert loading.partial_slip(states).sum() == pytest.approx(expected, rel=1e-10 + 100 * near)
    assert loading.trapezoid_error(states)[0] == pytest.approx(expected, rel=1e-10 + 100 * near)


def test_one_state_takes_few_products(monkeypatch: pytest.MonkeyPatch) -> None:
    """Started from its neighbours a state takes a few steps, and two products to be judged."""
    counted = {"float32": 0, "float64": 0}
    apply = LatticeInfluence.apply

    def counting(self: LatticeInfluence, loads: Any) -> Any:
        counted[loads.dtype.name] += 1
        return apply(self, loads)

    contact = refined("lattice", times=5, heights=0.0)
    problem = TangentialProblem.of(contact)
    judge_states(problem, problem.solve(np.array([0.0])))  # what is known of the loads
    monkeypatch.setattr(LatticeInfluence, "apply", counting)
    states = problem.solve(np.linspace(0.05, 0.95, 19) * problem.limit)
    assert counted["float64"] <= 19 * 4.5
    assert counted["float32"] <= 19 * 25
    counted["float64"] = 0
    judge_states(problem, states)
    assert counted["float64"] == 19 * 2


def test_every_stage_tells_how_far_it_is() -> None:
    contact = refined("lattice")
    lines: list[str] = []
    stages = Stages((0.5,), ((0.2, 0.4, 1.0), (-0.2, -0.4, -1.0)), (0.3, -0.3))
    compute(contact, stages, lines.append)
    pattern = r"state (\d+) of (\d+): residual \de[-+]\d\d of the displacement, [\d,]+ sliding"
    told = [found.groups() for line in lines if (found := re.fullmatch(pattern, line))]
    assert told[:2] == [("1", "3"), ("2", "3")]
    assert ("1", "1") in told
    assert lines.count("certified 3 states") == 1
    told_before = len(lines)
    cr.cycle(contact, maximum=0.2 * FRICTION * contact.load).loop(20, announce=lines.append)
    assert len(lines) > told_before + 9
    quiet: list[str] = []
    cr.shear(pressed("paper"), force=1e-8, announce=quiet.append)
    assert quiet == []


def test_onset_of_some() -> None:
    """In the order asked for; of too many, which ones must be said."""
    contact, other = refined("lattice", times=5), refined("dense")
    touching = np.flatnonzero(contact.loads)
    which = np.array([touching[400], int(np.flatnonzero(contact.loads == 0)[0]), touching[7]])
    onsets = cr.onset_of_sliding(contact, which=which)
    assert onsets.shape == (3,)
    assert np.isnan(onsets[1])
    state = cr.shear(contact, force=onsets[0] * (1 + 1e-9))
    assert 0 < state.slips[which[0]] < 1e-8 * state.displacement
    with pytest.raises(cr.InputError, match=r"which: found \d+ loaded asperities"):
        cr.onset_of_sliding(contact)
    all_of_them, some = cr.onset_of_sliding(pressed("rough")), np.array([5, 3, 60])
    assert_allclose(cr.onset_of_sliding(pressed("rough"), which=some), all_of_them[some])
    for bad in ([-1], [len(other.scene)], [0.5], ["a"], [[0, 1]]):
        with pytest.raises(cr.InputError, match="which"):
            cr.onset_of_sliding(other, which=bad)  # type: ignore[arg-type]


def test_the_law_by_the_width_of_the_annulus() -> None:
    """Each function of the share t of friction to its last digits, against the definitions in 60.

    The potentials are integrals over t of what is above them.
    """
    ctx.dps = 60
    for t in (1e-15, 1e-9, 1e-3, 0.1, 0.37, 0.5, 0.999, 1 - 1e-9, 1.0):
        x, exact = annulus.width_under(t), arb(t)
        left = (1 - exact) if t < 1 else arb(0)
        phi = 1 - left ** (arb(2) / 3)
        lost = 1 - left ** (arb(5) / 3)
        laws = {
            "force": exact,
            "deflection": phi,
            "excess_deflection": phi - 2 * exact / 3,
            "potential": exact - 3 * lost / 5,
            "excess_potential": exact - 3 * lost / 5 - exact**2 / 3,
            "loss": lost - 5 * exact / 6 * (2 - phi),
        }
        for name, law in laws.items():
            assert getattr(annulus, name)(x) == pytest.approx(float(law), rel=5e-15), (name, t)
        assert annulus.width_at(float(phi)) == pytest.approx(float(1 - left ** (arb(1) / 3)), 1e-14)
        assert annulus.width_under(-t) == x
    assert (annulus.width_at(np.array([1.0, -1.0, 3.0])) == 1).all()


def test_a_contact_is_freed_with_all_that_was_made_from_it() -> None:
    """By counting references alone: nothing that later stages keep holds the contact."""
    contact = cr.press(with_friction(paper()), approach=PAPER_APPROACH)
    limit = FRICTION * contact.load
    cr.shear(contact, force=0.3 * limit)
    cr.cycle(contact, maximum=0.5 * limit)
    cr.history(contact, forces=[0.4 * limit])
    cr.shear_vector(contact, force=0.3 * limit)
    cr.onset_of_sliding(contact, which=[0])
    problem = weakref.ref(TangentialProblem.of(contact))
    assert TangentialProblem.of(contact) is problem()
    gc.collect()
    gc.disable()
    try:
        left = weakref.ref(contact)
        del contact
        assert left() is None
        assert problem() is None
    finally:
        gc.enable()
