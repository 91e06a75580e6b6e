"""Gradients of a pressed contact, of a friction state, and of an onset of sliding."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction

import numpy as np
from numpy.typing import ArrayLike

from convexrough import checks
from convexrough.arrays import Array, Indices, among_zeros
from convexrough.contact import Contact
from convexrough.errors import InputError
from convexrough.gradients.adjoint import (
    Adjoint,
    Friction,
    Holding,
    Pair,
    Pulled,
    excess,
    through_friction,
    through_pressing,
)
from convexrough.gradients.doubts import Doubt, GivenDoubt, StateDoubt
from convexrough.gradients.gradient import Gradient, to_scene
from convexrough.gradients.gross import (
    GrossDoubt,
    last_to_slide,
    slides_last,
    through_gross_sliding,
)
from convexrough.gradients.origin import Origin, felt, held, pressed
from convexrough.gradients.system import TOLERANCE, System
from convexrough.influence.choice import couple
from convexrough.shearing.state import ShearState, indices, onset_of_sliding


def contact_gradient(
    contact: Contact,
    *,
    loads: ArrayLike | None = None,
    gaps: ArrayLike | None = None,
    approach: float | None = None,
    load: float | None = None,
    holding: Holding | None = None,
    tolerance: float = TOLERANCE,
) -> Gradient:
    """As `Contact.gradient`."""
    holding, problem = held(contact, holding), pressed(contact)
    P, D = _number("load", load), _number("approach", approach)
    on_loads = _weights("loads", loads, contact) + P
    on_gaps = np.where(contact.loads > 0, 0.0, _weights("gaps", gaps, contact))
    _something(loads=loads, gaps=gaps, approach=approach, load=load)

    touching, units = problem.touching, problem.units
    far = np.flatnonzero(on_gaps)
    pulled = Pulled(on_loads[touching] * units.force, np.zeros(len(problem)), [])
    whole = (D - float(on_gaps.sum())) * units.length
    off = np.where(contact.loads > 0, 0.0, np.abs(on_loads)) * units.force
    if len(far):
        away = couple(contact.scene, far, problem.influence.scale, contact.influence)
        onto = away.onto(contact.scene.contact_points[touching])
        pulled = pulled._replace(loads=pulled.loads + onto.apply(on_gaps[far]) * units.length)
        sizes = np.abs(on_gaps[far])
        off[touching] += onto.rounding(sizes).of(onto.apply(sizes)) * units.length
    doubts: list[Doubt] | None = [GivenDoubt(1.0, pulled.loads, off)]
    if len(far) and (contact.status == "undecided").any():  # whose gap may not be there
        doubts = None
    adjoint = through_pressing(problem, pulled, holding, tolerance, whole)
    origin = Origin.of(contact, adjoint, holding, doubts=doubts, approach=whole)
    if len(far):
        origin = _with_gaps(origin, adjoint, holding, far, on_gaps[far] * units.length)
    carried = float(on_loads @ contact.loads)
    return to_scene(
        origin,
        holding,
        value=carried + float(on_gaps @ contact.gaps) + D * contact.approach,
        scaled=(carried,),
        cancels=False,
        friction=None if contact.scene.friction is None else 0.0,
    )


def _with_gaps(
    origin: Origin, adjoint: Adjoint, holding: Holding, far: Indices, weights: Array
) -> Origin:
    """Weights on gaps besides: dg = A dP + dA P - dd - dD0 at each open asperity."""
    problem = pressed(origin.contact)
    places = np.union1d(problem.touching, far)
    here, there = np.searchsorted(places, problem.touching), np.searchsorted(places, far)

    def spread(values: Array, at: Indices) -> Array:
        return among_zeros(values, at, len(places))

    pairs = [Pair(spread(pair.left, here), spread(pair.right, here)) for pair in adjoint.pairs]
    pairs.append(Pair(spread(weights, there), spread(problem.loads, here)))
    whole = adjoint._replace(
        offsets=spread(adjoint.offsets, here) - spread(weights, there),
        local=spread(adjoint.local, here),
        pairs=pairs,
    )
    both = Origin.of(origin.contact, whole, holding, doubts=origin.doubts, places=places)
    return replace(both, total=origin.total)


def state_gradient(
    state: ShearState,
    *,
    displacement: float | None = None,
    forces: ArrayLike | None = None,
    slips: ArrayLike | None = None,
    holding: Holding | None = None,
    tolerance: float = TOLERANCE,
) -> Gradient:
    """As `ShearState.gradient`."""
    contact = state.contact
    holding, problem = held(contact, holding), pressed(contact)
    X = _number("displacement", displacement)
    on_forces, on_slips = _weights("forces", forces, contact), _weights("slips", slips, contact)
    _something(displacement=displacement, forces=forces, slips=slips)
    sign = -1.0 if state.force < 0 else 1.0
    touching, force_unit, travel = problem.touching, problem.force_unit, problem.travel_unit
    increments = sign * force_unit * on_forces[touching]
    moved, rise = sign * travel * on_slips[touching], sign * travel * X

    there = Friction.of_state(problem, state)
    felt(problem, "force", np.array([there.total]))
    doubts: list[Doubt] | None = None
    if limit := bool(problem.at_limit(np.array([there.total]))[0]):
        last = last_to_slide(problem, holding, "force", state.force)
        pulled, by_force, by_friction = through_gross_sliding(
            problem, last, increments=increments, slips=moved, rise=rise
        )
        doubts = [GrossDoubt(1.0, last, increments, moved, rise)]
    else:
        system = System(problem, there.slopes, tolerance)
        pulled = through_friction(
            problem, there, system, increments=increments, slips=moved, rise=rise
        )
        assert pulled.solution is not None
        total = -rise - float(moved[there.slides].sum())
        force = abs(Fraction(state.force))
        doubts = [StateDoubt(1.0, there, pulled.solution, increments, moved, total, force)]
        beyond, slides = excess(problem, there, system), there.slides
        by_force = pulled.total
        by_friction = rise * beyond.rise + float(increments @ beyond.increments)
        slid = beyond.deflections - there.signs * problem.ceilings
        by_friction += float(moved @ np.where(slides, slid, 0.0))
    adjoint = through_pressing(problem, pulled, holding, tolerance)
    carried = float(on_forces @ state.forces)
    length = X * state.displacement + float(on_slips @ state.slips)
    nu = contact.scene.material.poisson_ratio
    return to_scene(
        Origin.of(contact, adjoint, holding, doubts=doubts),
        holding,
        value=carried + length,
        scaled=(carried,) if limit else (by_friction, -length),
        cancels=not limit,
        poisson_ratio=length / ((1.0 - nu) * (2.0 - nu)),
        friction=by_friction / problem.friction,
        load=-by_force * np.inf if limit and np.isinf(by_force) else None,
        force=sign * by_force / force_unit,
    )


def onset_gradient(
    contact: Contact,
    asperity: int,
    *,
    holding: Holding | None = None,
    tolerance: float = TOLERANCE,
) -> Gradient:
    """Of the shear force at which one asperity starts to slide on first loading.

    asperity : its index in the scene
    holding, tolerance : as in `Contact.gradient`

    Raises InputError where the asperity carries no load, or slides last and not alone: then there
    is no derivative.

    >>> gradient = cr.onset_gradient(contact, 36)
    >>> print(f"{gradient.value / contact.load:.3f}", f"{gradient.friction / contact.load:.3f}")
    0.176 0.352
    """
    holding, problem = held(contact, holding), pressed(contact)
    checks.friction(contact.scene.friction)
    which = indices("asperity", [asperity], len(contact.scene))
    onset = float(onset_of_sliding(contact, which=which)[0])
    if np.isnan(onset):
        expected = "an asperity that carries a load: others never slide"
        raise InputError("asperity", found=asperity, expected=expected)
    place = int(np.searchsorted(problem.touching, which[0]))
    total = problem.limited(np.array([onset / problem.force_unit]))
    only = among_zeros(np.ones(1), np.array([place]), len(problem))
    if problem.at_limit(total)[0]:  # all slide at f P, the last one whatever the heights are
        if not slides_last(problem)[1]:
            expected = "one that slides before others do, or last and alone"
            found = f"{asperity}, which slides last, together with others"
            raise InputError("asperity", found=found, expected=expected)
        pulled = Pulled(np.full(len(problem), problem.force_unit), 0.0 * only, [])
    else:
        state = Friction.among(problem, problem.solve(total), 0)
        margin = through_friction(
            problem,
            state,
            System(problem, state.slopes, tolerance),
            increments=0.0 * only,
            slips=state.signs * only,
            rise=0.0,
        )
        pulled = margin.scaled(-problem.force_unit / margin.total)
    adjoint = through_pressing(problem, pulled, holding, tolerance)
    return to_scene(
        Origin.of(contact, adjoint, holding, doubts=None),
        holding,
        value=onset,
        scaled=(onset,),
        cancels=False,
        friction=onset / problem.friction,
    )


def _weights(what: str, values: ArrayLike | None, contact: Contact) -> Array:
    """(n,) checked; 0 where none are given."""
    return checks.array(what, 0.0 if values is None else values, length=len(contact.scene))


def _number(what: str, value: float | None) -> float:
    return 0.0 if value is None else checks.finite(what, value)


def _something(**weights: object) -> None:
    if all(value is None for value in weights.values()):
        expected = "at least one: weights on what is to be differentiated"
        raise InputError(", ".join(weights), found="none", expected=expected)
