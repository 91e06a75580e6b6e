"""Gradients of results: their parts at each level, and the derivatives of the levels' loads.

A result is a sum over levels (`gradients.parts`): a contact has one level, its load P; a friction
state and a cycle have two, P and L = P - T with T = Q / f; a load path has many. Q is the shear
force, f the coefficient of friction, and c_t Mindlin's ratio. Losses are proportional to c_t f^2,
displacements and slips to c_t f, and shear forces of asperities to f.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from fractions import Fraction
from itertools import accumulate
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from convexrough import checks
from convexrough.arithmetic import balls
from convexrough.arithmetic.balls import Ball
from convexrough.arrays import Array, among_zeros
from convexrough.contact import Contact
from convexrough.errors import InputError, ProofError
from convexrough.friction.cycle import Cycle
from convexrough.friction.levels import FrictionLevels
from convexrough.friction.onset import indices, root
from convexrough.friction.path import LoadPath
from convexrough.friction.shear import ShearState
from convexrough.gradients.along import NONE, Along
from convexrough.gradients.gradient import Gradient, Holding, Number, control_held, levels
from convexrough.gradients.parts import ZERO, Moves, Part, product
from convexrough.normal.exact import Units
from convexrough.normal.level import Level
from convexrough.normal.levels import Levels
from convexrough.normal.proved import proved
from convexrough.normal.refine import refined_loads

#: Number of Newton steps to the level at which an asperity starts to slide. The initial relative
#: error is about 1e-15, and each step raises the error to the power 3/2.
NEWTON = 3


def with_friction(result: ShearState | Cycle | LoadPath) -> FrictionLevels:
    """The levels of a result. Raises InputError if its order "fails", or if there is no load."""
    if result.order == "fails":
        expected = "a result whose indentations do not fall as the load rises"
        raise InputError("order", found='"fails"', expected=expected)
    levels(result.contact)
    return result.contact.cached(FrictionLevels)


def level_below(known: FrictionLevels, what: str, height: Fraction, holding: Holding) -> Level:
    """The level at the load L = P - |T|, for the shear force Q = f T with T = `height`."""
    if abs(height) == known.load and holding == "approach":
        expected = "a force below f P: at constant approach f P may fall below the force"
        force = float(abs(height) * Fraction(checks.friction(known.scene.friction)))
        raise InputError(what, found=f"{force}: gross sliding", expected=expected)
    return known.at(known.load - abs(height))


def by_load(units: Units) -> Moves:
    """The derivative of the scaled load P with respect to the load P in the scene's units."""
    return {"load": Ball.exact(1.0) / units.force}


def by_forces(known: FrictionLevels, height: Ball, /, **shares: float) -> Moves:
    """Derivatives of the level L = P - T, T = Q / f; `shares` are those of Q by forces."""
    rates = {name: -1.0 / known.force_unit * share for name, share in shares.items()}
    return {**by_load(known.units), "friction": height / known.coefficient, **rates}


def by_ratio(known: FrictionLevels) -> Ball:
    """The derivative of log c_t (Mindlin's ratio) by nu (Poisson's ratio)."""
    nu = Ball.exact(known.scene.material.poisson_ratio)
    return 1.0 / ((1.0 - nu) * (2.0 - nu))


def at_fixed_levels(
    known: FrictionLevels, loss: Ball = ZERO, displacement: Ball = ZERO, force: Ball = ZERO
) -> dict[str, Ball]:
    """Derivatives of the sum of these terms by f and by Poisson's ratio, at fixed levels."""
    return {
        "friction": (loss * 2.0 + displacement + force) / known.coefficient,
        "poisson_ratio": (loss + displacement) * by_ratio(known),
    }


