"""The columns of the result tables (docs/reference/output-files.md)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from convexrough.contact import Contact
from convexrough.run.sensitivity import Differentiated, gradient_columns
from convexrough.run.stages import Cycled, Findings, Followed, Sheared
from convexrough.run.summary import SHEAR, counts
from convexrough.run.tables import ASPERITY_COLUMNS
from convexrough.run.varied import varied_tables

Columns: TypeAlias = dict[str, NDArray[Any]]


def stage_tables(found: Findings) -> Iterator[tuple[str, Columns]]:
    """The name and the columns of each table, one after the other."""
    yield "asperities", _asperity_columns(found.contact)
    if found.shear:
        yield "shear", _shear_columns(found.shear)
    if found.cycles:
        yield "cycle", _cycle_columns(found.cycles)
        yield "loop", _loop_columns(found.cycles)
    if found.history is not None:
        yield "history", _history_columns(found.history)
    yield from varied_tables(found.varying, found.contact)
    if isinstance(found.gradient, Differentiated):
        yield "gradient", dict(gradient_columns(found.gradient))


def _asperity_columns(contact: Contact) -> Columns:
    asperities = contact.scene.asperities
    x, y = asperities.positions.T
    values = (
        x,
        y,
        asperities.heights,
        asperities.tip_radii,
        contact.loads,
        contact.contact_radii,
        contact.gaps,
        contact.status,
        contact.certificate.load_errors,
    )
    return dict(zip(ASPERITY_COLUMNS, values, strict=True))


def _shear_columns(rows: tuple[Sheared, ...]) -> Columns:
    """One row for each fraction and asperity."""
    states = [row.state for row in rows]
    count = len(states[0].forces)
    x, y = states[0].contact.scene.asperities.positions.T
    fields = {
        "force": "forces",
        "stick_radius": "stick_radii",
        "slip": "slips",
        "displacement": "displacements",
        "status": "status",
    }
    return {
        "fraction": np.repeat([row.fraction for row in rows], count),
        "x": np.tile(x, len(rows)),
        "y": np.tile(y, len(rows)),
        **{
            name: np.concatenate([getattr(state, field) for state in states])
            for name, field in fields.items()
        },
    }


def _cycle_columns(rows: tuple[Cycled, ...]) -> Columns:
    """One row per cycle; energies are those of both bodies, per steady cycle."""
    cycles = [row.cycle for row in rows]
    names = (
        *("force_amplitude", "displacement_amplitude", "displacement_error"),
        *("secant_stiffness", "loss_factor"),
        *("loss", "loss_normalised", "smooth_normalised", "balance_defect"),
    )
    return {
        "maximum": np.array([row.maximum for row in rows]),
        "minimum": np.array([row.minimum for row in rows]),
        **{name: np.array([getattr(cycle, name) for cycle in cycles]) for name in names},
        "partial_slip_loss": np.array([each.partial_slip_losses.sum() for each in cycles]),
        "sliding_loss": np.array([each.sliding_losses.sum() for each in cycles]),
        "sliding": np.array([counts(each.status, SHEAR)["sliding"] for each in cycles]),
        "loss_error": np.array([each.loss_error for each in cycles]),
    }


def _loop_columns(rows: tuple[Cycled, ...]) -> Columns:
    """Force-displacement points of each cycle: macroscopic ("total"), and of some asperities."""
    parts: dict[str, list[NDArray[Any]]] = {
        name: [] for name in ("maximum", "minimum", "curve", "force", "displacement")
    }
    for maximum, minimum, _, loop in rows:
        curves = [("total", loop.forces, loop.displacements)]
        curves += [
            (str(i), loop.asperity_forces[:, place], loop.asperity_displacements[:, place])
            for place, i in enumerate(loop.asperities)
        ]
        for name, forces, displacements in curves:
            points = len(forces)
            parts["maximum"].append(np.full(points, maximum))
            parts["minimum"].append(np.full(points, minimum))
            parts["curve"].append(np.full(points, name))
            parts["force"].append(forces)
            parts["displacement"].append(displacements)
    return {name: np.concatenate(part) for name, part in parts.items()}


def _history_columns(followed: Followed) -> Columns:
    past = followed.history
    return {
        "fraction": np.array(followed.fractions),
        "force": past.forces,
        "displacement": past.displacements,
        "loss": past.losses,
        "loss_error": past.loss_errors,
    }
