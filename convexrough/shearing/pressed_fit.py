"""How well the loads of a contact fit its law, for the bounds of docs/theory/shear-sup-norm.md."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from convexrough.arrays import Array
from convexrough.normal.problem import NormalProblem
from convexrough.normal.residual import Fit, fit
from convexrough.normal.sup_norm import SupNorm
from convexrough.roundoff import SAFETY
from convexrough.shearing.load_errors import LoadErrors
from convexrough.shearing.problem import TangentialProblem
from convexrough.shearing.riding_weights import Weights
from convexrough.sphere import hertz


class PressedFit(NamedTuple):
    """What the loads P leave of the contact law, and what follows for all of them together.

    In own units; p is the true loads less P.
    """

    gap: Array  # (n,) k P^(2/3) + A P - D as computed, D with the certificate's approach
    rounding: Array  # (n,) bounds on its error, less a remainder
    remainder: float  # bound on the 2-norm of that
    component: float  # and on each component of it
    approach: float  # bound on the error of the approach
    total: float  # bound on |sum p| of those that are sure
    local: Array  # (n,) bounds on the change of k P^(2/3)
    sup: SupNorm | None  # of the least stiffness of friction
    moves: Array  # (n,) what a residual of at most 1 moves

    @classmethod
    def of(cls, problem: TangentialProblem) -> PressedFit:
        """Those of a problem, which keeps them."""
        return problem.keep(cls._judge)

    @classmethod
    def _judge(cls, problem: TangentialProblem) -> PressedFit:
        known = LoadErrors.of(problem)
        found = fit(_pressing(problem), problem.loads)
        approach = problem.certificate.approach_error / problem.units.length
        P, b = problem.loads, np.where(known.sure, known.errors, 0.0)
        local = softness(problem) * b / np.cbrt(P - b) * (1 + SAFETY)
        total, sup = _total(problem, known, found, approach), None
        if known.sure.any():
            sup = SupNorm.of(problem.influence, known.stiffness)
        moves = np.full(len(P), np.inf) if sup is None else sup.moves(problem.influence, 1.0)
        return cls(
            found.gap, found.rounding, found.remainder, found.component, approach, total,
            local, sup, moves,
        )  # fmt: skip


def softness(problem: TangentialProblem) -> Array:
    """(n,) (2/3) k: the stiffness of an asperity with P - |u| left is that over its cube root."""
    k: Array = 2.0 / 3.0 * problem.ceilings / np.cbrt(problem.loads) ** 2
    return k


def _pressing(problem: TangentialProblem) -> NormalProblem:
    """The pressing of the loaded asperities, at the certificate's approach."""
    scene, length, touching = problem.scene, problem.units.length, problem.touching
    modulus, radii = scene.material.contact_modulus, scene.relative_radii[touching]
    approach = problem.certificate.approach / length
    return NormalProblem(
        scene=scene,
        units=problem.units,
        candidates=touching,
        coefficients=hertz.local_coefficient(modulus, radii) * problem.units.local,
        offsets=scene.offsets[touching] / length,
        offset_errors=scene.offset_errors[touching] / length,
        influence=problem.influence,
        shells=problem.shells,
        approach=approach,
        load=None,
        ceiling=approach,
    )


def _total(problem: TangentialProblem, known: LoadErrors, found: Fit, approach: float) -> float:
    """Bound on |sum p|: of all one by one, or from sum nu f, f = dD - gap of the true loads."""
    P, b = problem.loads, np.where(known.sure, known.errors, 0.0)
    singly = float(b.sum()) * (1 + SAFETY)
    soft = softness(problem)
    softest = np.where(known.sure, soft / np.cbrt(P + b), np.inf)
    stiffest = np.where(known.sure, soft / np.cbrt(P - b), np.inf)
    nu = Weights.of(problem, softest, stiffest)
    if not nu.total > 0:
        return singly
    left = np.abs(found.gap) + found.rounding + known.stray_effect + known.loose_effect
    together = float(nu.values @ (left + found.component + approach))
    together += float(np.where(known.sure, nu.off, 0.0) @ b)
    return min(singly, together * (1 + SAFETY))
