"""Boxes of loads on which the energy is convex: docs/theory/certificate.md, "Choice of the box".

If contacts are crowded, a box may contain only the loads of the touching asperities, with all other
loads 0: docs/theory/crowded.md. A stack is many problems, one per row (`normal.stack`). Symbols: h
is the local compliance at the upper ends of a box (`NormalProblem.compliance`), H the diagonal
matrix of the h, and A the compliance operator. On the box the Hessian of the energy is at least
mu H, with the margin mu = 1 - `convexity_number`.

In crowded contacts, overlapping shells about the asperities may prove the convexity:
docs/theory/crowded.md, "Shells that overlap", defines their sparse matrix S, with the energy U_ij
of two shells, the lengths t_i = 1 / (pi E* h_i), and the distances r_ij.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal, NamedTuple

import numpy as np
import scipy  # its parts are imported when they are used
from numpy.typing import NDArray

from convexrough.arithmetic.balls import Ball
from convexrough.arithmetic.pairs import Pair
from convexrough.arrays import Array, Indices, even
from convexrough.convex.definite import largest, proved_margin, proved_sparse_margin
from convexrough.convex.newton_step import correct
from convexrough.errors import SolverError
from convexrough.influence.coupling import Influence
from convexrough.normal.problem import NormalProblem, convexity_number
from convexrough.roundoff import ROUNDOFF, SAFETY

Scope = Literal["global", "local", "none"]

# Heuristics: proofs are valid for any of these numbers.

#: Shells are also fitted to the contact radii if the convexity number is above FIT_FROM. In their
#: radii, contact radii have the weight FITTED, and half the distance to the nearest neighbour has
#: 1 - FITTED (docs/theory/certificate.md, "Choice of the box", 3).
FIT_FROM, FITTED = 0.8, 0.9

#: Margins mu with which a Cholesky factorisation is tried; and those on a box of touching
#: asperities, where the energy may be barely convex.
MARGINS, CROWDED_MARGINS = (0.1, 1e-3), tuple((1e-4 * 2.0 ** np.arange(12)).tolist())

#: The upper ends of a box of touching asperities exceed each load by at least LEEWAY times the load
#: plus LEAST_LEEWAY times the largest load.
LEEWAY, LEAST_LEEWAY = 3e-4, 1e-12

#: Number of touching asperities up to which a Cholesky factorisation costs no more than a proof by
#: overlapping shells.
FACTORISED = 1500

#: The radius of an overlapping shell is at first the larger of w t and WIDENED t / (1 - c)^(1/2),
#: where w is one of WIDTHS (the cheapest first), and c is `closest` among the NEAREST neighbours.
#: It is then raised to at least the radius of such a neighbour minus LESS times its distance.
WIDTHS, WIDENED, LESS, NEAREST = (4.0, 8.0), 3.0, 0.5, 8

#: Largest number of pairs of overlapping shells, divided by the number of asperities, for memory.
MOST_PAIRS = 200

#: For shells wider than WIDE times the median, overlaps are searched shell by shell, for speed.
WIDE = 2.0

#: Largest number of asperities for which a proof by overlapping shells is tried. Such a proof needs
#: several eliminations, and one takes 5 s for 100,000 asperities.
MOST_ELIMINATED = 200_000

#: Relative accuracy of the rates in `highest_by_rates`, whose result depends on its square.
RATES = 1e-5


class Box(NamedTuple):
    """A box of loads, and the convexity of the energy on it; for one problem or for a stack."""

    scope: Scope  # "global" if every solution lies in the box
    shells: Array  # (n,) 1 / (pi E* s_i) for shells of radii s_i, which may prove the convexity
    loads: Array  # (n,) upper ends of the box; the lower ends are 0
    compliance: Array  # (n,) h at the upper ends
    convexity_number: Any  # 1 - mu
    faces: Array  # (n,) the proof must show that loads are below these; else infinite
    fixed_open: NDArray[np.bool_]  # (n,) True where assumed open, which the proof must then show

    def at(self, rows: Indices) -> Box:
        """The boxes of some rows of a stack."""
        return Box._make((self.scope, *(each[rows] for each in self[1:])))

    def convexity_at(self, compliance: Array) -> Any:
        """The convexity number that shells prove for a box with this compliance at upper ends."""
        return convexity_number(self.shells, compliance)

    @np.errstate(divide="ignore", invalid="ignore")
    def closed(self, problem: NormalProblem) -> Box:
        """A box that contains this one, to be tried at another load or approach of `problem`: the
        proof must show that all loads are below its upper ends.

        If shells prove the convexity on this box, upper ends above 0 are raised to where they still
        do, so that small loads get upper ends far above their error bounds.
        """
        theta = self.convexity_number
        ends = (2.0 / 3.0 * problem.coefficients * theta / self.shells) ** 3
        shelled = self.convexity_at(self.compliance) <= theta * (1 + 4 * SAFETY)
        wider = shelled & (self.loads > 0) & (ends > self.loads) & np.isfinite(ends)
        loads = np.where(wider, ends, self.loads)
        h = np.where(wider, problem.compliance(loads), self.compliance)
        theta = np.where(shelled, np.maximum(theta, self.convexity_at(h)), theta)
        faces = np.where(loads > 0, loads, np.inf)
        return self._replace(loads=loads, compliance=h, convexity_number=theta, faces=faces)


def widest(problem: NormalProblem, loads: Array, highest: Any) -> Box:
    """The box that contains every solution, and `loads`; for a stack, one box for each row. If its
    convexity number is below 1, the shells of the problem prove the convexity.

    highest : upper bound on the approach at every solution
    """
    corner = np.maximum(problem.bounds(highest), loads)
    h, none = problem.compliance(corner), np.zeros(corner.shape, dtype=bool)
    number, nowhere = convexity_number(problem.shells, h), even(np.inf, *corner.shape)
    return Box("global", problem.shells, corner, h, number, nowhere, none)


def tried(problem: NormalProblem, loads: Array, displacement: Ball) -> Box | None:
    """The global box, which contains every solution, if convexity on it is proved; or else a local
    box, which contains `loads`; or None. `displacement` (n,) is A times `loads`."""
    box = widest(problem, loads, problem.overhang(loads, displacement))
    if not box.convexity_number < 1 and problem.influence.stored:
        if problem.by_load:
            box = widest(problem, loads, highest_by_rates(problem, loads))
        if not box.convexity_number < 1:
            given = problem.influence, box.compliance
            found = (convex_margin(*given, (mu,)) for mu in MARGINS)
            box = box._replace(convexity_number=1.0 - next(filter(None, found), 0.0))
    if box.convexity_number < 1:
        return box
    shells, h = problem.shells, problem.compliance(loads)
    theta = convexity_number(shells, h)
    if theta > FIT_FROM:
        fitted = problem.influence.fitted_shells(problem.radii(h), FITTED)
        if (number := convexity_number(fitted, h)) < theta:
            shells, theta = fitted, number
    if not theta < 1:
        return None
    theta = (1.0 + theta) / 2.0
    # The loads at which the contact radius is theta (pi/2) s_i; there h_i = shell_i / theta.
    faces = (2.0 / 3.0 * problem.coefficients * theta / shells) ** 3
    local = np.minimum(box.loads, faces)
    h, beyond = problem.compliance(local), np.where(faces < box.loads, faces, np.inf)
    return Box("local", shells, local, h, theta, beyond, box.fixed_open)


def highest_by_rates(problem: NormalProblem, loads: Array) -> float:
    """An upper bound on D0 at every solution under a prescribed load; near `loads` (n,) of a
    solution in which loads and indentations increase with the total, hardly above its D0.

    It is (2) of docs/theory/certificate.md with the rates q = dP/dL as weights.
    """
    slopes = 1.0 / problem.compliance(loads)  # 0 where open
    parts = problem.influence, problem.shells, np.sqrt(slopes), np.full(len(loads), -1.0)
    try:
        moved = correct(*parts, balanced=False, tolerance=RATES)
    except SolverError:  # the energy may not be convex there
        return problem.approach_bound
    rates = np.maximum(slopes * moved, 0.0)
    return float(problem.overhang(rates, problem.plain_product(Pair.exact(rates))))


def box_of_touching(
    problem: NormalProblem, loads: Array, touching: NDArray[np.bool_], room: Array
) -> Box | None:
    """A local box for the touching asperities, with all others fixed open; None if convexity on it
    is not proved.

    room : (n,) the upper ends of the box exceed `loads` by at least this
    """
    which = np.flatnonzero(touching)
    influence = problem.influence.restricted(which)
    least = LEEWAY * loads + LEAST_LEEWAY * float(loads.max(initial=0.0))
    box = np.where(touching, loads + np.maximum(least, room), 0.0)
    h = problem.compliance(box)
    own, shells = h[which], np.zeros(len(h))
    shells[which] = influence.fitted_shells(problem.radii(own), FITTED)
    number = convexity_number(shells, h)
    if not number < 1:
        if influence.stored or len(which) <= FACTORISED:
            margin = convex_margin(influence, own, CROWDED_MARGINS)
        else:
            margin = overlapping_margin(influence, influence.scale / own, CROWDED_MARGINS)
        number = 1.0 - margin
    if not number < 1:
        return None
    return Box("local", shells, box, h, number, np.where(touching, box, np.inf), ~touching)


def convex_margin(influence: Influence, compliance: Array, margins: Sequence[float]) -> float:
    """The largest mu of the increasing `margins` for which Cholesky's factorisation proves
    H + A >= mu H,  with the diagonal H of `compliance`; 0 if there is none."""
    root = 1.0 / np.sqrt(compliance)
    scaled = influence.matrix * root * root[:, None]
    error = influence.entry_error + 8 * ROUNDOFF
    return largest(margins, lambda mu: proved_margin(scaled, (mu,), error) > 0)


def crowded(problem: NormalProblem, loads: Array) -> Indices:
    """Indices of loaded asperities that probably prevent a proof of convexity: those of pairs that
    are too close; without such pairs, those whose shells of radius t_i meet another; else all."""
    which = np.flatnonzero(loads)
    influence = problem.influence.restricted(which)
    t = influence.scale / problem.compliance(loads)[which]
    distances, others, closest = nearest(influence.points, t)
    meeting = (t[:, None] + t[others] > distances).any(axis=1)
    for poor in (closest >= 1.0 - CROWDED_MARGINS[0], meeting):
        if poor.any():
            return which[poor]
    return which


def overlapping_margin(influence: Influence, lengths: Array, margins: Sequence[float]) -> float:
    """The largest of `margins` mu for which  H + A >= mu H  is proved by the first shells that
    prove any of them; 0 if there is none. `lengths` (n,) are t_i = 1 / (pi E* h_i)."""
    points = influence.points
    if len(points) > MOST_ELIMINATED:
        return 0.0
    error = 2.0 * influence.entry_error + 32 * ROUNDOFF
    distances, others, closest = nearest(points, lengths)
    if not closest.max(initial=0.0) < 1:
        return 0.0
    for width in WIDTHS:
        radii = np.maximum(width, WIDENED / np.sqrt(1.0 - closest)) * lengths
        covering = (radii[others] - LESS * distances).max(axis=1, initial=0.0)
        radii = np.maximum(radii, covering)
        if (pairs := overlaps(points, lengths, radii)) is None:
            return 0.0
        indices, values, sizes = pairs
        diagonal, errors = 1.0 - lengths / radii, error * sizes
        if (margin := proved_sparse_margin(diagonal, indices, values, margins, errors)) > 0:
            return margin
    return 0.0


def nearest(points: Array, lengths: Array) -> tuple[Array, Indices, Array]:
    """(n, m) distances to the m nearest neighbours, (n, m) indices of these neighbours, and (n,)
    the largest (t_i t_j)^(1/2) / r_ij with one of them, for t = `lengths`."""
    if len(points) < 2:
        none = np.zeros((len(points), 0))
        return none, none.astype(np.intp), np.zeros(len(points))
    found = scipy.spatial.cKDTree(points).query(points, k=min(len(points), NEAREST + 1))
    distances, which = (np.asarray(each)[:, 1:] for each in found)
    closest = (np.sqrt(lengths[:, None] * lengths[which]) / distances).max(axis=1)
    return distances, which, closest


def overlaps(
    points: Array, lengths: Array, radii: Array
) -> tuple[tuple[Indices, Indices], Array, Array] | None:
    """All pairs i, j of asperities whose shells overlap, the entries S_ij, and the numbers
    (t_i t_j)^(1/2) / r_ij; None if there may be too many pairs to store."""
    tree = scipy.spatial.cKDTree(points)
    usual = WIDE * float(np.median(radii)) if len(radii) else 0.0
    wide = np.flatnonzero(radii > usual)  # searched one by one
    reach = radii[wide] + float(radii.max(initial=0.0))
    counts = tree.query_ball_point(points[wide], reach, return_length=True)
    many = tree.count_neighbors(tree, 2.0 * usual) + int(np.sum(counts))
    if many > MOST_PAIRS * len(points):
        return None
    around = tree.query_ball_point(points[wide], reach)
    i = np.repeat(wide, counts)
    j = np.concatenate([np.asarray(each, dtype=np.intp) for each in around] or [wide])
    once = (radii[j] <= usual) | (i < j)
    both = tree.query_pairs(2.0 * usual, output_type="ndarray")
    both = both[(radii[both] <= usual).all(axis=1)]
    i, j = np.concatenate((i[once], both[:, 0])), np.concatenate((j[once], both[:, 1]))
    r = np.hypot(*(points[i] - points[j]).T)
    near = radii[i] + radii[j] > r
    i, j, r = i[near], j[near], r[near]
    large, small = np.maximum(radii[i], radii[j]), np.minimum(radii[i], radii[j])
    # U_ij r_ij: the energy of two shells, divided by that of two points.
    crossing = 1.0 - (large + small - r) ** 2 / (4.0 * large * small)
    energy = np.where(r <= large - small, r / large, crossing)
    sizes = np.sqrt(lengths[i] * lengths[j]) / r
    return (i, j), sizes * (1.0 - energy), sizes
