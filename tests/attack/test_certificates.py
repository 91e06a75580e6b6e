"""Certificates under attack: at the ends of arithmetic, near gross sliding, along paths.

Those of pressed contacts are judged in whole numbers and in 60 digits.
"""

import json
from fractions import Fraction
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from flint import arb, ctx
from friction_scenes import LARGEST, PAPER, SCENES, around, on_flat, shaded
from levels_reference import Bristles, assert_close, cycle_loss, judge_of, loss_and_displacement
from multiprecision import exact, of_scene, travel_of
from scenes import MATERIAL, PAPER_APPROACH, STEEL, on_sphere, paper, reference
from status_audit import compare, excess

import convexrough as cr
from convexrough import checker

P = LARGEST["paper"]


def inside(tip: float, share: float) -> cr.Contact:
    """Two asperities, the small one inside the other's disc, with about this share of its load."""
    apart = 0.5 / 2.8
    height = 1 / (6 * np.pi * apart) - 0.25 + 0.25 * share ** (2 / 3) / tip ** (1 / 3)
    scene = on_flat([[0.0, 0.0], [apart, 0.0]], [1.0, tip], [0.0, height])
    contact = cr.press(scene, approach=0.25)
    assert (contact.loads > 0).all()
    return contact


@pytest.mark.parametrize(
    ("make", "load"), [(around, 4.0), (around, 3.5), (lambda P: cr.press(shaded(), load=P), 3.0)]
)
def test_losses_where_order_fails(make: Any, load: float) -> None:
    """Bristles are good to 1e-7 of the largest force and 1e-5 of the loss here, and the forces are
    2e-6 off, or more, and the loss 2e-4.
    """
    contact = make(load)
    assert contact.certificate.scope == "global"
    for fraction in (0.5, 0.8):
        force = fraction * 0.5 * load
        cycle, true = cr.cycle(contact, maximum=force), cycle_loss(contact, force)
        assert abs(cycle.loss - true) <= cycle.loss_error + 2e-5 * true
        borne = Bristles(contact).to(np.linspace(0, force, 101)[1:]).forces
        state = cr.shear(contact, force=force)
        for proof in (state.certificate, cr.certify_shear(contact, state.forces, force=force)):
            off = np.abs(state.forces - borne)
            assert (off <= proof.force_errors + 5e-7 * borne.max()).all()


@pytest.mark.parametrize("turns", [[0.8, -0.6, 0.5], [0.8, 0.4, 0.6, -0.2]])
def test_histories_where_order_fails(turns: list[float]) -> None:
    """The general step knows how well it does: energies within a part in a thousand, or none."""
    contact, forces = around(4.0), 0.5 * 4.0 * np.array([0.0, *turns])
    past, state = cr.history(contact, forces=forces), Bristles(contact)
    path = cr.load_path(contact.scene, loads=np.full(len(forces), 4.0), forces=forces)
    assert path.order == "fails"
    for i, (before, after) in enumerate(pairwise(forces), start=1):
        true = state.to(np.linspace(before, after, 201)[1:]).lost
        assert abs(past.losses[i] - true) <= past.loss_errors[i] + 2e-5 * true
        assert np.isnan(path.losses[i]) or path.losses[i] == pytest.approx(true, rel=1e-3)


def test_no_false_word_near_gross_sliding() -> None:
    """P lacks more than the small one could ever take back, so the large one cannot slide."""
    contact = inside(1e-3, 1e-5)
    force = (1 - 1e-12) * 0.5 * contact.load
    assert Bristles(contact).to(np.linspace(0, 0.495 * contact.load, 401)[1:]).bent[1].min() > 0
    # The small one has turned and slides forward, as it does from here on.
    statuses = cr.shear(contact, force=force).status
    assert statuses[0] != "sliding"
    assert statuses[1] != "partial"


