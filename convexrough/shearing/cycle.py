"""Steady shear cycles at constant normal load: loops, and the energy they cost, three ways.

The loss of a cycle is the sum of what each asperity loses in partial slip and in sliding; it is
eight c_t f^2 times the error of the trapezoid rule on the indentation curve; and it is the area of
the loop. Only the range of the force matters.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from convexrough import checks
from convexrough.arrays import Array, frozen, row_sums
from convexrough.contact import Contact
from convexrough.drawn import Drawn
from convexrough.errors import InputError
from convexrough.progress import Announce
from convexrough.record import Along, Table
from convexrough.shearing.bounds import Bounds
from convexrough.shearing.certificate import friction_words
from convexrough.shearing.first_loading import FirstLoading
from convexrough.shearing.loop import Loop, loops_between
from convexrough.shearing.normal_map import States
from convexrough.shearing.state import forces_at
from convexrough.sphere import mindlin
from convexrough.sphere.smooth import smooth

if TYPE_CHECKING:
    from convexrough.gradients.adjoint import Holding
    from convexrough.gradients.gradient import Gradient


@dataclass(frozen=True, eq=False, repr=False)
class Cycle(Table, Drawn):
    """A steady cycle between two shear forces. Arrays are (n,), in the scene's order.

    maximum, minimum       : [force]
    energy                 : lost per cycle, both bodies [force length]: asperity by asperity
    energy_error           : proved bound on |energy - solution|, infinite without proof
    partial_slip_energies  : [force length] of each asperity's partial slip
    sliding_energies       : [force length] of each asperity's gross slip
    balance_defect         : relative difference to the energy from the trapezoid error
    energy_normalised      : energy / W0, W0 = 9 (2 - nu) f^2 P^2 / (5 G a_H)
    smooth_normalised      : the same for the smooth sphere, e((maximum - minimum) / (2 f P))
    displacement_amplitude : X_a, half the range of X [length]
    displacement_error     : proved bound on |X_a - solution| [length], infinite without proof
    sliding, partial       : proved to slide in each half of the cycle; proved never to

    >>> cycle = cr.cycle(contact, maximum=0.25 * contact.load)
    >>> print(f"{cycle.loss_factor:.4f}", f"{cycle.secant_stiffness:.4g}")
    0.0488 0.009131
    """

    _shown = ("status", "secant_stiffness", "loss_factor")
    _along: ClassVar[Along] = {
        ("asperity",): ("status", "partial_slip_energies", "sliding_energies")
    }

    contact: Contact
    maximum: float
    minimum: float
    energy: float
    partial_slip_energies: Array
    sliding_energies: Array
    balance_defect: float
    energy_normalised: float
    smooth_normalised: float
    displacement_amplitude: float
    displacement_error: float
    sliding: NDArray[np.bool_]
    partial: NDArray[np.bool_]
    energy_error: float

    @cached_property
    def status(self) -> NDArray[np.str_]:
        """(n,) "sliding" in each half of the cycle, "partial", "open" or "undecided"."""
        return friction_words(self.contact.status, self.sliding, self.partial)

    @property
    def energies(self) -> Array:
        """(n,) [force length] lost at each asperity."""
        return frozen(self.partial_slip_energies + self.sliding_energies)

    @property
    def force_amplitude(self) -> float:
        """Q_a [force], half the range of Q."""
        return (self.maximum - self.minimum) / 2.0

    @property
    def secant_stiffness(self) -> float:
        """Q_a / X_a [force / length]; nan where nothing moves."""
        moved = self.displacement_amplitude
        return self.force_amplitude / moved if moved > 0 else np.nan

    @property
    def loss_factor(self) -> float:
        """W / (2 pi U), U = Q_a X_a / 2 (Ungar and Kerwin 1962, J. Acoust. Soc. Am. 34, 954).

        nan where nothing moves.
        """
        stored = self.force_amplitude * self.displacement_amplitude / 2.0
        return self.energy / (2.0 * np.pi * stored) if stored > 0 else np.nan

    def gradient(self, *, holding: Holding | None = None, tolerance: float = 1e-9) -> Gradient:
        """Derivatives of the energy with respect to the scene: two linear systems.

        holding, tolerance : as in `Contact.gradient`; the forces are held, also where a
            displacement was prescribed: `Gradient` says how to hold that

        Raises InputError in gross sliding where several asperities slide last, or the approach is
        held: there is no derivative.

        >>> gradient = cr.cycle(contact, maximum=0.25 * contact.load).gradient(holding="load")
        >>> print(f"{gradient.heights[0]:.4g}", f"{gradient.load:.4g}")
        5.907e-10 -9.964e-07
        """
        from convexrough.gradients.losses import cycle_gradient  # a floor above: when asked

        return cycle_gradient(self, holding=holding, tolerance=tolerance)

    def loop(
        self,
        points: int = 200,
        announce: Announce | None = None,
        asperities: ArrayLike | None = None,
    ) -> Loop:
        """The loop through about `points` points, as many down as up, denser at the ends.

        announce   : told in a line how far long work has come
        asperities : indices of those whose own loops to keep, default all
        """
        return loops([self], points, announce, asperities)[0]


def loops(
    cycles: Sequence[Cycle],
    points: int = 200,
    announce: Announce | None = None,
    asperities: ArrayLike | None = None,
) -> list[Loop]:
    """The loops of several cycles of one contact, which share their states.

    points : of the loop of the widest range, about; narrower ones have fewer
    asperities : as in `Cycle.loop`

    Half of the points are solved for: by Masing's rule the way back is the way there, mirrored.

    >>> several = cr.cycles(contact, contact.load * np.array([0.1, 0.2]))
    >>> [len(loop.forces) for loop in cr.loops(several, points=40)]
    [23, 41]
    """
    if not cycles:
        return []
    ranges = [(each.maximum, each.minimum) for each in cycles]
    return loops_between(cycles[0].contact, ranges, points, announce, asperities)


def cycle(
    contact: Contact,
    *,
    maximum: float | None = None,
    minimum: float | None = None,
    displacement: float | None = None,
    announce: Announce | None = None,
) -> Cycle:
    """The steady cycle between two shear forces [force]; `minimum` defaults to -maximum.

    displacement : amplitude of X [length] of a symmetric cycle, instead of its forces
    announce     : told in a line how far long work has come

    Raises InputError where the scene has no friction, the minimum exceeds the maximum, or either
    exceeds f P in size, or the displacement that of gross sliding.

    >>> cycle = cr.cycle(contact, maximum=0.25 * contact.load)
    >>> print(f"{cycle.energy:.4g}", (cycle.status == "sliding").sum())
    1.367e-13 6
    """
    upper = None if maximum is None else [maximum]
    lower = None if minimum is None else [minimum]
    moved = None if displacement is None else [displacement]
    return cycles(contact, upper, lower, displacement=moved, announce=announce)[0]


def cycles(
    contact: Contact,
    maximum: ArrayLike | None = None,
    minimum: ArrayLike | None = None,
    *,
    displacement: ArrayLike | None = None,
    announce: Announce | None = None,
) -> list[Cycle]:
    """`cycle` for many amplitudes at once: (m,) maxima, and minima if not the negatives.

    >>> several = cr.cycles(contact, contact.load * np.array([0.1, 0.2, 0.4]))
    >>> print([f"{cycle.energy_normalised:.2g}" for cycle in several])
    ['0.00021', '0.0028', '0.048']
    """
    checks.instance("contact", contact, Contact)
    limit = checks.friction(contact.scene.friction) * contact.load
    checks.exactly_one("maximum", maximum, "displacement", displacement)
    if displacement is not None:
        if minimum is not None:
            expected = "none beside a displacement, whose cycles are symmetric"
            raise InputError("minimum", found=minimum, expected=expected)
        amplitudes = checks.array("displacement", displacement, sign="not negative")
        maximum = forces_at(contact, amplitudes)
    assert maximum is not None  # exactly_one
    upper = checks.bearable("maximum", checks.array("maximum", maximum), limit)
    lower = -upper
    if minimum is not None:
        lower = checks.array("minimum", minimum, length=len(upper))
        lower = checks.bearable("minimum", lower, limit)
    if (upper < lower).any():
        i = int(np.argmax(upper < lower))
        expected = f"at least the minimum, {lower[i]:g}; by default that is its negative"
        raise InputError(f"maximum[{i}]", found=upper[i], expected=expected)
    if contact.load == 0.0 or len(upper) == 0:
        return [_empty(contact, high, low) for high, low in zip(upper, lower, strict=True)]

    loading = FirstLoading(contact)
    problem = loading.problem
    states, back = loading.states((upper - lower) / (2.0 * problem.force_unit), announce)
    judged = loading.judged(states, announce)
    losses = [loss for block in judged for loss in _losses(loading, *block)]
    whole = smooth(contact.scene, load=contact.load).energy_scale  # W0
    return [
        Cycle(
            contact=contact,
            maximum=float(upper[i]),
            minimum=float(lower[i]),
            energy=each.energy,
            partial_slip_energies=each.partial_slip,
            sliding_energies=each.sliding_slip,
            balance_defect=each.defect,
            energy_normalised=each.energy / whole,
            smooth_normalised=float(mindlin.loss(each.total / problem.limit)),
            displacement_amplitude=each.rise * problem.travel_unit,
            displacement_error=each.rise_error * problem.travel_unit,
            sliding=each.sliding,
            partial=each.partial,
            energy_error=each.energy_error,
        )
        for i, each in enumerate(losses[place] for place in back)
    ]


class _Loss(NamedTuple):
    """What a cycle of one amplitude costs, and which asperities slide; as in Cycle."""

    total: float  # T
    rise: float
    rise_error: float
    energy: float
    partial_slip: Array
    sliding_slip: Array
    defect: float
    sliding: NDArray[np.bool_]
    partial: NDArray[np.bool_]
    energy_error: float


def _losses(loading: FirstLoading, states: States, bounds: Bounds) -> Iterator[_Loss]:
    problem, unit = loading.problem, loading.energy_unit
    slip = problem.to_scene(loading.partial_slip(states) * unit)
    slide = problem.to_scene(loading.sliding(states) * unit)
    energies = row_sums(slip) + row_sums(slide)
    others = unit * loading.trapezoid_error(states)
    defects = np.abs(others - energies) / np.where(energies > 0, energies, 1.0)
    errors = loading.energy_errors(bounds.losses)
    for i, total in enumerate(states.totals):
        yield _Loss(
            float(total),
            float(states.rises[i]),
            float(bounds.rises[i]),
            float(energies[i]),
            frozen(slip[i]),
            frozen(slide[i]),
            float(defects[i]),
            frozen(problem.to_scene(bounds.sliding[i])),
            frozen(problem.to_scene(bounds.partial[i])),
            float(errors[i]),
        )


def _empty(contact: Contact, maximum: float, minimum: float) -> Cycle:
    zero, no = frozen(np.zeros(len(contact.scene))), frozen(np.zeros(len(contact.scene), bool))
    return Cycle(contact, maximum, minimum, 0.0, zero, zero, 0.0, 0.0, 0.0, 0.0, 0.0, no, no, 0.0)
