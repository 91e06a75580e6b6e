"""For the tests of other software: assert that loads are certified, or that two answers agree.

Both raise AssertionError with a message that says which asperities, by how much, and which word;
neither needs a test framework. Loads that no certificate can judge (negative, not finite, of the
wrong number) raise InputError, as everywhere.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from convexrough.arrays import Array, Indices
from convexrough.compare import Answer, contradictions, listed
from convexrough.contact import Contact
from convexrough.errors import InputError
from convexrough.normal.certificate import Certificate, certify
from convexrough.scene.scene import Scene


def assert_certified(
    scene: Scene,
    loads: ArrayLike,
    *,
    approach: float | None = None,
    load: float | None = None,
    within: float | None = None,
) -> Certificate:
    """Every asperity is proved to touch or proved to be open; returns the proof.

    loads  : (n,) [force] from anywhere, in the order of the scene's asperities
    approach [length] or load [force] : what is prescribed, exactly one
    within : also, no load is further from the solution than this part of the largest load. Without
        it the loads need only be good enough for the words
    """
    certificate = certify(scene, loads, approach=approach, load=load)
    values = np.asarray(loads, dtype=np.float64) * np.ones(len(scene))
    _check_proof(certificate)
    doubtful = np.flatnonzero(certificate.status == "undecided")
    if len(doubtful):
        least = certificate.gaps[doubtful] / certificate.gap_errors[doubtful]
        doubtful = doubtful[np.argsort(least, kind="stable")]
        count = f"{len(doubtful)} of {len(scene)} asperities are undecided"
        raise AssertionError(f"{count}: {_described(scene, doubtful, values, certificate)}")
    if within is not None:
        limit = within * float(values.max())
        wide = np.flatnonzero(certificate.load_errors > limit)
        if len(wide):
            wide = wide[np.argsort(-certificate.load_errors[wide])]
            bound = f"loads are proved to {_part(certificate.load_error, values)} of the largest"
            found = f"{bound}, expected {within:g}"
            raise AssertionError(f"{found}: {_described(scene, wide, values, certificate)}")
    return certificate


def assert_agree(
    first: Contact | ArrayLike,
    second: Contact | ArrayLike,
    *,
    scene: Scene | None = None,
    approach: float | None = None,
    load: float | None = None,
    within: float | None = None,
) -> None:
    """Two answers to one problem are both proved, and do not exclude each other.

    first, second : contacts, or loads (n,) [force] in the order of the scene's asperities
    scene, approach or load : what loads that come without a contact answer
    within : also, no two loads differ by more than this part of the largest. Without it two poor
        answers agree as long as their bounds allow

    They exclude each other where loads, gaps or approaches are further apart than the sum of their
    proved bounds, or where one proves that an asperity touches and the other that it is open.
    """
    answers = [
        _answer(name, given, scene, approach, load)
        for name, given in (("first", first), ("second", second))
    ]
    one, other = answers
    if len(one.loads) != len(other.loads):
        expected = f"as many asperities as in the first, {len(one.loads)}"
        raise InputError("second", found=len(other.loads), expected=expected)
    for answer in answers:
        _check_proof(answer.certificate, f" of {answer.name}")
    if found := contradictions(one, other):
        raise AssertionError("\n".join(found))
    if within is not None:
        apart = np.abs(one.loads - other.loads)
        largest = max(float(one.loads.max()), float(other.loads.max()))
        far = np.flatnonzero(apart > within * largest)
        if len(far):
            each = (
                f"{i}: {one.loads[i]:.6g} and {other.loads[i]:.6g}"
                for i in far[np.argsort(-apart[far])]
            )
            differ = f"loads differ by {apart.max() / largest:.2g} of the largest"
            raise AssertionError(
                f"{one.name} and {other.name}: {differ}, expected {within:g}: "
                f"asperities {listed(each)}"
            )


def _answer(
    name: str,
    given: Contact | ArrayLike,
    scene: Scene | None,
    approach: float | None,
    load: float | None,
) -> Answer:
    if isinstance(given, Contact):
        return Answer(f"{name} ({given.solver})", given.loads, given.certificate)
    if scene is None:
        raise InputError("scene", found="none", expected=f"the scene that {name} answers")
    certificate = certify(scene, given, approach=approach, load=load)
    return Answer(name, np.asarray(given, dtype=np.float64) * np.ones(len(scene)), certificate)


def _check_proof(certificate: Certificate, whose: str = "") -> None:
    if certificate.scope == "none":
        raise AssertionError(
            f"nothing is proved of the loads{whose}: they are too far from a solution, or the "
            f"asperities are too dense (convexity number {certificate.convexity_number:.3g}; the "
            "energy is convex below 1)"
        )


def _described(scene: Scene, which: Indices, loads: Array, certificate: Certificate) -> str:
    """The asperities with their loads, gaps, bounds and words."""
    return listed(
        f"{i} at ({scene.asperities.positions[i, 0]:.6g}, {scene.asperities.positions[i, 1]:.6g}) "
        f"has load {loads[i]:.6g} +- {certificate.load_errors[i]:.2g}, gap "
        f"{certificate.gaps[i]:.6g} +- {certificate.gap_errors[i]:.2g}, {certificate.status[i]}"
        for i in which
    )


def _part(error: float, loads: Array) -> str:
    largest = float(loads.max())
    return f"{error / largest:.2g}" if largest > 0 else "any multiple"
