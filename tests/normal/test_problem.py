"""The normal problem: derivatives, bounds, convexity, known answers, and extreme units."""

import itertools
import math
from functools import partial
from typing import Any

import numpy as np
import pytest
import scenes
from flint import arb, ctx
from friction_scenes import ring
from hypothesis import given, settings
from hypothesis import strategies as st
from multiprecision import middle, of_scene
from numpy.testing import assert_allclose

import convexrough as cr
from convexrough.arithmetic.balls import Ball
from convexrough.arithmetic.pairs import Pair
from convexrough.convex.newton import descend
from convexrough.influence import Kind
from convexrough.normal import load_control
from convexrough.normal.boxes import tried
from convexrough.normal.load_control import all_that_could_touch, highest_approach
from convexrough.normal.problem import NormalProblem
from convexrough.normal.proved import proved
from convexrough.normal.refine import refined_loads
from convexrough.scene.asperities import CUT_DEVIATIONS, largest_tip_radius
from convexrough.scene.lattice import Lattice
from convexrough.scene.scene import reach
from convexrough.solvers import Newton
from convexrough.solvers.newton import Pressing
from convexrough.sphere import hertz


def test_screening_drops_only_those_that_cannot_touch() -> None:
    # The ring at 4 spacings lies at D = 0 to rounding, and is kept.
    assert len(NormalProblem.assemble(scenes.paper(), approach=5e-5)) == 61
    problem = NormalProblem.assemble(scenes.paper(), approach=1e-5)
    inside = scenes.paper().asperities.distances < np.sqrt(2e-5)
    assert set(problem.candidates) == set(np.flatnonzero(inside))


@settings(max_examples=20, deadline=None)
@given(scenes.random_cases(crowding=1.5), st.integers(0, 2**32 - 1))
def test_the_approach_bound_holds_for_any_weights(sampled: scenes.Case, seed: int) -> None:
    """No solution carries more than an asperity would alone; no load, a higher approach."""
    scene, approach, kind = sampled
    contact = cr.press(scene, approach=approach)
    problem = NormalProblem.assemble(scene, approach=approach, influence=kind)
    bounds = problem.bounds(problem.approach_bound) * problem.units.force
    assert (contact.loads[problem.candidates] <= bounds).all()
    if contact.load == 0:
        return
    assert highest_approach(scene, contact.load, kind) >= approach * (1 - 1e-12)
    problem = NormalProblem.assemble(scene, load=contact.load, influence=kind)
    assert set(np.flatnonzero(contact.loads)) <= set(problem.candidates)
    weights = np.random.default_rng(seed).random(len(problem)) ** 9
    bound = problem.overhang(weights, problem.plain_product(Pair.exact(weights)))
    assert bound * problem.units.length >= approach * (1 - 1e-12)


@pytest.mark.parametrize("kind", ["dense", "scattered"])
def test_a_close_pair_does_not_make_candidates_of_all(kind: Kind) -> None:
    regular = cr.Asperities.square(spacing=0.0025, tip_radius=0.002, within=0.04).positions
    regular = regular + np.random.default_rng(0).uniform(-0.3, 0.3, regular.shape) * 0.0025
    points = np.vstack((regular, regular[np.argmin(np.hypot(*regular.T))] + [1e-9, 0.0]))
    usual, more = (scenes.on_sphere(each, 0.002) for each in (regular, points))
    assert highest_approach(more, 1e-7, kind) <= 1.05 * highest_approach(usual, 1e-7, kind)


