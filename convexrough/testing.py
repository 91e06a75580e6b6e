"""Assertions for the tests of other software: forces are certified, or two results agree.

An AssertionError names the asperities for which the assertion fails, with their errors and
statuses. Each function raises InputError for values that are not finite, for negative loads, and
for a wrong number of values. No function needs a test framework.
"""

from __future__ import annotations

import warnings

import numpy as np
from numpy.typing import ArrayLike

from convexrough import checks
from convexrough.comparison import Answer, contradictions, joined
from convexrough.contact import Contact
from convexrough.errors import InputError
from convexrough.friction.shear import ShearCertificate
from convexrough.friction.verdict import verify_shear
from convexrough.normal.certificate import Certificate, certify
from convexrough.normal.claims import WITHIN, Claim, tolerance
from convexrough.plausibility import cautions_about
from convexrough.record import Record
from convexrough.scene.scene import Scene
from convexrough.verdict import verify
from convexrough.verdict.report import describe_claim, reason

__tracebackhide__ = True  # pytest shows no frames of this module


def assert_certified(
    scene: Scene,
    loads: ArrayLike,
    *,
    approach: float | None = None,
    load: float | None = None,
    within: float = WITHIN,
    floor: float = 0.0,
) -> Certificate:
    """The certificate of loads, after a check that they are right.

    The check is passed if it is proved that exactly the asperities with a load touch, and that no
    error exceeds `within`; otherwise AssertionError is raised. Overlapping discs give a warning.
    Arguments are those of `verify`.

    >>> cr.testing.assert_certified(scene, contact.loads, approach=5e-5, within=1e-9).scope
    'global'
    """
    verdict = verify(scene, loads, approach=approach, load=load, within=within, floor=floor)
    if len(verdict.undecided) == len(scene):
        _check_proof(verdict.certificate)
    given, approach = np.where(verdict.claimed, verdict.loads, 0.0), verdict.certificate.approach
    cautions = "\n".join(cautions_about(scene, given, approach))
    if "contact discs overlap" in cautions:  # others are not about the model
        warnings.warn(cautions, stacklevel=2)
    _check(verdict)
    return verdict.certificate


def assert_shear_certified(
    contact: Contact,
    forces: ArrayLike,
    *,
    force: float,
    within: float = WITHIN,
    sliding: ArrayLike | None = None,
) -> ShearCertificate:
    """The certificate of shear forces, after a check that they are right.

    The check is passed if it is proved that exactly the claimed asperities slide, and that no error
    exceeds `within`; otherwise AssertionError is raised.

    forces  : (n,) [force] shear force of each asperity on first loading, from any source
    force   : [force] the prescribed sum of the shear forces
    within  : largest error allowed, as a fraction of the largest force, and of the prescribed sum
    sliding : (n,) True where sliding is claimed; default: where |force| is at least (1 - 1e-4) f
        P_i, with the coefficient of friction f and the load P_i

    >>> state = cr.shear(contact, force=9e-8)
    >>> proof = cr.testing.assert_shear_certified(contact, state.forces, force=9e-8, within=1e-9)
    >>> proof.all_proved
    True
    """
    verdict = verify_shear(contact, forces, force=force, within=within, sliding=sliding)
    _check(verdict)
    return verdict.certificate


def assert_agree(
    first: Contact | ArrayLike,
    second: Contact | ArrayLike,
    *,
    scene: Scene | None = None,
    approach: float | None = None,
    load: float | None = None,
    within: float = WITHIN,
) -> None:
    """Check that two results of one problem have certificates (scope not "none") and agree.

    They agree if no loads differ by more than `within`, and if they do not contradict each other:
    if proved statuses are equal, and values differ by at most the sum of their error bounds.

    first, second : contacts, or loads (n,) [force] in the order of the scene's asperities
    scene, approach or load : the problem of an array of loads
    within : largest difference of two loads of one asperity, as a fraction of the largest load

    Raises AssertionError if the check fails.

    >>> other = cr.press(scene, approach=5e-5, solver="conic")
    >>> cr.testing.assert_agree(contact, other, within=1e-9)
    """
    within = tolerance("within", within)
    one = _answer("first", first, scene, approach, load)
    other = _answer("second", second, scene, approach, load)
    if len(one.loads) != len(other.loads):
        expected = f"as many asperities as in the first, {len(one.loads)}"
        raise InputError("second", found=len(other.loads), expected=expected)
    for answer in (one, other):
        _check_proof(answer.certificate, f" of {answer.name}")
    if found := contradictions(one, other):
        raise AssertionError("\n".join(found))
    apart = np.abs(one.loads - other.loads)
    largest = min(float(one.loads.max()), float(other.loads.max()))
    far = np.flatnonzero(apart > within * largest)
    if len(far):
        worst = far[np.argsort(-apart[far])]
        each = (f"{i}: {one.loads[i]:.6g} and {other.loads[i]:.6g}" for i in worst)
        part = apart.max() / largest if largest > 0 else np.inf
        raise AssertionError(
            f"{one.name} and {other.name}: loads differ by {part:.2g} of the largest, expected "
            f"{within:g}: asperities {joined(each)}"
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
    if isinstance(given, Record):
        checks.instance(name, given, Contact)
    if scene is None:
        raise InputError("scene", found="none", expected=f"the scene of the loads `{name}`")
    certificate = certify(scene, given, approach=approach, load=load)
    return Answer(name, np.asarray(given, dtype=np.float64) * np.ones(len(scene)), certificate)


def _check_proof(certificate: Certificate, whose: str = "") -> None:
    if certificate.scope == "none":
        why = certificate.meaning.removeprefix("nothing is proved")
        raise AssertionError(
            f"nothing is proved about the loads{whose}{why}; convexity number "
            f"{certificate.convexity_number:.3g}, expected below 1"
        )


def _check(claim: Claim) -> None:
    if not claim.holds:
        hints = (f"hint: {each}" for each in claim.hints())
        lines = [reason(claim), *describe_claim(claim), *hints]
        raise AssertionError("\n".join(lines))
