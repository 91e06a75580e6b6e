"""Gradients of a pressed contact, of a friction state, and of the onset of sliding."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from convexrough import checks
from convexrough.arithmetic import balls
from convexrough.arithmetic.balls import Ball
from convexrough.arrays import Array, Indices, among_zeros
from convexrough.contact import Contact
from convexrough.errors import InputError, ProofError
from convexrough.friction.cycle import Cycle
from convexrough.friction.levels import FrictionLevels
from convexrough.friction.onset import indices, root
from convexrough.friction.path import LoadPath
from convexrough.friction.shear import ShearState
from convexrough.gradients.gradient import Gradient, Holding, Number, control_held, levels
from convexrough.gradients.pulled import ZERO, Moves, Part, product
from convexrough.normal.level import Level
from convexrough.normal.proved import proved
from convexrough.normal.refine import refined_loads

#: Number of Newton steps to the level at which an asperity starts to slide. The relative error is
#: about 1e-15 at first, and each step raises it to the power 3/2.
NEWTON = 3


@dataclass(frozen=True)
class Frictional:
    """A contact with friction, and the levels of this contact by rational loads."""

    contact: Contact
    known: FrictionLevels

    @classmethod
    def of(cls, result: ShearState | Cycle | LoadPath) -> Frictional:
        """The contact of a result. Raises InputError if general steps computed the result."""
        if result.order == "fails":
            expected = "a result whose indentations do not fall as the load rises"
            raise InputError("order", found='"fails"', expected=expected)
        return cls.pressed(result.contact)

    @classmethod
    def pressed(cls, contact: Contact) -> Frictional:
        levels(contact)
        return cls(contact, contact.cached(FrictionLevels))

    @property
    def f(self) -> Ball:
        return self.known.coefficient

    @property
    def by_ratio(self) -> Ball:
        """The derivative of log c_t (Mindlin's ratio) by nu (Poisson's ratio)."""
        nu = Ball.exact(self.contact.scene.material.poisson_ratio)
        return 1.0 / ((1.0 - nu) * (2.0 - nu))

    @property
    def unit(self) -> float:
        """[force] the scaled unit of loads."""
        return self.known.units.force

    def below(self, what: str, force: float | Fraction, holding: Holding) -> Level:
        """The level at the load L = P - |Q| / f, for the shear force Q = `force`."""
        height = abs(self.known.height(force))
        if height == self.known.load and holding == "approach":
            expected = "a force below f P: at constant approach f P may fall below the force"
            raise InputError(what, found=f"{float(force)}: gross sliding", expected=expected)
        return self.known.at(self.known.load - height)

    def moves(self, height: Ball, /, **shares: float) -> Moves:
        """Derivatives of L = P - T, T = Q / f, by load, friction and forces.

        shares : derivative of Q by each force, by name
        """
        by_force = -1.0 / self.known.force_unit
        rates = {name: by_force * share for name, share in shares.items()}
        return {"load": self.top_moves["load"], "friction": height / self.f, **rates}

    @property
    def top_moves(self) -> Moves:
        return {"load": Ball.exact(1.0) / self.unit}


def contact_gradient(
    contact: Contact, holding: Holding | None = None, **weights: ArrayLike | None
) -> Gradient:
    """The result of `Contact.gradient`."""
    holding = control_held(contact, holding)
    top, (on_loads, on_gaps, D, P) = levels(contact).top, _checked(contact, weights)
    on_loads, units = on_loads + P, top.problem.units
    far = np.setdiff1d(np.flatnonzero(on_gaps), top.problem.candidates)
    if len(far):
        top = _wider(top, np.union1d(top.problem.candidates, far))
    which, length = top.problem.candidates, units.length
    gap_weights = _where_open(top, -on_gaps[which]) * length if on_gaps.any() else None
    part = Part(
        top,
        approach=Ball.exact(D) * length,
        loads=Ball.exact(on_loads[which]) * units.force if on_loads.any() else None,
        indentations=gap_weights,
        moves={"load": Ball.exact(1.0) / units.force},
    )
    explicit = {} if contact.scene.friction is None else {"friction": ZERO}
    return Gradient.of(Number.of(contact, top, [part], explicit), holding)


def state_gradient(
    state: ShearState, holding: Holding | None = None, **weights: ArrayLike | None
) -> Gradient:
    """The result of `ShearState.gradient`."""
    contact, sheared = state.contact, Frictional.of(state)
    holding = control_held(contact, holding)
    X, on_forces, on_slips = _checked(contact, weights)
    sign = -1.0 if state.force < 0 else 1.0
    top, low = sheared.known.top, sheared.below("force", state.force, holding)
    which, f, travel = top.problem.candidates, sheared.f, sheared.known.travel_unit
    weight = travel * (sign * X)
    # Q_i = f (P_i(P) - P_i(L));  X = c_t f (D0(P) - D0(L));  slips are c_t f times gaps at L
    carried = sheared.known.force_unit * Ball.exact(sign * on_forces[which])
    slid = _where_open(low, -sign * on_slips[which]) * travel
    slid = balls.where(~top.open, slid, 0.0 * slid)
    moved = sheared.moves(top.load - low.load, force=sign)
    parts = [
        Part(top, approach=weight, loads=carried, moves=sheared.top_moves),
        Part(low, approach=-weight, loads=-carried, indentations=slid, moves=moved),
    ]
    far = weight * (top.approach - low.approach) + slid.dot(low.indentation)
    near = carried.dot(top.loads - low.loads)
    explicit = {"friction": (far + near) / f, "poisson_ratio": far * sheared.by_ratio}
    return Gradient.of(Number.of(contact, top, parts, explicit), holding)


def onset_gradient(contact: Contact, asperity: int, *, holding: Holding | None = None) -> Gradient:
    """Derivatives of the shear force at which one asperity starts to slide on first loading.

    asperity : index of the asperity in the scene
    holding  : quantity kept constant, as in `Contact.gradient`

    Raises InputError if the scene has no friction, if the asperity carries no load, or if it is one
    of several that slide last: then there is no derivative. Raises ProofError if it is not proved
    that the indentation of the asperity rises with the load.

    >>> gradient = cr.onset_gradient(contact, 36)
    >>> print(f"{gradient.value / contact.load:.3f}", f"{gradient.friction / contact.load:.3f}")
    0.176 0.352
    """
    holding, sheared = control_held(contact, holding), Frictional.pressed(contact)
    top, f, unit = sheared.known.top, sheared.f, sheared.unit
    which = indices("asperity", [asperity], len(contact.scene))[0]
    if contact.loads[which] == 0.0:
        expected = "an asperity that carries a load: others never slide"
        raise InputError("asperity", found=asperity, expected=expected)
    place = int(top.problem.places[which])
    offsets, parts = top.problem.exact.offsets, []
    first = ~sheared.known.at(Fraction(0)).open
    total = top.load * f * unit
    start = root(sheared.known, place)
    if start > 0:
        low, slope = _just_touching(sheared, place)
        if sheared.known.order([start]) == "fails":
            raise ProofError("an indentation falls as the load rises: no onset is known")
        only = Ball.exact(among_zeros(np.ones(1), np.array([place]), len(offsets)))
        # n(L) = 0, so that -f dL = f dn / (dn/dL)
        parts = [Part(low, indentations=only * (f * unit / slope))]
        total = (top.load - low.load) * f * unit
    elif np.count_nonzero(first) > 1 or not first[place]:  # all of these slide at f P
        expected = "one that slides before another, or last and alone"
        found = f"{asperity}, which slides last, together with others"
        raise InputError("asperity", found=found, expected=expected)
    number = Number.of(contact, top, parts, {"load": f, "friction": total / f})
    return Gradient.of(number._replace(value=total), holding)


def _just_touching(sheared: Frictional, place: int) -> tuple[Level, Ball]:
    """The level at which the indentation n of a candidate is 0, and dn/dL at this level.

    The load L of the level is an interval that contains the root of n; n increases on all of it.
    """
    known, named = levels(sheared.contact), sheared.known

    def at(load: Ball) -> tuple[Level, Ball]:
        level = known.at(load)
        coupled = product(level, level.tangent.loads)[place]
        return level, level.tangent.approach - coupled

    load = Ball.exact(named.at(root(named, place)).load.mid)
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


def _where_open(level: Level, weights: Array) -> Ball:
    """(n,) weights of gaps: 0 where touching; where undecided, intervals from 0 to the weight."""
    if level.box is None:
        shut = level.springs.touching if level.trial is not None else ~level.open
        return Ball.exact(np.where(shut, 0.0, weights))
    low, high = np.minimum(weights, 0.0), np.maximum(weights, 0.0)
    doubtful = ~level.touching & ~level.open
    known = Ball.exact(np.where(level.open, weights, 0.0))
    return balls.where(doubtful, Ball.between(low, high), known) if doubtful.any() else known


def _wider(level: Level, which: Indices) -> Level:
    """The same level with the asperities `which` as further, open candidates."""
    problem = level.problem.widened(which)
    assert level.trial is not None
    places = np.searchsorted(which, level.problem.candidates)
    state = refined_loads(problem, among_zeros(level.trial.loads.high, places, len(which)))
    return proved(problem, state)


def _checked(contact: Contact, weights: Mapping[str, Any]) -> Iterator[Any]:
    """The checked weights: numbers, or arrays (n,) for asperities; 0 in place of None."""
    if all(value is None for value in weights.values()):
        expected = "weights of at least one of these results"
        raise InputError(", ".join(weights), found="none", expected=expected)
    for name, value in weights.items():
        if name in ("load", "approach", "displacement"):
            yield 0.0 if value is None else checks.finite(name, value)
        else:
            yield checks.array(name, 0.0 if value is None else value, length=len(contact.scene))