def test_no_false_word_of_given_forces() -> None:
    contact = inside(0.01, 0.005)
    force = 0.99 * 0.5 * contact.load
    true = Bristles(contact).to(np.linspace(0, force, 801)[1:])
    assert (np.abs(true.forces) < 0.999 * 0.5 * contact.loads).all()  # so both stick
    statuses = cr.certify_shear(contact, cr.shear(contact, force=force).forces, force=force).status
    assert (statuses != "sliding").all()


def test_no_slip_of_what_does_not_touch() -> None:
    """The middle of three is open, and the proof is too coarse to tell."""
    points = [[0.0, 0.0], [0.003, 0.0], [-0.003, 0.0]]

    def pressed(height: float) -> cr.Contact:
        scene = on_sphere(points, heights=[height, 0.0, 0.0], friction=0.5)
        return cr.press(scene, approach=3e-5)

    contact = pressed(pressed(-3e-5).gaps[0] - 3e-5 - 1e-11)
    assert contact.status[0] == "open"
    state = cr.shear(contact, force=0.15 * contact.load)
    document = json.loads(json.dumps(contact.proof(sheared=[state]).document))
    radii = document["pressed"]["radii"]
    document["pressed"]["radii"] = [[float(f"{float.fromhex(r[0]):.4e}").hex()] for r in radii]
    proved = checker.prove(document)
    assert proved["status"][0] == "undecided"
    assert proved["shear"][0]["slips"][0].low == 0


@pytest.mark.parametrize("fraction", [3e-4, 0.5])
def test_gradients_of_one_asperity_are_within_their_bounds(fraction: float) -> None:
    """The approach all but cancels the drop, so that its rounding is felt."""
    rng = np.random.default_rng(3)
    for _ in range(6):
        place = rng.uniform(1, 2, 2)
        scene = on_sphere([place], 0.144, radius=300.0, friction=0.5)
        low = 1 + 10 ** rng.uniform(-5, -2)
        contact = cr.press(scene, approach=float(place @ place) / 600 * low)
        force = fraction * 0.5 * contact.load
        judge = judge_of(loss_and_displacement, contact, "approach", force)
        loss = cr.cycle(contact, maximum=force).gradient()
        moved = cr.shear(contact, force=force).gradient(displacement=1.0)
        slopes = judge.difference("heights", exact([1.0]))
        for found, true in zip((loss, moved), slopes, strict=True):
            assert_close(true, found.heights, found.height_errors, "heights")


def test_gradients_of_gaps_are_within_their_bounds() -> None:
    """Lift the only one that touches under a held load: each gap grows by as much."""
    points = [[0.0, 0.0], [0.01, 0.0], [-0.01, 0.0], [0.0, 0.01]]
    contact = cr.press(on_sphere(points, heights=[0.0, -1e-3, -1e-3, -1e-3]), load=1e-8)
    assert contact.status.tolist() == ["contact", "open", "open", "open"]
    rng = np.random.default_rng(1)
    for _ in range(20):
        weights = rng.standard_normal(4)
        gradient = contact.gradient(gaps=weights)
        true = sum(map(Fraction, weights[1:].tolist()))
        assert abs(Fraction(gradient.heights[0]) - true) <= Fraction(gradient.height_errors[0])


@pytest.mark.parametrize("control", ["load", "approach"])
def test_one_of_two_contacts_that_exclude_each_other(control: str) -> None:
    """The blunt one alone touches. At less load the sharp one alone would do so as well."""
    scene = on_flat([[0.0, 0.0], [0.05, 0.0]], [1.0, 16.0], [0.0, -0.05])
    blunt = on_flat([[0.05, 0.0]], 16.0, -0.05)
    pressed = cr.press(scene, load=0.1)
    assert pressed.status.tolist() == ["open", "contact"]
    assert cr.press(scene, load=0.05).status.tolist() == ["contact", "open"]
    contact = cr.press(scene, **{control: getattr(pressed, control)}, start=pressed.loads)
    alone = cr.press(blunt, load=contact.load)
    state, cycle = cr.shear(contact, force=0.025), cr.cycle(contact, maximum=0.025)
    assert np.abs(state.forces - [0.0, 0.025]).max() <= 1e-16
    assert state.status.tolist() == ["open", "partial"]
    assert cycle.loss == pytest.approx(cr.cycle(alone, maximum=0.025).loss, rel=1e-12)
    path, true = (cr.history(each, forces=[0.025, -0.025]) for each in (contact, alone))
    assert path.order == cycle.order == "proved"
    assert path.losses == pytest.approx(true.losses, rel=1e-12)


