"""The bristle program: its order of convergence, its convexity."""

from typing import Any

import numpy as np
import pytest
from scenes import MATERIAL, NAMED

import convexrough as cr
from convexrough.normal.problem import NormalProblem
from convexrough.solvers import BristleQP

CONTROLS = ("approach", "load")


def pressed(scene: cr.Scene, approach: float, control: str) -> tuple[cr.Contact, dict[str, Any]]:
    """The reference, and how to prescribe it."""
    contact = cr.press(scene, approach=approach)
    return contact, {control: getattr(contact, control)}


def errors(reference: cr.Contact, prescribed: dict[str, Any], solver: BristleQP) -> Any:
    """(n,) errors of the loads over the largest load."""
    loads = cr.press(reference.scene, solver=solver, **prescribed).loads
    return (loads - reference.loads) / reference.loads.max()


@pytest.mark.sample(2)
@pytest.mark.parametrize("control", CONTROLS)
@pytest.mark.parametrize("name", ["rough", "rough, closest"])
def test_second_order(name: str, control: str) -> None:
    reference, prescribed = pressed(*NAMED[name], control)
    counts = np.array([16, 32, 64, 128])
    found = [errors(reference, prescribed, BristleQP(int(m), newton_step=False)) for m in counts]
    assert all(np.abs(e).max() < 0.65 / m**2 for m, e in zip(counts, found, strict=True))
    mean_square = [np.sqrt(np.mean(e**2)) for e in found]
    order = -np.polyfit(np.log(counts), np.log(mean_square), 1)[0]
    assert order == pytest.approx(2.0, abs=0.15)


@pytest.mark.parametrize("control", CONTROLS)
def test_a_box_cut_to_the_convex_range(control: str) -> None:
    """The a priori bounds are not convex, the contact is: answered, and certified."""
    wide = cr.Asperities.hexagonal(spacing=0.0025, tip_radius=0.02, within=0.03)
    scene, approach = cr.Scene(1.0, wide, MATERIAL, geometry="summit"), 5e-4
    problem = NormalProblem.assemble(scene, approach=approach)
    assert problem.convexity_number(problem.bounds(problem.approach_bound)) > 1.5
    reference, prescribed = pressed(scene, approach, control)
    contact = cr.press(scene, solver=BristleQP(32), **prescribed)
    assert contact.certificate.holds
    assert np.abs(contact.loads - reference.loads).max() < 1e-6 * reference.loads.max()
    if control == "approach":
        assert contact.certificate.scope == reference.certificate.scope


# What stops it, in words.
