"""What is proved of a friction state, in the scene's units and order."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array, among_zeros, frozen
from convexrough.normal.certificate import Certificate
from convexrough.normal.judgement import Scope
from convexrough.shearing.judgement import Bounds
from convexrough.shearing.problem import TangentialProblem


@dataclass(frozen=True, eq=False)
class ShearCertificate:
    """What is proved of a friction state. Arrays are (n,), in the caller's order.

    scope : that of the contact it starts from, or "none" where nothing is proved
    status : "sliding" (proved to slide as a whole), "partial" (proved to keep a stick disc),
        "open" (proved to carry no load) or "undecided"
    force_errors : [force];  slip_errors : [length] bounds on the distance to the solution
    displacement_error : [length] likewise
    """

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
