"""The hard cases: answers proved anew, and everything of the package run on all of them."""

import json
import re
from fractions import Fraction
from functools import cache
from typing import Any

import gallery_answers
import numpy as np
import pytest
from gallery_answers import true_statuses
from scenes import operators, scaled

import convexrough as cr
from convexrough import gallery, solvers

NAMES = gallery.names()
UNIT = Fraction(1, 10**49)  # of the last of 50 digits

#: 64 bristles are off by about 1 / 64^2, which a Newton step squares; the others are nearer.
SQUARED = 64.0**-4

#: Newton's method is in every other test, and CVXPY sends Clarabel what Conic does.
CVXPY = [solvers.ConicCVXPY(solver=name) for name in ("QOCO", "SCS")]
SOLVERS = [solvers.Conic(), *CVXPY, solvers.BristleQP()]

each_case = pytest.mark.parametrize("name", NAMES)

#: The first case of each family; what differs inside a family is how near a thing is to happening.
FIRST = [*{gallery.case(name).family: name for name in reversed(NAMES)}.values()]

#: A case with each operator that it allows, and with each solver.
WAYS = [(name, "influence", it) for name in NAMES for it in operators(gallery.case(name).scene)]
WAYS += [(name, "solver", solver) for name in NAMES for solver in SOLVERS]


@cache
def pressed(name: str, operator: Any = "dense") -> cr.Contact:
    case = gallery.case(name)
    return cr.press(case.scene, **case.control, influence=operator)


def within(values: Any, digits: Any, bounds: Any) -> bool:
    """In exact arithmetic, but for the last digit; an infinite bound holds."""
    exact = map(Fraction, digits)
    all_three = zip(np.atleast_1d(values), exact, np.atleast_1d(bounds), strict=True)
    bounded = [(v, x, b) for v, x, b in all_three if b != np.inf]
    return all(abs(Fraction(v) - x) <= Fraction(b) + abs(x) * UNIT for v, x, b in bounded)


@pytest.mark.sample(4)
@each_case
def test_the_stored_answer_is_computed_anew(name: str) -> None:
    case = json.loads(gallery_answers.PATH.read_text())[name]
    assert gallery_answers.answer(case) == case["answer"]


@pytest.mark.sample(18)
@pytest.mark.parametrize(("name", "which", "way"), WAYS, ids=lambda it: getattr(it, "name", it))
def test_every_solver_is_right_or_refuses(name: str, which: str, way: Any) -> None:
    case = gallery.case(name)
    try:
        contact = cr.press(case.scene, **case.control, **{which: way})
    except solvers.TooDenseError:
        assert pressed(name).crowding > 0.9
        return
    except cr.SolverError as refused:  # a first-order solver amid radii over seven decades
        assert (name, way.name) == ("no-least-distance", "conic in CVXPY (SCS) + Newton step")
        said = str(refused)
        assert re.search("residual of .* accepted", said)
        return
    proof = contact.certificate
    assert true_statuses(case, contact.status)
    assert case.check(contact.loads).error < (SQUARED if which == "solver" else 1e-12)
    assert within(contact.loads, case.loads, proof.load_errors)
    assert within(proof.gaps, case.gaps, proof.gap_errors)
    assert within(proof.approach, [case.exact_approach], proof.approach_error)
    if way == "dense":
        assert (contact.status != "undecided").all()


@pytest.mark.sample(5)
@each_case
def test_sheared_and_cycled(name: str) -> None:
    case, contact = gallery.case(name), pressed(name)
    state = cr.shear(contact, force=case.shear_force)
    cycle = cr.cycle(contact, maximum=case.shear_force)
    assert np.array_equal(cycle.status, state.status)
    assert cycle.loss > 0
    if not case.forces:
        return
    proof = state.certificate
    assert case.check_shear(state.forces).error < 1e-12
    slides = np.array([each != "0" for each in case.slips])
    true = np.where(slides, "sliding", np.where(case.touching, "partial", "open"))
    assert ((state.status == true) | (state.status == "undecided")).all()
    assert within(state.forces, case.forces, proof.force_errors)
    assert within(state.slips, case.slips, proof.slip_errors)
    assert within(state.displacement, [case.displacement], proof.displacement_error)


