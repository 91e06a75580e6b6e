"""How far a contact is from where its model ceases to hold: numbers, and warnings in words."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from convexrough.contact import Contact
from convexrough.tabular.units import UnitNames

#: Fewer asperities in contact than this are no rough surface.
FEW = 5

#: Contact moduli [Pa] of soft rubber, and of diamond on a rigid body.
RUBBER, DIAMOND = 1e6, 1.2e12

#: Contact radius over radius from which the parabola differs from the sphere by 1 %.
STEEP = 0.2


def limits_of(contact: Contact) -> dict[str, Any]:
    """Numbers that tell how far the model holds, with no unit but that of pressure.

    contact      : how many asperities touch;  covered, crowding : as in `Contact`
    extent       : how far contact reaches from the axis, over the radius of the base
    steepness    : the largest contact radius over the tip radius
    mean_pressure, hardness : the largest [force / length^2], and the material's, or None
    beyond_hardness : how many asperities are
    mismatch     : Dundurs' beta of two bodies, which is neglected
    """
    scene, touching = contact.scene, contact.loads > 0
    radii, hardness = contact.contact_radii, scene.material.hardness
    reaches = (
        (np.linalg.norm(scene.contact_points[touching, axes], axis=1) + radii[touching]) / R
        for R, axes in scene.curved
    )
    return {
        "contact": int(touching.sum()),
        "crowding": contact.crowding,
        "covered": contact.covered,
        "extent": max((float(reach.max(initial=0.0)) for reach in reaches), default=0.0),
        "steepness": float((radii / scene.asperities.tip_radii).max()),
        "mean_pressure": float(contact.mean_pressures.max()),
        "hardness": hardness,
        "mismatch": scene.material.mismatch,
        "beyond_hardness": int((contact.mean_pressures > (hardness or np.inf)).sum()),
    }


def warnings_of(contact: Contact) -> Iterator[str]:
    """What a user should know of a contact before relying on it, in words with numbers."""
    if contact.certificate.scope == "none":
        yield "not certified: these loads come without any proof"
    elif undecided := int((contact.status == "undecided").sum()):
        yield f"not certified: {undecided} of the asperities undecided"
    yield from doubts(limits_of(contact))


def doubts(normal: Mapping[str, Any], pressure_unit: str = "") -> Iterator[str]:
    """What a user should know of the summary of a contact, in words with numbers."""
    if 0 < normal["contact"] < FEW:
        yield (
            f"asperities in contact: {normal['contact']}, fewer than {FEW}: hardly a rough "
            "surface; is the spacing, or the approach or load, in the unit that was meant?"
        )
    if normal["extent"] > STEEP:
        yield (
            f"contact reaches to {normal['extent']:.3g} of the base's radius: its paraboloid "
            f"differs from a sphere by 1 % at {STEEP:g}"
        )
    if normal["steepness"] > STEEP:
        yield (
            f"contact radius is {normal['steepness']:.3g} of the tip radius: the paraboloid of a "
            f"tip differs from a sphere by 1 % at {STEEP:g}"
        )
    if normal["crowding"] > 1:
        yield (
            "contact discs overlap (crowding above 1): the asperity model does not hold; crowding "
            f"is {normal['crowding']:.3g}"
        )
    if normal["covered"]:
        yield (
            f"open summits under a contact disc: {normal['covered']}; a point force does "
            "not stand for its pressure there"
        )
    if normal["beyond_hardness"]:
        unit = f" {pressure_unit}" if pressure_unit else ""
        yield (
            f"mean pressure up to {normal['mean_pressure']:.4g}{unit} beyond the hardness, "
            f"{normal['hardness']:.4g}{unit}, on {normal['beyond_hardness']} of "
            f"{normal['contact']} asperities: they would yield"
        )


def unlikely_modulus(modulus: float, units: UnitNames) -> Iterator[str]:
    """A contact modulus that only gels have, or no pair of bodies, where units are named."""
    unit = units.unit("pressure")
    if unit is not None and not RUBBER <= (pascals := modulus * float(unit.size)) <= DIAMOND:
        limit = f"softer than rubber, {RUBBER:g}" if pascals < RUBBER else f"above {DIAMOND:g}"
        yield (
            f"contact modulus is {described_modulus(modulus, units)}: {limit} Pa; is it in the "
            "units of [units]?"
        )


def described_modulus(modulus: float, units: UnitNames) -> str:
    """A contact modulus, also in pascals where the units are named."""
    unit = units.unit("pressure")
    if unit is None:
        return f"{modulus:.10g}"
    return f"{modulus:.10g} {unit.name}  ({modulus * float(unit.size):.4g} Pa)"
