"""What a gradient was made from: an adjoint, of a contact, in units that a scene understands."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from convexrough import checks
from convexrough.arrays import Array, Indices, frozen
from convexrough.contact import Contact
from convexrough.errors import InputError
from convexrough.gradients.adjoint import Adjoint, Holding
from convexrough.gradients.doubts import Doubt
from convexrough.gradients.system import Solution
from convexrough.influence import Influence
from convexrough.influence.choice import couple
from convexrough.record import Record
from convexrough.shearing.problem import TangentialProblem

#: Least force but 0 over f P: squares of its third power, and of their rounding, are in float64.
SLIGHTEST = 1e-40


@dataclass(frozen=True, eq=False, repr=False)
class Origin(Record):
    """dJ = offsets'dd + local'd log k + sum over pairs left'dA right + prescribed d(P or D0).

    J, lengths and the load are in the scene's units, A in the problem's own. Arrays are (n,), of
    the asperities at `places` in the scene; left and right are (m, n).

    pressing : of the pressed state, with sum lambda = total where the load is held
    doubts   : about the weights on loads that it was solved for; None where nothing is known
    mixed    : of more than one J, each times a number
    rounding : (n,) bounds on what those numbers being off does to dJ/dd
    """

    contact: Contact
    places: Indices
    offsets: Array
    local: Array
    left: Array
    right: Array
    prescribed: float
    pressing: Solution
    total: float | None
    doubts: tuple[Doubt, ...] | None
    mixed: bool = False
    rounding: Array | float = 0.0

    @classmethod
    def of(
        cls,
        contact: Contact,
        adjoint: Adjoint,
        holding: Holding,
        *,
        doubts: Sequence[Doubt] | None = (),
        approach: float = 0.0,
        places: Indices | None = None,
    ) -> Origin:
        """doubts : about weights on loads;  approach : the weight on it

        places : of the arrays of the adjoint; default the loaded asperities
        """
        problem = pressed(contact)
        units = problem.units
        return cls(
            contact=contact,
            places=frozen(problem.touching.copy() if places is None else places),
            offsets=frozen(adjoint.offsets / units.length),
            local=frozen(adjoint.local),
            left=frozen(np.stack([pair.left for pair in adjoint.pairs])),
            right=frozen(np.stack([pair.right for pair in adjoint.pairs])),
            prescribed=adjoint.prescribed / (units.force if holding == "load" else units.length),
            pressing=adjoint.solution,
            total=-approach if holding == "load" else None,
            doubts=None if doubts is None else tuple(doubts),
        )

    def combined(
        self, own: float, doubt: float, factor: float = 0.0, other: Origin | None = None
    ) -> Origin:
        """Of J times a number, and another J, whose weights are exact, times another.

        doubt : bound on what either number is off, over that number
        """
        one, two = self.pressing, self.pressing if other is None else other.pressing
        doubts = self.doubts
        if doubts is not None:
            doubts = tuple(replace(each, factor=own * each.factor) for each in doubts)
        far = self if other is None else other  # with a factor of 0
        sizes = np.abs(own * self.offsets) + np.abs(factor * far.offsets)
        off = np.multiply(doubt, sizes, where=sizes > 0, out=np.zeros(len(sizes)))
        return replace(
            self,
            offsets=frozen(own * self.offsets + factor * far.offsets),
            local=frozen(own * self.local + factor * far.local),
            left=frozen(np.concatenate((own * self.left, factor * far.left))),
            right=frozen(np.concatenate((self.right, far.right))),
            prescribed=own * self.prescribed + factor * far.prescribed,
            pressing=Solution(
                own * one.values + factor * two.values,
                own * one.shift + factor * two.shift,
                np.abs(own * one.defect) + np.abs(factor * two.defect),
            ),
            doubts=doubts,
            mixed=self.mixed or other is not None,
            rounding=frozen(abs(own) * self.rounding + off),
        )

    @cached_property
    def influence(self) -> Influence:
        """A."""
        problem = pressed(self.contact)
        if len(self.places) == len(problem):
            return problem.influence
        return couple(
            self.contact.scene, self.places, problem.influence.scale, self.contact.influence
        )

    @cached_property
    def turning(self) -> Array:
        """(n, 2) [1 / length] dJ/dc through the coupling, c the contact points: G."""
        slopes, total = self.influence.slopes, np.zeros((len(self.places), 2))
        for left, right in zip(self.left, self.right, strict=True):
            total += left[:, None] * slopes(right) + right[:, None] * slopes(left)
        return total

    @cached_property
    def coupled(self) -> tuple[float, float]:
        """The sum over pairs of left'A right, and the sum of the sizes of its terms."""
        each = zip(self.left, self.right, strict=True)
        terms = [left * self.influence.apply(right) for left, right in each]
        return sum(float(t.sum()) for t in terms), sum(float(np.abs(t).sum()) for t in terms)


def held(contact: Contact, holding: Holding | None) -> Holding:
    """What is held, checked; default what was prescribed."""
    checks.instance("contact", contact, Contact)
    if holding is None:
        return "approach" if contact.prescribed_load is None else "load"
    if holding not in ("load", "approach"):
        raise InputError("holding", found=repr(holding), expected='"load" or "approach"')
    return holding


def pressed(contact: Contact) -> TangentialProblem:
    """The loaded asperities of a contact, of which there must be some."""
    if contact.load == 0.0:
        expected = "a contact that carries some load: without, nothing has a derivative"
        raise InputError("contact", found="no load", expected=expected)
    return TangentialProblem.pressed(contact)


def felt(problem: TangentialProblem, what: str, totals: Array) -> None:
    """InputError for forces, as T in own units, that are so small that bounds would vanish."""
    parts = totals[totals > 0] / problem.limit
    if (parts < SLIGHTEST).any():
        found, expected = (
            f"{parts.min():.3g} f P",
            f"0, or at least {SLIGHTEST:g} f P, in gradients",
        )
        raise InputError(what, found=found, expected=expected)


def far_radii(contact: Contact, places: Indices) -> Array:
    """(n,) [length] with a drop of r^2 / (2 far): R, or R + rho in the geometry "closest"."""
    scene, rho = contact.scene, contact.scene.asperities.tip_radii[places]
    R = scene.sphere_radius
    return R + rho if scene.geometry == "closest" else np.full(len(rho), R)
