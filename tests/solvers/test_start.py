"""Where Newton's method starts: close to the answer, and somewhere wherever there is one."""

from typing import Any

import numpy as np
import pytest
from scenes import MATERIAL, paper

import convexrough as cr
from convexrough.normal.problem import NormalProblem
from convexrough.solvers import mean_field
from convexrough.solvers.start import start_indentation
from convexrough.sphere import hertz


@pytest.mark.parametrize("prescribed", [dict(approach=5e-5), dict(load=3.6e-7)])
def test_the_papers_scene_takes_three_steps(prescribed: dict[str, Any]) -> None:
    assert cr.press(paper(), **prescribed).iterations <= 3


def test_no_other_size_of_the_start_has_less_energy() -> None:
    problem = NormalProblem.assemble(paper(), approach=5e-5)
    prescribed = problem.ceiling + problem.offsets
    displacement = prescribed - start_indentation(problem)
    loads = np.linalg.solve(problem.influence.matrix, displacement)

    def energy(size: float) -> float:
        return problem.energy(size * loads, size * displacement)

    assert (hertz.load(start_indentation(problem), problem.coefficients) > 0).any()
    assert min(energy(0.999), energy(1.001)) > energy(1.0)


@pytest.mark.parametrize("prescribed", [dict(approach=-1e-6), dict(load=1e-9)])
def test_nothing_where_the_smooth_sphere_would_touch(prescribed: dict[str, Any]) -> None:
    ring = np.exp(2j * np.pi * np.arange(6) / 6)
    positions = 0.01 * np.column_stack((ring.real, ring.imag))
    tall = cr.Scene(1.0, cr.Asperities(positions, 0.02, 6e-5), MATERIAL, geometry="summit")
    assert cr.press(tall, **prescribed).certificate.holds


def test_the_mean_field_is_close_on_a_fine_lattice(monkeypatch: pytest.MonkeyPatch) -> None:
    """Also where only some asperities are looked at."""
    fine = cr.Asperities.hexagonal(spacing=0.0025 / 15, tip_radius=0.02 / 15, within=0.01)
    problem = NormalProblem.assemble(
        cr.Scene(1.0, fine, MATERIAL, geometry="summit"), approach=5e-5
    )
    for sample in (mean_field.SAMPLE, 2000):
        monkeypatch.setattr(mean_field, "SAMPLE", sample)
        loads = hertz.load(start_indentation(problem), problem.coefficients)
        displacement = problem.influence.apply(loads)
        level = hertz.indentation(loads, problem.coefficients) + displacement - problem.offsets
        off = np.abs(level - problem.ceiling)[loads > 0]
        assert off.mean() <= 1e-4 * problem.ceiling
