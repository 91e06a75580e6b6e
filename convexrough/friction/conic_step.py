"""The general step as one second-order cone program: a check of the solution by Newton's method.

The program and its symbols are those of docs/theory/without-order.md, "The step as one cone
program". The force of an asperity is T_B, plus a part on the piece where it sticks, plus a part on
each piece where it slips. Shear forces are divided by the coefficient of friction f, displacements
by c_t f with Mindlin's ratio c_t. In the energy of one asperity, forces and loads are also divided
by its load, and lengths by its indentation.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from convexrough.arrays import Array, Indices
from convexrough.convex.cones import FIVE_CONES_LIMIT, FOUR_CONES_LIMIT, power_cones
from convexrough.errors import SolverError
from convexrough.friction.general_step import OwnStep, Step, Stepper
from convexrough.influence import couple
from convexrough.influence.shells import shells
from convexrough.solvers.programs import ConeProgram, run_clarabel
from convexrough.sphere import hertz

#: Tolerance of the solver Clarabel, and the largest fraction of the distance to the boundary of the
#: cones by which one of its steps moves.
TOLERANCE, STEP = 1e-11, 0.9

#: Layers thinner than this fraction of the load are omitted; the errors of the solver are larger.
THIN = 1e-9


class Stick(NamedTuple):
    """The piece of W(T) on which the asperity sticks:  |T - force| <= half, where the deflection is
    own + softness (T - force). If its load does not rise in the step, `half` is 0.
    """

    force: float
    own: float
    half: float
    softness: float


class Slips(NamedTuple):
    """The m pieces of W(T) on which the asperity slips, as arrays (m,).

    The load N of the front runs from `high` at the beginning of the piece to `low`. At N

        T = force - rate N,    the deflection is  own - rate N^(2/3).
    """

    low: Array
    high: Array
    rate: Array
    force: Array
    own: Array


def pieces_of(indentations: Array, deflections: Array, own: float, k: float) -> tuple[Stick, Slips]:
    """The pieces of the energy of an asperity, from its memory curve before the step.

    indentations, deflections : (m,) vertices of this curve; no indentation exceeds `own`
    own : indentation of the asperity after the step, positive
    k   : coefficient of the asperity in Hertz's law
    """
    distinct = np.diff(indentations, prepend=-1.0) > 0
    s, xi = indentations[distinct] / own, deflections[distinct] / own
    N = hertz.load(s * own, k) / hertz.load(own, k)
    slopes = np.diff(xi) / np.diff(s)
    T = np.concatenate(([0.0], np.cumsum(slopes * np.diff(N))))
    grows = s[-1] * (1 + THIN) < 1
    softness = (1.0 - s[-1]) / (1.0 - N[-1]) if grows else 0.0
    stick = Stick(T[-1], xi[-1], 1.0 - N[-1] if grows else 0.0, softness)
    sign = np.array([[1.0], [-1.0]])
    low, high, rate = np.broadcast_arrays(N[:-1], N[1:], sign - slopes)
    force, deflection = sign + T[:-1] - slopes * low, sign + xi[:-1] - slopes * s[:-1]
    kept = (high - low > THIN) & (np.abs(rate) > THIN)
    return stick, Slips(*(each[kept] for each in (low, high, rate, force, deflection)))


class ConicStepper(Stepper):
    """General steps that Clarabel solves as cone programs."""

    def _solve(self, step: Step) -> tuple[Array, float, OwnStep]:
        """eta, x and the own steps, from the solution of the cone program."""
        which = np.flatnonzero(step.loads)
        program, unit = self._program(step, which)
        raw = run_clarabel(program, "conic step", TOLERANCE, max_step_fraction=STEP)
        forces = np.zeros(len(step.loads))
        forces[which] = np.clip(raw.x[: len(which)], -1.0, 1.0) * step.loads[which]
        x = float(-raw.multipliers[0]) * unit / float(step.loads.sum())
        eta = x - self.A @ (forces - step.now.forces)
        return eta, x, step.at(eta)

    def _program(self, step: Step, which: Indices) -> tuple[ConeProgram, float]:
        """The program, and the unit of its objective.

        The variables are T_i / N_i of the n asperities `which`, which touch after the step with the
        loads N_i; their n parts on the pieces where they stick; and the powers of N^(1/3) on each
        piece where they slip.

        Raises SolverError if the diagonal that makes the compliance matrix positive semidefinite
        (`shells`) is too large for the cones.
        """
        from scipy import sparse  # 0.1 s to import: only when solving

        n, N, own, parts = len(which), *(it[which] for it in (step.loads, step.own, step.parts))
        modulus, k = self.levels.scene.material.contact_modulus, self.coefficients[which]
        coupled = couple(self.levels.scene, which, 1.0 / (np.pi * modulus), "dense")
        wells = shells(coupled) if n > 1 else np.zeros(n)
        shifts = wells * N * parts / own  # `wells` in the units of the pieces
        if 1.5 * shifts.max(initial=0.0) > FIVE_CONES_LIMIT:
            raise SolverError("too dense for a convex program", solver="conic step")
        energies = N * own / parts  # the factors that turn scaled energies W into W_i / p_i
        unit = float(energies.max())
        vertices = step.curves.indentations[which], step.curves.deflections[which], own, k
        sticks, slips = zip(
            *(pieces_of(*each) for each in zip(*vertices, strict=True)), strict=True
        )
        stick = Stick(*np.transpose(sticks))
        slip = Slips(*map(np.concatenate, zip(*slips, strict=True)))
        owner = np.repeat(np.arange(n), [len(each.low) for each in slips])

        # The columns y1 (with five cones only), y2, ..., y5 and z of each piece of slip.
        m, names = len(owner), 6 if 1.5 * shifts.max() > FOUR_CONES_LIMIT else 5
        lift = 2 * n + np.arange(names * m).reshape(names, m)
        width, (_, y3, _, y5, z) = 2 * n + names * m, lift[-5:]
        powers = power_cones(list(lift), width)

        scale, shift = energies / unit, shifts[owner]
        around = self.A[which] @ step.now.forces
        linear = np.zeros(width)
        linear[:n] = -N * (step.now.deflections[which] / parts + around) / unit
        linear[n : 2 * n] = scale * (stick.own - shifts * stick.force)
        linear[y3] = scale[owner] * slip.rate * (shift * slip.force - slip.own)
        linear[y5] = scale[owner] * slip.rate**2 * (0.6 - shift / 2.0)
        linear[z] = scale[owner] * slip.rate**2 * shift / 2.0
        bent = np.zeros(width - n)
        bent[:n] = np.where(stick.half > 0, scale * (stick.softness - shifts), 0.0)
        A = self.A[np.ix_(which, which)] + np.diag(wells)
        quadratic = sparse.block_diag(
            (np.triu(A * N * (N[:, None] / unit)), sparse.diags_array(bent))
        )

        # T_i = T_B + the part that sticks + sum of rate (high - y3);  the sum of all T_i.
        rows = np.arange(n)
        sums = sparse.lil_array((1 + n, width))
        sums[0, :n] = N / N.sum()
        sums[1 + rows, rows], sums[1 + rows, n + rows], sums[1 + owner, y3] = 1.0, -1.0, slip.rate
        total = stick.force + np.bincount(owner, slip.rate * slip.high, n)

        # half >= |part that sticks|,  (high - low) / 2 >= |y3 - (high + low) / 2|
        bounded = np.concatenate((n + rows, y3))
        bounds = sparse.lil_array((3 * (n + m), width))
        bounds[3 * np.arange(n + m) + 1, bounded] = -1.0
        limits = np.zeros((n + m, 3))
        limits[:, 0] = np.concatenate((stick.half, (slip.high - slip.low) / 2.0))
        limits[n:, 1] = -(slip.high + slip.low) / 2.0
        program = ConeProgram(
            quadratic=sparse.csc_matrix(quadratic),
            linear=linear,
            constraints=sparse.csc_matrix(sparse.vstack((sums, bounds, powers.matrix))),
            constant=np.concatenate(
                ([step.total / N.sum()], total, limits.ravel(), powers.constant)
            ),
            equalities=1 + n,
        )
        return program, unit
