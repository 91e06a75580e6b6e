"""What was measured, for programs, and what follows from it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, replace
from typing import Any

from convexrough.bench.frontier import NOISE
from convexrough.bench.measure import Row
from convexrough.bench.scenes import APPROACH, WORDS, Family
from convexrough.bench.suite import FITTED_FROM, Bench, Panel
from convexrough.run.summary import Summary
from convexrough.version import __version__


def summarise(bench: Bench) -> Summary:
    """Everything, for programs. Errors are relative to the largest load, times in seconds."""
    return {
        "schema": 1,
        "version": __version__,
        "quick": bench.quick,
        "machine": bench.machine,
        "seconds": bench.seconds,
        "approach": APPROACH,
        "noise": NOISE,
        "work_precision": [_panel_summary(panel) for panel in bench.panels],
        "cost": [asdict(row) for row in bench.cost],
        "exponents": [
            {"family": family, "from": FITTED_FROM, "exponent": bench.exponent(family)}
            for family in _families(bench)
        ],
        "shear": [asdict(row) for row in bench.shear],
        "paths": [asdict(row) for row in bench.paths],
        "sweeps": [asdict(row) for row in bench.sweeps],
        "gradient": [asdict(row) for row in bench.gradients],
    }


def tables(bench: Bench) -> dict[str, dict[str, list[Any]]]:
    """The rows as columns, by the stem of the file each belongs in."""
    work = [
        {"family": panel.family, "asperities": panel.asperities} | asdict(row)
        for panel in bench.panels
        for row in panel.rows
    ]
    found = {"work-precision": work}
    found["cost"] = [asdict(row) for row in bench.cost]
    found["shear"] = [asdict(row) for row in bench.shear]
    found["paths"] = [asdict(row) for row in bench.paths]
    found["sweeps"] = [asdict(row) for row in bench.sweeps]
    found["gradient"] = [asdict(row) for row in bench.gradients]
    return {
        name: {key: [row[key] for row in rows] for key in rows[0]}
        for name, rows in found.items()
        if rows
    }


def verdicts(bench: Bench) -> list[str]:
    """Whether the default solver is on the frontier, and how its time grows."""
    lines = []
    judged = [panel for panel in bench.panels if panel.reference is not None]
    beaten = [panel for panel in judged if not _on_frontier(panel)]
    for panel in beaten:
        names = "; ".join(f"{row.solver}, {row.setting}" for row in panel.offenders)
        lines.append(
            f"NOT on the frontier with {panel.asperities:,} asperities ({panel.family}): "
            f"{names or 'the default solver has no answer'}"
        )
    where = f"{len(judged) - len(beaten)} of {len(judged)}"
    lines.insert(0, f"The default solver is on the work-precision frontier in {where} scenes.")
    for family in _families(bench):
        if math.isfinite(b := bench.exponent(family)):
            sizes = [row.asperities for row in bench.fitted(family)]
            lines.append(
                f"The time of a press grows as n^{b:.2f} from {min(sizes):,} to {max(sizes):,} "
                f"asperities ({family})."
            )
    return lines


def condensed(rows: Sequence[Row]) -> list[Row]:
    """Settings of one solver that make no difference in one row, with the least of their times."""
    found: dict[tuple[object, ...], list[Row]] = {}
    for row in rows:
        same = row.error if math.isfinite(row.error) else row.outcome
        answer = (row.solver, same, row.iterations, row.products, row.single)
        found.setdefault(answer, []).append(row)
    return [_one(alike) for alike in found.values()]


def _panel_summary(panel: Panel) -> Summary:
    found = None
    if (reference := panel.reference) is not None:
        found = {
            name: getattr(reference, name)
            for name in ("how", "residual", "correction", "digits", "touching")
        }
    return {
        "family": panel.family,
        "asperities": panel.asperities,
        "reference": found,
        "without": panel.without,
        "rows": [asdict(row) for row in panel.rows],
        "default_on_frontier": _on_frontier(panel),
        "better_than_default": [[row.solver, row.setting] for row in panel.offenders],
    }


def _on_frontier(panel: Panel) -> bool | None:
    """Whether nothing beats the default solver by more than noise; None without a reference."""
    if panel.reference is None:
        return None
    return panel.default is not None and not panel.offenders


def _one(rows: Sequence[Row]) -> Row:
    """Rows with one answer as one row."""
    best = min(rows, key=lambda row: (not row.seconds >= 0.0, row.seconds, row.expected))
    settings = [row.setting for row in rows]
    setting = settings[0] if len(rows) == 1 else f"{settings[0]} to {_last_word(settings[-1])}"
    if not any(row.outcome == "answered" for row in rows) and len(rows) > 1:
        setting = "every setting"
    return replace(
        best,
        setting=setting,
        default=any(row.default for row in rows),
        frontier=any(row.frontier for row in rows),
    )


def _last_word(setting: str) -> str:
    return setting.rpartition(" ")[2]


def _families(bench: Bench) -> list[Family]:
    present = {row.family for row in bench.cost}
    return [family for family in WORDS if family in present]
