"""Certified normal solutions of a scene at the levels that a load path asks for, each pressed once.

Levels are total loads. Approaches count from the first touch, and energies accordingly, so that all
is 0 at no load: only differences enter the tangential state.
"""

from __future__ import annotations

from bisect import bisect
from collections.abc import Iterable
from dataclasses import replace
from fractions import Fraction
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array
from convexrough.contact import solve
from convexrough.errors import SolverError
from convexrough.influence import Kind
from convexrough.influence.coupling import Influence
from convexrough.normal.problem import NormalProblem
from convexrough.progress import Announce
from convexrough.roundoff import ROUNDOFF, SAFETY
from convexrough.scene.scene import Scene
from convexrough.sphere import hertz

#: Levels closer than this, relative to themselves, are one: errors of the answer include it.
SAME = 16 * ROUNDOFF


class Level(NamedTuple):
    """The normal solution at one total load, and bounds on its errors. Arrays are (n,).

    load : [force];  approach : since the first touch [length];  energy : V [force length]
    loads : [force];  indentations : [length] minus the gap where open
    touching, open : proved
    rate : least dn_i/ds over dD0/ds of all asperities, n_i the indentation; nan at no load
    """

    load: float
    approach: float
    approach_error: float
    energy: float
    energy_error: float
    loads: Array
    load_errors: Array
    indentations: Array
    indentation_errors: Array
    touching: NDArray[np.bool_]
    open: NDArray[np.bool_]
    rate: float


