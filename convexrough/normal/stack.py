"""Many normal problems with the same number of asperities that could touch, as rows of arrays.

The functions of `refine` and `proved` take such a stack in place of a single problem.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from convexrough.arithmetic.balls import Ball, joined
from convexrough.arithmetic.pairs import Pair
from convexrough.arrays import Array, Indices, largest
from convexrough.normal.problem import Data, NormalProblem, Units
from convexrough.roundoff import SAFETY
from convexrough.scene.scene import Scene


@dataclass(frozen=True, eq=False)
class Stack:
    """Problems in m rows, in scaled units: arrays are (m, n), or (n,) where all rows are equal.

    coupled : slices of the rows, each with a problem whose compliance operator is that of these
        rows
    exact   : coefficients k, which may be (1,) or (m, 1), and offsets d;  shells : as in
        `NormalProblem`
    squares : [length^2] squared distances of summits from the axis
    control : (m, 1) the prescribed loads if `by_load` is True, else the prescribed approaches
    """

    coupled: Sequence[tuple[slice, NormalProblem]]
    exact: Data
    shells: Array
    squares: Array
    control: Ball
    by_load: bool

    def __len__(self) -> int:
        return int(self.coupled[-1][0].stop)

    @property
    def scene(self) -> Scene:
        """A scene that has the same base and material as those of all rows."""
        return self.coupled[0][1].scene

    @property
    def units(self) -> Units:
        return self.coupled[0][1].units

    @cached_property
    def coefficients(self) -> Array:
        """The coefficients k, rounded to float64."""
        return self.exact.coefficients.value

    @cached_property
    def offsets(self) -> Array:
        """The offsets d, rounded to float64."""
        return self.exact.offsets.value

    @property
    def load(self) -> Array | None:
        """(m, 1) the prescribed loads, or None."""
        return self.control.value if self.by_load else None

    @property
    def approach(self) -> Array | None:
        """(m, 1) the prescribed approaches, or None."""
        return None if self.by_load else self.control.value

    @cached_property
    def row_norm(self) -> Array:
        """(m, 1) bounds on the largest 2-norm of a row of the compliance operator A."""
        return self._each("row_norm")

    @cached_property
    def largest_entry(self) -> Array:
        """(m, 1) bounds on the largest entry of A."""
        return self._each("largest_entry")

    def _each(self, name: str) -> Array:
        values = np.empty((len(self), 1))
        for rows, problem in self.coupled:
            values[rows] = getattr(problem, name)
        return values

    def only(self, rows: Indices) -> Stack:
        """The stack of the chosen rows, given in increasing order."""
        ends = np.searchsorted(rows, [0, *(some.stop for some, _ in self.coupled)]).tolist()
        slices = zip(map(slice, ends[:-1], ends[1:]), self.coupled, strict=True)

        def pick(values: Any) -> Any:
            return values[rows] if len(values.shape) == 2 and len(values) == len(self) else values

        k, d, scale = self.exact
        return Stack(
            [(some, problem) for some, (_, problem) in slices if some.stop > some.start],
            Data(pick(k), pick(d), scale),
            pick(self.shells),
            pick(self.squares),
            pick(self.control),
            self.by_load,
        )

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
        """(m, n) A P for P = `others`, to about thirty digits; other arguments are not used."""
        return self.product(others)

    def convexity_at(self, compliance: Array) -> Array:
        """(m, 1) convexity numbers at loads with this `compliance` (m, n)."""
        return np.asarray(largest(self.shells / compliance) * (1 + SAFETY))

    def compliance(self, loads: Array) -> Array:
        """(m, n) h = (2/3) k P^(-1/3)."""
        return np.asarray((2.0 / 3.0) * self.coefficients / np.cbrt(loads))

    def correct(self, slopes: Array, defect: Array, enough: Any, todo: NDArray[np.bool_]) -> Array:
        """(m, n) one Newton step of the indentations; nan in rows with an indefinite matrix.

        slopes, defect : (m, n) as in `NormalProblem.correct`
        todo   : (m,) True for rows that need a step; the step of all other rows is 0
        enough : not used, because factorisations leave only rounding errors
        """
        from scipy.linalg.lapack import dposv  # takes 0.2 s to import

        root = np.sqrt(slopes)
        count = max(1, int((root > 0).sum(axis=1).max()))
        order = np.argsort(root <= 0, axis=1, kind="stable")[:, :count]
        w = np.take_along_axis(root, order, axis=1)
        right = w * np.take_along_axis(defect, order, axis=1)
        changes, shift = np.zeros(root.shape), np.zeros((len(root), 1))
        for rows, problem in self.coupled:
            A = problem.influence.matrix
            for k in range(rows.start, rows.stop):
                if not todo[k]:
                    continue
                matrix = A.take(order[k], 0).take(order[k], 1)
                matrix *= w[k]
                matrix *= w[k][:, None]
                matrix.ravel()[:: count + 1] = 1.0
                _, y, info = dposv(matrix.T, np.array((right[k], w[k])).T, lower=1, overwrite_a=1)
                if info != 0:
                    shift[k] = np.nan
                    continue
                if self.load is not None:
                    shift[k] = w[k] @ y[:, 0] / (w[k] @ y[:, 1])
                changes[k, order[k]] = w[k] * (y[:, 0] - shift[k] * y[:, 1])
        return np.asarray(np.where(todo[:, None], shift - defect + self.apply(changes), 0.0))
