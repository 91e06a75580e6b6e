"""A pressed contact and A to twice the digits: docs/theory/gradient-bounds-twice.md."""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from convexrough.arrays import Array
from convexrough.contact import Contact
from convexrough.gradients.bounds import Known, above
from convexrough.gradients.origin import pressed
from convexrough.gradients.system import System
from convexrough.influence import Influence
from convexrough.normal.residual import INVERSE_PI
from convexrough.normal.sup_norm import SupNorm
from convexrough.roundoff import ROUNDOFF, SAFETY
from convexrough.shearing.load_errors import LoadErrors
from convexrough.shearing.problem import TangentialProblem
from convexrough.twofold import Twofold, exact_sum, square_sum, whole

#: What a chain of operations on twofold numbers loses, over the sizes of what is added up: of 2^15
#: operations, more than any here and than the differences of points near to each other need.
SHARP = 2.0**-85

#: Asperities at most whose matrix is stored in twofold numbers, and pairs looked at together.
MOST, ROWS = 3000, 2**15

#: Points may be as many times farther away than their nearest neighbours.
FARTHEST = 2.0**9

#: Newton's steps from float64: digits double with each.
STEPS = 4

#: Loads must then be known to this part of themselves.
CLOSE = 1e-6

#: How often a bound on a multiplier, and that on the distance, sharpen each other.
ROUNDS = 8


