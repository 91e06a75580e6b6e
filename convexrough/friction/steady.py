"""`cycle`, `cycles` and `steady`: steady cycles between two shear forces, and of closed paths."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from fractions import Fraction
from functools import partial
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from convexrough import checks
from convexrough.arithmetic.balls import Ball
from convexrough.arrays import Array, among_zeros, frozen
from convexrough.contact import Contact
from convexrough.errors import InputError
from convexrough.friction import state
from convexrough.friction.curve import MemoryCurve, Point
from convexrough.friction.cycle import Cycle
from convexrough.friction.levels import FrictionLevels, rounded
from convexrough.friction.path import walk_of
from convexrough.friction.walk import Closed
from convexrough.influence import Kind
from convexrough.normal.level import Level
from convexrough.progress import LOGGER
from convexrough.scene.scene import Scene
from convexrough.sphere import mindlin
from convexrough.sphere.smooth import smooth_reference


def cycle(
    contact: Contact,
    *,
    maximum: float | None = None,
    minimum: float | None = None,
    displacement: float | None = None,
) -> Cycle:
    """The steady cycle between two shear forces at constant load (docs/theory/losses.md).

    maximum, minimum : [force] largest and smallest shear force; the minimum defaults to -maximum
    displacement     : [length] displacement amplitude of a symmetric cycle, instead of forces. If
        `order` is "fails", the force is that of the memory curve, which only approximates it:
        `displacement_amplitude` of the result then differs from it, in a test by 5e-5 of it

    As in `shear`, a force or displacement that differs only by rounding from its value at the onset
    of gross sliding is replaced by that value, also in the result.

    Raises InputError if the scene has no friction, if the minimum exceeds the maximum, if a force
    exceeds the friction limit f P, or if the displacement exceeds that of gross sliding.

    >>> cycle = cr.cycle(contact, maximum=0.25 * contact.load)
    >>> print(f"{cycle.loss:.4g}", (cycle.status == "sliding").sum())
    1.367e-13 6
    """
    given = {"maximum": maximum, "minimum": minimum, "displacement": displacement}
    for name, value in given.items():
        if value is not None and (shape := np.shape(value)):
            expected = "one number; `cycles` computes several cycles"
            raise InputError(name, found=f"shape {shape}", expected=expected)
    upper, lower, moved = (None if value is None else [value] for value in given.values())
    return cycles(contact, upper, lower, displacement=moved)[0]


def cycles(
    contact: Contact,
    maximum: ArrayLike | None = None,
    minimum: ArrayLike | None = None,
    *,
    displacement: ArrayLike | None = None,
) -> list[Cycle]:
    """The steady cycles of several ranges of shear force at constant load, computed together.

    maximum, minimum, displacement : (m,) as in `cycle`

    Raises the errors of `cycle`.

    >>> several = cr.cycles(contact, contact.load * np.array([0.1, 0.2, 0.4]))
    >>> print([f"{cycle.loss_normalised:.2g}" for cycle in several])
    ['0.00021', '0.0028', '0.048']
    """
    checks.instance("contact", contact, Contact)
    f = checks.friction(contact.scene.friction)
    levels = contact.cached(FrictionLevels)
    checks.exactly_one("maximum", maximum, "displacement", displacement)
    if displacement is not None:
        if minimum is not None:
            expected = "no minimum: a cycle of given displacement is symmetric"
            raise InputError("minimum", found=minimum, expected=expected)
        amplitudes = checks.array("displacement", displacement, sign="not negative")
        checks.some("displacement", amplitudes)
        tops = [levels.load - levels.displaced(x) for x in amplitudes]
        heights = [(T, -T) for T in tops]
    else:
        assert maximum is not None  # exactly_one
        ranges = force_ranges(maximum, minimum, f * float(levels.load))
        checks.some("maximum", ranges[0])
        ends = zip(*(each.tolist() for each in ranges), strict=True)
        heights = [(levels.height(high), levels.height(low)) for high, low in ends]
        LOGGER.info("pressing at the load P - T of each cycle")
    paths = [[(levels.load, T) for T in each] for each in heights]
    return steady_cycles(contact, MemoryCurve.pressed(levels.load), paths)


def force_ranges(
    maximum: ArrayLike,
    minimum: ArrayLike | None,
    limit: float | Array,
    length: int | None = None,
    one: str = "",
) -> tuple[Array, Array]:
    """(m,) the checked largest and smallest shear forces; `length` and `one` as in
    `checks.array`."""
    upper = checks.array("maximum", maximum, length=length, one=one)
    upper = checks.bearable("maximum", upper, limit)
    lower = -upper
    if minimum is not None:
        each = one or "maximum"
        lower = checks.array("minimum", minimum, length=len(upper), one=each)
        lower = checks.bearable("minimum", lower, limit)
    if len(wrong := np.flatnonzero(upper < lower)):
        k = wrong[0]
        expected = f"at least the minimum, {lower[k]:g} (-maximum by default)"
        raise InputError(f"maximum[{k}]", found=upper[k], expected=expected)
    return upper, lower


def steady(
    scene: Scene, *, loads: ArrayLike, forces: ArrayLike, influence: Kind | None = None
) -> Cycle:
    """The steady state of a closed path of load and shear force that is repeated.

    docs/theory/paths.md, "Closed paths", derives it.

    loads, forces : (m,) [force] load P and shear force Q at the points of the path, |Q| <= f P;
        segments between points are straight, and the last segment returns to the first point. As
        in `shear`, Q counts as f P if they differ only by rounding
    influence : how the compliance matrix is stored, as in `press`

    Raises the errors of `load_path`.

    >>> P = contact.load
    >>> settled = cr.steady(scene, loads=[P, P / 2], forces=[0.3 * P, -0.1 * P])
    >>> f"{settled.level / P:.4f}", int((settled.status == "sliding").sum())
    ('0.3500', 12)
    """
    contact, walk = walk_of(scene, loads, forces, None, influence)
    return steady_cycles(contact, walk.start, [walk.points])[0]


def steady_cycles(
    contact: Contact, start: MemoryCurve, paths: Sequence[Sequence[Point]]
) -> list[Cycle]:
    """The steady cycles of several closed paths (P, T) that begin from the same memory curve."""
    levels = contact.cached(FrictionLevels)
    closed = [Closed.around(levels, start, points) for points in paths]
    levels.prepare(load for each in closed for load in each.needed)
    for needed in sorted((each.needed for each in closed), key=min):
        levels.order(needed)  # a proof for the widest range of loads holds for the others
    costs = [pieces for each in closed for pieces in each.cycles]
    spent = state.losses(levels, costs) * levels.loss_unit
    sums = state.LevelSums.of([curve for each in closed for curve in each.steady])
    moved = state.displacements_of(levels, sums)
    ends = np.cumsum([0, *map(len, paths)]).tolist()
    return [
        _cycle(contact, closed[k], spent[2 * k : 2 * k + 2], moved[start:stop])
        for k, (start, stop) in enumerate(pairwise(ends))
    ]


def _cycle(contact: Contact, closed: Closed, spent: Ball, moved: Ball) -> Cycle:
    """The result, from the losses `spent` of cycles 1 and 2 and the displacements `moved`."""
    levels, order, (stuck, stuck_height) = closed.levels, closed.order, closed.stuck
    (first, loss), (first_error, error) = spent.value, spent.error
    half = (_largest(moved) + _largest(-moved)) * 0.5
    amplitude = float(half.value)
    rest, top, bottom = (levels.at(s) for s in (stuck, levels.load, closed.least))
    slides, lost = bottom.touching & rest.open, top.touching & bottom.open
    slips, slip_errors = _slips(closed, rest, bottom)
    slips[levels.to_scene(lost)] = np.nan
    radii, radius_errors = state.stick_radii(levels, rest)
    loaded, heights = zip(*closed.points[: closed.once], strict=True)
    reference = smooth_reference(contact.scene, contact.load) if levels.load else None
    smooth = np.nan
    if closed.one_loop and reference:
        smooth = float(mindlin.loss(float((max(heights) - min(heights)) / (2 * levels.load))))
    if (general := closed.general) is not None:
        each = closed.losses_of(general)
        first, loss = each[0], each[-1] if closed.settled(each) else np.nan
        amplitude = float(np.ptp(general.states.displacements.value[-closed.once - 1 :])) / 2.0
    unknown = np.inf if order == "fails" else 0.0
    unused = 0.0 if general is None else np.nan
    unproved = 0.0 if order == "proved" else np.inf
    statuses = {
        "intermittent": lost,
        "sliding": slides,
        "partial" if closed.cycles[1] else "stuck": rest.touching & top.touching,
    }
    found = Cycle(
        contact=contact,
        loads=frozen(np.array(loaded, dtype=np.float64)),
        forces=closed.forces[: closed.once],
        loss=float(loss),
        loss_error=float(error + unproved),
        loss_first=float(first),
        loss_first_error=float(first_error + unproved),
        status=state.by_status(levels, top, **({} if unknown else statuses)),
        slips=frozen(slips),
        slip_errors=frozen(slip_errors + unknown),
        stick_radii=radii,
        stick_radius_errors=frozen(radius_errors + unknown),
        level=float(stuck) + unused,
        force_level=float(levels.coefficient.value) * float(stuck_height) + unused,
        loss_normalised=float(loss) / (reference.energy_scale if reference else np.nan),
        smooth_normalised=smooth,
        displacement_amplitude=amplitude,
        displacement_error=float(half.error) + unknown,
        order=order,
        presses=levels.presses,
        start=float(closed.start.load),
        heights=heights,
    )
    found.__dict__["_walk"] = closed  # the cached property would follow the path again
    return found


def _slips(closed: Closed, rest: Level, bottom: Level) -> tuple[Array, Array]:
    """(N,) [length] the gross slip in each direction per steady cycle, and error bounds.

    rest, bottom : the normal solutions at L* and at the least load

    It is half the sum, over the pieces of a cycle, of c_t f (1 - c th) times the growth of the gap
    as the front falls (docs/theory/paths.md, "Closed paths").
    """
    levels, weights = closed.levels, defaultdict[Fraction, Fraction](Fraction)
    for piece in closed.cycles[1]:
        share = (1 - piece.sign * piece.slope) / 2
        weights[piece.bottom] += share
        weights[piece.top] -= share
    some = np.flatnonzero(~rest.touching & ~bottom.open)  # the others stick, or open
    total = Ball.exact(np.zeros(len(some)))
    for load, weight in weights.items() if len(some) else ():
        total = total + (-levels.at(load).indentation[some]).positive_part() * weight
    values, errors = rounded(total * levels.travel_unit)
    sure = bottom.touching[some]  # 0 if the asperity opens
    spread = partial(among_zeros, places=some, count=len(levels.candidates))
    found, off = np.where(sure, values, 0.0), np.where(sure, errors, np.abs(values) + errors)
    return levels.to_scene(spread(found)), levels.to_scene(spread(off))


def _largest(numbers: Ball) -> Ball:
    """The largest of m numbers, with all their digits."""
    above = numbers - numbers[int(np.argmax(numbers.value))]
    k = int(np.argmax(above.value))
    more = np.inf
    if np.isfinite(above.upper).all():
        more = float(above.upper.max() - above.upper[k])  # if another may be larger
    return Ball.around(numbers[k].mid, numbers[k].radius + more)
