"""The states and paths of the source paper's Figs. 4 to 9, computed once for a contact."""

from __future__ import annotations

import numpy as np

import convexrough as cr
from convexrough import checks
from convexrough.arrays import Array, Indices
from convexrough.scene.rings import rings

#: Q / (f P) of the paper's Figs. 4 to 6 and 8.
SHARE = 0.5

#: Forces Q / (f P) of loading from rest, and amplitudes Q / (f P) of cycles; both are closer
#: together near gross sliding.
FRACTIONS = np.union1d(np.linspace(0.0, 1.0, 51), 1.0 - np.linspace(0.0, 1.0, 31) ** 2)
AMPLITUDES = np.union1d(
    np.concatenate((np.geomspace(1e-3, 0.0125, 6), np.linspace(0.0125, 1.0, 80))),
    1.0 - 0.02 * np.linspace(0.0, 1.0, 11)[:-1] ** 2,
)


class PaperStates:
    """The results that the paper's figures and their tables show, for a contact with friction.

    limit  : [force] friction limit f P
    named  : indices of touching asperities by the letter of their ring, from the axis outwards; the
        outermost ring has the letter A
    onsets : (n,) Q / (f P) at which each asperity starts to slide
    half   : state at half of the limit;  steady, loop : cycle between plus and minus half of the
        limit, and its loop
    path   : loading from rest through Q / (f P) = `fractions`, which include the onsets of all
        rings
    cycles : steady cycles at `AMPLITUDES`
    """

    def __init__(self, contact: cr.Contact) -> None:
        self.contact = contact
        self.limit = limit = checks.friction(contact.scene.friction) * contact.load
        self.named = lettered(contact)
        self.onsets: Array = cr.onset_of_sliding(contact) / limit
        self.half = cr.shear(contact, force=SHARE * limit)
        self.steady = cr.cycle(contact, maximum=SHARE * limit)
        self.loop = self.steady.loop(400)
        firsts = [ring[0] for ring in self.named.values()]
        self.fractions = np.minimum(np.union1d(FRACTIONS, self.onsets[firsts]), 1.0)
        self.path = cr.history(contact, forces=self.fractions * limit)
        self.cycles = cr.cycles(contact, AMPLITUDES * limit)


def lettered(contact: cr.Contact) -> dict[str, Indices]:
    """Indices of touching asperities by ring, from the axis outwards; the outermost ring is A."""
    groups = rings(contact.scene.asperities.distances, contact.loads)
    several = -(-len(groups) // 26)
    letters = [chr(ord("A") + k) * (turn + 1) for turn in range(several) for k in range(26)]
    return dict(zip(reversed(letters[: len(groups)]), groups, strict=True))
