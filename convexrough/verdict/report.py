"""What `verify` says of a claim: for people, for programs, and in files."""

from __future__ import annotations

import math
from typing import Any
from xml.etree import ElementTree

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Indices
from convexrough.compare import joined
from convexrough.friction.verdict import ShearVerdict
from convexrough.normal.claims import Claim
from convexrough.plausibility import described_modulus
from convexrough.scene.scene import Scene
from convexrough.tabular.columns import aligned, bound
from convexrough.tabular.units import UnitNames
from convexrough.verdict.files import Verified

#: From this part on errors are said in per cent.
PERCENT = 1e-4

#: Asperities that a list on the terminal names before it says how many more there are.
MOST_LISTED = 10


def verdict_summary(found: Verified) -> dict[str, Any]:
    """What `--json` prints of the claims, in the scene's units."""
    summary: dict[str, Any] = {"verdict": _claim_summary(found.verdict)}
    if found.sheared is not None:
        summary["shear_verdict"] = _claim_summary(found.sheared)
    columns = asperity_columns(found)
    rows = zip(*(values.tolist() for values in columns.values()), strict=True)
    return summary | {"asperities": [dict(zip(columns, row, strict=True)) for row in rows]}


def _claim_summary(claim: Claim) -> dict[str, Any]:
    names = ("wrongly_open", "wrongly_loaded")
    if isinstance(claim, ShearVerdict):
        names = ("wrongly_sliding", "wrongly_sticking")
    return {
        "holds": claim.holds,
        **{name: getattr(claim, name).tolist() for name in names},
        "undecided": claim.undecided.tolist(),
        "off": claim.off.tolist(),
        "suspects": claim.suspects.tolist(),
        "error": claim.error,
        "total_given": claim.total_given,
        "total_prescribed": claim.total_prescribed,
        "within": claim.within,
    }


def asperity_columns(found: Verified) -> dict[str, NDArray[Any]]:
    """One row per asperity: what is claimed of it and what is proved."""
    verdict, sheared = found.verdict, found.sheared
    x, y = verdict.scene.asperities.positions.T
    claimed = np.where(verdict.claimed, "contact", "open")
    columns = {"index": np.arange(len(x)), "x": x, "y": y, **_columns(verdict, "load", claimed)}
    if sheared is not None:
        claimed = np.where(sheared.claimed, "sliding", "sticking")
        for name, values in _columns(sheared, "force", claimed).items():
            columns[name if name.startswith("force") else f"shear_{name}"] = values
    return columns


def _columns(claim: Claim, name: str, claimed: NDArray[np.str_]) -> dict[str, NDArray[Any]]:
    rank = np.zeros(len(claimed), dtype=np.intp)
    rank[claim.suspects] = np.arange(len(claim.suspects)) + 1
    columns = {name: claim.values, "claimed": claimed, "status": claim.status}
    columns |= {f"{name}_error": claim.errors, "suspect": rank}
    if (nearby := claim.nearby()) is not None:
        columns["solution"] = nearby[0]
    return columns


def describe_verdict(found: Verified, units: UnitNames) -> list[str]:
    """Aligned lines: of each claim the wrong set, undecided, off, and the total, in this order."""
    lines = [*found.notes, *describe_scene(found.verdict.scene, units)]
    for name, claim in found.claims:
        lines += ["", *_describe(claim, found.verdict.scene, name, units)]
    return lines


def describe_scene(scene: Scene, units: UnitNames) -> list[str]:
    """Lines about the scene: geometry and contact modulus."""
    modulus = described_modulus(scene.material.contact_modulus, units)
    return [_line("geometry", scene.geometry), _line("contact modulus", modulus)]


def _kind(claim: Claim) -> str:
    return "shear forces" if isinstance(claim, ShearVerdict) else "loads"


def _proved(claim: Claim) -> str:
    """What is proved of a claim, in a line."""
    what = "statuses" if isinstance(claim, ShearVerdict) else "contact set"
    if len(claim.wrongly_claimed):
        return f"{what} wrong"
    if len(claim.undecided):
        return f"{what} not proved"
    asked = "" if claim.within is not None else " (no tolerance given)"
    near = f"{_kind(claim)} known to {_size(claim)}{asked}"
    if not claim.near_enough:
        near += ", not near enough"
    return f"{what} proved; {near}{'' if claim.total_holds else '; total load differs'}"


def _size(claim: Claim) -> str:
    per_cent = claim.error > PERCENT
    return f"{f'{bound(100 * claim.error)} %' if per_cent else bound(claim.error)} of the largest"


