"""Certificates under attack at the ends of arithmetic; judged in whole numbers and in 60 digits."""

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from attacks import excess
from scenes import PAPER_APPROACH, STEEL, on_sphere, paper, reference
from status_audit import assert_honest, compare

import convexrough as cr


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


@pytest.mark.parametrize("load", [1e-310, 5e-324])
def test_bounds_of_the_smallest_loads_on_a_lattice(load: float) -> None:
    scene, given = paper(), np.full(61, load)
    judged = cr.certify(scene, given, approach=PAPER_APPROACH, influence="lattice")
    exact = reference(scene, approach=PAPER_APPROACH)
    assert_honest(judged, given, exact)
    assert judged.duality_gap >= excess(scene, given, exact)


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