def contact_gradient(
    contact: Contact, holding: Holding | None = None, **weights: ArrayLike | None
) -> Gradient:
    """The result of `Contact.gradient`."""
    holding = control_held(contact, holding)
    top, (on_loads, on_gaps, D, P) = levels(contact).top, _checked(contact, weights)
    units = top.problem.units
    far = np.setdiff1d(np.flatnonzero(on_gaps), top.problem.candidates)
    if len(far):  # they become candidates, which are open
        assert top.trial is not None
        which = np.union1d(top.problem.candidates, far)
        places, known = np.searchsorted(which, top.problem.candidates), top.trial.loads.high
        wider = top.problem.widened(which)
        top = proved(wider, refined_loads(wider, among_zeros(known, places, len(which))))
    which = top.problem.candidates
    carried = (Ball.exact(on_loads[which]) + P) * units.force
    part = Part(
        top,
        approach=Ball.exact(D) * units.length,
        loads=carried if carried.size.any() else None,
        indentations=_where_open(top, -on_gaps[which]) * units.length if on_gaps.any() else None,
        moves=by_load(units),
    )
    explicit = {} if contact.scene.friction is None else {"friction": ZERO}
    return Gradient.of(contact, Number.of(top, part.value, [part], explicit), holding)


def state_gradient(
    state: ShearState, holding: Holding | None = None, **weights: ArrayLike | None
) -> Gradient:
    """The result of `ShearState.gradient`."""
    contact, known = state.contact, with_friction(state)
    holding = control_held(contact, holding)
    X, on_forces, on_slips = _checked(contact, weights)
    sign = -1.0 if state.force < 0 else 1.0
    top, low = known.top, level_below(known, "force", state.height, holding)
    which, travel = top.problem.candidates, known.travel_unit
    weight = travel * (sign * X) if X else ZERO
    # Q_i = f (P_i(P) - P_i(L));  X = c_t f (D0(P) - D0(L));  slips are c_t f times gaps at L
    carried = known.force_unit * Ball.exact(sign * on_forces[which])
    slid = _where_open(low, -sign * on_slips[which]) * travel
    slid = balls.where(top.open, 0.0 * slid, slid)
    if top.box is not None and (unsure := ~top.touching & ~top.open).any():
        slid = balls.where(unsure, Ball.around(np.zeros(len(unsure)), slid.size), slid)
    moves = by_forces(known, top.load - low.load, force=sign)
    parts = [
        Part(top, approach=weight, loads=carried, moves=by_load(known.units)),
        Part(low, approach=-weight, loads=-carried, moves=moves),
    ]
    if on_slips.any():
        parts[1] = replace(parts[1], indentations=slid)
    moved = weight * (top.approach - low.approach) + slid.dot(low.indentation)
    borne = carried.dot(top.loads - low.loads)
    explicit = at_fixed_levels(known, displacement=moved, force=borne)
    return Gradient.of(contact, Number.of(top, moved + borne, parts, explicit), holding)


def onset_gradient(contact: Contact, asperity: int, *, holding: Holding | None = None) -> Gradient:
    """Derivatives of the shear force at which one asperity starts to slide on first loading.

    docs/theory/gradients.md, "Weights on single asperities", derives them.

    asperity : index of the asperity in the scene
    holding  : quantity kept constant, as in `Contact.gradient`

    Raises InputError if the scene has no friction, if the asperity carries no load, or if it is one
    of several that slide last: then there is no derivative. Raises ProofError if indentations may
    fall as the load rises.

    >>> gradient = cr.onset_gradient(contact, 36)
    >>> print(f"{gradient.value / contact.load:.3f}", f"{gradient.friction / contact.load:.3f}")
    0.176 0.352
    """
    holding, found = control_held(contact, holding), levels(contact)
    known = contact.cached(FrictionLevels)
    top, f, unit = known.top, known.coefficient, known.units.force
    which = indices("asperity", [asperity], len(contact.scene))[0]
    if known.loads[which] == 0.0:
        expected = "an asperity that carries a load: others never slide"
        raise InputError("asperity", found=asperity, expected=expected)
    place, parts = int(top.problem.places[which]), []
    first = ~known.at(Fraction(0)).open
    total, start = top.load * f * unit, root(known, place)
    if start > 0:
        low, slope = _just_touching(found, place, known.at(start).load)
        if known.order([start]) == "fails":
            raise ProofError("indentations may fall as the load rises, so the onset is not proved")
        only = Ball.exact(among_zeros(np.ones(1), np.array([place]), len(first)))
        # n(L) = 0, so that -f dL = f dn / (dn/dL)
        parts = [Part(low, indentations=only * (f * unit / slope))]
        total = (top.load - low.load) * f * unit
    elif np.count_nonzero(first) > 1 or not first[place]:  # all of these slide at f P
        expected = "an asperity that does not slide last, or that slides last alone"
        said = f"{asperity}, which slides last, together with others"
        raise InputError("asperity", found=said, expected=expected)
    explicit = {"load": f, "friction": total / f}
    return Gradient.of(contact, Number.of(top, total, parts, explicit), holding)


