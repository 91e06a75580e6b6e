"""Where Newton's method starts: close to the answer, and somewhere wherever there is one."""

from typing import Any

import numpy as np
import pytest
from scenes import MATERIAL

import convexrough as cr


@pytest.mark.parametrize("prescribed", [dict(approach=-1e-6), dict(load=1e-9)])
def test_nothing_where_the_smooth_sphere_would_touch(prescribed: dict[str, Any]) -> None:
    ring = np.exp(2j * np.pi * np.arange(6) / 6)
    positions = 0.01 * np.column_stack((ring.real, ring.imag))
    tall = cr.Scene(1.0, cr.Asperities(positions, 0.02, 6e-5), MATERIAL, geometry="summit")
    assert cr.press(tall, **prescribed).certificate.holds
