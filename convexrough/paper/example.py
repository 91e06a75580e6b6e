"""The source paper's example, its published numbers, and the data behind its figures.

Dini and Hills, "Frictional Energy Dissipation in a Rough Hertzian Contact", Journal of Tribology
131 (2009), doi 10.1115/1.3063697: a hexagonal array of asperities with one under the centre,
lengths in units of the sphere's radius and pressures in units of the contact modulus. Built from
the public names only.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

import convexrough as cr
from convexrough import fields
from convexrough.arrays import Array
from convexrough.run.stages import Outcome, compute

APPROACH = 5e-5
SPACING = 0.0025

#: The paper's rings from the centre outwards: (distance / spacing)^2 and number of asperities.
RINGS = {"F": (0, 1), "E": (1, 6), "D": (3, 6), "C": (4, 6), "B": (7, 12), "A": (9, 6)}

#: Amplitudes of the loss curve and forces of the asperity curves, as fractions of f P.
AMPLITUDES = np.concatenate((np.geomspace(1e-3, 0.02, 20)[:-1], np.linspace(0.02, 1.0, 99)))
FRACTIONS = np.linspace(0.0, 1.0, 201)

Columns = dict[str, NDArray[Any]]


def scene() -> cr.Scene:
    """The example, with every asperity that the sphere's undeformed surface would reach."""
    asperities = cr.Asperities.hexagonal(spacing=SPACING, tip_radius=0.02, within=0.0102)
    material = cr.Material(contact_modulus=1.0, poisson_ratio=0.3)
    return cr.Scene(1.0, asperities, material, friction=0.5)


def outcome() -> Outcome:
    """Pressed, sheared to half of gross sliding, and cycled at the amplitudes the paper shows."""
    maxima = (0.1, 0.37, 0.5)
    return compute(
        cr.press(scene(), approach=APPROACH),
        shear_at=maxima,
        cycle_between=(maxima, tuple(-part for part in maxima)),
        history_of=None,
    )


def ring_names(contact: cr.Contact) -> NDArray[np.str_]:
    """(n,) the letter of each loaded asperity's ring, "" for the others."""
    squared = np.rint((contact.scene.asperities.distances / SPACING) ** 2)
    names = np.full(len(squared), "", dtype="<U1")
    for name, (distance, _) in RINGS.items():
        names[(squared == distance) & (contact.loads > 0)] = name
    return names


def crossover(contact: cr.Contact) -> float:
    """Q_max / (f P) at which a rough cycle begins to cost more than a smooth one."""
    from scipy.optimize import brentq  # 0.1 s to import: only when asked

    limit = 0.5 * contact.load

    def excess(part: float) -> float:
        cycle = cr.cycle(contact, maximum=part * limit)
        return cycle.energy_normalised - cycle.smooth_normalised

    return float(brentq(excess, 0.2, 0.6, xtol=1e-12))


def compare(outcome: Outcome) -> dict[str, Any]:
    """The paper's numbers and the computed ones, by the names that `summary.json` uses.

    The paper's number is None where it prints none.
    """
    contact = outcome.contact
    names = ring_names(contact)
    limit = 0.5 * contact.load
    onsets = cr.onset_of_sliding(contact) / limit
    half = next(state for part, state in outcome.shear if part == 0.5)
    cycle = next(cycle for part, _, cycle in outcome.cycles if part == 0.5)
    rings = {}
    for name, (_, count) in RINGS.items():
        ring = names == name
        rings[name] = {
            "paper": count,
            "computed": int((contact.status[ring] == "contact").sum()),
            "load": float(contact.loads[ring].mean()),
            "first_slide": float(onsets[ring].min()),
        }
    return {
        "contacts": _pair(37, int((contact.status == "contact").sum())),
        "rings": rings,
        "sliding_at_half": _pair(6, int((half.status == "sliding").sum())),
        "sliding_ring_at_half": _pair("A", "".join(sorted(set(names[half.status == "sliding"])))),
        "first_slide": _pair(None, float(np.nanmin(onsets))),
        "crossover": _pair(0.37, crossover(contact)),
        "loss_at_half": _pair(None, cycle.energy_normalised),
        "smooth_loss_at_half": _pair(None, cycle.smooth_normalised),
    }


def _pair(paper: Any, computed: Any) -> dict[str, Any]:
    return {"paper": paper, "computed": computed}


