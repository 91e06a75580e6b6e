"""Press many scenes at once, and compute a cycle of each.

All scenes have the same number of asperities. Scenes with the same positions and tip radii share
one matrix, so that a product for all of them is one product of matrices. Scenes that this does not
prove are solved one by one.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import groupby
from typing import Any, ClassVar, NamedTuple, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from convexrough import checks, threads
from convexrough.arrays import Array, Indices, frozen
from convexrough.contact import Contact, press
from convexrough.errors import InputError
from convexrough.friction.cycle import Cycle, cycle
from convexrough.friction.levels import AT_THE_END
from convexrough.friction.loss import asperity_losses
from convexrough.friction.order import proved_in_rows
from convexrough.normal import stack
from convexrough.normal.problem import NormalProblem
from convexrough.normal.stack import Boxes, Rows, Stack, joined
from convexrough.numbers.balls import Ball, where
from convexrough.numbers.pairs import Pair
from convexrough.record import Along, Table
from convexrough.roundoff import ROUNDOFF, SAFETY
from convexrough.scene.scene import Scene
from convexrough.sphere import hertz

#: Scenes with more asperities are solved one by one: stacking them saves nothing.
MOST = 512

#: Largest total size of the matrices of all rows processed at once.
MATRICES = 2**20


@dataclass(frozen=True, eq=False, repr=False)
class Contacts(Table):
    """What `press_many` finds of m scenes with n asperities each. Errors are proved bounds.

    `contacts[k]` is the `Contact` that `press` returns for scene k, made on first access.

    controls : (m,) what was prescribed: approaches [length], or loads [force] where `by_load`
    loads, approaches : (m,) totals [force], and D0 [length];  load_errors, approach_errors : (m,)
    asperity_loads : (m, n) [force];  asperity_load_errors : (m, n)
    status   : (m, n) "contact", "open" or "undecided"; each of the first two is proved
    alone    : (k,) indices of the scenes whose solution the rows do not prove to be the only one:
        these were pressed one by one

    >>> contacts = cr.press_many([scene, scene], approach=[5e-5, 1e-5])
    >>> contacts.asperity_loads.shape, (contacts.status == "contact").sum(axis=1).tolist()
    ((2, 61), [37, 7])
    """

    _along: ClassVar[Along] = {
        ("scene",): ("controls", "loads", "load_errors", "approaches", "approach_errors"),
        ("scene", "asperity"): ("asperity_loads", "asperity_load_errors", "status"),
    }

    scenes: tuple[Scene, ...]
    by_load: bool
    controls: Array
    loads: Array
    load_errors: Array
    approaches: Array
    approach_errors: Array
    asperity_loads: Array
    asperity_load_errors: Array
    status: NDArray[np.str_]
    alone: Indices

    def __len__(self) -> int:
        return len(self.scenes)

    def __getitem__(self, k: int) -> Contact:
        """One of them."""
        k = range(len(self))[k]
        known: dict[int, Contact] = self.__dict__.setdefault("_known", {})
        if k not in known:
            name = "load" if self.by_load else "approach"
            start = self.asperity_loads[k]
            known[k] = _pressed(self.scenes[k], name, self.controls[k], start)
        return known[k]

    def cycles(self, maximum: ArrayLike, minimum: ArrayLike | None = None) -> Cycles:
        """The steady cycle of each between shear forces [force], (m,) or one for all.

        minimum : default the negatives of the maxima

        Raises InputError where a scene has no friction, a minimum exceeds its maximum, or either
        exceeds f P in size.

        >>> found = cr.press_many([scene, scene], load=3.6e-7).cycles([9e-8, 4e-8])
        >>> print([f"{loss:.4g}" for loss in found.losses], found.order.tolist())
        ['1.364e-13', '6.542e-15'] ['proved', 'proved']
        """
        m, n = self.status.shape
        upper = checks.array("maximum", maximum, length=m, one="scene")
        lower = -upper
        if minimum is not None:
            lower = checks.array("minimum", minimum, length=m, one="scene")
        f = np.array([checks.friction(scene.friction) for scene in self.scenes])
        for name, forces in (("maximum", upper), ("minimum", lower)):
            for k in np.flatnonzero(np.abs(forces) > f * self.loads).tolist():
                checks.bearable(f"{name}[{k}]", forces[k], float(f[k] * self.loads[k]))
        if (upper < lower).any():
            k = int(np.argmax(upper < lower))
            expected = f"at least the minimum, {lower[k]:g}; by default that is its negative"
            raise InputError(f"maximum[{k}]", found=upper[k], expected=expected)
        fields: dict[str, NDArray[Any]] = {name: np.zeros(m) for name in CYCLE}
        fields["order"] = np.full(m, "proved", dtype="<U19")
        fields["status"], alone = np.full((m, n), "open", dtype="<U12"), np.ones(m, dtype=bool)
        with threads.one_where(MATRICES):
            for rows in self._together:
                good, found = _cycles(rows, upper[rows.places], lower[rows.places], f[rows.places])
                places = rows.places[good]
                alone[places] = False
                for name, values in found.items():
                    fields[name][places] = values[good]
        for k in np.flatnonzero(alone).tolist():
            one = cycle(self[k], maximum=float(upper[k]), minimum=float(lower[k]))
            known = one.loss, one.loss_error, one.displacement_amplitude, one.displacement_error
            for name, value in zip(CYCLE, known, strict=True):
                fields[name][k] = value
            fields["order"][k], fields["status"][k] = one.order, one.status
        fields = {name: frozen(values) for name, values in fields.items()}
        return Cycles(contacts=self, maximum=upper, minimum=lower, **fields)

    @property
    def _together(self) -> list[_Pressed]:
        """Those proved in rows; a copy presses again."""
        if "_pressed" not in self.__dict__:
            self.__dict__["_pressed"] = list(_in_rows(self.scenes, self.controls, self.by_load))
        rows: list[_Pressed] = self.__dict__["_pressed"]
        return rows


#: What is one number for each cycle.
CYCLE = ("losses", "loss_errors", "displacement_amplitudes", "displacement_errors")


@dataclass(frozen=True, eq=False, repr=False)
class Cycles(Table):
    """A steady cycle of each of m contacts, as of `Cycle`. Arrays are (m,), status is (m, n).

    `cycles[k]` is the `Cycle` of one of them.

    >>> cycles = cr.press_many([scene, scene], load=3.6e-7).cycles([9e-8, 4e-8])
    >>> print([f"{loss:.3g}" for loss in cycles.losses], cycles[0].loss == cycles.losses[0])
    ['1.36e-13', '6.54e-15'] True
    """

    _along: ClassVar[Along] = {
        ("scene",): ("maximum", "minimum", *CYCLE, "order"),
        ("scene", "asperity"): ("status",),
    }

    contacts: Contacts
    maximum: Array
    minimum: Array
    losses: Array
    loss_errors: Array
    displacement_amplitudes: Array
    displacement_errors: Array
    order: NDArray[np.str_]
    status: NDArray[np.str_]

    def __len__(self) -> int:
        return len(self.contacts)

    def __getitem__(self, k: int) -> Cycle:
        """One of them."""
        return cycle(
            self.contacts[k], maximum=float(self.maximum[k]), minimum=float(self.minimum[k])
        )


def press_many(
    scenes: Sequence[Scene], *, approach: ArrayLike | None = None, load: ArrayLike | None = None
) -> Contacts:
    """Many scenes with as many asperities, pressed by an approach [length] or a load [force].

    approach or load : one for all, or one for each

    Raises InputError for scenes of different sizes, and what `press` raises.

    >>> contacts = cr.press_many([scene, scene], load=[3e-7, 2e-7])
    >>> bool((contacts[1].loads == contacts.asperity_loads[1]).all())
    True
    """
    checks.exactly_one("approach", approach, "load", load)
    by_load = load is not None
    scenes = tuple(scenes)
    for k, scene in enumerate(scenes):
        checks.instance(f"scenes[{k}]", scene, Scene)
        if len(scene) != len(scenes[0]):
            expected = f"{len(scenes[0])}, as of the first: rows are of one length"
            raise InputError(f"scenes[{k}]", found=f"{len(scene)} asperities", expected=expected)
    m, n = len(scenes), len(scenes[0]) if scenes else 0
    name = "approach" if load is None else "load"
    given = cast("ArrayLike", approach if load is None else load)
    sign = "positive" if by_load else ""
    controls = checks.array(name, given, length=m, sign=sign, one="scene")
    totals = {each: np.zeros(m) for each in TOTALS}
    loads, errors = np.zeros((2, m, n))
    statuses, alone = np.full((m, n), "undecided"), np.ones(m, dtype=bool)
    with threads.one_where(MATRICES):
        rows = list(_in_rows(scenes, controls, by_load))
    for each in rows:
        found, at, units = each.high, each.places, each.problem.units
        alone[at] = False
        loads[at], errors[at] = found.loads.value * units.force, found.loads.error * units.force
        statuses[at] = np.where(
            found.touching, "contact", np.where(found.open, "open", "undecided")
        )
        totals["approaches"][at] = found.approach.value * units.length
        totals["approach_errors"][at] = found.approach.error * units.length
        off = np.abs(loads[at].sum(axis=1) - found.load.value * units.force)
        totals["load_errors"][at] = (off + found.load.error * units.force) * (1 + SAFETY)
    known = dict[int, Contact]()
    for k in np.flatnonzero(alone).tolist():
        one = known[k] = _pressed(scenes[k], name, controls[k])
        proof = one.certificate
        loads[k], errors[k], statuses[k] = one.loads, proof.load_errors, proof.status
        totals["approaches"][k], totals["approach_errors"][k] = one.approach, proof.approach_error
        rounding = n * ROUNDOFF * one.load  # of the sum
        totals["load_errors"][k] = (proof.load_errors.sum() + rounding) * (1 + SAFETY)
    totals["loads"] = loads.sum(axis=1)
    contacts = Contacts(
        scenes=scenes,
        by_load=by_load,
        controls=controls,
        asperity_loads=frozen(loads),
        asperity_load_errors=frozen(errors),
        status=frozen(statuses),
        alone=frozen(np.flatnonzero(alone)),
        **{each: frozen(values) for each, values in totals.items()},
    )
    contacts.__dict__.update(_pressed=rows, _known=known)
    return contacts


#: What is one number for each contact.
TOTALS = ("loads", "load_errors", "approaches", "approach_errors")


def _pressed(scene: Scene, name: str, control: float, start: Array | None = None) -> Contact:
    prescribed: dict[str, Any] = {name: float(control)}
    return press(scene, start=start, **prescribed)


class _Pressed(NamedTuple):
    """Some scenes that were proved in rows.

    places : which of all;  problem : in whose units;  high : their levels
    squares : (m, n) r^2 [length^2]
    """

    places: Indices
    problem: NormalProblem
    stack: Stack
    boxes: Boxes
    high: Rows
    squares: Array


def _in_rows(scenes: Sequence[Scene], controls: Array, by_load: bool) -> Iterator[_Pressed]:
    """Those that are proved in rows."""
    if not scenes or len(scenes[0]) > MOST:
        return
    families: dict[tuple[Any, ...], list[int]] = {}
    for k, scene in enumerate(scenes):
        families.setdefault(_family(scene), []).append(k)
    alike: dict[tuple[Any, ...], list[tuple[NormalProblem, list[int]]]] = {}
    for places in families.values():
        highest = [controls[k] + (0.0 if by_load else scenes[k].offsets.max()) for k in places]
        first = places[int(np.argmax(highest))]
        problem = _leader(scenes[first], float(controls[first]), by_load)
        if problem is not None:
            key = problem.units, *_family(problem.scene)[2:5]
            alike.setdefault(key, []).append((problem, places))
    some = max(1, min(MATRICES // len(scenes[0]) ** 2, stack.NUMBERS // len(scenes[0])))
    for group in alike.values():
        every = [(problem, k) for problem, places in group for k in places]
        for start in range(0, len(every), some):
            yield from _proved(every[start : start + some], scenes, controls, by_load)


def _family(scene: Scene) -> tuple[Any, ...]:
    """Scenes where this is equal differ in heights and friction alone."""
    asperities = scene.asperities
    shape = asperities.positions.tobytes(), asperities.tip_radii.tobytes()
    elastic = scene.material.contact_modulus, scene.material.poisson_ratio
    return *shape, scene.sphere_radius, *elastic, scene.geometry


def _leader(scene: Scene, control: float, by_load: bool) -> NormalProblem | None:
    """Of a family: its problem with all asperities as candidates; None where none can touch."""
    approach, load = (None, control) if by_load else (control, None)
    problem = NormalProblem.assemble(scene, approach=approach, load=load, influence="dense")
    return problem.widened(np.arange(len(scene))) if len(problem) else None


def _proved(
    every: Sequence[tuple[NormalProblem, int]],
    scenes: Sequence[Scene],
    controls: Array,
    by_load: bool,
) -> Iterator[_Pressed]:
    """Of one stack, in units of the first."""
    first, places = every[0][0], np.array([k for _, k in every])
    n, units = len(first), first.units
    coupled, offsets, known = list[tuple[slice, NormalProblem]](), list[Ball](), list[Ball]()
    wells, start = list[Array](), 0
    for _, group in groupby(every, key=lambda each: id(each[0])):
        family = list(group)
        problem, m = family[0][0], len(family)
        coupled.append((slice(start, start + m), problem))
        offsets.append(_offsets(problem, [scenes[k] for _, k in family]))
        known.append(stack.of_rows(partial(_repeated, shape=(m, n)), problem.exact.coefficients))
        wells.append(_repeated(problem.shells, shape=(m, n)))
        start += m
    unit = units.force if by_load else units.length
    given = Ball.exact(controls[places][:, None]).scaled(1.0 / unit)
    total, depth = (given, None) if by_load else (None, given)
    shelled = np.concatenate(wells)
    rows = Stack(coupled, joined(known), joined(offsets), shelled, total, depth)
    squares = np.array([scenes[k].asperities.distances for k in places]) ** 2
    if by_load:
        prescribed, reach = rows.offsets.value, _reach(first, given.value)
    else:
        prescribed = rows.offsets.value + given.value
        reach = first.scene.mean_radius * np.maximum(given.value, 0.0) * units.length
    guess = stack.guessed(rows, prescribed, squares, reach)
    state = stack.refined(rows, stack.pressed(rows, guess))
    boxes = stack.widest(rows, state)
    found = stack.proved(rows, state, boxes)
    good = np.flatnonzero(found.good)
    if len(good):
        high = found.rows if total is None else found.rows._replace(load=total[:, 0])
        chosen = rows.only(good), Boxes._make(each[good] for each in boxes), high.at(good)
        yield _Pressed(places[good], first, *chosen, squares[good])


def _repeated(values: Array, shape: tuple[int, int]) -> Array:
    return np.array(np.broadcast_to(values, shape))


def _offsets(problem: NormalProblem, rows: Sequence[Scene]) -> Ball:
    """(m, n) d of scenes that differ in heights, as `NormalProblem.exact` has them."""
    scene, length = problem.scene, problem.units.length
    if len(rows) == 1 and rows[0] is scene:
        return problem.exact.offsets[None, :]
    bare = replace(scene, asperities=scene.asperities.with_tips(scene.asperities.tip_radii, 0.0))
    drops = replace(problem, scene=bare).twofold_offsets()  # below 0
    heights = np.array([each.asperities.heights for each in rows]) / length
    offsets = Pair.exact(heights) + Pair(*(part[None, :] for part in drops))
    sizes = np.abs(offsets.high) + 6.0 * (np.abs(heights) + np.abs(drops.high))
    return Ball.around(offsets, 2.0**-98 * sizes)


def _reach(problem: NormalProblem, loads: Array) -> Array:
    """a^2 of smooth contacts [length^2]."""
    scene, force = problem.scene, loads * problem.units.force
    a = hertz.contact_radius(force, scene.material.contact_modulus, scene.mean_radius)
    return np.asarray(a**2)


def _cycles(
    pressed: _Pressed, upper: Array, lower: Array, friction: Array
) -> tuple[NDArray[np.bool_], dict[str, NDArray[Any]]]:
    """The cycles of those pressed in rows, and which of them are proved."""
    problem, high, units = pressed.problem, pressed.high, pressed.problem.units
    f, nu = Ball.exact(friction), Ball.exact(problem.scene.material.poisson_ratio)
    half = (Ball.exact(upper) - Ball.exact(lower)) * 0.5
    drop = (half / f).scaled(1.0 / units.force)
    total = high.load - drop
    inside = (half.value > 0) & (total.value > AT_THE_END * ROUNDOFF * high.load.value)
    total = where(inside, total, high.load)[:, None]  # others are done one by one
    rows = replace(pressed.stack, total=total, depth=None)
    guess = stack.guessed(rows, rows.offsets.value, pressed.squares, _reach(problem, total.value))
    state = stack.refined(rows, stack.pressed(rows, guess))
    found = stack.proved(rows, state, pressed.boxes.closed)
    low = found.rows._replace(load=total[:, 0])
    ordered = proved_in_rows(rows, pressed.boxes, high, low)
    slip, slide = asperity_losses(high, low)
    travel = f * ((2.0 - nu) / ((1.0 - nu) * 2.0)) * units.length
    loss = (slip + slide).sum() * 4.0 * (f * units.force) * travel
    moved = (high.approach - low.approach) * travel
    statuses = np.where(high.open, "open", np.full(high.open.shape, "undecided", dtype="<U12"))
    statuses[high.touching & low.touching] = "partial"
    statuses[high.touching & low.open] = "sliding"
    return found.good & ordered & inside, {
        "losses": loss.value,
        "loss_errors": loss.error,
        "displacement_amplitudes": moved.value,
        "displacement_errors": moved.error,
        "status": statuses,
    }
