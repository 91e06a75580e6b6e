"""The memory curve: the friction state under varying normal load, as plane geometry.

With the load P, the shear force Q and the coefficient of friction f, the state after any path of
(P, T = Q / f) is a polygonal line: the heights Th(s) at load levels 0 <= s <= P. It leads from
(0, 0) to the present point (P, T), with slopes from -1 to 1. A straight segment of the path changes
it by the rules in docs/theory/paths.md, "Changes of the curve", above a level, the slip front. The
rules do not depend on elasticity. All numbers are exact fractions, so no rule rounds.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from fractions import Fraction
from itertools import pairwise
from typing import Any, ClassVar, NamedTuple, TypeAlias

import numpy as np

from convexrough import checks
from convexrough.errors import InputError
from convexrough.plottable import Plottable
from convexrough.record import Along, Table, Variables, in_text

#: A point (P, T = Q / f) of a path, as exact fractions.
Point: TypeAlias = tuple[Fraction, Fraction]


class Piece(NamedTuple):
    """A part of a path's segment on which the slip front falls through one layer of the curve.

    In this part, the load P is a linear function of the level of the front.
    """

    sign: int  # the direction c of slip, 1 or -1
    slope: Fraction  # slope th of the layer; the loss is proportional to 1 - c th
    top: Fraction  # [force] level of the front at the beginning
    bottom: Fraction  # [force] level of the front at the end
    load_before: Fraction  # [force] P at the beginning
    load_after: Fraction  # [force] P at the end

    @property
    def load_constant(self) -> bool:
        return self.load_before == self.load_after


@dataclass(frozen=True, repr=False)
class MemoryCurve(Table, Plottable):
    """The friction state after a path: a polygonal line over the load (docs/theory/paths.md).

    levels, heights : (m + 1,) [force] coordinates s and Th of the vertices, from the origin
    slopes : (m,) slope of each layer, between a vertex and the next
    front  : [force] level of the slip front at the end of the last segment of the path, above which
        this segment has changed the line. None if nothing slips

    >>> curve, _ = cr.MemoryCurve.pressed(1.0).go(1.0, 0.25)
    >>> float(curve.front), float(curve.heights[-1])
    (0.75, 0.25)
    """

    _along: ClassVar[Along] = {("vertex",): ("levels", "heights"), ("layer",): ("slopes",)}

    levels: tuple[Fraction, ...] = (Fraction(0),)
    heights: tuple[Fraction, ...] = (Fraction(0),)
    slopes: tuple[Fraction, ...] = ()
    front: Fraction | None = None

    @classmethod
    def pressed(cls, load: Fraction | float) -> MemoryCurve:
        """The state of a contact that was pressed to a load [force] without shear."""
        return cls().go(load, 0)[0]

    @property
    def load(self) -> Fraction:
        """[force] the load P, the level of the last vertex."""
        return self.levels[-1]

    @property
    def height(self) -> Fraction:
        """[force] T = Q / f, the height of the last vertex."""
        return self.heights[-1]

    def _rows(self) -> Iterator[tuple[str, str]]:
        """The printed rows; fractions are rounded."""
        for name, (_, values) in self._variables().items():
            yield name, in_text(values)
        yield "front", "none" if self.front is None else in_text(float(self.front))

    def _variables(self) -> Variables:
        return {
            name: (along, np.array([float(value) for value in getattr(self, name)]))
            for along, names in self._along.items()
            for name in names
        }

    def _attributes(self) -> dict[str, Any]:
        return {} if self.front is None else {"front": float(self.front)}

    @property
    def bends(self) -> list[tuple[Fraction, Fraction]]:
        """Each vertex's level s_k and bend c_k: the slope below the vertex minus that above."""
        slopes = (Fraction(0), *self.slopes, Fraction(0))
        bends = [below - above for below, above in pairwise(slopes)]
        return list(zip(self.levels, bends, strict=True))

    def go(
        self, load: Fraction | float, height: Fraction | float
    ) -> tuple[MemoryCurve, list[Piece]]:
        """The state after a straight segment to (P, T) [force], and the pieces of its loss.

        Raises InputError if a number is not finite, or |T| > P, which friction does not allow.
        """
        load, height = (
            Fraction(it if isinstance(it, int | Fraction) else checks.finite(name, it))
            for name, it in (("P", load), ("T", height))
        )
        if abs(height) > load:
            expected = f"at most the load, {float(load)}, in size"
            raise InputError("T", found=float(height), expected=expected)
        curve, pieces = self, list[Piece]()
        while (curve.load, curve.height) != (load, height):
            curve, more = curve._stroke(load, height)
            pieces += more
        return curve, pieces

    def _stroke(self, load: Fraction, height: Fraction) -> tuple[MemoryCurve, list[Piece]]:
        """The state after the first part of a segment, which one rule covers, and its pieces."""
        added, shear = load - self.load, height - self.height
        if added > 0 and abs(shear) <= added:
            return self._with(shear / added, load, height), []
        # If the load falls, `lean` is positive where the path starts above the old curve.
        lean = shear if added >= 0 else shear - self.slopes[-1] * added
        if lean != 0:
            return self._slip(1 if lean > 0 else -1, load, height)
        last = len(self.slopes) - 1  # the path runs back along the top layer
        below = self._cut(last)
        return below if load <= below.load else below._with(self.slopes[last], load, height), []

    def _slip(self, sign: int, load: Fraction, height: Fraction) -> tuple[MemoryCurve, list[Piece]]:
        """The state after slip of this sign on a segment, and the pieces of its loss.

        The line of slope `sign` through the moving point (P, T) meets the old curve at the front.
        The front reaches the lower end of a layer when the point has passed the fraction `reach` of
        the segment; its level is linear in this fraction. It passes a layer of slope `sign` at
        once. If the load falls, the point may meet the curve again. Then slip ends.
        """
        added, shear = load - self.load, height - self.height
        rate, done, front, k = shear - sign * added, Fraction(0), Fraction(0), 0
        pieces, met = list[Piece](), False
        for k in reversed(range(len(self.slopes))):
            if (slope := self.slopes[k]) == sign:
                continue
            front, high = self.levels[k], self.levels[k + 1]
            above, run = self.height - self.heights[k], self.load - front
            reach = (sign * run - above) / rate
            start, done = done, min(reach, Fraction(1))
            if added < 0 and sign * (nears := slope * added - shear) > 0:
                meets = (above - slope * run) / nears
                if met := start < meets <= done:
                    done = meets
            if done < reach:
                front = high - (high - front) * (done - start) / (reach - start)
            if front < high:
                loads = self.load + start * added, self.load + done * added
                pieces.append(Piece(sign, slope, high, front, *loads))
            if met or done == 1:
                break
        if met:
            load, height = self.load + done * added, self.height + done * shear
        curve = self._cut(k)
        if front > curve.load:
            at_front = curve.height + self.slopes[k] * (front - curve.load)
            curve = curve._with(self.slopes[k], front, at_front)
        if load > front:
            curve = curve._with(Fraction(sign), load, height)
        return replace(curve, front=front), pieces

    def _cut(self, vertex: int) -> MemoryCurve:
        """The curve from the origin to the vertex with this index."""
        part = slice(vertex + 1)
        return MemoryCurve(self.levels[part], self.heights[part], self.slopes[:vertex])

    def _with(self, slope: Fraction, load: Fraction, height: Fraction) -> MemoryCurve:
        """The curve with one more layer, up to (load, height); layers of equal slope are merged."""
        count = len(self.slopes)
        if count and self.slopes[-1] == slope:
            count -= 1
        below = self._cut(count)
        return MemoryCurve((*below.levels, load), (*below.heights, height), (*below.slopes, slope))
