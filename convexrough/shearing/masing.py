"""Masing's rule with memory: which first-loading state each step of a history is made of.

On a branch from a turning point Q1 to Q, with T = |Q - Q1| / (2 f),

    Q_i = Q_i(Q1) -+ 2 f u_i(T),  X = X(Q1) -+ 2 c_t f rise(T),  s_i = s_i(Q1) -+ 2 c_t f slip_i(T).

A branch that reaches the previous turning point closes its loop; both points are forgotten and the
older branch goes on; first loading ends the stack. A branch costs half of a cycle of its amplitude,
first loading a quarter (docs/theory/shear.md, "Histories").
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from convexrough.arrays import Array


class Step(NamedTuple):
    """How one step is looked up: state = base + scale * first loading(total).

    Each T that it is charged for is half the difference of the forces of two steps, or, where the
    second is -1, that of one step.
    """

    base: int  # the step at the turning point, -1 for the virgin state
    scale: float  # +-2 on a branch, +-1 on first loading, 0 if nothing moves
    total: float  # T
    lost: list[tuple[float, float]]  # (factor, T): the step costs sum factor * w(T)
    between: list[tuple[int, int]]  # whose forces give each T of these


def remember(applied: Array) -> list[Step]:
    """Masing's rule with memory: which turning point each step hangs on. T-units: Q / f.

    The stack holds turning points (Q, step) that are not yet wiped out. The costs of a step are
    differences of w along the branches it runs through: 1/4 of a cycle on first loading, 1/2 on
    a branch.
    """
    stack: list[tuple[float, int]] = []
    steps: list[Step] = []
    now = 0.0
    for m, target in enumerate(applied):
        if target == now:
            steps.append(Step(m - 1, 0.0, 0.0, [], []))  # the same state once more
            continue
        origin, direction = now, np.sign(target - now)
        heading = np.sign(now - stack[-1][0]) if stack else np.sign(now)
        if heading == -direction:
            stack.append((now, m - 1))  # a new turning point
        lost: list[tuple[float, float]] = []
        between: list[tuple[int, int]] = []
        begun = max(m - 1, 0)  # the step whose force the origin is, but for its sign
        while stack:
            turn, step = stack[-1]
            # The branch closes where it meets the point before; the first one, on first loading.
            close, closing = stack[-2] if len(stack) > 1 else (-turn, -1)
            end = min(target * direction, close * direction) * direction
            lost += [(0.5, abs(end - turn) / 2), (-0.5, abs(origin - turn) / 2)]
            if target * direction < close * direction:
                between += [(m, step), (begun, step)]
                break
            between += [(step, closing), (begun, step)]
            origin, begun = close, closing if closing >= 0 else step
            del stack[-2:]
        if not stack:
            lost += [(0.25, abs(target)), (-0.25, abs(origin))]
            between += [(m, -1), (begun, -1)]
            steps.append(Step(-1, float(np.sign(target)), abs(target), lost, between))
        else:
            turn, step = stack[-1]
            total = abs(target - turn) / 2
            scale = 2.0 * float(np.sign(target - turn))
            steps.append(Step(step, scale, total, lost, between))
        now = target
    return steps
