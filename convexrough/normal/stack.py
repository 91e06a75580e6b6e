"""Many normal problems with the same number of asperities that could touch, as rows of arrays.

The functions of `refine` and `proved` take such a stack in place of a single problem.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np

from convexrough.arithmetic.balls import Ball, joined
from convexrough.arithmetic.pairs import Pair
from convexrough.arrays import Array, Indices, summed
from convexrough.convex.newton_step import softness_of
from convexrough.normal.exact import Data
from convexrough.normal.problem import NormalProblem

#: Slices of rows, each with a problem that has the compliance operator of these rows.
Coupled: TypeAlias = Sequence[tuple[slice, NormalProblem]]


@dataclass(frozen=True, eq=False)
class Stack(NormalProblem):
    """Problems in m rows: arrays are (m, n), or (n,) where all rows are equal. `restricted`,
    `widened`, `approach_bound`, `places`, `to_scene` and `assemble` do not work."""

    coupled: Coupled  # scene and units are those of the first problem

    @classmethod
    def of(cls, coupled: Coupled, exact: Data, control: Ball, by_load: bool) -> Stack:
        """The stack of these problems; `exact` has coefficients (1,) or (m, 1), offsets (m, n)."""
        first = coupled[0][1]
        given = {each.name: getattr(first, each.name) for each in fields(first)} | {
            "coefficients": exact.coefficients.value,
            "offsets": exact.offsets.value,
            "offset_errors": exact.offsets.error,
            "highest": np.full(control.shape, np.inf) if by_load else control.upper,
            "shells": _each(coupled, "shells"),
            "control": control,
            "by_load": by_load,
            "sharp": True,
        }
        stack = cls(**given, coupled=coupled)
        stack.__dict__.update(exact=exact, squares=_each(coupled, "squares"))
        return stack

    @cached_property
    def row_norm(self) -> Array:
        return _each(self.coupled, "row_norm")[:, None]

    @cached_property
    def largest_entry(self) -> Array:
        return _each(self.coupled, "largest_entry")[:, None]

    def only(self, rows: Indices) -> Stack:
        """The stack of the chosen rows, given in increasing order."""
        ends = np.searchsorted(rows, [0, *(some.stop for some, _ in self.coupled)]).tolist()
        slices = zip(map(slice, ends[:-1], ends[1:]), self.coupled, strict=True)

        def pick(values: Any) -> Any:
            every = len(values.shape) == 2 and len(values) == len(self.control)
            return values[rows] if every else values

        k, d, scale = self.exact
        coupled = [(some, problem) for some, (_, problem) in slices if some.stop > some.start]
        data = Data(pick(k), pick(d), scale)
        return Stack.of(coupled, data, pick(self.control), self.by_load)

    def apply(self, loads: Array) -> Array:
        """(m, n) A P in float64."""
        found = np.empty(loads.shape)
        for rows, problem in self.coupled:
            found[rows] = loads[rows] @ problem.influence.matrix
        return found

    def product(self, loads: Pair) -> Ball:
        """(m, n) A P to about thirty digits."""
        return joined([problem.product(loads.at(rows)) for rows, problem in self.coupled])

    def moved(self, loads: Pair, product: Ball, others: Pair) -> Ball:
        return self.product(others)

    def correct(self, slopes: Array, defect: Array, enough: Any = 0.0, todo: Any = True) -> Array:
        """(m, n) as `NormalProblem.correct`, to rounding; nan in rows whose matrix is indefinite.

        The step is beta - F + A x, where (1 / slopes + A) x = F - beta.

        todo : (m,) True for rows that need a step; the step of all other rows is 0
        """
        from scipy.linalg.lapack import dposv  # takes 0.2 s to import

        count = max(1, int((slopes > 0).sum(axis=1).max()))
        order = np.argsort(slopes <= 0, axis=1, kind="stable")[:, :count]
        softness = softness_of(np.take_along_axis(slopes, order, axis=1))
        right = np.ones((len(slopes), 2, count))
        right[:, 0] = np.take_along_axis(defect, order, axis=1)
        for rows, problem in self.coupled:
            A = problem.influence.matrix
            for k in range(rows.start, rows.stop):
                if todo[k]:
                    matrix = A.take(order[k], 0).take(order[k], 1)
                    matrix.ravel()[:: count + 1] = softness[k]
                    _, x, info = dposv(matrix.T, right[k].T, lower=1, overwrite_a=1)
                    right[k] = x.T if info == 0 else np.nan
        changes, (moved, border) = np.zeros(slopes.shape), right.transpose(1, 0, 2)
        shift = summed(moved) / summed(border) if self.by_load else 0.0
        np.put_along_axis(changes, order, moved - shift * border, axis=1)
        return np.asarray(np.where(todo[:, None], shift - defect + self.apply(changes), 0.0))


def _each(coupled: Coupled, name: str) -> Array:
    """(m, ...) this property of the problem of each row."""
    counts = [rows.stop - rows.start for rows, _ in coupled]
    return np.repeat([getattr(problem, name) for _, problem in coupled], counts, axis=0)
