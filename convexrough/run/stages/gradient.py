"""[gradient]: the derivatives of one result with respect to all parameters of the scene."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from convexrough import plots
from convexrough.contact import Contact
from convexrough.errors import InputError, SolverError
from convexrough.gradients.gradient import Holding
from convexrough.gradients.objective import NUMBERS, gradient_of
from convexrough.run.stage import Columns, Result, Stage, Summary, limit
from convexrough.run.values import Mistake, Share, expected, one_of
from convexrough.tabular.columns import bound, labelled

#: Results whose gradient a scene file may request, and their symbols.
LETTERS = {"loss": "W", "displacement": "X", "approach": "D_0", "load": "P"}

#: Names of the parameters of asperities: plural, and singular.
EACH = {"heights": "height", "tip_radii": "tip_radius", "positions": "position"}

#: Parameters that are one number for the whole scene.
SHARED = ("sphere_radius", "contact_modulus", "poisson_ratio", "friction", "load", "approach",
          "maximum", "minimum", "force")  # fmt: skip

#: What the key `by` may be.
ASKED = f"a list of some of: {', '.join(EACH)}; those by {', '.join(SHARED[:4])} are always given"


class GradientStage(Stage):
    """The result to differentiate, and the parameters.

    of       : "loss" (of the cycle between -Q and Q), "displacement" (under Q), "approach" or
        "load"
    fraction : Q / (f P) for "loss" and "displacement"
    by       : parameters of asperities that get columns in the table
    holding  : "load" or "approach", held constant; default: what is prescribed
    """

    name = "gradient"

    of: Annotated[str, one_of(LETTERS)]
    fraction: Share | None = None
    by: Annotated[list[str], expected(ASKED, lambda it: bool(it) and {*it} <= {*EACH})] = Field(
        list(EACH)
    )
    holding: Annotated[Holding, expected('"load" or "approach"')] | None = None

    @property
    def sheared(self) -> bool:
        """True if the result depends on a shear force."""
        return NUMBERS[self.of] == "force"

    @classmethod
    def sheared_by(cls, keys: Any) -> str:
        of = keys.get("of") if isinstance(keys, dict) else None
        return f"the {of} of [gradient]" if of in ("loss", "displacement") else ""

    def mistakes_within(self) -> Iterator[Mistake]:
        if self.sheared and self.fraction is None:
            yield "fraction", f"missing, needed with the {self.of}"
        if not self.sheared and self.fraction is not None:
            yield "fraction", f"found {self.fraction}, expected none with the {self.of}"

    def compute(self, contact: Contact) -> GradientResult:
        """The gradient, or the reason why there is none."""
        try:
            force = (self.fraction or 0.0) * limit(contact) if self.sheared else None
            gradient = gradient_of(contact, self.of, force, self.holding)
            return GradientResult(self, contact, (gradient,))
        except (InputError, SolverError) as error:
            return GradientResult(self, contact, (), str(error))


@dataclass(frozen=True, eq=False, repr=False)
class GradientResult(Result):
    """The result of [gradient]: the gradient, or the reason `none_because` why there is none."""

    stage: GradientStage
    none_because: str = ""

    def rows(self) -> list[Summary]:
        """One row: derivatives by the scalars, and the largest by parameters of asperities."""
        asked = self.stage
        if not self.found:
            return [{"of": asked.of, "none_because": self.none_because}]
        (gradient,) = self.found
        largest = {}
        for name in asked.by:
            slopes = getattr(gradient, name)
            sizes = np.linalg.norm(slopes, axis=1) if slopes.ndim == 2 else np.abs(slopes)
            at = int(np.argmax(sizes))
            largest[name] = {"slope": slopes[at].tolist(), "asperity": at}
        return [{
            "of": asked.of,
            **({"fraction": asked.fraction} if asked.sheared else {}),
            "holding": gradient.holding,
            "value": gradient.value,
            "by": {name: it for name in SHARED if (it := getattr(gradient, name)) is not None},
            "largest": largest,
            "height_error": float(gradient.height_errors.max()),
            "balance_defect": gradient.balance_defect,
        }]  # fmt: skip

    def tables(self) -> dict[str, Columns]:
        """A table with one row for each asperity."""
        if not self.found:
            return {}
        (gradient,), by = self.found, self.stage.by
        columns = self.at_asperities({})
        for name in ("heights", "tip_radii"):
            if name in by:
                columns[f"by_{EACH[name]}"] = getattr(gradient, name)
                columns[f"by_{EACH[name]}_error"] = getattr(gradient, f"{EACH[name]}_errors")
        if "positions" in by:
            columns |= dict(zip(("by_x", "by_y"), gradient.positions.T, strict=True))
        return {"gradient": columns}

    def doubts(self) -> Iterator[str]:
        if not self.found:
            yield f"no gradient of the {self.stage.of} exists for this scene: {self.none_because}"
        for each in self.found:
            if not np.isfinite([each.value_error, each.height_errors.max()]).all():
                yield f"not proved: the gradient of the {self.stage.of}, whose errors have no bound"

    def lines(self) -> list[str]:
        said = self.known[0]
        if not self.found:
            return [f"gradient of the {said['of']}: none, {said['none_because']}"]
        held, under = f"at constant {said['holding']}", ""
        if "fraction" in said:
            under, held = f" at Q/(fP) = {said['fraction']:g}", f"{held} and force"
        rows = [("  value", f"{said['value'] + 0.0:.10g}")]  # 0 in place of -0
        rows += [(f"  by {name}", f"{slope + 0.0:.8g}") for name, slope in said["by"].items()]
        for name, most in said["largest"].items():
            text = ", ".join(f"{slope:.8g}" for slope in np.ravel(most["slope"]) + 0.0)
            text = f"({text})" if name == "positions" else text
            where = f"asperity {most['asperity']}"
            if name == "heights":
                where += f", error at most {bound(said['height_error'])}"
            rows.append((f"  by {EACH[name]}", f"up to {text}  ({where})"))
        return [f"gradient of the {said['of']}{under}, {held}", *labelled(rows, 22)]

    def figures(self) -> Mapping[str, Any]:
        figures = [plots.gradient_figures(it, of=LETTERS[self.stage.of]) for it in self.found]
        return figures[0] if figures else {}
