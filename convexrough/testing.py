"""For the tests of other software: assert that forces are certified, or that two answers agree.

All raise AssertionError with a message that says which asperities, by how much, and which word;
none needs a test framework. Loads that no certificate can judge (negative, not finite, of the
wrong number) raise InputError, as everywhere.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from convexrough.arrays import Indices
from convexrough.compare import Answer, contradictions, listed
from convexrough.contact import Contact
from convexrough.errors import InputError
from convexrough.friction.shear import ShearCertificate
from convexrough.friction.verdict import verify_shear
from convexrough.normal.certificate import Certificate, certify
from convexrough.normal.claims import Claim
from convexrough.scene.scene import Scene
from convexrough.verdict import Verdict, verify


def assert_certified(
    scene: Scene,
    loads: ArrayLike,
    *,
    approach: float | None = None,
    load: float | None = None,
    within: float | None = None,
    floor: float = 0.0,
) -> Certificate:
    """The asperities that these loads claim to touch are proved to, and only they; the proof.

    loads  : (n,) [force] from anywhere, in the order of the scene's asperities
    approach [length] or load [force] : what is prescribed, exactly one; it is that of the loads
    within : also, no load is further from the solution than this part of the largest load. Without
        it the loads need only be good enough for the words
    floor  : [force] a load up to this claims that its asperity is open
    """
    __tracebackhide__ = True
    verdict = verify(scene, loads, approach=approach, load=load, within=within, floor=floor)
    if len(verdict.undecided) == len(scene):
        _check_proof(verdict.certificate)
    _check(verdict, "load", scene)
    return verdict.certificate


def assert_shear_certified(
    contact: Contact,
    forces: ArrayLike,
    *,
    force: float,
    within: float | None = None,
    sliding: ArrayLike | None = None,
) -> ShearCertificate:
    """The asperities that these forces claim to slide are proved to, and only they; the proof.

    forces  : (n,) [force] of first loading, along the shear force, from anywhere
    force   : [force] the shear force that they carry
    within  : also, no force is further from the solution than this part of the largest
    sliding : (n,) who is claimed to slide; default: those whose force is f P to 1e-4 of it
    """
    __tracebackhide__ = True
    verdict = verify_shear(contact, forces, force=force, within=within, sliding=sliding)
    _check(verdict, "force", contact.scene)
    return verdict.certificate


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
    __tracebackhide__ = True
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
    __tracebackhide__ = True
    if certificate.scope == "none":
        raise AssertionError(
            f"nothing is proved of the loads{whose}: they are too far from a solution, or the "
            f"asperities are too dense (convexity number {certificate.convexity_number:.3g}; the "
            "energy is convex below 1)"
        )


def _check(claim: Claim, name: str, scene: Scene) -> None:
    """Raise AssertionError unless the claim holds; `name` is what its numbers are called."""
    __tracebackhide__ = True
    if claim.holds:
        return
    hints = claim.hints() if isinstance(claim, Verdict) else ()
    raise AssertionError("\n".join([_wrong(claim, name, scene), *(f"hint: {h}" for h in hints)]))


def _wrong(claim: Claim, name: str, scene: Scene) -> str:
    """What keeps a claim from holding."""

    def described(which: Indices) -> str:
        return _described(claim, name, scene, which)

    if len(wrong := claim.wrongly_claimed):
        first = claim.suspects[np.isin(claim.suspects, wrong)]
        named = np.append(first, np.setdiff1d(wrong, first))
        kinds = ", ".join(f"{len(who)} {what}" for what, who in claim.wrong.items() if len(who))
        return f"{kinds}: {described(named)}"
    if len(doubtful := claim.undecided):
        count = f"{len(doubtful)} of {len(scene)} asperities are undecided"
        return f"{count}: {described(doubtful)}"
    if not claim.near_enough:
        worst = claim.suspects if len(claim.suspects) else claim.off
        bound = f"{name}s are proved to {claim.error:.2g} of the largest"
        needed = "enough for every word" if claim.within is None else f"{claim.within:g}"
        return f"{bound}, expected {needed}: {described(worst)}"
    return f"{name}s add up to {claim.total_given:.17g}, expected {claim.total_prescribed:.17g}"


def _described(claim: Claim, name: str, scene: Scene, which: Indices) -> str:
    """The asperities with what is claimed of them, how far that may be off, and their words."""
    points, nearby = scene.asperities.positions, claim.nearby()

    def solved(i: int) -> str:
        return "" if nearby is None else f", solved {nearby[0][i]:.6g}"

    return listed(
        f"{i} at ({points[i, 0]:.6g}, {points[i, 1]:.6g}) has {name} {claim.values[i]:.6g} +- "
        f"{claim.errors[i]:.2g}{solved(i)}, {claim.status[i]}"
        for i in which
    )
