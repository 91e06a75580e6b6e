"""Order that follows from distances alone: theorems 1 and 2 of docs/theory/states.md.

A touching asperity k has a shell of the radius R_k = 2 a_k / pi, with the contact radius a_k.
Theorem 1: all rates are positive, at this load and at all lower ones, if the discs of radii 3 R_k
around contact points do not overlap and contain no other contact point. Theorem 2: the same holds
on a lattice if no R_k exceeds a number below half the spacing that depends on the lattice's shape.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array
from convexrough.influence.coupling import Influence
from convexrough.influence.lattice import LatticeInfluence
from convexrough.roundoff import SAFETY
from convexrough.scene.lattice import Lattice
from convexrough.scene.scene import Scene

#: [spacing] shells up to HALF do not overlap on a lattice. At the sites z, (5) must hold with the
#: relative margin MARGIN, for rounding.
HALF, MARGIN = 0.499, 1e-3

#: Lattices on which a vector z of theorem 2 exceeds this many spacings are left out.
LONGEST = 100


def order_holds(scene: Scene, influence: Influence, shells: Array) -> bool:
    """True if one of the theorems proves order for the shell radii (n,) [length]."""
    if not np.isfinite(shells).all():
        return False
    # To find out whether few given points form a lattice takes too long.
    known = scene.asperities.layout.made is not None or isinstance(influence, LatticeInfluence)
    if known and float(shells.max(initial=0.0)) <= largest_shell(scene):
        return True
    lost = SAFETY + 2.0 * influence.entry_error
    return influence.crowding(3.0 * shells) * (1.0 + lost) < 1


def largest_shell(scene: Scene) -> float:
    """[length] the number of theorem 2; 0 if the scene has no lattice, or no number is proved."""
    if (lattice := scene.lattice) is None:
        return 0.0
    ring, (low, high) = lattice.cached(_Ring.of), scene.asperities.layout.corners
    farthest = 3.0 * (float(np.hypot(*(high - low))) / lattice.spacing + ring.longest)
    # Distances of points differ from those of sites by at most `off`, which includes rounding.
    off = 3.0 * lattice.site_error / lattice.spacing + 1e-13
    sure = ring.gain > 16.0 * off * farthest * ring.longest
    return ring.shell * lattice.spacing if sure else 0.0


def settled_by_rings(scene: Scene, influence: LatticeInfluence, shells: Array) -> NDArray[np.bool_]:
    """(n,) True where asperities lie at all sites z around an asperity, and none of them has a
    shell above the number of theorem 2: then its rate is positive if no rate is negative.
    """
    assert scene.lattice is not None
    ring, limit = scene.lattice.cached(_Ring.of), largest_shell(scene)
    (rows, columns), (i, j) = influence.box.shape, influence.cells
    field = np.full((rows + 2, columns + 2), np.inf)
    field[i + 1, j + 1] = shells
    around = [field[i + 1 + a, j + 1 + b] <= limit for a, b in (*ring.steps, *-ring.steps)]
    return np.asarray(np.logical_and.reduce(around) & (limit > 0))


class _Ring(NamedTuple):
    """The charges of theorem 2; lengths are divided by the spacing of the lattice."""

    longest: float  # largest |z_k|
    shell: float  # largest radius of the shells
    gain: float  # at most |x|^3 times (left minus right side of (5)), except where w_x is positive
    steps: NDArray[np.intp]  # (3, 2) half of the vectors z, in units of b1 and b2

    @classmethod
    def of(cls, lattice: Lattice) -> _Ring:
        basis = lattice.basis / lattice.spacing
        (g11, g12), (_, g22) = basis @ basis.T
        half_steps = np.array([[1, 0], [0, 1], [1, -1 if g12 > 0 else 1]])
        half = half_steps @ basis @ [1.0, 1.0j]
        shares = np.array([g22 - abs(g12), g11 - abs(g12), abs(g12)])
        z, w = np.concatenate((half, -half)), np.tile(shares / shares.sum() / 2, 2)
        if (longest := float(np.abs(z).max())) > LONGEST:
            return cls(longest, 0.0, 0.0, half_steps)
        m, n = np.ceil(4.0 * longest / np.sqrt([g11, g22])).astype(int)
        steps = np.mgrid[-m : m + 1, -n : n + 1].reshape(2, -1).T  # all sites of the disc, and more
        x = steps @ basis @ [1.0, 1.0j]
        x = x[(np.abs(x) < 3.01 * longest) & steps.any(axis=1)]
        apart = np.abs(x[:, None] - z)
        own = apart < 0.5
        potentials, charge = (w / np.where(own, np.inf, apart)).sum(axis=1), (w * own).sum(axis=1)
        needed, ring = (1.0 + MARGIN) / np.abs(x) - potentials, charge > 0
        shell = charge[ring & (needed > 0)] / needed[ring & (needed > 0)]
        gains = (np.abs(x) * potentials - 1.0) * np.abs(x) ** 2
        far = (w * np.abs(z) ** 2).sum() / 8 - 0.75 * abs((w * z**2).sum())
        found = shell.min(initial=HALF), min(far, gains[~ring].min())
        return cls(longest, *found, half_steps)
