"""Friction bounded by its largest residual: each image, each term, and no growth with number."""

from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from itertools import product
from typing import Any, NamedTuple

import numpy as np
import pytest
from friction_scenes import FRACTIONS, FRICTION, KINDS, exact, in_doubt, off, pressed
from hypothesis import given as drawn
from hypothesis import settings
from hypothesis import strategies as st
from scenes import MATERIAL

import convexrough as cr
from convexrough.shearing import by_largest, judgement
from convexrough.shearing.bounds import Given
from convexrough.shearing.images import Image, images
from convexrough.shearing.judgement import judge_states
from convexrough.shearing.load_errors import couple_above
from convexrough.shearing.loss_errors import Nearness
from convexrough.shearing.normal_map import States, slips
from convexrough.shearing.pressed_fit import PressedFit, softness
from convexrough.shearing.problem import TangentialProblem
from convexrough.shearing.riding_weights import Weights
from convexrough.sphere import hertz

IMAGES = ["carried", "kept"]


class First(NamedTuple):
    """A state with what the norms say of it."""

    given: Given
    near: Nearness
    increments: Any


def first(problem: TangentialProblem, states: States) -> First:
    """Of one state, before the largest residual is looked at."""
    seen: list[First] = []

    def caught(given: Given, near: Nearness, increments: Any) -> Any:
        seen.append(First(given, near, increments))
        return near, increments

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(judgement, "by_largest", caught)
        judge_states(problem, states)
    assert len(seen) == 1
    return seen[0]


def found(first: First, image: str, in_norm: bool = False, **changes: Any) -> Any:
    """The bounds by one image, of which some terms may be left out; None where it is not made."""
    given, pressed_fit = first.given, PressedFit.of(first.given.problem)
    if in_norm:
        pressed_fit = pressed_fit._replace(sup=None)
    here = by_largest._near(given, first.near, first.increments[0], 0)
    every = {
        "kept" if each.turned is None else "carried": each for each in images(given, pressed_fit, 0)
    }
    if image not in every or not here.weights.total > 0:
        return None
    chosen = every[image]._replace(**{k: v for k, v in changes.items() if k in Image._fields})
    return by_largest._found(given, pressed_fit, here, chosen)


@pytest.mark.parametrize("digits", [3, 5, 8, 12, 15])
@pytest.mark.parametrize("fraction", FRACTIONS)
@pytest.mark.parametrize("control", ["approach", "load"])
@pytest.mark.parametrize("influence", KINDS)
def test_each_image_covers_eighty_digits(
    influence: Any, control: str, fraction: float, digits: int
) -> None:
    """Of rounded loads, whose certificate knows no better."""
    contact, truth = pressed("paper", influence, control), exact("paper", fraction, control)
    problem = TangentialProblem.of(in_doubt(contact, digits, control))
    total = fraction * contact.load / problem.units.force
    states = problem.solve(problem.limited(np.array([total])))
    try:
        before = first(problem, states)
    except AssertionError:
        assert digits == 3 or fraction > 0.99  # convexity proves nothing close to gross sliding
        return
    sure, places = before.given.known.sure, problem.touching
    for image, in_norm in product(IMAGES, (False, True)):
        if (bounds := found(before, image, in_norm)) is None:
            continue
        here = slips(problem, before.given.available)[0] * problem.travel_unit
        for i, place in enumerate(places):
            if sure[i]:
                error = off(states.increments[0, i] * problem.force_unit, truth.forces[place])
                assert error <= bounds.increments[i] * problem.force_unit
                error = off(here[i], truth.slips[place])
                assert error <= bounds.slips[i] * problem.travel_unit
        error = off(states.rises[0] * problem.travel_unit, truth.displacement)
        assert error <= bounds.rise * problem.travel_unit


class Attack(NamedTuple):
    """A state of wrong loads, in own units, and the true one."""

    first: First
    loads: Any
    forces: Any
    slips: Any
    rise: float


