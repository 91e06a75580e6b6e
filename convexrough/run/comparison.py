"""The report of `compare`: a summary for other programs, aligned lines, and warnings."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from convexrough.comparison import CARRIES, Comparison, Entry
from convexrough.run.results import headed
from convexrough.run.stage import Summary, numbers, unit_of
from convexrough.run.stages.normal import COUNTS
from convexrough.tabular.columns import aligned, bound
from convexrough.tabular.units import UnitNames

HEADING = ["solver", "disagreement", "load error", "duality gap", "certificate", "statuses",
           "iterations", "seconds", "MB"]  # fmt: skip


def comparison_summary(comparison: Comparison, within: float) -> Summary:
    """The summary of a comparison; `within` is the tolerance of `Comparison.disagreeing`."""
    return headed(
        compare=[_entry(entry) for entry in comparison.entries],
        contradictions=list(comparison.contradictions),
        within=within,
        disagreeing=comparison.disagreeing(within),
    )


def _entry(entry: Entry) -> Summary:
    said = ("solver", "outcome", "message", "disagreement", "different_statuses",
            "different_contacts", "memory")  # fmt: skip
    row: Summary = {name: getattr(entry, name) for name in said}
    if (contact := entry.contact) is not None:
        proof, work = ("scope", "load_error", "duality_gap"), ("iterations", "seconds", "influence")
        row |= numbers(contact, (*COUNTS, "approach", "load"))
        row |= {"largest_load": float(contact.loads.max()), **numbers(contact, proof + work)}
    return row


def steps(comparison: Comparison) -> list[list[Any]]:
    """A table of the logged iterations of solvers: headings, then a row for each iteration."""
    names = ["step", "objective", "residual"]
    steps = [(entry.solver, step) for entry in comparison.entries for step in entry.steps]
    return [["solver", *names], *([solver, *(it[name] for name in names)] for solver, it in steps)]


def describe_comparison(summary: Summary, units: UnitNames) -> list[str]:
    """The printed report of a comparison, in aligned lines."""
    rows = [_cells(row) for row in summary["compare"]]
    first = summary["compare"][0]
    lines, work, reference = [], unit_of("duality_gap", units), first["solver"]
    if first["outcome"] == "answered":
        counts = ", ".join(f"{first[status]} {status}" for status in COUNTS if first[status])
        lines.append(f"asperities         {counts}")
    lines += [
        f"disagreement       largest difference from the loads of {reference} / largest load",
        "load error         largest bound on the error of a load / largest load of the solver",
        f"duality gap        {f'in {work}, ' if work else ''}bound on the energy of the loads,"
        " scaled to a prescribed total, minus that of the solution",
        f"statuses           those proved from the solver's loads, compared with {reference};",
        f"                   a contact differs if one solver gives it more than {CARRIES:g} of the",
        f"                   largest load, and the other solver less than {CARRIES / 10:g}",
        "MB                 largest increase of the memory of the process during the solution",
        "",
        *aligned([HEADING, *rows], left=1),
    ]
    for row in summary["compare"]:
        lines += ["", row["message"]] if row["message"] else []
    return lines


def _cells(row: Summary) -> list[str]:
    if row["outcome"] != "answered":
        return [row["solver"], row["outcome"], *["-"] * (len(HEADING) - 2)]
    error, largest, memory = row["load_error"], row["largest_load"], row["memory"]
    relative = error / largest if largest else (math.inf if error else 0.0)
    different, undecided = row["different_statuses"], row["undecided"]
    said = {None: "-", 0: "same"}.get(different, f"{different} differ")
    statuses = f"{said}, {undecided} undecided" if undecided else said
    statuses += f"; {wrong} contacts differ" if (wrong := row["different_contacts"]) else ""
    return [row["solver"], _two(row["disagreement"]), bound(relative), _two(row["duality_gap"]),
            row["scope"], statuses, str(row["iterations"]), _two(row["seconds"]),
            "-" if memory is None else f"{memory / 1e6:.1f}"]  # fmt: skip


def comparison_warnings(summary: Summary) -> Iterator[str]:
    """Warnings about contradictions, wrong or missing solutions, and a missing certificate."""
    yield from (f"contradiction: {each}" for each in summary["contradictions"])
    rows, within = summary["compare"], summary["within"]
    for solver, apart in summary["disagreeing"].items():
        yield (
            f"{solver} disagrees: its loads differ from those of {rows[0]['solver']} by "
            f"{apart:.2g} of the largest load; at most {within:g} is allowed (--within)"
        )
    for row in rows:
        if count := row["different_contacts"]:
            differ = f"{count} contacts differ from those of {rows[0]['solver']}"
            most = f"one solver gives them more than {CARRIES:g} of the largest load"
            yield f"{row['solver']}: {differ}: {most}, the other less than {CARRIES / 10:g}"
    yield from (f"{it['solver']}: {it['outcome']}" for it in rows if it["outcome"] != "answered")
    answered = [row for row in rows if row["outcome"] == "answered"]
    if not any(row["scope"] != "none" and not row["undecided"] for row in answered):
        yield "not certified: no solver's loads prove the status of every asperity"


def _two(value: float) -> str:
    return f"{value:.2g}" if math.isfinite(value) else "-"
