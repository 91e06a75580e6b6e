"""Steady shear cycles at constant normal load: loops, and the energy they cost, three ways.

The loss of a cycle is the sum of what each asperity loses in partial slip and in sliding; it is
eight c_t f^2 times the error of the trapezoid rule on the indentation curve; and it is the area of
the loop. Only the range of the force matters.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from convexrough import checks
from convexrough.arrays import Array, frozen
from convexrough.contact import Contact
from convexrough.errors import InputError
from convexrough.progress import Announce
from convexrough.shearing.certificate import friction_words
from convexrough.shearing.first_loading import FirstLoading
from convexrough.shearing.history import history
from convexrough.shearing.judgement import Bounds
from convexrough.shearing.normal_map import States
from convexrough.sphere import mindlin
from convexrough.sphere.smooth import smooth


@dataclass(frozen=True, eq=False)
class Loop:
    """Points of a closed loop, from the maximum to the minimum and back.

    forces : (m,) Q [force];  displacements : (m,) X [length], both bodies
    asperity_forces : (m, n) Q_i [force]
    asperity_displacements : (m, n) X_i + slip_i [length]
    """

    forces: Array
    displacements: Array
    asperity_forces: Array
    asperity_displacements: Array

    @property
    def area(self) -> float:
        """[force length] of the polygon through the points: the loss, from inside."""
        return float(np.trapezoid(self.forces, self.displacements))


@dataclass(frozen=True, eq=False)
class Cycle:
    """A steady cycle between two shear forces. Arrays are (n,), in the scene's order.

    maximum, minimum       : [force]
    energy                 : lost per cycle, both bodies [force length]: asperity by asperity
    partial_slip_energies  : [force length] of each asperity's partial slip
    sliding_energies       : [force length] of each asperity's gross slip
    balance_defect         : relative difference to the energy from the trapezoid error
    energy_normalised      : energy / W0, W0 = 9 (2 - nu) f^2 P^2 / (5 G a_H)
    smooth_normalised      : the same for the smooth sphere, e((maximum - minimum) / (2 f P))
    sliding, partial       : proved to slide in each half of the cycle; proved never to
    """

    contact: Contact
    maximum: float
    minimum: float
    energy: float
    partial_slip_energies: Array
    sliding_energies: Array
    balance_defect: float
    energy_normalised: float
    smooth_normalised: float
    sliding: NDArray[np.bool_]
    partial: NDArray[np.bool_]

    @cached_property
    def status(self) -> NDArray[np.str_]:
        """(n,) "sliding" in each half of the cycle, "partial", "open" or "undecided"."""
        return friction_words(self.contact.status, self.sliding, self.partial)

    @property
    def energies(self) -> Array:
        """(n,) [force length] lost at each asperity."""
        return frozen(self.partial_slip_energies + self.sliding_energies)

    def loop(self, points: int = 200, announce: Announce | None = None) -> Loop:
        """The loop through about `points` points, as many down as up, denser at the ends.

        announce : told in a line how far long work has come
        """
        if not isinstance(points, int) or points < 4:
            raise InputError("points", found=points, expected="a whole number, at least 4")
        middle, amplitude = (self.maximum + self.minimum) / 2, (self.maximum - self.minimum) / 2
        down = middle + amplitude * np.cos(np.linspace(0.0, np.pi, points // 2 + 1))
        down[0], down[-1] = self.maximum, self.minimum
        there_and_back = [self.maximum, self.minimum]
        if abs(self.minimum) > abs(self.maximum):
            there_and_back.insert(0, self.minimum)
        path = np.concatenate((there_and_back[:-1], down[1:], down[-2::-1]))
        past = history(self.contact, forces=path, announce=announce)
        body = slice(len(there_and_back) - 2, None)
        return Loop(
            forces=frozen(path[body]),
            displacements=past.displacements[body],
            asperity_forces=past.forces[body],
            asperity_displacements=past.asperity_displacements[body],
        )


def cycle(
    contact: Contact,
    *,
    maximum: float,
    minimum: float | None = None,
    announce: Announce | None = None,
) -> Cycle:
    """The steady cycle between two shear forces [force]; `minimum` defaults to -maximum.

    announce : told in a line how far long work has come

    Raises InputError where the scene has no friction, the minimum exceeds the maximum, or either
    exceeds f P in size.
    """
    lower = None if minimum is None else [minimum]
    return cycles(contact, [maximum], lower, announce=announce)[0]


def cycles(
    contact: Contact,
    maximum: ArrayLike,
    minimum: ArrayLike | None = None,
    *,
    announce: Announce | None = None,
) -> list[Cycle]:
    """`cycle` for many amplitudes at once: (m,) maxima, and minima if not the negatives."""
    limit = checks.friction(contact.scene.friction) * contact.load
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
            sliding=each.sliding,
            partial=each.partial,
        )
        for i, each in enumerate(losses[place] for place in back)
    ]


class _Loss(NamedTuple):
    """What a cycle of one amplitude costs, and which asperities slide; as in Cycle."""

    total: float  # T
    energy: float
    partial_slip: Array
    sliding_slip: Array
    defect: float
    sliding: NDArray[np.bool_]
    partial: NDArray[np.bool_]


def _losses(loading: FirstLoading, states: States, bounds: Bounds) -> Iterator[_Loss]:
    problem, unit = loading.problem, loading.energy_unit
    slip = problem.to_scene(loading.partial_slip(states) * unit)
    slide = problem.to_scene(loading.sliding(states) * unit)
    energies = slip.sum(axis=1) + slide.sum(axis=1)
    others = unit * loading.trapezoid_error(states)
    defects = np.abs(others - energies) / np.where(energies > 0, energies, 1.0)
    for i, total in enumerate(states.totals):
        yield _Loss(
            float(total),
            float(energies[i]),
            frozen(slip[i]),
            frozen(slide[i]),
            float(defects[i]),
            frozen(problem.to_scene(bounds.sliding[i])),
            frozen(problem.to_scene(bounds.partial[i])),
        )


def _empty(contact: Contact, maximum: float, minimum: float) -> Cycle:
    zero, no = frozen(np.zeros(len(contact.scene))), frozen(np.zeros(len(contact.scene), bool))
    return Cycle(contact, maximum, minimum, 0.0, zero, zero, 0.0, 0.0, 0.0, no, no)
