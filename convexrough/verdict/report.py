"""Reports of `verify` and of failed assertions: text, JSON, tables and JUnit files."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Indices
from convexrough.comparison import joined
from convexrough.normal.claims import Claim
from convexrough.plausibility import described_modulus
from convexrough.record import rows_of
from convexrough.scene.scene import Scene
from convexrough.tabular.columns import aligned, bound, labelled

#: Relative errors above PERCENT are printed in per cent; lists have at most MOST_LISTED asperities.
PERCENT, MOST_LISTED = 1e-4, 10


def verdict_summary(claims: Sequence[Claim]) -> dict[str, Any]:
    """What `--json` prints: the verdicts and a row for each asperity, in the scene's units."""
    summary: dict[str, Any] = {}
    for key, claim in zip(("verdict", "shear_verdict"), claims, strict=False):
        names = ("holds", *claim.kinds, "undecided", "off", "suspects", "error", "total_given",
                 "total_prescribed", "within")  # fmt: skip
        found = ((name, getattr(claim, name)) for name in names)
        summary[key] = {name: it.tolist() if np.ndim(it) else it for name, it in found}
        summary[key][f"{claim.one}_error"] = float(claim.errors.max())
    return summary | {"asperities": rows_of(asperity_columns(claims))}


def asperity_columns(claims: Sequence[Claim]) -> dict[str, NDArray[Any]]:
    """Columns by name, with what is claimed, and what is proved, about each asperity."""
    loads, *sheared = claims
    x, y = loads.of.asperities.positions.T
    columns = {"index": np.arange(len(x)), "x": x, "y": y, **_columns(loads)}
    for name, values in (each for claim in sheared for each in _columns(claim).items()):
        columns[name if name.startswith("force") else f"shear_{name}"] = values
    return columns


def _columns(claim: Claim) -> dict[str, NDArray[Any]]:
    rank = np.zeros(len(claim.values), dtype=np.intp)
    rank[claim.suspects] = np.arange(len(claim.suspects)) + 1
    columns = {claim.one: claim.values, "claimed": np.where(claim.claimed, *claim.claims)}
    columns |= {"status": claim.status, f"{claim.one}_error": claim.errors, "suspect": rank}
    if (nearby := claim.nearby()) is not None:
        columns["solution"] = nearby[0]
    return columns


def describe_scene(scene: Scene) -> list[str]:
    """Aligned lines with the geometry and the contact modulus of a scene."""
    modulus = described_modulus(scene.material.contact_modulus, scene.units)
    return labelled([("geometry", scene.geometry), ("contact modulus", modulus)])


def _proved(claim: Claim) -> str:
    if len(claim.wrongly_claimed):
        return f"{claim.proved} wrong"
    if len(claim.undecided):
        return f"{claim.proved} not proved"
    near = f"{claim.many} correct to within {_size(claim)}"
    if not claim.near_enough:
        near = f"errors of up to {_size(claim)}, more than allowed"
    total = "" if claim.total_holds else f"; total {claim.one} differs"
    return f"{claim.proved} proved; {near}{total}"


def _size(claim: Claim) -> str:
    """The largest error, rounded up but not above an allowed error that it does not exceed."""
    if math.isinf(most := float(claim.errors.max())):
        return "an unknown size"
    smaller = claim.nearby() is not None and claim.largest < np.abs(claim.values).max()
    which = f"{claim.one} of the solution" if smaller else claim.one
    if most > 0 == claim.largest:
        size = f"{bound(most)} {claim.of.units.force}".rstrip()
        return f"{size} while the largest {'' if smaller else 'given '}{which} is 0"
    if math.isinf(claim.error):  # of tiny loads
        return f"more than the largest {which}"
    shown = float(bound(claim.error))
    if claim.near_enough:
        shown = min(shown, claim.within)
    return f"{_fraction(shown)} of the largest {which}"


def _fraction(value: float) -> str:
    return f"{100 * value:.12g} %" if value > PERCENT else f"{value:.12g}"


