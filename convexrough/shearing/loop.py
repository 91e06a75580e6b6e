"""Steady loops, point by point, by Masing's rule."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from convexrough.arrays import Array, Indices, frozen
from convexrough.contact import Contact
from convexrough.errors import InputError
from convexrough.frames import Variables
from convexrough.progress import Announce
from convexrough.record import Along, Table
from convexrough.shearing.first_loading import FirstLoading
from convexrough.shearing.normal_map import States
from convexrough.shearing.problem import TangentialProblem
from convexrough.shearing.state import indices


@dataclass(frozen=True, eq=False, repr=False)
class Loop(Table):
    """Points of a closed loop, from the maximum to the minimum and back.

    asperities : (k,) indices of those whose own loops follow
    forces : (m,) Q [force];  displacements : (m,) X [length], both bodies
    asperity_forces : (m, k) Q_i [force]
    asperity_displacements : (m, k) X_i + slip_i [length]

    >>> loop = cr.cycle(contact, maximum=0.25 * contact.load).loop(points=100)
    >>> len(loop.forces), loop.asperity_forces.shape
    (101, (101, 61))
    """

    _shown = ("area",)
    _along: ClassVar[Along] = {
        ("point",): ("forces", "displacements"),
        ("point", "asperity"): ("asperity_forces", "asperity_displacements"),
    }

    asperities: Indices
    forces: Array
    displacements: Array
    asperity_forces: Array
    asperity_displacements: Array

    def _variables(self) -> Variables:
        return super()._variables() | {"asperity": (("asperity",), self.asperities)}

    @property
    def area(self) -> float:
        """[force length] of the polygon through the points: the loss, from inside."""
        return float(np.trapezoid(self.forces, self.displacements))


def loops_between(
    contact: Contact,
    ranges: Sequence[tuple[float, float]],
    points: int,
    announce: Announce | None = None,
    asperities: ArrayLike | None = None,
) -> list[Loop]:
    """The steady loops between maxima and minima of Q [force]; the arguments are as in `loops`.

    Half of the points are solved for: by Masing's rule the way back is the way there, mirrored.
    """
    if not isinstance(points, int) or points < 4:
        raise InputError("points", found=points, expected="a whole number, at least 4")
    chosen = indices("asperities", asperities, len(contact.scene))
    amplitudes = [(high - low) / 2.0 for high, low in ranges]
    widest = max(amplitudes)
    shared = widest * (0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, points // 2 + 1)))
    ways = [np.append(shared[shared < half], half) for half in amplitudes]
    if contact.load == 0.0:
        return [_still(way, chosen) for way in ways]
    loading = FirstLoading(contact)
    problem = loading.problem
    firsts = [max(abs(high), abs(low)) for high, low in ranges]
    states, back = loading.states(np.concatenate((*ways, firsts)) / problem.force_unit, announce)
    *places, first = np.split(back, np.cumsum([len(way) for way in ways]))
    found = []
    for (high, low), way, place, start in zip(ranges, ways, places, first, strict=True):
        branch = states.take(np.append(place, start))
        found.append(_closed(problem, high, low, way, branch, chosen))
    return found


def _closed(
    problem: TangentialProblem,
    maximum: float,
    minimum: float,
    way: Array,
    states: States,
    chosen: Indices,
) -> Loop:
    """The loop from the states at T = way / f and, the last, at the larger of the two forces.

    way : (m,) (maximum - Q) / 2 on the way down [force]

    On a branch everything is that at its beginning -+ twice its first loading
    (docs/theory/shear.md, "Histories").
    """
    held = np.searchsorted(problem.touching, chosen).clip(max=len(problem) - 1)
    loaded = problem.touching[held] == chosen

    def closed(field: Array, unit: float) -> Array:
        there, first = 2.0 * unit * field[:-1], unit * field[-1]
        top = first if maximum >= abs(minimum) else there[-1] - first
        return frozen(np.concatenate((top - there, (top - there[-1] + there)[1:])))

    def of_chosen(field: Array) -> Array:
        return np.where(loaded, field[:, held], 0.0)

    forces = np.concatenate((maximum - 2.0 * way, (minimum + 2.0 * way)[1:]))
    forces[len(way) - 1], forces[-1] = minimum, maximum
    return Loop(
        asperities=chosen,
        forces=frozen(forces),
        displacements=closed(states.rises, problem.travel_unit),
        asperity_forces=closed(of_chosen(states.increments), problem.force_unit),
        asperity_displacements=closed(of_chosen(states.deflections), problem.travel_unit),
    )


def _still(way: Array, chosen: Indices) -> Loop:
    """Where nothing is loaded, so that no force is borne either."""
    zero = frozen(np.zeros(2 * len(way) - 1))
    none = frozen(np.zeros((len(zero), len(chosen))))
    return Loop(chosen, zero, zero, none, none)
