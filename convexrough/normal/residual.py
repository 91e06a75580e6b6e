"""How well loads fit the contact law: the residual e of judged loads, with its rounding.

docs/theory/certificate.md, "A bound on the loads" and "Rounding".
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array
from convexrough.errors import InputError
from convexrough.normal.problem import NormalProblem
from convexrough.roundoff import ROUNDOFF
from convexrough.sphere import hertz

#: Roundoffs lost in k P^(2/3) and in adding it, A P and D up: "Rounding".
SUM_ROUNDOFFS = 16


class Fit(NamedTuple):
    """How well loads fit the contact law, with the rounding error of saying so."""

    displacement: Array  # A P
    indentation: Array  # D - A P
    gap: Array  # k P^(2/3) + A P - D
    local: Array  # k P^(2/3)
    rounding: Array  # bound on the error of each of the above, less a remainder
    remainder: float  # bound on the 2-norm of that
    component: float  # bound on each component of it
    residual: Array  # bound on |e|, less the remainder: |gap| where loaded, else its negative part
    approach: float  # D0

    def of_some(self, which: NDArray[np.bool_]) -> Fit:
        """Of some asperities alone, whatever gaps the others have."""
        return self._replace(residual=np.where(which, self.residual, 0.0))


def scaled_to(load: float, given: Array) -> Array:
    """Loads that add up to what is prescribed: "Prescribed load"."""
    total = float(given.sum())
    if total == 0.0:
        expected = "a load on some asperity that could touch, as the total is prescribed"
        raise InputError("loads", found="none", expected=expected)
    return given / total * load


def fit(problem: NormalProblem, loads: Array, weights: Array | None = None) -> Fit:
    """The residual e, with its "Rounding"; D0 so that the sum of e with the weights is 0.

    weights : (n,) of touching asperities, for a prescribed load
    """
    displacement = problem.influence.apply(loads)
    local = hertz.indentation(loads, problem.coefficients)
    approach = problem.approach
    if approach is None:
        assert weights is not None
        approach = float(weights @ (local + displacement - problem.offsets) / weights.sum())
    indentation = approach + problem.offsets - displacement
    gap = local - indentation
    off = problem.influence.rounding(loads)
    # The relative part is of the true product, which the computed one may miss by the remainder.
    rounding = (
        off.relative * (np.maximum(displacement, 0.0) + off.component) + problem.offset_errors
    )
    rounding += SUM_ROUNDOFFS * ROUNDOFF * (local + np.abs(displacement) + abs(approach))
    residual = np.where(loads > 0, np.abs(gap) + rounding, np.maximum(rounding - gap, 0.0))
    return Fit(
        displacement, indentation, gap, local, rounding, off.norm, off.component, residual, approach
    )