def describe_claim(claim: Claim, others: str = "") -> list[str]:
    """Aligned lines about a claim; `others` follows the number of rows that a table leaves out."""
    length, force = claim.of.units
    units = {"x": length, "y": length, claim.one: force}
    heads = [f"{each} [{unit}]" if unit else each for each, unit in units.items()]
    nearby, points = claim.nearby(), claim.of.asperities.positions.tolist()

    def table(which: Indices) -> Iterator[str]:
        rows: list[list[Any]] = [["index", *heads, "solution", "bound", "status"]]
        for i in which[:MOST_LISTED]:
            solution = None if nearby is None else float(nearby[0][i])
            error = bound(float(claim.errors[i]))
            rows.append([i, *points[i], float(claim.values[i]), solution, error, claim.status[i]])
        if len(which):
            yield from (f"    {line}" for line in aligned(rows))
        if (more := len(which) - MOST_LISTED) > 0:
            yield f"    and {more:,} more{others}"

    worst = np.argsort(-claim.errors, kind="stable")
    lines = labelled([("result" if claim.one == "load" else claim.many, _proved(claim))])
    lines += [claim.basis] if claim.basis else []
    lines += labelled([("wrong statuses", str(len(claim.wrongly_claimed) or "none"))])
    for what, which in claim.wrong.items():
        if len(which):
            lines += [f"  {what}: {len(which):,}", *table(worst[np.isin(worst, which)])]
    lines += labelled([("undecided", str(len(claim.undecided) or "none"))])
    lines += table(claim.undecided)
    lines += labelled([(f"{claim.one} error", _off(claim))])
    lines += table(claim.off) if math.isfinite(claim.errors.max()) else []
    lines += labelled([(f"total {claim.one}", _total(claim, claim.of.units.force))])
    if len(claim.suspects):
        lines += [*labelled([("suspects", "most likely first")]), *table(claim.suspects)]
    return lines


def reason(claim: Claim) -> str:
    """The reasons why a claim does not hold, on one line; "" if it holds."""
    counts = {"wrong statuses": len(claim.wrongly_claimed), "undecided": len(claim.undecided)}
    counts[f"{claim.one}s not within the tolerance"] = len(claim.off)
    parts = [f"{what} ({count:,})" for what, count in counts.items() if count]
    if not claim.total_holds:
        parts.append(f"the total {claim.one} is not the prescribed one")
    return ", ".join(parts)


def junit(claims: Sequence[Claim], files: str) -> bytes:
    """JUnit XML about `files`, with a case for each check of each claim."""
    suite = ElementTree.Element("testsuite", name=f"convexrough verify {files}", errors="0")
    named = ((it.many, *each) for it in claims for each in _findings(it).items())
    for name, text in ((f"{many}: {check}", text) for many, check, text in named):
        case = ElementTree.SubElement(suite, "testcase", classname=suite.get("name", ""), name=name)
        if text:
            first = f"{name}: {text.splitlines()[0]}"
            ElementTree.SubElement(case, "failure", message=first).text = text
    suite.set("tests", str(len(suite)))
    suite.set("failures", str(len(suite.findall("*/failure"))))
    root = ElementTree.Element("testsuites")
    root.append(suite)
    return bytes(ElementTree.tostring(root, encoding="utf-8", xml_declaration=True))


def _findings(claim: Claim) -> dict[str, str]:
    """By the name of each check: what is wrong, or "" if the check is passed."""
    points = claim.of.asperities.positions

    def named(which: Indices) -> str:
        return joined(f"{i} at ({points[i, 0]:.6g}, {points[i, 1]:.6g})" for i in which)

    wrong = (f"{what}: {named(which)}" for what, which in claim.wrong.items() if len(which))
    return {
        claim.proved: "; ".join(wrong),
        "undecided": named(claim.undecided),
        "off": "" if claim.near_enough else _off(claim),
        "total": "" if claim.total_holds else _total(claim, ""),
    }


def _off(claim: Claim) -> str:
    noun = claim.one if len(claim.off) == 1 else claim.many
    beyond = f"; exceeded by {len(claim.off):,} {noun}" if len(claim.off) else ""
    allowed = f"{_fraction(claim.within)} allowed"
    if math.isinf(claim.errors.max()):
        return f"no bound is proved ({allowed})"
    return f"at most {_size(claim)} ({allowed}{beyond})"


def _total(claim: Claim, unit: str) -> str:
    given = f"{claim.total_given:.10g} {unit}".rstrip()
    if claim.total_prescribed is None:
        return f"{given} (none prescribed)"
    apart = abs(claim.total_given - claim.total_prescribed)
    if apart <= PERCENT / 100 * abs(claim.total_prescribed):
        return f"{given} (as prescribed)"
    expected = f"{claim.total_prescribed:.10g} {unit}".rstrip()
    ratio = claim.total_given / claim.total_prescribed if claim.total_prescribed else math.inf
    opposite = ", of opposite sign" if ratio < 0 else ""
    return f"{given}, prescribed {expected}: ratio {ratio:.7g}{opposite}"
