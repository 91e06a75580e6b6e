"""How far the slip annuli of a friction state can be off: docs/theory/gradient-bounds.md.

"What changes at a friction state". Arrays are (N,), of the asperities of `bounds.Known`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array
from convexrough.gradients.adjoint import Friction
from convexrough.gradients.bounds import FEW, Known, Moved, Off, Rest, norm, respond
from convexrough.gradients.system import Solution
from convexrough.roundoff import ROUNDOFF
from convexrough.shearing.judgement import StateErrors
from convexrough.sphere import annulus

#: Asperities with at least this part of the slope of a pressed contact count as sticking firmly. A
#: heuristic: any part gives a bound.
FIRM = 0.05


class Widths(NamedTuple):
    """How far widths x of slip annuli can be off.

    |dx| <= per |delta| + rounding, and `errors`; delta is u* less the image of u, of which
    || delta ||_h <= distance and |delta_i| <= each_i
    farthest, sticks : most that x* and 1 - x* can be;  softest : least that c* can be
    ceilings, most, fewest : most that C* and P* can be, and the least that P* can be
    """

    per: Array
    rounding: Array
    errors: Array
    each: Array
    distance: float
    farthest: Array
    sticks: Array
    softest: Array
    ceilings: Array
    most: Array
    fewest: Array
    slopes: Array
    sure: NDArray[np.bool_]

    @classmethod
    def of(cls, known: Known, state: Friction, near: StateErrors) -> Widths:
        h, P, b = 1.0 / known.slopes, known.loads, known.errors
        fewest, most = np.where(known.unsure, 1.0, P - b), P + b
        shifts, u = known.spread(near.shifts), known.spread(np.abs(state.increments))
        t = np.where(known.unsure, 1.0, np.minimum(u / np.maximum(P, fewest), 1.0))
        settled = known.spread(near.sliding & state.slides)
        thin = np.asarray(annulus.width_under(t))
        s = 1.0 - thin

        def about(distance: float) -> tuple[Array, Array, Array]:
            """Bounds on |delta|, and on s* from both sides."""
            each = distance * np.sqrt(known.slopes) + shifts
            each = each if known.apart is None else np.minimum(each, known.apart)
            off = each / fewest + 4 * ROUNDOFF * t
            low = np.cbrt(np.maximum(1.0 - t - off, 0.0)) - 4 * ROUNDOFF
            return each, np.maximum(low, 0.0), np.cbrt(np.minimum(1.0 - t + off, 1.0))

        def softest(low: Array) -> Array:
            stuck = np.where(settled | known.unsure, 0.0, low)
            return np.asarray(known.slopes * np.cbrt(fewest / most) * stuck)

        # T itself is rounded: what that moves is du/dT times it.
        distance = near.distance + float(np.sqrt(np.sum((shifts**2 * h)[known.sure])))
        least = float(softest(about(distance)[1])[known.sure].sum())
        if state.total:
            swayed = np.sqrt((1.0 + known.coupling) / (1.0 - known.convexity_number))
            distance += (
                8 * known.roundoff * state.total * (swayed / np.sqrt(least) if least else np.inf)
            )
        each, low, high = about(distance)
        with np.errstate(divide="ignore"):
            per = 1.0 / (fewest * (s * s + s * low + low * low))
        wholly = np.maximum(high - s, s - low) + 4 * ROUNDOFF
        errors = np.where(low > 0, np.minimum(per * each, wholly), wholly)
        rounded = 4 * known.roundoff * np.where(low > 0, t * per * fewest, 0.0)
        errors += rounded
        rounding = rounded + 4 * known.roundoff * thin
        if known.roundoff == ROUNDOFF:
            rounding += np.abs(known.spread(state.widths) - thin)
        per, errors, rounding = (
            np.where(settled | known.unsure, 0.0, each) for each in (per, errors, rounding)
        )
        x = np.maximum(known.spread(state.widths), thin) + errors + rounding
        return cls(
            per=per,
            rounding=rounding,
            errors=errors,
            each=each,
            distance=distance,
            farthest=np.where(known.unsure, 1.0, np.minimum(x, 1.0)),
            sticks=np.where(settled, 0.0, np.minimum(s + errors + rounding, 1.0)),
            softest=softest(low),
            ceilings=1.5 * most * h * np.where(known.unsure, 1.0, np.cbrt(most / fewest) ** 2),
            most=most,
            fewest=fewest,
            slopes=known.slopes,
            sure=known.sure,
        )

    def norm(self, weights: Array) -> float:
        """Bound on the 2-norm of w dx, of those that are sure."""
        weights = np.where(self.sure, weights, 0.0)
        with np.errstate(invalid="ignore"):
            scaled = np.where(weights > 0, weights * self.per * np.sqrt(self.slopes), 0.0)
        whole = norm(scaled, weights * self.errors, self.distance)
        return whole + float(np.linalg.norm(weights * self.rounding))

    def apart(self, known: Known, increments: Array) -> Array:
        """(N,) bounds on |u* - u|."""
        size = np.abs(increments)
        sure = size / np.maximum(self.fewest, known.loads) * known.errors + self.each
        return np.where(known.unsure, self.most + size, sure)

    def respond(
        self,
        known: Known,
        solution: Solution,
        per_width: Array,
        per_load: Array,
        *,
        off: Off,
        sizes: Array,
        loose: Array,
        total: float,
    ) -> Rest:
        """`bounds.respond` for m = per_width |dx| + per_load |P* - P|, of the unsure `loose`."""
        rounding = np.where(self.sure, FEW * known.roundoff * sizes, 0.0)
        firmly = self.sure & (self.softest > FIRM * self.slopes)

        def moved(which: NDArray[np.bool_], least: Array) -> float:
            scaled = np.where(which, 1.0 / np.sqrt(np.where(which, least, 1.0)), 0.0)
            found = self.norm(per_width * scaled) + known.of_loads(per_load * scaled)
            return found + float(np.linalg.norm(rounding * scaled))

        each = per_width * (self.errors + self.rounding) + per_load * known.errors + rounding
        return respond(
            known,
            solution,
            off,
            Moved(
                moved(firmly, self.softest),
                moved(self.sure & ~firmly, self.slopes),
                np.where(known.unsure, loose, each),
            ),
            least=float(self.softest.sum()),
            total=total,
        )

    def shifted(self, known: Known, rest: Rest) -> float:
        """Bound on || x* dY ||_(1/h), dY = dbeta - A dy - r."""
        x = np.where(self.sure, self.farthest, 0.0)
        return float(x.max(initial=0.0)) * rest.values + rest.shift * known.dual(x)
