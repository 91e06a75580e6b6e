"""Many normal problems with as many candidates each, solved and proved together: a row for each.

The levels of one scene, or many scenes. One Newton's method, one refinement to pairs and one
theorem go over all rows at once; the formulas are those of `refine` and `proved`. A row that the
cheapest argument does not settle is left to the way of one by one.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array, Indices
from convexrough.convex.theorem import excess
from convexrough.normal.boxes import Box
from convexrough.normal.problem import NormalProblem
from convexrough.normal.proved import POOR, Proved
from convexrough.normal.refine import Trial
from convexrough.numbers.balls import Ball
from convexrough.numbers.kernels import residual
from convexrough.numbers.pairs import Pair, two_sum
from convexrough.roundoff import ROUNDOFF, SAFETY

#: Newton steps, corrections and shifts of a first guess, at most.
STEPS, CORRECTIONS, SHIFTS = 30, 4, 8

#: A rough contact reaches further than Hertz's, in the square of its radius. A heuristic.
WIDER = 1.1

#: Newton's method ends where a step leaves this part of the indentations: a correction leaves its
#: square. A heuristic.
NEGLIGIBLE = 88 * ROUNDOFF

#: Numbers of an array of rows: some dozens of these are in use at once.
NUMBERS = 2**17

quietly = np.errstate(all="ignore")


@dataclass(frozen=True, eq=False)
class Stack:
    """Problems in m rows, in own units; (m, n), or (n,) of what all rows share.

    coupled : slices of the rows, and a problem that has their coupling
    coefficients, offsets : k, also (1,) or (m, 1), and d;  shells : as of `NormalProblem`
    total, depth : (m, 1) the load or the approach that is prescribed
    """

    coupled: Sequence[tuple[slice, NormalProblem]]
    coefficients: Ball
    offsets: Ball
    shells: Array
    total: Ball | None
    depth: Ball | None

    def __len__(self) -> int:
        return int(self.coupled[-1][0].stop)

    @cached_property
    def k(self) -> Array:
        """To float64."""
        return self.coefficients.value

    @cached_property
    def row_norm(self) -> Array:
        """(m, 1) as of `NormalProblem`."""
        return self._each("row_norm")

    @cached_property
    def largest_entry(self) -> Array:
        """(m, 1) as of `NormalProblem`."""
        return self._each("largest_entry")

    def _each(self, name: str) -> Array:
        values = np.empty((len(self), 1))
        for rows, problem in self.coupled:
            values[rows] = getattr(problem, name)
        return values

    def only(self, rows: Indices) -> Stack:
        """Some of the rows (sorted)."""
        ends = np.searchsorted(rows, [0, *(some.stop for some, _ in self.coupled)]).tolist()
        slices = zip(map(slice, ends[:-1], ends[1:]), self.coupled, strict=True)
        pick = partial(of_rows, lambda part: part[rows])
        return Stack(
            [(some, problem) for some, (_, problem) in slices if some.stop > some.start],
            pick(self.coefficients) if len(self.coefficients) == len(self) else self.coefficients,
            pick(self.offsets),
            self.shells[rows] if self.shells.ndim == 2 else self.shells,
            None if self.total is None else pick(self.total),
            None if self.depth is None else pick(self.depth),
        )

    def apply(self, loads: Array) -> Array:
        """(m, n) A P to float64."""
        found = np.empty(loads.shape)
        for rows, problem in self.coupled:
            found[rows] = loads[rows] @ problem.influence.matrix
        return found

    def product(self, loads: Pair) -> Ball:
        """(m, n) A P to some thirty digits."""
        return joined([problem.product(loads.at(rows)) for rows, problem in self.coupled])

    def stiffness(self, loads: Array) -> Array:
        """(m, n) h = (2/3) k P^(-1/3)."""
        return np.asarray((2.0 / 3.0) * self.k / np.cbrt(loads))

    def correct(self, slopes: Array, defect: Array, todo: NDArray[np.bool_]) -> Array:
        """(m, n) a step of Newton's method as `convex.newton_step.correct`; nan where indefinite.

        slopes : (m, n) c = dP/dn;  todo : (m,) rows that need one; 0 of others
        """
        from scipy.linalg.lapack import dposv  # 0.2 s to import: only when solving

        root = np.sqrt(slopes)
        count = max(1, int((root > 0).sum(axis=1).max()))
        order = np.argsort(root <= 0, axis=1, kind="stable")[:, :count]
        w = np.take_along_axis(root, order, axis=1)
        right = w * np.take_along_axis(defect, order, axis=1)
        changes, shift = np.zeros(root.shape), np.zeros((len(root), 1))
        for rows, problem in self.coupled:
            A = problem.influence.matrix
            for k in range(rows.start, rows.stop):
                if not todo[k]:
                    continue
                matrix = A.take(order[k], 0).take(order[k], 1)
                matrix *= w[k]
                matrix *= w[k][:, None]
                matrix.ravel()[:: count + 1] = 1.0
                _, y, info = dposv(matrix.T, np.array((right[k], w[k])).T, lower=1, overwrite_a=1)
                if info != 0:
                    shift[k] = np.nan
                    continue
                if self.total is not None:
                    shift[k] = w[k] @ y[:, 0] / (w[k] @ y[:, 1])
                changes[k, order[k]] = w[k] * (y[:, 0] - shift[k] * y[:, 1])
        return np.asarray(np.where(todo[:, None], shift - defect + self.apply(changes), 0.0))


class Boxes(NamedTuple):
    """Boxes of loads on which energies are convex: (m, n) or (n,), as of `boxes.Box`.

    number : (m, 1) or () convexity numbers;  shells : that prove it
    """

    loads: Array
    stiffness: Array
    faces: Array
    number: Array
    shells: Array

    @property
    def closed(self) -> Boxes:
        """The same for other loads, of which they may not hold every solution."""
        return self._replace(faces=np.where(self.loads > 0, self.loads, np.inf))


class Rows(NamedTuple):
    """Levels of one scene, or of several: (k,) and, in own units, (k, n), as of `level.Level`."""

    load: Ball
    approach: Ball
    loads: Ball
    indentation: Ball
    touching: NDArray[np.bool_]
    open: NDArray[np.bool_]

    def at(self, which: Indices) -> Rows:
        """Some of them."""
        return Rows._make(each[which] for each in self)


class Trials(NamedTuple):
    """Trial loads, in rows: as of `refine.Trial`. Approach, missing : (m, 1)."""

    loads: Pair
    product: Ball
    indentation: Ball
    local: Array
    gap: Ball
    approach: Ball
    missing: Ball

    @property
    def inside(self) -> NDArray[np.bool_]:
        """(m, n) where a load is not 0."""
        return np.asarray(self.loads.high > 0)


@dataclass(frozen=True, eq=False)
class Solved:
    """Solutions, in rows, as of `proved.Proved`; nothing is proved of rows that are not `good`."""

    trial: Trials
    good: NDArray[np.bool_]
    distance: Array
    stiffness: Array
    loads: Ball
    indentation: Ball
    approach: Ball

    @cached_property
    def rows(self) -> Rows:
        """With the proved statuses."""
        touching = self.indentation.positive | self.loads.positive
        known = self.approach[:, 0], self.loads, self.indentation
        return Rows(self.total, *known, touching, self.indentation.negative)

    @cached_property
    def total(self) -> Ball:
        """(m,) the sums of the loads: as of `Proved`."""
        trial = Ball.exact(self.trial.loads).sum()
        spread = self.distance * np.sqrt((1.0 / self.stiffness).sum(axis=1)) * (1 + SAFETY)
        return Ball.around(trial.mid, trial.radius + spread + self.trial.missing.size[:, 0])

    def row(self, k: int, problem: NormalProblem, box: Box) -> Proved:
        """One of them, of a problem, in its box."""
        trial: Trials = of_rows(lambda part: part[k], self.trial)
        loads, product, _, local, gap, approach, missing = trial
        return Proved(
            problem,
            Trial(problem, loads, product, local, gap, approach[0], missing[0]),
            box,
            float(self.distance[k]),
            self.stiffness[k],
            self.loads[k],
            self.indentation[k],
            self.approach[k, 0],
        )


def of_rows(function: Callable[..., Any], *values: Any) -> Any:
    """function(array, ...) of each array that such values are made of."""
    first = values[0]
    if isinstance(first, np.ndarray):
        return function(*values)
    if isinstance(first, Ball):
        pairs, radii = [each.mid for each in values], [each.radius for each in values]
        return Ball(of_rows(function, *pairs), function(*radii))
    return type(first)(*(of_rows(function, *parts) for parts in zip(*values, strict=True)))


def joined(balls: Sequence[Ball]) -> Ball:
    """The rows of all of them."""
    joint: Ball = of_rows(lambda *each: np.concatenate(each), *balls)
    return joint


class _Pressed(NamedTuple):
    """A point of Newton's method: as of `solvers.pressing`."""

    own: Array
    loads: Array
    gap: Array

    @property
    def defect(self) -> Array:
        return np.where(self.loads > 0, self.gap, np.minimum(self.gap, 0.0))

    @property
    def unknown(self) -> Array:
        return np.where(self.loads > 0, self.own, np.minimum(-self.gap, 0.0))

    @property
    def slopes(self) -> Array:
        return np.where(self.loads > 0, 1.5 * self.loads / np.where(self.own > 0, self.own, 1), 0)


