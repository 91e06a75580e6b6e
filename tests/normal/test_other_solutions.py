"""On a lattice: where other solutions are excluded by its symbol."""

import numpy as np
from scenes import MATERIAL

import convexrough as cr
from convexrough.bench.scenes import scene as bench
from convexrough.normal.other_solutions import OtherSolutions
from convexrough.normal.problem import NormalProblem
from convexrough.solvers import Newton


def test_lattices_exclude_more_other_solutions() -> None:
    """Where shells of the secants meet, the lattice may still say that there is one solution."""
    rng, by_lattice = np.random.default_rng(3), 0
    for size in np.linspace(3.0, 8.0, 11):
        array = cr.Asperities.hexagonal(spacing=0.0025, tip_radius=0.02 * size, within=0.0102)
        problem = NormalProblem.assemble(
            cr.Scene(1.0, array, MATERIAL, geometry="summit"), approach=1e-4, influence="lattice"
        )
        loads, most = Newton().solve(problem).loads, problem.bounds(problem.approach_bound)
        others, A = OtherSolutions.of(problem, loads, problem.approach_bound), problem.influence
        secant = problem.coefficients * (np.cbrt(most) ** 2 - np.cbrt(loads) ** 2) / (most - loads)
        if A.crowding(A.scale / secant) <= 1:
            assert not others.possible
            continue
        if others.possible:
            continue
        by_lattice += 1
        for Q in (most, *(most * rng.random((20, len(most))))):
            secant = problem.coefficients * (np.cbrt(Q) ** 2 - np.cbrt(loads) ** 2) / (Q - loads)
            assert np.linalg.eigvalsh(np.diag(secant) + A.matrix)[0] > 0
    assert 2 <= by_lattice < 11


def test_eight_thousand_on_a_lattice_have_one_solution() -> None:
    """Shells that do not overlap show it of a third as many; three times as many are too many."""
    smaller = cr.press(bench("lattice", 12.0), approach=5e-5)
    assert smaller.certificate.scope == "global"
    assert smaller.certificate.meaning == "the only solution"
    larger = cr.press(bench("lattice", 20.0), approach=5e-5)
    assert larger.certificate.scope == "local"
