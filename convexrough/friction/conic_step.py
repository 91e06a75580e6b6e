"""The general step as a second-order cone program, solved by Clarabel."""

from __future__ import annotations

import numpy as np

from convexrough.arrays import Array, Indices
from convexrough.convex.cones import FIVE_CONES_LIMIT, FOUR_CONES_LIMIT, power_cones
from convexrough.errors import SolverError
from convexrough.friction.general_step import OwnStep, Step, Stepper
from convexrough.solvers.programs import ConeProgram, run_clarabel

TOLERANCE = 1e-11  # of the solver Clarabel
STEP = 0.9  # the largest part of the way to the boundary of the cones that one of its steps moves
THIN = 1e-9  # thinner layers, as a part of the load, are omitted; errors of the solver are larger


class ConicStepper(Stepper):
    """General steps that Clarabel solves as second-order cone programs.

    docs/theory/without-order.md, "The step as one cone program", gives the program and its symbols.
    The force of an asperity is T_B, plus a part on the piece where it sticks, plus a part on each
    piece where it slips. Shear forces are divided by f, displacements by c_t f; in the energy of
    one asperity, forces and loads are also divided by its load, and lengths by its indentation.
    """

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
        piece where they slip. The `shells` make the compliance matrix positive semidefinite.
        """
        from scipy import sparse  # 0.1 s to import: only when solving

        n, N, own, parts = len(which), *(it[which] for it in (step.loads, step.own, step.parts))
        wells = self.influence.restricted(which).shells
        shifts = wells * N * parts / own  # `wells` in the units of the pieces
        if 1.5 * shifts.max(initial=0.0) > FIVE_CONES_LIMIT:
            what, advice = "asperities too dense for a convex program", 'use solver="newton"'
            raise SolverError(what, solver="conic step", advice=advice)
        energies = N * own / parts  # the factors that turn scaled energies W into W_i / p_i
        unit = float(energies.max())

        # The own curves: indentations s and deflections xi, loads and forces at the vertices.
        s, xi = step.curves.vertices[:, which] / own[:, None]
        loads, forces, slopes = (each[which] for each in step.curves.layers)
        loads, forces = loads / N[:, None], forces / N[:, None]
        # Where the load rises, an asperity sticks for |T - T_B| <= half; its deflection is that
        # at the last vertex + softness (T - T_B).
        grows = s[:, -1] * (1 + THIN) < 1
        half = np.where(grows, 1.0 - loads[:, -1], 0.0)
        softness = np.divide(1.0 - s[:, -1], half, out=np.zeros(n), where=grows)
        # While an asperity slips with a sign, its front falls through a layer, from the load `high`
        # to `low`. At the load N its force is force - rate N, its deflection shift - rate N^(2/3).
        sign = np.array([[1.0], [-1.0]])
        T, slope = forces[:, None, :-1], slopes[:, None]
        low, high, rate = np.broadcast_arrays(loads[:, None, :-1], loads[:, None, 1:], sign - slope)
        kept = (high - low > THIN) & (np.abs(rate) > THIN)
        force, moved = sign + T - slope * low, sign + xi[:, None, :-1] - slope * s[:, None, :-1]
        slipped = (low, high, rate, force, moved)
        owner, (low, high, rate, force, moved) = np.nonzero(kept)[0], (it[kept] for it in slipped)

        # The columns y1 (with five cones only), y2, ..., y5 and z of each piece of slip.
        m, names = len(owner), 6 if 1.5 * shifts.max() > FOUR_CONES_LIMIT else 5
        lift = 2 * n + np.arange(names * m).reshape(names, m)
        width, (_, y3, _, y5, z) = 2 * n + names * m, lift[-5:]
        cones, constant = power_cones(m, five=names == 6)
        powers = sparse.hstack((sparse.csr_array((len(constant), 2 * n)), cones))

        scale, shift = energies / unit, shifts[owner]
        around = self.A[which] @ step.now.forces
        linear = np.zeros(width)
        linear[:n] = -N * (step.now.deflections[which] / parts + around) / unit
        linear[n : 2 * n] = scale * (xi[:, -1] - shifts * forces[:, -1])
        linear[y3] = scale[owner] * rate * (shift * force - moved)
        linear[y5] = scale[owner] * rate**2 * (0.6 - shift / 2.0)
        linear[z] = scale[owner] * rate**2 * shift / 2.0
        bent = np.zeros(width - n)
        bent[:n] = np.where(half > 0, scale * (softness - shifts), 0.0)
        A = self.A[np.ix_(which, which)] + np.diag(wells)
        blocks = np.triu(A * N * (N[:, None] / unit)), sparse.diags_array(bent)

        # T_i = T_B + the part that sticks + sum of rate (high - y3);  the sum of all T_i.
        rows = np.arange(n)
        sums = sparse.lil_array((1 + n, width))
        sums[0, :n] = N / N.sum()
        sums[1 + rows, rows], sums[1 + rows, n + rows], sums[1 + owner, y3] = 1.0, -1.0, rate
        total = forces[:, -1] + np.bincount(owner, rate * high, n)

        # half >= |part that sticks|,  (high - low) / 2 >= |y3 - (high + low) / 2|
        bounds = sparse.lil_array((3 * (n + m), width))
        bounds[3 * np.arange(n + m) + 1, np.concatenate((n + rows, y3))] = -1.0
        limits = np.zeros((n + m, 3))
        limits[:, 0] = np.concatenate((half, (high - low) / 2.0))
        limits[n:, 1] = -(high + low) / 2.0
        program = ConeProgram(
            quadratic=sparse.csc_array(sparse.block_diag(blocks)),
            linear=linear,
            constraints=sparse.csc_array(sparse.vstack((sums, bounds, powers))),
            constant=np.hstack((step.total / N.sum(), total, limits.ravel(), constant)),
            equalities=1 + n,
        )
        return program, unit
