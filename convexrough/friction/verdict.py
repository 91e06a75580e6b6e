"""`verify_shear`, `certify_shear`: comparison of claimed shear forces with what is proved."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from convexrough import checks
from convexrough.arrays import Array, Indices, frozen
from convexrough.contact import Contact
from convexrough.errors import InputError
from convexrough.friction.levels import FrictionLevels
from convexrough.friction.shear import ShearCertificate, ShearState, shear
from convexrough.normal.claims import WITHIN, Claim, tolerance
from convexrough.record import Record
from convexrough.roundoff import SAFETY
from convexrough.scene.scene import Scene

#: An asperity is claimed to slide if its shear force is at least 1 - CLAIMS_SLIDING times f P_i. It
#: keeps this status of the solution if the error bound of its force is below NEAR_SLIDING f P_i.
CLAIMS_SLIDING, NEAR_SLIDING = 1e-4, 1e-2


@dataclass(frozen=True, eq=False, repr=False)
class ShearVerdict(Claim, Record):
    """Comparison of claimed shear forces with the state on first loading, as `Claim` explains."""

    one = "force"
    many = "shear forces"
    proved = "statuses"
    kinds: ClassVar[Mapping[str, str]] = {
        "wrongly_sliding": "claimed to slide, proved not to",
        "wrongly_sticking": "claimed to stick, proved to slide",
    }
    claims = ("sliding", "sticking")

    contact: Contact
    forces: Array  # (n,) [force] as claimed
    total_prescribed: float | None
    claimed: NDArray[np.bool_]
    within: float
    certificate: ShearCertificate
    solution: ShearState

    @property
    def values(self) -> Array:
        return self.forces

    @property
    def of(self) -> Scene:
        return self.contact.scene

    @property
    def largest(self) -> float:
        """[force] the largest |claimed force|, or the largest limit f P_i if all claims are 0."""
        return super().largest or float(_limits(self.contact).max())

    @cached_property
    def wrongly_sliding(self) -> Indices:
        """(m,) indices of asperities claimed to slide, but proved to stick in part or be open."""
        return frozen(np.flatnonzero(self.claimed & np.isin(self.status, ("partial", "open"))))

    @cached_property
    def wrongly_sticking(self) -> Indices:
        """(m,) indices of asperities not claimed to slide, but proved to slide."""
        return frozen(np.flatnonzero(~self.claimed & (self.status == "sliding")))

    def hints(self) -> Iterator[str]:
        yield from super().hints()
        limits = _limits(self.contact)
        close = np.abs(self.forces) >= (1.0 - WITHIN) * limits
        by_forces = (self.claimed == claims_sliding(self.contact, self.forces)).all()
        if by_forces and (count := int(close[self.wrongly_sticking].sum())):
            yield (
                f"{count:,} of the shear forces, on asperities proved to slide, are between "
                f"{100 * CLAIMS_SLIDING:g} % and {100 * WITHIN:g} % below f P_i: these asperities "
                "count as claimed to stick, unless a column status says sliding"
            )

    @property
    def errors_alone(self) -> Array:
        """(n,) [force] the error bounds of the certificate."""
        return self.certificate.force_errors

    @property
    def basis(self) -> str:
        return f"indentations increase with the load: {self.certificate.order}"

    def nearby(self) -> tuple[Array, Array]:
        """The shear forces of the solution, and bounds on their errors."""
        return self.solution.forces, self.solution.certificate.force_errors


def verify_shear(
    contact: Contact,
    forces: ArrayLike,
    *,
    force: float,
    within: float = WITHIN,
    sliding: ArrayLike | None = None,
) -> ShearVerdict:
    """The verdict on shear forces (n,) with the prescribed sum `force`.

    sliding : (n,) true where an asperity is claimed to slide; default: `claims_sliding`
    """
    checks.instance("contact", contact, Contact)
    within = tolerance("within", within)
    given = checks.array("forces", forces, length=len(contact.scene))
    state = shear(contact, force=checks.finite("force", force))
    if sliding is None:
        sliding = claims_sliding(contact, given)
    claimed = np.asarray(sliding)
    if claimed.dtype != bool or claimed.shape not in ((), given.shape):
        found = f"shape {claimed.shape} of {claimed.dtype}"
        expected = f"{len(given)} values True or False, one per asperity"
        raise InputError("sliding", found=found, expected=expected)
    proved = state.certificate
    errors = (np.abs(given - state.forces) + proved.force_errors) * (1 + SAFETY)
    limits = _limits(contact)
    left = np.where(state.status == "sliding", NEAR_SLIDING * limits, limits - np.abs(state.forces))
    implied = (errors < left) | (state.status == "open")
    status = np.where(implied, state.status, "undecided")
    return ShearVerdict(
        contact=contact,
        forces=given,
        total_prescribed=float(force),
        claimed=frozen(np.array(np.broadcast_to(claimed, given.shape))),
        within=within,
        certificate=replace(proved, status=frozen(status), force_errors=frozen(errors)),
        solution=state,
    )


def certify_shear(contact: Contact, forces: ArrayLike, *, force: float) -> ShearCertificate:
    """The certificate of given shear forces after monotonic shear.

    forces : (n,) [force] shear forces in the order of the scene's asperities
    force  : [force] the prescribed sum of the shear forces

    `force_errors` are bounds on the differences between the given forces and the exact ones. The
    status is that of the solution if this is "open", or if `force_errors` is below 1 % of the
    friction limit f P_i for "sliding", below f P_i - |Q_i| with the force Q_i of the solution for
    "partial"; else "undecided". The rest of the certificate is that of the solution.

    Raises InputError if the scene has no friction, the force exceeds the friction limit f P, or
    the forces are not finite numbers.

    >>> force = 0.25 * contact.load
    >>> state = cr.shear(contact, force=force)
    >>> cr.certify_shear(contact, state.forces, force=force).all_proved
    True
    """
    return verify_shear(contact, forces, force=force).certificate


def claims_sliding(contact: Contact, forces: Array) -> NDArray[np.bool_]:
    """(n,) true where |force| is at least (1 - 1e-4) f P_i."""
    limits = _limits(contact)
    return np.asarray((limits > 0) & (np.abs(forces) >= (1.0 - CLAIMS_SLIDING) * limits))


def _limits(contact: Contact) -> Array:
    """(n,) [force] f P_i."""
    return np.asarray(
        checks.friction(contact.scene.friction) * contact.cached(FrictionLevels).loads
    )
