"""Slips and losses by the appendix of Dini and Hills (2009), equations [A1] to [A15].

Forces and stick discs are those of `shear`; docs/validation.md says how the methods differ.
Displacements and energies are for both bodies, and so twice those of the paper.
"""

from __future__ import annotations

import numpy as np

from convexrough import fields
from convexrough.arrays import Array
from convexrough.contact import Contact
from convexrough.friction.shear import ShearState, shear
from convexrough.sphere import mindlin


def displacements(state: ShearState) -> Array:
    """(n,) [length] surface displacement along the force at each loaded asperity, else nan."""
    contact = state.contact
    touching = np.flatnonzero(contact.loads)
    found = np.full(len(contact.loads), np.nan)
    found[touching] = fields.shear_displacement(state, contact.scene.contact_points[touching])
    return found


def slips(state: ShearState) -> Array:
    """(n,) [length] slips of sliding asperities, 0 for others; positive along positive Q."""
    u, adhered = displacements(state), state.stick_radii > 0
    sliding = (state.contact.loads > 0) & ~adhered
    slips = np.zeros(len(u))
    if sliding.any():
        furthest = u[sliding][np.argmax(np.abs(u[sliding]))]
        slips[sliding] = (u[adhered].mean() if adhered.any() else furthest) - u[sliding]
    return slips


def energies(state: ShearState) -> Array:
    """(n,) [force length] energy lost at each asperity per steady cycle between Q and -Q."""
    contact, scene = state.contact, state.contact.scene
    limits = scene.friction * contact.loads
    indentations = contact.contact_radii**2 / scene.relative_radii
    scales = 4.8 * mindlin.ratio(scene.material.poisson_ratio) * scene.friction * indentations
    shares = np.minimum(np.abs(state.forces) / np.where(limits > 0, limits, 1.0), 1.0)
    forwards = np.sign(state.force) * slips(state)
    return limits * (scales * mindlin.loss(shares) + 4.0 * forwards)


def cycle_energy(contact: Contact, maximum: float) -> float:
    """[force length] energy lost per steady cycle between `maximum` and -`maximum` [force]."""
    return float(energies(shear(contact, force=maximum)).sum())
