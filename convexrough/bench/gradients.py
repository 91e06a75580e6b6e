"""What a gradient of the loss costs, beside a press and the cycle it is of."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from convexrough import checks
from convexrough.bench.measure import Outcome, Tally, counted, outcome_of, timed
from convexrough.bench.scenes import APPROACH
from convexrough.contact import Contact, press
from convexrough.errors import InputError, SolverError
from convexrough.gradients.adjoint import Friction, excess, through_loss, through_pressing
from convexrough.gradients.system import TOLERANCE, System
from convexrough.scene.scene import Scene
from convexrough.shearing.cycle import cycle
from convexrough.shearing.problem import TangentialProblem


@dataclass(frozen=True)
class GradientRow:
    """pressing, cycling, differentiating : [s] of `press`, `cycle` and `Cycle.gradient`

    products, single : of the two linear systems, in double and in single precision
    outcome, message : as those of other rows
    """

    family: str
    asperities: int
    outcome: Outcome
    message: str = ""
    touching: int = 0
    pressing: float = np.nan
    cycling: float = np.nan
    differentiating: float = np.nan
    products: int = 0
    single: int = 0


def measure_gradient(family: str, scene: Scene) -> GradientRow:
    """Of the loss of a cycle to half of f P."""
    try:
        contact, pressing = timed(lambda: press(scene, approach=APPROACH))
        force = 0.5 * checks.friction(scene.friction) * contact.load
        found, cycling = timed(lambda: cycle(contact, maximum=force))
        _, differentiating = timed(lambda: found.gradient(holding="load"))
        tally = _products(contact, force)
    except (InputError, SolverError) as error:
        return GradientRow(family, len(scene), outcome_of(error), str(error))
    touching = int(np.count_nonzero(contact.loads))
    times = pressing, cycling, differentiating
    return GradientRow(
        family, len(scene), "answered", "", touching, *times, tally.double, tally.single
    )


def _products(contact: Contact, force: float) -> Tally:
    """Those of the two linear systems alone, at a state that is known."""
    tally, problem = Tally(), TangentialProblem.of(contact)
    states = problem.solve(np.array([force / problem.force_unit]))
    heard = replace(problem, influence=counted(problem.influence, tally))
    state = Friction.among(heard, states, 0)
    beyond = excess(heard, state, System(heard, state.slopes))
    through_pressing(heard, through_loss(heard, state, beyond), "load", TOLERANCE)
    return tally
