"""The general step as one second-order cone program: a check of the solution by Newton's method.

The general step is a step along a load path without the assumption of order. The elastic energy
W(T) of an asperity is the integral of its deflection over its shear force T. It consists of pieces:
one on which the asperity sticks, and others on which it slips. There is one of these for each
direction of slip and each straight part (layer) of the memory curve before the step in which the
slip front may end (docs/theory/without-order.md). W is convex, so it is the convex hull of its
pieces. The cones of `convexrough.convex.cones` represent each piece exactly. Piece j has a weight
w_j >= 0, which replaces the constant 1 in the cones of this piece (its perspective). The weights of
an asperity add up to 1. The forces and energies of its pieces add up to those of the asperity.
Forces are in units of the coefficient of friction f, displacements in units of c_t f with Mindlin's
ratio c_t: docs/theory/without-order.md, "The step as one cone program".
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from convexrough.arrays import Array, Indices
from convexrough.convex.cones import FIVE_CONES_LIMIT, FOUR_CONES_LIMIT, power_cones
from convexrough.errors import SolverError
from convexrough.friction.general_step import OwnStep, Step, Stepper
from convexrough.influence import couple
from convexrough.influence.shells import shells
from convexrough.solvers.programs import ConeProgram, run_clarabel
from convexrough.sphere import hertz

#: Tolerance of the solver Clarabel, and the largest fraction of the way to the cones' boundary that
#: one of its steps takes.
TOLERANCE, STEP = 1e-11, 0.9

#: A piece has LIFT variables: its weight, y1, ..., y5 and z. Y3, Y5, Z are the places of y3, y5, z.
LIFT, Y3, Y5, Z = 7, 3, 5, 6

#: Layers thinner than this fraction of the load are omitted; the solver's error is larger.
THIN = 1e-9


class ConePiece(NamedTuple):
    """A piece of W(T). Forces are divided by the load N of the asperity, lengths by k N^(2/3).

    On a slipping piece the level L of the slip front runs from `low` to `high`. With the constants
    `force`, `rate`, `own` and `energy` of the piece,  T = force - rate L,  the deflection is
    own - rate L^(2/3),  and  W = own T + (3/5) rate^2 L^(5/3) + energy.  On a stuck piece
    rate = 0,  |T - force| <= high  and  W = own (T - force) + (T - force)^2 softness / 2 + energy.
    """

    low: float
    high: float
    rate: float
    force: float
    own: float
    energy: float
    softness: float = 0.0

    def forces(self) -> tuple[float, float]:
        """The smallest and the largest force on the piece."""
        if self.rate == 0.0:
            return self.force - self.high, self.force + self.high
        ends = self.force - self.rate * self.low, self.force - self.rate * self.high
        return min(ends), max(ends)

    @property
    def force_row(self) -> Array:
        """(LIFT,) coefficients of T in the variables of a piece."""
        found = np.zeros(LIFT)
        found[0], found[Y3] = self.force, -self.rate or 1.0
        return found

    def objective(self, shift: float) -> Array:
        """(LIFT,) coefficients of W - shift T^2 / 2 in the variables of a piece."""
        found = np.zeros(LIFT)
        found[0] = self.energy - shift * self.force**2 / 2.0
        if self.rate == 0.0:
            found[Y3] = self.own - shift * self.force
            found[Y5] = (self.softness - shift) / 2.0
            return found
        found[0] += self.own * self.force
        found[Y3] = self.rate * (shift * self.force - self.own)
        found[Y5] = self.rate**2 * (0.6 - shift / 2.0)
        found[Z] = self.rate**2 * shift / 2.0
        return found

    def rows(self, lift: Array) -> Array:
        """(3 k, LIFT) a matrix A: for the variables y of the piece, -A y lies in k cones.

        The cones have dimension 3. The first one stands for the bounds of the piece. On a slipping
        piece the others are `lift`, the cones for powers. A stuck piece has one other cone, and
        uses three variables: the weight; y3, the force minus the force in the middle of the piece;
        and y5, the square of y3 divided by the weight.
        """
        low = -self.high if self.rate == 0.0 else self.low
        bounds, square = np.zeros((3, LIFT)), np.zeros((3, LIFT))
        bounds[:2, 0] = (low - self.high) / 2.0, (low + self.high) / 2.0
        bounds[1, Y3] = square[0, 0] = square[0, Y5] = square[1, Y5] = -1.0
        square[1, 0], square[2, Y3] = 1.0, -2.0
        return np.vstack((bounds, lift if self.rate else square))

    def cost(self, force: float) -> float:
        """W at this force, minus the constant `energy`."""
        if self.rate == 0.0:
            return (self.own + 0.5 * self.softness * (force - self.force)) * (force - self.force)
        level = max((self.force - force) / self.rate, 0.0)
        return self.own * force + 0.6 * self.rate**2 * float(np.cbrt(level)) ** 5


def pieces_of(levels: Array, heights: Array, own: float, k: float) -> list[ConePiece]:
    """The pieces of the energy of an asperity, from its memory curve before the step.

    levels, heights : (m,) vertices of this curve; no level exceeds `own`
    own : indentation of the asperity after the step, positive
    k   : coefficient of the asperity in Hertz's law
    """
    distinct = np.diff(levels, prepend=-1.0) > 0
    s, base = levels[distinct], float(levels[-1])
    load = float(hertz.load(own, k))
    N, xi = hertz.load(s, k) / load, heights[distinct] / own
    slopes = (np.diff(heights[distinct]) / np.diff(s)).tolist()
    T = np.concatenate(([0.0], np.cumsum(np.array(slopes) * np.diff(N))))
    top, moved = float(N[-1]), float(xi[-1])
    found = []
    start = {1: (float(T[-1]), 0.0), -1: (float(T[-1]), 0.0)}  # force and energy reached so far
    if own > base * (1 + THIN):
        softness = (1.0 - base / own) / (1.0 - top)
        stuck = ConePiece(0.0, 1.0 - top, 0.0, float(T[-1]), moved, 0.0, softness)
        found.append(stuck)
        for sign, end in zip((-1, 1), stuck.forces(), strict=True):
            start[sign] = end, stuck.cost(end)
    for sign in (1, -1):
        force, energy = start[sign]
        for j in reversed(range(len(slopes))):
            low, high = float(N[j]), float(N[j + 1])
            rate = sign - slopes[j]  # c (1 - c th)
            if high - low <= THIN or abs(rate) <= THIN:
                continue
            level = float(T[j]) - slopes[j] * low + sign
            reached = float(xi[j]) - slopes[j] * low ** (2 / 3) + sign
            piece = ConePiece(low, high, rate, level, reached, 0.0)
            piece = piece._replace(energy=energy - piece.cost(force))
            found.append(piece)
            force = piece.forces()[1 if sign > 0 else 0]
            energy = piece.cost(force) + piece.energy
    return found


class ConicStepper(Stepper):
    """General steps that Clarabel solves as cone programs."""

    def _solve(self, step: Step) -> tuple[Array, float, OwnStep]:
        """eta, x and own steps, from the forces of touching asperities and the multiplier of T."""
        which = np.flatnonzero(step.loads)
        program, unit = self._program(step, which)
        raw = run_clarabel(program, "conic step", TOLERANCE, max_step_fraction=STEP)
        forces = np.zeros(len(step.loads))
        forces[which] = np.clip(raw.x[: len(which)], -1.0, 1.0) * step.loads[which]
        x = float(-raw.multipliers[0]) * unit / float(step.loads.sum())
        eta = x - self.A @ (forces - step.now.forces)
        return eta, x, step.at(eta)

    def _program(self, step: Step, which: Indices) -> tuple[ConeProgram, float]:
        """The program in T_i / N_i and the variables of each piece, and the unit of its objective.

        which : (n,) indices of the asperities that touch after the step, with the loads N_i

        Raises SolverError if the shells, a diagonal that makes the compliance matrix positive
        semidefinite, are too large for the cones.
        """
        from scipy import sparse  # 0.1 s to import: only when solving

        n, N, own, parts = len(which), *(it[which] for it in (step.loads, step.own, step.parts))
        modulus, k = self.levels.scene.material.contact_modulus, self.coefficients[which]
        coupled = couple(self.levels.scene, which, 1.0 / (np.pi * modulus), "dense")
        wells = shells(coupled) if n > 1 else np.zeros(n)
        shifts = wells * N * parts / own  # the shells in the units of the pieces
        if 1.5 * shifts.max(initial=0.0) > FIVE_CONES_LIMIT:
            raise SolverError("too dense for a convex program", solver="conic step")
        energies = N * own / parts  # the factors that turn scaled energies W into W_i / p_i
        unit = float(energies.max())
        vertices = step.curves.levels[which], step.curves.heights[which], own, k
        each = [pieces_of(*values) for values in zip(*vertices, strict=True)]
        owner = np.repeat(np.arange(n), [len(pieces) for pieces in each])
        pieces = [piece for some in each for piece in some]
        around = self.A[which] @ step.now.forces
        linear = [-N * (step.now.deflections[which] / parts + around) / unit]
        linear += [
            piece.objective(shifts[i]) * (energies[i] / unit)
            for i, piece in zip(owner, pieces, strict=True)
        ]
        names = range(1 if 1.5 * shifts.max() > FOUR_CONES_LIMIT else 2, LIFT)
        lift = power_cones([np.array([name]) for name in names], LIFT, ones=np.zeros(1, dtype=int))
        powers = lift.matrix.toarray()
        cones: Any = sparse.block_diag([piece.rows(powers) for piece in pieces])
        weights, forces = np.zeros((2, n, len(pieces), LIFT))
        weights[owner, range(len(pieces)), 0] = 1.0
        forces[owner, range(len(pieces))] = [piece.force_row for piece in pieces]
        sums = np.vstack((weights.reshape(n, -1), forces.reshape(n, -1)))
        A = self.A[np.ix_(which, which)] + np.diag(wells)
        quadratic = np.triu(A * N * (N[:, None] / unit))
        rows = [[N[None] / N.sum(), None], [-np.eye(2 * n, n, -n), sums], [None, cones]]
        constraints = sparse.csc_matrix(sparse.block_array(rows))
        constraints.eliminate_zeros()  # `block_diag` keeps them
        constant = np.zeros(1 + 2 * n + cones.shape[0])
        constant[0], constant[1 : n + 1] = step.total / N.sum(), 1.0
        program = ConeProgram(
            quadratic=sparse.csc_matrix(
                sparse.block_diag((quadratic, sparse.csc_array((cones.shape[1],) * 2)))
            ),
            linear=np.concatenate(linear),
            constraints=constraints,
            constant=constant,
            equalities=1 + 2 * n,
        )
        return program, unit
