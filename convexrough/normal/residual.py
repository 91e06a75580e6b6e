"""How well loads fit the contact law: the residual e of judged loads, with its rounding.

docs/theory/certificate.md, "A bound on the loads" and "Rounding".
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array, frozen
from convexrough.errors import InputError
from convexrough.normal.problem import NormalProblem
from convexrough.record import Record
from convexrough.roundoff import ROUNDOFF, SAFETY
from convexrough.sphere import hertz
from convexrough.twofold import TWOFOLD_ROUNDOFF, Twofold, exact_sum, in_parts, whole

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


@dataclass(frozen=True, eq=False, repr=False)
class Displaced(Record):
    """Loads, and A times them to many more digits than a product has: from nothing but both.

    docs/theory/last-step.md, "Loads nearby". What `of` and `moved_to` make is read-only, as proofs
    rest on it: one made by hand would be no proof.

    loads   : (n,);  product : A P;  offsets : D - D0
    error   : bound on the error of each component, beside the rounding of twofold numbers
    norm    : bound on the 2-norm of these errors
    """

    problem: NormalProblem
    loads: Array
    product: Twofold
    offsets: Twofold
    error: float
    norm: float

    @classmethod
    def of(cls, problem: NormalProblem, loads: Array) -> Displaced | None:
        """None where products are known to a product's digits only."""
        sums = problem.influence.sums(loads)
        if sums is None:
            return None
        scale = _twofold_scale(problem)

        def multiply(some: slice) -> Twofold:
            total = Twofold(*exact_sum(sums.whole[some], sums.rest[some]))
            return Twofold(total.high * sums.unit, total.low * sums.unit) * scale

        product = in_parts(len(loads), multiply)
        error, norm = (
            each * sums.unit * scale.high * (1 + SAFETY) for each in (sums.error, sums.norm)
        )
        return cls(problem, _kept(loads), product, problem.twofold_offsets(), error, norm)

    def moved_to(self, loads: Array) -> Displaced:
        """With an ordinary product, of what loads nearby differ by: so small is its rounding."""
        change = loads - self.loads
        if not change.any():
            return self
        product = self.problem.influence.apply(change)
        off = self.problem.influence.rounding(change)
        # A |change| is at most off.most; subtracting loads may have lost a roundoff of each.
        relative = (off.relative + ROUNDOFF) * off.most
        error = off.component + relative
        norm = off.norm + relative * math.sqrt(len(loads))
        moved = in_parts(len(loads), lambda some: self.product.at(some) + whole(product[some]))
        bounds = self.error + error * (1 + SAFETY), self.norm + norm * (1 + SAFETY)
        return Displaced(self.problem, _kept(loads), moved, self.offsets, *bounds)


def _kept(loads: Array) -> Array:
    """What nobody changes any more."""
    return frozen(loads.copy()) if loads.flags.writeable else loads


def displaced(problem: NormalProblem, loads: Array, nearby: Displaced | None) -> Displaced | None:
    """Of these loads: from those nearby, if these are of this problem and near enough."""
    if nearby is not None and nearby.problem is problem:
        moved = nearby.moved_to(loads)
        local = hertz.indentation(loads, problem.coefficients)
        touching = float(np.count_nonzero(loads)) or 1.0
        little = ROUNDOFF * float(local.sum()) / touching  # of the mean of the local terms
        if moved.error - nearby.error <= max(nearby.error, little):
            return moved
    return Displaced.of(problem, loads)


def local_rounding(local: Array) -> Array:
    """Bound on the error of k P^(2/3) as computed."""
    return LOCAL_ROUNDOFFS * ROUNDOFF * local


def scaled_to(load: float, given: Array) -> Array:
    """Loads that add up to what is prescribed: "Prescribed load".

    As they are, if they do so already.
    """
    total = float(given.sum())
    if total == 0.0:
        expected = "a load on some asperity that could touch, as the total is prescribed"
        raise InputError("loads", found="none", expected=expected)
    return given if abs(total - load) <= 2 * ROUNDOFF * load else given / total * load


def fit(
    problem: NormalProblem,
    loads: Array,
    weights: Array | None = None,
    nearby: Displaced | None = None,
) -> Fit:
    """The residual e, with its "Rounding"; D0 so that the sum of e with the weights is 0.

    weights : (n,) of touching asperities, for a prescribed load
    nearby  : loads near these, of which A P is known to many digits
    """
    known = displaced(problem, loads, nearby)
    if known is not None:
        return sharp_fit(problem, known, weights)
    local = hertz.indentation(loads, problem.coefficients)
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


class Gaps(NamedTuple):
    """Of the contact law, to twice as many digits but for the local term."""

    local: Array  # k P^(2/3)
    indentation: Array  # D - A P, its first digits
    gap: Array  # k P^(2/3) + A P - D
    approach: float  # D0

    @classmethod
    def of(cls, problem: NormalProblem, known: Displaced, weights: Array | None) -> Gaps:
        """`weights` as for `fit`."""
        loads, offsets, product = known.loads, known.offsets, known.product
        local = hertz.indentation(loads, problem.coefficients)
        # D - D0 - A P
        above = in_parts(len(loads), lambda some: offsets.at(some) + -product.at(some))
        if problem.approach is None:
            assert weights is not None
            total = float(weights.sum())
            shift = float(weights @ (local - above.high) / total)
            rest = float(weights @ ((local - above.high - shift) - above.low) / total)
            level = Twofold(*exact_sum(shift, rest))
        else:
            level = whole(problem.approach)
        indentation = in_parts(len(loads), lambda some: above.at(some) + level)
        gap = (local - indentation.high) - indentation.low
        return cls(local, indentation.high, gap, level.high)


def sharp_fit(problem: NormalProblem, known: Displaced, weights: Array | None) -> Fit:
    """The same with A P and D in twofold numbers: what is left is the rounding of k P^(2/3)."""
    displacement = known.product.high
    local, indentation, gap, approach = Gaps.of(problem, known, weights)
    rounding = local_rounding(local) + 4 * ROUNDOFF * np.abs(gap)
    sizes = np.abs(displacement) + np.abs(problem.offsets) + abs(approach)
    rounding += SHARP_OPERATIONS * TWOFOLD_ROUNDOFF * (sizes + problem.offset_errors / ROUNDOFF)
    # The rounded values are given, and their own rounding with them.
    residual = _residual(known.loads, gap, rounding)
    rounding = rounding + 2 * ROUNDOFF * np.abs(indentation)
    return Fit(
        displacement,
        indentation,
        gap,
        local,
        rounding,
        known.norm,
        known.error,
        residual,
        approach,
    )


def _twofold_scale(problem: NormalProblem) -> Twofold:
    """1 / (pi E*) in own units."""
    modulus = Fraction(problem.scene.material.contact_modulus)
    units = Fraction(problem.units.force) / Fraction(problem.units.length)
    return Twofold.nearest(INVERSE_PI * units / modulus)