def test_the_smallest_shear_is_borne() -> None:
    path = cr.load_path(PAPER, loads=[P, P], forces=[0.0, -1e-17 * P])
    missing = abs(path.asperity_forces[-1].sum() - path.forces[-1])
    assert missing <= path.asperity_force_errors[-1].sum() + 1e-30 * P


@pytest.mark.parametrize("share", [1e-24, 1e-28, 1e-40])
def test_a_path_through_almost_no_load(share: float) -> None:
    scene, approach = SCENES["dense"]
    load = cr.press(scene, approach=approach).load
    shear = np.array([0.1, 0.3 * share, 0.2]) * load
    path = cr.load_path(scene, loads=np.array([1.0, share, 1.0]) * load, forces=shear)
    assert (path.displacement_errors <= 1e-8 * path.displacements.max()).all()
    assert (path.loss_errors <= 1e-8 * 0.25 * load * approach).all()


def test_gross_sliding_where_order_fails() -> None:
    """There and back at the limit f P, at a load that varies and one that does not."""
    contact = around(4.0)
    loads = np.array([4.0, 4.0, 3.0, 4.0])
    path = cr.load_path(contact.scene, loads=loads, forces=0.5 * loads * [1, -1, -1, 0])
    assert path.order == "fails"
    limits = 0.5 * path.asperity_loads
    assert path.asperity_forces[:3] == pytest.approx(limits[:3] * [[1], [-1], [-1]], rel=1e-12)
    true = Bristles(contact).to(2.0 * np.linspace(0, 1 - 1e-7, 201)[1:])
    history = cr.history(contact, forces=[2.0, -2.0, 2.0])
    assert history.displacements[0] == pytest.approx(true.displacement, rel=1e-4)
    assert history.displacements[2] == pytest.approx(history.displacements[0], rel=1e-9)


