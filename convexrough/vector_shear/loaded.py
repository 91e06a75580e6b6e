"""The loaded asperities of a contact: Mindlin's law of each, and bounds on their loads.

An asperity with the load P and the shear force u has the deflection
eta = threshold [1 - (1 - u / P)^(2/3)], and slides beyond threshold = k P^(2/3). With the
coefficient of friction f and Mindlin's ratio c_t = (2 - nu) / (2 (1 - nu)), shear forces are in
units of f times the unit of loads, and displacements in units of c_t f times the unit of lengths.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from convexrough.arithmetic.balls import Ball, where
from convexrough.arrays import Array, Indices, among_zeros
from convexrough.contact import Contact
from convexrough.friction.levels import FrictionLevels
from convexrough.influence import Influence, couple
from convexrough.influence.shells import shells
from convexrough.normal.boxes import Scope
from convexrough.normal.problem import Units
from convexrough.roundoff import SAFETY
from convexrough.scene.scene import Scene
from convexrough.sphere import annulus

#: If the shear force over f is below this fraction of the total load, the state is proportional to
#: the force to all digits.
ELASTIC = Fraction(1, 10**15)


@dataclass(frozen=True, eq=False)
class Loaded:
    """n loaded asperities of a contact. Arrays are (n,), in scaled units.

    scope    : scope of the contact's certificate; "none" without a proof
    touching : indices of the loaded asperities in the scene
    loads, errors : P, and bounds on the errors;  thresholds : k P^(2/3)
    influence : operator A;  shells : a diagonal; A + diag(shells) is positive semidefinite
    sure     : True where proved to touch
    load_balls, threshold_balls : P and k P^(2/3) as balls where sure, 0 and 1 elsewhere
    stiffness : upper bound on 3 P / (2 k P^(2/3)) where sure, 0 elsewhere
    stray    : bound on the total load of all asperities that are neither sure nor proved open
    stray_effect : bound on the displacement of any asperity by this load
    """

    levels: FrictionLevels
    scene: Scene
    scope: Scope
    units: Units
    touching: Indices
    loads: Array
    errors: Array
    thresholds: Array
    influence: Influence
    shells: Array
    sure: NDArray[np.bool_]
    load_balls: Ball
    threshold_balls: Ball
    stiffness: Array
    stray: float
    stray_effect: float

    @classmethod
    def of(cls, contact: Contact) -> Self:
        """The loaded asperities of a contact, cached. Raises InputError without friction."""
        return contact.cached(cls._assemble)

    @classmethod
    def _assemble(cls, contact: Contact) -> Self:
        levels, scene = contact.cached(FrictionLevels), contact.scene
        level, units = levels.top, levels.units
        loaded = np.flatnonzero(level.loads.value > 0)
        touching = levels.candidates[loaded]
        modulus = scene.material.contact_modulus
        influence = couple(
            scene, touching, units.force / units.length / (np.pi * modulus), contact.influence
        )
        P, k = level.loads[loaded], level.problem.exact.coefficients
        k = k if len(k) == 1 else k[loaded]
        thresholds = k * P.two_thirds()
        sure = level.touching[loaded] & P.positive & thresholds.positive
        left = ~level.open
        left[loaded[sure]] = False
        stray = float(np.maximum(level.loads.upper, 0.0)[left].sum()) * (1 + SAFETY)
        nothing = Ball.exact(np.zeros(len(loaded)))
        return cls(
            levels=levels,
            scene=scene,
            scope=contact.certificate.scope if levels.proved else "none",
            units=units,
            touching=touching,
            loads=P.value,
            errors=P.error,
            thresholds=thresholds.value,
            influence=influence,
            shells=shells(influence),
            sure=sure,
            load_balls=where(sure, P, nothing),
            threshold_balls=where(sure, thresholds, nothing + 1.0),
            stiffness=np.where(sure, (1.5 * P.cbrt() / k).upper, 0.0),
            stray=stray,
            stray_effect=stray * level.problem.largest_entry * (1 + SAFETY) if stray else 0.0,
        )

    def __len__(self) -> int:
        return len(self.loads)

    @property
    def force_unit(self) -> float:
        """[force] the unit of shear forces."""
        return float(self.levels.force_unit.value)

    @property
    def travel_unit(self) -> float:
        """[length] the unit of tangential displacements."""
        return float(self.levels.travel_unit.value)

    @property
    def most(self) -> Array:
        """(n,) upper bounds on the loads P."""
        return (self.loads + self.errors) * (1 + SAFETY)

    def from_rest(self, height: Fraction) -> tuple[Array, Array]:
        """(n,) u and eta of `shear`, with the scalar kernel, under the shear force T [force]."""
        if height < ELASTIC * self.levels.load:
            shares = self.elastic.value * float(height / Fraction(self.units.force))
            return shares, shares / self.stiffest
        top, low = self.levels.top, self.levels.at(self.levels.load - height)
        u, eta = top.loads - low.loads, top.indentation - low.indentation
        return u.value[self.places], eta.value[self.places]

    def increments(self, deflections: Array) -> Array:
        """(n,) the shear forces u at these deflections eta; u = P beyond the threshold."""
        u: Array = self.loads * annulus.force(annulus.width_at(deflections / self.thresholds))
        return u

    def deflections(self, increments: Array) -> Array:
        """(n,) the deflections of these shear forces, 0 <= u <= P."""
        left = (self.loads - increments) / self.loads
        x = annulus.width_between(increments / self.loads, left)
        eta: Array = self.thresholds * annulus.deflection(x)
        return eta

    def slopes(self, deflections: Array) -> Array:
        """(n,) c = du/deta at these deflections eta; 0 where sliding."""
        c: Array = self.stiffest * (1.0 - annulus.width_at(deflections / self.thresholds))
        return c

    @cached_property
    def stiffest(self) -> Array:
        """(n,) the slopes c at eta = 0, which are 2 E* a."""
        c: Array = 1.5 * self.loads / self.thresholds
        return c

    @property
    def places(self) -> Indices:
        """(n,) indices of the loaded asperities among the candidates."""
        return self.levels.top.problem.places[self.touching]

    @cached_property
    def elastic(self) -> Ball:
        """(n,) parts of a shear force that the asperities carry if all stick.

        They are the derivatives of the loads with respect to the total load.
        """
        return self.levels.top.tangent.loads[self.places]

    def to_scene(self, values: NDArray[Any]) -> NDArray[Any]:
        """(N, ...) these values, and 0 for all other asperities of the scene."""
        return among_zeros(values, self.touching, len(self.scene))
