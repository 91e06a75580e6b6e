"""Newton's method for the friction problem with the full tangential kernel.

docs/theory/vector-friction.md, "Newton's method", describes the method, and `vector_shear.problem`
the symbols in scaled units. With the sums eta_i of deflection and slip, `convex.newton` solves

    F = eta + B q(eta) - X = 0,    sum q(eta) = T.

With the derivatives dq_i/deta_i = W_i W_i' (2, 2), a step solves

    (I + W'B W) y = W'(dX - F),   sum W y = 0,   d(eta) = dX - F - B W y.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from fractions import Fraction
from typing import ClassVar

import numpy as np
import scipy  # its parts are imported when they are used

from convexrough.arrays import Array
from convexrough.convex import newton
from convexrough.errors import SolverError
from convexrough.roundoff import ROUNDOFF, SAFETY
from convexrough.vector_shear.problem import FrictionProblem, VectorState, along


@dataclass(frozen=True)
class FrictionNewton:
    """A solver for `shear_vector`: Newton's method, started from the state that `shear` finds.

    The method stops when  max_i |eta_i + (B q)_i - X| <= tolerance |X|  and a further step does not
    halve this residual. After `max_iterations` steps, `shear_vector` raises SolverError.
    docs/theory/vector-friction.md, "What is proved of a state", defines the symbols.

    >>> state = cr.shear_vector(contact, force=0.25 * contact.load, solver=cr.FrictionNewton())
    >>> state.residual < 1e-12
    True
    """

    tolerance: float = 1e-12
    max_iterations: int = 100
    name: str = field(default="newton", init=False)

    def solve(self, problem: FrictionProblem, total: Array) -> VectorState:
        """The state under a total (2,), |T| < sum P, in scaled units.

        Raises SolverError if the method does not converge.

        >>> problem = contact.cached(FrictionProblem)
        >>> cr.FrictionNewton().solve(problem, np.array([0.1, 0.0])).increments.shape
        (37, 2)
        """
        law = _Friction(problem, total)
        size = float(np.hypot(*total))
        height = Fraction(size) * Fraction(problem.units.force)
        _, deflections = problem.from_rest(height)
        start = law.evaluate(deflections[:, None] * (total / size))
        if start is None:
            missing = "no forces of the prescribed total to start from"
            raise SolverError(missing, solver=law.solver, advice=law.advice())
        state, iterations = newton.solve(law, start, self.tolerance, 0.0, self.max_iterations)
        sizes = np.hypot(*state.unknown.T)
        slips = along(np.maximum(sizes - problem.thresholds, 0.0), state.unknown, sizes)
        return VectorState(total, state.forces, state.at, slips, iterations)


@dataclass(frozen=True)
class _Friction:
    """The equations of vector friction for one total T (2,), in the form of `convex.newton`."""

    problem: FrictionProblem
    total: Array

    solver: ClassVar[str] = "friction (newton)"
    unit: ClassVar[str] = "the displacement"

    def evaluate(self, unknown: Array) -> newton.Iterate | None:
        """The state at eta plus a shift with which forces add up to T; None if none is found."""
        problem = self.problem
        shifted = _onto_total(problem, unknown, self.total)
        if shifted is None:
            return None
        q = problem.local_forces(shifted)
        coupling = problem.couple(q)
        roots = _roots(problem, shifted)
        slopes = roots @ np.swapaxes(roots, 1, 2)
        moved = shifted + coupling  # X, at every asperity
        middle = moved.mean(axis=0)
        pull = np.einsum("nij,nj->i", slopes, moved - middle)
        displacement = middle + np.linalg.lstsq(slopes.sum(axis=0), pull, rcond=None)[0]
        defect = moved - displacement
        residual = float(np.hypot(*defect.T).max())
        energy, scale = problem.energy(q, coupling), float(np.hypot(*displacement))
        size = np.hypot(*shifted.T)
        own = along(np.minimum(size, problem.thresholds), shifted, size)
        return newton.Iterate(
            unknown=shifted,
            forces=q,
            defect=defect,
            gradient=np.asarray(own + coupling - displacement),
            energy=energy,
            # Near gross sliding X is large, and so is the effect of rounding in the total.
            rounding=SAFETY * energy + 1e-14 * float(np.hypot(*self.total)) * scale,
            residual=residual,
            scale=scale,
            noise=ROUNDOFF * scale,  # ends the iteration on symmetric layouts
            at=displacement,  # the best estimate of X
        )

    def direction(self, state: newton.Iterate, left: float) -> Array:
        """The Newton step d(eta), solved directly, so that `left` is not used.

        If the matrix is not positive definite, a diagonal makes the kernel semidefinite.
        """
        problem, n = self.problem, len(self.problem)
        roots = _roots(problem, state.unknown)
        scaled = problem.kernel
        for _ in range(2):  # B W, then W'B W
            scaled = np.einsum("rjc,jcb->rjb", scaled.reshape(2 * n, n, 2), roots)
            scaled = scaled.reshape(2 * n, 2 * n).T
        pushed = np.einsum("nij,ni->nj", roots, -state.defect)
        turned = np.swapaxes(roots, 1, 2)  # W' for dX along x and along y
        right = np.concatenate((pushed[:, :, None], turned), axis=2).reshape(2 * n, 3)
        matrix = scaled + np.eye(2 * n)
        factor, info = scipy.linalg.lapack.dpotrf(matrix.T, lower=1, clean=0)
        if info != 0:  # with the diagonal, all eigenvalues are at least 1, up to rounding
            slopes = np.einsum("nij,nij->nj", roots, roots).reshape(-1)
            shift = np.repeat(problem.share * problem.compliance, 2)
            matrix[np.diag_indices(2 * n)] += shift * slopes
            factor, _ = scipy.linalg.lapack.dpotrf(matrix.T, lower=1, clean=0)
        solved = scipy.linalg.lapack.dpotrs(factor, right, lower=1)[0].reshape(n, 2, 3)
        forces = np.einsum("nij,njk->nik", roots, solved)  # dq = W y
        sums = forces.sum(axis=0)
        change = np.linalg.lstsq(sums[:, 1:], -sums[:, 0], rcond=None)[0]  # dX, so that sum dq = 0
        moved = problem.couple(forces[:, :, 0] + forces[:, :, 1:] @ change)
        return np.asarray(change - state.defect - moved)

    def advice(self, state: newton.Iterate | None = None) -> str:
        """What the user can try if no state is found at this total."""
        share = float(np.hypot(*self.total)) / float(self.problem.loads.sum())
        place, number = f"the shear force is {share:.6g} f P", self.problem.convexity_numbers.max()
        if number < 1:
            return f"{place}; try a shear force a little smaller"
        return (
            f"{place}, in a contact so crowded that the energy need not be convex (convexity "
            f"number {number:.3g}, convex below 1): use a smaller load, or sharper tips"
        )


def _roots(problem: FrictionProblem, eta: Array) -> Array:
    """(n, 2, 2) W: unit vectors along and across eta_i times the roots of the slopes of q."""
    size = np.hypot(*eta.T)
    radial, across = np.sqrt(problem.slopes(eta))
    direction = along(np.ones(len(size)), eta, size)
    direction[size == 0] = (1.0, 0.0)
    x, y = direction.T
    return np.stack((x * radial, -y * across, y * radial, x * across), axis=1).reshape(-1, 2, 2)


def _onto_total(problem: FrictionProblem, eta: Array, total: Array) -> Array | None:
    """eta + s with the vector s for which the forces add up to T; None if no s is found."""
    shift = np.zeros(2)
    excess = problem.local_forces(eta).sum(axis=0) - total
    size = float(np.hypot(*total))
    for _ in range(100):
        roots = _roots(problem, eta + shift)
        slopes = np.einsum("nij,nkj->ik", roots, roots)
        try:
            step = -np.linalg.solve(slopes, excess)
        except np.linalg.LinAlgError:
            return None
        fall = float(excess @ step)
        if not np.isfinite(fall):
            return None
        for _ in range(60):
            following = problem.local_forces(eta + shift + step).sum(axis=0) - total
            if float(following @ step) <= -0.5 * fall:
                break
            step, fall = step / 2.0, fall / 2.0
        else:
            return None
        shift = shift + step
        before, excess = excess, following
        if np.hypot(*excess) <= 1e-15 * size or (
            np.hypot(*excess) <= 1e-13 * size and np.hypot(*excess) >= 0.5 * np.hypot(*before)
        ):
            return np.asarray(eta + shift)
    return None
