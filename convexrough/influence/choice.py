"""Which operator a scene needs: the cheapest exact one, unless one is asked for by name."""

from __future__ import annotations

from typing import get_args

import numpy as np

from convexrough.arrays import Array, Indices
from convexrough.errors import InputError
from convexrough.influence.coupling import Influence, Kind
from convexrough.influence.dense import DenseInfluence, inverse_between
from convexrough.influence.lattice import LatticeInfluence
from convexrough.influence.scattered import ScatteredInfluence
from convexrough.scene.scene import Scene

KINDS: tuple[Kind, ...] = get_args(Kind)

#: Up to so many asperities the matrix costs less than anything else, ...
FEW_ASPERITIES = 512

#: ... and up to so many off a lattice. Both were timed on two cores: speed is all they decide.
FEW_SCATTERED = 3000


def couple(scene: Scene, which: Indices, scale: float, kind: Kind | None = None) -> Influence:
    """The coupling among some of a scene's asperities; scale = 1 / (pi E*) in their units.

    kind : None for the cheapest: a matrix for few asperities, else transforms on a lattice where
        they lie on one, else on a mesh

    Raises InputError for an unknown kind, a lattice where there is none, and too many asperities
    for the memory.
    """
    if kind is not None and kind not in KINDS:
        raise InputError("influence", found=repr(kind), expected=f"one of {', '.join(KINDS)}")
    points, error = scene.contact_points[which], scene.point_error
    n = len(which)
    if kind == "dense" or (kind is None and n <= FEW_ASPERITIES):
        return DenseInfluence.assemble(points, scale, error, _shared(scene, which))
    if kind != "scattered" and scene.lattice is not None:
        return LatticeInfluence.assemble(points, scene.lattice, scale, error)
    if kind == "lattice":
        raise InputError(
            "influence", found="lattice", expected="asperities on a two-dimensional lattice"
        )
    if kind is None and n <= FEW_SCATTERED:
        return DenseInfluence.assemble(points, scale, error)
    return ScatteredInfluence(points, scale, error)


def _shared(scene: Scene, which: Indices) -> Array | None:
    """1 / r_ij of some asperities, where their places keep it for several scenes."""
    if scene.geometry != "summit":  # there contact is beside the summits
        return None
    known = scene.asperities.places.kept(inverse_between)
    return None if known is None else known[np.ix_(which, which)]
