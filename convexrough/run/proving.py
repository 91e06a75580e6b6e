"""`run --proof`: a proof of the results of a run."""

from __future__ import annotations

from collections.abc import Sequence

from convexrough.friction.shear import ShearState, shear
from convexrough.proof import Proof
from convexrough.run.stage import Result, limit
from convexrough.run.stages.cycle import CycleResult

#: The proof leaves out shear forces of at least this fraction of the limit, where all slide.
BELOW_LIMIT = 1 - 1e-9


def prove_results(results: Sequence[Result]) -> Proof:
    """The proof of the contact, and of its states at each shear force and each cycle's amplitude.

    Raises InputError for scenes too large for exact arithmetic, ProofError if a proof fails.
    """
    contact = results[0].contact
    found = [each for result in results for each in result.found]
    states = {abs(each.force): each for each in found if isinstance(each, ShearState)}
    for result in results:
        for each in result.found if isinstance(result, CycleResult) else ():
            amplitude = (each.maximum - each.minimum) / 2
            if amplitude not in states:
                states[amplitude] = shear(contact, force=amplitude)
    most = BELOW_LIMIT * limit(contact) if contact.scene.friction else 0.0
    chosen = [states[force] for force in sorted(states) if 0 < force < most]
    return contact.proof(sheared=chosen)
