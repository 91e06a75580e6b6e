r"""Proof of order for many asperities: charges at near neighbours bound the rates from below.

docs/theory/states.md, "The proof of order", derives (7) and (8), and compares the weights w_k with
charges on shells, onto which a unit charge at asperity i is swept. For weights that satisfy (7),
1 - q_i is a lower bound on the rate y_i for all C with 0 <= C <= C~, if it is positive for all i on
the support. The shells have the radii R_k = c~_k / (pi E*).

The weights are those for which some moments vanish and which, together with a charge -1 at i, have
the least electrostatic energy. The moments are sums of w_k times functions of z_k, the vector from
i to k as a complex number, divided by the direction from the middle of the support to i. Where such
weights fail, a linear program finds those with the least q_i, for few asperities. For an asperity i
outside the contact one neighbour alone suffices if the whole support is nearer to this neighbour
than to i, and the neighbour's shell does not reach i.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np
import scipy  # its parts are imported when they are used
from numpy.typing import NDArray

from convexrough import threads
from convexrough.arrays import Array, Indices
from convexrough.influence.coupling import Influence
from convexrough.roundoff import ROUNDOFF

Moments = Callable[[NDArray[np.complex128]], list[Array]]


def around(d: NDArray[np.complex128]) -> list[Array]:
    """The moments that are 0 where neighbours lie all around; (8) then proves (7) for far ones."""
    return [d.real, d.imag, (d * d).real, (d * d).imag]


def edge(d: NDArray[np.complex128]) -> list[Array]:
    """The moments that are 0 at an edge: along it, and of second order towards the middle."""
    return [d.imag, np.abs(d) ** 2 - 3.0 * d.real**2]


def corner(d: NDArray[np.complex128]) -> list[Array]:
    """The moment that is 0 at a corner of the contact."""
    return [d.imag]


#: Numbers of neighbours, and moments of the weights; None for weights by a linear program. They are
#: tried until the bound 1 - q_i suffices. A try also uses the asperities that determined q_i in
#: earlier tries.
TRIES: tuple[tuple[int, Moments | None], ...] = (
    (12, around), (10, edge), (18, around), (14, corner), (18, edge), (32, around), (32, edge),
    (60, around), (60, edge), *3 * ((60, None),),
)  # fmt: skip

MORE, FEW = 32, 300  # more than MORE neighbours are tried only if at most FEW asperities remain
SAMPLE = 300  # the linear program considers about twice as many asperities
ALONE = 6  # neighbours of an asperity outside the contact that are tried, each alone
NEAR = 8  # where (8) proves (7) far away, (7) is computed for NEAR times as many as have weights
SEARCHES = 15  # systems solved for weights; each leaves out earlier neighbours of negative weight
ROWS, NUMBERS = 2**14, 2**18  # asperities treated together, and float64 numbers in an array


def swept_rates(influence: Influence, c: Array, rates: Array, spare: Array) -> Array:
    """(n,) lower bounds on the rates for 0 <= C <= C~; all -inf if one on the support is not > 0.

    c     : (n,) diagonal of C~, 0 where open
    rates : (n,) lower bounds known before, from row sums of A C~
    spare : (n,) at an open asperity, a bound above -spare is not improved further
    """
    support, others = np.flatnonzero(c > 0), np.flatnonzero(c == 0)
    if len(support) < 2:
        return rates
    rates, least = rates.copy(), np.where(c > 0, 0.0, -spare)
    swept = _Swept(influence, support, influence.scale * c)
    others = others[~(rates[others] > least[others])]
    rates[others] = swept.outside(others)
    for group in (support, others):
        left = group[~(rates[group] > least[group])]
        for some in threads.chunks(len(left), ROWS):
            swept.improve(rates, left[some], least)
        if not (rates[support] > 0).all():
            return np.full(len(rates), -np.inf)
    return rates


def _in_parts(make: Callable[..., Array], cost: int, *rows: NDArray[Any]) -> Array:
    """make(*rows), computed in threads; each row needs `cost` numbers, each part about NUMBERS."""
    found, some = dict[int, Array](), max(1, NUMBERS // cost)

    def compute(k: int) -> None:
        found[k] = make(*(each[k : k + some] for each in rows))

    parts = range(0, max(1, len(rows[0])), some)  # at least one part, even if `rows` are empty
    threads.each(compute, parts, min(threads.cores(), len(parts)))
    return np.concatenate([found[k] for k in parts])


@dataclass(frozen=True, eq=False)
class _Swept:
    """Sweeping of unit charges at asperities onto shells around neighbours, as in (7)."""

    influence: Influence
    support: Indices
    shells: Array  # (n,) radii R_k; 0 off the support

    @cached_property
    def places(self) -> NDArray[np.complex128]:
        """(n,) the points as complex numbers, relative to the middle of all points."""
        x, y = self.influence.points.T
        return np.asarray((x - (x.min() + x.max()) / 2) + 1j * (y - (y.min() + y.max()) / 2))

    @cached_property
    def plane(self) -> Array:
        """(2, n) the same points as real coordinates."""
        return np.stack((self.places.real, self.places.imag))

    @cached_property
    def middle(self) -> np.complex128:
        """The mean of the points on the support."""
        return np.complex128(self.places[self.support].mean())

    @cached_property
    def hull(self) -> NDArray[np.complex128]:
        """Points whose convex hull contains the support, up to 1e-9 of `extent`."""
        points = self.places[self.support]
        try:
            return np.asarray(points[scipy.spatial.ConvexHull(self.plane.T[self.support]).vertices])
        except scipy.spatial.QhullError:  # all on a line
            return np.asarray(points)

    @cached_property
    def extent(self) -> float:
        """An upper bound on the distance of any two points."""
        return 2.01 * float(np.abs(self.places).max())

    @cached_property
    def lost(self) -> float:
        """Bound on the relative rounding error of (7)."""
        moved = ROUNDOFF * self.extent / float(self.influence.separations().min())
        return 8 * (self.influence.entry_error + moved) + 128 * ROUNDOFF

    @cached_property
    def _tree(self) -> Any:
        return scipy.spatial.cKDTree(self.influence.points[self.support])

    def neighbours(self, which: Indices, count: int) -> Indices:
        """(m, count) the nearest asperities on the support to each asperity, without itself."""
        count = min(count, len(self.support) - 1)
        workers = threads.worthwhile(len(which) * count)
        _, found = self._tree.query(self.influence.points[which], count + 1, workers=workers)
        nearest = self.support[found]  # an asperity itself comes first, at the distance 0
        own = nearest[:, :1] == which[:, None]
        return np.asarray(np.where(own, nearest[:, 1:], nearest[:, :-1]))

    def apart(self, some: Indices, others: Indices, themselves: Array | float = np.inf) -> Array:
        """Distances of asperities; from an asperity to itself, `themselves`."""
        found, along_y = (axis[some] - axis[others] for axis in self.plane)
        found *= found
        found += along_y * along_y
        np.sqrt(found, out=found)
        np.copyto(found, themselves, where=some == others)
        return np.asarray(found)

    def potentials(self, charges: Indices, places: Indices) -> Array:
        """Potentials of unit charges at places; at a charge itself, the potential of its shell."""
        return np.asarray(1.0 / self.apart(charges, places, self.shells[charges]))

    def outside(self, which: Indices) -> Array:
        """(m,) lower bounds on rates by sweeping onto one neighbour; -inf where that fails."""
        near, here = self.neighbours(which, ALONE), self.places[which][:, None]
        away, middle = self.places[near] - here, (self.places[near] + here) / 2
        nearer = np.full(near.shape, np.inf)
        for corner in self.hull:
            nearer = np.minimum(nearer, (away.conj() * (corner - middle)).real)
        clear = self.shells[near] < (1 - 2 * self.lost) * np.abs(away)
        enough = (2 * self.lost * self.extent + 1e-9 * np.abs(away)) * self.extent
        found = (clear & (nearer > enough)).any(axis=1)
        return np.where(found, self.lost / 2, -np.inf)

    def improve(self, rates: Array, which: Indices, least: Array) -> None:
        """Increase the bounds `rates` (n,) of asperities, try by try, until they exceed `least`."""
        worst = np.empty((len(which), 0), dtype=np.intp)
        for count, moments in TRIES:
            if len(which) == 0 or (count > MORE and len(which) > FEW):
                break
            width = count + worst.shape[1]
            seen = self.neighbours(which, NEAR * width)
            near = np.column_stack((seen[:, :count], worst))
            if moments is None:
                weights = self.lightest(which, near)
            else:
                make = partial(self.weights, moments)
                weights = _in_parts(make, (width + 5) ** 2, which, near)
            rates[which], failed = self.rates(which, near, weights, seen, least[which])
            todo = ~(rates[which] > least[which])
            which, worst = which[todo], np.column_stack((worst, failed))[todo]

    def rates(
        self, which: Indices, near: Indices, weights: Array, seen: Indices, least: Array
    ) -> tuple[Array, Indices]:
        """(m,) lower bounds 1 - q_i, and the k that determine q_i; -inf if there are no weights, or
        where, without (8), near asperities show that the bound is not above `least` (m,).
        """
        stretched, every = 1.0 + self.lost, np.arange(len(which))
        ratios = _in_parts(self._ratios, near.shape[1] * seen.shape[1], which, near, weights, seen)
        k = ratios.argmin(axis=1)
        q, worst = 1.0 / np.maximum(ratios[every, k], 1e-300), seen[every, k]
        gains = self.gains(which, near, weights, seen[:, -1])
        left = weights.any(axis=1) & (gains == 0) & (1.0 - stretched * q > least)
        q = np.where(gains > 0, np.maximum(q, 1.0 / (1.0 + gains)), np.inf)
        q[left], worst[left] = self._everywhere(which[left], near[left], weights[left])
        return 1.0 - stretched * q, worst

    def weights(self, moments: Moments, which: Indices, near: Indices) -> Array:
        """(m, s) weights of least energy of the neighbours `near`; 0 where none are found."""
        (m, s), here = near.shape, self.places[which]
        outwards = np.where(here == self.middle, 1.0, here - self.middle)
        away = (self.places[near] - here[:, None]) / (outwards / np.abs(outwards))[:, None]
        least = np.abs(away).min(axis=1)[:, None]
        sums = np.stack([np.ones((m, s)), *moments(away / least)], axis=1)
        size = np.abs(sums).max(axis=2, keepdims=True)
        sums = np.where(size > 1e-9, sums, 0.0) / np.maximum(size, 1e-9)  # less is rounding
        rows = sums.shape[1]
        coupled = self.potentials(near[:, :, None], near[:, None, :]) * least[:, :, None]
        target = np.zeros((m, s + rows))
        target[:, :s], target[:, s] = least / np.abs(away), 1.0
        first = (near[:, :, None] == near[:, None, :]).argmax(axis=2)
        kept, weights, todo = first == np.arange(s), np.zeros((m, s)), np.arange(m)
        for _ in range(SEARCHES):
            used = np.pad(kept[todo].astype(float), ((0, 0), (0, rows)), constant_values=1.0)
            system = np.zeros((len(todo), s + rows, s + rows))
            system[:, :s, :s], system[:, s:, :s] = coupled[todo], sums[todo]
            system[:, :s, s:] = sums[todo].mT
            system *= used[:, :, None] * used[:, None, :]
            dropped = 1.0 - used
            dropped[:, s:] = -1e-13  # not singular if moments depend on each other
            system[:, range(s + rows), range(s + rows)] += dropped
            try:
                found = np.linalg.solve(system, (target[todo] * used)[:, :, None])[:, :s, 0]
            except np.linalg.LinAlgError:  # possible if shells overlap; weights remain 0
                break
            fits = (found >= 0).all(axis=1)
            weights[todo[fits]] = found[fits]
            kept[todo] &= found >= 0
            todo = todo[~fits]
            if len(todo) == 0:
                break
        off = np.abs((sums @ weights[:, :, None])[:, :, 0] - target[:, s:]).max(axis=1)
        weights[off > 1e-9] = 0.0
        return np.asarray(weights / np.maximum(weights.sum(axis=1, keepdims=True), 1e-300))

    def lightest(self, which: Indices, near: Indices) -> Array:
        """(m, s) weights of the neighbours `near` with the least q_i at a sample of asperities."""
        weights = np.zeros(near.shape)
        sample = self.support[:: -(-len(self.support) // SAMPLE)]
        for k, closest in enumerate(self.neighbours(which, SAMPLE)):
            i = which[k : k + 1]
            seen = np.setdiff1d(np.concatenate((near[k], closest, sample)), i)
            ratios = self.potentials(near[k][:, None], seen) * self.apart(i, seen)
            found = scipy.optimize.linprog(np.ones(len(near[k])), -ratios.T, -np.ones(len(seen)))
            if found.status == 0 and found.x is not None:
                own = np.maximum(found.x, 0.0)  # solvers return some below 0
                weights[k] = own / own.sum()
        return weights

    def _ratios(self, which: Indices, near: Indices, weights: Array, seen: Indices) -> Array:
        """(m, k) sum_j w_j A_jk (with the shell's potential if j = k) over A_ik for k in `seen`."""
        swept = np.einsum("is,isk->ik", weights, self.potentials(near[:, :, None], seen[:, None]))
        return np.asarray(swept * self.apart(which[:, None], seen))

    def gains(self, which: Indices, near: Indices, weights: Array, last: Indices) -> Array:
        """(m,) g > 0 for which, by (8), q_i = 1 / (1 + g) satisfies (7) for all k at least as far
        from i as the asperity `last`; 0 where (8) proves nothing.
        """
        d = self.places[near] - self.places[which][:, None]
        apart = np.where(weights > 0, np.abs(d), 0.0)
        r = np.abs(self.places[last] - self.places[which]) * (1 - self.lost)

        def total(values: NDArray[Any]) -> Array:
            return np.asarray(np.abs((weights * values).sum(axis=1)))

        square, first = total(apart**2), total(d) + self.lost * total(apart)
        third = 3 / 8 * total(apart**2 * d) + 5 / 8 * total(d**3)
        with np.errstate(divide="ignore"):
            rest = total(apart**4 / np.maximum(r[:, None] - apart, 0.0))
        kappa = square / 4 - 3 / 4 * total(d**2) - first * self.extent - (third + rest) / r
        # Where kappa > square / 64, kappa / 2 is far larger than its rounding error.
        return np.where(kappa > square / 64, kappa / 2 / self.extent**2, 0.0)

    def _everywhere(self, which: Indices, near: Indices, weights: Array) -> tuple[Array, Indices]:
        """(m,) the least q_i of (7) for the whole support, and the k that determine it."""
        charged, columns = np.unique(near, return_inverse=True)
        starts, shape = np.arange(len(which) + 1) * near.shape[1], (len(which), len(charged))
        charges = scipy.sparse.csr_array((weights.ravel(), columns.ravel(), starts), shape=shape)
        least, worst = np.full(len(which), np.inf), which.copy()
        parts = 1 + (len(charged) + len(which)) * len(self.support) // NUMBERS
        for seen in np.array_split(self.support, parts) if len(which) else ():
            ratios = charges @ self.potentials(charged[:, None], seen)
            ratios *= self.apart(which[:, None], seen)
            k = ratios.argmin(axis=1)
            worst = np.where(ratios.min(axis=1) < least, seen[k], worst)
            least = np.minimum(least, ratios.min(axis=1))
        return 1.0 / least, worst
