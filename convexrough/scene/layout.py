"""Where asperities stand, and what follows from that alone, whoever stands there."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from convexrough.arrays import Array, frozen
from convexrough.kept import Keeper
from convexrough.scene.lattice import Lattice
from convexrough.scene.neighbours import refuse_coincident

#: Of more asperities than this, a lattice is looked for before the nearest neighbours of all.
MANY = 5000


@dataclass(frozen=True, eq=False)
class Layout(Keeper):
    """Distinct points (n, 2) [length] in the plane; asperities of one layout share all of this."""

    points: Array

    def __post_init__(self) -> None:
        if len(self.points) <= MANY or self.lattice is None:
            refuse_coincident(self.points)

    @cached_property
    def lattice(self) -> Lattice | None:
        """What the points lie on, each on a site of its own, if that is a lattice."""
        return Lattice.through(self.points)

    @cached_property
    def distances(self) -> Array:
        """(n,) [length] distance of each point from the axis."""
        x, y = self.points.T
        return frozen(np.hypot(x, y))