@quietly
def pressed(stack: Stack, guess: Array) -> Array:
    """(m, n) loads by full steps of Newton's method; not finite where these do not get there.

    guess : (m, n) indentations, of which some are positive in each row
    """
    state, before = _pressed(stack, guess), np.full(len(stack), np.inf)
    for _ in range(STEPS):
        size = np.linalg.norm(state.defect, axis=1)
        expected = np.where(np.isinf(before), size, (size / before) ** 2 * size)
        todo = expected > NEGLIGIBLE * np.linalg.norm(state.own, axis=1)
        if not todo.any():
            break
        step = stack.correct(state.slopes, state.defect, todo)
        state, before = _pressed(stack, state.unknown + step), size
    return np.where(np.isfinite(size)[:, None], state.loads, np.nan)


def _pressed(stack: Stack, indentation: Array) -> _Pressed:
    own = np.maximum(indentation, 0.0)
    root = np.sqrt(own / stack.k)
    loads = own / stack.k * root
    if stack.total is not None:
        share = stack.total.value / loads.sum(axis=1, keepdims=True)
        loads, own = loads * share, own * np.cbrt(share) ** 2
    gap = own + stack.apply(loads) - stack.offsets.value
    if stack.depth is not None:
        return _Pressed(own, loads, gap - stack.depth.value)
    mean = (root * gap).sum(axis=1, keepdims=True) / root.sum(axis=1, keepdims=True)
    return _Pressed(own, loads, gap - mean)


