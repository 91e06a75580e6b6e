"""The normal contact problem in its own units: energy, gap, residual, bounds, convexity.

docs/theory/convexity.md, "The model", (1) and (2):

    minimise  Phi(P) = sum (3/5) k_i P_i^(5/3) + (1/2) P'AP - D'P   over P >= 0

with D_i = D0 + d_i prescribed (approach control), or with sum P_i prescribed and D0 the multiplier
of that constraint (load control). Its first-order conditions are the contact law

    P >= 0,   g = k P^(2/3) + A P - D >= 0,   P_i g_i = 0.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from convexrough import checks
from convexrough.arrays import Array, Indices, among_zeros, evenly, taken
from convexrough.influence import Influence, Kind, couple
from convexrough.influence.shells import fitted_shells, shells
from convexrough.normal.load_control import approach_bound, highest_approach, shifted_to_load
from convexrough.normal.units import Units
from convexrough.roundoff import ROUNDOFF, SAFETY
from convexrough.scene.scene import Scene
from convexrough.sphere import hertz
from convexrough.twofold import Twofold, exact_sum, in_parts, square_sum, whole

#: The part of the room between neighbours that fitted shells share out by size. A heuristic: any
#: part gives shells that hold, some of them sharper bounds (docs/theory/certificate.md, "Which
#: box", 3).
FITTED = 0.9

#: Candidates looked at together: what a cache holds.
CHUNK = 2**14


@dataclass(frozen=True, eq=False)
class NormalProblem:
    """The asperities of a scene that could touch, and what is prescribed. In own units.

    candidates    : (n,) their indices in the scene; all others carry nothing in any solution
    coefficients  : (n,) k of the local law
    offsets       : (n,) d_i = D_i - D0
    offset_errors : (n,) bound on the rounding error of D_i, without that of D0
    influence     : A
    shells        : (n,) 1 / (pi E* s_i): added to the diagonal of A they make it semidefinite
    approach      : D0, or None under load control
    load          : total load, or None under approach control
    ceiling       : upper bound on D0 at any solution
    """

    scene: Scene
    units: Units
    candidates: Indices
    coefficients: Array
    offsets: Array
    offset_errors: Array
    influence: Influence
    shells: Array
    approach: float | None
    load: float | None
    ceiling: float

    def __len__(self) -> int:
        return len(self.candidates)

    @classmethod
    def assemble(
        cls,
        scene: Scene,
        *,
        approach: float | None = None,
        load: float | None = None,
        influence: Kind | None = None,
        highest: float | None = None,
    ) -> NormalProblem:
        """Screen, scale and couple. `approach` [length] or `load` [force], exactly one.

        influence : how to couple; None for the cheapest exact way
        highest   : [length] an upper bound on the approach under this load, where one is known;
            else `highest_approach` finds one
        """
        checks.exactly_one("approach", approach, "load", load)
        offsets, errors = scene.offsets, scene.offset_errors
        modulus = scene.material.contact_modulus
        coefficients = evenly(partial(hertz.local_coefficient, modulus), scene.relative_radii)
        if approach is not None:
            ceiling = approach = checks.finite("approach", approach)
        else:
            assert load is not None  # exactly_one
            load = checks.positive("load", load)
            ceiling = highest_approach(scene, load, influence) if highest is None else highest

        # An asperity with D_i <= 0 cannot touch: A >= 0 and P >= 0 only raise the surface.
        prescribed = ceiling + offsets + errors + 6 * ROUNDOFF * abs(ceiling)
        candidates = scene.asperities.layout.sorted(prescribed > 0)
        top = float(prescribed.max(initial=0.0)) or 1.0
        units = Units.of(top, _middle(coefficients))

        scale = units.force / units.length / (np.pi * modulus)
        coupling = couple(scene, candidates, scale, influence)
        return cls(
            scene=scene,
            units=units,
            candidates=candidates,
            coefficients=evenly(lambda k: k * units.local, taken(coefficients, candidates)),
            offsets=offsets[candidates] / units.length,
            offset_errors=errors[candidates] / units.length,
            influence=coupling,
            shells=shells(coupling),
            approach=None if approach is None else approach / units.length,
            load=None if load is None else load / units.force,
            ceiling=ceiling / units.length,
        )

    def among(self, which: Indices) -> NormalProblem:
        """The problem of some of the candidates: all others carry nothing."""
        return replace(
            self,
            candidates=self.candidates[which],
            coefficients=taken(self.coefficients, which),
            offsets=self.offsets[which],
            offset_errors=self.offset_errors[which],
            influence=self.influence.among(which),
            shells=taken(self.shells, which),
        )

    def fitted_to(self, loads: Array) -> NormalProblem:
        """The same problem, with shells as large as neighbours of these loads allow."""
        with np.errstate(divide="ignore"):
            radii = (np.pi / 2.0) * self.influence.scale / self.stiffness(loads)
        shells = fitted_shells(self.influence, radii, FITTED)
        return replace(self, shells=shells)

    def energy(self, loads: Array, displacement: Array) -> float:
        """Phi(P), with D0 = 0 under load control; `displacement` is A P."""
        local = 0.6 * loads @ hertz.indentation(loads, self.coefficients)
        prescribed = self.offsets + (self.approach or 0.0)
        return float(local + loads @ (0.5 * displacement - prescribed))

    def gap(self, loads: Array, displacement: Array, approach: float) -> Array:
        """(n,) g = k P^(2/3) + A P - D, the gradient of Phi; `displacement` is A P."""
        local: Array = hertz.indentation(loads, self.coefficients)
        return local + displacement - self.offsets - approach

    def residual(self, loads: Array, approach: float, displacement: Array | None = None) -> float:
        """How far the contact law is from holding: max |g_i| where loaded, else max(-g_i, 0).

        displacement : A P, if known
        """
        if displacement is None:
            displacement = self.influence.apply(loads)
        gap = self.gap(loads, displacement, approach)
        return float(np.where(loads > 0, np.abs(gap), np.maximum(-gap, 0.0)).max(initial=0.0))

    def bounds(self, ceiling: float) -> Array:
        """(n,) U_i = (max(D_i, 0) / k_i)^(3/2): no solution with D0 <= ceiling carries more."""
        rounding = self.offset_errors + 6 * ROUNDOFF * abs(ceiling)
        alone: Array = hertz.load(ceiling + self.offsets + rounding, self.coefficients)
        return alone * (1 + SAFETY)

    def stiffness(self, loads: Array, which: Indices | slice = slice(None)) -> Array:
        """h_i = (2/3) k_i P_i^(-1/3): the local part of the Hessian, 1 / (2 E* a_i)."""
        with np.errstate(divide="ignore"):
            h: Array = (2.0 / 3.0) * self.coefficients[which] / np.cbrt(loads)
        return h

    def smooth_indentation(self) -> Array:
        """A start: the heights, riding on the surface that a smooth sphere would make."""
        radius, modulus = self.scene.sphere_radius, self.scene.material.contact_modulus
        load = self.load
        if load is None:
            smooth = hertz.local_coefficient(modulus, radius) * self.units.local
            alone = float(self.bounds(self.ceiling).sum())
            load = min(float(hertz.load(self.ceiling, smooth)), alone) or alone
        a = float(hertz.contact_radius(load * self.units.force, modulus, radius))
        distances = self.scene.asperities.distances[self.candidates]
        sunk = hertz.surface_displacement(distances, a, radius) / self.units.length
        indentation: Array = self.offsets - sunk
        return shifted_to_load(indentation, self.coefficients, load)

    def convexity_number(self, loads: Array) -> float:
        """theta = max 2 a_i / (pi s_i) over the box 0 <= P <= loads; Phi is convex where < 1.

        The smallest eigenvalue of the Hessian, relative to its diagonal, is at least 1 - theta:
        (3) of docs/theory/convexity.md.
        """
        return self.convexity_at(self.stiffness(loads))

    def convexity_at(self, stiffness: Array) -> float:
        """`convexity_number` up to loads of which the stiffness is known."""
        ratio = self.shells / stiffness
        return float(ratio.max(initial=0.0)) * (1 + SAFETY)

    def duality_gap(
        self,
        loads: Array,
        displacement: Array,
        approach: float,
        box: Array,
        error: Array | float = 0.0,
    ) -> float:
        """Upper bound on Phi(P) less its minimum over 0 <= P <= box, from the loads alone.

        docs/theory/exact-cones-answers.md, "A dual bound that trusts no solver": with
        M = A + diag(shells), positive semidefinite, and h_i = (3/5) k P^(5/3) - shell P^2 / 2,
        convex on the box where its convexity number is at most 1, any P gives a dual bound:

            min Phi >= -P'MP / 2 + sum min over 0 <= x <= box_i of [h_i(x) - (D - M P)_i x].

        Phi(P) less that is a sum of terms that are not negative. Under load control `approach` is
        any estimate of the multiplier, and what the loads miss the total by is counted with it.
        Infinite where the shells do not prove the box convex. Rounding is counted, so it is never
        quite 0.

        displacement : A P, and a bound on its error beyond that of a few roundings
        """
        if self.convexity_number(box) > 1:
            return np.inf
        total = rounding = 0.0
        error = np.broadcast_to(error, len(self))
        for start in range(0, len(self), CHUNK):
            some = slice(start, start + CHUNK)
            part = loads[some], displacement[some], approach, box[some], error[some]
            gap, lost = self._duality_terms(some, *part)
            total, rounding = total + gap, rounding + lost
        if self.load is not None:
            rounding += abs(approach) * self.missing(loads)
        return total + rounding

    def _duality_terms(
        self,
        some: slice,
        loads: Array,
        displacement: Array,
        approach: float,
        box: Array,
        error: Array,
    ) -> tuple[float, float]:
        """The sum of the terms of some candidates, and a bound on its rounding."""
        k, shells = self.coefficients[some], self.shells[some]
        slope = approach + self.offsets[some] - displacement - shells * loads  # (D - M P)_i
        best = _loads_at_slope(slope, box, k, shells)

        def charge(x: Array) -> Array:
            return np.asarray(x * (0.6 * hertz.indentation(x, k) - shells * x / 2.0 - slope))

        size = 0.6 * hertz.indentation(box, k) + shells * box + np.abs(slope)
        rounding = 32 * ROUNDOFF * float(((loads + best) * size).sum())
        # A slope off by e moves a term by e times the distance from P to the best x at most, and
        # the best x by e over the least curvature there.
        curvature = self.stiffness(box, some) - shells
        moved = np.divide(error, curvature, out=np.full(len(box), np.inf), where=curvature > 0)
        distance = np.minimum(np.abs(loads - best) + moved, np.maximum(loads, box))
        rounding += float((error * distance).sum()) * (1 + SAFETY)
        return float(np.maximum(charge(loads) - charge(best), 0.0).sum()), rounding

    def twofold_offsets(self) -> Twofold:
        """`offsets` from the scene's numbers, to twice as many digits: z - r^2 / (2 R)."""
        return in_parts(len(self), lambda some: self._twofold_offsets(self.candidates[some]))

    def _twofold_offsets(self, which: Indices) -> Twofold:
        scene, length = self.scene, self.units.length
        x, y = scene.asperities.positions[which].T / length
        further = np.zeros(len(which))
        if scene.geometry == "closest":
            further = scene.asperities.tip_radii[which] / length
        radius = Twofold(*exact_sum(np.full(len(which), scene.sphere_radius / length), further))
        drops = square_sum(x, y).over(radius + radius)
        return whole(scene.asperities.heights[which] / length) + -drops

    def missing(self, loads: Array) -> float:
        """Bound on what loads miss the prescribed total by."""
        assert self.load is not None
        return (abs(math.fsum(loads) - self.load) + 2 * ROUNDOFF * self.load) * (1 + SAFETY)

    def overhang(self, weights: Array, displacement: Array) -> float:
        """Upper bound on D0 at every solution of load control, from any trial loads.

        (2) of docs/theory/certificate-rounding.md, "Prescribed load".

        weights      : (n,) trial loads, not negative, not all zero
        displacement : A times weights
        """
        assert self.load is not None
        displacement = displacement + self.influence.rounding(weights).of(displacement)
        least = self.offsets - self.offset_errors
        return approach_bound(weights, displacement, self.coefficients, least, self.load)

    def to_scene(self, values: NDArray[Any]) -> Array:
        """Values of the candidates, set among zeros for all other asperities of the scene."""
        return among_zeros(values, self.candidates, len(self.scene))


