"""What a run says, for programs: the contents of summary.json and of what --json prints."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array
from convexrough.compare import Comparison, Entry
from convexrough.contact import Contact
from convexrough.normal.certificate import Certificate
from convexrough.run.plausibility import limits_of
from convexrough.run.sensitivity import gradient_summary
from convexrough.run.stages import Findings
from convexrough.run.varied import varied_summary
from convexrough.version import __version__

Summary = dict[str, Any]

#: Key of a count, and the word of a status that it counts.
NORMAL = {"contact": "contact", "open": "open", "undecided": "undecided"}
SHEAR = {"sliding": "sliding", "partial_slip": "partial", "undecided": "undecided"}


def counts(status: NDArray[np.str_], words: Mapping[str, str]) -> dict[str, int]:
    """How many asperities have each word, by the key of its count."""
    return {key: int(np.sum(status == word)) for key, word in words.items()}


def summarise(found: Findings) -> Summary:
    """The summary of a run, in the scene's units; the shear stages only where they were asked for.

    Forces named as in a scene file are fractions of f P, as there.
    """
    summary = _contact_summary(found.contact)
    if found.shear:
        summary["shear"] = [
            {
                "fraction": fraction,
                "force": state.force,
                "displacement": state.displacement,
                "displacement_error": state.certificate.displacement_error,
                **counts(state.status, SHEAR),
                "scope": state.certificate.scope,
            }
            for fraction, state in found.shear
        ]
    if found.cycles:
        summary["cycle"] = [
            {
                "maximum": maximum,
                "minimum": minimum,
                "loss": cycle.loss,
                "loss_error": cycle.loss_error,
                "loss_normalised": cycle.loss_normalised,
                "smooth_normalised": cycle.smooth_normalised,
                "balance_defect": cycle.balance_defect,
                "force_amplitude": cycle.force_amplitude,
                "displacement_amplitude": cycle.displacement_amplitude,
                "displacement_error": cycle.displacement_error,
                "secant_stiffness": cycle.secant_stiffness,
                "loss_factor": cycle.loss_factor,
                **counts(cycle.status, SHEAR),
            }
            for maximum, minimum, cycle, _ in found.cycles
        ]
    if found.history is not None:
        fractions, history = found.history
        summary["history"] = {
            "fraction": list(fractions),
            "displacement": history.displacements.tolist(),
            "loss": history.losses.tolist(),
            "loss_error": history.loss_errors.tolist(),
        }
    if found.gradient is not None:
        summary["gradient"] = gradient_summary(found.gradient)
    return summary | varied_summary(found.varying)


def certificate_summary(certificate: Certificate, loads: Array) -> Summary:
    """The summary of judged loads, (n,) [force], in the scene's units."""
    return _headed(normal=_judged(certificate, loads))


def comparison_summary(comparison: Comparison) -> Summary:
    """The summary of a comparison, in the scene's units."""
    rows = [_entry_summary(entry) for entry in comparison.entries]
    return _headed(compare=rows, contradictions=list(comparison.contradictions))


def proved(summary: Summary) -> bool:
    """Every asperity has a proved word, in every stage, and so is the order that words rest on.

    A gradient that was asked for is there.
    """
    stages = [summary["normal"], *summary.get("shear", ()), *summary.get("cycle", ())]
    stages += [summary[name] for name in ("path", "steady") if name in summary]
    scope = summary["normal"]["certificate"]["scope"]
    ordered = ("path", "steady", "phase_losses")
    rests = [summary[name]["order"] for name in ordered if name in summary]
    if (limit := summary.get("shakedown")) is not None:
        rests.append(limit["order"] or "proved")
        if not limit["proved"]:
            return False
    if "none_because" in summary.get("gradient", {}):
        return False
    if not all(order.startswith("proved") for order in rests):
        return False
    return scope != "none" and not any(stage["undecided"] for stage in stages)


def to_json(summary: Summary) -> str:
    """Valid JSON: infinities, and what is no number, are null."""
    return json.dumps(_finite(summary), indent=2, allow_nan=False)


def _contact_summary(contact: Contact) -> Summary:
    normal = _judged(contact.certificate, contact.loads) | {
        "candidates": contact.candidates,
        "influence": contact.influence,
        "solver": contact.solver,
        "iterations": contact.iterations,
        "seconds": contact.seconds,
        "model_error": contact.model_error,
        "crowding": contact.crowding,
        **limits_of(contact),
    }
    return _headed(normal=normal)


def _headed(**contents: Any) -> Summary:
    return {"schema": 1, "version": __version__} | contents


def _judged(certificate: Certificate, loads: Array) -> Summary:
    return {
        "asperities": len(loads),
        **counts(certificate.status, NORMAL),
        "approach": certificate.approach,
        "approach_error": certificate.approach_error,
        "load": float(loads.sum()),
        "largest_load": float(loads.max()),
        "certificate": {
            "scope": certificate.scope,
            "convexity_number": certificate.convexity_number,
            "load_error": certificate.load_error,
            "gap_error": certificate.gap_error,
            "duality_gap": certificate.duality_gap,
        },
    }


def _entry_summary(entry: Entry) -> Summary:
    row: Summary = {
        "solver": entry.solver,
        "outcome": entry.outcome,
        "message": entry.message,
        "disagreement": entry.disagreement,
        "different_words": entry.different_words,
        "memory": entry.memory,
    }
    if (contact := entry.contact) is not None:
        proof = contact.certificate
        row |= {
            **counts(contact.status, NORMAL),
            "approach": contact.approach,
            "load": contact.load,
            "largest_load": float(contact.loads.max()),
            "scope": proof.scope,
            "load_error": proof.load_error,
            "duality_gap": proof.duality_gap,
            "iterations": contact.iterations,
            "seconds": contact.seconds,
            "influence": contact.influence,
        }
    return row


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(each) for key, each in value.items()}
    if isinstance(value, list):
        return [_finite(each) for each in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
