"""The levels of a contact (normal solutions at given loads), and the units of friction results.

Levels are in the scaled units of the normal problem (`normal.problem`). The unit of shear forces is
f times that of loads, the unit of displacements c_t f times that of lengths, with the coefficient
of friction f and c_t = (2 - nu) / (2 (1 - nu)).

A rational number [force] identifies each level: its total load or, if the approach of the contact
is prescribed and its load P known to about thirty digits only, p - x for the level at P - x, with a
float64 number p close to P. The number 0 always identifies the level at the load 0.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import NDArray

from convexrough import checks
from convexrough.arithmetic.balls import TINY, Ball
from convexrough.arithmetic.pairs import PAIR_ROUNDOFF, Pair
from convexrough.arrays import Array, among_zeros, frozen
from convexrough.contact import Contact, levels_of
from convexrough.errors import InputError, ProofError
from convexrough.friction.order import MOST, Order, order_between
from convexrough.normal.level import Level, Rows, rows_of
from convexrough.roundoff import AT_THE_END, ROUNDOFF
from convexrough.scene.scene import Scene


class FrictionLevels:
    """The levels of a contact, by rational numbers; use `contact.cached(FrictionLevels)`."""

    def __init__(self, contact: Contact) -> None:
        self._levels, self.scene = contact.cached(levels_of), contact.scene
        self._named: dict[Fraction, Level] = {}
        self._orders: dict[tuple[frozenset[Fraction], int], Order] = {}
        self._ordered: Fraction | None = None  # order is proved from this load up to P
        self.top, problem = self._levels.top, self._levels.problem
        self.candidates, self.units = problem.candidates, problem.units  # may touch up to P
        self._prescribed = contact.prescribed_load
        found = float(self.top.load.value) * self.units.force
        self.load = Fraction(found if self._prescribed is None else self._prescribed)  # of `top`
        nu = Ball.exact(self.scene.material.poisson_ratio)
        self.coefficient = Ball.exact(checks.friction(self.scene.friction))
        self.ratio = (2.0 - nu) / ((1.0 - nu) * 2.0)
        self.force_unit = self.coefficient * self.units.force
        self.travel_unit = self.coefficient * self.ratio * self.units.length
        self.loss_unit = self.force_unit * self.travel_unit

    def height(self, force: float | Fraction) -> Fraction:
        """[force] T = Q / f for the shear force Q = `force` at the load P."""
        return height_at(self.load, force, self.scene)

    @property
    def proved(self) -> bool:
        """True if the normal solution at P is proved."""
        return self.top.box is not None

    @property
    def loads(self) -> Array:
        """(N,) [force] the loads at P of the solution: `Levels.loads`."""
        return self._levels.loads

    @property
    def presses(self) -> int:
        """The number of normal problems solved so far, including the one at P."""
        return 1 + self._levels.presses

    @property
    def known(self) -> list[Fraction]:
        """The loads of all levels found so far, and P."""
        return [*self._named, self.load]

    def at(self, load: Fraction) -> Level:
        """The level at a load from 0 to P. Raises ProofError if the load may be 0 or less, but is
        not named 0."""
        if load == self.load:
            return self.top
        if load not in self._named:
            ball = self._balls([load])[0] if load else Ball.exact(0.0)
            if load and not ball.positive:
                raise ProofError(
                    "the shear force is so near f P that gross sliding is not excluded, as the "
                    "load P is known up to rounding only: prescribe P, or the force f P"
                )
            self._named[load] = self._levels.at(ball)
        return self._named[load]

    def has(self, load: Fraction) -> bool:
        """True if the load of this level is proved positive: not for a number near 0 if P is
        rounded."""
        return load > 0 and bool(self._balls([load])[0].positive)

    def prepare(self, loads: Iterable[Fraction]) -> None:
        """Compute the levels at these loads together, if this is cheaper than one by one."""
        new = sorted({x for x in loads if x not in self._named and 0 < x < self.load})
        if len(new) > 1:
            found = zip(new, self._levels.prepare(self._balls(new)), strict=True)
            self._named |= {load: level for load, level in found if level is not None}

    def rows(self, loads: Sequence[Fraction]) -> Rows:
        """The levels at these loads, as the rows of arrays."""
        return rows_of([self.at(load) for load in loads])

    def displaced(self, displacement: float) -> Fraction:
        """[force] P - Q / f, for the shear force Q that displaces the bodies by X >= 0 [length].

        The approach at this load is D0(P) - X / (c_t f). Raises InputError beyond the X at which
        gross sliding starts.
        """
        farthest = (self.top.approach - self.at(Fraction(0)).approach) * self.travel_unit
        if not displacement <= (most := float(farthest.value)) * (1 + 1e-14):
            given, start = (repr(float(x)).removesuffix(".0") for x in (displacement, most))
            expected = f"at most X = {start}, at which it starts"
            raise InputError("displacement", found=f"{given}: gross sliding", expected=expected)
        if not (farthest - displacement).value > AT_THE_END * ROUNDOFF * displacement:
            return Fraction(0)
        lowered = Ball.exact(displacement) / self.travel_unit
        if displacement == 0.0:
            return self.load
        level = self._levels.at_approach(self.top.approach - lowered)
        drop = sum(Fraction(float(part)) for part in (self.top.load - level.load).mid)
        load = self.load - drop * Fraction(self.units.force)
        if load <= 0:  # where the load P is rounded
            load = Fraction(float(level.load.value) * self.units.force)
        self._named[load] = level
        return load

    def order(self, loads: Iterable[Fraction], most: int = MOST) -> Order:
        """What is proved about order (`friction.order`) between the least of these loads and P."""
        asked = frozenset({*loads, self.load})
        if self._ordered is not None and min(asked) >= self._ordered:
            return "proved"
        if (found := self._orders.get((asked, most))) is None:
            found = self._orders[asked, most] = order_between(self.at, asked, most)
        if found == "proved":
            self._ordered = min(asked)
        return found

    def depths(self, load: Fraction) -> Array:
        """(n,) [length] indentations of the candidates at a load, minus the gap where open."""
        return self.at(load).indentation.value * self.units.length

    def to_scene(self, values: NDArray[Any]) -> NDArray[Any]:
        """(..., N) the values (..., n) of the candidates, with 0 for all other asperities."""
        return among_zeros(values, self.candidates, len(self.scene), axis=-1)

    def _balls(self, loads: Sequence[Fraction]) -> Ball:
        """(k,) the total loads that these numbers identify, in scaled units."""
        if self._prescribed is not None:
            return exactly(loads).scaled(1.0 / self.units.force)
        return self.top.load - exactly([self.load - x for x in loads]).scaled(1 / self.units.force)


def height_at(load: Fraction, force: float | Fraction, scene: Scene) -> Fraction:
    """[force] T = Q / f as an exact fraction; P or -P if |T| and P differ only by rounding."""
    height = Fraction(force) / Fraction(checks.friction(scene.friction))
    if abs(load - abs(height)) > AT_THE_END * Fraction(ROUNDOFF) * load:
        return height
    return load if height > 0 else -load


def prove_order(contact: Contact, *, most: int = 1_000_000) -> Order:
    """What is proved about order at the loads between 0 and the load of `contact`.

    docs/theory/states.md, "Order", defines order and the results "proved", "proved for one step"
    and "fails". Later results for this contact reuse the proof. If contacts are far apart, or on a
    lattice and not too crowded (theorems 1 and 2 of that page), the proof takes no time at any
    size. Otherwise it needs weights for the touching asperities; on a lattice only for those near
    large contacts and at the rim. Other functions try this for at most 20,000, as for more it
    takes seconds.

    most : largest number of asperities for which weights are computed

    Raises InputError if the scene has no friction.

    >>> cr.prove_order(contact)
    'proved'
    """
    checks.instance("contact", contact, Contact)
    return contact.cached(FrictionLevels).order([Fraction(0)], checks.whole("most", most, 0))


def exactly(values: Sequence[Fraction]) -> Ball:
    """(k,) balls that contain these rational numbers."""
    pairs = [Pair.nearest(value) for value in values]
    high, low = (np.array([pair[part] for pair in pairs]) for part in (0, 1))
    return Ball.around(Pair(high, low), PAIR_ROUNDOFF * np.abs(high) + TINY)


def rounded(ball: Ball) -> tuple[Array, Array]:
    """The centres of balls rounded to float64, and bounds on the errors of the rounded centres."""
    return frozen(np.array(ball.value)), frozen(np.array(ball.error))