@pytest.mark.parametrize("name", ["reversals-random", "reversals-nested"])
def test_a_hundred_thousand_reversals(name: str, pytestconfig: pytest.Config) -> None:
    """The last of them wipes all others out; without --full some are left out before it."""
    case, contact = gallery.case(name), pressed(name)
    assert len(case.history) > 100_000
    most = (5_000 if "nested" in name else len(case.history)) if pytestconfig.option.full else 25
    every = len(case.history) // most
    past = cr.history(contact, forces=case.history[::-every][::-1])
    assert case.history[-1] == case.shear_force
    assert case.check_shear(past.asperity_forces[-1]).error < 1e-12
    assert within(past.displacements[-1], [case.displacement], past.displacement_errors[-1])
    assert (np.diff(past.losses) >= -1e-13 * past.losses[-1]).all()


@pytest.mark.sample(3)
@pytest.mark.parametrize("name", FIRST)
@pytest.mark.parametrize(("length", "modulus"), [(2.0**5, 2.0**-4), (2.0**-11, 2.0**10)])
def test_powers_of_two_scale_every_bit(name: str, length: float, modulus: float) -> None:
    """Where the exponents differ by a multiple of 3: k is a cube root, which must scale, too."""
    case = gallery.case(name)
    operator = operators(case.scene)[-1]  # the least like a matrix
    one, force = pressed(name, operator), modulus * length**2
    factor = length if case.load is None else force
    control = {key: value * factor for key, value in case.control.items()}
    other = cr.press(scaled(case.scene, length, modulus), **control, influence=operator)
    assert np.array_equal(other.loads, one.loads * force)
    assert np.array_equal(other.certificate.load_errors, one.certificate.load_errors * force)
    assert np.array_equal(other.gaps, one.gaps * length)
    assert np.array_equal(other.status, one.status)
    there = cr.shear(other, force=case.shear_force * force)
    here = cr.shear(one, force=case.shear_force)
    assert np.array_equal(there.forces, here.forces * force)
    assert there.displacement == here.displacement * length
    assert np.array_equal(there.status, here.status)
    loss = cr.cycle(other, maximum=case.shear_force * force).loss
    assert loss == cr.cycle(one, maximum=case.shear_force).loss * force * length


def test_wrong_answers_are_judged_wrong() -> None:
    case, open_one = gallery.case("grazing-load-1e-12"), gallery.case("grazing-gap-1e-6")
    loads, forces = (np.array(each, dtype=float) for each in (case.loads, open_one.forces))
    judged = case.check(np.append(loads[:-1], 0.0))
    assert (judged.wrongly_open.tolist(), judged.wrongly_loaded.tolist()) == ([7], [])
    off = loads * (1 + 2e-6)
    for right in (case.check(loads), case.check(off, within=1e-5), open_one.check_shear(forces)):
        assert right
    turned = open_one.check_shear(forces[::-1])
    for wrong in (judged, case.check(0 * loads), case.check(off), turned):
        assert not wrong
        assert not wrong.right
    assert not case.check(loads, floor=2e-12 * loads.max()).right


@pytest.mark.sample(2)
@pytest.mark.parametrize("count", [1, 61, 700, 20_000])
def test_manufactured_contacts_of_any_size(count: int) -> None:
    made = gallery.manufactured(count)
    proof = cr.certify(made.scene, made.loads, approach=made.approach)
    assert len(made.scene) == count
    assert np.array_equal(proof.status, np.where(made.loads > 0, "contact", "open"))
    assert proof.load_errors.max() < 1e-8 * made.loads.max()
    assert np.array_equal(gallery.manufactured(count).loads, made.loads)
    assert not np.array_equal(gallery.manufactured(count, seed=1).loads, made.loads)
    with pytest.raises(cr.InputError, match="a whole number, at least 1"):
        gallery.manufactured(count - 20_001)
