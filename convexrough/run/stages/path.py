"""Paths of load and shear force: [path], once; [steady], repeated; [shakedown], scaled."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import Field

from convexrough import checks, plots
from convexrough.contact import Contact
from convexrough.errors import blamed_on
from convexrough.friction.fretting import fretting, fretting_columns
from convexrough.friction.path import load_path
from convexrough.friction.phases import elliptic_path, phase_losses
from convexrough.friction.steady import steady
from convexrough.melan.shakedown import Theory, shakedown
from convexrough.record import rows_of
from convexrough.run import values
from convexrough.run.stage import STATUSES, Columns, Result, Stage, Steps, Summary, numbers
from convexrough.run.values import Finite, Mistake, Phase, Positive, expected

COUNTS = tuple(status for status in STATUSES if status != "contact")


class Ellipse(values.FileTable):
    """Chords of an elliptic path: normal load P + A cos t, shear force Q + B sin(t + phase).

    load : P;  load_amplitude : A;  force : Q;  force_amplitude : B;  chords : number of chords
    """

    load: Positive
    load_amplitude: Finite = 0.0
    force: Finite = 0.0
    force_amplitude: Finite
    phase: Phase = 0.0
    chords: Annotated[int, expected("a whole number, at least 6", lambda value: value >= 6)] = 96


class _Points(Stage):
    """The points of a path, or an ellipse. All loads and forces are multiples of `reference`."""

    loads: list[values.NonNegative] | None = None
    forces: list[Finite] | None = None
    ellipse: Ellipse | None = None
    reference: Positive = 1.0

    def mistakes_within(self) -> Iterator[Mistake]:
        loads, forces = self.loads, self.forces
        if self.ellipse is not None:
            if (loads, forces) != (None, None):
                yield "ellipse", "found with loads or forces, expected an ellipse or both lists"
            if abs(amplitude := self.ellipse.load_amplitude) > self.ellipse.load:
                expects = f"at most the load {self.ellipse.load:g} in size"
                yield "ellipse.load_amplitude", f"found {amplitude:g}, expected {expects}"
        elif loads is None or forces is None:
            yield "loads, forces", "missing, both are needed without an ellipse"
        elif len(loads) != len(forces) or not loads:
            found = f"{len(loads)} and {len(forces)} values"
            yield "loads, forces", f"found {found}, expected equally many, at least one"

    @property
    def highest_load(self) -> float:
        if (it := self.ellipse) is not None:
            return self.reference * (it.load + abs(it.load_amplitude))
        return self.reference * max(self.loads or [0.0])

    def points(self, contact: Contact) -> dict[str, Any]:
        """Load and shear force [force] at the points of the path."""
        if self.ellipse is not None:
            friction = checks.friction(contact.scene.friction)
            loads, forces = elliptic_path(friction=friction, **self.ellipse.model_dump())
        else:
            loads, forces = np.array(self.loads), np.array(self.forces)
        return {"loads": self.reference * loads, "forces": self.reference * forces}

    def chords(self) -> list[str]:
        """A printed line about the chords that replace an ellipse; [] without an ellipse."""
        if self.ellipse is None:
            return []
        said = f"losses and errors are those of {self.ellipse.chords} chords; the loss along the "
        return [f"{said}ellipse differs: use twice as many chords to see by how much"]


class PathStage(_Points):
    """The table [path]: a path of normal load and shear force that starts at the load 0."""

    name = "path"
    numbers = (
        *("load", "force", "approach", "displacement", "displacement_error", "loss", "loss_error"),
        *("front", *COUNTS),
    )

    def compute(self, contact: Contact) -> PathResult:
        with blamed_on(f"[{self.name}]"):
            found = load_path(contact.scene, **self.points(contact), influence=contact.influence)
        return PathResult(self, contact, (found,))


class PathResult(Steps):
    stage: PathStage
    printed = ("load", "force", "displacement", "loss", "stuck", "partial", "sliding")

    def lines(self) -> list[str]:
        return [*super().lines(), *self.stage.chords()]

    def summary(self) -> Summary:
        return super().summary() | numbers(self.found[0], ("presses",))

    def tables(self) -> dict[str, Columns]:
        """A table of the points, and a table of all asperities at each point."""
        (path,) = self.found
        m, n = path.asperity_forces.shape
        names = ("asperity_loads", "asperity_forces", "asperity_force_errors",
                 "asperity_displacements", "drifts", "status")  # fmt: skip
        each = {"point": np.repeat(np.arange(m), n)}
        each |= {name: np.tile(it, m) for name, it in self.at_asperities({}).items()}
        for name, rows in path.columns(*names).items():
            each[name.removeprefix("asperity_")] = rows.ravel()
        return {**super().tables(), "path_asperities": each}


class SteadyStage(_Points):
    """The table [steady]: a closed path of normal load and shear force that is repeated.

    phases, factors : phases [rad] of the ellipse, and factors of its amplitudes, for which losses
        are computed, too; None for none
    """

    name = "steady"
    numbers = (*("level", "force_level", "loss", "loss_error", "loss_first", *COUNTS),)
    needs: ClassVar[Mapping[str, str]] = {"phases": "ellipse", "factors": "phases"}

    phases: Annotated[list[Phase], expected("a list of phases in radians", bool)] | None = None
    factors: Annotated[list[Positive], expected("a list of positive numbers", bool)] = Field([1.0])

    @property
    def highest_load(self) -> float:
        """[force] the largest load of the path, with the largest factor."""
        if self.ellipse is None:
            return super().highest_load
        amplitude = max(1.0, *self.factors) * abs(self.ellipse.load_amplitude)
        return self.reference * (self.ellipse.load + amplitude)

    def compute(self, contact: Contact) -> SteadyResult:
        scene, influence = contact.scene, contact.influence
        with blamed_on(f"[{self.name}]"):
            found: list[Any] = [steady(scene, **self.points(contact), influence=influence)]
            if self.phases and self.ellipse is not None:
                shape = self.ellipse.model_dump(exclude={"phase", "chords"})
                how = {name: self.reference * size for name, size in shape.items()}
                how |= {"chords": self.ellipse.chords, "influence": influence}
                found.append(phase_losses(scene, phases=self.phases, factors=self.factors, **how))
            return SteadyResult(self, contact, tuple(found))


class SteadyResult(Result):
    stage: SteadyStage
    most = Steps.most
    printed = ("level", "loss", "loss_error", "partial", "sliding", "intermittent")

    def summary(self) -> Summary:
        said = self.known[0] | numbers(self.found[0], ("order", "presses"))
        for name, columns in self.by_phase.items():
            lists = {key: it.tolist() for key, it in columns.items()}
            said[name] = lists | {"order": self.found[1].order}
        return said

    @property
    def by_phase(self) -> dict[str, Columns]:
        """The table of losses at other phases, by its name, if it is requested."""
        names = ("phases", "factors", "losses", "loss_errors", "smooth", "levels", "sliding")
        tables = [losses.columns(*names) for losses in self.found[1:]]
        return {"phase_losses": tables[0]} if tables else {}

    def tables(self) -> dict[str, Columns]:
        columns = self.at_asperities(self.found[0].columns("slips", "stick_radii", "status"))
        worn = fretting_columns([fretting(self.found[0])])
        return {"steady": columns, "steady_fretting": worn, **self.by_phase}

    def lines(self) -> list[str]:
        said = [*super().lines(), *self.stage.chords()]
        for name, columns in self.by_phase.items():
            printed = ("phase", "factor", "loss", "smooth")
            said += ["", *self.printed_table(name, rows_of(columns), printed)]
        return said

    def figures(self) -> Mapping[str, Any]:
        figures = dict(plots.steady_figures(self.found[0]))
        for losses in self.found[1:]:
            figures |= plots.phase_figures(losses)
        return figures


class ShakedownStage(Stage):
    """Mean load and shear force, and amplitudes that are scaled, all divided by `reference`.

    kind : "exact" (default), "elastic", or "vector": then forces are pairs [x, y]
    """

    name = "shakedown"
    numbers = ("factor", "lower", "upper", "gross")

    load: Positive
    force: values.Force = 0.0
    load_amplitudes: list[Finite] | None = None
    force_amplitudes: list[values.Force]
    kind: Annotated[Theory, expected('"exact", "elastic" or "vector"')] = "exact"
    reference: Positive = 1.0

    def mistakes_within(self) -> Iterator[Mistake]:
        if self.load_amplitudes and len(self.load_amplitudes) != len(self.force_amplitudes):
            found = f"found {len(self.load_amplitudes)} values"
            yield "load_amplitudes", f"{found}, expected {len(self.force_amplitudes)}"
        pairs = self.kind == "vector"
        expected = 'a pair [x, y] with kind = "vector"' if pairs else values.NUMBER_OR_PAIR
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
        forces = {
            "load": self.load,
            "force": self.force,
            "load_amplitudes": self.load_amplitudes or [0.0] * len(self.force_amplitudes),
            "force_amplitudes": self.force_amplitudes,
        }
        given: Any = {name: self.reference * np.array(it) for name, it in forces.items()}
        with blamed_on(f"[{self.name}]"):
            found = shakedown(contact.scene, **given, kind=self.kind, influence=contact.influence)
        return ShakedownResult(self, contact, (found,))


class ShakedownResult(Result):
    stage: ShakedownStage
    digits = 12
    printed = ("factor", "lower", "upper", "gross")

    def summary(self) -> Summary:
        (found,) = self.found
        more = numbers(found, ("limited_by", "proved", "order"))
        return {"kind": found.kind, **self.known[0], **more}

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
            "opening": "above the factor an asperity that touches at the mean load opens in every "
            "cycle, and need not slide",
            None: "sliding dies out at every factor",
        }
        return [f"shakedown  ({self.stage.kind}), {above[found.limited_by]}", *table]

    def figures(self) -> Mapping[str, Any]:
        return plots.shakedown_figures(self.found[0])