@quietly
def refined(stack: Stack, loads: Array) -> Trials:
    """Loads to thirty digits: as `refine.refined_loads`."""
    bad = np.asarray(~np.isfinite(loads).all(axis=1))
    pair = _completed(stack, Pair.exact(np.where(bad[:, None], 0.0, loads)))
    best = _trial(stack, pair)
    size = _size(best)
    todo = (size > np.linalg.norm(best.gap.radius, axis=1)) & ~bad
    for _ in range(CORRECTIONS):
        if not todo.any():
            break
        following = _corrected(stack, best, todo)
        left = _size(following)
        better = (left < size) & todo
        best = of_rows(partial(np.where, better[:, None]), following, best)
        todo = better & (left < 0.5 * size)
        size = np.where(better, left, size)
        todo &= size > np.linalg.norm(best.gap.radius, axis=1)
    return best


def _size(state: Trials) -> Array:
    gap = state.gap.value
    defect = np.where(state.inside, gap, np.minimum(gap, 0.0))
    return np.asarray(np.linalg.norm(defect, axis=1))


def _trial(stack: Stack, loads: Pair) -> Trials:
    """As `refine.trial`."""
    product, exact, d = stack.product(loads), Ball.exact(loads), stack.offsets
    local = stack.k * np.cbrt(loads.high) ** 2
    if stack.total is None:
        assert stack.depth is not None
        depth = d + stack.depth
        gap = residual(stack.coefficients, exact, product, depth)
        missing = Ball.exact(np.zeros((len(local), 1)))
        return Trials(loads, product, depth - product, local, gap, stack.depth, missing)
    missing = stack.total - _column(exact.sum())
    above = residual(stack.coefficients, exact, product, d)
    weights = np.cbrt(loads.high)
    weights /= weights.sum(axis=1, keepdims=True)
    shift = (weights * above.value).sum(axis=1, keepdims=True)
    rest = (weights * ((above.value - shift) + above.mid.low)).sum(axis=1, keepdims=True)
    approach = Ball.exact(Pair(*two_sum(shift, rest)))
    indentation = d + approach - product
    return Trials(loads, product, indentation, local, above - approach, approach, missing)


