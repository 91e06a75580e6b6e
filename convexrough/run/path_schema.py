"""The tables of a scene file that say how normal load and shear vary together."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, ClassVar

from pydantic import Field

from convexrough.run.values import (
    Finite,
    Force,
    NonNegative,
    Positive,
    ShakedownKind,
    Table,
    expected,
)


class Ellipse(Table):
    load: Positive
    load_amplitude: Finite = 0.0
    force: Finite = 0.0
    force_amplitude: Finite
    phase: Finite = 0.0
    chords: Annotated[int, expected("a whole number, at least 6", lambda value: value >= 6)] = 96


class Path(Table):
    loads: list[NonNegative] | None = None
    forces: list[Finite] | None = None
    ellipse: Ellipse | None = None
    reference: Positive = 1.0

    def mistakes_within(self) -> Iterator[str]:
        points = (self.loads, self.forces)
        if self.ellipse is not None:
            if points != (None, None):
                yield "ellipse: found beside loads or forces, expected one of the two ways"
        elif None in points:
            yield "loads, forces: missing, both are needed where there is no ellipse"
        elif len(points[0] or ()) != len(points[1] or ()) or not points[0]:
            found = f"{len(points[0] or ())} and {len(points[1] or ())} values"
            yield f"loads, forces: found {found}, expected as many of both, at least one"


class Steady(Path):
    needs: ClassVar = {"phases": "ellipse", "factors": "phases"}
    phases: Annotated[list[Finite], expected("a list of finite numbers", bool)] | None = None
    factors: Annotated[list[Positive], expected("a list of positive numbers", bool)] = Field([1.0])


class Shakedown(Table):
    loads: Positive
    forces: Force = 0.0
    load_amplitudes: list[Finite] | None = None
    force_amplitudes: list[Force]
    kind: ShakedownKind = "exact"
    reference: Positive = 1.0

    def mistakes_within(self) -> Iterator[str]:
        if self.load_amplitudes and len(self.load_amplitudes) != len(self.force_amplitudes):
            found = len(self.load_amplitudes)
            yield f"load_amplitudes: found {found} values, expected {len(self.force_amplitudes)}"
        pairs = self.kind == "vector"
        expected = 'a pair [x, y] with kind = "vector"' if pairs else "a number with this kind"
        if isinstance(self.forces, list) != pairs and self.forces != 0.0:
            yield f"forces: found {self.forces}, expected {expected}"
        for i, force in enumerate(self.force_amplitudes):
            if isinstance(force, list) != pairs:
                yield f"force_amplitudes[{i}]: found {force}, expected {expected}"