@dataclass(frozen=True, eq=False)
class SharpCoupling:
    """A of the loaded asperities, for twofold forces.

    entries : (n, n) A itself; None of too many asperities, where the operator has sharp sums
    scale   : 1 / (pi E*)
    """

    influence: Influence
    scale: Twofold
    entries: Twofold | None

    @classmethod
    def of(cls, problem: TangentialProblem) -> SharpCoupling | None:
        """None where the operator knows no more digits."""
        units, modulus = problem.units, problem.scene.material.contact_modulus
        exact = Fraction(units.force) / Fraction(units.length) / Fraction(modulus)
        scale = Twofold.nearest(INVERSE_PI * exact)
        points = contact_points(problem) if len(problem) <= MOST else None
        if points is not None:
            return cls(problem.influence, scale, scale * inverse_distances(points))
        known = problem.influence.sums(problem.loads) is not None
        return cls(problem.influence, scale, None) if known else None

    def apply(self, values: Twofold) -> tuple[Twofold, Array]:
        """A v, and bounds on what each component is off by."""
        if self.entries is None:
            return self._by_sums(values)
        n = len(values.high)
        product, rows = Twofold(np.empty(n), np.empty(n)), max(1, ROWS // n)
        for start in range(0, n, rows):
            some = slice(start, start + rows)
            part = (Twofold(*(each[some] for each in self.entries)) * values).total()
            product.high[some], product.low[some] = part
        return product, 2.0 * SHARP * above(self.influence, np.abs(values.high))

    def _by_sums(self, values: Twofold) -> tuple[Twofold, Array]:
        sums = self.influence.sums(values.high)
        if sums is None:
            return values, np.full(len(values.high), np.inf)
        found = Twofold(*exact_sum(sums.whole, sums.rest))
        product = Twofold(found.high * sums.unit, found.low * sums.unit) * self.scale
        off = sums.error * sums.unit * float(self.scale.high) * (1 + SAFETY)
        low, sizes = self.influence.apply(values.low), np.abs(values.low)
        rest = self.influence.rounding(sizes).of(self.influence.apply(sizes))
        return product + whole(low), off + rest + SHARP * np.abs(product.high)


class Pressed(NamedTuple):
    """A pressed contact to twice the digits, own units.

    given   : with the loads that were computed;  problem : with the first halves of these
    known   : that of bounds, at these loads
    reach   : (n,) how far an error by 1 in the norm of h moves each
    """

    given: TangentialProblem
    problem: TangentialProblem
    coupling: SharpCoupling
    loads: Twofold
    coefficients: Twofold
    known: Known
    reach: Array

    @property
    def ceilings(self) -> Twofold:
        root = self.loads.cube_root()
        return self.coefficients * root * root

    @property
    def stiffest(self) -> Twofold:
        return whole(1.5) * self.loads.over(self.ceilings)

    @classmethod
    def of(cls, contact: Contact) -> Pressed | None:
        """That of a contact, which keeps it; None where not all are proved to touch, or to be open.

        And where no more digits are to be had.
        """
        return contact.keep(cls._refine)

    @classmethod
    def _refine(cls, contact: Contact) -> Pressed | None:
        problem = pressed(contact)
        known = Known.of(problem)
        if known is None or known.unsure.any():
            return None
        coupling = SharpCoupling.of(problem)
        if coupling is None:
            return None
        k = coefficients(problem)
        P, residual, missing, shift = _newton(contact, problem, coupling, k)
        most, fewest = known.loads + known.errors, known.loads - known.errors
        reach = LoadErrors.of(problem).reach
        rates = np.cbrt(most / fewest) / np.sqrt(known.slopes) + reach
        distance, shift = balanced(known, known.dual(residual), residual, missing, shift, rates)
        errors, away = distance * np.sqrt(known.slopes), np.abs((P + whole(-problem.loads)).high)
        sup = SupNorm.of(problem.influence, 1.0 / known.slopes)
        if sup is not None:
            apart = residual + shift
            errors = np.minimum(errors, sup.load_errors(apart, float(apart.max())))
        near = (away <= known.errors + 8 * ROUNDOFF * known.loads).all()
        if not near or not (errors < CLOSE * known.loads).all():
            return None
        root = P.cube_root()
        ceilings = (k * root * root).high
        sharper = known._replace(
            loads=P.high,
            errors=errors,
            slopes=1.5 * (P.high + errors) / ceilings * (1 + SAFETY),
            distance=distance,
            roundoff=SHARP,
        )
        there = replace(problem, loads=P.high, ceilings=ceilings)
        return cls(problem, there, coupling, P, k, sharper, reach)


def _newton(
    contact: Contact, problem: TangentialProblem, coupling: SharpCoupling, k: Twofold
) -> tuple[Twofold, Array, float, float]:
    """P; bounds on the residual, on what the loads miss their total by, and on |D0* - D0|."""
    d, load, length = offsets(problem), contact.prescribed_load, problem.units.length
    total = None if load is None else load / problem.units.force
    given = contact.approach / length
    P, level = whole(problem.loads), whole(given)
    system = System(problem, problem.stiffest)
    for step in range(STEPS):
        root = P.cube_root()
        moved, off = coupling.apply(P)
        local = k * root * root
        left = local + moved + -(d + level)
        missing = 0.0 if total is None else rounded(P.total() + whole(-total))
        if step == STEPS - 1 or (np.abs(left.high) <= off).all():
            break
        more = system.solve(-left.high, None if total is None else -missing)
        P, level = P + whole(problem.stiffest * more.values), level + whole(more.shift)
    scene, which = problem.scene, problem.touching
    sizes = (np.abs(scene.asperities.heights) + scene.drops)[which] / length
    sizes += local.high + np.abs(moved.high) + abs(level.high)
    missing = abs(missing) + (0.0 if total is None else SHARP * total)
    shift = contact.certificate.approach_error / length + abs(rounded(level + whole(-given)))
    return P, np.abs(left.high) + off + SHARP * sizes, missing, shift


def balanced(
    known: Known, norm: float, residual: Array, missing: float, shift: float, rates: Array
) -> tuple[float, float]:
    """D and |beta| of (1 - theta) D^2 <= norm D + |beta| missing, |beta| <= residual + rate D.

    shift : a bound on |beta|;  rates : (n,) infinite where the asperity says nothing of beta
    """
    margin, D = 1.0 - known.convexity_number, np.inf
    for _ in range(ROUNDS):
        D = norm / margin + np.sqrt(shift * missing / margin)
        shift = min(shift, float((residual + rates * D).min()))
    return D * (1 + SAFETY), shift * (1 + SAFETY)


def coefficients(problem: TangentialProblem) -> Twofold:
    """(n,) k = (9 (1 / R + 1 / rho) / 16 E*^2)^(1/3)."""
    scene, one = problem.scene, whole(1.0)
    modulus = whole(scene.material.contact_modulus)
    rho = whole(scene.asperities.tip_radii[problem.touching])
    curvature = one.over(whole(scene.sphere_radius)) + one.over(rho)
    k = (whole(9.0 / 16.0) * curvature.over(modulus * modulus)).cube_root()
    return k * whole(problem.units.local)


def offsets(problem: TangentialProblem) -> Twofold:
    """(n,) d = z - r^2 / (2 far)."""
    scene, which = problem.scene, problem.touching
    x, y = scene.asperities.positions[which].T / problem.units.length
    far = _far(problem)
    unit = whole(1.0 / problem.units.length)
    drops = square_sum(x, y).over((far + far) * unit)
    return whole(scene.asperities.heights[which] / problem.units.length) + -drops


def contact_points(problem: TangentialProblem) -> tuple[Twofold, Twofold] | None:
    """x and y [length]; None where neighbours are too close to each other for twofold numbers."""
    scene, which = problem.scene, problem.touching
    points, nearest = scene.asperities.positions[which], problem.influence.separations()
    if np.abs(points).max(initial=0.0) > FARTHEST * float(nearest.min(initial=np.inf)):
        return None
    x, y = (whole(np.ascontiguousarray(points[:, i])) for i in (0, 1))
    if scene.geometry == "summit":
        return x, y
    shrink = whole(scene.sphere_radius).over(_far(problem))
    return x * shrink, y * shrink


def inverse_distances(points: tuple[Twofold, Twofold]) -> Twofold:
    """(n, n) 1 / r, 0 on the diagonal."""
    n = len(points[0].high)
    found, rows = Twofold(np.empty((n, n)), np.empty((n, n))), max(1, ROWS // n)
    for start in range(0, n, rows):
        some = slice(start, min(start + rows, n))
        away = [Twofold(v.high[some, None], v.low[some, None]) + -v for v in points]
        squares = away[0] * away[0] + away[1] * away[1]
        itself = np.arange(some.start, some.stop)
        squares.high[itself - start, itself] = 1.0
        inverse = whole(1.0).over(squares.root())
        for part in inverse:
            part[itself - start, itself] = 0.0
        found.high[some], found.low[some] = inverse
    return found


def _far(problem: TangentialProblem) -> Twofold:
    """(n,) [length] R, or R + rho in the geometry "closest"."""
    scene, rho = problem.scene, problem.scene.asperities.tip_radii[problem.touching]
    further = rho if scene.geometry == "closest" else np.zeros(len(rho))
    return Twofold(*exact_sum(np.full(len(rho), scene.sphere_radius), further))


def rounded(value: Twofold) -> float:
    """To float64."""
    return float(value.high) + float(value.low)