def table(comparison: dict[str, Any]) -> list[str]:
    """Aligned lines: quantity, what the paper says, what is computed."""
    rows = [("asperities in contact", comparison["contacts"], "")]
    for name, ring in comparison["rings"].items():
        more = f"load of each {ring['load']:.6e}, slides from Q/(fP) = {ring['first_slide']:.4f}"
        rows.append((f"  ring {name}", ring, more))
    rows += [
        ("sliding at Q/(fP) = 0.5", comparison["sliding_at_half"], ""),
        ("  their ring", comparison["sliding_ring_at_half"], ""),
        ("first to slide at Q/(fP)", comparison["first_slide"], ""),
        ("rough costs more beyond", comparison["crossover"], "the paper reads a graph"),
        ("loss W/W0 at 0.5, rough", comparison["loss_at_half"], ""),
        ("loss W/W0 at 0.5, smooth", comparison["smooth_loss_at_half"], ""),
    ]
    lines = [f"{'quantity':<26}{'paper says':>12}{'computed':>12}"]
    for name, row, more in rows:
        said, found = _shown(row["paper"]), _shown(row["computed"])
        lines.append(f"{name:<26}{said:>12}{found:>12}  {more}".rstrip())
    return lines


def _shown(value: Any) -> str:
    if value is None:
        return "-"
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def figure_data(contact: cr.Contact) -> dict[str, Columns]:
    """The numbers behind the paper's Figs. 3 to 9, name -> columns; forces as fractions of f P."""
    limit = 0.5 * contact.load
    names, positions = ring_names(contact), contact.scene.asperities.positions
    smooth = cr.smooth(contact.scene, load=contact.load)
    half = cr.shear(contact, force=0.5 * limit)
    x = np.linspace(-1.3, 1.3, 2001) * smooth.contact_radius
    line = np.column_stack((x, np.zeros_like(x)))
    close = np.linspace(0.0, 1.2, 241) * contact.contact_radii[0]
    radial = np.column_stack((close, np.zeros_like(close)))
    first = [int(np.flatnonzero(names == name)[0]) for name in RINGS]  # one of each ring
    path = cr.history(contact, forces=FRACTIONS * limit)
    loop = cr.cycle(contact, maximum=0.5 * limit).loop(200)
    branch = smooth.branch(loop.forces[: len(loop.forces) // 2 + 1], 0.5 * limit)
    smooth_loop: Array = np.concatenate((branch, -branch[1:]))
    cycles = cr.cycles(contact, AMPLITUDES * limit)
    x_i, y_i = positions.T
    return {
        "fig3_pressure": {
            "x": x,
            "pressure": fields.pressure(contact, line),
            "smooth_pressure": smooth.pressure(np.abs(x)),
        },
        "fig4_rings": {
            "x": x_i,
            "y": y_i,
            "ring": names,
            "load": contact.loads,
            "status_at_half": half.status,
        },
        "fig5_traction": {
            "x": x_i,
            "y": y_i,
            "contact_radius": contact.contact_radii,
            "stick_radius": half.stick_radii,
            "load": contact.loads,
            "force": half.forces,
        },
        "fig5_centre": {
            "r": close,
            "friction_limit": 0.5 * fields.pressure(contact, radial),
            "traction": fields.traction(half, radial),
        },
        "fig6_section": {
            "x": x,
            "friction_limit": 0.5 * fields.pressure(contact, line),
            "traction": fields.traction(half, line),
            "smooth_traction": smooth.traction(np.abs(x), half.force),
        },
        "fig7_asperities": {
            "fraction": FRACTIONS,
            "displacement": path.displacements,
            **{f"force_{n}": path.forces[:, i] for n, i in zip(RINGS, first, strict=True)},
            **{
                f"displacement_{n}": path.asperity_displacements[:, i]
                for n, i in zip(RINGS, first, strict=True)
            },
        },
        "fig8_loops": {
            "force": loop.forces,
            "displacement": loop.displacements,
            "smooth_displacement": smooth_loop,
            **{f"force_{n}": loop.asperity_forces[:, i] for n, i in zip(RINGS, first, strict=True)},
            **{
                f"displacement_{n}": loop.asperity_displacements[:, i]
                for n, i in zip(RINGS, first, strict=True)
            },
        },
        "fig9_energy": {
            "fraction": AMPLITUDES,
            "loss": np.array([cycle.energy_normalised for cycle in cycles]),
            "smooth_loss": np.array([cycle.smooth_normalised for cycle in cycles]),
            "balance_defect": np.array([cycle.balance_defect for cycle in cycles]),
        },
    }
