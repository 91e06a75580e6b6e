"""The states and paths of the source paper's Figs. 4 to 9, computed once for a contact."""

from __future__ import annotations

from functools import cached_property

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


#: Amplitude Q / (f P) at which, by the paper, the curves of its Fig. 9 cross.
READ_CROSSING = 0.37


class PaperStates:
    """The results that the paper's figures, their tables and the comparison of numbers show.

    limit  : [force] friction limit f P
    named  : indices of touching asperities by the letter of their ring, from the axis outwards; the
        outermost ring has the letter A;  firsts : the first of each ring
    onsets : (n,) Q / (f P) at which each asperity starts to slide
    half   : state at half of the limit;  steady, loop : cycle between plus and minus half of the
        limit, and its loop
    path   : loading from rest through Q / (f P) = `fractions`, which include the onsets of all
        rings
    cycles : steady cycles at `AMPLITUDES`;  crossing : amplitude Q / (f P) above which the rough
        contact loses more per cycle than a smooth one
    """

    def __init__(self, contact: cr.Contact) -> None:
        self.contact = contact
        self.limit = limit = checks.friction(contact.scene.friction) * contact.load
        groups = rings(contact.scene.asperities.distances, contact.loads)
        letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"[len(groups) - 1 :: -1]
        self.named: dict[str, Indices] = dict(zip(letters, groups, strict=True))
        self.firsts = {name: int(ring[0]) for name, ring in self.named.items()}
        self.onsets: Array = cr.onset_of_sliding(contact) / limit
        self.half = cr.shear(contact, force=SHARE * limit)
        self.steady = cr.cycle(contact, maximum=SHARE * limit)
        self.loop = self.steady.loop(400)
        onsets = self.onsets[list(self.firsts.values())]
        self.fractions = np.minimum(np.union1d(FRACTIONS, onsets), 1.0)
        self.path = cr.history(contact, forces=self.fractions * limit)
        self.cycles = cr.cycles(contact, AMPLITUDES * limit)

    @cached_property
    def crossing(self) -> float:
        from scipy.optimize import brentq  # 0.1 s to import: only when asked

        def excess(part: float) -> float:
            cycle = cr.cycle(self.contact, maximum=part * self.limit)
            return cycle.loss_normalised - cycle.smooth_normalised

        return float(brentq(excess, 0.2, 0.6, xtol=1e-12))
