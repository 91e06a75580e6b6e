"""Proved bounds on derivatives by heights: docs/theory/gradient-bounds.md. Own units.

The letters of that page, and the names here:

    h, theta, Lambda        stiffness, convexity_number, coupling of Known
    U, c+                   unsure, slopes
    pi, delta, dx           `of_loads`, `_Widths.norm`
    m, e, kappa, rho        `respond`
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array, Indices, among_zeros
from convexrough.gradients.system import Solution
from convexrough.influence import Influence
from convexrough.influence.choice import couple
from convexrough.influence.shells import shells
from convexrough.roundoff import ROUNDOFF, SAFETY
from convexrough.shearing.load_errors import LoadErrors
from convexrough.shearing.problem import TangentialProblem
from convexrough.sphere import hertz

#: For loads within a tenth: |(P* / P)^(+-1/3) - 1| over |P* - P| / P is at most this.
CUBE_ROOT = 0.37

#: Roundoffs of a sum or product of a few terms.
FEW = 16


class Known(NamedTuple):
    """What is known of the pressed state: N loaded asperities, and those that might be loaded.

    places    : (N,) in the scene;  loaded : (N,) which of them the problem has
    unsure    : (N,) U: not proved to touch, or known to no digit
    loads     : (N,) P;  errors : (N,) b
    slopes    : (N,) c+, the most that c0* can be;  stiffness : (N,) h = 1 / c+
    distance  : || P* - P ||_h of those that are sure
    roundoff  : of the numbers that are judged
    apart     : (N,) on |u* - t P*| one by one, where more is known than the norm says
    """

    influence: Influence
    places: Indices
    loaded: NDArray[np.bool_]
    unsure: NDArray[np.bool_]
    loads: Array
    errors: Array
    slopes: Array
    distance: float
    convexity_number: float
    coupling: float
    roundoff: float = ROUNDOFF
    apart: Array | None = None

    @classmethod
    def of(cls, problem: TangentialProblem) -> Known | None:
        """That of a problem, which keeps it; None where nothing is proved."""
        return problem.keep(cls._judge)

    @classmethod
    def _judge(cls, problem: TangentialProblem) -> Known | None:
        certificate, scene = problem.certificate, problem.scene
        if certificate.scope == "none":
            return None
        judged = LoadErrors.of(problem)
        possible = certificate.status != "open"
        possible[problem.touching] = True
        places = np.flatnonzero(possible)
        loaded = np.isin(places, problem.touching)
        unsure = ~loaded
        unsure[loaded] = ~judged.sure
        errors = certificate.load_errors[places] / problem.units.force
        loads = among_zeros(problem.loads, np.flatnonzero(loaded), len(places))
        modulus, radii = scene.material.contact_modulus, scene.relative_radii[places]
        k = hertz.local_coefficient(modulus, radii) * problem.units.local
        slopes = 1.5 * np.cbrt(loads + errors) / k * (1 + SAFETY)
        slopes[~unsure] = 1.0 / judged.stiffness[judged.sure]
        influence, theta = problem.influence, judged.convexity_number
        if len(places) > len(problem):
            influence = couple(scene, places, influence.scale, influence.name)
        if unsure.any():
            theta = float((shells(influence) * slopes).max()) * (1 + SAFETY)
        if not theta < 1 or not np.isfinite(slopes).all():
            return None
        reach = float(above(influence, slopes).max(initial=0.0))
        return cls(influence, places, loaded, unsure, loads, errors, slopes,
                   judged.distance, theta, reach)  # fmt: skip

    @property
    def sure(self) -> NDArray[np.bool_]:
        return ~self.unsure

    def spread(self, values: NDArray[Any]) -> NDArray[Any]:
        """(N,) of values of the loaded asperities."""
        return among_zeros(values, np.flatnonzero(self.loaded), len(self.places))

    def dual(self, values: Array) -> float:
        """|| v ||_(1/h) of those that are sure."""
        return float(np.sqrt(np.sum(np.where(self.unsure, 0.0, self.slopes) * values**2)))

    def of_loads(self, weights: Array) -> float:
        """Bound on the 2-norm of w (P* - P), of those that are sure."""
        each = np.where(self.unsure, 0.0, weights * self.errors)
        scaled = np.where(self.unsure, 0.0, weights * np.sqrt(self.slopes))
        return norm(scaled, each, self.distance)

    def rounding(self, solution: Solution, forces: Array, sizes: Array, total: float | None) -> Off:
        """That of a system solved in float64: y, and the sizes of what was coupled to find Y."""
        magnitude, off = above(self.influence, sizes), self.influence.rounding(sizes)
        each = off.relative * magnitude + FEW * ROUNDOFF * (magnitude + abs(solution.shift))
        missing = 0.0 if total is None else abs(float(forces.sum()) - total)
        return Off(each, off.norm, missing + len(forces) * ROUNDOFF * float(sizes.sum()))


class Off(NamedTuple):
    """What rounding leaves of a system.

    each    : (N,) bounds on the error of its defect, less a remainder;  norm : 2-norm of that
    missing : bound on what the sum of y misses where it is prescribed
    """

    each: Array
    norm: float
    missing: float


class Moved(NamedTuple):
    """Bounds on m = db + dc Y, what b and c change at this Y.

    firm  : || m ||_(1/c*) of some that are sure to stick;  loose : || m ||_h of the others, but for
        the unsure;  each : (N,) |m|
    """

    firm: float
    loose: float
    each: Array


class Rest(NamedTuple):
    """How far a solution of the system can be from that of the true state.

    values : || A dy ||_(1/h) + || r ||_(1/h), by which Y changes but for its shift
    shift  : of beta
    forces : (N,) of y = b + c Y;  unsure : (N,) of Y of the unsure, 0 of the others
    """

    values: float
    shift: float
    forces: Array
    unsure: Array


def respond(
    known: Known,
    solution: Solution,
    off: Off,
    moved: Moved,
    *,
    least: float,
    total: float | None,
    residual: float = 0.0,
    residual_unsure: Array | None = None,
) -> Rest:
    """The lemma of the page: y* - y = m + e, with Y = beta - A y + r.

    least    : a lower bound on sum c* of those that are sure
    total    : sum y, None where it is not prescribed
    residual : on || r ||_(1/h) beyond the defect and rounding;  residual_unsure : (N,) on |r|
    """
    unsure, theta, reach = known.unsure, known.convexity_number, known.coupling
    kappa = 0.5 * np.sqrt((reach + theta) / (1.0 - theta)) + theta / (1.0 - theta)
    rho = max(reach / (1.0 + reach), theta / (1.0 - theta))
    defect = np.abs(known.spread(solution.defect)) + off.each
    largest = float(np.sqrt(known.slopes[known.sure].max(initial=0.0)))
    apart = defect + off.norm + (0.0 if residual_unsure is None else residual_unsure)
    strayed = np.where(unsure, moved.each + known.slopes * apart, 0.0)
    felt = known.dual(above(known.influence, strayed)) if strayed.any() else 0.0
    r = residual + known.dual(defect) + off.norm * largest + felt
    lost, root = 0.0, float(np.sqrt(least)) or np.nan
    if total is not None:  # what the sum of m misses is shared out in proportion to c*
        lost = moved.loose * float(np.sqrt(known.slopes[known.sure].sum())) + float(strayed.sum())
        lost += off.missing
    other = moved.loose + (lost / root if lost else 0.0)
    e = rho * moved.firm + kappa * other + r / (1.0 - theta)
    values = kappa * moved.firm + reach * (1.0 + kappa) * other + (1.0 + kappa) * r
    shift = 0.0
    if total is not None:
        gone = lost + e * float(np.sqrt(known.slopes)[unsure].sum())
        shift = (values + moved.firm + gone / root) / root
    each = moved.each + np.sqrt(known.slopes) * (e + lost / root + moved.firm) + strayed
    if not np.isfinite(values + shift):
        return Rest(np.inf, np.inf, np.full(len(each), np.inf), np.full(len(each), np.inf))
    if unsure.any():
        apart = shift + above(known.influence, each) + apart
    return Rest(values, shift, each * (1 + SAFETY), np.where(unsure, apart, 0.0))


def above(influence: Influence, values: Array) -> Array:
    """(n,) upper bounds on A times values that are not negative."""
    product = np.maximum(influence.apply(values), 0.0)
    return product + influence.rounding(values).of(product)


def norm(weights: Array, each: Array, whole: float) -> float:
    """Bound on || w v || for |w_i v_i| <= each_i and || v || <= whole.

    The largest weights count by components, all others by the norm.
    """
    order = np.argsort(weights)[::-1]
    w = np.append(weights[order], 0.0)
    first = np.append(0.0, np.cumsum(each[order] ** 2))
    with np.errstate(invalid="ignore"):
        squares = first + (w * whole) ** 2
    return float(np.sqrt(np.nanmin(squares))) * (1 + SAFETY)
