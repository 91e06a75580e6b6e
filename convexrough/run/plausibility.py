"""How far a contact is from where its model ceases to hold: numbers and warnings, no errors."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from typing import Any

import numpy as np

from convexrough.contact import Contact, closest_changes
from convexrough.errors import SolverError

#: Fewer asperities in contact than this are no rough surface.
FEW = 5

#: Contact radius over radius from which the parabola that stands for a sphere is off by 1 %.
STEEP = 0.2

#: Loads of this part of the largest, and greater, are looked at for what the geometry does to them.
HEAVY = 0.1

#: Relative difference between the geometries that is worth a word.
DIFFERENT = 0.01


def limits_of(contact: Contact) -> dict[str, Any]:
    """Keys of the summary, with no unit but that of pressure.

    extent       : how far contact reaches from the axis, over the radius of the sphere
    steepness    : the largest contact radius over the tip radius
    mean_pressure, hardness : the largest [force / length^2], and the material's, or None
    beyond_hardness : how many asperities are
    closest_change : the largest change of a load, relative to itself, in the geometry "closest";
        None where that is the geometry, or where it is not found
    """
    scene, touching = contact.scene, contact.loads > 0
    radii, hardness = contact.contact_radii, scene.material.hardness
    reach = np.hypot(*scene.contact_points.T) + radii
    change = None
    if scene.geometry == "summit" and touching.any():
        heavy = contact.loads >= HEAVY * contact.loads.max()
        with suppress(SolverError):
            changes = closest_changes(contact)[heavy] / contact.loads[heavy]
            change = float(np.abs(changes).max())
    return {
        "extent": float(reach[touching].max(initial=0.0)) / scene.sphere_radius,
        "steepness": float((radii / scene.asperities.tip_radii).max()),
        "mean_pressure": float(contact.mean_pressures.max()),
        "hardness": hardness,
        "beyond_hardness": int((contact.mean_pressures > (hardness or np.inf)).sum()),
        "closest_change": change,
    }


def doubts(normal: Mapping[str, Any], pressure_unit: str = "") -> Iterator[str]:
    """What a user should know of the summary of a contact, in words with numbers."""
    if 0 < normal["contact"] < FEW:
        yield (
            f"asperities in contact: {normal['contact']}, fewer than {FEW}: hardly a rough "
            "surface; is the spacing, or the approach or load, in the unit that was meant?"
        )
    if normal["extent"] > STEEP:
        yield (
            f"contact reaches to {normal['extent']:.3g} of the sphere's radius: a sphere is taken "
            f"for a paraboloid, which is off by 1 % at {STEEP:g}"
        )
    if normal["steepness"] > STEEP:
        yield (
            f"contact radius {normal['steepness']:.3g} of the tip radius: a tip is taken for a "
            f"paraboloid, which is off by 1 % at {STEEP:g}"
        )
    if normal["crowding"] > 1:
        yield (
            "contact discs overlap (crowding above 1): the asperity model does not hold; crowding "
            f"is {normal['crowding']:.3g}"
        )
    if normal["beyond_hardness"]:
        unit = f" {pressure_unit}" if pressure_unit else ""
        yield (
            f"mean pressure up to {normal['mean_pressure']:.4g}{unit} beyond the hardness, "
            f"{normal['hardness']:.4g}{unit}, on {normal['beyond_hardness']} of "
            f"{normal['contact']} asperities: they would yield"
        )


def geometry_matters(normal: Mapping[str, Any]) -> str:
    """How far the two geometries are apart, where that is worth a word."""
    change = normal["closest_change"] or 0.0
    if change <= DIFFERENT:
        return ""
    return (
        f'summit: with "closest", nearer to boundary elements, loads change by up to about '
        f"{100 * change:.2g} %"
    )