def _middle(values: Array) -> float:
    """The median of about a thousand of these, spread evenly: any number of their size will do."""
    some = np.sort(values[:: max(1, len(values) // 1000)])
    return float(some[len(some) // 2])


def _loads_at_slope(slope: Array, box: Array, coefficients: Array, shells: Array) -> Array:
    """(n,) the x from 0 to box_i with h_i'(x) = slope_i, or the nearer end: h_i of the above.

    s = (x / box)^(1/3) solves k box^(2/3) s^2 - shell box s^3 = slope: by Newton's method, from
    a lower bound.
    """
    k_box, shell_box = hertz.indentation(box, coefficients), shells * box
    target = np.minimum(np.maximum(slope, 0.0), k_box - shell_box)
    s = np.sqrt(np.divide(target, k_box, out=np.zeros_like(target), where=k_box > 0))
    for _ in range(60):
        value = s * s * (k_box - shell_box * s) - target
        rate = s * (2.0 * k_box - 3.0 * shell_box * s)
        step = np.divide(value, rate, out=np.zeros_like(s), where=rate > 0)
        s = np.minimum(np.maximum(s - step, 0.0), 1.0)
        if np.abs(step).max(initial=0.0) < 1e-9:  # the next would be about its square
            break
    return np.asarray(box * s**3)
