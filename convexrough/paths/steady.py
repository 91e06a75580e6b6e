"""`steady`: what a closed load path settles to, after one cycle.

With m+ and m- the least P + T and P - T along the path, T = Q / f, the memory curve passes through
the point  L* = (m+ + m-) / 2, T* = (m+ - m-) / 2  for ever: below L* nothing slips again, and above
it the state repeats, whatever was before (docs/theory/closed-paths.md,
"What stays for ever").
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from convexrough.arrays import Array, frozen
from convexrough.drawn import Drawn
from convexrough.influence import Kind
from convexrough.paths.energy import loss, shares
from convexrough.paths.general_step import Stepper, stepped
from convexrough.paths.levels import Levels
from convexrough.paths.memory import MemoryCurve, Piece
from convexrough.paths.order import Order, order_of
from convexrough.paths.path import STEPS, follow, points_of
from convexrough.paths.state import Friction, levels_of, worded
from convexrough.progress import Announce
from convexrough.record import Along, Table
from convexrough.scene.scene import Scene
from convexrough.sphere import hertz

#: Cells that all fronts of a cycle together are cut into, to share its loss out: about 0.1 %.
CELLS = 64


@dataclass(frozen=True, eq=False, repr=False)
class Steady(Table, Drawn):
    """A closed load path, repeated. Arrays are (n,), in the scene's order; errors are proved.

    loads, applied : (m,) P and Q at the points of the path [force]
    level, force_level : L* and f T* [force]
    energy         : lost in each cycle but the first, both bodies [force length];  energy_error
    energy_first   : lost on the way from no load through the first cycle;  energy_first_error
        Where order fails, in the first and in the second cycle by general steps, with infinite
        errors: level, slips and stick radii are those of the memory curve then, and every word of
        an asperity that touches is "undecided"
    status         : "stuck" where a cycle has no slip, "partial" where a disc sticks for ever,
        "sliding" once in each direction per cycle, "intermittent" where contact is lost in the
        cycle, "open" all along, or "undecided"
    slips          : [length] of gross slip, in each direction per cycle; nan where intermittent
    stick_radii    : [length] of the disc that sticks for ever
    order          : whether indentations rise with the load, which errors and words rest on
    presses        : how many normal problems were solved
    influence      : how the asperities were coupled; None for the cheapest that is exact

    >>> P = contact.load
    >>> settled = cr.steady(scene, loads=[P, P], forces=[0.25 * P, -0.25 * P])
    >>> f"{settled.energy / cr.cycle(contact, maximum=0.25 * P).energy:.6f}"
    '1.000000'
    """

    _along: ClassVar[Along] = {
        ("asperity",): ("status", "slips", "stick_radii"),
        ("point",): ("loads", "applied"),
    }

    scene: Scene
    loads: Array
    applied: Array
    level: float
    force_level: float
    energy: float
    energy_error: float
    energy_first: float
    energy_first_error: float
    status: NDArray[np.str_]
    slips: Array
    stick_radii: Array
    order: Order
    presses: int
    influence: Kind | None = None

    @cached_property
    def energies(self) -> Array:
        """(n,) [force length] lost at each asperity per cycle, to about 0.1 %; exact at constant P.

        Takes two normal solutions for each of 64 cells, where P is not constant.
        """
        points = points_of(self.scene, self.loads, self.applied)
        levels = Levels(self.scene, float(max(points)[0]), self.influence)
        return frozen(shares(levels, _cycles(points)[1], CELLS))


def steady(
    scene: Scene,
    *,
    loads: ArrayLike,
    forces: ArrayLike,
    influence: Kind | None = None,
    announce: Announce | None = None,
) -> Steady:
    """The steady state of a closed path of P and Q, |Q| <= f P, straight between its points.

    loads, forces : (m,) P and Q at its points [force]; from the last it goes back to the first
    influence, announce : as in `load_path`

    Raises what `load_path` raises.

    >>> P = contact.load
    >>> settled = cr.steady(scene, loads=[P, P / 2], forces=[0.3 * P, -0.1 * P])
    >>> f"{settled.level / P:.4f}", int((settled.status == "sliding").sum())
    ('0.3500', 12)
    """
    points = points_of(scene, loads, forces)
    first, pieces, curve = _cycles(points)
    high, low = min(p + t for p, t in points), min(p - t for p, t in points)
    still, least, most = (high + low) / 2, min(points)[0], max(points)[0]

    levels = Levels(scene, float(most), influence, announce)
    levels.need((still, least, most))
    levels.need(levels_of(curve, [*first, *pieces]))
    order = order_of(levels)
    energy, energy_error = loss(levels, pieces)
    energy_first, energy_first_error = loss(levels, first)
    if order == "fails":
        energy_first, energy = _two_cycles(levels, points)
        energy_error = energy_first_error = np.inf
    rest, bottom, top = levels.at(still), levels.at(least), levels.at(most)
    sliding = bottom.touching & rest.open
    intermittent = top.touching & bottom.open
    words = {
        "intermittent": intermittent,
        "sliding": sliding,
        "partial" if pieces else "stuck": rest.touching,
    }
    slips = 2.0 * Friction.of(levels).travel * np.maximum(-rest.indentations, 0.0)
    modulus = scene.material.contact_modulus
    return Steady(
        scene=scene,
        loads=frozen(np.array(loads, dtype=np.float64)),
        applied=frozen(np.array(forces, dtype=np.float64)),
        level=float(still),
        force_level=Friction.of(levels).coefficient * float((high - low) / 2),
        energy=energy,
        energy_error=energy_error,
        energy_first=energy_first,
        energy_first_error=energy_first_error,
        status=worded(top, **({} if order == "fails" else words)),
        slips=frozen(np.where(intermittent, np.nan, np.where(sliding, slips, 0.0))),
        stick_radii=frozen(hertz.contact_radius(rest.loads, modulus, scene.relative_radii)),
        order=order,
        presses=levels.presses,
        influence=influence,
    )


def _two_cycles(levels: Levels, points: list[tuple[Fraction, Fraction]]) -> tuple[float, float]:
    """What the first cycle and the way there cost, and the second, without order."""
    m = len(points)
    bundles = Stepper(levels).along(MemoryCurve(), [*points, *points, points[0]], STEPS)
    spent = stepped(levels, bundles)[1]
    return float(spent[m]), float(spent[2 * m] - spent[m])


def _cycles(
    points: list[tuple[Fraction, Fraction]],
) -> tuple[list[Piece], list[Piece], MemoryCurve]:
    """What the first cycle costs, and the way there; what all later ones do; the curve then."""
    start, costs = follow(MemoryCurve(), [*points, points[0]])
    again, later = follow(start[-1], points[1:] + points[:1])
    costly = [piece for cost in later for piece in cost if piece.slope * piece.sign != 1]
    return [piece for cost in costs for piece in cost], costly, again[-1]
