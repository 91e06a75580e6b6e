"""Numbers whose products float64 cannot hold: refused, and never a wrong status."""

import itertools
from typing import Any

import pytest
from scenes import MATERIAL

import convexrough as cr
from convexrough.scene.lattice import Lattice

HEXAGON = cr.Asperities.hexagonal(spacing=0.25, tip_radius=1.0, within=0.5).positions


@pytest.mark.parametrize("exponent", [-59, -70, -140])
def test_contact_points_too_near_to_each_other(exponent: int) -> None:
    """Reached by "closest" from positions of a good size: no status, and no search without end."""
    points = HEXAGON * 10.0**exponent
    lattice = Lattice.through(points)
    assert (lattice is None) == (exponent < -59)
    if exponent < -59:
        positions = HEXAGON * 1e-30
        asperities = cr.Asperities(positions, 10.0 ** min(-40 - exponent, 59))
        with pytest.raises(cr.InputError, match=r"at a distance of .* choose other units"):
            cr.Scene(1e-10, asperities, MATERIAL, geometry="closest")


@pytest.mark.sample(1)
@pytest.mark.parametrize("control", ["approach", "load"])
@pytest.mark.parametrize("geometry", ["summit", "closest"])
@pytest.mark.parametrize("modulus", [1e-60, 1.0, 1e60])
@pytest.mark.filterwarnings("ignore::RuntimeWarning")  # of float64's range, which is the point
def test_extremes_are_answered_or_refused(modulus: float, geometry: Any, control: str) -> None:
    """Never ZeroDivisionError: of sums in the bound on the approach, above all."""
    sizes = (1e-60, 1e-20, 1e20, 1e60)
    for radius, tip, size, given in itertools.product(sizes, sizes, (1e-57, 1e57), sizes):
        try:
            asperities = cr.Asperities(HEXAGON * size, tip)
            scene = cr.Scene(radius, asperities, cr.Material(modulus, 0.3), 0.5, geometry)
            contact = cr.press(scene, **{control: given})
        except (cr.InputError, cr.SolverError):
            continue
        assert ((contact.status != "contact") | (contact.loads > 0)).all()
