"""What friction states are judged by, and the bounds that a judgement of them finds."""

from __future__ import annotations

from fractions import Fraction
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array, Indices
from convexrough.influence.coupling import Sums
from convexrough.normal.residual import INVERSE_PI, SHARP_OPERATIONS, SUM_ROUNDOFFS
from convexrough.roundoff import ROUNDOFF, SAFETY
from convexrough.shearing.load_errors import LoadErrors
from convexrough.shearing.loss_errors import Nearness, loss_errors
from convexrough.shearing.normal_map import States, slips
from convexrough.shearing.problem import TangentialProblem
from convexrough.twofold import TWOFOLD_ROUNDOFF, Twofold, exact_sum, whole

#: Roundoffs of a share u / P that are counted apart: near full slip each changes the loss by up to
#: 1e5 roundoffs of its own.
SHARE_ROUNDOFFS = 4

#: Roundoffs of k P^(2/3) phi(t): 22 of the first, as in `normal.residual`, and some 12 of phi.
OWN_ROUNDOFFS = 40


class Bounds(NamedTuple):
    """Proved bounds on m states, in own units; infinite where nothing is proved."""

    proved: NDArray[np.bool_]  # (m,)
    increments: Array  # (m, n) |u - u*|
    slips: Array  # (m, n) |slip - slip*|
    rises: Array  # (m,)
    sliding: NDArray[np.bool_]  # (m, n)
    partial: NDArray[np.bool_]  # (m, n) proved not to slide
    losses: Array  # (m,) |w - w*|, of what a cycle of this amplitude costs

    @classmethod
    def unproved(cls, m: int, n: int) -> Bounds:
        """Nothing is known of m states of n asperities."""
        unknown, no = np.full((m, n), np.inf), np.zeros((m, n), dtype=bool)
        nowhere, unproved = np.full(m, np.inf), np.zeros(m, dtype=bool)
        return cls(unproved, unknown, unknown.copy(), nowhere, no, no.copy(), nowhere.copy())


class Given(NamedTuple):
    """What the proofs start from: m states, what each leaves to each asperity, and its rounding."""

    problem: TangentialProblem
    known: LoadErrors
    states: States
    available: Array  # (m, n) Delta - A u: the own deflection of an asperity, and its slip
    rounding: Array  # (m, n) bounds on the error of that, less a remainder
    remainder: Array  # (m,) bounds on the 2-norm of that
    each: Array  # (m,) and on each component of it

    def take(self, rows: Indices) -> Given:
        """Some of the states."""
        rest = (field[rows] for field in self[3:])
        return Given(self.problem, self.known, self.states.take(rows), *rest)


class _Left(NamedTuple):
    """The rest of `Given`, of one state."""

    available: Array
    rounding: Array
    remainder: float
    each: float


def assess(problem: TangentialProblem, states: States) -> Given:
    rises = states.rises.tolist()
    found = [_left(problem, u, rise) for u, rise in zip(states.increments, rises, strict=True)]
    fields = (np.array(field) for field in zip(*found, strict=True))
    return Given(problem, LoadErrors.of(problem), states, *fields)


def _left(problem: TangentialProblem, u: Array, rise: float) -> _Left:
    """Delta - A u, in twofold numbers where the sums of A u are known to so many digits."""
    A = problem.influence
    sums = A.sums(u)
    if sums is not None:
        return _sharply_left(problem, sums, rise)
    displacement, off = A.apply(u), A.rounding(u)
    above = A.apply(np.abs(u)) if (u < 0).any() else displacement
    # The relative part is of the true product, which the computed one may miss by all of it.
    above = (np.maximum(above, 0.0) + off.component) * (1.0 + 2.0 * off.relative)
    rounding = off.relative * above + SUM_ROUNDOFFS * ROUNDOFF * (above + rise)
    return _Left(rise - displacement, rounding, off.norm, off.component)


def _sharply_left(problem: TangentialProblem, sums: Sums, rise: float) -> _Left:
    force, length = Fraction(problem.units.force), Fraction(problem.units.length)
    modulus = Fraction(problem.scene.material.contact_modulus)
    scale = Twofold.nearest(INVERSE_PI * force / length / modulus)
    product = Twofold(*exact_sum(sums.whole, sums.rest))
    displacement = Twofold(product.high * sums.unit, product.low * sums.unit) * scale
    left = whole(np.full(len(sums.whole), rise)) + -displacement
    rounding = 2 * ROUNDOFF * np.abs(left.high)
    rounding += SHARP_OPERATIONS * TWOFOLD_ROUNDOFF * (np.abs(displacement.high) + rise)
    unit = sums.unit * scale.high * (1 + SAFETY)
    return _Left(left.high, rounding, sums.norm * unit, sums.error * unit)


def bounds_of(given: Given, near: Nearness, proved: NDArray[np.bool_], increments: Array) -> Bounds:
    problem, states = given.problem, given.states
    losses = loss_errors(problem, given.known, states, near)
    missed = np.abs(states.slips - slips(problem, given.available))
    errors = near.errors + missed * (1 + SAFETY)
    return Bounds(proved, increments, errors, near.rises, near.sliding, near.partial, losses)
