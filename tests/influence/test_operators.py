"""What every compliance operator promises, against sums over all pairs in 160 bits and more."""

import itertools
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from types import FrameType
from typing import Any

import multiprecision
import numpy as np
import pytest
import scenes
from flint import arb, ctx
from hypothesis import given, settings
from hypothesis import strategies as st
from multiprecision import assert_sums, exact, fractions, inverse_sums, middle, pulled, quotient

import convexrough as cr
from convexrough.arithmetic.balls import Ball
from convexrough.arithmetic.pairs import Pair, two_product
from convexrough.arrays import Array
from convexrough.bench import scenes as bench
from convexrough.convex.newton_step import correct
from convexrough.influence import couple, coupling, lattice, scattered
from convexrough.influence.coupling import Coupling, Influence, JointCoupling, inverse_distances
from convexrough.influence.dense import DenseInfluence
from convexrough.influence.pair_sums import Product
from convexrough.influence.scattered import ScatteredInfluence
from convexrough.influence.softened import Softened
from convexrough.influence.splitting import Splitting
from convexrough.normal.problem import NormalProblem
from convexrough.normal.refine import trial
from convexrough.roundoff import ROUNDOFF
from convexrough.scene.lattice import Lattice
from convexrough.solvers import Newton

SCALE = 0.37

#: Layouts of which a mesh gives sums much better than products.
EVEN = ("disc", "jittered")


def operator(kind: str, layout: str, rng: np.random.Generator, count: int = 0) -> Any:
    if kind == "lattice":
        count = count or int(rng.choice([40, 500, 1000]))
        points = scenes.lattice_patch(scenes.turned(scenes.LATTICES[layout], 0.3), count)
        return scenes.lattice_operator(points + rng.choice([0.0, 300.0, 1e4]), SCALE)
    points = scenes.LAYOUTS[layout](rng)
    if kind == "dense":  # more than 64 points are summed in blocks
        return DenseInfluence.assemble(rng.permutation(points)[: count or 500], SCALE)
    return ScatteredInfluence(points[:count] if count else points, SCALE)


CASES = [
    *(("dense", layout) for layout in ("disc", "coincident")),
    *(("lattice", basis) for basis in scenes.LATTICES),
    *(("scattered", layout) for layout in scenes.LAYOUTS),
]
each_operator = pytest.mark.parametrize(("kind", "layout"), CASES)


@pytest.mark.sample(4)
@each_operator
@pytest.mark.parametrize("seed", range(5))
def test_products_and_sums(kind: str, layout: str, seed: int) -> None:
    """Within their bounds, which are not absurd."""
    rng = np.random.default_rng(seed)
    A: Influence = operator(kind, layout, rng)
    rows, loads = rng.integers(0, len(A), 30), scenes.loadings(len(A), rng)
    shift = np.abs(A.points.mean(axis=0)).max() if kind == "lattice" else 0.0
    good = {"dense": 1e-14, "lattice": max(1e-14, 3e-16 * shift), "scattered": 1e-13}[kind]
    sums = (each.T for each in inverse_sums(A.points[rows], A.points, loads.T, SCALE))
    for load, true, rest in zip(loads, *sums, strict=True):
        product, sizes, rounding = A.apply(load), A.apply(np.abs(load)), A.rounding(load)
        error, top = np.abs(product[rows] - true - rest), float(sizes.max())
        assert error.max() <= good * top
        assert (error <= rounding.of(sizes)[rows] * (1 + 1e-12)).all()
        assert (kind != "dense") or (rounding.each == 0 and rounding.relative <= 1e-14)
        assert rounding.each <= {"lattice": 1e-9 * max(1.0, 1e-3 * shift)}.get(kind, 1e-10) * top
        assert rounding.relative <= 1e-12
        if not A.stored:
            single = A.apply(load.astype(np.float32))
            assert single.dtype == np.float32
            assert np.abs(single - product).max() <= (1e-6 if kind == "lattice" else 1e-4) * top

        found = A.sums(Pair.exact(load))
        high, low = two_product(SCALE, found.mid.high[rows])
        off = np.abs((high - true) + (low - rest + SCALE * found.mid.low[rows]))
        radius = SCALE * found.radius
        assert (off <= radius[rows] * (1 + 1e-12) + 1e-30 * top).all()
        if kind == "lattice":
            assert radius.max() <= 1e-9 * rounding.each + 1e-300
        elif kind == "dense":
            assert radius.max() <= 1e-24 * top or layout == "coincident"
        elif layout in EVEN:
            assert off.max() <= 1e-16 * top
            assert radius.max() <= 0.1 * rounding.of(sizes).max()


