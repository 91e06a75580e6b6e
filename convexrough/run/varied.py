"""Tables and summaries of the load-path stages (docs/reference/output-files.md)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from convexrough.contact import Contact
from convexrough.melan.shakedown import Shakedown
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
        m, n = path.asperity_forces.shape
        yield (
            "path",
            {
                "load": path.loads,
                "force": path.forces,
                "approach": path.approaches,
                "displacement": path.displacements,
                "displacement_error": path.displacement_errors,
                "loss": path.losses,
                "loss_error": path.loss_errors,
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
                "load": path.asperity_loads.ravel(),
                "force": path.asperity_forces.ravel(),
                "force_error": path.asperity_force_errors.ravel(),
                "displacement": path.asperity_displacements.ravel(),
                "drift": path.drifts.ravel(),
                "status": path.status.ravel(),
            },
        )
    if (closed := found.steady) is not None:
        columns = {"slip": closed.slips, "stick_radius": closed.stick_radii}
        yield "steady", {"x": x, "y": y, **columns, "status": closed.status}
    if (losses := found.phase_losses) is not None:
        yield (
            "phase_losses",
            {
                "phase": losses.phases,
                "factor": losses.factors,
                "loss": losses.losses,
                "loss_error": losses.loss_errors,
                "smooth": losses.smooth,
                "level": losses.levels,
                "sliding": losses.sliding,
            },
        )
    if (limit := found.shakedown) is not None:
        yield "shakedown", {"x": x, "y": y, "factor": limit.factors, **_witnesses(limit)}


def _witnesses(limit: Shakedown) -> Columns:
    """The state at rest and the mechanism; with vectors their components, of each vertex."""
    if limit.kind != "vector":
        return {"witness": limit.witness, "slip": limit.mechanism}
    columns = {f"witness_{name}": limit.witness[:, k] for k, name in enumerate("xy")}
    for v, slips in enumerate(limit.mechanism):
        columns |= {f"slip_{v}_{name}": slips[:, k] for k, name in enumerate("xy")}
    return columns


def varied_summary(found: Varied) -> dict[str, Any]:
    """What summary.json says of each."""
    summary: dict[str, Any] = {}
    if (path := found.path) is not None:
        numbers = {
            "load": path.loads,
            "force": path.forces,
            "displacement": path.displacements,
            "displacement_error": path.displacement_errors,
            "loss": path.losses,
            "loss_error": path.loss_errors,
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
            "loss": closed.loss,
            "loss_error": closed.loss_error,
            "loss_first": closed.loss_first,
            **{key: int((closed.status == word).sum()) for key, word in WORDS.items()},
            "order": closed.order,
            "presses": closed.presses,
        }
    if (losses := found.phase_losses) is not None:
        summary["phase_losses"] = {
            "phase": losses.phases.tolist(),
            "factor": losses.factors.tolist(),
            "loss": losses.losses.tolist(),
            "smooth": losses.smooth.tolist(),
            "order": losses.order,
        }
    if (limit := found.shakedown) is not None:
        summary["shakedown"] = {
            "kind": limit.kind,
            "factor": limit.factor,
            "lower": limit.lower,
            "upper": limit.upper,
            "gross": limit.gross,
            "proved": limit.proved,
            "order": limit.order,
        }
    return summary
