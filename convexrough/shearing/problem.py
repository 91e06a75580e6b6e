"""The friction problem of a contact at constant normal load (Ciavarella-Jaeger), in increments.

A shear force Q on the pressed contact is carried as Q_i = f u_i with |u_i| <= P_i, and the
increments u minimise the energy of `convexrough.shearing.energy` under sum u_i = T = Q / f.
Displacements are that problem's times c_t f. Where u >= 0 this is the reduced normal contact
p = P - u of Ciavarella and Jaeger, and the slip is its gap; but u = 0 is exact at Q = 0 and
everything keeps its relative accuracy as Q -> 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from convexrough.arrays import Array, Indices
from convexrough.contact import Contact
from convexrough.influence import couple
from convexrough.influence.shells import shells
from convexrough.normal.units import Units
from convexrough.progress import Announce
from convexrough.shearing.energy import TangentialEnergy
from convexrough.shearing.newton import States, by_matrices, solve_in_turn, solve_together
from convexrough.sphere import hertz

__all__ = ["States", "TangentialProblem"]


@dataclass(frozen=True, eq=False)
class TangentialProblem(TangentialEnergy):
    """The loaded asperities of a contact, in own units.

    touching : (n,) their indices in the scene
    """

    contact: Contact
    units: Units
    touching: Indices

    @classmethod
    @lru_cache(maxsize=4)
    def of(cls, contact: Contact) -> TangentialProblem:
        """Coupled by the same kind of operator as the contact was pressed with."""
        scene = contact.scene
        touching = np.flatnonzero(contact.loads)
        modulus = scene.material.contact_modulus
        k = hertz.local_coefficient(modulus, scene.relative_radii[touching])
        largest = contact.contact_radii.max() ** 2 / scene.relative_radii.min()
        units = Units.of(float(largest), float(np.median(k)))
        scale = units.force / units.length / (np.pi * modulus)
        influence = couple(scene, touching, scale, contact.influence)
        loads = contact.loads[touching] / units.force
        return cls(
            loads=loads,
            ceilings=hertz.indentation(loads, k * units.local),
            influence=influence,
            shells=shells(influence),
            contact=contact,
            units=units,
            touching=touching,
        )

    def solve(
        self,
        totals: Array,
        *,
        known: States | None = None,
        announce: Announce | None = None,
    ) -> States:
        """States at the given total increments 0 <= T <= sum P.

        known    : states to start from, where states are solved one after the other
        announce : told a line for each of these
        """
        if by_matrices(self):
            return solve_together(self, totals)
        return solve_in_turn(self, totals, self.as_on_a_smooth_sphere, known, announce)

    def limited(self, totals: Array) -> Array:
        """T, and exactly sum P where it is that to rounding, or beyond."""
        limited: Array = np.where(self.at_limit(totals), self.limit, totals)
        return limited

    def as_on_a_smooth_sphere(self, total: float) -> Array:
        """(n,) deflections, up to a shift: what sphere P - T leaves of the displacements of P."""
        scene = self.contact.scene
        radius, modulus = scene.sphere_radius, scene.material.contact_modulus
        loads = np.maximum(self.limit - np.array([0.0, total]), 0.0) * self.units.force
        full, left = hertz.contact_radius(loads, modulus, radius)
        distances = scene.asperities.distances[self.touching]
        displaced: Array = hertz.surface_displacement(distances, left, radius)
        displaced = displaced - hertz.surface_displacement(distances, full, radius)
        return displaced / self.units.length
