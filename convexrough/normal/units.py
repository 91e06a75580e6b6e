"""Scaled units, in which the numbers of normal problems and of friction are about 1."""

from __future__ import annotations

import math
from dataclasses import dataclass

from convexrough.checks import SIZED
from convexrough.errors import InputError


@dataclass(frozen=True)
class Units:
    """Scaled units of length and force: numbers of a problem are about 1 in them.

    They are the units of the scene times powers of two (of eight for the force). So scaling a
    float64 number by them, or a force to the power 2/3, does not round.
    """

    length: float  # [length] the scaled unit of length
    force: float  # [force] the scaled unit of force

    @property
    def local(self) -> float:
        """force^(2/3) / length, a power of two: k in scaled units is k times this factor."""
        return 2.0 ** round(math.log2(self.force) * 2 / 3) / self.length

    @classmethod
    def of(cls, approach: float, coefficient: float) -> Units:
        """Units of the size of `approach` [length] and of the load whose indentation it is.

        coefficient : k of Hertz's law, indentation = k load^(2/3)

        Raises InputError if the approach is not positive and finite.
        """
        if not 0 < approach < math.inf:
            raise InputError("scene", found=f"indentations of {approach:g}", expected=SIZED)
        length = 2.0 ** round(math.log2(approach))
        return cls(length, 8.0 ** round(math.log2(length / coefficient) / 2.0))