@pytest.mark.parametrize("kind", [None, "dense", "scattered"])
@pytest.mark.parametrize(
    ("within", "spacing", "raised"),
    [
        (0.02, 0.0008, {}),
        (0.02, 0.0008, dict.fromkeys(range(900, 2263), 1e-4)),  # the highest ones are far out
        (0.02, 0.0008, {0: 2e-6}),
        (0.003, 0.0016, {0: 1.2e-7}),  # one asperity within 1.5 contact radii, six beyond
    ],
)
def test_the_bound_in_a_wide_scene(
    within: float, spacing: float, raised: Any, kind: Kind | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is close. It comes from the asperities that could touch at a poor bound, if they are few,
    or near the axis where this is enough."""
    regular = cr.Asperities.hexagonal(spacing=spacing, tip_radius=0.01, within=within)
    if kind is not None:
        moved = np.random.default_rng(0).uniform(-0.3, 0.3, (len(regular), 2)) * spacing
        regular = cr.Asperities(regular.positions + moved, 0.01)
    heights = np.zeros(len(regular))
    heights[[*raised]] = [*raised.values()]
    scene = cr.Scene(1.0, regular.with_tips(0.01, heights), scenes.MATERIAL)
    for load, few in itertools.product((1e-10, 1e-9, 1e-8, 1e-7), (load_control.FEW, 0.0)):
        monkeypatch.setattr(load_control, "FEW", few)
        approach = cr.press(scene, load=load, influence=kind).certificate.approach
        bound = highest_approach(scene, load, kind)
        loose = 0.1 if kind else 0.2  # equal weights: at best 1/15 above a smooth body's approach
        assert approach * (1 - 1e-12) <= bound <= approach + loose * (approach + max(heights))


def test_the_displacements_that_bound_the_approach() -> None:
    """The sum of q / r, with weights q on some discs, is below the bound, and close to it."""
    random, closest = np.random.default_rng(0), []
    cells = np.indices((13, 13)).reshape(2, -1).T - 6
    shapes = (0.0, 1.0), (0.5, np.sqrt(0.75)), (0.3, 1.1), (0.5, 1.0), (0.0, 3.0)
    for (skew, height), moved in itertools.product(shapes, (0.0, 0.0, 0.2, 0.6)):
        points = cells @ np.array([[1.0, 0.0], [skew, height]])
        points += random.uniform(-moved, moved, points.shape)
        apart = np.linalg.norm(points[:, None] - points, axis=2)
        np.fill_diagonal(apart, np.inf)
        areas, nearest_first = (apart.min(axis=0) / 2.0) ** 2, apart[84].argsort()
        for m in (1, 2, 3, 6, 7, 18, 37, 90, 160):
            for chosen in (nearest_first[:m], random.permutation(169)[:m]):
                whole = areas[chosen].sum()
                most = (areas[chosen] / apart[:, chosen]).sum(axis=1).max() / whole
                bound = load_control.most_potential(whole, np.sqrt(areas.min()))
                closest.append(most / bound)
    assert 0.9 < max(closest) < 1.0
    assert load_control.most_potential(1e-30, 1.0) == pytest.approx(1.0, rel=1e-15)


@pytest.mark.parametrize(("moved", "spread"), [(0.0, 0.0), (0.0, 2.0), (0.15, 0.0), (0.15, 2.0)])
def test_the_bound_by_discs_is_that_of_exact_displacements_or_more(
    moved: float, spread: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With the same weights, and sums of q / r over all pairs. On a lattice it is hardly more."""
    monkeypatch.setattr(load_control, "COVERED", 0.0)
    monkeypatch.setattr(load_control, "DEEP", np.inf)
    random, modulus = np.random.default_rng(0), scenes.MATERIAL.contact_modulus
    regular = cr.Asperities.hexagonal(spacing=0.001, tip_radius=1.0, within=0.0155)
    points = regular.positions + random.uniform(-moved, moved, (len(regular), 2)) * 0.001
    points[1] = points[1] if moved == 0 else points[0] + [1e-6, 0.0]
    tips = 0.01 * 10.0 ** (spread * random.uniform(-1, 1, len(points)))
    own = regular.with_tips(tips) if moved == 0 else cr.Asperities(points, tips)
    scene = cr.Scene(1.0, own, scenes.MATERIAL)
    apart = np.linalg.norm(points[:, None] - points, axis=2)
    np.fill_diagonal(apart, np.inf)
    k = (9.0 / (16.0 * modulus**2 * scene.relative_radii)) ** (1.0 / 3.0)
    v = (apart.min(axis=0) / 2) ** 2 * np.minimum(1.0, (np.median(k) / k) ** 1.5)
    deepest, d = scene.offsets.argsort()[::-1], scene.offsets
    for load in (1e-9, 1e-8, 1e-7):
        exact = []
        for m in range(1, len(points), 3):
            q = np.where(np.isin(np.arange(len(points)), deepest[:m]), v, 0.0)
            q /= q.sum()
            local = load ** (2 / 3) * ((q * k) ** 3).sum() ** (1 / 3)
            exact.append(local + load / (np.pi * modulus) * (q / apart).sum(axis=1).max() - q @ d)
        bound, _ = load_control._bound_by_discs(scene, load)
        loose = 1.05 if moved == spread == 0 else 2.0
        assert min(exact) * (1 - 1e-12) <= bound <= min(exact) * loose
        with monkeypatch.context() as sampled:  # a sample finds the asperities that matter
            sampled.setattr(load_control, "SAMPLE", 40)
            again, _ = load_control._bound_by_discs(scene, load)
            assert spread > 0 or again == pytest.approx(bound, rel=1e-12)


def test_the_bound_by_discs_counts_the_rounding_of_its_sums() -> None:
    """Weights of sharp tips are half a unit in the last place of the sum that they are added to."""
    sharp, side = 2.0**-100, 400
    blunt = np.array([it for it in itertools.product(range(3), range(3)) if any(it)], dtype=float)
    many = -np.indices((side, side)).reshape(2, -1).T * 2.0**-25 * 1.0005
    points = np.vstack((blunt, many))
    tips = np.where(np.arange(len(points)) < 8, 1.0, sharp)
    heights = -(2.0**-94) * np.where(tips == 1.0, 1.0, 0.998)
    heights[-1] = 0.0
    scene = cr.Scene(1e60, cr.Asperities(points, tips, heights), cr.Material(1.0, 0.3))
    k = (9.0 / (16.0 * scene.relative_radii)) ** (1.0 / 3.0)
    loads = ((2.0**-94 / 0.44 + heights) / k) ** 1.5
    least = (k * loads ** (2.0 / 3.0) - heights).min()  # without A P
    assert load_control._bound_by_discs(scene, math.fsum(loads) * (1 + 1e-15))[0] >= least


def test_the_bound_counts_what_asperities_far_out_are_displaced() -> None:
    """A far asperity beside the contact may be displaced most by the weights, and touch alone."""
    load, heights = 1e-6, np.array([0.0, 0.0, -1.3e-4])
    reach = np.sqrt((1.5 * (0.75 * load) ** (1 / 3)) ** 2 + 2.0 * (heights.max() - heights.mean()))
    points = reach * np.array([[0.9999, 0.0], [-0.9999, 0.0], [1.0001, 0.0]])
    other = cr.press(scenes.on_sphere(points[1:], 0.1, heights[1:]), load=load)
    scene = scenes.on_sphere(points, 0.1, heights)
    away = np.linalg.norm(points[0] - points[1:], axis=1)
    pushed = (other.loads / (np.pi * scene.material.contact_modulus * away)).sum()
    assert pushed - scene.offsets[0] > other.approach  # so this is a solution of the whole scene
    assert highest_approach(scene, load) >= other.approach


@pytest.mark.parametrize(
    ("sphere_radius", "within", "vacant", "load"),
    [(np.inf, 0.03, 1e3, 8e-13), (np.inf, 0.1, 1e6, 1e-8), (1.0, 0.1, 0.0, 1e-25)],
)
def test_the_bound_at_a_load_that_is_tiny_for_the_scene(
    sphere_radius: float, within: float, vacant: float, load: float
) -> None:
    """A vacant site is marked by a great depth. The bound is found, and few can touch."""
    regular = cr.Asperities.hexagonal(spacing=0.0025, tip_radius=0.02, within=within)
    heights = np.where(np.arange(len(regular)) == 30, -vacant, 0.0)
    scene = cr.Scene(sphere_radius, regular.with_tips(0.02, heights), scenes.MATERIAL)
    contact = cr.press(scene, load=load)
    assert contact.certificate.scope == "global"
    assert contact.candidates == (1 if np.isfinite(sphere_radius) else len(scene) - 1)


@pytest.mark.parametrize("sphere_radius", [np.inf, 1e5])
def test_low_sites_beside_large_contacts_are_no_candidates(sphere_radius: float) -> None:
    """Contacts at every third site, with discs wider than the spacing, have one solution."""
    sites = np.indices((30, 30)).reshape(2, -1).T
    positions = (sites - 15) @ np.array([[1.0, 0.0], [0.5, np.sqrt(0.75)]])
    heights = np.where((sites % 3 == 0).all(axis=1), 0.0, -0.16)
    scene = cr.Scene(sphere_radius, cr.Asperities(positions, 30.0, heights), scenes.MATERIAL)
    contact = cr.press(scene, load=cr.press(scene, approach=0.13).load)
    assert (contact.certificate.scope, contact.candidates) == ("global", 100)


@settings(max_examples=8, deadline=None)
@given(scenes.random_cases(crowding=0.99), st.integers(0, 2**32 - 1), st.floats(-6, 3))
def test_newton_converges_from_any_start(sampled: scenes.Case, seed: int, size: float) -> None:
    """On every convex scene, to the same answer."""
    scene, approach, kind = sampled
    contact = cr.press(scene, approach=approach)
    if contact.certificate.scope != "global" or contact.load == 0:
        return
    rng = np.random.default_rng(seed)
    start = contact.load * 10**size * rng.random(len(scene)) ** rng.uniform(0, 9)
    start *= rng.random(len(scene)) < rng.random()
    for control in ({"approach": approach}, {"load": contact.load}):
        again = cr.press(scene, start=start, influence=kind, **control)
        assert_allclose(again.loads, contact.loads, rtol=1e-9, atol=1e-12 * contact.loads.max())


def test_newton_converges_where_distances_are_graded() -> None:
    """Along a geometric line: blocks average over whole parts; the preconditioner helps little."""
    random, n = np.random.default_rng(0), 2600
    x = np.exp(12.0 * np.arange(n) / n)
    gaps = np.diff(x)
    approach = 1e-3 * float(np.median(gaps))
    heights = -approach * 10 ** (7.0 * random.random(n) - 6.0)
    line = cr.Asperities(np.column_stack((x, 0 * x)), (0.45 * gaps[0]) ** 2 / approach, heights)
    contact = cr.press(cr.Scene(x[-1] ** 2 / approach, line, scenes.MATERIAL), approach=approach)
    assert (contact.influence, contact.certificate.scope) == ("scattered", "global")
    assert contact.iterations < 12


@pytest.mark.parametrize("size", [1e-2, 1e-3])
def test_newton_converges_where_a_cluster_is_far_smaller_than_the_scene(size: float) -> None:
    """The preconditioner, which averages over blocks, says nothing about such a cluster."""
    field = cr.Asperities.hexagonal(spacing=0.0025, tip_radius=0.02, within=0.045).positions
    points = np.vstack((field, size * field + [0.3, 0.1]))
    tips = np.repeat([0.02, 0.02 * size], len(field))
    scene = cr.Scene(np.inf, cr.Asperities(points, tips), scenes.MATERIAL)
    contact = cr.press(scene, approach=1e-6 * size)
    assert (contact.influence, contact.certificate.scope) == ("scattered", "global")
    assert contact.iterations < 20


#: Dense alone where the points are scattered; on a lattice, every operator.
CROWDED = [(scenes.scattered, "dense"), *((scenes.on_lattice, kind) for kind in scenes.OPERATORS)]


@pytest.mark.parametrize(("make", "kind"), CROWDED)
def test_every_newton_step_lowers_the_energy(make: Any, kind: Kind) -> None:
    """Also from bad starts on scenes far from convex, where full steps would not."""
    for seed in range(10):
        scene, approach = make(seed, 20, 4.0, 0.5)
        problem = NormalProblem.assemble(scene, approach=approach, influence=kind)
        rng = np.random.default_rng(seed)
        start = problem.bounds(problem.approach_bound) * rng.random(len(problem)) ** 3
        law = Pressing(problem, float(np.abs(problem.offsets).max()))
        state = law.evaluate(hertz.indentation(start, problem.coefficients))
        for _ in range(12):
            following = descend(law, state, law.direction(state, 0.0))
            assert following.energy <= state.energy + 1e-12 * abs(state.energy)
            state = following


@pytest.mark.parametrize("prescribed", [dict(approach=-1e-6), dict(load=1e-9)])
def test_nothing_where_the_smooth_sphere_would_touch(prescribed: dict[str, Any]) -> None:
    """Newton's method starts somewhere wherever there is an answer."""
    scene = scenes.on_sphere(0.01 * ring(6)[1:], heights=6e-5)
    assert cr.press(scene, **prescribed).certificate.all_proved


@pytest.mark.parametrize(("std", "cv"), [(0.0, 0.0), (1e-6, 0.0), (1e-6, 0.1), (2e-5, 0.5)])
@pytest.mark.parametrize("load", [1e-9, 2e-7])
def test_the_bound_is_above_the_approach(std: float, cv: float, load: float) -> None:
    """How far a scene has to reach under a load."""
    tip, height = largest_tip_radius(0.02, cv), CUT_DEVIATIONS * std
    highest = dict(sphere_radius=1.0, tip_radius=tip, height=height, geometry="summit")
    rough = dict(height_std=std, tip_radius_cv=cv, seed=5)
    scene_within = partial(scenes.hexagonal, 0.0025, 0.02, **rough)
    scene, bound = all_that_could_touch(scene_within, partial(reach, **highest), load)
    assert cr.press(scene, load=load).certificate.approach <= bound * (1 + 1e-12)


def test_bounds_cover_all_loads_within_an_uncertain_total() -> None:
    pair = scenes.on_sphere([[-1e-3, 0.0], [1e-3, 0.0]])  # alike: the loads only scale
    problem = NormalProblem.assemble(pair, load=1e-8)
    total: Any = problem.load
    state = refined_loads(problem, Newton().solve(problem).loads)
    box = tried(problem, state.loads.high, state.product)
    totals = Ball.around(total, 1e-6 * total), Ball.exact(total * (1 + 0.999e-6))
    problems = [problem.at_load(each) for each in totals]
    wide, higher = (proved(each, refined_loads(each, state.loads.high), box) for each in problems)
    assert wide.box is higher.box is box
    for name in ("loads", "indentation", "approach"):
        moved = np.abs((getattr(higher, name) - getattr(wide, name)).value)
        assert (moved <= getattr(wide, name).radius).all(), name


@pytest.mark.parametrize("radii", [(1.0, 1.0), (0.7, 3e5), (np.inf, np.inf)])
def test_coefficients_are_within_their_bounds_of_k(radii: tuple[float, float]) -> None:
    """k^3 = 9 (1 / R + 1 / rho) / (16 E*^2), with the mean curvature 1 / R of the base."""
    rng, modulus = np.random.default_rng(0), 1.0 / 3.0
    tips = 10.0 ** rng.uniform(-20.0, 20.0, 500)
    points = 1e-3 * np.indices((25, 20)).reshape(2, -1).T
    scene = cr.Scene(radii, cr.Asperities(points, tips), cr.Material(modulus, 0.3), None, "summit")
    problem = NormalProblem.assemble(scene, approach=1.0)
    found = problem.exact.coefficients
    with ctx.workprec(300):
        true = of_scene(scene)[2][problem.candidates] * arb(problem.units.local)
        off = (middle(found) - true).astype(float)
    assert (np.abs(off) <= found.radius).all()
    assert ((found.radius > 0) & (found.radius <= 1e-29 * found.mid.high)).all()


HEXAGON = cr.Asperities.hexagonal(spacing=0.25, tip_radius=1.0, within=0.5).positions


@pytest.mark.parametrize("exponent", [-59, -70, -140])
def test_contact_points_too_near_to_each_other(exponent: int) -> None:
    """Reached by "closest" from positions of a good size: no status, and no search without end."""
    points = HEXAGON * 10.0**exponent
    assert (Lattice.through(points) is None) == (exponent < -59)
    if exponent < -59:
        positions = HEXAGON * 1e-30
        asperities = cr.Asperities(positions, 10.0 ** min(-40 - exponent, 59))
        with pytest.raises(cr.InputError, match=r"at a distance of .* choose other units"):
            cr.Scene(1e-10, asperities, scenes.MATERIAL, geometry="closest")


@pytest.mark.sample(1)
@pytest.mark.parametrize("control", ["approach", "load"])
@pytest.mark.parametrize("geometry", ["summit", "closest"])
@pytest.mark.parametrize("modulus", [1e-60, 1.0, 1e60])
@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # of float64's range, which is the point
def test_extremes_are_answered_or_refused(modulus: float, geometry: Any, control: str) -> None:
    """Never ZeroDivisionError: of sums in the bound on the approach, above all."""
    sizes = (1e-60, 1e-20, 1e20, 1e60)
    for radius, tip, size, value in itertools.product(sizes, sizes, (1e-57, 1e57), sizes):
        try:
            asperities = cr.Asperities(HEXAGON * size, tip)
            scene = cr.Scene(radius, asperities, cr.Material(modulus, 0.3), 0.5, geometry)
            contact = cr.press(scene, **{control: value})
        except (cr.InputError, cr.SolverError):
            continue
        assert ((contact.status != "contact") | (contact.loads > 0)).all()
