"""The contact law in float64, with the symbols of `normal.problem`, for one problem or for a stack.

Arrays are (n,) for one problem and (m, n) for a stack, in which quantities with one number per
problem are (m, 1).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from convexrough.arrays import Array, summed
from convexrough.normal.problem import NormalProblem
from convexrough.sphere import hertz

#: An estimate of the squared contact radius of a rough sphere, divided by that of a smooth sphere.
#: The estimate affects speed only.
WIDER = 1.1


class Pressed(NamedTuple):
    """Loads P by Hertz's law at given indentations delta, and the gaps that they leave."""

    own: Array  # k P^(2/3), which is max(delta, 0), scaled if a total load is prescribed
    loads: Array  # P
    displacement: Array  # A P
    gap: Array  # k P^(2/3) + A P - D, the gradient of the energy
    defect: Array  # the residual F of the contact law: the gap where P > 0, elsewhere min(gap, 0)
    #: D0: prescribed, or the value for which a weighted mean of the gaps of loaded asperities is 0
    approach: Any

    @classmethod
    def at(cls, problem: NormalProblem, indentation: Array) -> Pressed:
        """The loads at these indentations, scaled to a prescribed total (one must be positive)."""
        own = np.maximum(indentation, 0.0)
        ratio = own / problem.coefficients
        root = np.sqrt(ratio)
        loads = ratio * root
        if problem.load is not None:
            share = problem.load / summed(loads)
            loads, own = loads * share, own * np.cbrt(share) ** 2
        displacement = problem.apply(loads)
        gap = own + displacement - problem.offsets
        approach = problem.approach
        if approach is None:
            approach = summed(root * gap) / summed(root)
        gap = gap - approach
        defect = np.where(own > 0, gap, np.minimum(gap, 0.0))
        return cls(own, loads, displacement, gap, defect, approach)

    @property
    def unknown(self) -> Array:
        """Indentations of touching asperities; min(-gap, 0) for open ones, whose loads are 0."""
        return np.asarray(self.own + (self.defect - self.gap))

    @property
    def slopes(self) -> Array:
        """The derivatives dP/d(delta); 0 where open."""
        own = self.own
        return np.divide(1.5 * self.loads, own, out=np.zeros(own.shape), where=own > 0)


@np.errstate(all="ignore")
def on_hertz_pressure(problem: NormalProblem) -> Array:
    """Initial indentations D - A P for loads P distributed like the pressure of a sphere.

    P = x^3 s with s = (1 - r^2 / a^2)^(1/2), where r is the distance from the axis and a an
    estimated contact radius. The number x follows from a prescribed load. At a prescribed approach,
    x minimises the energy; the condition is  x^2 sum k s^(5/3) + x^3 s'A s = D's.  If this gives no
    x > 0, then s is 1 at the asperity with the largest offset and 0 at all others.
    """
    load, approach = problem.load, problem.approach
    if approach is None:  # small loads keep their digits if the largest D is 0
        approach = -problem.offsets.max(axis=-1, keepdims=problem.offsets.ndim > 1)
    prescribed = problem.offsets + approach
    inside = 1.0 - problem.squares / (WIDER * smooth_reach(problem))
    s = np.sqrt(np.fmax(inside, 0.0)) + 0.0 * (prescribed + problem.control.value)
    poor = ~(summed(s if load is not None else s * prescribed) > 0)
    if poor.any():
        highest = prescribed == prescribed.max(axis=-1, keepdims=True)
        s = np.where(poor, 1.0 * highest, s)
    displacement, own = problem.apply(s), problem.coefficients * np.cbrt(s) ** 2
    if load is not None:
        cubed = load / summed(s)  # x^3
        needed = np.cbrt(cubed) ** 2 * own + cubed * displacement - prescribed
        risen = summed(np.cbrt(s) * needed) / summed(np.cbrt(s))
        return np.asarray(risen + prescribed - cubed * displacement)
    work, local, coupled = (summed(s * each) for each in (prescribed, own, displacement))
    x = np.sqrt(work / local)
    for _ in range(8):  # Newton's method from the right of the root
        x = x - (x * x * (local + coupled * x) - work) / (x * (2.0 * local + 3.0 * coupled * x))
    return np.asarray(prescribed - np.where(work > 0, x, 0.0) ** 3 * displacement)


def smooth_reach(problem: NormalProblem) -> Any:
    """[length^2] squared contact radius of a smooth body; infinite if the body is flat."""
    scene, units, radius = problem.scene, problem.units, problem.scene.mean_radius
    if radius == np.inf:
        return np.inf
    if problem.approach is not None:
        return radius * np.maximum(problem.approach, 0.0) * units.length
    modulus = scene.material.contact_modulus
    return hertz.contact_radius(problem.load * units.force, modulus, radius) ** 2
