"""Properties of solutions that a local certificate does not exclude.

docs/theory/crowded.md, "Other solutions", derives them; (1) is an equation of that page.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from convexrough.arrays import Array
from convexrough.normal.problem import NormalProblem
from convexrough.roundoff import SAFETY

#: If contact radii are at most this fraction of the distance to the nearest neighbour, in every
#: other solution a disc covers a neighbour's summit. In units of this distance it is the radius a
#: for which (1), with the radius b = 1 in the other solution, gives m = pi / 4; rounded down.
ROOMY = 0.52


class OtherSolutions(NamedTuple):
    """Properties of all solutions other than the one found."""

    possible: bool  # False if it is proved that there are none
    crowding: float  # lower bound on their crowding (see `Certificate`); infinite if there are none
    cover: bool  # in each of them a disc covers the nearest neighbour's summit

    @classmethod
    def of(cls, problem: NormalProblem, near: Array, approach_bound: float) -> OtherSolutions:
        """The properties of solutions other than the one found.

        near           : (n,) upper bounds on the loads of the solution found
        approach_bound : upper bound on the approach of every solution
        """

        def radii(loads: Array) -> Array:
            return problem.radii(problem.compliance(loads)) * (1 + SAFETY)

        A = problem.influence
        perturbed = 1.0 + SAFETY + 2.0 * A.entry_error
        a = radii(near)
        t = 2.0 / np.pi * _mean(a, radii(problem.bounds(approach_bound)))
        if A.crowding(t) * perturbed <= 1 or A.semidefinite_with(float(t.max(initial=0.0))):
            return NO_OTHERS
        crowding = 0.75 * np.pi * (1.0 - SAFETY) - A.crowding(a) * perturbed
        cover = bool((a <= ROOMY * A.separations()).all())
        return cls(True, max(crowding, 0.0), cover)


NO_OTHERS, UNKNOWN = OtherSolutions(False, np.inf, True), OtherSolutions(True, 0.0, False)


def _mean(a: Array, b: Array) -> Array:
    """(n,) m of (1) for contact radii a and b in two solutions; it increases with both."""
    total = a + b
    product = np.divide(a * b, total, out=np.zeros_like(total), where=total > 0)
    return np.asarray(2.0 / 3.0 * (total - product) * (1 + SAFETY))
