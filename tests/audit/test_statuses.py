"""The status audit: four fresh scenes by default, ten thousand with --full; one thread and two."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import status_audit
from scenes import hexagonal
from status_audit import Wrong, assert_agree, audit, report
from threadpoolctl import threadpool_limits

import convexrough as cr
from convexrough.normal.certificate import OPEN


def test_every_status_and_bound(pytestconfig: pytest.Config) -> None:
    first, full = 1_000_000 * pytestconfig.option.seed, pytestconfig.option.full
    tally = audit(range(10_000) if full else range(first, first + 4))
    if not full:
        return
    assert tally["refused"] + tally["unsolved"] < 0.25 * tally["tried"]
    keys = [key for key in tally if len(key) == 2]
    assert {kind for kind, _ in keys} == {*status_audit.KINDS, "limit"}
    usual = [key for key in keys if key[0] in ("usual", "units") and key[1] != "vector"]
    undecided = sum(tally[*key, "undecided"] for key in usual)
    assert undecided <= 0.01 * sum(tally[key] for key in usual)
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


@pytest.mark.parametrize("influence", ["dense", "lattice", "scattered"])
@pytest.mark.sample(1)
def test_one_thread_and_two(influence: Any) -> None:
    rough = hexagonal(spacing=0.0013, tip_radius=0.0104, height_std=1e-6, seed=3)
    scene, found = replace(rough, friction=0.5, geometry="closest"), []
    for threads in (1, 2):
        with threadpool_limits(threads):
            contact = cr.press(scene, approach=5e-5, influence=influence)
            found.append((contact, cr.shear(contact, force=0.25 * contact.load)))
    for name, one, two in zip(("load", "force"), *found, strict=True):
        assert_agree(one, two, name)
        assert (one.status == two.status).all()