@cache
def attacks() -> list[Attack]:
    """Loads that are off in some way, known no better than that, and states that are off, too."""
    made = []
    for kind in ("approach", "load", "random", "one", "fringe", "slider", "none"):
        by_load = kind == "load"
        contact = pressed("rough", "lattice", "load" if by_load else "approach")
        wrong = wrongly_pressed(contact, kind)
        problem, true = TangentialProblem.of(wrong), TangentialProblem.of(contact)
        for fraction in (1e-6, 0.02, 0.3, 0.7):
            total = np.array([fraction * contact.load / problem.units.force])
            good = true.solve(total)
            for states in spoiled(problem, problem.solve(total)):
                made.append(
                    Attack(
                        first(problem, states),
                        true.loads,
                        good.increments[0],
                        good.slips[0],
                        float(good.rises[0]),
                    )
                )
    return made


def low_in_a_ring(low: float, approach: float) -> cr.Scene:
    """One below six that are crowded about it, and many around: it is dragged backwards."""
    angles, k = np.pi / 3 * np.arange(6), np.arange(400)
    ring = 0.0025 * np.stack((np.cos(angles), np.sin(angles)), axis=1)
    r, turns = np.sqrt(0.02**2 + (0.05**2 - 0.02**2) * (k + 0.5) / 400), (k + 0.5) * 2.399963
    points = np.vstack(([[0, 0]], ring, np.stack((r * np.cos(turns), r * np.sin(turns)), axis=1)))
    heights = np.concatenate(([-low], 4e-7 * np.arange(6), r * r / 2 - approach + 2e-4))
    return cr.Scene(1.0, cr.Asperities(points, 0.02, heights), MATERIAL, FRICTION)


@pytest.mark.parametrize("approach", [5e-4, 5.5e-4])
def test_a_load_that_slides_backwards_may_be_wrong(approach: float) -> None:
    """Then the ring is sheared as if it slid with less than its load, and the rise is off."""
    open_by = cr.press(low_in_a_ring(1.0, approach), approach=approach).gaps[0]
    contact = cr.press(low_in_a_ring(1.0 - open_by - 2e-7, approach), approach=approach)
    true = TangentialProblem.of(contact)
    total = np.array([0.2 * contact.load / true.units.force])
    good = true.solve(total)
    assert good.increments[0, 0] == -true.loads[0]
    problem = TangentialProblem.of(with_first(contact, 1 / 1.001))
    p = true.loads[0] - problem.loads[0]
    lighter = TangentialProblem.of(with_first(contact, (problem.loads[0] - p) / true.loads[0]))
    states = lighter.solve(total + p)
    u, deflections = states.increments.copy(), states.deflections.copy()
    u[0, 0] = -problem.loads[0]
    deflections[0, 0] = states.rises[0] - problem.couple(u)[0, 0]
    wrong = problem.solve(total)._replace(
        increments=u,
        rises=states.rises,
        deflections=deflections,
        slips=deflections - np.clip(deflections, -problem.ceilings, problem.ceilings),
    )
    bounds = judge_states(problem, wrong)
    assert abs(wrong.rises[0] - good.rises[0]) <= 0.9 * bounds.rises[0] < np.inf
    assert (np.abs(u - good.increments) <= bounds.increments).all()


def with_first(contact: cr.Contact, factor: float) -> cr.Contact:
    """The first load is off by this factor, and known no better."""
    loads = contact.loads * np.where(np.arange(len(contact.loads)) == 0, factor, 1.0)
    errors = np.abs(loads - contact.loads) * (1 + 1e-9) + 1e-15 * contact.loads
    return replace(
        contact,
        loads=loads,
        load=float(loads.sum()),
        contact_radii=hertz.contact_radius(loads, 1.0, contact.scene.relative_radii),
        certificate=replace(contact.certificate, load_errors=errors, approach_error=0.0),
    )


