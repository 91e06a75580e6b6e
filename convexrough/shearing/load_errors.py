"""What the certificate of a contact says of its loads, as friction needs it: known to some digits.

Each load is known to its certified bound b. All of them together are known better than that: by
docs/theory/shear-errors.md, "The pressed loads". In the letters of that page:

    loads P, errors b, distance || P* - P ||_H    stiffness h of H, convexity_number theta
    coupling Lambda                               reach_i (sum_j A_ij^2 / h_j)^(1/2)

An asperity is sure if it is proved to touch and its load is known to a tenth; loose if it is not. A
stray has no load here and is not proved open.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array, Indices
from convexrough.influence import couple
from convexrough.influence.coupling import Coupling, error_reach
from convexrough.influence.shells import fitted_shells
from convexrough.normal.boxes import FIT_FROM, convex_margin, crowded_margin
from convexrough.normal.problem import FITTED
from convexrough.normal.residual import SUM_ROUNDOFFS
from convexrough.roundoff import ROUNDOFF, SAFETY
from convexrough.shearing.problem import TangentialProblem

#: Margins of convexity that Cholesky's factorisation is tried with, the best first.
MARGINS = (0.6, 0.3, 0.1, 1e-2, 1e-3)


class LoadErrors(NamedTuple):
    """What the normal certificate says of the loads P, in own units."""

    errors: Array  # (n,) b
    sure: NDArray[np.bool_]  # (n,) proved to touch, and known to some digits
    relative: Array  # (n,) b / P of those, 0 of the others
    stray: float  # most that asperities with no load here, but not proved open, carry in all
    stray_effect: Array  # (n,) most that this moves each of the others
    stray_among: float  # b'A b of their bounds
    loose_effect: Array  # (n,) most that those not sure move each, wherever |u| <= P leaves them
    stiffness: Array  # (n,) h, the least local part of the Hessian; infinite where not sure
    convexity_number: float  # theta
    coupling: float  # the largest eigenvalue of H^-1/2 A H^-1/2 is no larger
    reach: Array  # (n,) how far an error by 1 in the norm of H moves each
    distance: float  # || P - P* ||_H of those that are sure

    @classmethod
    def of(cls, problem: TangentialProblem) -> LoadErrors:
        """Those of a problem, which keeps them."""
        return problem.keep(cls._judge)

    @classmethod
    def _judge(cls, problem: TangentialProblem) -> LoadErrors:
        certificate, P, A = problem.certificate, problem.loads, problem.influence
        errors = certificate.load_errors[problem.touching] / problem.units.force
        sure = certificate.status[problem.touching] == "contact"
        sure &= errors < 0.1 * P
        strays = _strays(problem)
        most = certificate.load_errors[strays] / problem.units.force
        effect, among = _effects(problem, strays, most)
        h = np.where(sure, 2.0 / 3.0 * problem.ceilings / (P + errors), np.inf)
        loose = np.where(sure, 0.0, 2.0 * P + errors)
        by_component = float(np.sqrt(np.sum(np.where(sure, h, 0.0) * errors**2)))
        return cls(
            errors=errors,
            sure=sure,
            relative=np.where(sure, errors / P, 0.0),
            stray=float(most.sum()),
            stray_effect=effect,
            stray_among=among,
            loose_effect=couple_above(problem, loose) if loose.any() else loose,
            stiffness=h,
            convexity_number=_convexity_number(problem, h),
            # Collatz and Wielandt: by the trial vector H^-1/2.
            coupling=float(couple_above(problem, 1.0 / h).max(where=sure, initial=0.0)),
            reach=error_reach(A, A.scale, 1.0 / h),
            distance=min(by_component, _distance(problem, errors, effect)) * (1 + SAFETY),
        )

    def image_distances(self, loads: Array, increments: Array) -> Array:
        """How far each u can be from its image on the true loads; |u| <= P is all known of some."""
        size = np.abs(increments)
        return size * self.relative + np.where(self.sure, 0.0, loads + self.errors + size)

    def image_norm(self, used: Array) -> float:
        """Bound on || t (P* - P) ||_H for parts 0 <= t <= 1 (n,) of the loads.

        The largest t count by components, all others by the norm.
        """
        order = np.argsort(used)[::-1]
        t = np.append(used[order], 0.0)
        h = np.where(self.sure, self.stiffness, 0.0)
        largest = np.append(0.0, np.cumsum((h * (used * self.errors) ** 2)[order]))
        return float(np.sqrt((largest + (t * self.distance) ** 2).min())) * (1 + SAFETY)


def couple_above(problem: TangentialProblem, values: Array) -> Array:
    """(..., n) upper bounds on A times values, one state or m, that are not negative."""
    return _above(problem.couple(values), problem.influence, values)


def _above(product: Array, coupling: Coupling, values: Array) -> Array:
    """The product of values that are not negative, and its rounding."""
    above = np.maximum(product, 0.0)
    for row, each in zip(np.atleast_2d(above), np.atleast_2d(values), strict=True):
        row += coupling.rounding(each).of(row)
    return above


def _convexity_number(problem: TangentialProblem, stiffness: Array) -> float:
    """theta: H + A >= (1 - theta) H, by the better of two kinds of shells, or else as in boxes.

    Among the sure: of crowded contacts by Cholesky's factor or by shells that overlap.
    """
    theta = float((problem.shells / stiffness).max())
    if theta > FIT_FROM:
        radii = (np.pi / 2.0) * problem.influence.scale / stiffness
        fitted = fitted_shells(problem.influence, radii, FITTED)
        theta = min(theta, float((fitted / stiffness).max()))
    theta *= 1 + SAFETY
    if theta < 1:
        return theta
    margin = convex_margin(problem.influence, stiffness, MARGINS)
    if not margin > 0:
        sure = np.flatnonzero(np.isfinite(stiffness))
        margin = crowded_margin(problem.influence.among(sure), stiffness[sure])
    return min(theta, 1.0 - margin)


def _strays(problem: TangentialProblem) -> Indices:
    """Asperities of the scene without load here that are not proved to be open."""
    possible = problem.certificate.status != "open"
    possible[problem.touching] = False
    return np.flatnonzero(possible)


def _effects(problem: TangentialProblem, strays: Indices, most: Array) -> tuple[Array, float]:
    """(n,) most that loads of up to `most` elsewhere do to the loaded asperities; and b'A b."""
    if len(strays) == 0:
        return np.zeros(len(problem)), 0.0
    scene = problem.scene
    apart = couple(scene, strays, problem.influence.scale, problem.influence.name)
    coupling = apart.onto(scene.contact_points[problem.touching])
    among = float(most @ _above(apart.apply(most), apart, most)) * (1 + SAFETY)
    return _above(coupling.apply(most), coupling, most), among


