"""Rows of a sweep that are computed together, against the same scenes measured one by one."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from sweep_files import sweeping

import convexrough as cr
from convexrough.sweeps import batch, measures
from convexrough.sweeps.batch import Columns, compute
from convexrough.sweeps.plan import plan_of

#: Numbers that rows know, but for errors, which are bounds of their own.
KNOWN = [f"normal.{name}" for name in measures.NORMAL if "error" not in name]
CYCLES = [f"cycle.{name}" for name in measures.CYCLE if "error" not in name]

SCENES: dict[str, dict[str, Any]] = {
    "load": {
        "sweep": {"over": {"normal.load": [1e-7, 3e-7], "asperities.height_std": [1e-7, 1e-6]}}
    },
    "approach": {"normal": {"approach": 5e-5}},
    "tips": {"asperities": {"tip_radius_cv": 0.2, "geometry": "summit"}},
    "one end": {"cycle": {"maximum_fraction": [0.3, 0.4], "minimum_fraction": [0.1, -0.2]}},
    "gross sliding": {"cycle": {"maximum_fraction": [1.0, 0.2]}},
    "friction": {"sweep": {"draw": {"friction.coefficient": {"uniform": [0.3, 0.6]}}}},
    "crowded": {
        "asperities": {"spacing": 0.0006, "within": 0.0007},
        "cycle": {"maximum_fraction": [0.2]},
    },
}


def tables(changes: dict[str, Any], measure: list[str]) -> dict[str, Any]:
    found = sweeping(seeds=2, measure=measure)
    found["asperities"] |= {"height_std": 1e-6, "geometry": "closest"}
    found["cycle"] = {"maximum_fraction": [0.2, 0.7]}
    for name, table in changes.items():
        found[name] = table if name == "normal" else found[name] | table
    return found


def rows(changes: dict[str, Any], measure: list[str]) -> Columns:
    plan = plan_of(tables(changes, measure), Path("sweep"), None)
    return compute(plan.batch(range(plan.source.count)))[0]


def test_onset_is_the_least_force_at_which_the_fraction_slides() -> None:
    asperities = cr.Asperities([[0, 0], [1, 0], [0, 1], [-1, -1]], 0.1, [0.0, 2e-4, 3e-4, 5e-4])
    scene = cr.Scene(np.inf, asperities, cr.Material(1.0, 0.3), friction=0.5)
    contact = cr.press(scene, approach=1e-3)
    onsets = np.sort(cr.onset_of_sliding(contact)[contact.loads > 0]) / (0.5 * contact.load)
    found = measures.measured(contact, {}, ["onset"]).numbers
    for quarters in range(1, 5):
        least = onsets[-(-quarters * len(onsets) // 4) - 1]
        assert_allclose(found["onset", f"{quarters / 4:g}"], least, rtol=1e-12)


@pytest.mark.sample(2)
@pytest.mark.parametrize("changes", SCENES.values(), ids=SCENES)
def test_rows_together_are_those_of_scenes_one_by_one(
    changes: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    measure = KNOWN + CYCLES + ["normal.certificate.load_error", "cycle.loss_error"]
    found = rows(changes, measure)
    monkeypatch.setattr(batch, "measured_together", lambda *_: {})
    alone = rows(changes, measure)
    assert found.keys() == alone.keys()
    for name in ("scene", "status", "message"):
        assert_array_equal(found[name], alone[name])
    for name in list(found)[-len(measure) :]:
        if "error" in name:
            assert np.all(found[name] <= 1e3 * alone[name] + 1e-25), name
        elif not name.endswith("message"):
            assert_allclose(found[name], alone[name], rtol=1e-12, atol=1e-30, err_msg=name)
