"""The shear stages asked for, on a pressed contact. Forces are fractions of f P."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from convexrough import checks
from convexrough.contact import Contact
from convexrough.friction.cycle import Cycle, Loop, cycles, loops
from convexrough.friction.path import History, history
from convexrough.friction.shear import ShearState, shear
from convexrough.progress import Announce
from convexrough.run.sensitivity import Differentiated, Missing, Sensitivity
from convexrough.run.varying import Varied, Varying
from convexrough.scene.rings import one_of_each_ring

Fractions = tuple[float, ...]

#: Asperities whose loops are kept, at most, unless they are named.
MOST_LOOPS = 12

#: Points of a loop, at most and at least, and touching asperities times points that are affordable:
#: each takes a friction state of all of them.
MOST_POINTS, LEAST_POINTS, AFFORDABLE = 400, 32, 600_000


@dataclass(frozen=True)
class Stages:
    """What is asked for, None where it is not.

    shear   : shear forces, as fractions of f P
    cycle   : maxima and minima of steady cycles, as fractions of f P
    history : shear forces one after the other, as fractions of f P
    varying : paths of load and shear, which do not start from the contact
    gradient : of what, and by what
    loop_points : of each loop, about; None for what is affordable
    loop_asperities : whose loops to keep: indices or "all"; None for one at each distance from the
        axis, of at most 12 distances
    """

    shear: Fractions | None = None
    cycle: tuple[Fractions, Fractions] | None = None
    history: Fractions | None = None
    varying: Varying = field(default_factory=Varying)
    gradient: Sensitivity | None = None
    loop_points: int | None = None
    loop_asperities: tuple[int, ...] | Literal["all"] | None = None


class Sheared(NamedTuple):
    """The state under one shear force."""

    fraction: float
    state: ShearState


class Cycled(NamedTuple):
    """The steady cycle between two shear forces, and its loop."""

    maximum: float
    minimum: float
    cycle: Cycle
    loop: Loop


class Followed(NamedTuple):
    """The history of a sequence of shear forces."""

    fractions: Fractions
    history: History


@dataclass(frozen=True, eq=False)
class Findings:
    """A contact and what was computed of it; empty or None where nothing was asked for."""

    contact: Contact
    shear: tuple[Sheared, ...] = ()
    cycles: tuple[Cycled, ...] = ()
    history: Followed | None = None
    varying: Varied = field(default_factory=Varied)
    gradient: Differentiated | Missing | None = None


def compute(contact: Contact, stages: Stages, announce: Announce | None = None) -> Findings:
    """All stages asked for.

    announce : told in a line how far long work has come
    """
    varied = stages.varying.compute(contact, announce)
    slopes = None if stages.gradient is None else stages.gradient.compute(contact)
    if stages.shear is None and stages.cycle is None and stages.history is None:
        return Findings(contact, varying=varied, gradient=slopes)
    limit = checks.friction(contact.scene.friction) * contact.load
    maxima, minima = stages.cycle or ((), ())
    steady = cycles(contact, limit * np.array(maxima), limit * np.array(minima), announce=announce)
    drawn = loops(steady, _points(contact, stages), announce, _chosen(contact, stages))
    followed = None
    if stages.history is not None:
        past = history(contact, forces=limit * np.array(stages.history), announce=announce)
        followed = Followed(stages.history, past)
    return Findings(
        contact,
        shear=tuple(
            Sheared(part, shear(contact, force=part * limit, announce=announce))
            for part in stages.shear or ()
        ),
        cycles=tuple(map(Cycled, maxima, minima, steady, drawn)),
        history=followed,
        varying=varied,
        gradient=slopes,
    )


def _points(contact: Contact, stages: Stages) -> int:
    if stages.loop_points is not None:
        return stages.loop_points
    touching = max(1, int((contact.loads > 0).sum()))
    return int(np.clip(AFFORDABLE // touching, LEAST_POINTS, MOST_POINTS))


def _chosen(contact: Contact, stages: Stages) -> ArrayLike | None:
    """Indices of the asperities whose loops to keep, None for all."""
    if stages.loop_asperities is None:
        return one_of_each_ring(contact.scene.asperities.distances, contact.loads, MOST_LOOPS)
    return None if stages.loop_asperities == "all" else stages.loop_asperities
