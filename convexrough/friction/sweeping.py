r"""Proof of order for many asperities: charges at near neighbours bound the rates from below.

docs/theory/states.md, "The proof of order", derives (6), defines its symbols, and compares the
weights w_k with charges on shells, onto which a unit charge at asperity i is swept. For weights
that satisfy (6), 1 - q_i is a lower bound on the rate y_i for all C with 0 <= C <= C~, if it is
positive for all i on the support. The shells have the radii R_k = scale C~_k with
scale = 1 / (pi E*).

There are three ways to find weights:

- Where neighbours are all around i: weights of least energy whose first and second moments vanish:
  sum w_k d_k = sum w_k d_k^2 = 0, where the complex number d_k is the vector from i to k.
- At an edge of the contact: a barrier method. It minimises the sum of the weights under (6) with
  q_i = 1, at near asperities and at a sample of all others. Then the weights are scaled to the
  sum 1.
- Outside the contact: one neighbour alone, if the whole support is nearer to this neighbour than to
  i.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array, Indices
from convexrough.influence.coupling import Influence
from convexrough.roundoff import ROUNDOFF

# All numbers here are heuristics.

#: NEIGHBOURS: number of neighbours for weights of least energy. MORE: number for each search for
#: weights of least total. A search adds the constraint that the last result violated most.
NEIGHBOURS, MORE = 14, (32,) * 5 + (80,) * 5

#: Weights of least total are constrained at the NEAR nearest asperities and at about SAMPLE others.
#: CENTRED is a factor in the estimate of how far the total is above the least one.
NEAR, SAMPLE, CENTRED = 60, 100, 3.0

#: Largest number of Newton steps for weights of least total, and the estimated excess of the total
#: at which the steps end.
STEPS, LEAST = 40, 1e-8

#: Largest number of searches for weights of least energy; each drops the neighbours whose weights
#: are negative.
SEARCHES = 8

#: DIRECTIONS: number of directions in which the extent of the support is computed. NUMBERS: about
#: the number of float64 numbers that are in memory at once.
DIRECTIONS, NUMBERS = 256, 2**20


def swept_rates(influence: Influence, c: Array, spare: Array, most: int) -> Array:
    """(n,) lower bounds on the rates y(C) for all diagonal C with 0 <= C <= C~.

    All bounds are -inf if a bound on the support is not positive, or if the support has fewer than
    two asperities (then row sums of A C~ suffice for a proof).

    c     : (n,) diagonal of C~, 0 where open
    spare : (n,) at an open asperity, a bound above -spare is not improved further
    most  : largest number of asperities for which weights of least total are sought
    """
    support, others = np.flatnonzero(c > 0), np.flatnonzero(c == 0)
    rates = np.full(len(c), -np.inf)
    if len(support) < 2:
        return rates
    swept, least = _Swept(influence, support, influence.scale * c), np.where(c > 0, 0.0, -spare)
    rates[others] = swept.outside(others)

    def unsettled(which: Indices) -> NDArray[np.bool_]:
        return ~(rates[which] > least[which])

    for group in (support, others):
        left = group[unsettled(group)]
        rates[left], worst = swept.rates(left, *swept.lightest(left))
        looked = np.empty((len(left), 0), dtype=np.intp)
        for count in MORE:
            failed = unsettled(left)
            left, looked = left[failed], np.column_stack((looked, worst))[failed]
            if not 0 < len(left) <= most:
                break
            rates[left], worst = swept.rates(left, *swept.tightest(left, count, looked))
        if not (rates[support] > 0).all():
            return np.full(len(c), -np.inf)
    return rates


def _in_parts(make: Callable[..., Array], cost: int, *rows: Indices) -> Array:
    """make(*rows), computed in parts of about NUMBERS numbers; each row needs `cost` numbers."""
    some = max(1, NUMBERS // cost)
    parts = range(0, max(1, len(rows[0])), some)  # at least one part, even if `rows` are empty
    return np.concatenate([make(*(each[k : k + some] for each in rows)) for k in parts])


@dataclass(frozen=True, eq=False)
class _Swept:
    """Sweeping of unit charges at asperities onto shells around neighbours, as in (6).

    support : indices of the asperities on the support
    shells  : (n,) radii R_k of the shells; 0 off the support
    """

    influence: Influence
    support: Indices
    shells: Array

    @cached_property
    def places(self) -> NDArray[np.complex128]:
        """(n,) the points as complex numbers, relative to the middle of all points."""
        x, y = self.influence.points.T
        return np.asarray((x - (x.min() + x.max()) / 2) + 1j * (y - (y.min() + y.max()) / 2))

    @cached_property
    def extent(self) -> float:
        """An upper bound on the distance of any two points."""
        return 2.01 * float(np.abs(self.places).max())

    @cached_property
    def lost(self) -> float:
        """Bound on the relative rounding error of (6)."""
        moved = ROUNDOFF * self.extent / float(self.influence.separations().min())
        return 8 * (self.influence.entry_error + moved) + 128 * ROUNDOFF

    @cached_property
    def _tree(self) -> Any:
        from scipy.spatial import cKDTree  # 0.1 s to import: only when asked

        return cKDTree(self._plane(self.places[self.support]))

    @staticmethod
    def _plane(places: NDArray[np.complex128]) -> Array:
        return np.column_stack((places.real, places.imag))

    def neighbours(self, which: Indices, count: int) -> Indices:
        """(m, count) the nearest asperities on the support to each asperity, without itself."""
        count = min(count, len(self.support) - 1)
        _, found = self._tree.query(self._plane(self.places[which]), count + 1)
        nearest = self.support[found]
        itself = np.argsort(nearest == which[:, None], axis=1, kind="stable")
        return np.asarray(np.take_along_axis(nearest, itself[:, :count], axis=1))

    def potentials(self, charges: Indices, places: Indices) -> Array:
        """Potentials of unit charges at places; at a charge itself, the potential of its shell."""
        apart = self.places[charges] - self.places[places]
        squares = apart.real**2 + apart.imag**2
        return np.asarray(1.0 / np.where(charges == places, self.shells[charges], np.sqrt(squares)))

    def outside(self, which: Indices) -> Array:
        """(m,) lower bounds on rates by sweeping onto one neighbour; -inf where that fails."""
        near, here = self.neighbours(which, NEIGHBOURS), self.places[which][:, None]
        away, middle = self.places[near] - here, (self.places[near] + here) / 2
        nearer = self._least_along(away) - (away.conj() * middle).real
        clear = self.shells[near] < (1 - 2 * self.lost) * np.abs(away)
        found = (clear & (nearer > 2 * self.lost * self.extent**2)).any(axis=1)
        return np.where(found, self.lost / 2, -np.inf)

    def lightest(self, which: Indices) -> tuple[Indices, Array]:
        """(m, s) neighbours, and their weights of least energy; 0 where none are found."""
        near = self.neighbours(which, NEIGHBOURS)
        return near, _in_parts(self._lightest, (near.shape[1] + 5) ** 2, which, near)

    def _lightest(self, which: Indices, near: Indices) -> Array:
        (m, s), rows = near.shape, 5
        away = self.places[near] - self.places[which][:, None]
        least = np.abs(away).min(axis=1)[:, None]
        powers = [(away / least) ** k for k in range(3)]
        sums = np.stack([part for p in powers for part in (p.real, p.imag)], axis=1)
        sums = np.delete(sums, 1, axis=1)  # the imaginary part of 1
        coupled = self.potentials(near[:, :, None], near[:, None, :]) * least[:, :, None]
        target = np.zeros((m, s + rows))
        target[:, :s], target[:, s] = least / np.abs(away), 1.0
        kept, weights, todo = np.ones((m, s), dtype=bool), np.zeros((m, s)), np.arange(m)
        for _ in range(SEARCHES):
            here = np.pad(kept[todo].astype(float), ((0, 0), (0, rows)), constant_values=1.0)
            system = np.zeros((len(todo), s + rows, s + rows))
            system[:, :s, :s], system[:, s:, :s] = coupled[todo], sums[todo]
            system[:, :s, s:] = sums[todo].mT
            system *= here[:, :, None] * here[:, None, :]
            dropped = 1.0 - here
            dropped[:, s:] = -1e-13  # the system is then never singular
            system[:, range(s + rows), range(s + rows)] += dropped
            found = np.linalg.solve(system, (target[todo] * here)[:, :, None])[:, :s, 0]
            fits = (found >= 0).all(axis=1)
            weights[todo[fits]] = found[fits]
            kept[todo] &= found >= 0
            todo = todo[~fits]
        off = np.abs((sums @ weights[:, :, None])[:, :, 0] - target[:, s:]).max(axis=1)
        weights[off > 1e-9] = 0.0
        return weights

    def tightest(self, which: Indices, count: int, looked: Indices) -> tuple[Indices, Array]:
        """(m, s) neighbours, and weights of least total by the barrier method."""
        near = self.neighbours(which, count)
        cost = max(near.shape[1] * (NEAR + SAMPLE), len(self.support))
        return near, _in_parts(self._tightest, cost, which, near, looked)

    def _tightest(self, which: Indices, near: Indices, looked: Indices) -> Array:
        sample = self.support[:: -(-len(self.support) // SAMPLE)]
        spread = np.where(sample == which[:, None], near[:, :1], sample)
        seen = np.concatenate((self.neighbours(which, NEAR), spread, looked), axis=1)
        apart = np.abs(self.places[seen] - self.places[which][:, None])
        ratios = self.potentials(near[:, :, None], seen[:, None, :]) * apart[:, None, :]
        diagonal = np.arange(near.shape[1])
        weights = np.repeat(2.0 / ratios.sum(axis=1).min(axis=1)[:, None], len(diagonal), axis=1)
        todo, price = np.arange(len(which)), 1.0 / weights.sum(axis=1)
        for _ in range(STEPS):
            w, ratio = weights[todo], ratios[todo]
            room = np.einsum("is,isk->ik", w, ratio) - 1.0
            scaled = ratio / room[:, None]
            downhill = scaled.sum(axis=2) + 1.0 / w - price[todo, None]
            bending = scaled @ scaled.mT
            bending[:, diagonal, diagonal] += 1.0 / w**2
            try:
                step = np.linalg.solve(bending, downhill[:, :, None])[:, :, 0]
            except np.linalg.LinAlgError:  # singular by rounding; `rates` verifies the weights
                break
            shrinks = np.maximum(
                (-step / w).max(axis=1), (-np.einsum("is,isk->ik", step, scaled)).max(axis=1)
            )
            weights[todo] = w + step * np.minimum(1.0, 0.9 / np.maximum(shrinks, 1e-9))[:, None]
            price[todo] *= 3.0
            left = CENTRED * len(seen[0]) / price[todo]
            todo = todo[(1.0 - weights[todo].sum(axis=1) < left) & (left > LEAST)]
            if not len(todo):
                break
        return weights

    def rates(self, which: Indices, near: Indices, weights: Array) -> tuple[Array, Indices]:
        """(m,) bounds 1 - q_i (-inf where all weights are 0), and the k that determine q_i."""
        from scipy.sparse import csr_array

        total, rates, worst = weights.sum(axis=1), np.full(len(which), -np.inf), near[:, 0].copy()
        known = np.flatnonzero(total)
        rows, mine = np.arange(len(known)), which[known]
        charged, columns = np.unique(near[known], return_inverse=True)
        each = (weights[known] / total[known, None]).ravel()
        starts = np.arange(len(known) + 1) * near.shape[1]
        charges = csr_array((each, columns.ravel(), starts), shape=(len(known), len(charged)))
        most, nowhere = np.zeros(len(known)), np.full(len(self.places), np.inf)
        parts = 1 + (len(charged) + len(known)) * len(self.support) // NUMBERS
        for seen in np.array_split(self.support, parts):
            swept = charges @ (1.0 / self._apart(charged, seen, self.shells))
            swept *= self._apart(mine, seen, nowhere)
            least = swept.argmin(axis=1)
            q = 1.0 / swept[rows, least]
            worst[known] = np.where(q > most, seen[least], worst[known])
            most = np.maximum(most, q)
        rates[known] = 1.0 - (1.0 + self.lost) * most
        return rates, worst

    def _apart(self, some: Indices, seen: Indices, themselves: Array) -> Array:
        """(m, k) distances of asperities; from an asperity to itself, its entry in `themselves`."""
        from scipy.spatial.distance import cdist

        apart: Array = cdist(self._plane(self.places[some]), self._plane(self.places[seen]))
        both, i, j = np.intersect1d(some, seen, return_indices=True)
        apart[i, j] = themselves[both]
        return apart

    def _least_along(self, directions: NDArray[np.complex128]) -> Array:
        """(...) for each direction p, a lower bound on Re(conj(p) z) of all z on the support."""
        step = 2 * np.pi / DIRECTIONS
        around = np.exp(1j * step * np.arange(DIRECTIONS + 1))
        least = np.array([(side.conj() * self.places[self.support]).real.min() for side in around])
        angle = np.angle(directions) % (2 * np.pi) / step
        k = np.minimum(angle.astype(int), DIRECTIONS - 1)
        before, after = np.sin(step * np.stack((k + 1 - angle, angle - k)).clip(0.0)) / np.sin(step)
        return np.asarray(np.abs(directions) * (before * least[k] + after * least[k + 1]))
