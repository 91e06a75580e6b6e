"""Measures of the validity of the asperity model for a contact, and warnings about its limits."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array
from convexrough.contact import Contact, covered, discs_of, mean_pressures
from convexrough.scene.base import along
from convexrough.scene.neighbours import crowding
from convexrough.scene.scene import Scene
from convexrough.sphere.smooth import SmoothEllipsoid, smooth_reference
from convexrough.tabular.columns import bound
from convexrough.tabular.units import UnitNames

#: Least numbers of asperities that may be a part of a larger array: in general, and on a lattice.
ARRAY, ON_LATTICE = 20, 7

#: Contact moduli [Pa] of soft rubber, and of diamond on a rigid body.
RUBBER, DIAMOND = 1e6, 1.2e12

# Limits for warnings:
FEW = 5  # asperities that touch
CUT_OFF = 0.7  # `array_extent`: there the pressure of a smooth sphere is 0.7 of the peak
CUT_RIM = 0.5  # `rim_touching`: not 0, because single tall asperities can touch at the rim
NEAR_END = 0.9  # part of the array's length within which contact is away from its ends
HIGH_FRICTION = 2.0  # which only clean metals in vacuum exceed
INACCURATE = 0.1  # bound on the error of a load, as a fraction of the largest load
STEEP = 0.2  # ratio of radii at which paraboloid and sphere differ by 1 %


def limits_of(contact: Contact) -> dict[str, Any]:
    """The measures of `limits` for a contact."""
    known = {"crowding": contact.crowding, "covered": contact.covered}
    return known | limits(contact.scene, contact.loads, contact.approach, contact.contact_radii)


def limits(scene: Scene, loads: Array, approach: float, radii: Array) -> dict[str, Any]:
    """Measures of the validity of the model, by name, for loads and contact radii (n,); without
    `crowding` and `covered`, which `Contact` has.
    """
    touching, hardness, pressures = loads > 0, scene.material.hardness, mean_pressures(loads, radii)
    reaches = (
        (np.linalg.norm(scene.contact_points[:, axes], axis=1) + radii)[touching] / R
        for R, axes in scene.curved
    )
    return {
        "loaded": int(touching.sum()),
        # largest distance of a point of contact from the axis, divided by the sphere's radius
        "extent": max((float(reach.max(initial=0.0)) for reach in reaches), default=0.0),
        "array_extent": 0.0 if ends(scene, touching) else array_extent(scene, float(loads.sum())),
        "rim_touching": rim_touching(scene, touching, approach),
        "axis_outside": axis_outside(scene),
        "steepness": float((radii / scene.asperities.tip_radii).max()),
        "mean_pressure": float(pressures.max()),  # [force / length^2]
        "hardness": hardness,
        "mismatch": scene.material.mismatch,  # Dundurs' beta, whose effect the model neglects
        "contact_modulus": scene.material.contact_modulus,
        "friction": scene.friction,
        "beyond_hardness": int((pressures > (hardness or np.inf)).sum()),
    }


def doubts_of(contact: Contact) -> Iterator[str]:
    """The reason why not every status is proved, if that is so."""
    if contact.certificate.scope == "none":
        yield "not certified: nothing is proved about these loads"
    elif undecided := int((contact.status == "undecided").sum()):
        yield f"not certified: undecided asperities: {undecided}"


def cautions_of(contact: Contact, known: Mapping[str, Any] | None = None) -> Iterator[str]:
    """A warning if the loads may be far from the exact solution, whose statuses are proved; and
    those of `cautions`. The limits of the contact may be `known`."""
    proof, largest = contact.certificate, float(contact.loads.max())
    loaded = int(((contact.loads > 0) & (proof.status == "open")).sum())
    far = proof.load_error > INACCURATE * largest and "contact" in proof.status
    if largest and (loaded or far):  # `cautions` warns of loads that are all 0
        off = f"{bound(100 * proof.load_error / largest, 3)} % of the largest load"
        yield (
            f"the loads err by up to {off}; asperities with a load that are proved open: "
            f"{loaded}; check the solver"
        )
    yield from cautions(known or limits_of(contact), contact.scene, contact.approach)


def cautions(normal: Mapping[str, Any], scene: Scene, approach: float) -> Iterator[str]:
    """Warnings about the `limits` of the model, which the certificate does not cover."""
    unit, modulus = (units := scene.units).unit("pressure"), normal["contact_modulus"]
    if unit is not None and not RUBBER <= (pascals := modulus * float(unit.size)) <= DIAMOND:
        limit = f"softer than rubber, {RUBBER:g}" if pascals < RUBBER else f"above {DIAMOND:g}"
        yield (
            f"the contact modulus is {described_modulus(modulus, units)}: {limit} Pa; check that "
            "it is in the units of [units]"
        )
    if (normal["friction"] or 0.0) > HIGH_FRICTION:
        yield (
            f"the coefficient of friction is {normal['friction']:g}: few pairs of bodies exceed "
            f"{HIGH_FRICTION:g}; it is a ratio, not in per cent"
        )
    if normal["loaded"] == 0:
        overlaps = (scene.offsets + approach > 0).any()  # then loads that are all 0 are wrong
        blamed = "loads" if overlaps else "sign and unit of the approach"
        yield f"no asperity carries a load: check the {blamed}"
    elif normal["loaded"] < FEW:
        yield (
            f"asperities in contact: {normal['loaded']}, fewer than {FEW}: too few for a rough "
            "surface; check the units of modulus, radii, spacing, heights and approach or load"
        )
    if normal["extent"] > STEEP:
        yield (
            f"contact extends to {normal['extent']:.3g} of the sphere's radius from the axis; "
            f"above {STEEP:g} the paraboloid of the model differs from a sphere by more than 1 %"
        )
    if normal["axis_outside"]:
        yield (
            "the axis of the sphere, at x = 0 and y = 0, is at the edge of the asperities or "
            "outside: shift their positions if these are measured from another point"
        )
    extent = normal["array_extent"]
    cut_off = normal["loaded"] >= FEW and extent is not None
    if cut_off and extent == 0:
        yield (
            "contact reaches the ends of the array along the axis of the cylinder: loads rise "
            "towards the ends, and the approach depends on the length of the array; judge a long "
            "cylinder by the middle of a long array"
        )
    elif cut_off and extent < CUT_OFF:
        yield (
            f"contact reaches the rim of the array, which is at {extent:.3g} of the contact radius "
            "of the smooth sphere: the loads depend on the size of the array; check the unit of "
            "the sphere's radius, or use a larger array"
        )
    elif cut_off and normal["rim_touching"] > CUT_RIM:
        yield (
            f"{normal['rim_touching']:.0%} of the asperities at the rim of the array touch; "
            "asperities beyond the rim, which the scene lacks, could carry load too; use a larger "
            "array"
        )
    if normal["steepness"] > STEEP:
        yield (
            f"the contact radius is up to {normal['steepness']:.3g} of the tip radius; above "
            f"{STEEP:g} the paraboloid of the model differs from a sphere by more than 1 %"
        )
    if normal["crowding"] > 1:
        yield (
            f"contact discs overlap (crowding {normal['crowding']:.3g}, above 1): the asperity "
            "model does not apply; check the units of the modulus, the load and the radii"
        )
    if normal["covered"]:
        yield (
            f"open summits under or beside a contact disc: {normal['covered']}; a point force does "
            "not represent the pressure of the disc at these summits"
        )
    if normal["beyond_hardness"]:
        named = f" {units.name('pressure')}".rstrip()
        yield (
            f"mean pressure up to {normal['mean_pressure']:.4g}{named} exceeds the hardness "
            f"{normal['hardness']:.4g}{named} on {normal['beyond_hardness']} of "
            f"{normal['loaded']} asperities: they would yield"
        )


def cautions_about(
    scene: Scene, loads: Array, approach: float, radii: Array | None = None
) -> list[str]:
    """The warnings of `cautions` for loads (n,) [force] at an approach [length], which may come
    with the contact radii (n,) [length].
    """
    radii = discs_of(scene, loads) if radii is None else radii
    apart = scene.lattice is not None and 2 * radii.max() < 0.99 * scene.lattice.spacing
    near = 0.0 if apart else crowding(scene.contact_points, radii)
    found = {"crowding": near, "covered": covered(scene, radii)}
    return [*cautions(found | limits(scene, loads, approach, radii), scene, approach)]


def is_array(scene: Scene) -> bool:
    """True if the asperities may be a part of a larger array."""
    return len(scene) >= ARRAY or (len(scene) >= ON_LATTICE and scene.lattice is not None)


def axis_outside(scene: Scene) -> bool:
    """True for an array whose asperities do not surround the axis of the sphere."""
    low, high = scene.asperities.layout.corners
    outside = (low < high) & ((low >= 0) | (high <= 0))
    return is_array(scene) and any(bool(outside[axes].any()) for _, axes in scene.curved)


def rim_touching(scene: Scene, touching: NDArray[np.bool_], approach: float) -> float:
    """Fraction that touches of the rim (the farthest in each of 16 sectors); 0 without an array, or
    if asperities are equal and none of the same pattern beyond the rim could touch.
    """
    layout, asperities = scene.asperities.layout, scene.asperities
    equal = np.ptp(asperities.heights) == 0 == np.ptp(asperities.tip_radii)
    if not is_array(scene) or (equal and scene.reach(approach) <= layout.filled * (1 + 1e-9)):
        return 0.0
    return np.count_nonzero(touching[layout.rim]) / len(layout.rim)


def ends(scene: Scene, touching: NDArray[np.bool_]) -> bool:
    """True for a cylinder whose contact reaches an end of the array along its axis."""
    flat = np.isinf(along(scene.sphere_radius))
    if flat.sum() != 1 or not is_array(scene):
        return False
    place = scene.asperities.positions[:, flat].ravel()
    reach = np.abs(place - (place.min() + place.max()) / 2)
    return bool(reach[touching].max(initial=0.0) > NEAR_END * reach.max() > 0)


def array_extent(scene: Scene, load: float) -> float | None:
    """The smaller of max |x| / a and max |y| / b over the asperities, with the half widths a and b
    of a smooth body's contact at this load; None without an array, load or such a contact."""
    smooth = smooth_reference(scene, load) if load > 0 and is_array(scene) else None
    if smooth is None:
        return None
    axes = smooth.semi_axes if isinstance(smooth, SmoothEllipsoid) else smooth.contact_radius
    low, high = scene.asperities.layout.corners
    reached = np.maximum(-low, high)
    return float((reached / axes)[reached > 0].min(initial=np.inf))


def described_modulus(modulus: float, units: UnitNames) -> str:
    """A contact modulus as text, also in pascals if the units are named."""
    unit = units.unit("pressure")
    if unit is None:
        return f"{modulus:.10g}"
    return f"{modulus:.10g} {unit.name}  ({modulus * float(unit.size):.4g} Pa)"