def _just_touching(known: Levels, place: int, near: Ball) -> tuple[Level, Ball]:
    """The level, near a load, at which the indentation n of a candidate is 0; and dn/dL there.

    The load of the result is an interval that contains the root of n, and on which n increases.
    """

    def at(load: Ball) -> tuple[Level, Ball]:
        level = known.at(load)
        coupled = product(level, level.tangent.loads)[place]
        return level, level.tangent.approach - coupled

    load = Ball.exact(near.mid)
    for _ in range(NEWTON):
        level, slope = at(load)
        load = Ball.exact((load - level.indentation[place] / slope).mid)
    level, slope = at(load)
    left = float(level.indentation[place].size)
    radius = 2.0 * left / float(slope.lower) if slope.positive else np.inf
    level, slope = at(Ball.around(load.mid, radius))
    if not left <= float(slope.lower) * radius:
        raise ProofError("the onset is not proved: the indentation may fall as the load rises")
    return level, slope


def cycle_gradient(cycle: Cycle, *, holding: Holding | None = None) -> Gradient:
    """The result of `Cycle.gradient`.

    For one loop at constant load the loss W is given by (1) of docs/theory/losses.md. Otherwise W
    is the sum over the pieces of the second cycle (`Along`).
    """
    contact, known = cycle.contact, with_friction(cycle)
    holding = control_held(contact, holding)
    if not cycle.one_loop:
        paths, m = bool(np.ptp(cycle.loads)), len(cycle.loads)
        first = [(k % m, Fraction(0), Fraction(0)) for k in range(m + 1)]
        again = [((k + 1) % m, Fraction(1), Fraction(0)) for k in range(m)]
        points = zip(map(Fraction, cycle.loads.tolist()), cycle.heights, strict=True)
        along = Along(known, Fraction(cycle.start), first + again, np.array([*points]))
        return _gradient(contact, along, holding, paths=paths, sharp=cycle.order == "proved")
    amplitude = (max(cycle.heights) - min(cycle.heights)) / 2
    top, low = known.top, level_below(known, "maximum", amplitude, holding)
    T, mean = top.load - low.load, (top.approach + low.approach) * 0.5
    weight = known.loss_unit * 8.0
    moves = by_forces(known, T, maximum=0.5, minimum=-0.5)
    parts = [
        Part(top, energy=weight, approach=weight * T * -0.5, moves=by_load(known.units)),
        Part(low, energy=-weight, approach=weight * T * -0.5, moves=moves),
    ]
    W = weight * (top.energy - low.energy - T * mean)
    if cycle.loss_error < float(W.error):  # at small amplitudes
        W = Ball.around(cycle.loss, cycle.loss_error)
    explicit = at_fixed_levels(known, loss=W)
    for name in ("maximum", "minimum", "friction"):  # dT = dP - dL
        explicit[name] = explicit.get(name, ZERO) + weight * mean * moves[name]
    number = Number.of(top, W, parts, explicit)
    return Gradient.of(contact, number if cycle.order == "proved" else _loose(number), holding)


