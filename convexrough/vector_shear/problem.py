"""The friction problem of the loaded asperities, with vectors of shear forces.

docs/theory/vector-friction.md derives the equations. Here shear forces are divided by the
coefficient of friction f, displacements by c_t f and energies by c_t f^2, with Mindlin's ratio c_t.
The shear force u deflects an asperity with the load P and Hertz's coefficient k by

    own(u) = threshold [1 - (1 - u / P)^(2/3)],    threshold = k P^(2/3).

The kernel (1) of the page is B_ij = A_ij [(1 - bias) I + 2 bias d d'], with bias = nu / (2 - nu),
Poisson's ratio nu and the unit vector d from j to i. The forces q_i, |q_i| <= P_i, with the sum
T = Q / f, the slips and the rigid displacement X satisfy

    X = own(q_i) + (B q)_i + slip_i,

where own(q) is the vector of length own(|q|) in the direction of q.
"""

from __future__ import annotations

from fractions import Fraction
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from convexrough import checks
from convexrough.arithmetic.balls import Ball, where
from convexrough.arrays import Array, Indices, among_zeros
from convexrough.contact import Contact
from convexrough.convex.definite import proved_margin
from convexrough.errors import InputError
from convexrough.friction.levels import FrictionLevels
from convexrough.influence import Influence
from convexrough.normal.boxes import Scope
from convexrough.roundoff import ROUNDOFF, SAFETY, SUM_ROUNDOFFS
from convexrough.sphere import mindlin

#: Margins of convexity for which a Cholesky factorisation is tried, the largest first.
MARGINS = (0.6, 0.3, 0.1, 1e-2, 1e-3)

#: If the shear force divided by f is below this fraction of the total load, the state is
#: proportional to the force, to all digits.
ELASTIC = Fraction(1, 10**15)


class VectorState(NamedTuple):
    """A friction state of the n loaded asperities, in scaled units."""

    total: Array  # (2,) T
    increments: Array  # (n, 2) q
    displacement: Array  # (2,) X
    slips: Array  # (n, 2) slip_i
    iterations: int


