"""Thousands of asperities on a lattice: the same answers as through the matrix, in few products."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scenes import PAPER_APPROACH, hexagonal, prescribed

import convexrough as cr
from convexrough.influence import Kind
from convexrough.normal.problem import NormalProblem
from convexrough.solvers.newton import ALL_ITERATED


def scene(k: float, within: float = 0.01, **rough: Any) -> cr.Scene:
    """The paper's sphere on a lattice k times finer, of tips k times smaller."""
    return hexagonal(0.0025 / k, 0.02 / k, within, **rough)


def edited(
    whole: cr.Scene, *, kept: Any = slice(None), shift: Any = 0.0, raised: Any = 0.0
) -> cr.Scene:
    """Some of the asperities, moved sideways and up."""
    a = whole.asperities
    some = cr.Asperities(a.positions[kept] + shift, a.tip_radii[kept], (a.heights + raised)[kept])
    return replace(whole, asperities=some)


def sparse(whole: cr.Scene) -> cr.Scene:
    rng = np.random.default_rng(5)
    near = whole.asperities.distances < 3e-3  # where a lattice is looked for
    return edited(whole, kept=near | (rng.random(len(whole)) < 0.6))


def scattered(whole: cr.Scene) -> cr.Scene:
    shift = np.random.default_rng(6).uniform(-5e-5, 5e-5, (len(whole), 2))
    return edited(whole, shift=shift)


#: Scenes of 1000 to 3500 candidates, each in the convex range.
SCENES = {
    "heights": scene(6, height_std=1e-7, seed=1),
    "rough": scene(6, height_std=1e-6, tip_radius_cv=0.1, seed=2),
    "closest": replace(scene(6, height_std=1e-6, seed=3), geometry="closest"),
    "screened": scene(6, within=0.02, height_std=1e-7, seed=4),
    "sparse": sparse(scene(7, height_std=1e-7, seed=4)),
    "scattered": scattered(scene(6, height_std=1e-6, seed=2)),
}


@pytest.mark.sample(1)
@pytest.mark.parametrize("control", ["approach", "load"])
@pytest.mark.parametrize("kind", ["lattice", "scattered"])
@pytest.mark.parametrize("name", SCENES)
def test_as_through_the_matrix(name: str, kind: Kind, control: str) -> None:
    """Loads agree within what is proved of each, and to 1e-12; statuses are the same."""
    pressed = SCENES[name]
    if kind == "lattice" and pressed.lattice is None:
        with pytest.raises(cr.InputError, match="lattice"):
            cr.press(pressed, approach=PAPER_APPROACH, influence=kind)
        return
    given = prescribed(pressed, PAPER_APPROACH, control)
    dense, contact = (cr.press(pressed, **given, influence=each) for each in ("dense", kind))
    assert ALL_ITERATED < contact.candidates < 3500
    assert contact.influence == kind
    assert contact.certificate.all_proved
    assert contact.certificate.load_error <= 1e-8 * contact.loads.max()
    assert contact.iterations <= 12
    assert dense.certificate.all_proved
    apart = np.abs(contact.loads - dense.loads)
    assert apart.max() <= 1e-12 * dense.loads.max()
    assert (apart <= contact.certificate.load_errors + dense.certificate.load_errors).all()
    between = np.abs(contact.gaps - dense.gaps)
    assert (between <= contact.certificate.gap_errors + dense.certificate.gap_errors).all()
    assert (contact.status == dense.status).all()
    assert contact.approach == pytest.approx(PAPER_APPROACH, rel=1e-12)
    assert contact.crowding == pytest.approx(dense.crowding, rel=1e-9)
    assert contact.model_error == pytest.approx(dense.model_error, rel=0.03)
    problem = NormalProblem.assemble(pressed, approach=PAPER_APPROACH, influence="dense")
    loads, reached = contact.loads[problem.candidates], contact.approach / problem.units.length
    assert problem.residual(loads / problem.units.force, reached) <= 1e-12 * reached


@pytest.mark.sample(1)
@pytest.mark.parametrize("control", ["approach", "load"])
def test_those_left_out_at_first_are_found(control: str) -> None:
    """The contact lies beside the axis, and across from it there are peaks. In rings about the axis
    they are alike, so the start takes the surface to sink where it does not."""
    whole = scene(7)
    x, y = whole.asperities.positions.T
    peaks = (np.hypot(x + 0.006, y) < 0.003) & (np.arange(len(whole)) % 20 == 0)
    level = np.where(peaks, -3.45e-5, -((x - 0.006) ** 2 + y**2) / 2)
    pressed = edited(whole, raised=level + whole.drops)
    known = cr.press(pressed, approach=5e-5, influence="dense")
    assert known.certificate.all_proved
    assert (known.status[peaks] == "contact").any()
    given: Any = {control: getattr(known, control)}
    found = cr.press(pressed, **given, influence="lattice")
    assert found.candidates > ALL_ITERATED
    assert_allclose(found.loads, known.loads, rtol=0, atol=1e-12 * known.loads.max())


@pytest.mark.parametrize(
    ("pressed", "approach"),
    [
        (scene(12), 4.147157190635452e-05),
        (scene(12), 4.79933110367893e-05),
        (replace(hexagonal(0.0025 / 9, 0.004 / 9, 0.012), sphere_radius=np.inf), 2e-4),
    ],
)
def test_the_start_is_good(pressed: cr.Scene, approach: float) -> None:
    """Two approaches at which rings that begin on a smooth sphere fail, and a flat."""
    assert cr.press(pressed, approach=approach).iterations <= 5
