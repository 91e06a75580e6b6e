"""The states and paths of the source paper's Figs. 4 to 9, computed once for a contact."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import convexrough as cr
from convexrough import checks
from convexrough.arrays import Array, Indices
from convexrough.scene.rings import rings

#: Q / (f P) of the paper's Figs. 4 to 6 and 8.
SHARE = 0.5

#: Forces Q / (f P) of loading from rest, denser near gross sliding; amplitudes Q / (f P) of cycles.
FRACTIONS = np.union1d(np.linspace(0.0, 1.0, 51), 1.0 - np.linspace(0.0, 1.0, 31) ** 2)
AMPLITUDES = np.union1d(
    np.concatenate((np.geomspace(1e-3, 0.0125, 6), np.linspace(0.0125, 1.0, 80))),
    1.0 - 0.02 * np.linspace(0.0, 1.0, 11)[:-1] ** 2,
)


@dataclass(frozen=True, eq=False)
class PaperStates:
    """The results that the figures and their tables show.

    limit  : [force] friction limit f P
    named  : touching asperities by ring, from the axis outwards; the last ring is A
    onsets : (n,) Q / (f P) at which each asperity starts to slide
    half   : state at half of the limit;  steady, loop : cycle between plus and minus this force
    path   : loading from rest to Q / (f P) = `fractions`, which include the onsets of all rings
    cycles : steady cycles at `AMPLITUDES`
    """

    contact: cr.Contact
    limit: float
    named: dict[str, Indices]
    onsets: Array
    half: cr.ShearState
    steady: cr.Cycle
    loop: cr.Loop
    fractions: Array
    path: cr.LoadPath
    cycles: list[cr.Cycle]

    @classmethod
    def of(cls, contact: cr.Contact) -> PaperStates:
        """The results for a pressed contact with friction."""
        limit = checks.friction(contact.scene.friction) * contact.load
        named = lettered(contact)
        onsets = cr.onset_of_sliding(contact) / limit
        firsts = [ring[0] for ring in named.values()]
        fractions = np.minimum(np.union1d(FRACTIONS, onsets[firsts]), 1.0)
        steady = cr.cycle(contact, maximum=SHARE * limit)
        return cls(
            contact=contact,
            limit=limit,
            named=named,
            onsets=onsets,
            half=cr.shear(contact, force=SHARE * limit),
            steady=steady,
            loop=steady.loop(400),
            fractions=fractions,
            path=cr.history(contact, forces=fractions * limit),
            cycles=cr.cycles(contact, AMPLITUDES * limit),
        )


def lettered(contact: cr.Contact) -> dict[str, Indices]:
    """The touching asperities by ring, from the axis outwards; the last ring is A."""
    groups = rings(contact.scene.asperities.distances, contact.loads)
    several = -(-len(groups) // 26)
    letters = [chr(ord("A") + k) * (turn + 1) for turn in range(several) for k in range(26)]
    return dict(zip(reversed(letters[: len(groups)]), groups, strict=True))
