"""The shear stages a scene file asks for, on a pressed contact. Forces are fractions of f P."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from convexrough import checks
from convexrough.arrays import Array, Indices
from convexrough.contact import Contact
from convexrough.progress import Announce
from convexrough.shearing.cycle import Cycle, cycles
from convexrough.shearing.history import History, history
from convexrough.shearing.state import ShearState, shear


@dataclass(frozen=True, eq=False)
class Outcome:
    """A contact and what was computed from it; stages that were not asked for are empty.

    shear   : (fraction, state) of each shear force
    cycles  : (maximum, minimum, cycle) of each steady cycle, as fractions
    history : (fractions, history), or None
    """

    contact: Contact
    shear: Sequence[tuple[float, ShearState]] = ()
    cycles: Sequence[tuple[float, float, Cycle]] = ()
    history: tuple[Sequence[float], History] | None = None


def compute(
    contact: Contact,
    *,
    shear_at: Sequence[float] | None,
    cycle_between: tuple[Sequence[float], Sequence[float]] | None,
    history_of: Sequence[float] | None,
    announce: Announce | None = None,
) -> Outcome:
    """The stages asked for; None for those that are not.

    announce : told in a line how far long work has come
    """
    if shear_at is None and cycle_between is None and history_of is None:
        return Outcome(contact)
    limit = checks.friction(contact.scene.friction) * contact.load
    maxima, minima = cycle_between or ((), ())
    steady = cycles(contact, limit * np.array(maxima), limit * np.array(minima), announce=announce)
    past = None
    if history_of is not None:
        past = (
            history_of,
            history(contact, forces=limit * np.array(history_of), announce=announce),
        )
    return Outcome(
        contact,
        shear=[
            (part, shear(contact, force=part * limit, announce=announce)) for part in shear_at or ()
        ],
        cycles=list(zip(maxima, minima, steady, strict=True)),
        history=past,
    )


def representatives(contact: Contact, most: int = 12) -> Indices:
    """Loaded asperities, one from each distance from the axis, evenly chosen if there are many."""
    touching = np.flatnonzero(contact.loads)
    distances: Array = contact.scene.asperities.distances[touching]
    spacing = 1e-9 * float(distances.max(initial=0.0)) or 1.0
    _, first = np.unique(np.round(distances / spacing), return_index=True)
    if len(first) > most:
        first = first[np.linspace(0, len(first) - 1, most).astype(int)]
    return touching[first]
