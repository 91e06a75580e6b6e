"""Steady cycles: the friction states, energy losses and loops of closed paths that are repeated.

docs/theory/paths.md, "Closed paths", proves that from the second cycle on the memory curve no
longer changes below the point (L*, T*), and repeats above. docs/theory/losses.md derives the loss.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from convexrough import checks
from convexrough.arithmetic.balls import of_rows
from convexrough.arrays import Array, Indices, among_zeros, frozen
from convexrough.contact import Contact
from convexrough.errors import InputError
from convexrough.friction.curve import MemoryCurve
from convexrough.friction.levels import FrictionLevels, rounded
from convexrough.friction.onset import indices
from convexrough.friction.order import Order
from convexrough.friction.state import States, shared, states_of
from convexrough.friction.walk import Closed, Walk
from convexrough.plottable import Plottable
from convexrough.progress import LOGGER
from convexrough.record import Along, Table
from convexrough.scene.scene import Scene

if TYPE_CHECKING:
    from convexrough.gradients.gradient import Gradient, Holding

#: Where the load varies, the path is cut into at most about this number of cells.
CELLS = 64


@dataclass(frozen=True, eq=False, repr=False)
class Cycle(Table, Plottable):
    """The steady state of a closed path of load and shear force that is repeated.

    Arrays with one value per asperity are (n,), in the order of the scene. An error bound is
    infinite where nothing is proved. f is the coefficient of friction.

    contact          : the contact, pressed with the highest load of the path
    loads, forces    : (m,) [force] load P and shear force Q at the points of the path
    loss             : [force length] energy lost per cycle by both bodies, from the second cycle
        on; for general steps, in the last of up to 12 cycles, or nan if it does not settle
    loss_first       : [force length] energy lost from the start without shear to the end of cycle 1
    loss_error, loss_first_error : proved bounds on the errors of the losses
    status           : "stuck" (no slip in the cycle), "partial" (a disc always sticks), "sliding"
        (as a whole, in each direction), "intermittent" (contact is lost in the cycle), "open"
        (never loaded) or "undecided"
    slips            : [length] gross slip in each direction per cycle; nan where intermittent
    stick_radii      : [length] radius of the disc that always sticks
    slip_errors, stick_radius_errors : [length] proved bounds on the errors of these two
    level, force_level : [force] L* and f T*: from the second cycle on the memory curve
        (docs/theory/paths.md) is the same at every moment up to the load L*; nan for general steps
    loss_normalised  : loss / W0, with W0 = 9 (2 - nu) f^2 P^2 / (5 G a_H). P is the highest load,
        nu Poisson's ratio, G the shear modulus, a_H the contact radius of a smooth sphere under P;
        for an ellipsoid W0 = (24/5) c_t f^2 P D with its approach D and Mindlin's ratio c_t
    smooth_normalised : loss of the smooth shape / W0; nan unless `one_loop`. Both ratios to W0 are
        nan if no asperity is loaded, or if the solution for the smooth shape is not known
    displacement_amplitude, displacement_error : [length] half the range of the displacement of one
        body relative to the other, at the points of the path, and proved bound on its error
    order            : what is proved about order between the lowest and the highest load at which
        normal solutions are used (docs/theory/states.md, "Order"). "proved": losses and statuses
        are proved; "proved for one step": statuses hold for the solution with one general step
        (docs/theory/without-order.md) per straight segment, and no loss is proved; "fails": nothing
        is proved; if the normal solution at the highest P is, general steps give the results
    presses          : number of normal problems that were solved
    start            : [force] load at the start of the path, without shear; 0 if unloaded
    heights          : (m,) [force] Q / f at the points of the path, without rounding

    >>> cycle = cr.cycle(contact, maximum=0.25 * contact.load)
    >>> print(f"{cycle.loss_factor:.4f}", f"{cycle.secant_stiffness:.4g}")
    0.0488 0.009131
    """

    _shown = ("secant_stiffness", "loss_factor", "balance_defect")
    _along: ClassVar[Along] = {
        ("asperity",): (
            *("status", "partial_slip_losses", "sliding_losses", "slips", "slip_errors"),
            *("stick_radii", "stick_radius_errors"),
        ),
        ("point",): ("loads", "forces"),
    }

    contact: Contact
    loads: Array
    forces: Array
    loss: float
    loss_error: float
    loss_first: float
    loss_first_error: float
    status: NDArray[np.str_]
    slips: Array
    slip_errors: Array
    stick_radii: Array
    stick_radius_errors: Array
    level: float
    force_level: float
    loss_normalised: float
    smooth_normalised: float
    displacement_amplitude: float
    displacement_error: float
    order: Order
    presses: int
    start: float = field(repr=False)
    heights: tuple[Fraction, ...] = field(repr=False)

    def __getstate__(self) -> dict[str, Any]:  # a pickle has no levels
        return super().__getstate__() | {"balance_defect": self.balance_defect}

    @property
    def scene(self) -> Scene:
        """The scene of the contact."""
        return self.contact.scene

    @property
    def maximum(self) -> float:
        """The largest shear force [force]."""
        return float(self.forces.max())

    @property
    def minimum(self) -> float:
        """The smallest shear force [force]."""
        return float(self.forces.min())

    @property
    def partial_slip_losses(self) -> Array:
        """(n,) [force length] the part of `asperity_losses` that is due to partial slip."""
        return self._shares[0]

    @property
    def sliding_losses(self) -> Array:
        """(n,) [force length] the part of `asperity_losses` that is due to gross slip."""
        return self._shares[1]

    @property
    def asperity_losses(self) -> Array:
        """(n,) [force length] energy lost at each asperity per cycle.

        The values are nan if general steps give the results (see `order`). Where the load varies,
        they are sums over about 64 cells of the path. The relative error of their total is below
        1 % if the load falls to no less than half, some per cent if it falls to 0, and larger if
        hardly anything slips. `asperity_loss_errors` are bounds, ten to hundreds of times as large.
        """
        return self._shares[2]

    @property
    def asperity_loss_errors(self) -> Array:
        """(n,) [force length] proved bounds on the errors of `asperity_losses`."""
        return self._shares[3]

    @cached_property
    def _shares(self) -> tuple[Array, Array, Array, Array]:
        levels, n = self.contact.cached(FrictionLevels), len(self.scene)
        if self.order == "fails" and levels.proved:
            unknown = frozen(np.full(n, np.nan))
            return unknown, unknown, unknown, frozen(np.full(n, np.inf))
        parts = shared(levels, self._walk.cycles[1], CELLS)
        (slip, _), (slide, _), (both, errors) = (
            rounded(of_rows(levels.to_scene, it)) for it in (*parts, parts[0] + parts[1])
        )
        return slip, slide, both, errors if self.order == "proved" else frozen(errors + np.inf)

    @cached_property
    def _walk(self) -> Closed:
        points = list(zip(map(Fraction, self.loads.tolist()), self.heights, strict=True))
        levels = self.contact.cached(FrictionLevels)
        return Closed.around(levels, MemoryCurve.pressed(self.start), points)

    @property
    def one_loop(self) -> bool:
        """True if, at constant load, the shear force rises and falls once in a cycle."""
        return self._walk.one_loop

    @cached_property
    def balance_defect(self) -> float:
        """Relative difference between `loss` and the loss by (1) of docs/theory/losses.md, as a
        check of rounding; nan unless `one_loop`, or for general steps."""
        closed, levels = self._walk, self._walk.levels
        if not closed.one_loop or closed.general is not None:
            return np.nan
        top, rest = levels.at(levels.load), levels.at(closed.stuck[0])
        mean, run = (top.approach + rest.approach) * 0.5, top.load - rest.load
        other = (top.energy - rest.energy - run * mean) * 8.0 * levels.loss_unit
        return abs(float(other.value) - self.loss) / (self.loss or 1.0)

    @property
    def force_amplitude(self) -> float:
        """[force] half the range of the shear force."""
        return (self.maximum - self.minimum) / 2.0

    @property
    def secant_stiffness(self) -> float:
        """[force / length] force amplitude / displacement amplitude; nan if nothing moves."""
        moved = self.displacement_amplitude
        return self.force_amplitude / moved if moved > 0 else np.nan

    @property
    def loss_factor(self) -> float:
        """loss / (2 pi U) with U = force amplitude * displacement amplitude / 2; nan if U = 0.

        Source: Ungar and Kerwin, J. Acoust. Soc. Am. 34 (1962) 954.
        """
        stored = self.force_amplitude * self.displacement_amplitude / 2.0
        return self.loss / (2.0 * np.pi * stored) if stored > 0 else np.nan

    def gradient(self, *, holding: Holding | None = None) -> Gradient:
        """Derivatives of the loss with respect to the scene, at constant shear forces.

        holding : quantity kept constant, as in `Contact.gradient`; "load" keeps the loads of all
            points. `Gradient` says how to keep a prescribed displacement constant

        Raises InputError if there is no derivative, in the cases of `ShearState.gradient`.

        >>> gradient = cr.cycle(contact, maximum=0.25 * contact.load).gradient(holding="load")
        >>> print(f"{gradient.heights[0]:.4g}", f"{gradient.load:.4g}")
        5.907e-10 -9.964e-07
        """
        from convexrough.gradients.results import cycle_gradient  # a higher layer

        return cycle_gradient(self, holding=holding)

    def loop(self, points: int = 200, asperities: ArrayLike | None = None) -> Loop:
        """The loop of shear force against displacement, with points denser at its ends.

        points     : approximate number of points of the outer loop, half of them on each branch;
            points and reversals of the cycle add to them
        asperities : indices of the asperities whose own loops are returned; default all

        Raises InputError if the load varies.

        >>> cr.cycle(contact, maximum=0.25 * contact.load).loop(100, [0]).asperity_forces.shape
        (101, 1)
        """
        return loops([self], points, asperities)[0]


@dataclass(frozen=True, eq=False, repr=False)
class Loop(Table):
    """Points of a closed loop, from the largest shear force through the path and back.

    asperities    : (k,) indices of the asperities whose own loops are given
    forces, displacements : (m,) shear force [force], and relative tangential displacement [length]
        of distant points of the two bodies
    asperity_forces : (m, k) [force] shear force on each of these asperities
    asperity_displacements : (m, k) [length] for each of these asperities, the displacement that its
        own shear force causes, plus its drift (its slip, while it touches): docs/theory/paths.md;
        0 where open
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