def _describe(claim: Claim, scene: Scene, name: str, units: UnitNames) -> list[str]:
    table = _Listing(claim, scene, name, units)
    what = "result" if name == "load" else _kind(claim)
    lines = [_line(what, _proved(claim))]
    lines.append(_line("wrong statuses", str(len(claim.wrongly_claimed) or "none")))
    for what, which in claim.wrong.items():
        if len(which):
            lines += [f"  {what}: {len(which):,}", *table.of(_worst_first(claim, which))]
    lines.append(_line("undecided", str(len(claim.undecided) or "none")))
    lines += table.of(claim.undecided)
    lines += [_line(f"{name} error", _off(claim, name)), *table.of(claim.off)]
    lines.append(_line(f"total {name}", _total(claim, units.force)))
    if len(claim.suspects):
        lines += [_line("suspects", "likeliest first"), *table.of(claim.suspects)]
    return lines


def reason(found: Verified) -> str:
    """One line: what keeps the claims from holding; "" where they do."""
    parts = []
    for kind, claim in found.claims:
        if claim.holds:
            continue
        counts = {"wrongly claimed": len(claim.wrongly_claimed), "undecided": len(claim.undecided)}
        counts[f"{kind}s off"] = len(claim.off)
        parts += [f"{count:,} {what}" for what, count in counts.items() if count]
        if not claim.near_enough and claim.within is None:
            parts.append(f"{kind}s too inaccurate to prove all statuses")
        if not claim.total_holds:
            parts.append(f"total of the {kind}s off")
    return ", ".join(parts)


def junit(found: Verified) -> bytes:
    """The findings as a suite of JUnit's, a case for each question."""
    suite = ElementTree.Element("testsuite", name="convexrough verify")
    failures = 0
    for kind, claim in found.claims:
        set_wrong = {what: which for what, which in claim.wrong.items() if len(which)}
        asked: dict[str, str] = {
            "contact set" if claim is found.verdict else "statuses": "; ".join(
                f"{what}: {_named(claim, found.verdict.scene, which)}"
                for what, which in set_wrong.items()
            ),
            "undecided": _named(claim, found.verdict.scene, claim.undecided),
            "off": "" if claim.near_enough else _off(claim, kind),
            "total": "" if claim.total_holds else _total(claim, ""),
        }
        for name, wrong in asked.items():
            case = ElementTree.SubElement(
                suite, "testcase", classname="convexrough.verify", name=f"{_kind(claim)}: {name}"
            )
            if wrong:
                failures += 1
                ElementTree.SubElement(case, "failure", message=name).text = wrong
    suite.set("tests", str(len(suite)))
    suite.set("failures", str(failures))
    root = ElementTree.Element("testsuites")
    root.append(suite)
    written: bytes = ElementTree.tostring(root, encoding="utf-8", xml_declaration=True)
    return written


def _named(claim: Claim, scene: Scene, which: Indices) -> str:
    points = scene.asperities.positions
    return joined(f"{i} at ({points[i, 0]:.6g}, {points[i, 1]:.6g})" for i in which)


class _Listing:
    """Tables of some asperities, cut with a count."""

    def __init__(self, claim: Claim, scene: Scene, name: str, units: UnitNames) -> None:
        self.claim, self.points = claim, scene.asperities.positions
        x, y, force = (
            f"{each} [{unit}]" if unit else each
            for each, unit in (("x", units.length), ("y", units.length), (name, units.force))
        )
        self.heading = ["index", x, y, force, "solution", "bound", "status"]

    def of(self, which: Indices) -> list[str]:
        if len(which) == 0:
            return []
        claim, nearby = self.claim, self.claim.nearby()
        rows = [
            [
                str(i),
                f"{self.points[i, 0]:.6g}",
                f"{self.points[i, 1]:.6g}",
                f"{claim.values[i]:.6g}",
                "-" if nearby is None else f"{nearby[0][i]:.6g}",
                bound(float(claim.errors[i])),
                str(claim.status[i]),
            ]
            for i in which[:MOST_LISTED]
        ]
        lines = [f"    {line}" for line in aligned([self.heading, *rows])]
        if (more := len(which) - MOST_LISTED) > 0:
            lines.append(f"    and {more:,} more: --json and --out have all")
        return lines


def _worst_first(claim: Claim, which: Indices) -> Indices:
    return which[np.argsort(-claim.errors[which], kind="stable")]


def _off(claim: Claim, name: str) -> str:
    if claim.within is None:
        if claim.near_enough:
            return f"at most {_size(claim)} {name}"
        return f"up to {_size(claim)} {name}: too large to prove every status"
    beyond = f"; beyond that: {len(claim.off):,}" if len(claim.off) else ""
    return f"at most {_size(claim)} {name} ({claim.within:g} allowed{beyond})"


def _total(claim: Claim, unit: str) -> str:
    given = f"{claim.total_given:.10g} {unit}".rstrip()
    if claim.total_prescribed is None:
        return f"{given} (none prescribed)"
    if claim.total_holds:
        return f"{given} (as prescribed)"
    expected = f"{claim.total_prescribed:.10g} {unit}".rstrip()
    ratio = claim.total_given / claim.total_prescribed if claim.total_prescribed else math.inf
    return f"{given}, prescribed {expected}: ratio {ratio:.7g}"


def _line(name: str, text: str) -> str:
    return f"{name:<18}{text}"