def _column(ball: Ball) -> Ball:
    return ball[:, None]


def _corrected(stack: Stack, state: Trials, todo: NDArray[np.bool_]) -> Trials:
    """As `refine.corrected`."""
    loads, inside, gap, local = state.loads, state.inside, state.gap.value, state.local
    slopes = np.where(inside, 1.5 * loads.high / np.where(inside, local, 1.0), 0.0)
    defect = np.where(inside, gap, np.minimum(gap, 0.0))
    size = np.abs(defect).max(axis=1, keepdims=True)
    size[size == 0] = 1.0
    step = size * stack.correct(slopes, defect / size, todo)
    ratio = np.where(inside, step / np.where(inside, local, 1.0), 0.0)
    change = loads.high * np.expm1(1.5 * np.log1p(np.maximum(ratio, -0.5)))
    left = inside & (ratio <= -0.5)
    new = np.where(inside, 0.0, np.minimum(-gap, 0.0)) + np.where(left, local, 0.0) + step
    entering = (left | ~inside) & (new > 0)
    share = np.where(entering, new, 0.0) / stack.k
    change = np.where(left, -loads.high, change) + share * np.sqrt(share)
    following = loads + Pair.exact(change)
    gone = left & ~entering
    following = Pair(*(np.where(gone, 0.0, part) for part in following))
    return _trial(stack, _completed(stack, following))


def _completed(stack: Stack, loads: Pair) -> Pair:
    """As `refine.completed`."""
    if stack.total is None:
        return loads
    total, rows = stack.total.mid, np.arange(len(stack))
    sums = Pair(*(part[:, None] for part in loads.total()))
    loads = loads * (total / sums)
    j = np.argmax(loads.high, axis=1)
    largest = loads.at((rows, j)) + (Pair(*(part[:, 0] for part in total)) - loads.total())
    high, low = loads.high.copy(), loads.low.copy()
    high[rows, j], low[rows, j] = largest
    return Pair(high, low)


