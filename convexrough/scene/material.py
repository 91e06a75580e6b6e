"""What both bodies are made of."""

from __future__ import annotations

from dataclasses import dataclass

from convexrough import checks
from convexrough.errors import InputError


@dataclass(frozen=True, init=False)
class Material:
    """Two elastically similar bodies.

    contact_modulus : E* = E / (2 (1 - nu^2))  [force / length^2]
    poisson_ratio   : nu, from 0 to 0.5
    hardness        : the mean pressure at which asperities yield [force / length^2], if known:
        nothing is computed from it, a contact beyond it is warned of

    >>> steel = cr.Material.from_youngs(210e9, 0.3)
    >>> print(f"{steel.contact_modulus:.4g}")
    1.154e+11
    """

    contact_modulus: float
    poisson_ratio: float
    hardness: float | None

    def __init__(
        self,
        contact_modulus: float | None = None,
        poisson_ratio: float | None = None,
        hardness: float | None = None,
        *,
        youngs_modulus: None = None,
    ) -> None:
        if youngs_modulus is not None:
            expected = "a contact_modulus; Material.from_youngs(modulus, poisson_ratio) converts"
            raise InputError("youngs_modulus", found=youngs_modulus, expected=expected)
        for name, value in (
            ("contact_modulus", checks.positive("contact_modulus", contact_modulus)),
            ("poisson_ratio", checks.between("poisson_ratio", poisson_ratio, 0.0, 0.5)),
            ("hardness", None if hardness is None else checks.positive("hardness", hardness)),
        ):
            object.__setattr__(self, name, value)

    @classmethod
    def from_youngs(
        cls, modulus: float, poisson_ratio: float, hardness: float | None = None
    ) -> Material:
        """Both bodies of Young's modulus E: E* = E / (2 (1 - nu^2))."""
        modulus = checks.positive("youngs_modulus", modulus)
        ratio = checks.between("poisson_ratio", poisson_ratio, 0.0, 0.5)
        return cls(modulus / (2.0 * (1.0 - ratio**2)), ratio, hardness)

    @property
    def youngs_modulus(self) -> float:
        """E = 2 (1 - nu^2) E*  [force / length^2]."""
        return 2.0 * (1.0 - self.poisson_ratio**2) * self.contact_modulus

    @property
    def shear_modulus(self) -> float:
        """G = E / (2 (1 + nu)) = (1 - nu) E*  [force / length^2]."""
        return (1.0 - self.poisson_ratio) * self.contact_modulus
