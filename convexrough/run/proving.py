"""`run --proof`: what a run computed, as far as a checker can be shown it."""

from __future__ import annotations

from convexrough.friction.shear import shear
from convexrough.progress import Announce
from convexrough.proof import Proof
from convexrough.run.stages import Findings

#: At friction's limit nothing is left to stick; shear forces nearer to it are left out.
BELOW_LIMIT = 1 - 1e-9


def prove_findings(found: Findings, announce: Announce | None = None) -> Proof:
    """Of the contact, of each shear force and of the amplitude of each cycle.

    Raises InputError for scenes too large for exact arithmetic, ProofError where nothing is proved.
    """
    contact = found.contact
    states = {abs(row.state.force): row.state for row in found.shear}
    for row in found.cycles:
        amplitude = (row.cycle.maximum - row.cycle.minimum) / 2
        if amplitude not in states:
            states[amplitude] = shear(contact, force=amplitude, announce=announce)
    limit = BELOW_LIMIT * (contact.scene.friction or 0.0) * contact.load
    chosen = [states[force] for force in sorted(states) if 0 < force < limit]
    return contact.proof(sheared=chosen, announce=announce)
