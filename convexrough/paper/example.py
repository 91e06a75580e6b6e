"""The example of the paper by Dini and Hills, its states, and the numbers published there.

Dini and Hills, "Frictional Energy Dissipation in a Rough Hertzian Contact", Journal of Tribology
131 (2009), doi 10.1115/1.3063697: a hexagonal array of asperities, one of them under the centre of
the sphere. Lengths are in units of the sphere's radius, pressures in units of the contact modulus.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
import scipy  # its parts are imported when they are used

import convexrough as cr
from convexrough import checks
from convexrough.arrays import Array, Indices
from convexrough.run.stage import Result
from convexrough.run.stages import CycleStage, NormalStage, ShearStage
from convexrough.scene.rings import rings
from convexrough.tabular.columns import aligned

#: The paper's approach.
APPROACH = 5e-5

#: The paper's rings, from the centre outwards, each with its number of asperities.
RINGS = {"F": 1, "E": 6, "D": 6, "C": 6, "B": 12, "A": 6}

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
    """The results that the paper's figures, their tables and the comparison of numbers show, of a
    contact in six rings, as in the paper.

    named  : indices of touching asperities by the letter of their ring, from the axis outwards to
        ring A;  firsts : the first of each ring
    onsets : (n,) Q / (f P) at which each asperity starts to slide
    half, steady, loop : state at half of the limit f P; cycle to plus and minus that; its loop
    path   : loading from rest through Q / (f P) = `fractions`, with the onsets of all rings
    cycles : steady cycles at `AMPLITUDES`;  crossing : amplitude Q / (f P) above which the rough
        contact loses more per cycle than a smooth one
    """

    def __init__(self, contact: cr.Contact) -> None:
        self.contact = contact
        self.limit = limit = checks.friction(contact.scene.friction) * contact.load
        groups = rings(contact.scene.asperities.distances, contact.loads)
        self.named: dict[str, Indices] = dict(zip(RINGS, groups, strict=True))
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
        def excess(part: float) -> float:
            cycle = cr.cycle(self.contact, maximum=part * self.limit)
            return cycle.loss_normalised - cycle.smooth_normalised

        return float(scipy.optimize.brentq(excess, 0.2, 0.6, xtol=1e-12))


def scene() -> cr.Scene:
    """The paper's scene, with all asperities that the undeformed sphere overlaps."""
    return scene_of(cr.Asperities.hexagonal(spacing=0.0025, tip_radius=0.02, within=0.0102))


def scene_of(asperities: cr.Asperities) -> cr.Scene:
    """The paper's sphere, material and friction, with these asperities."""
    material = cr.Material(contact_modulus=1.0, poisson_ratio=0.3)
    return cr.Scene(1.0, asperities, material, friction=0.5, geometry="summit")


def results() -> list[Result]:
    """The results of pressing, shearing and cycling at the amplitudes that the paper shows."""
    parts = [0.1, 0.37, 0.5]
    contact = cr.press(scene(), approach=APPROACH)
    pressed = NormalStage(approach=APPROACH).compute(contact)
    sheared = ShearStage(fractions=parts).compute(contact)
    return [pressed, sheared, CycleStage(maximum_fraction=parts).compute(contact)]


def compare(found: PaperStates) -> dict[str, Any]:
    """The paper's numbers (None if not published) and the computed numbers, by name."""
    touches, slides = found.contact.status == "contact", found.half.status == "sliding"
    sliding = sorted(name for name, ring in found.named.items() if slides[ring].any())

    def pair(paper: Any, computed: Any) -> dict[str, Any]:
        return {"paper": paper, "computed": computed}

    def of_ring(count: int, ring: Indices) -> dict[str, Any]:
        load, onset = found.contact.loads[ring].mean(), found.onsets[ring].min()
        own = {"load": float(load), "first_slide": float(onset)}
        return pair(count, int(touches[ring].sum())) | own

    return {
        "contacts": pair(37, int(touches.sum())),
        "rings": {name: of_ring(count, found.named[name]) for name, count in RINGS.items()},
        "sliding_at_half": pair(6, int(slides.sum())),
        "sliding_ring_at_half": pair("A", "".join(sliding)),
        "first_slide": pair(None, float(np.nanmin(found.onsets))),
        "crossover": pair(READ_CROSSING, found.crossing),
        "loss_at_half": pair(None, found.steady.loss_normalised),
        "smooth_loss_at_half": pair(None, found.steady.smooth_normalised),
    }


def table(comparison: dict[str, Any]) -> list[str]:
    """The lines of a table with quantities, the paper's values and the computed values."""
    rows = [("quantity", {"paper": "paper", "computed": "computed"}, "")]
    rows.append(("asperities in contact", comparison["contacts"], ""))
    for name, ring in comparison["rings"].items():
        more = f"load of each {ring['load']:.6e}, slides from Q/(fP) = {ring['first_slide']:.4f}"
        rows.append((f"  ring {name}", ring, more))
    rows += [
        ("sliding at Q/(fP) = 0.5", comparison["sliding_at_half"], ""),
        ("  ring of these asperities", comparison["sliding_ring_at_half"], ""),
        ("first asperity slides at Q/(fP)", comparison["first_slide"], ""),
        ("rough loses more above Q/(fP)", comparison["crossover"], "paper: read from a graph"),
        ("loss W/W0 at Q/(fP) = 0.5, rough", comparison["loss_at_half"], ""),
        ("loss W/W0 at Q/(fP) = 0.5, smooth", comparison["smooth_loss_at_half"], ""),
    ]
    lines = aligned([(name, row["paper"], row["computed"]) for name, row, _ in rows], left=1)
    return [f"{line}  {more}".rstrip() for line, (*_, more) in zip(lines, rows, strict=True)]
