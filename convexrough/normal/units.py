"""Scaled units, in which the numbers of normal problems and of friction are about 1."""

from __future__ import annotations

import math
from dataclasses import dataclass

from convexrough.checks import SIZED
from convexrough.errors import InputError


@dataclass(frozen=True)
class Units:
    """Scaled units of length and force: numbers of a problem are about 1 in them.

    They are the units of the scene times powers of two (for force, of eight), so that scaling a
    float64 number, or its 2/3 power, is exact.
    """

    length: float  # [length] of approach
    force: float  # [force]

    @property
    def local(self) -> float:
        """The factor force^(2/3) / length of a local coefficient k, a power of two."""
        return 2.0 ** round(math.log2(self.force) * 2 / 3) / self.length

    @classmethod
    def of(cls, approach: float, coefficient: float) -> Units:
        """Units for an approach [length] and a local coefficient k; InputError if out of range."""
        if not 0 < approach < math.inf:
            raise InputError("scene", found=f"indentations of {approach:g}", expected=SIZED)
        length = 2.0 ** round(math.log2(approach))
        return cls(length, 8.0 ** round(math.log2(length / coefficient) / 2.0))
