"""[normal]: the pressed contact and its certificate."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np

from convexrough import plausibility, plots
from convexrough.arrays import Array
from convexrough.contact import Contact
from convexrough.errors import InputError, SolverError
from convexrough.normal.certificate import Certificate
from convexrough.normal.problem import NormalProblem
from convexrough.run.stage import Columns, Result, Stage, Summary, numbers, unit_of
from convexrough.run.values import Finite, Positive
from convexrough.solvers import Newton
from convexrough.tabular.columns import bound, labelled
from convexrough.tabular.units import UnitNames, in_unit

#: `closest_change` is that of loads of at least HEAVY times the largest, reported above DIFFERENT.
HEAVY, DIFFERENT = 0.1, 0.01

PROOF = ("scope", "convexity_number", "load_error", "gap_error", "duality_gap")
COUNTS = ("contact", "open", "undecided")
FOUND = ("area", "candidates", "influence", "solver", "iterations", "seconds", "model_error")
SCOPES = {
    "global": "global: the scene has exactly one solution",
    "local": "local: exactly one solution with contact radii near those of these loads",
    "none": "none: nothing is proved",
}
INFLUENCES = {
    "dense": "dense: compliance as a matrix",
    "lattice": "lattice: compliance by Fourier transforms",
    "scattered": "scattered: compliance by Fourier transforms on a mesh",
}


class NormalStage(Stage):
    """The prescribed quantity: the approach of the two bodies [length] or the load [force]."""

    name = "normal"
    alternatives = ("approach", "load")

    approach: Finite | None = None
    load: Positive | None = None

    def compute(self, contact: Contact) -> NormalResult:
        return NormalResult(self, contact, (contact,))


class NormalResult(Result):
    def rows(self) -> list[Summary]:
        contact = self.contact
        judged = judged_loads(contact.certificate, contact.loads)
        return [judged | numbers(contact, FOUND) | limits_of(contact)]

    def tables(self) -> dict[str, Columns]:
        contact, asperities = self.contact, self.contact.scene.asperities
        columns: Columns = {"height": asperities.heights, "tip_radius": asperities.tip_radii}
        columns |= contact.columns("loads", "contact_radii", "gaps", "status")
        columns |= contact.certificate.columns("load_errors")
        units = contact.scene.units
        return {"asperities": {in_unit(name, unit_of(name, units)): each
                               for name, each in self.at_asperities(columns).items()}}  # fmt: skip

    def doubts(self) -> Iterator[str]:
        return plausibility.doubts_of(self.contact)

    def cautions(self) -> Iterator[str]:
        return plausibility.cautions_of(self.contact, self.known[0])

    def figures(self) -> Mapping[str, Any]:
        return plots.press_figures(self.contact)

    def lines(self) -> list[str]:
        return describe(self.known[0], self.contact.scene.units)


def judged_loads(certificate: Certificate, loads: Array) -> Summary:
    """The summary of the certificate of loads (n,) [force]."""
    return {
        "asperities": len(loads),
        **numbers(certificate, (*COUNTS, "approach", "approach_error")),
        "load": float(loads.sum()),
        "largest_load": float(loads.max()),
        "certificate": numbers(certificate, PROOF),
    }


def limits_of(contact: Contact) -> Summary:
    """Measures of the validity of the model: those of `plausibility.limits_of` and two others.

    closest_change : largest relative change of loads of at least `HEAVY` of the largest load at the
        same approach, if the geometry is "closest"; None if it is so already, or if not known
    """
    scene, loads, change = contact.scene, contact.loads, None
    if scene.geometry == "summit" and loads.any():
        heavy = loads >= HEAVY * loads.max()
        with suppress(InputError, SolverError):
            closest = replace(scene, geometry="closest")
            problem = NormalProblem.assemble(closest, approach=contact.approach)
            found = Newton().solve(problem, loads[problem.candidates] / problem.units.force)
            other = problem.to_scene(found.loads * problem.units.force)
            change = float(np.abs(other[heavy] / loads[heavy] - 1.0).max())
    own = {"geometry": scene.geometry, "closest_change": change}
    return plausibility.limits_of(contact) | own


def describe(normal: Summary, units: UnitNames) -> list[str]:
    """The printed report, in aligned lines, of a summary by `judged_loads` or a `NormalResult`."""
    proof = normal["certificate"]
    able = f"  ({normal['candidates']} could carry load)" if "candidates" in normal else ""
    width, largest = len(str(normal["asperities"])), normal["largest_load"]
    relative, given = "", "" if "solver" in normal else "given "
    if largest and math.isfinite(proof["load_error"]):
        relative = f"  ({bound(proof['load_error'] / largest)} of the largest {given}load)"
    crowding = normal.get("crowding", 0.0)
    model = f" (but the model does not apply: crowding {crowding:.3g})" if crowding > 1 else ""

    def known(name: str) -> str:
        if not math.isfinite(proof[name]):
            return "unknown"
        return f"at most {bound(proof[name])} {unit_of(name, units)}".rstrip()

    least = "that of the solution" if proof["scope"] == "local" else "its minimum"
    lines = [
        ("asperities", f"{normal['asperities']}{able}"),
        *((f"  {status}", f"{normal[status]:>{width}}") for status in COUNTS),
        ("approach", f"{normal['approach']:.10g} {units.length}".rstrip()),
        ("load", f"{normal['load']:.10g} {units.force}".rstrip()),
        ("certificate", SCOPES[proof["scope"]] + model),
        ("convexity number", f"{proof['convexity_number']:.4g}  (below 1 the energy is convex)"),
        ("load error", f"{known('load_error')}{relative}"),
        ("gap error", known("gap_error")),
        ("duality gap", f"{known('duality_gap')}  (energy minus {least})"),
    ]
    if "solver" in normal:
        steps = f"{normal['iterations']} iterations, {normal['seconds']:.2g} s"
        unit, error = units.unit("pressure"), normal["model_error"]
        pressure = f"at most {normal['mean_pressure']:.4g} {unit.name if unit else ''}".rstrip()
        if not normal["hardness"]:
            pressure += "  (no hardness given: yield is not checked)"
        geometry, change = normal["geometry"], normal["closest_change"] or 0.0
        if change > DIFFERENT:
            nearer = 'with "closest", nearer to boundary elements, loads change by up to about'
            geometry += f": {nearer} {100 * change:.2g} %"
        lines += [
            ("model error", f"about {error:.2g} of displacements  (due to point forces)"),
            ("crowding", f"{crowding:.3g}  (above 1 contact discs overlap)"),
        ]
        if beta := normal["mismatch"]:
            tractions = f"shear tractions of about {abs(100 * beta):.2g} % of the pressure"
            neglected = f"Dundurs' beta = {beta:.3g}, neglected: it causes {tractions}"
            lines.append(("bodies", neglected))
        lines += [
            ("contact area", f"{normal['area']:.4g} {unit_of('area', units)}".rstrip()),
            ("mean pressure", pressure),
            ("geometry", geometry),
            ("contact modulus", plausibility.described_modulus(normal["contact_modulus"], units)),
            ("solver", f"{normal['solver']}, {steps}"),
            ("influence", INFLUENCES[normal["influence"]]),
        ]
    return labelled(lines)
