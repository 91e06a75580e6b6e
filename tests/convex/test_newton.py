"""Newton's loop where its numbers are 0: laws of one unknown that only say what they are told."""

from typing import Any, NamedTuple

import numpy as np
import pytest

import convexrough as cr
from convexrough.convex import newton


class Fixed(NamedTuple):
    unknown: Any
    forces: Any
    defect: Any
    scale: float
    energy: float
    residual: float


class Told:
    """A law with one state: wherever it is asked, the residual and the scale are these."""

    solver, unit = "told", "its scale"

    def __init__(self, residual: float, scale: float) -> None:
        one = np.ones(1)
        self.state = Fixed(one, one, residual * one, scale, 1.0, residual)

    def evaluate(self, unknown: Any) -> Fixed:
        return self.state

    def direction(self, state: Fixed, left: float) -> Any:
        return np.zeros(1)

    def gradient(self, state: Fixed) -> Any:
        return np.zeros(1)

    def energy_rounding(self, state: Fixed) -> float:
        return 1.0

    def noise(self, state: Fixed) -> float:
        return 0.0

    def advice(self, state: Fixed) -> str:
        return "nothing"


@pytest.mark.parametrize("tolerance", [0.0, 1e-9])
@pytest.mark.parametrize("scale", [-1.0, 0.0, 1.0])
def test_no_residual_is_an_answer_whatever_the_scale(scale: float, tolerance: float) -> None:
    """The multiplier of a hopelessly crowded contact may come out negative."""
    law = Told(0.0, scale)
    _, steps = newton.solve(law, law.state, newton.Stopping(1e-12, tolerance, 5), before=0.0)
    assert steps == 0


@pytest.mark.parametrize("scale", [-1.0, 0.0])
def test_a_residual_of_no_scale_is_an_error(scale: float) -> None:
    law = Told(1.0, scale)
    with pytest.raises(cr.SolverError, match="of its scale after 5 steps"):
        newton.solve(law, law.state, newton.Stopping(1e-12, 0.0, 5), before=0.0)
