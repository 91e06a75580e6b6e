"""The general step as one second-order cone program, which checks the solution by Newton's method.

The cones of `convexrough.convex.cones` represent each piece of the energy W(T) of an asperity
(`conic_pieces`) exactly, and W is the convex hull of its pieces. Piece j has a weight w_j, which
replaces the 1 in its cones. The weights of an asperity add up to 1. The forces and energies of its
pieces add up to those of the asperity. Forces are in units of the coefficient of friction f,
displacements of c_t f with Mindlin's ratio c_t: docs/theory/without-order.md, "The step as one cone
program".
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from convexrough.arrays import Array, Indices
from convexrough.convex.cones import FIVE_CONES_LIMIT, FOUR_CONES_LIMIT, power_cones
from convexrough.errors import SolverError
from convexrough.friction.conic_pieces import LIFT, Y3, Y5, ConePiece, pieces_of
from convexrough.friction.general_step import Bundle, Stepper
from convexrough.friction.levels import Snapshot
from convexrough.influence import couple
from convexrough.influence.shells import shells
from convexrough.solvers.programs import ConeProgram, RawAnswer, run_clarabel
from convexrough.sphere import hertz

if TYPE_CHECKING:
    from scipy.sparse import csc_matrix

#: Tolerance of the solver Clarabel, and the largest fraction of the way to the cones' boundary that
#: one of its steps takes.
TOLERANCE, STEP = 1e-11, 0.9


class ConicStepper(Stepper):
    """General steps that Clarabel solves as cone programs."""

    def _solve(self, now: Bundle, level: Snapshot, total: float) -> Bundle:
        program = StepProgram.assemble(self, now, level, total)
        raw = run_clarabel(program.apply(), "conic step", TOLERANCE, max_step_fraction=STEP)
        forces, x = program.invert(raw)
        own = np.maximum(level.indentations, 0.0)
        targets = program.deflections(forces)
        reached = now.curves.cut(own).step(own, targets)
        moved = x - self.A @ (forces - now.carried)
        positions, displacement = now.positions + moved, now.displacement + x
        curves, fronts = reached.curves, reached.fronts
        return Bundle(now.load, level, curves, fronts, forces, positions, displacement)


@dataclass(frozen=True, eq=False)
class StepProgram:
    """The cone program of one step, for the n asperities that touch after the step.

    total  : sum of the shear forces of these asperities
    which  : (n,) indices of the asperities in the scene
    loads, own : (n,) loads N_i and indentations after the step
    parts  : (n,) p_i, the fraction of the step during which the asperity touches
    shells : (n,) a diagonal; the compliance matrix plus this diagonal is positive semidefinite
    pieces : pairs of an asperity (its index among the n) and a piece of its energy
    """

    stepper: Stepper
    now: Bundle
    total: float
    which: Indices
    loads: Array
    own: Array
    parts: Array
    shells: Array
    pieces: tuple[tuple[int, ConePiece], ...]

    @classmethod
    def assemble(cls, stepper: Stepper, now: Bundle, level: Snapshot, total: float) -> StepProgram:
        """The program of a step. Raises SolverError if `shells` are too large for its cones."""
        which = np.flatnonzero(level.loads > 0)
        k, own = stepper.coefficients[which], level.indentations[which]
        gaps = np.maximum(-now.level.indentations[which], 0.0)
        scene = stepper.levels.scene
        scale = 1.0 / (np.pi * scene.material.contact_modulus)
        old = now.curves.cut(np.maximum(level.indentations, 0.0))
        vertices = old.levels[which], old.heights[which], own, k
        pieces = [
            (place, piece)
            for place, each in enumerate(zip(*vertices, strict=True))
            for piece in pieces_of(*each)
        ]
        program = cls(
            stepper=stepper,
            now=now,
            total=total,
            which=which,
            loads=hertz.load(own, k),
            own=own,
            parts=own / (own + gaps),
            shells=shells(couple(scene, which, scale, "dense")) if len(which) > 1 else 0.0 * own,
            pieces=tuple(pieces),
        )
        if 1.5 * program.shifts.max(initial=0.0) > FIVE_CONES_LIMIT:
            raise SolverError("too dense for a convex program", solver="conic step")
        return program

    @property
    def energies(self) -> Array:
        """(n,) the factors that turn the scaled energies W of the pieces into W_i / p_i."""
        return np.asarray(self.loads * self.own / self.parts)

    @property
    def shifts(self) -> Array:
        """(n,) the shells in the units of the pieces."""
        return np.asarray(self.shells * self.loads * self.parts / self.own)

    def apply(self) -> ConeProgram:
        """The program for Clarabel, in T_i / N_i and the variables of each piece.

        A stuck piece uses three of its variables: the weight; y3, the force minus the force in the
        middle of the piece; and y5, the square of y3 divided by the weight.
        """
        from scipy import sparse  # 0.1 s to import: only when solving

        n, N, unit = len(self.which), self.loads, float(self.energies.max())
        A = self.stepper.A[np.ix_(self.which, self.which)] + np.diag(self.shells)
        width = n + LIFT * len(self.pieces)
        linear = np.zeros(width)
        around = self.stepper.A[self.which] @ self.now.carried
        linear[:n] = -N * (self.now.deflections[self.which] / self.parts + around) / unit
        for place, (i, piece) in enumerate(self.pieces):
            at = n + LIFT * place
            linear[at : at + LIFT] = piece.objective(self.shifts[i]) * (self.energies[i] / unit)
        quadratic = sparse.block_diag(
            (np.triu(A * N * (N[:, None] / unit)), sparse.csc_matrix((width - n,) * 2))
        )
        equalities = self._equalities(width)
        cones, constant = self._cones(width)
        balance = np.zeros(1 + 2 * n)
        balance[0], balance[1 : n + 1] = self.total / N.sum(), 1.0
        return ConeProgram(
            quadratic=sparse.csc_matrix(quadratic),
            linear=linear,
            constraints=sparse.csc_matrix(sparse.vstack((equalities, cones))),
            constant=np.append(balance, constant),
            equalities=len(balance),
        )

    def _equalities(self, width: int) -> csc_matrix:
        """Rows for the total force, then for the sums of weights and of forces of each asperity."""
        from scipy.sparse import csc_matrix

        n = len(self.which)
        rows = np.zeros((1 + 2 * n, width))
        rows[0, :n] = self.loads / self.loads.sum()
        rows[n + 1 + np.arange(n), np.arange(n)] = -1.0
        for place, (i, piece) in enumerate(self.pieces):
            weight = n + LIFT * place
            rows[1 + i, weight] = 1.0
            rows[n + 1 + i, weight] = piece.force
            rows[n + 1 + i, weight + Y3] = 1.0 if piece.rate == 0.0 else -piece.rate
        return csc_matrix(rows)

    def _cones(self, width: int) -> tuple[csc_matrix, Array]:
        """Rows and constants of the cones: for the bounds of each piece, then for its energy."""
        from scipy.sparse import csc_matrix, lil_matrix, vstack

        n, five = len(self.which), 1.5 * self.shifts.max() > FOUR_CONES_LIMIT
        starts = n + LIFT * np.arange(len(self.pieces))
        stuck = np.array([piece.rate == 0.0 for _, piece in self.pieces])
        bounds = lil_matrix((3 * len(starts), width))
        squares = lil_matrix((3 * int(stuck.sum()), width))
        for place, (at, (_, piece)) in enumerate(zip(starts, self.pieces, strict=True)):
            low = -piece.high if piece.rate == 0.0 else piece.low
            bounds[3 * place, at] = -(piece.high - low) / 2.0
            bounds[3 * place + 1, at] = (piece.high + low) / 2.0
            bounds[3 * place + 1, at + Y3] = -1.0
        for row, at in zip(range(0, squares.shape[0], 3), starts[stuck], strict=True):
            squares[row, at] = squares[row, at + Y5] = squares[row + 1, at + Y5] = -1.0
            squares[row + 1, at] = 1.0
            squares[row + 2, at + Y3] = -2.0
        moving = starts[~stuck]
        names = range(1 if five else 2, LIFT)
        lifts = power_cones([moving + name for name in names], width, ones=moving)
        rows = vstack((bounds, squares, lifts.matrix))
        plain = np.zeros(3 * (len(starts) + int(stuck.sum())))
        return csc_matrix(rows), np.append(plain, lifts.constant)

    def invert(self, raw: RawAnswer) -> tuple[Array, float]:
        """(N,) shear forces of all asperities of the scene, and the displacement x of the step."""
        n, unit = len(self.which), float(self.energies.max())
        forces = np.zeros(len(self.now.carried))
        forces[self.which] = np.clip(raw.x[:n], -1.0, 1.0) * self.loads
        return forces, float(-raw.multipliers[0]) * unit / float(self.loads.sum())

    def deflections(self, forces: Array) -> Array:
        """(N,) own deflections under these forces; 0 for asperities that are not in the program."""
        found = np.zeros(len(forces))
        for place, i in enumerate(self.which):
            part = float(forces[i] / self.loads[place])
            mine = [piece for k, piece in self.pieces if k == place]
            nearest = min(mine, key=lambda piece: piece.distance(part))
            found[i] = self.own[place] * min(max(nearest.deflection(part), -1.0), 1.0)
        return found