def loops(
    cycles: Sequence[Cycle], points: int = 200, asperities: ArrayLike | None = None
) -> list[Loop]:
    """The force-displacement loops of several cycles at constant load.

    points : approximate number of points of the widest loop; narrower loops have fewer
    asperities : as in `Cycle.loop`

    Raises InputError if the load of a cycle varies.

    >>> several = cr.cycles(contact, contact.load * np.array([0.1, 0.2]))
    >>> [len(loop.forces) for loop in cr.loops(several, points=40)]
    [23, 41]
    """
    checks.whole("points", points, 4)
    checks.sequence("cycles", cycles, "a list of cycles; `Cycle.loop` is for one")
    if not cycles:
        return []
    for k, each in enumerate(cycles):
        checks.instance(f"cycles[{k}]", each, Cycle)
    if any(np.ptp(each.loads) > 0 for each in cycles):
        raise InputError("cycles", found="a load that varies", expected="cycles at constant load")
    largest = max(len(each.scene) for each in cycles)
    checks.fits_in_memory("points", points, 200 * largest, noun="levels")
    widest = max(each.force_amplitude for each in cycles)
    parts = (0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, points // 2 + 1)))[1:-1]
    way = [2 * Fraction(widest * part) for part in parts.tolist()]
    return [_loop(each, way, indices("asperities", asperities, len(each.scene))) for each in cycles]


def _loop(cycle: Cycle, way: Sequence[Fraction], chosen: Indices) -> Loop:
    """The loop through the points of a cycle, and points at the distances `way` [force] behind each
    reversal.
    """
    levels, f = cycle._walk.levels, Fraction(checks.friction(cycle.scene.friction))
    top, general = max(cycle.heights), cycle._walk.general
    heights, k, turn, sign = [top], cycle.heights.index(top), top, 0
    for here, there in pairwise([*cycle.heights[k:], *cycle.heights[:k], top]):
        if here == there:
            continue
        before, sign = sign, 1 if there > here else -1
        if sign != before:
            turn = here
        near, far = f * abs(here - turn), f * abs(there - turn)
        heights += [turn + sign * part / f for part in way if near < part < far] + [there]
    LOGGER.info(f"computing {len(heights)} levels of a loop")
    if general is None:  # one cycle, up to the largest shear force
        past = [*cycle.heights, *cycle.heights[:k]]
    else:
        past = [*cycle.heights[:k], *heights[:-1] * len(cycle._walk.losses_of(general))]
    path = [(levels.load, height) for height in (*past, *heights)]
    checks.fits_in_memory("points", len(path), 200 * len(cycle.scene), noun="levels")
    walk, loop = Walk(levels, cycle._walk.start, path, steps=1), slice(len(past), None)
    places = levels.top.problem.places[chosen]
    on = np.flatnonzero(places >= 0)  # the others cannot touch
    if general is None:
        states = states_of(levels, walk.curves[loop], places[on])
    else:
        states = States(*(each[loop] for each in walk.states(places[on])))
    loaded, own = levels.loads[chosen] > 0, list[Array]()
    for each in (states.forces, states.asperity_displacements):
        values = among_zeros(each.value, on, len(chosen), axis=-1)
        own.append(frozen(np.where(loaded, values, 0.0)))
    return Loop(chosen, walk.forces[loop], frozen(states.displacements.value), *own)
