"""Gross sliding, Q = f P: one-sided derivatives, where all asperities slide and the last one just.

What is held must keep Q at f P: the load is. By forces, the load and friction itself displacements
and losses change infinitely fast there, like (1 - Q / f P)^(-1/3). Derived in
docs/theory/scene-derivatives.md, "Where there is a derivative".
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from convexrough.arrays import Array, among_zeros
from convexrough.errors import InputError
from convexrough.gradients.adjoint import Excess, Friction, Holding, Pair, Pulled
from convexrough.shearing.problem import TangentialProblem

#: Asperities that slide last within so much of the displacement do so together.
TOGETHER = 1e-12


@dataclass(frozen=True)
class GrossDoubt:
    """About weights on loads that gross sliding leaves, times a factor; last : who slides last.

    increments, slips, rise : their weights; None of a loss
    """

    factor: float
    last: int
    increments: Array | None = None
    slips: Array | None = None
    rise: float = 0.0

    def weights(self, known: object, problem: TangentialProblem) -> None:
        """None: they are bounded to twice the digits only."""


def slides_last(problem: TangentialProblem) -> tuple[int, bool]:
    """Its index among the loaded asperities, and whether it slides last alone."""
    levels = problem.ceilings + problem.couple(problem.loads)
    last = int(np.argmax(levels))
    return last, np.count_nonzero(levels >= levels[last] * (1.0 - TOGETHER)) == 1


def last_to_slide(problem: TangentialProblem, holding: Holding, what: str, found: object) -> int:
    """Its index among the loaded asperities; InputError where nothing has a derivative."""
    last, alone = slides_last(problem)
    if holding == "approach":
        expected = "a force below f P: with the approach held f P may fall below the force"
        raise InputError(what, found=f"{found}: gross sliding", expected=expected)
    if not alone:
        expected = "a force below f P: there several asperities slide last, together, and which "
        expected += "of them does depends on the direction of a change"
        raise InputError(what, found=f"{found}: gross sliding", expected=expected)
    return last


def through_gross_sliding(
    problem: TangentialProblem, last: int, *, increments: Array, slips: Array, rise: float
) -> tuple[Pulled, float, float]:
    """From weights on u, on slips and on Delta; dJ/dT and f dJ/df besides, as Q comes from below.

    u = P but for the last, which has what is left of T; Delta = C_l + (A P)_l is its own.
    """
    P, C = problem.loads, problem.ceilings
    only = among_zeros(np.ones(1), np.array([last]), len(P))
    whole = rise + float(slips.sum())
    own = whole * only - slips  # weights on C + A P
    loads = increments - increments[last] + own * 2.0 * C / (3.0 * P) + problem.couple(own)
    by_force, by_friction = float(increments[last]), float((increments - increments[last]) @ P)
    if whole:
        by_force, by_friction = whole * np.inf, -whole * np.inf
    return Pulled(loads, own * C, [Pair(own, P)], by_force), by_force, by_friction


def excess_in_gross_sliding(problem: TangentialProblem, state: Friction, last: int) -> Excess:
    """y = P - T e_l, with Y = -A y where beta is without end."""
    y = problem.loads.copy()
    y[last] -= state.total
    return Excess(y, -problem.couple(y), -np.inf, None)
