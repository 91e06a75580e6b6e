"""`verify` on files: read the claims, and compare them with the proof."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from convexrough import checks
from convexrough.contact import Contact, solve
from convexrough.errors import InputError, TableError
from convexrough.friction.verdict import ShearVerdict, claims_sliding, verify_shear
from convexrough.normal.claims import Claim
from convexrough.normal.problem import NormalProblem
from convexrough.scene.scene import Scene
from convexrough.verdict.claims import PLAIN, Claimed, Manner, read_loads, read_shear_forces
from convexrough.verdict.verdict import Verdict, verify_on

#: What a file may call an asperity under shear. "undecided" claims nothing: then the force does.
STATUSES = ("sliding", "partial", "sticking", "open", "undecided")


@dataclass(frozen=True, kw_only=True)
class Question:
    """What is asked of a file of loads, and how it is to be read.

    within    : parts of the largest load, or shear force;  floor : [force]
    shear, force : a file of shear forces and what they carry [force]; both or neither
    """

    within: float | None = None
    floor: float = 0.0
    how: Manner = PLAIN
    shear: Path | None = None
    force: float | None = None

    def __post_init__(self) -> None:
        for name, value in (("within", self.within), ("tolerance", self.how.tolerance)):
            if value is not None:
                checks.positive(f"--{name}", value)
        checks.non_negative("--floor", self.floor)


class Verified(NamedTuple):
    """The verdicts on the claims of files; `notes` say how these were read.

    sheared : on shear forces, None without these
    """

    verdict: Verdict
    sheared: ShearVerdict | None
    notes: list[str]

    @property
    def claims(self) -> list[tuple[str, Claim]]:
        """Each with what its numbers are called."""
        claims: list[tuple[str, Claim]] = [("load", self.verdict)]
        return claims if self.sheared is None else [*claims, ("force", self.sheared)]

    @property
    def holds(self) -> bool:
        return all(claim.holds for _, claim in self.claims)


def read_files(scene: Scene, loads: Path, question: Question) -> tuple[Claimed, Claimed | None]:
    """What files claim, loads and shear forces, in the scene's units."""
    given = read_loads(loads, scene, question.how, question.floor)
    if question.shear is None:
        return given, None
    return given, read_shear_forces(question.shear, scene, question.how)


def verify_files(problem: NormalProblem, loads: Path, question: Question) -> Verified:
    """Judge the claims of files. Errors of reading and judging them name the file."""
    given, forces = read_files(problem.scene, loads, question)
    try:
        verdict = verify_on(problem, given.values, within=question.within, floor=question.floor)
    except InputError as error:
        raise error.within(str(loads)) from error
    if forces is None:
        return Verified(verdict, None, [given.note])
    sheared = _sheared(problem, verdict, forces, question)
    return Verified(verdict, sheared, [given.note, forces.note])


def _sheared(
    problem: NormalProblem, verdict: Verdict, forces: Claimed, question: Question
) -> ShearVerdict:
    """Shear forces on the contact that is pressed from the given loads."""
    assert question.force is not None  # both or neither
    contact = verdict.solution
    if contact is None:
        contact = solve(problem, start=np.where(verdict.claimed, verdict.loads, 0.0))
    return verify_shear(
        contact,
        forces.values,
        force=question.force,
        within=question.within,
        sliding=_claims(question.shear, forces, contact),
    )


def _claims(path: Path | None, forces: Claimed, contact: Contact) -> NDArray[np.bool_] | None:
    """(n,) true where the file says sliding; None where it has no statuses."""
    if forces.status is None:
        return None
    said = np.char.lower(np.char.strip(forces.status))
    if len(unknown := np.unique(said[~np.isin(said, STATUSES)])):
        valid = ", ".join(STATUSES)
        named = [repr(str(each)) for each in unknown[:10]]
        mistakes = [f"column status: found {each}, expected {valid}" for each in named]
        raise TableError(str(path), mistakes)
    by_force = claims_sliding(contact, forces.values)
    return np.where(said == "undecided", by_force, said == "sliding")
