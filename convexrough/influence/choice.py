"""`couple`: the compliance operator of some asperities of a scene."""

from __future__ import annotations

from dataclasses import replace
from typing import get_args

from convexrough.arrays import Indices
from convexrough.errors import InputError
from convexrough.influence.coupling import Influence, Kind
from convexrough.influence.dense import DenseInfluence
from convexrough.influence.lattice import LatticeInfluence
from convexrough.influence.scattered import ScatteredInfluence
from convexrough.scene.layout import Layout
from convexrough.scene.scene import Scene

KINDS: tuple[Kind, ...] = get_args(Kind)

#: A matrix is fastest for at most FEW_ASPERITIES asperities on a lattice, and for at most
#: FEW_SCATTERED that form no lattice. Timed on two cores; the numbers affect speed only.
FEW_ASPERITIES = 512
FEW_SCATTERED = 2000


def couple(scene: Scene, which: Indices, scale: float, kind: Kind | None = None) -> Influence:
    """The compliance operator of some asperities of a scene.

    which : (n,) indices of these asperities
    scale : 1 / (pi E*) with the contact modulus E*, in the units of the loads and displacements
    kind  : None for the fastest kind: for few asperities a matrix; for more, Fourier transforms, on
        their lattice or, if they form none, on a mesh

    Raises InputError for an unknown kind, for "lattice" without a lattice, and for more asperities
    than fit in memory.
    """
    if kind is not None and kind not in KINDS:
        raise InputError("influence", found=repr(kind), expected=f"one of {', '.join(KINDS)}")
    n, error, layout = len(which), scene.point_error, scene.asperities.layout
    if kind == "lattice" or (kind is None and n > FEW_ASPERITIES):
        if (lattice := scene.lattice) is not None:
            return LatticeInfluence(scene.contact_points, which, layout, lattice, scale, error)
        if kind == "lattice":
            expected = "contact points on a two-dimensional lattice"
            if layout.lattice is not None:
                expected += '; try equal tip radii, geometry "summit", or influence "scattered"'
            raise InputError("influence", found="lattice", expected=expected)
    points = scene.contact_points[which]
    tails = None if scene.contact_tails is None else scene.contact_tails[which]
    if kind == "dense" or (kind is None and n <= FEW_SCATTERED):
        if scene.geometry == "summit" and len(scene) <= FEW_ASPERITIES:
            part = layout.cached(_whole).restricted(which)
            return DenseInfluence(points, scale, scale * part.matrix, part.sums)
        return DenseInfluence.assemble(points, scale, error, tails)
    return ScatteredInfluence(points, scale, error, tails)


def _whole(layout: Layout) -> DenseInfluence:
    """1 / r_ij between all points of a small layout, shared by all scenes with it."""
    made = DenseInfluence.assemble(layout.points, 1.0)
    return replace(made, sums=replace(made.sums, shared=True))