def wrongly_pressed(contact: cr.Contact, kind: str) -> cr.Contact:
    """As in `test_all_that_wrong_loads_can_do_is_counted`."""
    off_by, loaded, approach = 1e-6, contact.loads > 0, contact.approach
    if kind in ("approach", "load"):
        scene = contact.scene
        near = cr.press(scene, approach=approach * (1 + off_by), influence=contact.influence)
        loads, approach = near.loads, near.approach
    else:
        size = np.random.default_rng(5).choice([-1, 1], len(loaded)).astype(float)
        if kind != "random":
            order = np.argsort(np.where(loaded, contact.loads, np.inf))
            slides = np.flatnonzero(cr.shear(contact, force=0.35 * contact.load).slips)
            chosen = {
                "fringe": order[:6],
                "one": order[int(loaded.sum()) - 1 :],
                "slider": slides[[np.argmax(contact.loads[slides])]],
            }.get(kind, order[:0])
            size = np.isin(np.arange(len(loaded)), chosen).astype(float)
        loads = contact.loads * (1 + off_by * size)
    by_load = kind == "load"
    proof = replace(
        contact.certificate,
        load_errors=np.abs(loads - contact.loads) * (1 + 1e-9) + 1e-14 * contact.loads,
        approach=approach if by_load else contact.approach,
        approach_error=abs(approach - contact.approach) if by_load else 0.0,
    )
    return replace(
        contact,
        loads=loads,
        load=float(loads.sum()),
        contact_radii=hertz.contact_radius(loads, 1.0, contact.scene.relative_radii),
        certificate=proof,
    )


def spoiled(problem: TangentialProblem, states: States) -> Iterator[States]:
    """As found; and with one force, all forces or the rise off by 1e-6."""
    yield states
    u, room = states.increments, problem.loads - states.increments
    one = np.argmax(np.minimum(u, room)[0])
    changes = 1e-6 * np.minimum(u, room)
    for change in (changes, -changes, np.where(np.arange(u.shape[1]) == one, changes, 0.0)):
        yield states._replace(increments=u + change)
    yield states._replace(rises=states.rises * (1 + 1e-6))


def broken(attack: Attack, image: str, in_norm: bool = False, **changes: Any) -> set[str]:
    """Which bounds do not hold."""
    given = attack.first.given
    if (bounds := found(attack.first, image, in_norm, **changes)) is None:
        return set()
    sure, u = given.known.sure, given.states.increments[0]
    here = slips(given.problem, given.available)[0]
    carried = u / given.problem.loads * attack.loads
    errors = {
        "forces": np.abs(u - attack.forces) > bounds.increments,
        "shares": np.abs(carried - attack.forces) > bounds.shares,
        "slips": np.abs(here - attack.slips) > bounds.slips,
        "rise": np.abs(given.states.rises[0] - attack.rise) > bounds.rise,
    }
    return {name for name, wrong in errors.items() if (sure & wrong).any()}


@pytest.mark.parametrize("in_norm", [False, True])
@pytest.mark.parametrize("image", IMAGES)
def test_all_that_wrong_loads_and_states_can_do_is_counted(image: str, in_norm: bool) -> None:
    counted = [found(attack.first, image) is not None for attack in attacks()]
    assert sum(counted) >= len(counted) / (1 if image == "carried" else 4)
    assert not any(broken(attack, image, in_norm) for attack in attacks())


@pytest.mark.parametrize(
    ("image", "term", "bound"),
    [
        ("carried", "residual", "shares"),
        ("carried", "missing", "rise"),
        ("carried", "slips", "slips"),
        ("carried", "shares", "forces"),
        ("kept", "blur", "forces"),
        ("kept", "shares", "forces"),
    ],
)
def test_no_term_of_an_image_is_idle(image: str, term: str, bound: str) -> None:
    """Without it some bound is too small, though the total of the loads be known."""

    def without(attack: Attack) -> set[str]:
        problem = attack.first.given.problem
        known = {"missing": abs(float((attack.loads - problem.loads).sum()))}
        zero = 0.0 if term == "missing" else np.zeros(len(problem))
        return broken(attack, image, **(known if image == "carried" else {}) | {term: zero})

    assert any(bound in without(attack) for attack in attacks())


