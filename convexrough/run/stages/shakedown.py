"""[shakedown]: the largest factor of the amplitudes of a path for which sliding dies out."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, ClassVar

import numpy as np

from convexrough import plots
from convexrough.contact import Contact
from convexrough.errors import blamed_on
from convexrough.melan.shakedown import Theory, shakedown
from convexrough.run.stage import Columns, Result, Stage, Summary
from convexrough.run.values import NUMBER_OR_PAIR, Finite, Force, Mistake, Positive, expected

Kind = Annotated[Theory, expected('"exact", "elastic" or "vector"')]


class ShakedownStage(Stage):
    """Mean load and shear force, and amplitudes that are scaled, all divided by `reference`.

    kind : "exact" (default), "elastic", or "vector": then forces are pairs [x, y]
    """

    name = "shakedown"
    numbers = ("factor", "lower", "upper", "gross")

    load: Positive
    force: Force = 0.0
    load_amplitudes: list[Finite] | None = None
    force_amplitudes: list[Force]
    kind: Kind = "exact"
    reference: Positive = 1.0

    def mistakes_within(self) -> Iterator[Mistake]:
        if self.load_amplitudes and len(self.load_amplitudes) != len(self.force_amplitudes):
            found = f"found {len(self.load_amplitudes)} values"
            yield "load_amplitudes", f"{found}, expected {len(self.force_amplitudes)}"
        pairs = self.kind == "vector"
        expected = 'a pair [x, y] with kind = "vector"' if pairs else NUMBER_OR_PAIR
        if isinstance(self.force, list) != pairs and self.force != 0.0:
            yield "force", f"found {self.force}, expected {expected}"
        for i, force in enumerate(self.force_amplitudes):
            if isinstance(force, list) != pairs:
                yield f"force_amplitudes[{i}]", f"found {force}, expected {expected}"

    @property
    def highest_load(self) -> float:
        """[force] the largest load of the path with the factor 1."""
        return self.reference * (self.load + max([0.0, *(self.load_amplitudes or [])]))

    def compute(self, contact: Contact) -> ShakedownResult:
        swings = self.load_amplitudes or [0.0] * len(self.force_amplitudes)
        with blamed_on(f"[{self.name}]"):
            found = shakedown(
                contact.scene,
                load=self.reference * self.load,
                force=self.reference * np.array(self.force),
                load_amplitudes=self.reference * np.array(swings),
                force_amplitudes=self.reference * np.array(self.force_amplitudes),
                kind=self.kind,
                influence=contact.influence,
            )
        return ShakedownResult(self, contact, (found,))


class ShakedownResult(Result):
    """The result of [shakedown]: the limit, its bounds, and the states that prove them."""

    stage: ShakedownStage
    digits = 12
    printed: ClassVar[Mapping[str, str]] = {
        "factor": "factor",
        "lower": "lower bound",
        "upper": "upper bound",
        "gross": "gross sliding",
    }

    def summary(self) -> Summary:
        (found,) = self.found
        said = {name: getattr(found, name) for name in ("limited_by", "proved", "order")}
        return {"kind": found.kind, **self.known[0], **said}

    def tables(self) -> dict[str, Columns]:
        """The tables of the residual state and the mechanism, by vertex and component."""
        (found,) = self.found
        columns = self.at_asperities({"factor": found.factors})
        if found.kind != "vector":
            return {self.name: columns | {"witness": found.witness, "slip": found.mechanism}}
        columns |= {f"witness_{name}": found.witness[:, k] for k, name in enumerate("xy")}
        for v, slips in enumerate(found.mechanism):
            columns |= {f"slip_{v}_{name}": slips[:, k] for k, name in enumerate("xy")}
        return {self.name: columns}

    def doubts(self) -> Iterator[str]:
        yield from super().doubts()
        if not self.found[0].proved:
            yield "not proved: bounds on the limit of [shakedown]"

    def lines(self) -> list[str]:
        _, *table = super().lines()
        (found,) = self.found
        above = {
            "sliding": "above the factor an asperity slides in every cycle",
            "opening": "above the factor an asperity opens in every cycle, and need not slide",
            None: "sliding dies out at every factor",
        }
        return [f"shakedown  ({self.stage.kind}), {above[found.limited_by]}", *table]

    def figures(self) -> Mapping[str, Any]:
        return plots.shakedown_figures(self.found[0])
