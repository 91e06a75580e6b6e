"""The slider page: one HTML file that shows precomputed states after loading from rest.

The page steps through these states and shows their numbers unchanged. The only results that it
computes are loops, by Masing's rule (docs/theory/paths.md).
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from importlib.resources import files
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from convexrough import checks
from convexrough.arrays import Indices
from convexrough.contact import Contact
from convexrough.errors import InputError
from convexrough.friction.path import history
from convexrough.friction.steady import cycles
from convexrough.scene.base import sphere_radius
from convexrough.scene.rings import evenly_chosen
from convexrough.sphere.smooth import smooth
from convexrough.tabular.columns import bound

#: Largest and smallest number of forces of the slider; largest product with that of touching
#: asperities, if more than the smallest number.
FORCES, FEWEST_FORCES, STATES = 101, 21, 400_000

#: MOST_DRAWN: largest number of discs, and of dots for open asperities. MOST_FOLLOWED: largest
#: number of asperities with curves. These limits keep a page below 2 MB.
MOST_DRAWN, MOST_FOLLOWED = 5_000, 200


def slider_html(contact: Contact, proved: Sequence[str]) -> str:
    """The page as text; `proved` are lines that say what is proved of the contact.

    Raises InputError if nothing touches, the body is not a sphere, or friction is not given.
    """
    found = json.dumps(slider_data(contact, proved), separators=(",", ":"))
    template = files("convexrough.plots").joinpath("slider.html").read_text(encoding="utf-8")
    return template.replace("{{data}}", found.replace("<", "\\u003c"))


def slider_data(contact: Contact, proved: Sequence[str]) -> dict[str, Any]:
    """The data of the page, with five digits: first loading, and steady cycles.

    Lengths are in a_H, forces in f P, displacements in X0 of `plots.style`. `stick` has a row per
    force and a column per disc: the stick radius in thousandths of the contact radius, 0 where
    sliding, -1 where undecided.
    """
    sphere_radius(contact.scene.sphere_radius, "slider page")
    if contact.load == 0:
        raise InputError("slider page", found="no asperity that touches", expected="a contact")
    f, touching = checks.friction(contact.scene.friction), np.flatnonzero(contact.loads)
    limit = f * contact.load
    count = int(np.clip(STATES // len(touching), FEWEST_FORCES, FORCES))
    fractions = np.linspace(0.0, 1.0, count)
    steady = cycles(contact, fractions * limit)
    loading = history(contact, forces=fractions * limit)
    sphere = smooth(contact.scene, load=contact.load)
    a_H, X0 = sphere.contact_radius, float(sphere.displacement(limit))
    shown = _some(touching, MOST_DRAWN)
    away = np.argsort(contact.scene.asperities.distances[shown], kind="stable")
    followed = np.array(evenly_chosen(away.tolist(), MOST_FOLLOWED), dtype=np.intp)
    which = shown[followed]
    points, radii = contact.scene.contact_points / a_H, contact.contact_radii[shown] / a_H
    radii *= np.sqrt(len(touching) / len(shown))  # together they cover the same area
    edge = 1.06 * max(1.0, float((np.hypot(*points[shown].T) + radii).max()))
    empty = _some(np.flatnonzero(contact.loads == 0), MOST_DRAWN)
    empty = empty[np.abs(points[empty]).max(axis=1) < edge]
    shares = loading.asperity_forces[:, shown] / (f * contact.loads[shown])
    statuses = np.array([each.status for each in steady])
    radius = np.rint(1000.0 * np.cbrt(np.maximum(1.0 - shares, 0.0)))
    stick = np.select([statuses[:, shown] == status for status in ("sliding", "undecided")],
                      [0, -1], np.maximum(radius, 1.0).astype(int))  # fmt: skip
    stuck = np.cbrt(1.0 - fractions)
    moved = np.array([each.displacement_amplitude for each in steady])
    length, force = (f" {unit}".rstrip() for unit in contact.scene.units)
    left_out = {
        f"{len(shown):,} of {len(touching):,} touching asperities are drawn, chosen at random, as "
        "larger discs.": len(shown) < len(touching),
        f"{len(which):,} of the touching asperities can be selected.": len(which) < len(touching),
        f"The slider has {count} positions.": count < FORCES,
    }
    return {
        "units": contact.scene.units._asdict(),
        "touching": len(touching),
        "edge": _digits(edge),
        "certificate": list(proved),
        "letters": [
            ["f P", f"{limit:.5g}{force}", "the largest shear force: gross sliding"],
            ["a_H", f"{a_H:.5g}{length}", "contact radius of the smooth sphere"],
            ["X_0", f"{X0:.5g}{length}", "displacement X of the smooth sphere at gross sliding"],
            ["X", "", "relative displacement of distant points of the two bodies"],
            ["X_i, s_i, a_i", "", "deflection of an asperity, its gross slip, its contact radius"],
            ["W_0", "", "scale of the loss, 24/5 f P X\u2080"],
            ["k", "", "initial stiffness of the contact; Q/k is the elastic part of X"],
        ],
        "left_out": [sentence for sentence, holds in left_out.items() if holds],
        "states": {
            "fraction": _digits(fractions),
            "force": _digits(fractions * limit),
            "length": _digits(moved),
            "displacement": _digits(moved / X0),
            "displacement_error": [bound(each.displacement_error) for each in steady],
            "loss": _digits([each.loss_normalised for each in steady]),
            "smooth_loss": _digits([each.smooth_normalised for each in steady]),
            "smooth_displacement": _digits(1.0 - stuck**2),
            "smooth_stick": _digits(stuck),
            "sliding": (statuses == "sliding").sum(axis=1).tolist(),
            "partial": np.isin(statuses, ("partial", "stuck")).sum(axis=1).tolist(),
            "undecided": (statuses == "undecided").sum(axis=1).tolist(),
        },
        "discs": {"index": shown.tolist(), "x": _digits(points[shown, 0]),
                  "y": _digits(points[shown, 1]), "radius": _digits(radii)},
        "stick": stick.tolist(),
        "open": {"x": _digits(points[empty, 0]), "y": _digits(points[empty, 1])},
        "followed": {
            "disc": followed.tolist(),
            "x": _digits(contact.scene.asperities.positions[which, 0]),
            "y": _digits(contact.scene.asperities.positions[which, 1]),
            "status": contact.status[which].tolist(),
            "load": _digits(contact.loads[which]),
            "load_error": [bound(error) for error in contact.certificate.load_errors[which]],
            "share": [_digits(curve) for curve in shares[:, followed].T],
            "moved": [_digits(curve) for curve in loading.asperity_displacements[:, which].T / X0],
        },
    }  # fmt: skip


def _some(which: Indices, most: int) -> Indices:
    """At most this many indices, chosen at random with a fixed seed."""
    if len(which) <= most:
        return which
    return np.sort(np.random.default_rng(0).choice(which, most, replace=False))


def _digits(values: ArrayLike) -> Any:
    """A number, or a list of them, to the five digits that the page shows."""
    if isinstance(values, float):
        return float(f"{values:.5g}")
    return [float(f"{value:.5g}") for value in np.asarray(values).tolist()]
