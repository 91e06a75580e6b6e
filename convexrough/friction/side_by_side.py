"""Comparison of three methods for a load path: agreement and time.

The memory curve holds only if no indentation falls as the load rises. The general step (Newton's
method) and the conic step, which minimises the energy of the same step as a cone program, need no
such condition. They are taken once per segment, which is exact if no indentation falls.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from time import perf_counter
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from convexrough.arrays import Array, Indices
from convexrough.contact import Contact
from convexrough.convex.cones import FIVE_CONES_LIMIT, FOUR_CONES_LIMIT, power_cones
from convexrough.errors import SolverError
from convexrough.friction.general_step import OwnStep, Step, Stepper
from convexrough.friction.order import Order
from convexrough.friction.path import LoadPath, path_of, walk_of
from convexrough.influence import Kind
from convexrough.influence.shells import shells
from convexrough.plottable import Plottable
from convexrough.progress import LOGGER
from convexrough.record import LINE, Record, Table, Variables
from convexrough.scene.scene import Scene
from convexrough.solvers.programs import ConeProgram, run_clarabel

Way = Literal["general step", "memory curve", "conic step"]

TOLERANCE = 1e-11  # of the solver Clarabel
STEP = 0.9  # the largest part of the way to the boundary of the cones that one of its steps moves
THIN = 1e-9  # thinner layers, as a part of the load, are omitted; errors of the solver are larger


@dataclass(frozen=True, eq=False, repr=False)
class PathEntry(Record):
    """The result of one method for a load path.

    way     : the method: "general step", "memory curve" or "conic step"
    outcome : "answered", "refused" (the method does not apply to the path) or "failed"
    message : the reason why there is no result, or ""
    path    : the result; None if there is none
    force_disagreement, displacement_disagreement : largest differences of a shear force Q_i and of
        the displacement X from the first result, over the largest friction limit f P_i and |X|
    seconds : [s] time, including the normal solutions that were not cached

    >>> found = cr.compare_paths(scene, loads=[contact.load], forces=[0.2 * contact.load])
    >>> found.entries[0].way, found.entries[0].outcome
    ('general step', 'answered')
    """

    way: Way
    outcome: Literal["answered", "refused", "failed"]
    message: str = ""
    path: LoadPath | None = None
    force_disagreement: float = np.nan
    displacement_disagreement: float = np.nan
    seconds: float = np.nan


@dataclass(frozen=True, eq=False, repr=False)
class PathComparison(Table, Plottable):
    """The results of three methods for one load path, the general step first.

    scene : the scene
    loads, forces : (m,) [force] load P and shear force Q at the points of the path
    order : as in `LoadPath`; if it is "fails", the result of the memory curve is refused
    entries : the result of each method

    >>> found = cr.compare_paths(scene, loads=[contact.load], forces=[0.2 * contact.load])
    >>> max(each.displacement_disagreement for each in found.entries) < 1e-4
    True
    """

    scene: Scene
    loads: Array
    forces: Array
    order: Order
    entries: tuple[PathEntry, ...]

    def _rows(self) -> Iterator[tuple[str, str]]:
        yield "order", self.order
        for each in self.entries:
            Q, X = each.force_disagreement, each.displacement_disagreement
            answered = f"differs by {Q:.1e} in Q_i, {X:.1e} in X; {each.seconds:.2g} s"
            found = answered if each.outcome == "answered" else f"{each.outcome}: {each.message}"
            yield each.way, found[:LINE]

    def _variables(self) -> Variables:
        names = ["way", "outcome", "message", "seconds"]
        names += ["force_disagreement", "displacement_disagreement"]
        arrays: Variables = {
            name: (("entry",), np.array([getattr(each, name) for each in self.entries]))
            for name in names
        }
        nothing = np.full((len(self.loads), len(self.scene)), np.nan)
        paths = [each.path for each in self.entries]
        displacements = [nothing[:, 0] if it is None else it.displacements for it in paths]
        forces = [nothing if it is None else it.asperity_forces for it in paths]
        arrays["displacements"] = ("entry", "point"), np.array(displacements)
        arrays["asperity_forces"] = ("entry", "point", "asperity"), np.array(forces)
        return arrays


def compare_paths(
    scene: Scene,
    *,
    loads: ArrayLike,
    forces: ArrayLike,
    start: Contact | None = None,
    influence: Kind | None = None,
) -> PathComparison:
    """Comparison of the general step, the memory curve and the conic step on one path.

    docs/theory/without-order.md describes the steps, docs/theory/paths.md the memory curve.

    loads, forces, start, influence : as in `load_path`

    Raises InputError for the same reasons as `load_path`, and SolverError if no method answers.

    >>> P = contact.load
    >>> found = cr.compare_paths(scene, loads=[P, P / 2], forces=[0.3 * P, 0.0])
    >>> [each.way for each in found.entries if each.force_disagreement < 1e-4]
    ['general step', 'memory curve', 'conic step']
    """
    ways: dict[Way, tuple[int | None, type[Stepper]]] = {
        "general step": (1, Stepper),
        "memory curve": (None, Stepper),
        "conic step": (1, ConicStepper),
    }
    entries, reference = list[PathEntry](), None
    for way, (steps, stepper) in ways.items():
        LOGGER.info(way)
        began = perf_counter()
        try:
            contact, walk = walk_of(scene, loads, forces, start, influence, steps, stepper)
            if steps is None and walk.order == "fails":
                message = "it is not proved that indentations rise with the load"
                entries.append(PathEntry(way, "refused", message))
                continue
            path = path_of(contact, walk)
        except SolverError as error:
            entries.append(PathEntry(way, "failed", str(error)))
            continue
        seconds = perf_counter() - began
        reference = reference or path
        apart = np.abs(path.asperity_forces - reference.asperity_forces).max()
        largest = (scene.friction or 1.0) * float(path.asperity_loads.max()) or 1.0
        off = np.abs(path.displacements - reference.displacements).max()
        farthest = float(np.abs(reference.displacements).max()) or 1.0
        disagreements = float(apart) / largest, float(off / farthest)
        entries.append(PathEntry(way, "answered", "", path, *disagreements, seconds))
    if reference is None:
        raise SolverError(entries[0].message, solver="compare_paths", advice="use load_path")
    found = reference.loads, reference.forces, reference.order, tuple(entries)
    return PathComparison(scene, *found)


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
        wells = shells(self.influence.restricted(which))
        shifts = wells * N * parts / own  # `wells` in the units of the pieces
        if 1.5 * shifts.max(initial=0.0) > FIVE_CONES_LIMIT:
            raise SolverError("too dense for a convex program", solver="conic step")
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
        powers = power_cones(list(lift), width)

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
            quadratic=sparse.csc_matrix(sparse.block_diag(blocks)),
            linear=linear,
            constraints=sparse.csc_matrix(sparse.vstack((sums, bounds, powers.matrix))),
            constant=np.hstack((step.total / N.sum(), total, limits.ravel(), powers.constant)),
            equalities=1 + n,
        )
        return program, unit