def path_gradient(
    path: LoadPath,
    holding: Holding | None = None,
    *,
    losses: ArrayLike | None = None,
    displacements: ArrayLike | None = None,
) -> Gradient:
    """The result of `LoadPath.gradient`."""
    known, m = with_friction(path), len(path.forces)
    holding = control_held(path.contact, holding)
    spent, far = (
        checks.array(name, 0.0 if given is None else given, length=m, one="force")
        for name, given in (("losses", losses), ("displacements", displacements))
    )
    if losses is None and displacements is None:
        spent = np.eye(m)[-1]
    # A loss on one segment is part of all later losses.
    later = [*accumulate(map(Fraction, spent[::-1].tolist()))][::-1]
    steps = [(k, later[k], Fraction(far[k])) for k in range(m)]
    points = np.array([(curve.load, curve.height) for curve in path.curves])
    along = Along(known, Fraction(path.start), steps, points)
    sharp = path.order == "proved" or not spent.any()
    return _gradient(path.contact, along, holding, paths=not path.load_constant, sharp=sharp)


def _gradient(
    contact: Contact, along: Along, holding: Holding, *, paths: bool, sharp: bool
) -> Gradient:
    """The gradient of a weighted sum along a path.

    paths : True if the load varies: derivatives by the loads of all points are added
    sharp : False for losses whose order is not proved
    """
    if paths and holding == "approach":
        expected = '"load", because the loads of all points are prescribed'
        raise InputError("holding", found='"approach"', expected=expected)
    if not paths and any(abs(T) == P for P, T in along.points):
        expected = "forces below f P: in gross sliding there is no derivative"
        raise InputError("forces", found="gross sliding", expected=expected)
    known = along.known
    lost, moved = along.parts({} if paths else by_load(known.units))
    loss, far = (sum((part.value for part in parts), start=ZERO) for parts in (lost, moved))
    f, in_P, in_T = known.coefficient, *np.eye(2, dtype=object)
    each = np.eye(len(along.points), dtype=object)[:, :, None]
    explicit, sides = at_fixed_levels(known, loss, far), {}
    scaled, _ = along.slopes(along.points[None] * in_T, 1.0 / f)
    by_friction = explicit["friction"] - scaled[0]
    explicit["friction"] = NONE if np.isnan(scaled.value[0]) else by_friction
    explicit["forces"], sides["forces"] = along.slopes(each * in_T, 1.0 / f)
    if paths:
        explicit["loads"], sides["loads"] = along.slopes(each * in_P, Ball.exact(1.0))
    number = Number.of(known.top, loss + far, [*lost, *moved], explicit, **sides)
    return Gradient.of(contact, number if sharp else _loose(number), holding)


def _loose(number: Number) -> Number:
    """The number with infinite error bounds."""
    return number.times(Ball.around(1.0, np.inf))


def _where_open(level: Level, weights: Array) -> Ball:
    """(n,) weights of gaps; 0 if an asperity touches, an interval from 0 if this is undecided."""
    if level.box is None:
        shut = level.springs.touching if level.trial is not None else ~level.open
        return Ball.exact(np.where(shut, 0.0, weights))
    low, high = np.minimum(weights, 0.0), np.maximum(weights, 0.0)
    doubtful = ~level.touching & ~level.open
    known = Ball.exact(np.where(level.open, weights, 0.0))
    return balls.where(doubtful, Ball.between(low, high), known) if doubtful.any() else known


def _checked(contact: Contact, weights: Mapping[str, Any]) -> Iterator[Any]:
    """The checked weights: numbers, or arrays (n,) for asperities; 0 in place of None."""
    if all(value is None for value in weights.values()):
        expected = "weights of at least one of these results"
        raise InputError(", ".join(weights), found="none", expected=expected)
    for name, given in weights.items():
        value = 0.0 if given is None else given
        if name in ("load", "approach", "displacement"):
            yield checks.finite(name, value)
        else:
            yield checks.array(name, value, length=len(contact.scene))