@quietly
def proved(stack: Stack, state: Trials, boxes: Boxes) -> Solved:
    """The solutions in these boxes: as `proved.proved`, of the rows where one box is enough.

    Rows with a residual above rounding, or a status that is undecided, are not `good`, either.
    """
    loads, missing = state.loads.high, state.missing.size
    rows, j = np.arange(len(loads)), np.argmax(loads, axis=1)
    largest = loads[rows, j][:, None]
    missing_effect = np.where(missing > 0, missing * stack.largest_entry, 0.0)
    steepest = 4.0 / 3.0 * state.local[rows, j][:, None] / largest * (1 + SAFETY)
    lost = np.where(missing < largest / 2.0, missing * steepest, np.inf)
    residuals = excess(state.gap, state.inside) + missing_effect
    residuals[rows, j] += np.where(missing > 0, lost, 0.0)[:, 0]

    def errors_on(stiffness: Array, margin: Array) -> tuple[Array, Array]:
        most = residuals.max(axis=1, keepdims=True)
        squared = ((residuals / most) ** 2 / stiffness).sum(axis=1, keepdims=True)
        within = most * np.sqrt(squared) / margin * (1 + SAFETY + loads.shape[1] * 2.0**-52)
        within = np.where(most == 0.0, 0.0, np.where(np.isfinite(within), within, np.inf))
        errors = within / np.sqrt(stiffness) * (1 + SAFETY)
        errors[rows, j] += missing[:, 0]
        return within, errors

    _, errors = errors_on(boxes.stiffness, 1.0 - boxes.number)
    good = np.isfinite(errors).all(axis=1) & (loads + errors < boxes.faces).all(axis=1)
    good &= (boxes.number < 1).ravel()
    near = np.minimum(boxes.loads, (loads + errors) * (1 + SAFETY))
    h = stack.stiffness(near)
    number = (boxes.shells / h).max(axis=1, keepdims=True) * (1 + SAFETY)
    within, errors = errors_on(h, 1.0 - np.minimum(boxes.number, number))
    softest = h.min(axis=1, keepdims=True)
    moved = (within / np.sqrt(softest) * stack.row_norm + missing_effect) * (1 + SAFETY)
    shift = _approach_errors(stack, state, errors, moved)
    known = state.indentation
    indentation = Ball.around(known.mid, known.radius + (moved + shift))
    found = Ball.around(state.loads, np.where(indentation.negative, 0.0, errors))
    found = _sharpened(stack, found, indentation)
    good &= np.isfinite(errors).all(axis=1)
    good &= _size(state) <= 4.0 * np.linalg.norm(state.gap.radius, axis=1)
    good &= (found.positive | indentation.positive | indentation.negative).all(axis=1)
    approach = Ball.around(state.approach.mid, shift)
    return Solved(state, good, within[:, 0], h, found, indentation, approach)


def _approach_errors(stack: Stack, state: Trials, errors: Array, moved: Array) -> Array:
    """(m, 1) as of `proved`."""
    if stack.total is None:
        return state.approach.radius
    least = state.loads.high - errors
    slope = stack.stiffness(np.where(least > 0, least, 1.0))
    each = np.where(least > 0, state.gap.size + slope * errors * (1 + SAFETY), np.inf)
    closest = each.min(axis=1, keepdims=True)
    return np.asarray((closest + moved) * (1 + SAFETY) + state.approach.radius)


def _sharpened(stack: Stack, loads: Ball, indentation: Ball) -> Ball:
    """As of `proved`."""
    which = loads.radius > POOR * loads.mid.high
    if not which.any():
        return loads
    k = stack.coefficients
    wide = of_rows(lambda part: np.broadcast_to(part, which.shape)[which], k)
    ratio = indentation[which] / (k if k.radius.size == 1 else wide)
    by_law = ratio.positive_part() * ratio.sqrt()
    better = by_law.radius < loads.radius[which]
    parts = np.array((*loads.mid, loads.radius))
    places = tuple(np.array(np.nonzero(which))[:, better])
    parts[:, places[0], places[1]] = np.array((*by_law.mid, by_law.radius))[:, better]
    return Ball(Pair(parts[0], parts[1]), parts[2])