@pytest.mark.parametrize("term", ["each", "mean", "shift"])
def test_no_term_of_the_residual_is_idle(term: str, monkeypatch: pytest.MonkeyPatch) -> None:
    true = by_largest._residual

    def without(*arguments: Any) -> Any:
        residual = true(*arguments)
        return residual._replace(**{term: 0.0 * getattr(residual, term)})

    monkeypatch.setattr(by_largest, "_residual", without)
    assert any(broken(attack, image) for attack in attacks() for image in IMAGES)


def test_a_total_that_is_missed_is_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(by_largest, "_missing", lambda *arguments: 0.0)
    assert any("forces" in broken(attack, "kept") for attack in attacks())


@pytest.mark.parametrize("image", IMAGES)
def test_own_deflections_change_by_no_more(image: str) -> None:
    """On any loads within their bounds, forwards and backwards, from nothing to full slip."""
    contact = in_doubt(pressed("rough"), 3, "approach")
    problem, rng = TangentialProblem.of(contact), np.random.default_rng(7)
    P, most = problem.loads, 0.0
    total = np.array([0.01 * P.sum()])
    given = first(problem, problem.solve(total)).given
    pressed_fit, known = PressedFit.of(problem), given.known
    b, soft = known.errors, softness(problem)

    def own(forces: Any, loads: Any) -> Any:
        left = np.cbrt(np.maximum(loads - np.abs(forces), 0.0))
        return 1.5 * soft * np.copysign(np.cbrt(loads) ** 2 - left**2, forces)

    for _ in range(300):
        u = P * 10.0 ** rng.uniform(-6, 0) * rng.uniform(-0.01, 1, len(P)) ** 3
        few = rng.random(len(P)) < 0.01
        u = np.where(few, P - b * rng.uniform(0, 4, len(P)), u)
        u = np.where(rng.random(len(P)) < 0.01, P, u)
        states = given.states._replace(increments=u[None])
        every = dict(
            zip(IMAGES, images(given._replace(states=states), pressed_fit, 0), strict=False)
        )
        if image not in every:
            continue
        chosen, loads = every[image], P + b * rng.choice([-1, 1], len(P))
        x = np.sign(u) * (np.abs(u) + chosen.shares * (loads - P))
        if image == "carried":
            x = u + (loads - P)
        change = own(x, loads) - own(u, P)
        blur = chosen.blur
        if image == "carried":
            change -= 1.5 * soft * (np.cbrt(loads) ** 2 - np.cbrt(P) ** 2)
            blur = blur - pressed_fit.rounding
        else:
            blur = blur - couple_above(problem, chosen.shares * b)
        assert (np.abs(x) <= loads * (1 + 1e-12))[known.sure & np.isfinite(blur)].all()
        assert (np.abs(change) <= blur * (1 + 1e-6) + 1e-15 * soft)[known.sure].all()
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.where(np.abs(change) > 1e-13 * soft, np.abs(change) / blur, 0.0)
        most = max(most, float(ratio[known.sure].max()))
    assert most > (0.1 if image == "carried" else 0.5)


@settings(max_examples=50, deadline=None)
@drawn(st.integers(0, 2**32 - 1), st.sampled_from(KINDS), st.floats(0.0, 0.2))
def test_weights_say_what_they_leave(seed: int, influence: Any, width: float) -> None:
    """|M mu - 1| for any stiffness in the range, and sum v = sum mu f + sum v (1 - M mu)."""
    problem = TangentialProblem.of(pressed("rough", influence))
    rng = np.random.default_rng(seed)
    slides = rng.random(len(problem)) < 0.3
    softest = softness(problem) / np.cbrt(problem.loads) * rng.uniform(1, 3, len(problem))
    stiffest = np.where(slides, np.inf, softest * (1 + width))
    weights = Weights.of(problem, softest, stiffest)
    stiffness = softest * (1 + width * rng.random(len(problem)))
    matrix = TangentialProblem.of(pressed("rough")).influence.matrix
    left = np.abs(stiffness * weights.values + matrix @ weights.values - 1)
    assert (weights.values[slides] == 0).all()
    assert (left <= weights.off).all()
    assert weights.off[~slides].max() < 1e-3 + 1.1 * width
    assert weights.total == pytest.approx(weights.values.sum(), rel=1e-11)


