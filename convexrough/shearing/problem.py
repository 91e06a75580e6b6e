"""The friction problem of a contact at constant normal load (Ciavarella-Jaeger), in increments.

A shear force Q on the pressed contact is carried as Q_i = f u_i with |u_i| <= P_i, and the
increments u minimise the energy of `shearing.energy` under sum u_i = T = Q / f. Displacements are
that problem's times c_t f. Where u >= 0 this is the reduced normal contact p = P - u of Ciavarella
and Jaeger, and the slip is its gap; but u = 0 is exact at Q = 0 and everything keeps its relative
accuracy as Q -> 0 (docs/theory/shear.md).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from convexrough import checks
from convexrough.arrays import Array, Indices, among_zeros
from convexrough.contact import Contact
from convexrough.errors import SolverError
from convexrough.influence.choice import couple
from convexrough.influence.shells import shells
from convexrough.kept import Keeper
from convexrough.normal.certificate import Certificate
from convexrough.normal.units import Units
from convexrough.progress import Announce
from convexrough.scene.scene import Scene
from convexrough.shearing.energy import TangentialEnergy
from convexrough.shearing.many_states import by_matrices, solve_together
from convexrough.shearing.newton import solve_in_turn
from convexrough.shearing.normal_map import States
from convexrough.sphere import hertz, mindlin


@dataclass(frozen=True, eq=False)
class TangentialProblem(TangentialEnergy, Keeper):
    """The loaded asperities of a contact, in own units, and what is proved of their loads.

    certificate : of the contact;  touching : (n,) the indices of these asperities in the scene
    """

    scene: Scene
    certificate: Certificate
    units: Units
    touching: Indices

    @classmethod
    def of(cls, contact: Contact) -> TangentialProblem:
        """That of a contact, which keeps it: coupled by the kind of operator it was pressed with.

        Raises InputError where the scene has no friction.
        """
        checks.friction(contact.scene.friction)
        return cls.pressed(contact)

    @classmethod
    def pressed(cls, contact: Contact) -> TangentialProblem:
        """The same, for what of it needs no friction."""
        return contact.keep(cls._assemble)

    @classmethod
    def _assemble(cls, contact: Contact) -> TangentialProblem:
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
            scene=scene,
            certificate=contact.certificate,
            units=units,
            touching=touching,
        )

    @property
    def friction(self) -> float:
        """f."""
        return checks.friction(self.scene.friction)

    @property
    def force_unit(self) -> float:
        """What increments are shear forces in [force]: f times the unit of loads."""
        return self.friction * self.units.force

    @property
    def travel_unit(self) -> float:
        """What tangential displacements are counted in [length]: c_t f times the unit of length."""
        ratio: float = mindlin.ratio(self.scene.material.poisson_ratio)
        return ratio * self.friction * self.units.length

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
        try:
            if by_matrices(self):
                return solve_together(self, totals)
            return solve_in_turn(self, totals, self.as_on_a_smooth_sphere, known, announce)
        except SolverError as error:
            if error.iterate is not None:
                error.iterate = self.to_scene(error.iterate * self.force_unit)
            raise

    def limited(self, totals: Array) -> Array:
        """T, and exactly sum P where it is that to rounding, or beyond."""
        limited: Array = np.where(self.at_limit(totals), self.limit, totals)
        return limited

    def as_on_a_smooth_sphere(self, total: float) -> Array:
        """(n,) deflections, up to a shift: what sphere P - T leaves of the displacements of P."""
        radius, modulus = self.scene.sphere_radius, self.scene.material.contact_modulus
        loads = np.maximum(self.limit - np.array([0.0, total]), 0.0) * self.units.force
        full, left = hertz.contact_radius(loads, modulus, radius)
        distances = self.scene.asperities.distances[self.touching]
        displaced: Array = hertz.surface_displacement(distances, left, radius)
        displaced = displaced - hertz.surface_displacement(distances, full, radius)
        return displaced / self.units.length

    def to_scene(self, values: NDArray[Any]) -> NDArray[Any]:
        """(..., n) values of the loaded asperities, among zeros for all others of the scene."""
        return among_zeros(values, self.touching, len(self.scene), axis=-1)
