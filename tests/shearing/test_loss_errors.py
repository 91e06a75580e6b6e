"""Proved bounds on the energy of cycles and histories, against 80 digits; and how sharp."""

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import pytest
from friction_scenes import FRICTION, exact, in_doubt, off, pressed, with_friction
from scenes import OPERATORS, PAPER_APPROACH, paper, twins

import convexrough as cr
from convexrough.shearing.first_loading import FirstLoading
from convexrough.shearing.judgement import judge_states
from convexrough.shearing.load_errors import LoadErrors
from convexrough.shearing.loss_errors import Nearness, loss_errors
from convexrough.shearing.problem import TangentialProblem
from convexrough.sphere import mindlin

NAMES = ["paper", "rough", "rough, closest"]
FRACTIONS = [1e-9, 1e-6, 1e-3, 0.1, 0.35, 0.37, 0.6, 0.9, 0.999, 1 - 1e-9]


def sharpness(fraction: float) -> float:
    """Of the bound relative to the energy: the same for all small forces, and up to the limit."""
    return 1e-8 if fraction > 0.999 else 5e-11


@pytest.mark.parametrize("fraction", FRACTIONS)
@pytest.mark.parametrize("control", ["approach", "load"])
@pytest.mark.parametrize("name", NAMES)
def test_the_bound_holds_and_is_sharp(name: str, control: str, fraction: float) -> None:
    truth = exact(name, fraction, control)
    for influence in OPERATORS:
        if influence == "lattice" and "closest" in name:
            continue  # contact points of unequal tip radii are on no lattice
        contact = pressed(name, influence, control)
        cycle = cr.cycle(contact, maximum=fraction * FRICTION * contact.load)
        assert off(cycle.energy, truth.energy) <= cycle.energy_error
        assert cycle.energy_error <= sharpness(fraction) * cycle.energy


@pytest.mark.parametrize("digits", [3, 5, 8, 12])
@pytest.mark.parametrize("fraction", [1e-6, 0.1, 0.37, 0.6, 0.999])
@pytest.mark.parametrize("control", ["approach", "load"])
def test_doubt_about_the_loads_is_counted(control: str, fraction: float, digits: int) -> None:
    truth = exact("paper", fraction, control)
    for influence in OPERATORS:
        contact = pressed("paper", influence, control)
        doubtful = in_doubt(contact, digits, control)
        cycle = cr.cycle(doubtful, maximum=fraction * FRICTION * contact.load)
        assert off(cycle.energy, truth.energy) <= cycle.energy_error
        if digits > 5:
            assert cycle.energy_error < 1e5 * 10.0**-digits * cycle.energy


@pytest.mark.parametrize("part", ["increments", "slips", "rises"])
@pytest.mark.parametrize("fraction", [1e-9, 0.3, 0.9])
def test_wrong_states_cost_what_the_bound_allows(fraction: float, part: str) -> None:
    """Spoiled states have other losses; the bounds on these cover the true one."""
    contact = pressed("rough")
    loading = FirstLoading(contact)
    problem = loading.problem
    right = problem.solve(np.array([fraction * problem.limit]))
    true = cost(loading, right)
    rng = np.random.default_rng(7)
    for size in 10.0 ** np.arange(-13, -2):
        field = getattr(right, part)
        wrong = field * (1 + size * rng.standard_normal(field.shape))
        if part == "increments":
            wrong = np.minimum(wrong, problem.loads)
        state = right._replace(**{part: wrong})
        bounds = judge_states(problem, state)
        known = judge_states(problem, right).losses[0]
        assert abs(cost(loading, state) - true) <= bounds.losses[0] + known


class Part(NamedTuple):
    """A judged state, what is known of it, and the loss of another that this allows."""

    states: Any
    known: LoadErrors
    near: Nearness
    other: float