@pytest.mark.sample(5)
@each_operator
@pytest.mark.parametrize("count", [0, 1, 2, 3, 40, 200])
@pytest.mark.parametrize("seed", range(3))
def test_parts_and_other_points(
    kind: str, layout: str, seed: int, count: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Among some, in any order, and onto others: on the lattice, off it, at one place, none."""
    rng = np.random.default_rng(seed)
    A = operator(kind, layout, rng, 400)
    which = rng.permutation(400)[:count]
    part, loads = A.restricted(which), rng.random(count) ** 9
    assert (part.points == A.points[which]).all()
    assert len(part) == len(part.separations()) == count
    assert part.crowding(np.ones(count)) >= 0
    mixed = np.concatenate((A.points[:60], part.points[:1]))
    targets = [mixed, mixed + 1e-3, np.concatenate((mixed, [[0.3, 0.4]])), mixed[:0]]
    couplings: list[tuple[Coupling, Array]] = [(part, part.points)]
    couplings += [(part.onto(points), points) for points in targets]
    if kind == "dense":  # in blocks
        monkeypatch.setattr(coupling, "KEPT", 0)
        monkeypatch.setattr(coupling, "ENTRIES", 16)
        couplings += [(part.onto(points), points) for points in targets]
    if kind == "scattered":
        monkeypatch.setattr(scattered, "FEW_ONTO", 0)
        couplings += [(part.onto(points), points) for points in targets if len(points) and count]
        together = ScatteredInfluence(np.concatenate((mixed, part.points)), SCALE)
        couplings.append((JointCoupling(together, len(mixed)), mixed))
    for onto, points in couplings:
        true, rest = inverse_sums(points, part.points, loads, SCALE)
        product = onto.apply(loads)
        error = np.abs(product - true - rest)
        assert (error <= onto.rounding(loads).of(product) * (1 + 1e-12)).all()
        assert error.max(initial=0.0) <= 1e-9 * true.max(initial=0.0)
        for power in (1, 2, 3):
            exactly, _ = inverse_sums(points, part.points, loads, power=power)
            assert (onto.falloff(loads, power) >= exactly).all()


@pytest.mark.parametrize("balanced", [False, True])
@pytest.mark.parametrize("tolerance", [1e-3, 1e-10])  # single precision has fewer digits than 1e-10
def test_steps_are_as_accurate_as_asked_for(balanced: bool, tolerance: float) -> None:
    scene, random = bench.scene("lattice", 9.0), np.random.default_rng(1)
    A = couple(scene, np.arange(len(scene)), SCALE)
    c = random.uniform(0.02, 0.2, len(scene)) * scene.asperities.lattice.spacing / SCALE
    c *= random.random(len(scene)) < 0.9  # the others are open
    defect = random.normal(size=len(scene))
    step = correct(A, A.shells, np.sqrt(c), defect, balanced=balanced, tolerance=tolerance)
    left = step + A.apply(c * step) + defect
    if balanced:
        assert abs(c @ step) <= 0.1 * tolerance * np.abs(c * step).sum()
        left -= np.median(left[c == 0.0])  # beta: nothing else is left where asperities are open
    assert np.linalg.norm(left) <= 1.1 * tolerance * np.linalg.norm(defect)


def at_line(k: int, call: Callable[[], Any], other: Callable[[], Any]) -> tuple[Any, bool]:
    """What `call` returns if another thread calls `other` before its kth line in the module of
    lattices, and whether there are so many lines."""
    lines, before = itertools.count(), sys.gettrace()

    def trace(frame: FrameType, event: str, _: Any) -> Any:
        if frame.f_code.co_filename != lattice.__file__:
            return None
        if next(lines) == k:
            thread.submit(other).result()
        return trace

    with ThreadPoolExecutor(1) as thread:
        sys.settrace(trace)
        try:
            return call(), next(lines) > k
        finally:
            sys.settrace(before)


def interrupted(points: Array, ask: Any, own: Any, other: Any, first: Any) -> Iterator[Any]:
    """What `ask` returns for `own` if another thread asks for `other` at any moment."""
    for k in itertools.count():
        A = scenes.lattice_operator(points, SCALE)
        ask(A, first)
        found, reached = at_line(k, partial(ask, A, own), partial(ask, A, other))
        yield found
        if not reached:
            return


def test_threads_that_restrict_one_operator_at_once_get_their_own() -> None:
    points, own, other = scenes.lattice_patch(np.eye(2), 60), np.arange(40), np.arange(20, 60)
    for part in interrupted(points, lattice.LatticeInfluence.restricted, own, other, first=other):
        assert (part.points == points[own]).all()


def test_threads_whose_loads_reach_unequally_far_get_their_own_sums() -> None:
    points = scenes.lattice_patch(scenes.turned(scenes.LATTICES["square"], 0.3), 60)
    near, everywhere = Pair.exact(np.eye(60)[0]), Pair.exact(np.ones(60))
    true = scenes.lattice_operator(points, SCALE).sums(near)
    for found in interrupted(points, lattice.LatticeInfluence.sums, near, everywhere, first=near):
        assert (np.abs((found - true).value) <= found.radius + true.radius).all()


def off_and_errors(A: Influence, load: Array, rows: Any) -> tuple[Array, Array]:
    """How far slopes in these rows are from the true ones, and the bounds of all, which hold."""
    slopes = A.slopes(load)
    true = np.array([pulled(A.points, load, i, A.scale) for i in rows])
    off = np.abs((exact(slopes.value[rows]) - true).astype(float))
    assert (off <= slopes.error[rows]).all()
    return off, slopes.error


@pytest.mark.sample(4)
@each_operator
@pytest.mark.parametrize("seed", range(8))
def test_slopes(kind: str, layout: str, seed: int) -> None:
    """Within their bounds, which are not absurd; on a mesh they have none."""
    rng = np.random.default_rng(seed)
    A = operator(kind, layout, rng)
    rows = rng.integers(0, len(A), 10)
    shift = np.abs(A.points.mean(axis=0)).max() if kind == "lattice" else 1.0
    for load in scenes.loadings(len(A), rng):
        off, errors = off_and_errors(A, load, rows)
        top = (SCALE * A.falloff(np.abs(load), 2)).max()
        assert off.max() <= 1e-10 * top or layout not in (*EVEN, *scenes.LATTICES)
        limit = {"lattice": 1e-11 * max(1.0, 1e-3 * shift), "dense": 1e-12}.get(kind, np.inf)
        assert errors.max() <= limit * top or layout == "coincident"


@pytest.mark.parametrize(("family", "most"), [("hexagonal", 2e-14), ("square", 1e-15)])
def test_slopes_on_lattices_that_are_made(family: str, most: float) -> None:
    """Points are on their sites, those of the hexagonal lattice up to rounding."""
    rng = np.random.default_rng(0)
    array = getattr(cr.Asperities, family)(spacing=1.0, tip_radius=1.0, within=20.0)
    scene = cr.Scene(1e3, array, cr.Material(1.0, 0.3), geometry="summit")
    A = NormalProblem.assemble(scene, approach=1.0, influence="lattice").influence
    for load in scenes.loadings(len(A), rng):
        _, errors = off_and_errors(A, load, rng.integers(0, len(A), 3))
        assert errors.max() <= most * (A.scale * A.falloff(np.abs(load), 2)).max()


@pytest.mark.parametrize("family", ["hexagonal", "square"])
@pytest.mark.parametrize("geometry", ["summit", "closest"])
def test_many_points_of_a_lattice_are_exactly_on_their_sites(family: str, geometry: Any) -> None:
    spacing, rng = 0.1 / 7.0, np.random.default_rng(0)
    make = partial(getattr(cr.Asperities, family), spacing=spacing, tip_radius=1.0)
    array, fewer = make(within=45.5 * spacing), make(within=30.0 * spacing)
    assert array.layout.exact
    assert not fewer.layout.exact
    assert np.abs(array.positions[: len(fewer)] - fewer.positions).max() < 1e-12 * spacing
    layout, points = array.layout, fractions(array.positions)
    assert (layout.sites.astype(object) @ fractions(layout.lattice.basis) == points).all()
    scene = cr.Scene(1e3, array, cr.Material(1.0, 0.3), geometry=geometry)
    A = NormalProblem.assemble(scene, approach=1.0, influence="lattice").influence
    loads, (along, across) = Pair.exact(rng.random(len(A))), A.lattice.shrink
    found = A.sums(loads)
    with ctx.workprec(400):
        places = [[quotient(along * x), quotient(across * y)] for x, y in points[A.members]]
    assert_sums(found, np.array(places), loads, rng.integers(0, len(A), 2))
    assert (found.radius <= 1e-21 * found.mid.high).all()


@pytest.mark.parametrize("name", scenes.LATTICES)
def test_what_is_nearly_a_lattice_is_none(name: str) -> None:
    points = scenes.lattice_patch(np.array(scenes.LATTICES[name]), 500)
    assert Lattice.through(points) is not None
    noise = 1e-9 * np.random.default_rng(2).standard_normal(points.shape)
    for moved in (slice(None), 0, 100, 499):
        jittered = points.copy()
        jittered[moved] += noise[moved]
        assert Lattice.through(jittered) is None
    assert Lattice.through(np.concatenate((points, points[77:78]))) is None


def test_far_from_the_origin_rounded_points_are_no_lattice() -> None:
    """Products that leave out how far points are from their sites are not accurate enough."""
    square = cr.Asperities.square(spacing=1.0, tip_radius=1.0, within=14).positions
    points = square @ np.array([[0.8, 0.6], [-0.6, 0.8]]) + 3e6 * np.array([0.6, 0.8])
    tips = 10 ** np.random.default_rng(0).uniform(-1.5, 1.5, len(points))
    scene = cr.Scene(np.inf, cr.Asperities(points, tips), scenes.MATERIAL, geometry="summit")
    contact = cr.press(scene, approach=0.002)
    assert (contact.influence, contact.certificate.scope) == ("dense", "global")


@pytest.mark.parametrize("seed", range(60))
def test_shells_do_not_overlap(seed: int) -> None:
    """The premise of the shell lemma: s_i + s_j <= r_ij for all pairs, touching or not."""
    rng = np.random.default_rng(seed)
    basis = scenes.turned([*scenes.LATTICES.values()][seed % 4], 0.2)
    points = rng.permutation(scenes.lattice_patch(basis, 300))[:120] + rng.choice([0.0, 1e4])
    touching = rng.random(120) < rng.random() ** 3
    radii = rng.lognormal(0, rng.choice([0.0, 0.0, 3.0]), 120) * touching
    inverse, share = inverse_distances(points, points), rng.choice([0.0, rng.random(), 1.0])
    dense, mesh = (DenseInfluence.assemble(points, SCALE), ScatteredInfluence(points, SCALE))
    for A in (scenes.lattice_operator(points, SCALE), mesh, dense):
        with np.errstate(divide="ignore"):
            fitted, halves = SCALE / A.fitted_shells(radii, share), SCALE / A.shells
        for s in (fitted, halves):
            assert ((s[:, None] + s) * inverse).max() <= 1 + 4 * ROUNDOFF, A.name


@pytest.mark.parametrize("basis", ["hexagonal", "square"])
def test_the_most_crowded_pair(basis: str) -> None:
    """Also if it is not one of nearest neighbours, at the ends of rows, and if none touches."""
    rng = np.random.default_rng(1)
    points = np.indices((6, 7)).reshape(2, -1).T @ np.array(scenes.LATTICES[basis])
    A, mesh = scenes.lattice_operator(points, SCALE), ScatteredInfluence(points, SCALE)
    dense = DenseInfluence.assemble(points, SCALE)
    for coverage in np.linspace(0.0, 0.2, 150):
        radii = rng.choice([1.0, 0.2], 42) * (rng.random(42) < coverage)
        expected = pytest.approx(dense.crowding(radii), rel=1e-12)
        assert A.crowding(radii) == expected
        assert mesh.crowding(radii) == expected


def assert_gaps_known(problem: NormalProblem, loads: Array, limit: float) -> None:
    """Gaps of any loads are within their bounds, which are at most `limit`, by ball arithmetic."""
    scene, units, pair = problem.scene, problem.units, Pair.exact(loads)
    found = trial(problem, pair, Ball.exact(0.0), problem.product(pair))
    with ctx.workprec(200):
        known = np.full(len(scene), arb(0))
        known[problem.candidates] = exact(loads) * arb(units.force)
        rows = np.arange(0, len(problem), max(1, len(problem) // 12))
        gaps = multiprecision.gaps(scene, known, arb(0), problem.candidates[rows])
        off = gaps / arb(units.length) - middle(found.approach) - middle(found.gap[rows])
        assert (np.abs(off) <= exact(found.gap.radius[rows])).all()
    assert found.gap.radius.max() < limit


@pytest.mark.parametrize(
    ("geometry", "R"), [("summit", 1.0), ("closest", 1.0), ("closest", (0.3, np.inf))]
)
@pytest.mark.parametrize("shift", [0.0, 0.3e-3, None])
def test_gaps_on_a_lattice(geometry: Any, R: Any, shift: float | None) -> None:
    if shift is None:  # exactly on their sites
        lattice, shift = cr.Asperities.square(spacing=2.0**-9, tip_radius=0.02, within=0.01), 0.0
    else:
        lattice = scenes.paper().asperities
    heights = 1e-6 * np.random.default_rng(4).standard_normal(len(lattice))
    asperities = cr.Asperities(lattice.positions + shift, 0.02, heights)
    scene = cr.Scene(R, asperities, cr.Material(0.7, 0.3), geometry=geometry)
    contact = cr.press(scene, approach=bench.APPROACH)
    for control in ({"approach": bench.APPROACH}, {"load": contact.load}):
        problem = NormalProblem.assemble(scene, influence="lattice", **control)
        loads = contact.loads[problem.candidates] / problem.units.force
        assert_gaps_known(problem, loads, limit=1e-19)


@pytest.mark.sample(1)
@pytest.mark.parametrize("geometry", ["summit", "closest"])
def test_gaps_on_a_mesh_and_what_they_prove(geometry: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Loads are then proved to eleven digits."""
    monkeypatch.setattr(scattered, "FEW_ONTO", 0)
    scene = replace(bench.scene("scattered", 8.0), geometry=geometry)
    problem = NormalProblem.assemble(scene, approach=bench.APPROACH)
    assert isinstance(problem.onto_screened, JointCoupling)
    loads = Newton().solve(problem).loads
    assert_gaps_known(problem, loads, limit=2e-14 * problem.approach)
    given = problem.to_scene(loads) * problem.units.force
    certificate = cr.certify(scene, given, approach=bench.APPROACH)
    assert certificate.scope == "local"
    assert certificate.load_error < 1e-11 * given.max()


def test_a_lattice_shrunk_until_its_points_are_off_the_sites_is_refused() -> None:
    """Distances of its points are not those of the sites, so no bound would hold."""
    asperities = cr.Asperities.square(spacing=1.0, tip_radius=1.0, within=6.0)
    scene = cr.Scene((np.inf, 5e-14), asperities, cr.Material(1.0, 0.3), geometry="closest")
    assert scene.lattice is None
    with pytest.raises(cr.InputError, match="influence: found lattice"):
        cr.press(scene, approach=1e-6, influence="lattice")


@settings(max_examples=40, deadline=None)
@given(
    st.integers(0, 2**32 - 1),
    st.sampled_from([1, 2, 3, 61, 128, 129, 257, 300, 400]),
    st.sampled_from([1e-150, 1e-9, 1.0, 1e150]),
    st.sampled_from([1e-150, 1.0, 1e7, 1e150]),
    st.sampled_from(["disc", "pairs", "grid"]),
    st.sampled_from(["plain", "uneven", "signs", "zeros"]),
)
def test_sums_are_known(
    seed: int, count: int, length: float, force: float, layout: str, kind: str
) -> None:
    """At all scales; with points in pairs, in ties, and with loads of all sizes and signs."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(-1, 1, (count, 2))
    if layout == "grid":
        points = np.stack(np.divmod(np.arange(count), int(np.ceil(np.sqrt(count)))), axis=1) * 1.0
    elif layout == "pairs":
        points[count // 2 :] = points[: count - count // 2] + 1e-6 * points[count // 2 :]
    high = rng.random(count) * {"uneven": 10.0 ** rng.uniform(-40, 0, count)}.get(kind, 1.0)
    if kind in ("signs", "zeros"):
        high *= rng.choice([-1, 1] if kind == "signs" else [0, 0, 1], count)
    points, high = points * length, high * force
    loads = Pair(high, high * 2.0**-54 * rng.uniform(-1, 1, count))
    operator = DenseInfluence.assemble(points, SCALE)
    found = operator.sums(loads)
    assert_sums(found, exact(points), loads, {0, *rng.integers(0, count, 5).tolist()})
    most = float(operator.apply(np.abs(high)).max()) / SCALE
    if layout == "grid" and 1e-150 < most < 1e150:
        assert found.radius.max() <= (1e-25 if kind == "uneven" else 1e-26) * most


def test_sums_where_points_are_pairs() -> None:
    """Of the closest-point geometry as many digits as of summits, and of the true points."""
    scene = scenes.rough("closest")
    loads = Pair.exact(np.random.default_rng(4).random(len(scene)))
    found = couple(scene, np.arange(len(scene)), SCALE).sums(loads)
    with ctx.workprec(400):
        points, _, _ = multiprecision.of_scene(scene)
    assert_sums(found, points, loads, range(0, len(scene), 7))
    assert (found.radius < 1e-26 * found.value).all()


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(2, 40), st.floats(0.3, 4))
def test_shell_lemma(seed: int, count: int, shape: float) -> None:
    """A + diag(1 / (pi E* s_i)) is positive semidefinite for any layout."""
    rng = np.random.default_rng(seed)
    points = rng.standard_normal((count, 2)) * np.abs(rng.standard_normal((count, 1))) ** shape
    matrix = inverse_distances(points, points)
    shifted = matrix + np.diag(DenseInfluence.assemble(points, 1.0).shells)
    eigenvalues = np.linalg.eigvalsh(shifted)
    assert eigenvalues[0] >= -1e-13 * eigenvalues[-1]
    assert np.linalg.eigvalsh(matrix)[0] < 0  # so the shift is needed


def test_upper_bounds_on_sums() -> None:
    """Also where what is computed is too low, as on a mesh that is coarse enough."""
    rng = np.random.default_rng(13)
    points = rng.uniform(0, 1.2, (300, 2))
    splitting = Splitting(Softened(3, 16, 1.0), 1.0 / 20, 8)
    product = Product.assemble(points, splitting, np.float64)
    inverse = inverse_distances(points, points) ** 3
    too_low = 0
    for i, strengths in enumerate(np.eye(300)[:20]):
        assert (product.above(strengths) >= inverse[i]).all()
        relative = product.rounding(strengths).relative
        low = product.apply(strengths) < (1 - relative) * inverse[i]
        too_low += int(low[inverse[i] > 0].sum())
    assert too_low > 100


def test_point_error_is_counted() -> None:
    rng = np.random.default_rng(8)
    points = scenes.jittered(rng)
    moved = points + rng.choice([-1e-13, 1e-13], points.shape)
    operator = ScatteredInfluence(points, SCALE, 1e-13)
    loads = rng.random(len(points))
    computed = operator.apply(loads)
    true, rest = inverse_sums(moved[:60], moved, loads, SCALE)
    assert (np.abs(computed[:60] - true - rest) <= operator.rounding(loads).of(computed)[:60]).all()
    exactly = ScatteredInfluence(points, SCALE).rounding(loads)
    assert (operator.rounding(loads).of(computed) >= 10 * exactly.of(computed)).all()
    far = points + rng.choice([-2e-6, 2e-6], points.shape)
    rough = ScatteredInfluence(points, SCALE, 2e-6)
    for power in (1, 2, 3):
        above = rough.falloff(loads, power)[:60]
        assert (above >= inverse_sums(far[:60], far, loads, power=power)[0]).all()
    assert (operator.separations() < ScatteredInfluence(points, SCALE).separations()).all()
