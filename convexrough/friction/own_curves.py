"""The memory curves of asperities, each in the plane of its own indentation and deflection.

This module writes docs/theory/paths.md, "The rules", as one formula. The curve after a straight
step follows from the old curve and the end (s1, t1) of the step alone: the slip front only moves
down, and the part of a curve above the present indentation is dropped. Cut the old curve at the
smaller of the old and the new indentation, and let h be its heights. If the asperity slips, the new
curve ends in a line of slope c = +1 or -1 from the front L to (s1, t1), with

    L - c h(L) = s1 - c t1,

whose left side does not decrease with L. Shear forces are divided by the coefficient of friction f,
deflections by c_t f with Mindlin's ratio c_t.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array, Indices
from convexrough.sphere import hertz


class OwnCurves(NamedTuple):
    """The curves of n asperities, as polygons of m vertices; the last vertex may be repeated.

    coefficients : (n,) k of Hertz's law
    levels, heights : (n, m) indentations and deflections at the vertices
    loads, forces : (n, m) loads and shear forces there
    """

    coefficients: Array
    levels: Array
    heights: Array
    loads: Array
    forces: Array

    @classmethod
    def pressed(cls, indentations: Array, coefficients: Array) -> OwnCurves:
        """The curves of asperities without shear; a negative indentation (a gap) counts as 0."""
        levels = np.column_stack((np.zeros(len(indentations)), np.maximum(indentations, 0.0)))
        nothing = np.zeros(levels.shape)
        return cls(
            coefficients, levels, nothing, hertz.load(levels, coefficients[:, None]), nothing
        )

    def cut(self, indentations: Array) -> OwnCurves:
        """The curves up to these indentations (n,); curves that end below them are unchanged."""
        front = self._front(np.zeros(len(indentations)), indentations)
        return self._ended(front, front.level, front.height, front.load, front.force)

    def step(self, indentations: Array, deflections: Array) -> OwnStep:
        """A straight step that ends here, (n,) each; the curves must be cut at `indentations`."""
        base, moved = self.levels[:, -1], deflections - self.heights[:, -1]
        sticks = (indentations > base) & (np.abs(moved) <= indentations - base)
        sign = np.where(sticks, 0.0, np.sign(moved))
        front = self._front(sign, np.where(sign == 0, base, indentations - sign * deflections))
        load = hertz.load(indentations, self.coefficients)
        grown = np.where(sticks, indentations - base, 1.0)
        slope = np.where(sticks, moved / grown, sign)
        at_front = 1.5 * np.sqrt(front.level / self.coefficients**3)
        stiffness = np.where(sticks, (load - front.load) / grown, at_front)
        return OwnStep(
            old=self,
            front=front,
            indentations=indentations,
            deflections=deflections,
            loads=load,
            forces=front.force + slope * (load - front.load),
            stiffness=np.where(np.abs(deflections) < indentations, stiffness, 0.0),
            slips=sign != 0,
        )

    def energies(self) -> Array:
        """(n,) elastic energy of the own deflections, divided by c_t f^2."""
        run, added = np.diff(self.levels), np.diff(self.heights)
        slope = np.divide(added, run, out=np.zeros(run.shape), where=run > 0)
        plain = slope * (self.forces[:, :-1] - slope * self.loads[:, :-1]) * run
        power = np.diff(self.loads * self.levels)
        return np.asarray((plain + 0.4 * slope**2 * power).sum(axis=1))

    def _front(self, sign: Array, wanted: Array) -> _Front:
        """The point on each curve at which  level - sign * height  reaches `wanted` (n,)."""
        keys, rows = self.levels - sign[:, None] * self.heights, np.arange(len(sign))
        below = (keys < wanted[:, None]).sum(axis=1)
        after = np.clip(below, 1, keys.shape[1] - 1)
        here, there = (rows, after - 1), (rows, after)
        width = keys[there] - keys[here]
        part = np.where(below > after, 1.0, 0.0)
        np.divide(wanted - keys[here], width, out=part, where=width > 0)
        part = np.clip(part, 0.0, 1.0)
        level, height = (
            each[here] + part * (each[there] - each[here]) for each in (self.levels, self.heights)
        )
        load, low = hertz.load(level, self.coefficients), self.loads[here]
        width = self.loads[there] - low
        part = np.divide(load - low, width, out=np.zeros(len(low)), where=width > 0)
        force = self.forces[here] + part * (self.forces[there] - self.forces[here])
        return _Front(after, level, height, load, force)

    def _ended(self, front: _Front, *ends: Array) -> OwnCurves:
        """The curves up to the front, then a line to `ends`: levels, heights, loads and forces."""
        columns, after = np.arange(int(front.after.max()) + 2), front.after[:, None]
        kept = np.minimum(columns, self.levels.shape[1] - 1)
        parts = (
            np.where(
                columns < after,
                old[:, kept],
                np.where(columns == after, at_front[:, None], end[:, None]),
            )
            for old, at_front, end in zip(self[1:], front[1:], ends, strict=True)
        )
        return OwnCurves(self.coefficients, *parts)


class _Front(NamedTuple):
    """One point on each curve, before its vertex with the index `after`; arrays are (n,)."""

    after: Indices
    level: Array
    height: Array
    load: Array
    force: Array


class OwnStep(NamedTuple):
    """A step of n asperities from their old curves; all arrays are (n,).

    forces    : shear forces after the step
    stiffness : derivatives of the forces with respect to the deflections
    slips     : True where a front moves
    """

    old: OwnCurves
    front: _Front
    indentations: Array
    deflections: Array
    loads: Array
    forces: Array
    stiffness: Array
    slips: NDArray[np.bool_]

    @property
    def curves(self) -> OwnCurves:
        """The curves after the step."""
        ends = self.indentations, self.deflections, self.loads, self.forces
        return self.old._ended(self.front, *ends)

    @property
    def fronts(self) -> Array:
        """(n,) indentations at the slip fronts; the whole indentation where nothing slips."""
        return np.where(self.slips, self.front.level, self.indentations)
