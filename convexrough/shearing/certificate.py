"""What is proved of a friction state, or of shear forces from anywhere, in the scene's units."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from convexrough import checks
from convexrough.arrays import Array, among_zeros, frozen
from convexrough.contact import Contact
from convexrough.normal.boxes import Scope
from convexrough.normal.certificate import Certificate
from convexrough.record import Along, Table
from convexrough.roundoff import ROUNDOFF, SAFETY
from convexrough.shearing.bounds import Bounds
from convexrough.shearing.judgement import judge_states
from convexrough.shearing.normal_map import States, evaluate, gross_sliding, slips
from convexrough.shearing.problem import TangentialProblem

#: Forces that the normal map has slide are judged as f P if they fall short of it by this part.
NEAR_SLIDING = 1e-2


@dataclass(frozen=True, eq=False, repr=False)
class ShearCertificate(Table):
    """What is proved of a friction state. Arrays are (n,), in the caller's order.

    scope : that of the contact it starts from, or "none" where nothing is proved
    status : "sliding" (proved to slide as a whole), "partial" (proved to keep a stick disc),
        "open" (proved to carry no load) or "undecided"
    force_errors : [force];  slip_errors : [length] bounds on the distance to the solution
    displacement_error : [length] likewise

    >>> judged = cr.shear(contact, force=0.25 * contact.load).certificate
    >>> judged.scope, judged.holds, (judged.status == "sliding").sum().item()
    ('global', True, 6)
    """

    _shown = ("holds",)
    _along: ClassVar[Along] = {("asperity",): ("status", "force_errors", "slip_errors")}

    scope: Scope
    status: NDArray[np.str_]
    force_errors: Array
    slip_errors: Array
    displacement_error: float

    @property
    def holds(self) -> bool:
        """Every asperity is proved to slide, to stick in part, or to be open."""
        return self.scope != "none" and not bool((self.status == "undecided").any())

    @classmethod
    def of(cls, problem: TangentialProblem, bounds: Bounds) -> ShearCertificate:
        """From the bounds on one state; those on vectors are on their lengths."""
        normal, touching = problem.certificate, problem.touching
        loaded = among_zeros(np.ones(len(touching), dtype=bool), touching, len(problem.scene))
        unloaded = np.where(loaded, 0.0, problem.friction * normal.load_errors)
        unplaced = np.where(loaded | (normal.status == "open"), 0.0, np.inf)
        sliding, partial = problem.to_scene(bounds.sliding[0]), problem.to_scene(bounds.partial[0])
        forces = problem.to_scene(bounds.increments[0] * problem.force_unit)
        slips = problem.to_scene(bounds.slips[0] * problem.travel_unit)
        return cls(
            scope=normal.scope if bounds.proved[0] else "none",
            status=friction_words(normal.status, sliding, partial),
            force_errors=frozen(unloaded + forces),
            slip_errors=frozen(unplaced + slips),
            displacement_error=float(bounds.rises[0]) * problem.travel_unit,
        )

    @classmethod
    def of_no_load(cls, certificate: Certificate) -> ShearCertificate:
        """Of a contact that carries nothing: its words, and no force or slip in doubt."""
        zero = frozen(np.zeros(len(certificate.status)))
        return cls(certificate.scope, certificate.status, zero, zero, 0.0)


def friction_words(
    normal: NDArray[np.str_], sliding: NDArray[np.bool_], partial: NDArray[np.bool_]
) -> NDArray[np.str_]:
    """(n,) "sliding", "partial", "open" or "undecided", from the words of the pressed contact.

    sliding, partial : (n,) proved of each asperity of the scene
    """
    words = np.full(len(normal), "undecided", dtype="<U9")
    words[normal == "open"] = "open"
    words[partial] = "partial"
    words[sliding] = "sliding"
    return frozen(words)


def certify_shear(contact: Contact, forces: ArrayLike, *, force: float) -> ShearCertificate:
    """Judge shear forces of first loading that came from anywhere.

    forces : (n,) [force] along the shear force, in the order of the scene's asperities
    force  : [force] the shear force Q that they carry

    Two states are judged: the forces, with those that slide at f P, and their image under the
    normal map. A force is no further from the solution than from either state, and that state's
    own bound. `slip_errors` and `displacement_error` are of the slips and the displacement that
    the forces leave.

    Raises InputError if the scene has no friction, |Q| exceeds f P, or forces are not numbers.

    >>> force = 0.25 * contact.load
    >>> state = cr.shear(contact, force=force)
    >>> cr.certify_shear(contact, state.forces, force=force).holds
    True
    """
    limit = checks.friction(contact.scene.friction) * contact.load
    total = abs(float(checks.bearable("force", checks.finite("force", force), limit)))
    given = checks.array("forces", forces, length=len(contact.scene))
    if contact.load == 0.0:
        judged, elsewhere = ShearCertificate.of_no_load(contact.certificate), given
    else:
        problem = TangentialProblem.of(contact)
        increments = np.copysign(1.0, force) * given[problem.touching] / problem.force_unit
        totals = problem.limited(np.array([total / problem.friction / problem.units.force]))
        judged = ShearCertificate.of(problem, _judged(problem, increments, totals))
        elsewhere = np.where(contact.loads > 0, 0.0, given)
    return replace(judged, force_errors=frozen(judged.force_errors + np.abs(elsewhere)))


def _judged(problem: TangentialProblem, given: Array, totals: Array) -> Bounds:
    """Bounds on (n,) increments from anywhere, by those on two states near them."""
    states = _near(problem, given, totals)
    bounds = judge_states(problem, states)
    apart = np.abs(states.increments - given) + 4 * ROUNDOFF * np.abs(given)

    def least(errors: Array, apart: Array) -> Array:
        return np.asarray((errors + apart * (1 + SAFETY)).min(axis=0, keepdims=True))

    def either(proved: NDArray[np.bool_]) -> NDArray[np.bool_]:
        return np.asarray(proved.any(axis=0, keepdims=True))

    return Bounds(
        proved=either(bounds.proved),
        increments=least(bounds.increments, apart),
        slips=least(bounds.slips, np.abs(states.slips - states.slips[0])),
        rises=least(bounds.rises, np.abs(states.rises - states.rises[0])),
        sliding=either(bounds.sliding),
        partial=either(bounds.partial),
        losses=np.array([np.inf]),  # nobody asks for a loss of given forces
    )


def _near(problem: TangentialProblem, given: Array, totals: Array) -> States:
    """Two states near (n,) increments from anywhere: themselves, and their image.

    The image of u is u(rise - A u), with the rise that makes it add up to the total. What slides
    there and is near P here is taken for P: short of it by little, it would seem to stick.
    """
    P = problem.loads
    u = np.clip(given, -P, P)
    image = evaluate(problem, -problem.couple(u)[None], totals)
    eta, moved, rises = image.deflections, image.increments, image.rises
    if problem.at_limit(totals).any():
        eta, moved, rise = gross_sliding(problem)
        eta, moved, rises = eta[None], moved[None], np.array([rise])
    slides = (np.abs(eta[0]) >= problem.ceilings) & (np.sign(eta[0]) == np.sign(u))
    u = np.where(slides & (P - np.abs(u) <= NEAR_SLIDING * P), np.copysign(P, u), u)
    own = problem.deflections(u)
    weights = problem.slopes(own)
    if weights.any():
        rise = float(weights @ (own + problem.couple(u)) / weights.sum())
        rises = np.append(rise, rises)
    else:
        rises = np.repeat(rises, 2)
    increments = np.stack((u, moved[0]))
    left = rises[:, None] - problem.couple(increments)
    deflections = np.stack((own, eta[0]))
    return States(np.repeat(totals, 2), deflections, increments, rises, slips(problem, left))
