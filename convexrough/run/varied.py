"""Tables and summaries of the stages in which the normal load varies (docs/results.md)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from convexrough.contact import Contact
from convexrough.run.varying import Varied

Columns: TypeAlias = dict[str, NDArray[Any]]

#: Key of a count, and the word of a status that it counts.
WORDS = {
    "stuck": "stuck",
    "partial_slip": "partial",
    "sliding": "sliding",
    "intermittent": "intermittent",
    "open": "open",
    "undecided": "undecided",
}


def varied_tables(found: Varied, contact: Contact) -> Iterator[tuple[str, Columns]]:
    """The name and the columns of each table."""
    x, y = contact.scene.asperities.positions.T
    if (path := found.path) is not None:
        m, n = path.forces.shape
        yield (
            "path",
            {
                "load": path.loads,
                "force": path.applied,
                "approach": path.approaches,
                "displacement": path.displacements,
                "displacement_error": path.displacement_errors,
                "energy": path.energy,
                "energy_error": path.energy_errors,
                "front": path.fronts,
                **{key: (path.status == word).sum(axis=1) for key, word in WORDS.items()},
            },
        )
        yield (
            "path_asperities",
            {
                "point": np.repeat(np.arange(m), n),
                "x": np.tile(x, m),
                "y": np.tile(y, m),
                "load": path.normal_loads.ravel(),
                "force": path.forces.ravel(),
                "force_error": path.force_errors.ravel(),
                "displacement": path.asperity_displacements.ravel(),
                "drift": path.drifts.ravel(),
                "status": path.status.ravel(),
            },
        )
    if (closed := found.steady) is not None:
        columns = {"slip": closed.slips, "stick_radius": closed.stick_radii}
        yield "steady", {"x": x, "y": y, **columns, "status": closed.status}
    if (limit := found.shakedown) is not None:
        columns = {"factor": limit.factors, "witness": limit.witness, "slip": limit.mechanism}
        yield "shakedown", {"x": x, "y": y, **columns}


def varied_summary(found: Varied) -> dict[str, Any]:
    """What summary.json says of each."""
    summary: dict[str, Any] = {}
    if (path := found.path) is not None:
        numbers = {
            "load": path.loads,
            "force": path.applied,
            "displacement": path.displacements,
            "displacement_error": path.displacement_errors,
            "energy": path.energy,
            "energy_error": path.energy_errors,
            **{key: (path.status == word).sum(axis=1) for key, word in WORDS.items()},
        }
        summary["path"] = {key: each.tolist() for key, each in numbers.items()} | {
            "order": path.order,
            "presses": path.presses,
            "undecided": int((path.status == "undecided").sum()),
        }
    if (closed := found.steady) is not None:
        summary["steady"] = {
            "level": closed.level,
            "force_level": closed.force_level,
            "energy": closed.energy,
            "energy_error": closed.energy_error,
            "energy_first": closed.energy_first,
            **{key: int((closed.status == word).sum()) for key, word in WORDS.items()},
            "order": closed.order,
            "presses": closed.presses,
        }
    if (limit := found.shakedown) is not None:
        summary["shakedown"] = {
            "kind": limit.kind,
            "factor": limit.factor,
            "lower": limit.lower,
            "upper": limit.upper,
            "gross": limit.gross,
            "order": limit.order,
        }
    return summary
