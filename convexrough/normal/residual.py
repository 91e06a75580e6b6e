"""How well loads fit the contact law: the residual e of judged loads, with its rounding.

docs/theory/certificate.md, "A bound on the loads" and "Rounding".
"""

from __future__ import annotations

from fractions import Fraction
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array
from convexrough.errors import InputError
from convexrough.influence.coupling import Sums
from convexrough.normal.problem import NormalProblem
from convexrough.roundoff import ROUNDOFF, SAFETY
from convexrough.sphere import hertz
from convexrough.twofold import TWOFOLD_ROUNDOFF, Twofold, exact_sum, whole

#: Roundoffs lost in k P^(2/3) and in adding it, A P and D up: "Rounding".
SUM_ROUNDOFFS = 16

#: Roundoffs lost in k P^(2/3) alone, and operations on twofold numbers that lead to the rest.
LOCAL_ROUNDOFFS, SHARP_OPERATIONS = 22, 32

#: To 66 digits.
INVERSE_PI = Fraction("0.318309886183790671537767526745028724068919291480912897495334688118")


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
    local = hertz.indentation(loads, problem.coefficients)
    sums = problem.influence.sums(loads)
    if sums is not None:
        return _sharp_fit(problem, loads, weights, local, sums)
    displacement = problem.influence.apply(loads)
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
    return Fit(
        displacement,
        indentation,
        gap,
        local,
        rounding,
        off.norm,
        off.component,
        _residual(loads, gap, rounding),
        approach,
    )


def _residual(loads: Array, gap: Array, rounding: Array) -> Array:
    residual: Array = np.where(loads > 0, np.abs(gap) + rounding, np.maximum(rounding - gap, 0.0))
    return residual


def _sharp_fit(
    problem: NormalProblem, loads: Array, weights: Array | None, local: Array, sums: Sums
) -> Fit:
    """The same with A P and D in twofold numbers: what is left is the rounding of k P^(2/3)."""
    scale = _twofold_scale(problem)
    product = Twofold(*exact_sum(sums.whole, sums.rest))
    displacement = Twofold(product.high * sums.unit, product.low * sums.unit) * scale
    above = problem.twofold_offsets() + -displacement  # D - D0 - A P
    if problem.approach is None:
        assert weights is not None
        approach, total = 0.0, float(weights.sum())
        shift = float(weights @ (local - above.high) / total)
        rest = float(weights @ ((local - above.high - shift) - above.low) / total)
        level = Twofold(*exact_sum(shift, rest))
        approach = level.high
    else:
        approach = problem.approach
        level = whole(approach)
    indentation = above + level
    gap = (local - indentation.high) - indentation.low
    error = sums.error * sums.unit * scale.high * (1 + SAFETY)
    rounding = LOCAL_ROUNDOFFS * ROUNDOFF * local + 4 * ROUNDOFF * np.abs(gap)
    sizes = np.abs(displacement.high) + np.abs(problem.offsets) + abs(approach)
    rounding += SHARP_OPERATIONS * TWOFOLD_ROUNDOFF * (sizes + problem.offset_errors / ROUNDOFF)
    norm = sums.norm * sums.unit * scale.high * (1 + SAFETY)
    # The rounded values are given, and their own rounding with them.
    residual = _residual(loads, gap, rounding)
    rounding = rounding + 2 * ROUNDOFF * np.abs(indentation.high)
    return Fit(
        displacement.high,
        indentation.high,
        gap,
        local,
        rounding,
        norm,
        error,
        residual,
        approach,
    )


def _twofold_scale(problem: NormalProblem) -> Twofold:
    """1 / (pi E*) in own units."""
    modulus = Fraction(problem.scene.material.contact_modulus)
    units = Fraction(problem.units.force) / Fraction(problem.units.length)
    return Twofold.nearest(INVERSE_PI * units / modulus)
