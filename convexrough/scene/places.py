"""Where asperities stand, and what follows from that alone."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from convexrough.arrays import Array, frozen
from convexrough.kept import Keeper
from convexrough.scene.lattice import Lattice


@dataclass(frozen=True, eq=False)
class Places(Keeper):
    """Positions (n, 2) [length] that several asperities of other heights and tips may share."""

    positions: Array

    @cached_property
    def lattice(self) -> Lattice | None:
        """What they lie on, each on a site of its own, if that is a lattice."""
        return Lattice.through(self.positions)

    @cached_property
    def distances(self) -> Array:
        """(n,) [length] from the axis."""
        x, y = self.positions.T
        return frozen(np.hypot(x, y))
