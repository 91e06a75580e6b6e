"""The table [gradient] of a scene file: of what, by what, and what comes of it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from convexrough import checks
from convexrough.contact import Contact
from convexrough.gradients.adjoint import Holding
from convexrough.gradients.gradient import Gradient
from convexrough.shearing.cycle import cycle
from convexrough.shearing.state import shear

#: What a scene file may ask the gradient of, and its letter.
NUMBERS = {"loss": "W", "displacement": "X", "approach": "D_0", "load": "P"}

#: What it may ask it by, asperity by asperity.
BY = ("heights", "tip_radii", "positions")


class Sensitivity(NamedTuple):
    """What is asked for.

    of       : "loss" of the cycle between +-fraction f P, "displacement" under fraction f P,
        "approach" or "load"
    by       : which columns the table has;  holding : None for what is prescribed
    """

    of: str
    fraction: float
    by: tuple[str, ...]
    holding: Literal["load", "approach"] | None

    def compute(self, contact: Contact) -> Differentiated:
        """The gradient, of a contact that carries a load."""
        holding: Holding | None = self.holding
        if self.of == "approach":
            return Differentiated(self, contact.gradient(approach=1.0, holding=holding))
        if self.of == "load":
            return Differentiated(self, contact.gradient(load=1.0, holding=holding))
        force = self.fraction * checks.friction(contact.scene.friction) * contact.load
        if self.of == "displacement":
            state = shear(contact, force=force)
            return Differentiated(self, state.gradient(displacement=1.0, holding=holding))
        return Differentiated(self, cycle(contact, maximum=force).gradient(holding=holding))


class Differentiated(NamedTuple):
    """A gradient, and how it was asked for."""

    asked: Sensitivity
    gradient: Gradient


def gradient_columns(found: Differentiated) -> Iterator[tuple[str, NDArray[Any]]]:
    """One row for each asperity."""
    gradient, by = found.gradient, found.asked.by
    x, y = gradient.contact.scene.asperities.positions.T
    yield from (("x", x), ("y", y))
    if "heights" in by:
        yield from (("by_height", gradient.heights), ("error", gradient.height_errors))
    if "tip_radii" in by:
        yield "by_tip_radius", gradient.tip_radii
    if "positions" in by:
        yield from zip(("by_x", "by_y"), gradient.positions.T, strict=True)


def gradient_summary(found: Differentiated) -> dict[str, Any]:
    """Numbers of the whole, and which asperity matters most."""
    asked, gradient = found
    most = int(np.argmax(np.abs(gradient.heights)))
    shared = ("sphere_radius", "contact_modulus", "poisson_ratio", "friction", "load", "approach")
    names = (*shared, "maximum", "minimum", "force")
    by = {name: it for name in names if (it := getattr(gradient, name)) is not None}
    return {
        "of": asked.of,
        "holding": gradient.holding,
        "value": gradient.value,
        "by": by,
        "largest_by_height": float(gradient.heights[most]),
        "largest_at": most,
        "height_error": float(gradient.height_errors.max()),
        "balance_defect": gradient.balance_defect,
    } | ({"fraction": asked.fraction} if asked.of in ("loss", "displacement") else {})


def gradient_lines(summary: dict[str, Any]) -> list[str]:
    """What people are told."""
    under = f" at Q/(fP) = {summary['fraction']:g}" if "fraction" in summary else ""
    lines = ["", f"gradient of the {summary['of']}{under}, {summary['holding']} held"]
    lines += [f"{'  value':<18}{summary['value']:.10g}"]
    lines += [f"{'  by ' + name:<18}{slope:.8g}" for name, slope in summary["by"].items()]
    largest = f"{summary['largest_by_height']:.8g}  (asperity {summary['largest_at']})"
    return [*lines, f"{'  by height':<18}up to {largest}"]