@quietly
def guessed(stack: Stack, prescribed: Array, squares: Array, reach: Array) -> Array:
    """(m, n) first indentations: each rides on the displacement of Hertz's pressure.

    As `solvers.start` does.

    prescribed : (m, n) or (n,) d, or D;  squares : r^2 likewise;  reach : (m, 1) a^2, or infinite
    """
    s = np.sqrt(np.maximum(1.0 - squares / (WIDER * reach), 0.0)) + 0.0 * prescribed
    alone = s.sum(axis=1) == 0
    s[alone, np.argmax(prescribed + 0.0 * s, axis=1)[alone]] = 1.0
    displacement = stack.apply(s)
    total = s.sum(axis=1, keepdims=True)
    if stack.total is not None:
        return _shifted(stack, prescribed - stack.total.value / total * displacement)
    work = (s * prescribed).sum(axis=1, keepdims=True)
    local = (s * stack.k * np.cbrt(s) ** 2).sum(axis=1, keepdims=True)
    coupled = (s * displacement).sum(axis=1, keepdims=True)
    x = np.sqrt(work / local)
    for _ in range(8):  # from the right of the root of a convex function
        x = x - (x * x * (local + coupled * x) - work) / (x * (2.0 * local + 3.0 * coupled * x))
    return np.asarray(prescribed - x**3 * displacement)


def _shifted(stack: Stack, indentation: Array) -> Array:
    """Until the loads are the prescribed one, to some digits: as `load_control.shifted_to_load`."""
    assert stack.total is not None
    k, load = stack.k, stack.total.value
    alone = np.cbrt(load) ** 2 * k  # one that carries it all
    shift = (alone - indentation).min(axis=1, keepdims=True)
    for _ in range(SHIFTS):
        ratio = np.maximum(indentation + shift, 0.0) / k
        root = np.sqrt(ratio)
        total = (ratio * root).sum(axis=1, keepdims=True)
        excess = total - np.cbrt(load) ** 2 * np.cbrt(total)
        shift = shift - np.maximum(excess / (root / k).sum(axis=1, keepdims=True), 0.0)
    return np.asarray(indentation + shift)


@quietly
def approach_bounds(stack: Stack, state: Trials) -> Array:
    """(m, 1) no D0 is higher at any solution: prescribed, or as `load_control.approach_bound`."""
    if stack.depth is not None:
        return stack.depth.upper
    assert stack.total is not None
    loads, load, d = state.loads.high, stack.total.upper, stack.offsets
    total = loads.sum(axis=1, keepdims=True)
    q, c = loads / total, state.product.upper / total
    cubes = (q * stack.k) ** 3
    height = (c + np.cbrt(8.0 * cubes / (27.0 * load))).max(axis=1, keepdims=True) * (1 + SAFETY)
    for _ in range(SHIFTS):  # any height gives a bound
        excess = np.where(cubes > 0, cubes / (height - c) ** 3, 0.0)
        slope = 3.0 * np.where(cubes > 0, excess / (height - c), 0.0).sum(axis=1, keepdims=True)
        step = (excess.sum(axis=1, keepdims=True) - 27.0 * load / 8.0) / slope
        height = height + np.fmax(step, 0.0)
    height = np.maximum(height, c.max(axis=1, keepdims=True))
    rest = np.where(cubes > 0, cubes / (height - c) ** 2, 0.0).sum(axis=1, keepdims=True)
    terms = height * load, 4.0 / 27.0 * rest, -(d.lower * q).sum(axis=1, keepdims=True)
    size = terms[0] + terms[1] + (np.abs(d.lower) * q).sum(axis=1, keepdims=True)
    return np.asarray(sum(terms) + (SAFETY + loads.shape[1] * ROUNDOFF) * size)


@quietly
def widest(stack: Stack, state: Trials) -> Boxes:
    """Boxes that hold every solution and these loads, by shells: as `boxes.tried` begins."""
    depth = np.maximum(approach_bounds(stack, state) + stack.offsets.upper, 0.0)
    alone = (depth / stack.coefficients.lower) ** 1.5 * (1 + SAFETY)
    corner = np.maximum(alone, state.loads.high)
    h = stack.stiffness(corner)
    number = (stack.shells / h).max(axis=1, keepdims=True) * (1 + SAFETY)
    return Boxes(corner, h, np.full(h.shape, np.inf), number, stack.shells)