class FrictionProblem:
    """n loaded asperities of a contact; use `contact.cached(FrictionProblem)`.

    Arrays are (n,), in scaled units. Raises InputError without friction.

    levels   : normal solutions at loads up to that of the contact
    scope    : scope of the contact's certificate; "none" without a proof
    touching, places : indices of the loaded asperities in the scene, and in `levels.candidates`
    loads, errors, most : P, bounds on its errors, and upper bounds on P
    thresholds : k P^(2/3)
    compliance : h_i = (2/3) threshold_i / P_i; the Hessian of the local energy is at least h_i I
    sure     : True where proved to touch
    load_balls, threshold_balls : P and k P^(2/3) as balls where sure, 0 and 1 elsewhere
    stiffness : upper bound on 1 / h_i where sure, 0 elsewhere
    stray    : bound on the total load of all asperities not proved to touch or to be open
    stray_effect : bound on the displacement of any asperity by this load
    bias     : nu / (2 - nu)
    force_unit, travel_unit : [force], [length] units of shear forces and tangential displacements
    """

    def __init__(self, contact: Contact) -> None:
        self.levels = levels = contact.cached(FrictionLevels)
        self.units, self._scene = levels.units, contact.scene
        self.scope: Scope = contact.certificate.scope if levels.proved else "none"
        level = levels.top
        self.places = np.flatnonzero(level.loads.value > 0)
        self.touching: Indices = levels.candidates[self.places]
        P, k = level.loads[self.places], level.problem.exact.coefficients
        k = k if len(k) == 1 else k[self.places]
        thresholds, nothing = k * P.two_thirds(), Ball.exact(np.zeros(len(self.places)))
        self.loads, self.errors, self.thresholds = P.value, P.error, thresholds.value
        self.most = (self.loads + self.errors) * (1 + SAFETY)
        self.compliance: Array = (2.0 / 3.0) * self.thresholds / self.loads
        self.sure = level.touching[self.places] & P.positive & thresholds.positive
        self.load_balls = where(self.sure, P, nothing)
        self.threshold_balls = where(self.sure, thresholds, nothing + 1.0)
        self.stiffness = np.where(self.sure, (1.5 * P.cbrt() / k).upper, 0.0)
        left = ~level.open
        left[self.places[self.sure]] = False
        self.stray = float(np.maximum(level.loads.upper, 0.0)[left].sum()) * (1 + SAFETY)
        largest = level.problem.largest_entry * (1 + SAFETY)
        self.stray_effect = self.stray * largest if self.stray else 0.0
        nu = contact.scene.material.poisson_ratio
        self.bias = nu / (2.0 - nu)
        self.force_unit = float(levels.force_unit.value)
        self.travel_unit = float(levels.travel_unit.value)

    def __len__(self) -> int:
        return len(self.loads)

    @cached_property
    def influence(self) -> Influence:
        """The operator A."""
        return self.levels.top.problem.influence.restricted(self.places)

    @cached_property
    def kernel(self) -> Array:
        """(2n, 2n) B, in the order x_1, y_1, x_2, y_2, ..."""
        n = len(self)
        checks.fits_in_memory("loaded asperities", n, 160, power=2)
        x, y = self._scene.contact_points[self.touching].T
        dx, dy = np.subtract.outer(x, x), np.subtract.outer(y, y)
        squares = dx**2 + dy**2
        squares[np.diag_indices(n)] = 1.0
        kernel = np.empty((n, 2, n, 2))
        A = self.influence.matrix
        # bias A times the cosine in 2 d d' - I
        turned = self.bias * A * (dx - dy) * (dx + dy) / squares
        kernel[:, 0, :, 0], kernel[:, 1, :, 1] = A + turned, A - turned
        kernel[:, 0, :, 1] = kernel[:, 1, :, 0] = self.bias * A * 2.0 * dx * dy / squares
        return kernel.reshape(2 * n, 2 * n)

    @property
    def convexity_numbers(self) -> Array:
        """(n,) contact radii divided by pi/4 times the distance to the nearest loaded asperity."""
        return np.asarray(self.influence.shells / self.compliance)

    @property
    def elastic(self) -> Ball:
        """(n,) parts of a shear force on the asperities if all stick: dP_i / d(total load)."""
        return self.levels.top.tangent.loads[self.places]

    def from_rest(self, height: Fraction) -> tuple[Array, Array]:
        """(n,) scaled forces u, and sums eta of deflection and slip, from `shear` at `height`, the
        tangential force T = Q / f [force]."""
        if height < ELASTIC * self.levels.load:
            shares = self.elastic.value * float(height / Fraction(self.units.force))
            return shares, shares * self.compliance
        top, low = self.levels.top, self.levels.at(self.levels.load - height)
        u, eta = top.loads - low.loads, top.indentation - low.indentation
        return u.value[self.places], eta.value[self.places]

    def deflections(self, increments: Array) -> Array:
        """(n,) the deflections under the shear forces u = `increments`, 0 <= u <= P."""
        left = (self.loads - increments) / self.loads
        x = mindlin.width_between(increments / self.loads, left)
        return np.asarray(self.thresholds * mindlin.deflection_at(x))

    def to_scene(self, values: NDArray[Any]) -> NDArray[Any]:
        """(N, ...) these values, and 0 for all other asperities of the scene."""
        return among_zeros(values, self.touching, len(self._scene))

    @property
    def product_error(self) -> float:
        """Bound on the rounding error of (B q)_i, divided by sum_j A_ij |q_j|."""
        entries = self.influence.entry_error
        return 2.0 * (entries + (2 * len(self) + SUM_ROUNDOFFS) * ROUNDOFF)

    def couple(self, increments: Array) -> Array:
        """(n, 2) the displacements B q for the forces q = `increments`."""
        return np.asarray(self.kernel @ increments.reshape(-1)).reshape(-1, 2)

    def sizes(self, increments: Array) -> Array:
        """(n,) |q_i|, set to P_i where they differ by rounding, as deflections are steep there."""
        size, P = np.hypot(*increments.T), self.loads
        return np.where(size >= P * (1.0 - 8 * ROUNDOFF), P, size)

    def local_forces(self, eta: Array) -> Array:
        """(n, 2) the forces q(eta), with |q_i| = P_i where an asperity slides."""
        _, across = self.slopes(eta)
        return eta * across[:, None]

    def slopes(self, eta: Array) -> tuple[Array, Array]:
        """(n,) the eigenvalues of dq/deta along and across eta (n, 2)."""
        return slopes(self.loads / self.thresholds, np.hypot(*eta.T) / self.thresholds)

    def energy(self, increments: Array, coupling: Array) -> float:
        """The energy of forces q, given their coupling B q."""
        P, thresholds = self.loads, self.thresholds
        local = mindlin.potential(np.hypot(*increments.T) / P) @ (P * thresholds)
        return float(local + 0.5 * (increments * coupling).sum())

    def residual(self, state: VectorState) -> float:
        """The largest relative violation of the conditions of least energy.

        The violations are: the error of the equation for X (top of the module), the part of a slip
        that is not along its force, and |slip_i| (1 - |q_i| / P_i), all divided by |X|; the part of
        |q_i| beyond P_i, divided by P_i; and the error of the total, divided by |T|.
        """
        if not np.isfinite(state.displacement).all():
            return np.inf
        q, slips, P = state.increments, state.slips, self.loads
        size = self.sizes(q)
        slip_size = np.hypot(*slips.T)
        own = along(self.deflections(size), q, size)
        imbalance = np.hypot(*(state.displacement - own - self.couple(q) - slips).T)
        across = np.hypot(*(slips - along(slip_size, q, size)).T)
        unused = slip_size * np.maximum(1.0 - size / P, 0.0)
        missing = float(np.hypot(*(q.sum(axis=0) - state.total)))
        travel, total = float(np.hypot(*state.displacement)), float(np.hypot(*state.total))
        wrong = float(np.max([imbalance, across, unused])) / (travel or 1.0)
        return max(wrong, float((np.hypot(*q.T) / P - 1.0).max()), missing / (total or 1.0))

    @cached_property
    def share(self) -> float:
        """The least S, up to rounding, for which B + S H is positive semidefinite, H = diag(h_i).

        The energy is convex if S <= 1: docs/theory/vector-friction.md, "Convexity".
        """
        root = np.repeat(1.0 / np.sqrt(self.compliance), 2)
        lowest = float(np.linalg.eigvalsh(self.kernel * root * root[:, None])[0])
        return max(-lowest, 0.0) + 1e-14 * (1 + len(self))

    @cached_property
    def margin(self) -> float:
        """A proved mu > 0 with I + H^-1/2 B H^-1/2 >= mu I for the true loads; 0 if none is found.

        H is the diagonal matrix of `compliance`. Asperities not proved to touch are left out.
        """
        root = np.repeat(np.sqrt(self.stiffness), 2)
        scaled = self.kernel * root * root[:, None]
        return proved_margin(scaled, MARGINS, self.product_error + 8 * ROUNDOFF, spare=SAFETY)

    @property
    def reach(self) -> Array:
        """(n, n) bounds on the norms of the B_ij: |B_ij v| <= reach_ij |v|."""
        return np.asarray(self.influence.matrix * ((1.0 + self.bias) * (1 + SAFETY)))


def slopes(scale: Array, share: Array) -> tuple[Array, Array]:
    """(n,) eigenvalues of dq/deta along and across eta; the second is |q| / |eta|.

    The force is q = P [1 - z^(3/2)] eta / |eta| with z = max(1 - share, 0), scale = P / threshold
    and share = |eta| / threshold.
    """
    left = np.maximum(1.0 - share, 0.0)
    root = np.sqrt(left)
    return 1.5 * scale * root, scale * (1.0 + left / (1.0 + root)) / np.maximum(share, 1.0)


def along(lengths: Array, vectors: Array, sizes: Array) -> Array:
    """(n, 2) vectors of these lengths along `vectors`, which have the lengths `sizes`, or are 0."""
    scale: Array = lengths / np.where(sizes > 0, sizes, 1.0)
    return vectors * scale[:, None]


def in_plane(force: ArrayLike) -> Array:
    """(2,) a checked force, of which a number is the component along x."""
    if np.ndim(force) == 0:
        return np.array([checks.array("force", force, length=1)[0], 0.0])
    given = checks.array("force", force)
    if given.shape != (2,):
        expected = "a number, along x, or a pair (Qx, Qy)"
        raise InputError("force", found=f"{given.size} numbers", expected=expected)
    return given.copy()
