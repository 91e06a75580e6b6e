"""The example of the paper by Dini and Hills, and the numbers published there.

Dini and Hills, "Frictional Energy Dissipation in a Rough Hertzian Contact", Journal of Tribology
131 (2009), doi 10.1115/1.3063697: a hexagonal array of asperities, one of them under the centre of
the sphere. Lengths are in units of the sphere's radius, pressures in units of the contact modulus.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

import convexrough as cr
from convexrough.paper.states import READ_CROSSING, PaperStates
from convexrough.run.stage import Result
from convexrough.run.stages import CycleStage, NormalStage, ShearStage
from convexrough.tabular.columns import aligned

APPROACH = 5e-5

#: The paper's rings, from the centre outwards, each with its number of asperities.
RINGS = {"F": 1, "E": 6, "D": 6, "C": 6, "B": 12, "A": 6}


def scene() -> cr.Scene:
    """The paper's scene, with all asperities that the undeformed sphere overlaps."""
    asperities = cr.Asperities.hexagonal(spacing=0.0025, tip_radius=0.02, within=0.0102)
    material = cr.Material(contact_modulus=1.0, poisson_ratio=0.3)
    return cr.Scene(1.0, asperities, material, friction=0.5, geometry="summit")


def results() -> list[Result]:
    """The results of pressing, shearing and cycling at the amplitudes that the paper shows."""
    parts = [0.1, 0.37, 0.5]
    stages = (
        NormalStage(approach=APPROACH),
        ShearStage(fractions=parts),
        CycleStage(maximum_fraction=parts),
    )
    contact = cr.press(scene(), approach=APPROACH)
    return [stage.compute(contact) for stage in stages]


def compare(found: PaperStates) -> dict[str, Any]:
    """The paper's numbers (None if not published) and the computed numbers, by name."""
    contact, named, half = found.contact, found.named, found.half
    sliding = sorted(name for name, ring in named.items() if (half.status[ring] == "sliding").any())
    return {
        "contacts": _pair(37, _count(contact.status, "contact")),
        "rings": {
            name: {
                **_pair(count, _count(contact.status[named[name]], "contact")),
                "load": float(contact.loads[named[name]].mean()),
                "first_slide": float(found.onsets[named[name]].min()),
            }
            for name, count in RINGS.items()
        },
        "sliding_at_half": _pair(6, _count(half.status, "sliding")),
        "sliding_ring_at_half": _pair("A", "".join(sliding)),
        "first_slide": _pair(None, float(np.nanmin(found.onsets))),
        "crossover": _pair(READ_CROSSING, found.crossing),
        "loss_at_half": _pair(None, found.steady.loss_normalised),
        "smooth_loss_at_half": _pair(None, found.steady.smooth_normalised),
    }


def _count(statuses: NDArray[np.str_], status: str) -> int:
    return int((statuses == status).sum())


def _pair(paper: Any, computed: Any) -> dict[str, Any]:
    return {"paper": paper, "computed": computed}


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
