"""The table [gradient] of a scene file: of what, by what, and what comes of it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from convexrough import checks
from convexrough.contact import Contact
from convexrough.errors import InputError, SolverError
from convexrough.friction.cycle import cycle
from convexrough.friction.shear import shear
from convexrough.gradients.gradient import Gradient, Holding

#: What a scene file may ask the gradient of, and its letter.
NUMBERS = {"loss": "W", "displacement": "X", "approach": "D_0", "load": "P"}

#: What it may ask it by, asperity by asperity, and the word for one of them.
EACH = {"heights": "height", "tip_radii": "tip_radius", "positions": "position"}
BY = tuple(EACH)


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

    def compute(self, contact: Contact) -> Differentiated | Missing:
        """The gradient, or why there is none."""
        try:
            return Differentiated(self, self._gradient(contact))
        except InputError as error:
            return Missing(self, str(self._in_the_file(error)))
        except SolverError as error:
            return Missing(self, str(error))

    def _gradient(self, contact: Contact) -> Gradient:
        holding: Holding | None = self.holding
        if self.of == "approach":
            return contact.gradient(approach=1.0, holding=holding)
        if self.of == "load":
            return contact.gradient(load=1.0, holding=holding)
        force = self.fraction * checks.friction(contact.scene.friction) * contact.load
        if self.of == "displacement":
            return shear(contact, force=force).gradient(displacement=1.0, holding=holding)
        return cycle(contact, maximum=force).gradient(holding=holding)

    def _in_the_file(self, error: InputError) -> InputError:
        """About a force: by the key of the file that it comes from."""
        if error.what not in ("force", "maximum"):
            return error
        found = f"{self.fraction:g}, a force of {error.found}"
        return InputError("[gradient] fraction", found=found, expected=error.expected)


class Differentiated(NamedTuple):
    """A gradient, and how it was asked for."""

    asked: Sensitivity
    gradient: Gradient


class Missing(NamedTuple):
    """What was asked for, and why it has no derivative."""

    asked: Sensitivity
    because: str


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


def gradient_summary(found: Differentiated | Missing) -> dict[str, Any]:
    """Numbers of the whole, and which asperity matters most; or why there are none."""
    if isinstance(found, Missing):
        return {"of": found.asked.of, "none_because": found.because}
    asked, gradient = found
    most = int(np.argmax(np.abs(gradient.heights)))
    shared = ("sphere_radius", "contact_modulus", "poisson_ratio", "friction", "load", "approach")
    names = (*shared, "maximum", "minimum", "force")
    by = {name: it for name in names if (it := getattr(gradient, name)) is not None}
    largest = {}
    for name in asked.by:
        slopes = getattr(gradient, name)
        sizes = np.linalg.norm(slopes, axis=1) if slopes.ndim == 2 else np.abs(slopes)
        at = int(np.argmax(sizes))
        largest[name] = {"slope": slopes[at].tolist(), "asperity": at}
    return {
        "of": asked.of,
        "holding": gradient.holding,
        "value": gradient.value,
        "by": by,
        "largest_by_height": float(gradient.heights[most]),
        "largest_at": most,
        "largest": largest,
        "height_error": float(gradient.height_errors.max()),
        "balance_defect": gradient.balance_defect,
    } | ({"fraction": asked.fraction} if asked.of in ("loss", "displacement") else {})


def gradient_lines(summary: dict[str, Any]) -> list[str]:
    """What people are told."""
    if "none_because" in summary:
        return ["", f"gradient of the {summary['of']}: none, {summary['none_because']}"]
    held, under = f"{summary['holding']} held", ""
    if "fraction" in summary:
        under, held = f" at Q/(fP) = {summary['fraction']:g}", f"{held}, and so is the force"
    rows = [("value", f"{summary['value'] + 0.0:.10g}")]  # no -0
    rows += [(f"by {name}", f"{slope + 0.0:.8g}") for name, slope in summary["by"].items()]
    for name, word in EACH.items():
        if (most := summary["largest"].get(name)) is None:
            continue
        known = f", {_known(summary['height_error'])}" if name == "heights" else ""
        slopes = np.ravel(most["slope"]) + 0.0
        text = ", ".join(f"{slope:.8g}" for slope in slopes)
        text = f"({text})" if len(slopes) > 1 else text
        rows.append((f"by {word}", f"up to {text}  (asperity {most['asperity']}{known})"))
    lines = [f"  {name:<20}{text}" for name, text in rows]
    return ["", f"gradient of the {summary['of']}{under}, {held}", *lines]


def _known(error: float) -> str:
    """Two digits of a proved bound, never below it."""
    return f"all known to {1.05 * error:.2g}" if math.isfinite(error) else "no bound"