def part(kind: str, fraction: float) -> tuple[TangentialProblem, Part]:
    """Nothing is in doubt but one thing, by 1e-3, and that to the full."""
    loading = FirstLoading(pressed("rough"))
    problem = loading.problem
    P, n = problem.loads, len(problem)
    states = problem.solve(np.array([fraction * problem.limit]))
    none, no, zero = np.zeros((1, n)), np.zeros((1, n), dtype=bool), np.zeros(1)
    known = LoadErrors.of(problem)._replace(errors=np.zeros(n), distance=0.0, stray=0.0)
    left = states.rises[:, None] - problem.couple(states.increments)
    sliding = states.increments == P
    near = Nearness(zero, none, none, left, none, zero, sliding, no)
    u, slips, loads, size = states.increments, states.slips, P, 1e-3
    if kind.startswith("loads"):
        loads = P * (1 + size)
        u = u * (1 + size)
        distance = np.sqrt(known.stiffness @ (loads - P) ** 2)
        known = known._replace(errors=loads - P, distance=10 * distance)
        if kind == "loads, in the norm":
            known = known._replace(errors=3 * (loads - P), distance=distance)
    if kind.startswith("increments"):
        change = np.where(sliding, 0.0, size * np.minimum(u, P - u))
        u = u + change
        near = near._replace(distance=zero + np.inf, each=change)
        if kind == "increments, in the norm":
            distance = np.sqrt((known.stiffness * change**2).sum(axis=1))
            near = near._replace(distance=distance, each=3 * change)
        if kind == "increments, shifted":
            near = near._replace(distance=zero, shifts=change, each=3 * change)
    if kind == "slips":
        slips = slips + size * states.rises
        near = near._replace(errors=none + size * states.rises)
    ceilings = problem.ceilings * (loads / P) ** (2 / 3)
    other = (loads * (0.6 * ceilings * mindlin.loss(u / loads) + slips / 2)).sum()
    return problem, Part(states, known, near, float(other))


@pytest.mark.parametrize("fraction", [1e-9, 0.3, 0.9])
@pytest.mark.parametrize(
    "kind",
    [
        *("loads", "loads, in the norm", "slips"),
        *("increments", "increments, in the norm", "increments, shifted"),
    ],
)
def test_each_part_of_the_bound_by_itself(kind: str, fraction: float) -> None:
    """It holds, where any other part left out would show, and is within a factor of 2 for one."""
    problem, (states, known, near, other) = part(kind, fraction)
    loading = FirstLoading(pressed("rough"))
    bound = loss_errors(problem, known, states, near)[0]
    change = abs(other - cost(loading, states))
    assert change <= bound
    assert bound <= 6 * change


def test_what_is_left_out_may_lose_something() -> None:
    """An asperity that touches, slides and has no load here; another that is hardly known."""
    full = pressed("rough")
    loaded = np.flatnonzero(full.loads)
    light = loaded[np.argsort(full.loads[loaded])[:2]]
    force = 0.95 * FRICTION * full.load
    truth = cr.cycle(full, maximum=force)
    assert (truth.status[light] == "sliding").all()
    loads, words = full.loads.copy(), full.status.copy()
    loads[light], words[light] = 0.0, "undecided"
    errors = full.certificate.load_errors + np.abs(full.loads - loads)
    certificate = replace(full.certificate, status=words, load_errors=errors)
    contact = replace(full, loads=loads, certificate=certificate)
    problem = TangentialProblem.of(contact)
    known = LoadErrors.of(problem)
    assert known.stray == pytest.approx(full.loads[light].sum() / problem.units.force)
    distance = float(np.hypot(*np.diff(full.scene.contact_points[light], axis=0)[0]))
    pair = 2 * problem.influence.scale / distance * np.prod(errors[light] / problem.units.force)
    assert known.stray_among == pytest.approx(pair, rel=1e-9)
    states = problem.solve(np.array([force / problem.force_unit]))
    none = np.zeros_like(states.slips)
    near = Nearness(none[:, 0], none, none, none, none, none[:, 0], none == 0, none != 0)
    bounds = [loss_errors(problem, each, states, near) for each in (known, known._replace(stray=0))]
    lost = truth.energies[light].sum() / FirstLoading(contact).energy_unit
    assert lost <= (bounds[0] - bounds[1])[0] <= 10 * lost
    cycle = cr.cycle(contact, maximum=force)
    assert cycle.energy_error >= abs(cycle.energy - truth.energy)


def cost(loading: FirstLoading, states: Any) -> float:
    return float((loading.partial_slip(states) + loading.sliding(states)).sum())


