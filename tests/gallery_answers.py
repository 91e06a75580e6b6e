"""The answers of the gallery, in ball arithmetic, of the scenes in convexrough/gallery/cases.json.

    PYTHONPATH=tests python tests/gallery_answers.py            computes all anew and writes them
    PYTHONPATH=tests python tests/gallery_answers.py one collinear   only those

A new case is a line without "answer".

Every digit is proved by an interval Newton step (`multiprecision`).
"""

import json
import sys
from math import log2
from pathlib import Path
from typing import Any

import numpy as np
from flint import arb, ctx
from multiprecision import NotProved
from scenes import solve_exactly
from status_audit import Dragged, slid_from

import convexrough as cr
from convexrough.gallery import cases

PATH = Path(cr.gallery.__file__).with_name(cases.DATA)
DIGITS, KEPT = 75, 50  # near Q = 0 a difference loses 12


def digits(ball: arb) -> str:
    if ball == 0:
        return "0"
    if ball.rel_accuracy_bits() < KEPT * log2(10):
        raise NotProved("fewer digits than promised")
    with ctx.workdps(DIGITS):
        return str(ball.str(KEPT, radius=False))


def answer(case: dict[str, Any]) -> dict[str, Any]:
    scene = cases.scene_of(case)
    contact = cr.press(scene, **case["prescribed"])
    full = solve_exactly(scene, **case["prescribed"], start=contact.loads, digits=DIGITS)
    totals = {"approach": digits(full.approach), "load": digits(full.load)}
    each = {"loads": [*map(digits, full.loads)], "gaps": [*map(digits, full.gaps)]}
    return totals | each | sheared(contact, full, case["shear_force"])


def sheared(contact: cr.Contact, full: Any, force: float) -> dict[str, Any]:
    """Nothing where an asperity would be dragged along."""
    with ctx.workdps(DIGITS + 30):
        try:
            slid = slid_from(contact, full, force, DIGITS)
        except Dragged:
            return {"forces": [], "slips": [], "displacement": ""}
        forces, slips = ([*map(digits, each)] for each in (slid.forces, slid.slips))
        return {"forces": forces, "slips": slips, "displacement": digits(slid.displacement)}


def true_statuses(case: cr.gallery.HardCase, statuses: Any) -> bool:
    """No status of a pressed contact is wrong."""
    allowed = np.where(case.touching, "contact", "open")
    return bool(((statuses == allowed) | (statuses == "undecided")).all())


def write(wanted: list[str]) -> None:
    """A line for each case."""
    found = json.loads(PATH.read_text())
    for name in wanted or found:
        found[name]["answer"] = answer(found[name])
        print(name, found[name]["answer"]["load"][:12])
    lines = [f"{json.dumps(name)}: {json.dumps(case)}" for name, case in found.items()]
    PATH.write_text("{\n" + ",\n".join(lines) + "\n}\n")


if __name__ == "__main__":
    write(sys.argv[1:])
