"""What a run says, for people: aligned lines, and warnings. All of it is read off a summary."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from convexrough.plausibility import doubts
from convexrough.run.columns import aligned
from convexrough.run.plausibility import described_geometry, described_modulus, neglected
from convexrough.run.sensitivity import gradient_lines
from convexrough.run.summary import NORMAL, Summary
from convexrough.tabular.units import UnitNames

_SCOPES = {
    "global": "global: the scene has exactly one solution",
    "local": "local: exactly one solution with contacts of such sizes",
    "none": "none: nothing is proved",
}
_INFLUENCES = {
    "dense": "dense: a matrix",
    "lattice": "lattice: Fourier transforms",
    "scattered": "scattered: Fourier transforms on a mesh",
}


def describe(summary: Summary, *, length_unit: str = "", force_unit: str = "") -> list[str]:
    """Aligned lines for people, of either summary."""
    normal, units = summary["normal"], UnitNames(length_unit, force_unit)
    proof = normal["certificate"]
    able = f"  ({normal['candidates']} could touch)" if "candidates" in normal else ""
    width = len(str(normal["asperities"]))
    relative = _ratio(proof["load_error"], normal["largest_load"])
    lines = [
        ("asperities", f"{normal['asperities']}{able}"),
        *((f"  {word}", f"{normal[word]:>{width}}") for word in NORMAL),
        ("approach", _quantity(f"{normal['approach']:.10g}", length_unit)),
        ("load", _quantity(f"{normal['load']:.10g}", force_unit)),
        ("certificate", _SCOPES[proof["scope"]] + _of_what(normal)),
        ("convexity number", f"{proof['convexity_number']:.4g}  (convex below 1)"),
        ("load error", f"{_quantity(bound(proof['load_error']), force_unit)}{relative}"),
        ("gap error", _quantity(bound(proof["gap_error"]), length_unit)),
        ("duality gap", _quantity(bound(proof["duality_gap"]), f"{force_unit} {length_unit}")),
    ]
    if "solver" in normal:
        steps = f"{normal['iterations']} iterations, {normal['seconds']:.2g} s"
        lines += [
            ("model error", f"{normal['model_error']:.2g}  (point forces for pressures)"),
            ("crowding", f"{normal['crowding']:.3g}  (contact discs overlap above 1)"),
            *((("bodies", said),) if (said := neglected(normal)) else ()),
            ("geometry", described_geometry(normal)),
            ("contact modulus", described_modulus(normal["contact_modulus"], units)),
            ("solver", f"{normal['solver']}, {steps}"),
            ("influence", _INFLUENCES[normal["influence"]]),
        ]
    described = [f"{name:<18}{text}" for name, text in lines]
    return described + _describe_shear(summary, length_unit, force_unit)


def _describe_shear(summary: Summary, length_unit: str, force_unit: str) -> list[str]:
    work = f"{force_unit} {length_unit}".strip()
    lines = []
    if rows := summary.get("shear"):
        keys = ["fraction", "force", "displacement", "sliding", "partial_slip", "undecided"]
        lines += ["", _titled("shear", f"force {force_unit}", f"displacement {length_unit}")]
        heading = ["Q/(fP)", "force", "displacement", "slide", "partial", "undecided"]
        lines += _numbers(heading, [[row[key] for key in keys] for row in rows])
    if rows := summary.get("cycle"):
        keys = ["maximum", "minimum", "force_amplitude", "displacement_amplitude"]
        keys += ["secant_stiffness", "loss", "loss_factor"]
        over = not math.isnan(rows[0]["smooth_normalised"])  # a smooth reference
        keys += [*(["loss_normalised", "smooth_normalised"] if over else []), "sliding"]
        stiffness = f"{force_unit}/{length_unit}" if force_unit and length_unit else ""
        lines += ["", _titled("steady cycles", f"Qa {force_unit}", f"Xa {length_unit}",
                              f"Qa/Xa {stiffness}", f"loss W {work}")]  # fmt: skip
        heading = ["max/(fP)", "min/(fP)", "Qa", "Xa", "Qa/Xa", "W", "W/(pi Qa Xa)"]
        heading += [*(["W/W0", "smooth W/W0"] if over else []), "slide"]
        lines += _numbers(heading, [[row[key] for key in keys] for row in rows], digits=6)
        lines += [] if over else ["no smooth reference, so no W/W0: a flat base, or a cylinder"]
    if past := summary.get("history"):
        steps = list(zip(past["fraction"], past["displacement"], past["loss"], strict=True))
        lines += ["", _titled("history", f"displacement {length_unit}", f"loss {work}")]
        if len(steps) > 20:
            lines.append(f"(the last 20 of {len(steps)} steps; all are in history.csv)")
        lines += _numbers(["Q/(fP)", "displacement", "loss"], steps[-20:])
    lines += describe_varied(summary, length_unit, force_unit)
    return lines + (gradient_lines(summary["gradient"]) if "gradient" in summary else [])


def describe_varied(summary: Summary, length_unit: str, force_unit: str) -> list[str]:
    """Lines on load paths, what they settle to, and shakedown."""
    work = f"{force_unit} {length_unit}".strip()
    lines = []
    if path := summary.get("path"):
        keys = ["load", "force", "displacement", "loss", "stuck", "partial_slip", "sliding"]
        lines += ["", _titled("load path", f"forces {force_unit}", f"displacement {length_unit}",
                              f"loss {work}")]  # fmt: skip
        if len(path["load"]) > 20:
            lines.append(f"(the last 20 of {len(path['load'])} points; all are in path.csv)")
        rows = list(zip(*(path[key][-20:] for key in keys), strict=True))
        lines += _numbers(["P", "Q", "displacement", "loss", "stuck", "partial", "slide"], rows)
        lines.append(f"order of indentations: {path['order']}")
    if steady := summary.get("steady"):
        lines += ["", _titled("steady", f"level {force_unit}", f"loss {work}")]
        keys = ["level", "loss", "loss_error", "partial_slip", "sliding", "intermittent"]
        heading = ["stuck level", "loss", "error", "partial", "slide", "intermittent"]
        lines += _numbers(heading, [[steady[key] for key in keys]])
        lines.append(f"order of indentations: {steady['order']}")
    if losses := summary.get("phase_losses"):
        lines += ["", _titled("loss against phase", f"loss {work}")]
        keys = ["phase", "factor", "loss", "smooth"]
        rows = list(zip(*(losses[key] for key in keys), strict=True))
        if len(rows) > 20:
            lines.append(f"(the last 20 of {len(rows)} ellipses; all are in phase_losses.csv)")
        lines += _numbers(["phase", "factor", "loss", "smooth sphere"], rows[-20:])
    if limit := summary.get("shakedown"):
        lines += ["", f"shakedown  ({limit['kind']})"]
        keys = ["factor", "lower", "upper", "gross"]
        lines += _numbers(["factor", "proved above", "and below", "gross sliding"],
                          [[limit[key] for key in keys]], digits=12)  # fmt: skip
    return lines


def _titled(name: str, *quantities: str) -> str:
    """A heading, with the units of quantities where the scene names them."""
    named = [quantity for quantity in quantities if not quantity.endswith(" ")]
    return f"{name}  ({', '.join(named)})" if named else name


def _numbers(heading: Sequence[str], rows: Sequence[Sequence[float]], digits: int = 7) -> list[str]:
    cells = [[f"{x:d}" if isinstance(x, int) else f"{x:.{digits}g}" for x in row] for row in rows]
    return aligned([heading, *cells])


def describe_comparison(
    summary: Summary, *, length_unit: str = "", force_unit: str = ""
) -> list[str]:
    """Aligned lines for people, of the summary of a comparison."""
    work = f"{force_unit} {length_unit}".strip()
    heading = ["solver", "disagreement", "load error", "duality gap", "certificate", "words"]
    heading += ["iterations", "seconds", "MB"]
    rows = []
    for row in summary["compare"]:
        if row["outcome"] == "answered":
            largest, memory = row["largest_load"], row["memory"]
            cells = [_two(row["disagreement"]), _relative_bound(row["load_error"], largest)]
            cells += [_two(row["duality_gap"]), row["scope"], _wording(row)]
            cells += [str(row["iterations"]), _two(row["seconds"])]
            cells.append("-" if memory is None else f"{memory / 1e6:.1f}")
        else:
            cells = [row["outcome"], *["-"] * (len(heading) - 2)]
        rows.append([row["solver"], *cells])
    first = summary["compare"][0]
    lines = []
    if first["outcome"] == "answered":
        words = ", ".join(f"{first[word]} {word}" for word in NORMAL if first[word])
        lines.append(f"asperities         {words}")
    lines += [
        f"disagreement       with {first['solver']}, over the largest load, as is the load error",
        f"duality gap        {f'in {work}, ' if work else ''}from the loads alone",
        "MB                 by which the memory of the process rose while the solver worked",
        "",
        *aligned([heading, *rows], left=1),
    ]
    for row in summary["compare"]:
        lines += ["", row["message"]] if row["message"] else []
    return lines


def _wording(row: Summary) -> str:
    """How the words compare with those of the reference, and whether any is missing."""
    different, undecided = row["different_words"], row["undecided"]
    said = {None: "-", 0: "same"}.get(different, f"{different} differ")
    return f"{said}, {undecided} undecided" if undecided else said


def warnings(summary: Summary, *, length_unit: str = "", force_unit: str = "") -> list[str]:
    """What a user must not overlook, of either summary."""
    normal = summary["normal"]
    found = []
    if normal["certificate"]["scope"] == "none":
        found.append("not certified: these loads come without any proof")
    elif normal["undecided"]:
        found.append(f"not certified: {normal['undecided']} of the asperities undecided")
    for stage in ("path", "steady"):
        if unsure := summary.get(stage, {}).get("undecided", 0):
            found.append(f"not certified: {unsure} words in {stage} undecided")
    for stage in ("path", "steady", "phase_losses", "shakedown"):
        if summary.get(stage, {}).get("order") in ("checked", "fails"):
            found.append(f"not proved: the order of indentations, on which [{stage}] rests")
    if not summary.get("shakedown", {}).get("proved", True):
        found.append("not proved: any bounds on the limit of [shakedown]")
    if "none_because" in (slopes := summary.get("gradient", {})):
        found.append(f"no gradient of the {slopes['of']}: there is none for this scene")
    for stage in ("shear", "cycle"):
        doubtful = sum(1 for row in summary.get(stage, ()) if row["undecided"])
        if doubtful:
            found.append(f"not certified: {doubtful} of the rows in {stage} have undecided words")
    if "crowding" in normal:
        found += doubts(
            normal, f"{force_unit}/{length_unit}²" if force_unit and length_unit else ""
        )
    return found


def _of_what(normal: Summary) -> str:
    """That a proof of the asperity model says nothing where that does not hold."""
    crowding = normal.get("crowding", 0.0)
    return f" (of a model that does not hold: crowding {crowding:.3g})" if crowding > 1 else ""


def comparison_warnings(summary: Summary) -> list[str]:
    """What a user must not overlook, of the summary of a comparison."""
    found = [f"contradiction: {each}" for each in summary["contradictions"]]
    for row in summary["compare"]:
        if row["outcome"] != "answered":
            found.append(f"{row['solver']}: {row['outcome']}")
    answered = [row for row in summary["compare"] if row["outcome"] == "answered"]
    if not any(row["scope"] != "none" and not row["undecided"] for row in answered):
        found.append("not certified: no answer has a proved word for every asperity")
    return found


def _quantity(number: str, unit: str) -> str:
    return f"{number} {unit}".rstrip()


def bound(value: float) -> str:
    """Two digits, never below the value."""
    return f"{1.05 * value:.2g}" if math.isfinite(value) else "unknown"


def _ratio(error: float, largest: float) -> str:
    if largest == 0 or not math.isfinite(error):
        return ""
    return f"  ({bound(error / largest)} of the largest load)"


def _relative_bound(error: float, largest: float) -> str:
    return bound(error / largest) if largest else bound(np.inf if error else 0.0)


def _two(value: float) -> str:
    return f"{value:.2g}" if math.isfinite(value) else "-"