#: Asperities x, y, height and tip radius, along paths where general steps are hard.
STEPS = {
    "slopes jump where asperities begin or cease to slide": (
        [[0.8, -0.5, -0.003, 0.3], [-0.6, 0.7, -0.006, 8.0], [-0.7, -0.4, -0.027, 0.7],
         [-0.7, 0.1, -0.04, 0.3], [0.9, 0.1, -0.024, 1.3]],
        [0.5, 0.1875, 0.0625], [-0.5, 0.1873125, 0.0625],
    ),
    "many begin to slide": (
        [[0.6, -0.3, -0.003, 7.6], [-0.9, 0.1, -0.033, 0.1], [-0.7, 0.4, -0.005, 6.0],
         [-0.3, -0.1, -0.027, 0.6], [1.0, 0.6, -0.002, 0.3], [0.7, 0.1, -0.012, 1.2]],
        [2.0, 2.0, 1.75], [1.5, -1.5, 1.75 * (1 - 1e-9)],
    ),
    "as near to gross sliding as rounding allows": (
        [[-0.5, -0.9, -0.007, 0.1], [-1.0, 0.6, -0.023, 5.2], [0.8, 0.2, -0.035, 0.1],
         [0.5, 0.1, -0.029, 2.9], [0.9, 0.6, -0.049, 0.2]],
        [2.0, 2.0, 2.0], [0.0, 2.0 * (1 - 3e-15), -2.0 * (1 - 3e-15)],
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", STEPS)
def test_general_steps_next_to_gross_sliding(name: str) -> None:
    asperities, loads, T = (np.array(each) for each in STEPS[name])
    x, y, heights, tips = asperities.T
    scene, forces = on_flat(np.column_stack((x, y)), tips, heights), 0.5 * T
    true = cr.load_path(scene, loads=loads, forces=forces)
    for steps in (1, 4):
        path = cr.load_path(scene, loads=loads, forces=forces, general_steps=steps)
        assert path.asperity_forces.sum(axis=1) == pytest.approx(forces, rel=1e-15, abs=1e-15)
        assert (abs(path.asperity_forces) <= 0.5 * path.asperity_loads * (1 + 1e-12)).all()
        if true.order == "proved":
            assert path.asperity_forces == pytest.approx(true.asperity_forces, abs=1e-11)
            assert path.displacements == pytest.approx(true.displacements, rel=1e-9)
    if T[0] == 0:
        assert path.displacements[2] == pytest.approx(-path.displacements[1], rel=1e-6)


def test_losses_by_asperities_where_the_load_falls_below_a_front() -> None:
    """A cell begins with the front at a level that is above the load at the end of the cell."""
    loads = P * np.array([1.0, 1e-3, 1e-3])
    settled = cr.steady(PAPER, loads=loads, forces=0.5 * loads * [0.5, 0.1, 0.9])
    off = abs(settled.asperity_losses.sum() - settled.loss)
    assert off <= settled.asperity_loss_errors.sum() + settled.loss_error
    assert (settled.asperity_losses >= 0).all()


@pytest.mark.parametrize("seed", range(5))
def test_energies_never_fall(seed: int) -> None:
    """Through many steps at the limit |dQ| = f |dP|, where the front hardly runs."""
    rng = np.random.default_rng(seed)
    points = [(float(rng.uniform(0.2, 1)), 0.0)]
    for _ in range(8):
        (load, force), kind = points[-1], rng.integers(3)
        after = float(np.clip(load + rng.uniform(-0.3, 0.3) * 10 ** rng.uniform(-6, 0), 0.01, 1))
        slope = rng.choice([-0.5, 0.5]) * (1.0, 1 + 1e-9, rng.uniform(0, 2))[kind]
        limit = 0.5 * after
        points.append((after, float(np.clip(force + slope * (after - load), -limit, limit))))
    loads, forces = P * np.array(points).T
    assert (np.diff(cr.load_path(PAPER, loads=loads, forces=forces).losses) >= 0).all()


@pytest.mark.parametrize("below", [-2, 0, 1, 7, 12, 20, 27])
def test_forces_that_miss_gross_sliding_by_roundings(below: int) -> None:
    """One asperity, whose approach is k L^(2/3) at the load L, in closed form."""
    rng = np.random.default_rng(20 + below)
    friction, load = float(rng.uniform(0.05, 2.0)), float(10 ** rng.uniform(-40, 10))
    scene = on_sphere([[0.0, 0.0]], friction=friction)
    contact, misses = cr.press(scene, load=load), below > 17  # else Q counts as f P
    force = friction * load * (1 - below * 2.0**-53)
    cycle, state = cr.cycle(contact, maximum=force), cr.shear(contact, force=force)
    past = cr.history(contact, forces=[force, 0.5 * force])
    used = force if misses else float(Fraction(friction) * Fraction(load))
    assert used == cycle.maximum == past.forces[0] == state.force
    with ctx.workdps(80):
        f, P, third = arb(friction), arb(load), arb(1) / 3
        k, travel = of_scene(scene)[2][0], travel_of(f, arb(MATERIAL.poisson_ratio))
        L = P - arb(force) / f if misses else arb(0)
        top, held = k * P ** (2 * third), k * L ** (2 * third)
        stored, moved = 3 * (P * top - L * held) / 5, travel * (top - held)
        loss = 8 * travel * f * (stored - (P - L) / 2 * (top + held))
        for value, error, true in (
            (cycle.loss, cycle.loss_error, loss),
            (cycle.displacement_amplitude, cycle.displacement_error, moved),
            (past.displacements[0], past.displacement_errors[0], moved),
            (state.displacement, state.certificate.displacement_error, moved),
        ):
            assert abs(arb(value) - true) <= arb(error) * (1 + arb(2) ** -40)
        far = float(travel * top) * (1 - below * 2.0**-53)
        pushed = cr.shear(contact, displacement=far)
        left = (max(top - arb(far) / travel, arb(0)) / k) ** (arb(3) / 2) if misses else arb(0)
        assert (pushed.displacement == far) or not misses
        assert abs(arb(pushed.force) - f * (P - left)) <= arb(pushed.certificate.force_error)
        assert pushed.slips[0] == 0


def test_the_checker_agrees_below_gross_sliding() -> None:
    rng = np.random.default_rng(9)
    for _ in range(40):
        points, tips = rng.uniform(-0.003, 0.003, (3, 2)), 0.02 * np.exp(rng.normal(0, 0.7, 3))
        scene = cr.Scene(1.0, cr.Asperities(points, tips, rng.normal(0, 1e-6, 3)), MATERIAL, 0.3)
        contact = cr.press(scene, approach=float(10 ** rng.uniform(-5.3, -5)))
        force = 0.3 * contact.load * (1 - 2.0**-53 * rng.integers(20, 60))
        state = cr.shear(contact, force=force)
        found = cr.cycle(contact, maximum=force)
        claims = contact.proof(sheared=[state]).document["claims"]["shear"][0]
        for name, value, error in (
            ("loss", found.loss, found.loss_error),
            ("displacement", state.displacement, state.certificate.displacement_error),
            ("displacement", found.displacement_amplitude, found.displacement_error),
        ):
            low, high = map(float.fromhex, claims[name])
            assert value - error <= high
            assert value + error >= low


def test_bounds_belong_to_the_force_of_a_prescribed_displacement() -> None:
    """Close to gross sliding the force is f P, rounded, and its rounding is not in the bounds."""
    contact = cr.press(cr.Scene(1.0, PAPER.asperities, MATERIAL, 0.3), load=3.3e-7)
    farthest = cr.shear(contact, force=0.3 * contact.load).displacement
    for part in (1e-10, 1e-6, 0.5):
        state = cr.shear(contact, displacement=farthest * (1 - part))
        gradient = state.gradient(displacement=1.0)
        assert abs(gradient.value - state.displacement) <= gradient.value_error
        cycle = cr.cycle(contact, displacement=farthest * (1 - part))
        loss = cycle.gradient(holding="load")
        assert abs(loss.value - cycle.loss) <= loss.value_error + cycle.loss_error
        assert cycle.loop().displacements.max() == pytest.approx(state.displacement, rel=1e-14)
    twice = cr.press_many([contact.scene] * 2, load=3.3e-7)
    many = twice.cycles(0.3 * 3.3e-7 * (1 - 14 * 2.0**-53))
    assert (many.maximum == [many[0].maximum, many[1].maximum]).all()


@pytest.mark.parametrize("off", [0.0, -5e-15, 5e-15, -2.3e-16])
def test_sides_of_a_tie_where_one_side_does_not_exist(off: float) -> None:
    scene, unit = cr.Scene(1.0, PAPER.asperities, MATERIAL, 0.5), 2.0**-22
    loads, forces = unit * np.array([0.25, 0.5 + off, 0.5]), 0.5 * unit * np.array([0.25, 0, 0.25])
    gradient = cr.load_path(scene, loads=loads, forces=forces).gradient()
    assert np.isnan([gradient.forces[0], gradient.loads[0]]).all()
    assert gradient.force_sides[0] == pytest.approx([-2.79425751e-8, np.nan], rel=1e-6, nan_ok=True)
    assert gradient.load_sides[0] == pytest.approx([np.nan, 9.7508208e-8], rel=1e-6, nan_ok=True)


def test_derivatives_by_loads_that_differ_by_rounding() -> None:
    scene, P = cr.Scene(1.0, PAPER.asperities, MATERIAL, 0.5), 3.3e-7
    forces = 0.5 * P * np.array([0.1, 0.05, 0.1, 0.2])
    loads = (P * np.array([0.5, each, 0.3, 0.9]) for each in (0.1 + 0.2, 0.3))
    one, other = (cr.load_path(scene, loads=each, forces=forces).gradient() for each in loads)
    np.testing.assert_allclose(one.loads, other.loads, rtol=0, atol=1e-16)
    ended = cr.load_path(scene, loads=[P, 0], forces=[0.05 * P, 0]).gradient()
    assert ended.forces[0] == 0


@pytest.mark.parametrize("radius", [0.7, 1.3])
def test_the_duality_gap_where_heights_cancel_drops(radius: float) -> None:
    """Summits on a bowl: the indentation of 1e-12 is a difference of numbers near 10."""
    points = 3.0 * (np.indices((3, 3)).reshape(2, -1).T - 1)
    scene = on_sphere(points, 1.0, (points**2).sum(axis=1) / (2 * radius), radius)
    contact = cr.press(scene, approach=1e-12, influence="lattice")
    exact = reference(scene, approach=1e-12)
    assert contact.certificate.duality_gap >= excess(scene, contact.loads, exact)


def test_a_stored_matrix_of_many_rows_decides_what_grazes() -> None:
    """900 summits anywhere, one of which is raised until it touches, to within rounding."""
    rng = np.random.default_rng(2)
    i, j = np.array(np.divmod(np.arange(900), 30)) - 14.5
    points = 0.0025 * np.column_stack((i, j)) + rng.uniform(-2e-4, 2e-4, (900, 2))

    def pressed(heights: Any) -> cr.Contact:
        return cr.press(on_sphere(points, 0.02, heights), approach=8e-4, influence="dense")

    contact, heights = pressed(0.0), np.zeros(900)
    assert contact.certificate.load_error < 2e-16 * contact.loads.max()
    which = int(np.argmin(np.where(contact.gaps > 0, contact.gaps, np.inf)))
    for off, status in ((-1e-15, "open"), (1e-15, "contact")):
        heights[which] = contact.gaps[which] + off
        assert pressed(heights).status[which] == status


@pytest.mark.parametrize("load", [1e-320, 5e-324])
def test_the_duality_gap_of_loads_that_underflow(load: float) -> None:
    """The solution carries nothing and has no energy; these loads have some."""
    scene = on_sphere([[0.0, 0.0], [0.01, 0.0]], heights=-1e-8)
    gap = cr.certify(scene, [load, 0.0], approach=5e-9).duality_gap
    assert Fraction(gap) >= Fraction(5e-9) * Fraction(load)


def test_errors_of_a_claim_are_not_short_by_a_rounding() -> None:
    """Of loads far from the solution, whose own bound is less than what their distance loses."""
    scene, exact = paper(), reference(paper(), approach=PAPER_APPROACH)
    rng = np.random.default_rng(1)
    for _ in range(20):
        claimed = 10.0 ** rng.uniform(-7, 0, 61)
        verdict = cr.verify(scene, claimed, approach=PAPER_APPROACH)
        compare("load", verdict.errors, claimed, exact.loads)


@pytest.mark.parametrize(("load", "apart"), [(0.003, 1.5e-6), (0.03, 1.5e-6), (0.003, 2.2e-6)])
def test_an_open_summit_under_or_beside_a_disc_is_told_of(load: float, apart: float) -> None:
    """The summit is 20 nm lower, under its neighbour's disc or at 1.3 of its radius."""
    asperities = cr.Asperities([[0.0, 0.0], [apart, 0.0]], 2e-4, [0.0, -2e-8])
    contact = cr.press(cr.Scene(0.01, asperities, STEEL, 0.3, geometry="summit"), load=load)
    assert contact.status.tolist() == ["contact", "open"]
    assert contact.contact_radii[0] > apart / 1.5
    assert any("disc" in line for line in contact.warnings)
    assert "disc" in repr(contact)
    assert "disc" in repr(cr.shear(contact, force=0.1 * load))
