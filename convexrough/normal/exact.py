"""The units of a normal problem, and its numbers to about thirty digits.

They follow from the float64 numbers of a scene by few operations on pairs and balls, which bound
the rounding errors.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from convexrough import checks
from convexrough.arithmetic.balls import Ball
from convexrough.arithmetic.pairs import PAIR_ROUNDOFF, Pair, in_parts, square_sum, two_sum
from convexrough.arrays import Array, Indices, taken
from convexrough.errors import InputError
from convexrough.scene.base import Radius, along
from convexrough.scene.scene import Scene

#: 1 / pi to 66 digits.
INVERSE_PI = Fraction("0.318309886183790671537767526745028724068919291480912897495334688118")


@dataclass(frozen=True)
class Units:
    """Units of length and force in which the numbers of a problem are about 1: those of the scene
    times a power of two (length) and a power of eight (force). So scaling rounds neither float64
    numbers nor forces to the power 2/3."""

    length: float  # [length] the scaled unit of length
    force: float  # [force] the scaled unit of force

    @property
    def local(self) -> float:
        """force^(2/3) / length, a power of two: k in scaled units is k times this factor."""
        return 2.0 ** round(math.log2(self.force) * 2 / 3) / self.length

    @classmethod
    def of(cls, approach: float, coefficient: float) -> Units:
        """Units close to `approach` [length] and to the load k^(-3/2) approach^(3/2) of this
        indentation, k = `coefficient`. Raises InputError unless approach is positive and finite."""
        if not 0 < approach < math.inf:
            raise InputError("scene", found=f"indentations of {approach:g}", expected=checks.SIZED)
        length = 2.0 ** round(math.log2(approach))
        return cls(length, 8.0 ** round(math.log2(length / coefficient) / 2.0))


class Data(NamedTuple):
    """The numbers of a problem as balls (numbers with error bounds), in scaled units."""

    coefficients: Ball  # (n,) k, or (1,) if all are equal
    offsets: Ball  # (n,) d
    scale: Ball  # () 1 / (pi E*)

    def at(self, which: Indices) -> Data:
        """The numbers of some asperities."""
        even = self.coefficients.shape == (1,)
        coefficients = self.coefficients if even else self.coefficients[which]
        return Data(coefficients, self.offsets[which], self.scale)


def exact_data(scene: Scene, which: Indices, units: Units, sizes: Array) -> Data:
    """The coefficients, offsets and scale of the asperities `which` of a scene.

    sizes : (n,) bounds on the numbers from which the offsets are computed, in scaled units
    """
    modulus = scene.material.contact_modulus
    constants = scene.sphere_radius, modulus, units.local, units.force / units.length
    asperities = scene.asperities
    tips, heights = (taken(each, which) for each in (asperities.tip_radii, asperities.heights))
    if len(tips) and (tips.strides == (0,) or (tips == tips[:1]).all()):
        k = _even_coefficient(float(tips[0]), *constants)
    else:
        k = _coefficients(tips, *constants)
    offsets = in_parts(
        len(which), lambda some: twofold_offsets(scene, which[some], units, heights[some])
    )
    errors = 2.0**-98 * (np.abs(offsets.high) + sizes)
    return Data(k, Ball.around(offsets, errors), _constants(*constants)[2])


def twofold_offsets(scene: Scene, which: Indices, units: Units, heights: Array) -> Pair:
    """(n,) offsets z - x^2 / (2 Rx) - y^2 / (2 Ry) of the asperities `which`, as pairs.

    heights : (n,) [length] the heights z; (m, n) for m scenes that differ only in heights
    """
    points = scene.asperities.positions.take(which, axis=0)  # 15 times as fast as [which]
    points /= units.length
    further = np.zeros(1)
    if scene.geometry == "closest":
        further = scene.asperities.tip_radii[which] / units.length
    offsets = Pair.exact(heights / units.length)
    for R, axes in scene.curved:
        far = Pair(*two_sum(R / units.length, further))
        offsets = offsets - square_sum(*points[:, axes].T) / (far + far)
    return offsets


@lru_cache
def _constants(base: Radius, modulus: float, local: float, unit: float) -> tuple[Ball, Ball, Ball]:
    """Three balls: the mean curvature of the pressed body; and, scaled by `local` and `unit`, k^3
    of an asperity whose relative curvature is 1, and 1 / (pi E*)."""
    curvature = sum((1 / (2 * Fraction(R)) for R in along(base) if math.inf > R), Fraction(0))
    cubed = Fraction(9, 16) * Fraction(local) ** 3 / Fraction(modulus) ** 2
    scale = INVERSE_PI / Fraction(modulus) * Fraction(unit)
    return Ball.exact(curvature), Ball.exact(cubed), Ball.exact(scale)


def _coefficients(tips: Array, *constants: Any) -> Ball:
    """(n,) the coefficients k of these tip radii.

    The numbers are positive, and two are rounded. So the cube has a relative error of at most four
    PAIR_ROUNDOFF, of which the root has a third, and the root is rounded once more.
    """
    curvature, cubed, _ = _constants(*constants)
    k = ((Pair.exact(1.0) / Pair.exact(tips) + curvature.mid) * cubed.mid).cbrt()
    return Ball.around(k, 3.0 * PAIR_ROUNDOFF * k.high)


@lru_cache
def _even_coefficient(tip: float, *constants: Any) -> Ball:
    """(1,) the coefficient of one tip radius, cached because scenes often share it."""
    return _coefficients(np.array([tip]), *constants)
