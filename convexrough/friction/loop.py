"""The loop of shear force against displacement of a steady cycle at constant load.

Q is the shear force, f the coefficient of friction, and T = Q / f.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import ClassVar

import numpy as np

from convexrough import checks
from convexrough.arrays import Array, Indices, frozen
from convexrough.friction.curve import MemoryCurve
from convexrough.friction.levels import FrictionLevels
from convexrough.friction.state import states_of
from convexrough.friction.walk import Walk
from convexrough.progress import LOGGER
from convexrough.record import Along, Table


@dataclass(frozen=True, eq=False, repr=False)
class Loop(Table):
    """Points of a closed loop, from the largest shear force to the smallest and back.

    asperities    : (k,) indices of the asperities whose own loops are given
    forces        : (m,) [force] shear force
    displacements : (m,) [length] relative tangential displacement of distant points of the two
        bodies
    asperity_forces : (m, k) [force] shear force on each of these asperities
    asperity_displacements : (m, k) [length] for each of these asperities, the displacement that its
        own shear force causes, plus its drift (its slip, while it touches): docs/theory/paths.md

    >>> loop = cr.cycle(contact, maximum=0.25 * contact.load).loop(points=100)
    >>> len(loop.forces), loop.asperity_forces.shape
    (101, (101, 61))
    """

    _shown = ("area",)
    _along: ClassVar[Along] = {
        ("point",): ("forces", "displacements"),
        ("point", "asperity"): ("asperity_forces", "asperity_displacements"),
        ("asperity",): ("asperities",),
    }

    asperities: Indices
    forces: Array
    displacements: Array
    asperity_forces: Array
    asperity_displacements: Array

    @property
    def area(self) -> float:
        """[force length] area of the polygon through the points, a little less than the loss."""
        return float(np.trapezoid(self.forces, self.displacements))


def loop_through(
    levels: FrictionLevels,
    top: Fraction,
    bottom: Fraction,
    way: Sequence[float],
    chosen: Indices,
    *,
    by_steps: bool,
) -> Loop:
    """The loop through the points at which Q has changed by 2 w since its last turning point.

    At these points T is top - 2 w / f as Q falls, and bottom + 2 w / f as Q rises.

    top, bottom : [force] the largest and the smallest T
    way      : the values of w [force], half of the change of Q
    chosen   : indices of the asperities whose own loops are given
    by_steps : True if general steps (docs/theory/without-order.md) give the results, one step from
        each point to the next; False if the memory curve does
    """
    f = Fraction(checks.friction(levels.scene.friction))
    LOGGER.info(f"computing {len(way) + 1} levels of a loop")
    drops = [*(min(2 * Fraction(each) / f, top - bottom) for each in way), top - bottom]
    heights = [top, *(top - drop for drop in drops), *(bottom + drop for drop in drops)]
    points = [(levels.load, height) for height in (top, bottom, *heights)]
    walk = Walk(levels, MemoryCurve.pressed(levels.load), points, steps=1)
    if by_steps:
        found, some = walk.states(), chosen
    else:
        found, some = states_of(levels, walk.curves, chosen), np.arange(len(chosen))
    loaded = levels.to_scene(levels.top.loads.value > 0)[chosen]
    mine = (found.forces.value, found.asperity_displacements.value)
    return Loop(
        chosen,
        frozen(np.array([float(f * height) for height in heights])),
        frozen(found.displacements.value[2:]),
        *(frozen(np.where(loaded, each[2:, some], 0.0)) for each in mine),
    )