def _distance(problem: TangentialProblem, errors: Array, stray_effect: Array) -> float:
    """|| P* - P ||_H, or infinite: docs/theory/shear-errors.md, "The pressed loads"."""
    P, ceilings, length = problem.loads, problem.ceilings, problem.units.length
    softening = np.cbrt(P / (P + errors))
    h = softening / problem.stiffest
    theta = _convexity_number(problem, h)
    if not theta < 1:
        return np.inf
    displacement, noise = problem.couple(P), problem.influence.rounding(P)
    scene, approach = problem.scene, problem.certificate.approach / length
    gap = ceilings + displacement - scene.offsets[problem.touching] / length - approach
    rounding = noise.relative * (np.maximum(displacement, 0.0) + noise.norm)
    rounding += scene.offset_errors[problem.touching] / length
    rounding += SUM_ROUNDOFFS * ROUNDOFF * (ceilings + np.abs(displacement) + abs(approach))
    residual = np.abs(gap) + rounding + stray_effect
    norm = float(np.sqrt(np.sum(residual**2 / h))) + noise.norm / np.sqrt(float(h.min()))
    norm /= np.sqrt(1.0 - theta)  # || d ||_N
    if problem.certificate.approach_error > 0:
        lost = (1.0 - float(softening.min())) / (1.0 - theta)  # N >= (1 - lost) N at P itself
        if not lost < 1:
            return np.inf
        flat = np.sqrt(_flatness(problem, theta) / (1.0 - lost))
        norm += problem.certificate.approach_error / length * flat
    return float(norm / np.sqrt(1.0 - theta))


def _flatness(problem: TangentialProblem, theta: float) -> float:
    """Bound on 1'N^-1 1, N = H + A at P: docs/theory/shear-errors.md, "The pressed loads".

    For any x, with r = 1 - N x:  1'N^-1 1 = 1'x + r'x + r'N^-1 r.  Elastic shares make r small.
    """
    q, H = problem.elastic, 1.0 / problem.stiffest
    coupled = problem.couple(q)
    level = H * q + coupled
    mean = float(level.mean())
    rounding = problem.influence.rounding(q).of(couple_above(problem, np.abs(q)))
    rounding += SUM_ROUNDOFFS * ROUNDOFF * (np.abs(H * q) + np.abs(coupled))
    r = float((np.abs(level - mean) + rounding).max()) / mean
    first = (float(q.sum()) + r * float(np.abs(q).sum())) / mean
    return (first + r**2 * float(problem.stiffest.sum()) / (1.0 - theta)) * (1 + SAFETY)
