"""`verify_files`: verdicts on the claims of files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from convexrough.contact import Contact, solve
from convexrough.errors import TableError, blamed_on
from convexrough.friction.verdict import claims_sliding, verify_shear
from convexrough.normal.claims import WITHIN, tolerance
from convexrough.normal.problem import NormalProblem
from convexrough.tabular.table import few
from convexrough.verdict.claims import Claimed, Manner, read_loads, read_shear_forces
from convexrough.verdict.report import Verified
from convexrough.verdict.verdict import verify_on

#: The statuses accepted in a file of shear forces. An asperity with "undecided" is claimed to slide
#: or to stick according to its force.
STATUSES = ("sliding", "partial", "sticking", "open", "undecided")


def verify_files(
    problem: NormalProblem,
    loads: Path,
    how: Manner,
    *,
    within: float = WITHIN,
    shear: Path | None = None,
    force: float | None = None,
) -> Verified:
    """The verdicts on loads, and on shear forces, that files claim. Errors name the file.

    within : largest error allowed, as a fraction of the largest load or shear force
    shear, force : a file of shear forces, and the prescribed total [force]; both or neither
    """
    tolerance("--within", within)
    given = read_loads(loads, problem.scene, how)
    forces = read_shear_forces(shear, problem.scene, how) if shear is not None else None
    with blamed_on(loads):
        verdict = verify_on(problem, given.values, within=within, floor=how.floor)
    if shear is None or force is None or forces is None:
        return Verified(verdict, None, [given.note])
    contact = verdict.solution
    if contact is None:
        contact = solve(problem, start=np.where(verdict.claimed, verdict.loads, 0.0))
    sliding = _claimed_to_slide(shear, forces, contact)
    with blamed_on("--shear-force"):
        sheared = verify_shear(contact, forces.values, force=force, within=within, sliding=sliding)
    return Verified(verdict, sheared, [given.note, forces.note])


def _claimed_to_slide(path: Path, forces: Claimed, contact: Contact) -> NDArray[np.bool_] | None:
    if forces.status is None:
        return None
    said = np.char.lower(np.char.strip(forces.status))
    if len(unknown := np.unique(said[~np.isin(said, STATUSES)])):
        valid = ", ".join(STATUSES)
        named = [repr(str(each)) for each in unknown[:10]]
        mistakes = [f"column status: found {each}, expected {valid}" for each in named]
        raise TableError(str(path), mistakes)
    wrong = np.where(contact.status == "contact", said == "open", False)
    wrong |= np.where(contact.status == "open", (said != "open") & (said != "undecided"), False)
    if wrong.any():
        mistakes = [
            f'column status: found "{said[i]}" at asperity {i}, which is proved {contact.status[i]}'
            for i in np.flatnonzero(wrong)
        ]
        raise TableError(str(path), few(mistakes))
    by_force = claims_sliding(contact, forces.values)
    return np.where(said == "undecided", by_force, said == "sliding")
