"""What the certificate of a contact says of its loads, as friction needs it: known to some digits.

Each load is known to its certified bound b. All of them together are known better than that: with
d = P* - P, the gaps e that the loads leave, h = 2/3 k (P + b)^(-1/3), H = diag(h) and N = H + A,
complementarity gives

    d'N d <= d'e,    so    || d ||_H <= || e ||_{H^-1} / (1 - theta),

as in docs/theory/certificate.md, once more for those that touch. Where the approach D0 is known to
an error only (load control), that adds  |dD0| || 1 ||_{N^-1}  to || d ||_N.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array, Indices
from convexrough.contact import Contact
from convexrough.influence import couple
from convexrough.influence.coupling import error_reach
from convexrough.influence.shells import fitted_shells
from convexrough.normal.judgement import FIT_FROM, SUM_ROUNDOFFS
from convexrough.normal.problem import FITTED
from convexrough.roundoff import ROUNDOFF, SAFETY
from convexrough.shearing.problem import TangentialProblem


class Known(NamedTuple):
    """What the normal certificate says of the loads P, in own units."""

    errors: Array  # (n,) b
    sure: NDArray[np.bool_]  # (n,) proved to touch, and known to some digits
    relative: Array  # (n,) b / P of those, 0 of the others
    stray: float  # most that asperities with no load here, but not proved open, carry in all
    stray_effect: Array  # (n,) most that this moves each of the others
    loose_effect: Array  # (n,) most that those not sure move each, wherever |u| <= P leaves them
    stiffness: Array  # (n,) h, the least local part of the Hessian; infinite where not sure
    convexity_number: float  # theta
    coupling: float  # the largest eigenvalue of H^-1/2 A H^-1/2 is no larger
    reach: Array  # (n,) how far an error by 1 in the norm of H moves each
    distance: float  # || P - P* ||_H of those that are sure

    @classmethod
    @lru_cache(maxsize=4)
    def of(cls, problem: TangentialProblem, contact: Contact) -> Known:
        certificate, P, A = contact.certificate, problem.loads, problem.influence
        errors = certificate.load_errors[problem.touching] / problem.units.force
        sure = certificate.status[problem.touching] == "contact"
        sure &= errors < 0.1 * P
        strays = np.flatnonzero((contact.loads == 0) & (certificate.status != "open"))
        most = certificate.load_errors[strays] / problem.units.force
        effect = _effect(problem, contact, strays, most)
        h = np.where(sure, 2.0 / 3.0 * problem.ceilings / (P + errors), np.inf)
        loose = np.where(sure, 0.0, 2.0 * P + errors)
        by_component = float(np.sqrt(np.sum(np.where(sure, h, 0.0) * errors**2)))
        return cls(
            errors=errors,
            sure=sure,
            relative=np.where(sure, errors / P, 0.0),
            stray=float(most.sum()),
            stray_effect=effect,
            loose_effect=couple_above(problem, loose) if loose.any() else loose,
            stiffness=h,
            convexity_number=_convexity_number(problem, h),
            # Collatz and Wielandt: by the trial vector H^-1/2.
            coupling=float(couple_above(problem, 1.0 / h).max(where=sure, initial=0.0)),
            reach=error_reach(A, A.scale, 1.0 / h),
            distance=min(by_component, _distance(problem, contact, errors, effect)) * (1 + SAFETY),
        )

    def moved(self, loads: Array, increments: Array) -> Array:
        """How far each u can be from its image on the true loads; |u| <= P is all known of some."""
        size = np.abs(increments)
        return size * self.relative + np.where(self.sure, 0.0, loads + self.errors + size)

    def scaled(self, shares: Array) -> float:
        """Bound on || t (P - P*) ||_H for shares 0 <= t <= 1 (n,) of the loads.

        The largest t count by components, all others by the norm.
        """
        order = np.argsort(shares)[::-1]
        t = np.append(shares[order], 0.0)
        h = np.where(self.sure, self.stiffness, 0.0)
        largest = np.append(0.0, np.cumsum((h * (shares * self.errors) ** 2)[order]))
        return float(np.sqrt((largest + (t * self.distance) ** 2).min())) * (1 + SAFETY)


def couple_above(problem: TangentialProblem, values: Array) -> Array:
    """(n,) upper bounds on A times values (n,) that are not negative."""
    product = np.maximum(problem.couple(values), 0.0)
    return product + problem.influence.rounding(values).of(product)


def _convexity_number(problem: TangentialProblem, stiffness: Array) -> float:
    """theta: H + A >= (1 - theta) H, by the better of two kinds of shells."""
    theta = float((problem.shells / stiffness).max())
    if theta > FIT_FROM:
        radii = (np.pi / 2.0) * problem.influence.scale / stiffness
        fitted = fitted_shells(problem.influence, radii, FITTED)
        theta = min(theta, float((fitted / stiffness).max()))
    return theta * (1 + SAFETY)


def _effect(problem: TangentialProblem, contact: Contact, strays: Indices, most: Array) -> Array:
    """(n,) bounds on what loads of up to `most` elsewhere do to the loaded asperities."""
    if len(strays) == 0:
        return np.zeros(len(problem))
    scene = contact.scene
    apart = couple(scene, strays, problem.influence.scale, contact.influence)
    coupling = apart.onto(scene.contact_points[problem.touching])
    effect = np.maximum(coupling.apply(most), 0.0)
    return effect + coupling.rounding(most).of(effect)


def _distance(
    problem: TangentialProblem, contact: Contact, errors: Array, stray_effect: Array
) -> float:
    """|| P - P* ||_H; infinite where convexity does not show it."""
    P, ceilings, length = problem.loads, problem.ceilings, problem.units.length
    bent = np.cbrt(P / (P + errors))
    h = bent / problem.stiffest
    theta = _convexity_number(problem, h)
    if not theta < 1:
        return np.inf
    displacement, noise = problem.couple(P), problem.influence.rounding(P)
    scene, approach = contact.scene, contact.certificate.approach / length
    gap = ceilings + displacement - scene.offsets[problem.touching] / length - approach
    rounding = noise.relative * (np.maximum(displacement, 0.0) + noise.norm)
    rounding += scene.offset_errors[problem.touching] / length
    rounding += SUM_ROUNDOFFS * ROUNDOFF * (ceilings + np.abs(displacement) + abs(approach))
    residual = np.abs(gap) + rounding + stray_effect
    norm = float(np.sqrt(np.sum(residual**2 / h))) + noise.norm / np.sqrt(float(h.min()))
    norm /= np.sqrt(1.0 - theta)  # || d ||_N
    if contact.certificate.approach_error > 0:
        bend = (1.0 - float(bent.min())) / (1.0 - theta)  # N >= (1 - bend) N at P itself
        if not bend < 1:
            return np.inf
        flat = np.sqrt(_flatness(problem, theta) / (1.0 - bend))
        norm += contact.certificate.approach_error / length * flat
    return float(norm / np.sqrt(1.0 - theta))


def _flatness(problem: TangentialProblem, theta: float) -> float:
    """Bound on 1'N^-1 1, N = H + A at the loads P.

    For any x, with r = 1 - N x:  1'N^-1 1 = 1'x + r'x + r'N^-1 r.  Elastic shares make r small.
    """
    q, H = problem.elastic, 1.0 / problem.stiffest
    coupled = problem.couple(q)
    level = H * q + coupled
    middle = float(level.mean())
    blur = problem.influence.rounding(q).of(couple_above(problem, np.abs(q)))
    blur += SUM_ROUNDOFFS * ROUNDOFF * (np.abs(H * q) + np.abs(coupled))
    left = float((np.abs(level - middle) + blur).max()) / middle
    plain = (float(q.sum()) + left * float(np.abs(q).sum())) / middle
    return (plain + left**2 * float(problem.stiffest.sum()) / (1.0 - theta)) * (1 + SAFETY)
