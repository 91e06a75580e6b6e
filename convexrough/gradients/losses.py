"""Gradients of the losses of cycles, histories and load paths, and of their displacements."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
from numpy.typing import ArrayLike

from convexrough import checks
from convexrough.arithmetic.balls import Ball
from convexrough.errors import InputError
from convexrough.friction.cycle import Cycle
from convexrough.friction.order import Order
from convexrough.friction.path import LoadPath
from convexrough.gradients.along import NONE, Along
from convexrough.gradients.gradient import Gradient, Holding, Number, control_held
from convexrough.gradients.pulled import Part
from convexrough.gradients.states import Frictional

#: The number 1 with an infinite error bound. A product with it has an infinite error bound, too.
UNKNOWN = Ball.around(1.0, np.inf)


def cycle_gradient(cycle: Cycle, *, holding: Holding | None = None) -> Gradient:
    """The result of `Cycle.gradient`.

    At constant load the loss W is given by (1) of docs/theory/losses.md. At varying load W is the
    sum over the pieces of the second cycle (`Along`).
    """
    contact, sheared = cycle.contact, Frictional.of(cycle)
    holding = control_held(contact, holding)
    if (cycle.loads != float(sheared.known.load)).any():
        m = len(cycle.loads)
        first = [(k % m, Fraction(0), Fraction(0)) for k in range(m + 1)]
        again = [((k + 1) % m, Fraction(1), Fraction(0)) for k in range(m)]
        given = cycle.loads, cycle.forces
        asked = Along.of(sheared.known, Fraction(0), first + again, *given)
        return _gradient(sheared, asked, holding, paths=True, order=cycle.order)
    amplitude = (Fraction(cycle.maximum) - Fraction(cycle.minimum)) / 2
    top, low = sheared.known.top, sheared.below("maximum", amplitude, holding)
    T, mean = top.load - low.load, (top.approach + low.approach) * 0.5
    weight = sheared.known.loss_unit * 8.0
    along = weight * T * -0.5
    moves = sheared.moves(T, maximum=0.5, minimum=-0.5)
    parts = [
        Part(top, energy=weight, approach=along, moves=sheared.top_moves),
        Part(low, energy=-weight, approach=along, moves=moves),
    ]
    W = weight * (top.energy - low.energy - T * mean)
    by_T = {name: weight * mean * rate for name, rate in moves.items()}  # dT = dP - dL
    explicit = {
        "maximum": by_T["maximum"],
        "minimum": by_T["minimum"],
        "friction": by_T["friction"] + W * 2.0 / sheared.f,
        "poisson_ratio": W * sheared.by_ratio,
    }
    return Gradient.of(_loss(Number.of(contact, top, parts, explicit), cycle.order), holding)


def _loss(number: Number, order: Order) -> Number:
    """The given `Number`, a loss, with infinite error bounds if order is not proved."""
    return number if order == "proved" else number.times(UNKNOWN, {})


def path_gradient(
    path: LoadPath,
    *,
    losses: ArrayLike | None = None,
    displacements: ArrayLike | None = None,
    holding: Holding | None = None,
) -> Gradient:
    """The result of `LoadPath.gradient`."""
    sheared, m = Frictional.of(path), len(path.forces)
    holding = control_held(path.contact, holding)
    spent, far = (
        checks.array(name, 0.0 if given is None else given, length=m, one="force")
        for name, given in (("losses", losses), ("displacements", displacements))
    )
    if losses is None and displacements is None:
        spent = np.eye(m)[-1]
    later = np.cumsum(spent[::-1])[::-1]  # a loss on one segment is part of all later losses
    steps = [(k, Fraction(later[k]), Fraction(far[k])) for k in range(m)]
    along = Along.of(sheared.known, Fraction(path.start), steps, path.loads, path.forces)
    sliding = [load == abs(T) for load, T in zip(along.loads, along.heights, strict=True)]
    if path.load_constant and any(sliding):
        expected = "forces below f P: in gross sliding a history has no derivative"
        raise InputError("forces", found="gross sliding", expected=expected)
    order = path.order if spent.any() else "proved"
    return _gradient(sheared, along, holding, paths=not path.load_constant, order=order)


def _gradient(
    sheared: Frictional, along: Along, holding: Holding, *, paths: bool, order: Order
) -> Gradient:
    """The gradient of a weighted sum along a path.

    paths : True to add the derivatives by the loads of all points
    """
    if paths and holding == "approach":
        expected = '"load", because the loads of all points are prescribed'
        raise InputError("holding", found='"approach"', expected=expected)
    m, T = len(along.loads), along.heights
    parts, spent, far = along.parts({} if paths else sheared.top_moves)
    nothing = [Fraction(0)] * m
    each = [[Fraction(int(i == k)) for i in range(m)] for k in range(m)]
    f = sheared.f
    forces, force_sides = along.slopes([(nothing, one) for one in each], 1.0 / f)
    scaled, _ = along.slopes([(nothing, T)], 1.0 / f)
    by_friction = (spent * 2.0 + far) / f - scaled[0]
    sides = {"forces": force_sides}
    explicit = {
        "forces": forces,
        "friction": NONE if np.isnan(scaled.value[0]) else by_friction,
        "poisson_ratio": (spent + far) * sheared.by_ratio,
    }
    if paths:
        directions = [(one, nothing) for one in each]
        explicit["loads"], sides["loads"] = along.slopes(directions, Ball.exact(1.0))
    number = Number.of(sheared.contact, sheared.known.top, parts, explicit)
    return Gradient.of(_loss(number._replace(sides=sides), order), holding)
