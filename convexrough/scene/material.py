"""The material of both bodies."""

from __future__ import annotations

from dataclasses import dataclass, field

from convexrough import checks
from convexrough.errors import InputError


@dataclass(frozen=True)
class Material:
    """The elastic constants of both bodies; `pair` combines two different materials.

    contact_modulus : [force / length^2] E*, where 1 / E* = (1 - nu_1^2) / E_1 + (1 - nu_2^2) / E_2
        with the Young's moduli E and Poisson's ratios nu of bodies 1 and 2
    poisson_ratio   : nu, from 0 to 0.5. For a pair it is the mean, weighted by 1 / G with the shear
        moduli G
    hardness        : [force / length^2] mean pressure at which asperities yield; None if unknown.
        The value is used only for a warning
    mismatch        : Dundurs' beta of a pair, 0 for equal materials. It measures the coupling of
        normal and tangential displacements, which the package neglects

    Raises InputError for values out of range. Source: Johnson, Contact Mechanics (1985),
    4.2 and 5.4; docs/theory/bodies.md.

    >>> steel = cr.Material.from_youngs(210e9, 0.3)
    >>> print(f"{steel.contact_modulus:.4g}")
    1.154e+11
    """

    contact_modulus: float
    poisson_ratio: float
    hardness: float | None = None
    mismatch: float = field(default=0.0, kw_only=True)

    def __post_init__(self) -> None:
        self.__dict__.update(
            contact_modulus=checks.positive("contact_modulus", self.contact_modulus),
            poisson_ratio=checks.between("poisson_ratio", self.poisson_ratio, 0.0, 0.5),
            mismatch=checks.between("mismatch", self.mismatch, -0.5, 0.5),
        )
        if self.hardness is not None:
            self.__dict__.update(hardness=checks.positive("hardness", self.hardness))

    @classmethod
    def from_youngs(
        cls, modulus: float, poisson_ratio: float, hardness: float | None = None
    ) -> Material:
        """The material of bodies with the same elastic constants; E* = E / (2 (1 - nu^2)).

        modulus : [force / length^2] Young's modulus E;  hardness : as in `Material`

        Raises InputError for bad values.
        """
        modulus = checks.positive("youngs_modulus", modulus)
        ratio = checks.between("poisson_ratio", poisson_ratio, 0.0, 0.5)
        return cls(modulus / (2.0 * (1.0 - ratio**2)), ratio, hardness)

    @classmethod
    def pair(cls, sphere: Material, base: Material) -> Material:
        """The material of two bodies of different materials.

        sphere, base : materials of the sphere (or another pressed body) and of the body with the
            asperities, as `from_youngs` returns them

        Normal and tangential compliances are those of two equal bodies with
        2 / G = 1 / G_1 + 1 / G_2 and nu = (nu_1 / G_1 + nu_2 / G_2) G / 2, without the coupling by
        Dundurs' beta (docs/theory/bodies.md). The hardness is the smaller one of those given.
        Raises InputError if one of the two materials is itself a pair with a nonzero beta.

        >>> steel = cr.Material.from_youngs(210e9, 0.3)
        >>> both = cr.Material.pair(steel, base=cr.Material.from_youngs(70e9, 0.33))
        >>> print(f"{both.contact_modulus:.4g} {both.poisson_ratio:.4g} {both.mismatch:.3f}")
        5.861e+10 0.3226 -0.117
        """
        for what, body in (("sphere", sphere), ("base", base)):
            checks.instance(what, body, Material)
            if body.mismatch:
                raise InputError(what, found="a pair", expected="one body, as from_youngs makes it")
        (G, nu), (H, mu) = ((each.shear_modulus, each.poisson_ratio) for each in (sphere, base))
        softer = [body.hardness for body in (sphere, base) if body.hardness is not None]
        modulus, other = sphere.contact_modulus, base.contact_modulus
        part = G / (G + H)  # (1 / H) / (1 / G + 1 / H)
        coupled = ((1.0 - part) * (1.0 - 2.0 * nu) - part * (1.0 - 2.0 * mu)) / 2.0
        return cls(
            modulus * (2.0 * other / (modulus + other)),  # exact for equal materials
            nu + part * (mu - nu),
            min(softer, default=None),
            mismatch=coupled / ((1.0 - part) * (1.0 - nu) + part * (1.0 - mu)),
        )

    @property
    def youngs_modulus(self) -> float:
        """[force / length^2] E = 2 (1 - nu^2) E* of two equal bodies with this E* and nu."""
        return 2.0 * (1.0 - self.poisson_ratio**2) * self.contact_modulus

    @property
    def shear_modulus(self) -> float:
        """[force / length^2] G = (1 - nu) E* of two equal bodies with this E* and nu.

        For a pair, 2 / G = 1 / G_1 + 1 / G_2.
        """
        return (1.0 - self.poisson_ratio) * self.contact_modulus
