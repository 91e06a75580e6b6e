"""A solution to compare solvers with: certified loads, right to the last digit of float64."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from convexrough.arrays import Array
from convexrough.contact import press
from convexrough.errors import SolverError
from convexrough.scene.scene import Scene

#: The largest proved error over the largest load at which loads are a reference: two units in the
#: last place of that.
ACCURATE = 2.0**-52


class Reference(NamedTuple):
    """loads : (n,) [force];  bound : proved on the error of each, over the largest"""

    loads: Array
    bound: float

    def error(self, loads: Array) -> float:
        """max |P - P_ref| / max P_ref, of loads (n,) [force]."""
        return float(np.abs(loads - self.loads).max() / self.loads.max())


def reference(scene: Scene, approach: float) -> Reference:
    """The loads at an approach. Raises SolverError where they are not proved to be so accurate."""
    contact = press(scene, approach=approach)
    bound = float(contact.certificate.load_errors.max() / contact.loads.max())
    if not bound <= ACCURATE:
        advice = "another approach, or asperities further apart"
        raise SolverError(f"loads proved to {bound:.2g} only", solver="reference", advice=advice)
    return Reference(contact.loads, bound)