class Levels:
    """The normal solutions of one scene, up to a highest load [force]."""

    def __init__(
        self,
        scene: Scene,
        highest: float,
        influence: Kind | None = None,
        announce: Announce | None = None,
    ) -> None:
        self.scene = scene
        self._announce = announce
        self._top = float(scene.offsets.max())
        self._problem = (
            NormalProblem.assemble(scene, load=highest, influence=influence) if highest else None
        )
        self._known = {0.0: self._no_load()}
        self._sorted = [0.0]

    @property
    def presses(self) -> int:
        """How many normal problems were solved."""
        return len(self._known) - 1

    @property
    def known(self) -> list[Level]:
        """All of them so far, lowest first."""
        return [self._known[load] for load in self._sorted]

    def at(self, level: Fraction | float) -> Level:
        """The solution at a level up to the highest, or at one that is the same to rounding."""
        load = float(level)
        place = bisect(self._sorted, load)
        for near in self._sorted[max(place - 1, 0) : place + 1]:
            if abs(near - load) <= SAME * near:
                return self._known[near]
        if self._announce is not None:
            self._announce(f"pressing level {len(self._known)}")
        self._known[load] = self._press(load)
        self._sorted.insert(place, load)
        return self._known[load]

    def need(self, levels: Iterable[Fraction]) -> None:
        """Press all of these."""
        for level in levels:
            self.at(level)

    @property
    def crowding_bound(self) -> float:
        """The largest row sum of A C with radii no solution up to the highest load exceeds.

        Up to 1 the indentations n_i of all candidates rise with the load at all levels: the map
        y -> 1 - A C y takes the box 0 <= y <= 1 into itself, and its fixed point is n' / D0'.
        """
        problem = self._problem
        if problem is None or len(problem) == 0:
            return 0.0
        stiffest = 1.0 / problem.stiffness(problem.bounds(problem.ceiling))
        coupled = problem.influence.apply(stiffest)
        return float((coupled + problem.influence.rounding(stiffest).of(coupled)).max())

    def _press(self, load: float) -> Level:
        assert self._problem is not None
        scene, units = self.scene, self._problem.units
        problem = replace(self._problem, load=load / units.force)
        contact = solve(problem)
        proof = contact.certificate
        k = hertz.local_coefficient(scene.material.contact_modulus, scene.relative_radii)
        own = hertz.indentation(contact.loads, k)
        low = hertz.indentation(np.maximum(contact.loads - proof.load_errors, 0.0), k)
        high = hertz.indentation(contact.loads + proof.load_errors, k)
        loaded = contact.loads > 0
        errors = np.where(loaded, np.maximum(own - low, high - own), proof.gap_errors)
        # dD0/ds is no more than 1 / (2 E* a) of any asperity.
        blur = (SAME + 2 * ROUNDOFF) * load
        softest = 2.0 * scene.material.contact_modulus * contact.contact_radii.max()
        energy, energy_error = self._energy(problem, contact.loads, proof.duality_gap)
        approach = contact.approach + self._top
        return Level(
            load=load,
            approach=approach,
            approach_error=proof.approach_error
            + blur / softest
            + float(scene.offset_errors.max())
            + 2 * ROUNDOFF * (abs(contact.approach) + abs(self._top)),
            energy=energy,
            energy_error=energy_error + 2 * blur * approach,
            loads=contact.loads,
            load_errors=proof.load_errors + blur,
            indentations=np.where(loaded, own, -contact.gaps),
            indentation_errors=errors + blur / softest + 8 * ROUNDOFF * (own + contact.gaps),
            touching=contact.status == "contact",
            open=contact.status == "open",
            rate=_least_rate(problem, contact.loads[problem.candidates] / units.force),
        )

    def _energy(
        self, problem: NormalProblem, scene_loads: Array, gap: float
    ) -> tuple[float, float]:
        """V and a bound on its error, with approaches since the first touch."""
        loads = scene_loads[problem.candidates] / problem.units.force
        displacement = problem.influence.apply(loads)
        local = 0.6 * hertz.indentation(loads, problem.coefficients)
        below = self._top / problem.units.length - problem.offsets
        energy = float(loads @ (local + 0.5 * displacement + below))
        off = problem.influence.rounding(loads).of(displacement) + 2 * problem.offset_errors
        size = local + np.abs(displacement) + np.abs(below)
        unit = problem.units.force * problem.units.length
        error = float(loads @ (off + 32 * ROUNDOFF * size)) * unit + gap
        return energy * unit, error * (1 + SAFETY)

    def _no_load(self) -> Level:
        scene, n = self.scene, len(self.scene)
        nothing = np.zeros(n)
        below = scene.offsets - self._top
        errors = scene.offset_errors + scene.offset_errors.max() + ROUNDOFF * np.abs(below)
        return Level(
            load=0.0,
            approach=0.0,
            approach_error=0.0,
            energy=0.0,
            energy_error=0.0,
            loads=nothing,
            load_errors=nothing,
            indentations=below,
            indentation_errors=errors,
            touching=np.zeros(n, dtype=bool),
            open=np.ones(n, dtype=bool),  # the last to leave has no gap, but carries nothing
            rate=np.nan,
        )


def _least_rate(problem: NormalProblem, loads: Array) -> float:
    """The least of y = (I + A C)^-1 1, C = diag(2 E* a): how fast each indentation grows.

    With z = C y among those that touch, (C^-1 + A) z = 1, and y = 1 - A z of the others.
    """
    touching = np.flatnonzero(loads)
    A: Influence = problem.influence
    root = 1.0 / np.sqrt(problem.stiffness(loads[touching], touching))
    if A.at_hand:
        scaled = A.submatrix(touching) * root * root[:, None]
        scaled[np.diag_indices_from(scaled)] += 1.0
        v = np.linalg.solve(scaled, root)
    else:
        from scipy.sparse.linalg import LinearOperator, cg  # only where there is no matrix

        part = A.among(touching)

        def product(x: Array) -> Array:
            return x + root * part.apply(root * x)

        shape = (len(touching), len(touching))
        v, failed = cg(LinearOperator(shape, product, dtype=np.float64), root, rtol=1e-8)
        if failed:
            raise SolverError("the rates of a normal solution are not found", solver="cg")
    z = np.zeros(len(loads))
    z[touching] = root * v
    y = 1.0 - A.apply(z)
    y[touching] = v / root
    return float(y.min())
