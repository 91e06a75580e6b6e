"""The status audit: four fresh scenes by default, ten thousand with --full."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import status_audit
from status_audit import Wrong, audit, report

import convexrough as cr
from convexrough.normal.certificate import OPEN


def test_every_status_and_bound(pytestconfig: pytest.Config) -> None:
    first, full = 1_000_000 * pytestconfig.option.seed, pytestconfig.option.full
    tally = audit(range(10_000) if full else range(first, first + 4))
    if not full:
        return
    judged = tally.scenes - tally.refused - tally.unsolved
    assert judged > 0.75 * tally.scenes
    assert {kind for kind, _ in tally.statuses} == {*status_audit.KINDS, "limit"}
    usual = (key for key in tally.statuses if key[0] in ("usual", "units") and key[1] != "vector")
    statuses, undecided = np.sum([tally.statuses[key] for key in usual], axis=0)
    assert undecided <= 0.01 * statuses
    assert report(tally).count("undecided") > 30


@pytest.mark.parametrize("kind", ["status", "load", "approach", "loss_error", "loss"])
def test_the_audit_finds_what_is_wrong(monkeypatch: pytest.MonkeyPatch, kind: str) -> None:
    honest = cr.cycle if kind.startswith("loss") else cr.press

    def lying(*arguments: Any, **options: Any) -> Any:
        found = honest(*arguments, **options)
        if kind == "loss_error":
            return replace(found, loss_error=1e-6 * found.loss_error)
        if kind == "loss":
            return replace(found, loss=found.loss * 1.001)
        proof = found.certificate
        changes = {
            "status": {"codes": np.where(proof.status == "contact", np.int8(OPEN), proof.codes)},
            "load": {"load_errors": 1e-4 * proof.load_errors},
            "approach": {"approach": proof.approach * (1 + 1e-9)},
        }
        return replace(found, certificate=replace(proof, **changes[kind]))

    monkeypatch.setattr(cr, honest.__name__, lying)
    with pytest.raises(Wrong, match="loss bound" if kind.startswith("loss") else "seed"):
        audit(range(24))
