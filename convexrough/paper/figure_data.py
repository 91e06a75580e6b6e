"""The numbers behind the source paper's Figs. 3 to 9."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

import convexrough as cr
from convexrough import fields
from convexrough.arrays import Array, Indices
from convexrough.paper.example import lettered

#: Amplitudes of the loss curve and forces of the asperity curves, as fractions of f P.
AMPLITUDES = np.concatenate((np.geomspace(1e-3, 0.02, 6)[:-1], np.linspace(0.02, 1.0, 50)))
FRACTIONS = np.linspace(0.0, 1.0, 51)

Columns = dict[str, NDArray[Any]]


def figure_data(contact: cr.Contact) -> dict[str, Columns]:
    """The numbers behind the paper's Figs. 3 to 9, name -> columns; forces as fractions of f P."""
    return _at_half(contact) | _loading(contact)


def _at_half(contact: cr.Contact) -> dict[str, Columns]:
    """Figs. 3 to 6: the pressure, and the state at half of gross sliding."""
    limit, smooth = 0.5 * contact.load, cr.smooth(contact.scene, load=contact.load)
    half = cr.shear(contact, force=0.5 * limit)
    x = np.linspace(-1.3, 1.3, 2001) * smooth.contact_radius
    line = np.column_stack((x, np.zeros_like(x)))
    close = np.linspace(0.0, 1.2, 241) * contact.contact_radii[0]
    radial = np.column_stack((close, np.zeros_like(close)))
    x_i, y_i = contact.scene.asperities.positions.T
    letters = np.full(len(x_i), "", dtype="<U1")
    for name, ring in lettered(contact).items():
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
            "friction_limit": 0.5 * fields.pressure(contact, radial),
            "traction": fields.traction(half, radial),
        },
        "fig6_section": {
            "x": x,
            "friction_limit": 0.5 * fields.pressure(contact, line),
            "traction": fields.traction(half, line),
            "smooth_traction": smooth.traction(np.abs(x), half.force),
        },
    }


def _loading(contact: cr.Contact) -> dict[str, Columns]:
    """Figs. 7 to 9: first loading, the loop at half of gross sliding, and energies."""
    limit, named = 0.5 * contact.load, lettered(contact)
    smooth = cr.smooth(contact.scene, load=contact.load)
    path = cr.history(contact, forces=FRACTIONS * limit)
    loop = cr.cycle(contact, maximum=0.5 * limit).loop(80)
    branch = smooth.branch(loop.forces[: len(loop.forces) // 2 + 1], 0.5 * limit)
    smooth_loop: Array = np.concatenate((branch, -branch[1:]))
    cycles = cr.cycles(contact, AMPLITUDES * limit)
    return {
        "fig7_asperities": {
            "fraction": FRACTIONS,
            "displacement": path.displacements,
            **_of_each_ring("force", named, path.asperity_forces),
            **_of_each_ring("displacement", named, path.asperity_displacements),
        },
        "fig8_loops": {
            "force": loop.forces,
            "displacement": loop.displacements,
            "smooth_displacement": smooth_loop,
            **_of_each_ring("force", named, loop.asperity_forces),
            **_of_each_ring("displacement", named, loop.asperity_displacements),
        },
        "fig9_energy": {
            "fraction": AMPLITUDES,
            "loss": np.array([cycle.loss_normalised for cycle in cycles]),
            "smooth_loss": np.array([cycle.smooth_normalised for cycle in cycles]),
            "balance_defect": np.array([cycle.balance_defect for cycle in cycles]),
        },
    }


def _of_each_ring(what: str, named: dict[str, Indices], values: Array) -> Columns:
    """A column for the first asperity of each ring; values (points, n)."""
    return {f"{what}_{name}": values[:, ring[0]] for name, ring in named.items()}
