"""The interface of all elastic couplings of asperities, with bounds on their rounding errors.

A point force at one asperity moves another, at a distance r, by 1 / (pi E* r) (Boussinesq;
equation (3) of the source). The coupling has a zero diagonal: an asperity's own displacement is
Hertz's business.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Literal, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array, Indices
from convexrough.numbers.balls import Ball
from convexrough.numbers.pairs import Pair

#: Relative error of one computed 1 / (pi E* r), in roundoffs, for exact points: differences 1,
#: squares 3, their sum 4, its root 3, then a product with pi and a division.
ENTRY_ROUNDOFFS = 8

#: The ways to couple.
Kind = Literal["dense", "lattice", "scattered"]

#: For given W: from r to about (I + W A W)^-1 r, and about the 2-norm of A W r.
Smoother = Callable[[NDArray[Any]], tuple[NDArray[Any], float]]


class Rounding(NamedTuple):
    """How far a computed product A P can be from the true one, for loads of either sign.

    The error of component i is at most  relative * (A |P|)_i + r_i  with |r_i| <= each  and
    ||r||_2 <= norm: eta, rho_inf and rho_2 of docs/theory/operators.md.
    """

    relative: float
    norm: float
    each: float

    def of(self, displacement: Array) -> Array:
        """Bounds on the errors of all components; `displacement` is A |P| as computed."""
        return self.relative * np.maximum(displacement, 0.0) + 1.01 * self.each

    def negligible(self, displacement: Array) -> float:
        """2-norm of a residual that solvers need not reduce: small beside these bounds.

        By a factor of 10 beside that of sums, which is near the truth, and of 50 beside that of
        transforms, which is some thousand times the truth.
        """
        size = math.sqrt(np.vdot(displacement, displacement))
        return 0.1 * self.relative * size + 0.02 * self.norm


class Coupling(Protocol):
    """A linear map from loads at the asperities to displacements at some points."""

    def apply(self, loads: Array) -> Array:
        """(m,) A P for loads (n,); in float32 where the loads are, if that is faster."""
        ...

    def rounding(self, loads: Array) -> Rounding:
        """Bound on the error of `apply` for these float64 loads."""
        ...

    def falloff(self, strengths: Array, power: int) -> Array:
        """(m,) upper bounds on sum_j strengths_j / r_ij^power, to be a few per cent of it high.

        Higher where the strengths differ by many powers of ten, and the sum is small.

        strengths : (n,) not negative;  power : 2 or 3
        """
        ...


class Influence(Coupling, Protocol):
    """The coupling A among asperities.

    name   : "dense", "lattice" or "scattered"
    points : (n, 2) [length];  scale : 1 / (pi E*) in the problem's units: A_ij = scale / r_ij
    stored : the matrix is stored, so that to use it, or a part of it, costs nothing; else products
        of float32 loads are cheaper than those of float64 loads
    cheap_sums : `sums` cost few products, so that Newton's last step starts from them
    """

    @property
    def name(self) -> Kind: ...
    @property
    def points(self) -> Array: ...
    @property
    def scale(self) -> float: ...
    @property
    def stored(self) -> bool: ...
    @property
    def cheap_sums(self) -> bool: ...

    @property
    def matrix(self) -> Array:
        """(n, n) A itself; computed when asked for, if it fits in memory, unless it is stored."""
        ...

    def submatrix(self, which: Indices) -> Array:
        """(m, m) A among some of the asperities, to be written into."""
        ...

    @property
    def entry_error(self) -> float:
        """Bound on the relative error of each entry of `matrix`."""
        ...

    def __len__(self) -> int: ...

    def restricted(self, which: Indices) -> Influence:
        """The coupling among some of the asperities."""
        ...

    def onto(self, points: Array) -> Coupling:
        """The displacements that these asperities cause elsewhere; 0 from a point to itself."""
        ...

    def slopes(self, loads: Array) -> Array:
        """(n, 2) [1 / length] how A P changes at each asperity as its point is moved.

        -scale sum_j (c_i - c_j) P_j / r_ij^3; nothing is proved of its rounding.
        """
        ...

    def separations(self) -> Array:
        """(n,) [length] lower bounds on the distance of each asperity to its nearest neighbour."""
        ...

    def crowding(self, radii: Array) -> float:
        """The largest (a_i + a_j) / r_ij over all pairs, for contact radii a (n,), 0 where open."""
        ...

    def semidefinite_with(self, radius: float) -> bool:
        """Whether A + (scale / radius) I >= 0 is known, shells of that radius may well overlap.

        From what is known of a lattice; elsewhere False.
        """
        ...

    def sums(self, loads: Pair) -> Ball:
        """(n,) sum_j P_j / r_ij [force / length], with many more digits than `apply`.

        Of the points where they are, as far as that is known.
        """
        ...

    def smoother(self, root: Array) -> Smoother | None:
        """An approximate inverse of I + W A W, W = diag(root), symmetric and positive definite.

        It also says how large A W r is, about: what an error r of a linear system in Newton's
        method leaves of the normal map. None where there is nothing better than the identity.
        """
        ...


def error_reach(coupling: Coupling, scale: float, variances: Array) -> Array:
    """(m,) bounds on sqrt(sum_j A_ij^2 v_j): how far an error of the loads moves each point."""
    return scale * np.sqrt(coupling.falloff(variances, 2))


def known(points: Array, tails: Array | None, point_error: float) -> tuple[Pair, float]:
    """(n, 2) the points, with what they lack if that is given; and a bound on their error."""
    if tails is None:
        return Pair.exact(points), point_error
    return Pair(points, tails), 2.0**-96 * float(np.abs(points).max(initial=0.0))


def squared_distances(
    points: Array, others: Array, tails: tuple[Array, Array] | None = None
) -> Array:
    """(n, m) [length^2] r_ij^2; with what the points and the others lack."""
    squares, y = (np.subtract.outer(points[:, k], others[:, k]) for k in (0, 1))
    if tails is not None:
        squares += np.subtract.outer(tails[0][:, 0], tails[1][:, 0])
        y += np.subtract.outer(tails[0][:, 1], tails[1][:, 1])
    squares *= squares
    y *= y
    squares += y
    return np.asarray(squares)


def inverse_distances(points: Array, others: Array) -> Array:
    """(n, m) [1/length]  1 / r_ij, and 0 where the two points are one."""
    squares = squared_distances(points, others)
    with np.errstate(divide="ignore"):
        inverse: Array = 1.0 / np.sqrt(squares)
    inverse[squares == 0] = 0.0
    return inverse


def cubed(squares: Array) -> Array:
    """1 / r^3 of squared distances, and 0 where two points are one."""
    with np.errstate(divide="ignore"):
        inverse: Array = 1.0 / (squares * np.sqrt(squares))
    inverse[squares == 0] = 0.0
    return inverse