@pytest.mark.parametrize("ulps", [0, 2, -2, 8, -8])
@pytest.mark.parametrize("fraction", [1e-9, 0.25, 0.9])
def test_an_asperity_that_may_or_may_not_touch(fraction: float, ulps: int) -> None:
    """What it could lose is in the bound, whether it is among the loaded ones or not."""

    def scene(height: float) -> cr.Scene:
        points = np.array([[0.0, 0.0], [0.0025, 0.0]])
        asperities = cr.Asperities(points, 0.02, [0.0, height])
        return with_friction(cr.Scene(1.0, asperities, paper().material))

    gap = cr.press(scene(-1e-4), approach=PAPER_APPROACH).gaps[1]
    height = -1e-4 + gap
    height += ulps * np.spacing(height)
    contact = cr.press(scene(height), approach=PAPER_APPROACH)
    wide = cr.press(scene(height - 1e-12), approach=PAPER_APPROACH)  # nothing in doubt there
    force = fraction * FRICTION * contact.load
    cycle, other = cr.cycle(contact, maximum=force), cr.cycle(wide, maximum=force)
    assert np.isfinite(cycle.energy_error)
    assert abs(cycle.energy - other.energy) <= cycle.energy_error + 1e-6 * other.energy
    if contact.status[1] == "undecided":
        state = cr.shear(contact, force=force)
        nu = contact.scene.material.poisson_ratio
        dragged = (2 - nu) / (2 * (1 - nu)) * state.forces[0] / (np.pi * 0.0025)
        most = contact.certificate.load_errors[1] * (state.displacement - dragged)
        assert cycle.energy_error >= 4 * FRICTION * most > 0


def test_it_is_infinite_without_proof_and_zero_without_load() -> None:
    contact = pressed("paper")
    scene, load = twins()
    unproved = cr.press(scene, load=load)
    assert unproved.certificate.scope == "none"
    assert cr.cycle(unproved, maximum=0.3 * FRICTION * unproved.load).energy_error == np.inf
    light = cr.press(contact.scene, approach=-1e-6)
    assert cr.cycle(light, maximum=0.0).energy_error == 0.0
    assert cr.history(light, forces=[0.0]).energy_errors[0] == 0.0


def test_the_interval_of_the_proof_file_overlaps() -> None:
    """Exact arithmetic and the fast certificate speak of the same number."""
    contact = pressed("paper")
    for fraction in (1e-3, 0.1, 0.5, 0.9):
        force = fraction * FRICTION * contact.load
        claims = contact.proof(sheared=[cr.shear(contact, force=force)]).document["claims"]
        low, high = (float.fromhex(end) for end in claims["shear"][0]["energy"])
        cycle = cr.cycle(contact, maximum=force)
        assert low - cycle.energy_error <= cycle.energy <= high + cycle.energy_error
        assert high - low < 1e-6 * cycle.energy


# Histories: sums of the losses of branches.


@pytest.mark.parametrize("influence", OPERATORS)
def test_histories_against_eighty_digits(influence: Any) -> None:
    """First loading to 0.6, back to -0.6 over two stops, and forth: 1/4, 1/2 and 1/2 of a cycle."""
    contact, truth = pressed("rough", influence), exact("rough", 0.6).energy
    limit = FRICTION * contact.load
    path = cr.history(contact, forces=np.array([0.1, 0.6, 0.2, -0.2, -0.6, 0.6]) * limit)
    for place, share in ((1, 0.25), (4, 0.75), (5, 1.25)):
        assert off(path.energy[place], truth * share) <= path.energy_errors[place]
    assert (path.energy_errors < 1e-8 * path.energy).all()


def test_stops_on_the_way_cost_nothing() -> None:
    """Errors of states that a branch only passes do not add up."""
    contact = pressed("paper")
    limit = FRICTION * contact.load
    plain = cr.history(contact, forces=np.array([0.6, -0.6, 0.6]) * limit)
    fractions = np.concatenate(
        (np.linspace(0, 0.6, 50), np.linspace(0.6, -0.6, 99)[1:], np.linspace(-0.6, 0.6, 99)[1:])
    )
    stopped = cr.history(contact, forces=fractions * limit)
    assert stopped.energy_errors[-1] < 1.1 * plain.energy_errors[-1]


def test_a_thousand_loops_cost_a_thousand_times_the_error() -> None:
    """And a part more, for the displacements at two thousand turns."""
    contact = pressed("paper")
    limit = FRICTION * contact.load
    path = cr.history(contact, forces=np.tile([0.5, -0.5], 1000) * limit)
    one = cr.cycle(contact, maximum=0.5 * limit)
    assert 1.0 <= path.energy_errors[-1] / (999.75 * one.energy_error) < 1.2
