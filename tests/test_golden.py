"""What was right stays right, and as well proved: values and statuses pinned by `golden_values`."""

import json
from typing import Any

import golden_values
import numpy as np
import pytest
from flint import arb, ctx


def distance(value: Any, pinned: Any) -> Any:
    """Between float64 numbers and decimal ones of any length."""
    pairs = zip(np.ravel(value), np.ravel(pinned), strict=True)
    with ctx.workdps(40):
        return np.array([float(abs(arb(a.item()) - arb(b.item()))) for a, b in pairs])


@pytest.mark.parametrize("name", golden_values.GOLDEN)
def test_what_was_right_stays_right(name: str) -> None:
    path = golden_values.FOLDER / f"{name.replace(', ', '-')}.json"
    pinned = json.loads(path.read_text("utf-8"))
    values, bounds, statuses = golden_values.found(name, pinned["given"])
    assert statuses == pinned["statuses"]
    assert all(what.startswith("loss at") for what in pinned["values"].keys() - values.keys())
    if pinned["source"] == "reference":  # few asperities, whose order is proved
        assert values.keys() == pinned["values"].keys()
    for what, value in values.items():
        bound, before = np.ravel(bounds[what]), np.ravel(pinned["bounds"][what])
        known = 0.0 if pinned["source"] == "reference" else before
        assert (distance(value, pinned["values"][what]) <= bound + known).all(), what
        assert (bound <= 2 * before).all(), what
