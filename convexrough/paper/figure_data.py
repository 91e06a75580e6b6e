"""The numbers behind the source paper's Figs. 3 to 9."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

import convexrough as cr
from convexrough import fields
from convexrough.arrays import Array, Indices
from convexrough.paper.states import AMPLITUDES, SHARE, PaperStates
from convexrough.plots.cycle import smooth_loop

Columns = dict[str, NDArray[Any]]


def figure_data(found: PaperStates) -> dict[str, Columns]:
    """The numbers behind the paper's Figs. 3 to 9: names of tables, with their columns."""
    return _at_half(found) | _loading(found)


def _at_half(found: PaperStates) -> dict[str, Columns]:
    contact, half = found.contact, found.half
    smooth = cr.smooth(contact.scene, load=contact.load)
    x = np.linspace(-1.3, 1.3, 2001) * smooth.contact_radius
    line = np.column_stack((x, np.zeros_like(x)))
    close = np.linspace(0.0, 1.2, 241) * contact.contact_radii[0]
    radial = np.column_stack((close, np.zeros_like(close)))
    x_i, y_i = contact.scene.asperities.positions.T
    letters = np.full(len(x_i), "", dtype="<U1")
    for name, ring in found.named.items():
        letters[ring] = name
    return {
        "fig3_pressure": {
            "x": x,
            "pressure": fields.pressure(contact, line),
            "smooth_pressure": smooth.pressure(np.abs(x)),
        },
        "fig4_rings": {
            "x": x_i,
            "y": y_i,
            "ring": letters,
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
            "friction_limit": SHARE * fields.pressure(contact, radial),
            "traction": fields.traction(half, radial),
        },
        "fig6_section": {
            "x": x,
            "friction_limit": SHARE * fields.pressure(contact, line),
            "traction": fields.traction(half, line),
            "smooth_traction": smooth.traction(np.abs(x), half.force),
        },
    }


def _loading(found: PaperStates) -> dict[str, Columns]:
    path, loop = found.path, found.loop
    smooth = cr.smooth(found.contact.scene, load=found.contact.load)
    return {
        "fig7_asperities": {
            "fraction": found.fractions,
            "displacement": path.displacements,
            **_of_each_ring("force", found.named, path.asperity_forces),
            **_of_each_ring("displacement", found.named, path.asperity_displacements),
        },
        "fig8_loops": {
            "force": loop.forces,
            "displacement": loop.displacements,
            "smooth_displacement": smooth_loop(smooth, loop.forces),
            **_of_each_ring("force", found.named, loop.asperity_forces),
            **_of_each_ring("displacement", found.named, loop.asperity_displacements),
        },
        "fig9_energy": {
            "fraction": AMPLITUDES,
            "loss": np.array([cycle.loss_normalised for cycle in found.cycles]),
            "smooth_loss": np.array([cycle.smooth_normalised for cycle in found.cycles]),
            "balance_defect": np.array([cycle.balance_defect for cycle in found.cycles]),
        },
    }


def _of_each_ring(what: str, named: dict[str, Indices], values: Array) -> Columns:
    """Columns for the first asperity of each ring, from values (points, n)."""
    return {f"{what}_{name}": values[:, ring[0]] for name, ring in named.items()}
