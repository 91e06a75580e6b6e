"""The shear stages asked for, on a pressed contact. Forces are fractions of f P."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from convexrough import checks
from convexrough.contact import Contact
from convexrough.progress import Announce
from convexrough.shearing.cycle import Cycle, cycles
from convexrough.shearing.history import History, history
from convexrough.shearing.state import ShearState, shear

Fractions = tuple[float, ...]


@dataclass(frozen=True)
class Stages:
    """What is asked for, None where it is not.

    shear   : shear forces, as fractions of f P
    cycle   : maxima and minima of steady cycles, as fractions of f P
    history : shear forces one after the other, as fractions of f P
    """

    shear: Fractions | None = None
    cycle: tuple[Fractions, Fractions] | None = None
    history: Fractions | None = None


class Sheared(NamedTuple):
    """The state under one shear force."""

    fraction: float
    state: ShearState


class Cycled(NamedTuple):
    """The steady cycle between two shear forces."""

    maximum: float
    minimum: float
    cycle: Cycle


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


def compute(contact: Contact, stages: Stages, announce: Announce | None = None) -> Findings:
    """All stages asked for.

    announce : told in a line how far long work has come
    """
    if stages.shear is None and stages.cycle is None and stages.history is None:
        return Findings(contact)
    limit = checks.friction(contact.scene.friction) * contact.load
    maxima, minima = stages.cycle or ((), ())
    steady = cycles(contact, limit * np.array(maxima), limit * np.array(minima), announce=announce)
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
        cycles=tuple(map(Cycled, maxima, minima, steady)),
        history=followed,
    )