def test_stiffness_lies_between_what_it_is_said_to() -> None:
    """On any loads and forces within the bounds; what may slide has no weight."""
    rng = np.random.default_rng(3)
    for attack in attacks():
        given, near = attack.first.given, attack.first.near
        here = by_largest._near(given, near, attack.first.increments[0], 0)
        problem, known = given.problem, given.known
        loads = problem.loads + rng.uniform(-1, 1, len(problem)) * known.errors
        swing = np.maximum(attack.first.increments[0], known.errors)
        u = np.abs(given.states.increments[0] + rng.uniform(-1, 1, len(loads)) * swing)
        left = np.maximum(loads - u, 1e-30 * loads)  # full slip is as stiff as can be
        stiffness = softness(problem) / np.cbrt(left)
        assert (stiffness * (1 + 1e-12) >= here.softest)[known.sure].all()
        off = np.abs(stiffness * here.weights.values + problem.couple(here.weights.values) - 1)
        held = here.weights.values > 0
        assert (off[held] <= here.weights.off[held]).all()
        assert not (held & (attack.slips > 0)).any()


@pytest.mark.parametrize("fraction", [0.1, 0.6])
def test_where_the_theorem_is_silent_a_norm_is_bounded(fraction: float) -> None:
    """Discs that overlap, by a quarter of their distance: still digits of the loads."""
    made = cr.Asperities.hexagonal(spacing=0.0025 / 5, tip_radius=0.02 / 5, within=0.01)
    radii = np.where(np.arange(len(made)) % 2, 0.042, 0.04)
    asperities = cr.Asperities(made.positions, radii)
    scene = cr.Scene(1.0, asperities, MATERIAL, FRICTION)
    contact = cr.press(scene, approach=5e-5, influence="lattice")
    assert PressedFit.of(TangentialProblem.of(contact)).sup is None
    state = cr.shear(contact, force=fraction * FRICTION * contact.load)
    assert state.certificate.holds
    assert state.certificate.force_errors.max() < 2e-10 * state.forces.max()
    assert state.certificate.displacement_error < 1e-12 * state.displacement


@pytest.mark.parametrize("control", ["approach", "load"])
@pytest.mark.parametrize("fraction", [1e-6, 0.1, 0.5, 0.9])
def test_bounds_do_not_grow_with_the_number(fraction: float, control: str) -> None:
    """300 to 4,800 asperities: the rise to 1e-12, forces and losses to 2e-10."""
    for times in (3, 6, 12):
        contact = lattice(times, control)
        state = cr.shear(contact, force=fraction * FRICTION * contact.load)
        proof = state.certificate
        assert proof.holds
        assert proof.displacement_error < 1e-12 * state.displacement
        assert proof.force_errors.max() < 1e-10 * state.forces.max()
        assert proof.slip_errors.max() < 1e-11 * state.displacement
        cycle = cr.cycle(contact, maximum=fraction * FRICTION * contact.load)
        assert cycle.energy_error < 2e-10 * cycle.energy


@cache
def lattice(times: int, control: str) -> cr.Contact:
    asperities = cr.Asperities.hexagonal(
        spacing=0.0025 / times, tip_radius=0.02 / times, within=0.01
    )
    scene = cr.Scene(1.0, asperities, MATERIAL, FRICTION)
    contact = cr.press(scene, approach=5e-5, influence="lattice")
    return contact if control == "approach" else cr.press(scene, load=contact.load)
