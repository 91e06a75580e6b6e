"""What the summary of a run says of the model of a contact, in words."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from typing import Any

import numpy as np

from convexrough import plausibility
from convexrough.contact import Contact, closest_changes
from convexrough.errors import SolverError
from convexrough.tabular.units import UnitNames

#: Loads of this part of the largest, and greater, are looked at for what the geometry does to them.
HEAVY = 0.1

#: Relative difference between the geometries that is worth a word.
DIFFERENT = 0.01


def limits_of(contact: Contact) -> dict[str, Any]:
    """Keys of the summary, with no unit but that of pressure: also those of `plausibility`.

    geometry     : where asperities meet the base
    contact_modulus : [force / length^2]
    closest_change : the largest change of a load, relative to itself, in the geometry "closest";
        None where that is the geometry, or where it is not found
    """
    scene, change = contact.scene, None
    if scene.geometry == "summit" and contact.loads.any():
        heavy = contact.loads >= HEAVY * contact.loads.max()
        with suppress(SolverError):
            changes = closest_changes(contact)[heavy] / contact.loads[heavy]
            change = float(np.abs(changes).max())
    return {
        **plausibility.limits_of(contact),
        "geometry": scene.geometry,
        "contact_modulus": scene.material.contact_modulus,
        "closest_change": change,
    }


def neglected(normal: Mapping[str, Any]) -> str:
    """What is left out of two different bodies, with its size."""
    if not (beta := normal["mismatch"]):
        return ""
    return (
        f"Dundurs' beta = {beta:.3g}, neglected: pressing would shear the surfaces by some "
        f"{abs(100 * beta):.2g} % of the pressure"
    )


def described_geometry(normal: Mapping[str, Any]) -> str:
    """Its name, and how far the other one is apart, where that is worth a word."""
    change, name = normal["closest_change"] or 0.0, str(normal["geometry"])
    if change <= DIFFERENT:
        return name
    return (
        f'{name}: with "closest", nearer to boundary elements, loads change by up to about '
        f"{100 * change:.2g} %"
    )


def described_modulus(modulus: float, units: UnitNames) -> str:
    """A contact modulus, also in pascals where the units are named."""
    unit = units.unit("pressure")
    if unit is None:
        return f"{modulus:.10g}"
    return f"{modulus:.10g} {unit.name}  ({modulus * float(unit.size):.4g} Pa)"
