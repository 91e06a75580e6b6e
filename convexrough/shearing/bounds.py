"""What friction states are judged by, and the bounds that a judgement of them finds."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array, Indices
from convexrough.shearing.load_errors import LoadErrors
from convexrough.shearing.loss_errors import Nearness, loss_errors
from convexrough.shearing.normal_map import States
from convexrough.shearing.problem import TangentialProblem

#: Roundoffs of a share u / P that are counted apart: near full slip each changes the own deflection
#: by (2/3) (1 - t)^(-1/3), up to 1e5, roundoffs of its own.
SHARE_ROUNDOFFS = 4


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
    """What the proofs start from: m states, A u of each, and its rounding."""

    problem: TangentialProblem
    known: LoadErrors
    states: States
    displacement: Array  # (m, n) A u
    magnitude: Array  # (m, n) upper bounds on A |u|
    rounding: Array  # (m, n) bounds on the error of A u, less a remainder
    remainder: Array  # (m,) bounds on the 2-norm of that

    @property
    def available(self) -> Array:
        """(m, n) the displacement left to each asperity, its own deflection and its slip."""
        return self.states.rises[:, None] - self.displacement

    def take(self, rows: Indices) -> Given:
        """Some of the states."""
        rest = (field[rows] for field in self[3:])
        return Given(self.problem, self.known, self.states.take(rows), *rest)


def assess(problem: TangentialProblem, states: States) -> Given:
    u, A = states.increments, problem.influence
    displacement = problem.couple(u)
    noise = [A.rounding(each) for each in u]
    relative = np.array([each.relative for each in noise])[:, None]
    remainder = np.array([each.norm for each in noise])
    magnitude = displacement
    back = np.flatnonzero((u < 0).any(axis=1))  # A |u| is not A u
    if len(back):
        magnitude = displacement.copy()
        magnitude[back] = problem.couple(np.abs(u[back]))
    # The relative part is of the true product, which the computed one may miss by all of it.
    magnitude = (np.maximum(magnitude, 0.0) + remainder[:, None]) * (1.0 + 2.0 * relative)
    known, rounding = LoadErrors.of(problem), relative * magnitude
    return Given(problem, known, states, displacement, magnitude, rounding, remainder)


def bounds_of(given: Given, near: Nearness, proved: NDArray[np.bool_], increments: Array) -> Bounds:
    losses = loss_errors(given.problem, given.known, given.states, near)
    return Bounds(proved, increments, near.errors, near.rises, near.sliding, near.partial, losses)
