"""`verify` for shear forces: what somebody claims of sliding, held against what is proved."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from convexrough import checks
from convexrough.arrays import Array, Indices, frozen
from convexrough.contact import Contact
from convexrough.normal.claims import beyond, standing_out, total_agrees
from convexrough.shearing.certificate import ShearCertificate, certify_shear
from convexrough.shearing.state import ShearState, shear

#: A shear force is claimed to slide if it falls short of f P by no more than this part of it.
CLAIMS_SLIDING = 1e-4


@dataclass(frozen=True, eq=False)
class ShearVerdict:
    """What is proved of shear forces of first loading. Arrays are those of the scene's asperities.

    contact : pressed;  force : [force] that is prescribed;  forces : (n,) [force] as given
    claimed : (n,) who is claimed to slide
    within  : forces must be proved this near, in parts of the largest; None: near enough for every
        word to follow from the forces alone
    certificate : of the forces as given
    solution : the friction state, with its own certificate; None where the claim holds without
    """

    contact: Contact
    force: float
    forces: Array
    claimed: NDArray[np.bool_]
    within: float | None
    certificate: ShearCertificate
    solution: ShearState | None = None

    @property
    def holds(self) -> bool:
        """Everybody is proved to slide or not, as claimed; forces are within, the total agrees."""
        wrong = len(self.wrongly_sliding) + len(self.wrongly_sticking) + len(self.undecided)
        return not wrong and self.forces_hold and self.total_holds

    @cached_property
    def status(self) -> NDArray[np.str_]:
        """(n,) the proved words: "sliding", "partial", "open" or "undecided"."""
        words = self.certificate.status
        if self.solution is None:
            return words
        return frozen(np.where(words == "undecided", self.solution.status, words))

    @cached_property
    def wrongly_sliding(self) -> Indices:
        """(m,) claimed to slide, and proved to stick in part or to be open."""
        return frozen(np.flatnonzero(self.claimed & np.isin(self.status, ("partial", "open"))))

    @cached_property
    def wrongly_sticking(self) -> Indices:
        """(m,) not claimed to slide, and proved to."""
        return frozen(np.flatnonzero(~self.claimed & (self.status == "sliding")))

    @cached_property
    def undecided(self) -> Indices:
        """(m,) proved neither to slide nor not to."""
        return frozen(np.flatnonzero(self.status == "undecided"))

    @cached_property
    def force_errors(self) -> Array:
        """(n,) [force] proved bounds on |force - solution|; infinite where nothing is proved."""
        errors = self.certificate.force_errors
        if self.solution is not None:
            apart = np.abs(self.forces - self.solution.forces)
            errors = np.minimum(errors, apart + self.solution.certificate.force_errors)
        return frozen(errors)

    @property
    def force_error(self) -> float:
        """The largest of `force_errors`, in parts of the largest force."""
        largest = float(np.abs(self.forces).max())
        return float(self.force_errors.max()) / largest if largest > 0 else np.inf

    @property
    def forces_hold(self) -> bool:
        """Every force is proved near enough."""
        return self.certificate.holds if self.within is None else not len(self.forces_off)

    @cached_property
    def forces_off(self) -> Indices:
        """(m,) not proved to be `within`, furthest first; none where that is None."""
        return beyond(self.force_errors, self.within, float(np.abs(self.forces).max()))

    @property
    def total_given(self) -> float:
        """[force] the sum of the forces."""
        return float(self.forces.sum())

    @property
    def total_holds(self) -> bool:
        """The forces add up to the shear force, within `within` of it or else 1e-6."""
        return total_agrees(self.total_given, self.force, self.within)

    @cached_property
    def suspects(self) -> Indices:
        """(m,) whose forces are furthest from the solution, likeliest first; none if all hold."""
        wrong = np.concatenate((self.wrongly_sliding, self.wrongly_sticking))
        if self.solution is None or (self.forces_hold and not len(wrong)):
            return frozen(wrong)
        apart = np.abs(self.forces - self.solution.forces)
        return standing_out(apart, self.solution.certificate.force_errors)


def verify_shear(
    contact: Contact,
    forces: ArrayLike,
    *,
    force: float,
    within: float | None = None,
    sliding: ArrayLike | None = None,
) -> ShearVerdict:
    """Hold shear forces of first loading that came from anywhere against the friction law.

    forces  : (n,) [force] along the shear force, in the order of the scene's asperities
    force   : [force] the shear force Q that they carry
    within  : forces must be proved this near, in parts of the largest force
    sliding : (n,) who is claimed to slide; default: those whose force is f P, or short of it by no
        more than 1e-4 of that

    Raises InputError as `certify_shear`.
    """
    within = None if within is None else checks.positive("within", within)
    certificate = certify_shear(contact, forces, force=force)
    given = checks.array("forces", forces, length=len(contact.scene))
    if sliding is None:
        limits = checks.friction(contact.scene.friction) * contact.loads
        sliding = (limits > 0) & (np.abs(given) >= (1.0 - CLAIMS_SLIDING) * limits)
    claimed = frozen(np.array(np.broadcast_to(sliding, given.shape), dtype=bool))
    verdict = ShearVerdict(contact, float(force), given, claimed, within, certificate)
    return verdict if verdict.holds else replace(verdict, solution=shear(contact, force=force))
