"""Shear cycles and histories at constant normal load: loops, memory, and the energy they cost.

Everything is looked up in one family, the states of first loading at total increment T (Masing's
rule). On a branch from a turning point Q1 to Q, with T = |Q - Q1| / (2 f),

    Q_i = Q_i(Q1) -+ 2 f u_i(T),  X = X(Q1) -+ 2 c_t f rise(T),  s_i = s_i(Q1) -+ 2 c_t f slip_i(T).

A branch that reaches the previous turning point closes its loop; both points are forgotten and the
older branch goes on. A cycle of amplitude T costs 8 c_t f^2 w(T), a branch half of that, and first
loading a quarter, with w(T) = T rise(T) / 2 - Psi(T) and Psi the energy of the increments: the
error of the trapezoid rule on the curve of rise against T.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from convexrough import checks, hertz
from convexrough.checks import Array, frozen
from convexrough.contact import Contact
from convexrough.errors import InputError
from convexrough.shear import check_force, coefficient
from convexrough.shear_certificate import judge_states
from convexrough.tangential import States, TangentialProblem


class _Family:
    """First-loading states of one contact, in the scene's units."""

    def __init__(self, contact: Contact) -> None:
        self.contact = contact
        self.friction = coefficient(contact)
        self.problem = TangentialProblem.of(contact)
        ratio = hertz.mindlin_ratio(contact.scene.material.poisson_ratio)
        self.force_unit = self.friction * self.problem.units.force
        self.length_unit = ratio * self.friction * self.problem.units.length
        self.energy_unit = 8.0 * self.force_unit * self.length_unit

    def states(self, totals: Array) -> States:
        """One state for each T, each distinct T solved once."""
        distinct, back = np.unique(totals, return_inverse=True)
        return States(*(field[back] for field in self.problem.solve(distinct)))

    def spread(self, values: Array, unit: float) -> Array:
        """(m, n) values of the loaded asperities, among zeros for all others of the scene."""
        full = np.zeros((len(values), len(self.contact.scene)))
        full[:, self.problem.touching] = values * unit
        return full

    def partial_slip(self, states: States) -> Array:
        """(m, n) share of w(T) lost in partial slip: (3/5) P ceiling e(u / P)."""
        problem = self.problem
        shares = hertz.loss(np.abs(states.increments) / problem.loads)
        return np.asarray(0.6 * problem.loads * problem.ceilings * shares)

    def sliding(self, states: States) -> Array:
        """(m, n) share of w(T) lost in sliding: P slip / 2."""
        return 0.5 * self.problem.loads * np.abs(states.slips)

    def trapezoid_error(self, states: States) -> Array:
        """(m,) w(T) = T rise / 2 - Psi, from the totals and not asperity by asperity.

        Both terms are of second order and their difference of third. So subtract from each the
        elastic part, which cancels exactly: with q the elastic shares and u = q T + v,

            rise = rise'(0) T + sum q_i (excess deflection_i + slip_i),
            Psi  = rise'(0) T^2 / 2 + sum excess potential_i + v'(H + A) v / 2.
        """
        problem, q = self.problem, self.problem.elastic
        P, ceilings, u = problem.loads, problem.ceilings, states.increments
        t = np.abs(u) / P
        total = u.sum(axis=1)
        excess = np.copysign(ceilings * hertz.excess_deflection(t), u) + states.slips
        v = u - total[:, None] * q
        v -= v.sum(axis=1, keepdims=True) * q
        bent = problem.couple(v) + 2.0 / 3.0 * ceilings / P * v
        potential = hertz.excess_potential(t) @ (P * ceilings)
        return np.asarray(0.5 * total * (excess @ q) - potential - 0.5 * (v * bent).sum(axis=1))


@dataclass(frozen=True, eq=False)
class Loop:
    """Points of a closed loop, from the maximum to the minimum and back.

    forces : (m,) Q [force];  displacements : (m,) X [length], both bodies
    asperity_forces : (m, n) Q_i [force]
    asperity_displacements : (m, n) X_i + slip_i [length]
    """

    forces: Array
    displacements: Array
    asperity_forces: Array
    asperity_displacements: Array

    @property
    def area(self) -> float:
        """[force length] of the polygon through the points: the loss, from inside."""
        return float(np.trapezoid(self.forces, self.displacements))


@dataclass(frozen=True, eq=False)
class Cycle:
    """A steady cycle between two shear forces. Arrays are (n,), in the scene's order.

    maximum, minimum       : [force]
    energy                 : lost per cycle, both bodies [force length]: asperity by asperity
    partial_slip_energies  : [force length] of each asperity's partial slip
    sliding_energies       : [force length] of each asperity's gross slip
    balance_defect         : relative difference to the energy from the trapezoid error
    energy_normalised      : energy / W0, W0 = 9 (2 - nu) f^2 P^2 / (5 G a_H)
    smooth_normalised      : the same for the smooth sphere, e((maximum - minimum) / (2 f P))
    status                 : "sliding" in each half of the cycle, "partial", "open", "undecided"
    """

    contact: Contact
    maximum: float
    minimum: float
    energy: float
    partial_slip_energies: Array
    sliding_energies: Array
    balance_defect: float
    energy_normalised: float
    smooth_normalised: float
    status: NDArray[np.str_]

    @property
    def energies(self) -> Array:
        """(n,) [force length] lost at each asperity."""
        return frozen(self.partial_slip_energies + self.sliding_energies)

    def loop(self, points: int = 200) -> Loop:
        """The loop through about `points` points, as many down as up."""
        down = np.linspace(self.maximum, self.minimum, max(2, points // 2 + 1))
        there_and_back = [self.maximum, self.minimum]
        if abs(self.minimum) > abs(self.maximum):
            there_and_back.insert(0, self.minimum)
        path = np.concatenate((there_and_back[:-1], down[1:], down[-2::-1]))
        past = history(self.contact, forces=path)
        body = slice(len(there_and_back) - 2, None)
        return Loop(
            forces=frozen(path[body]),
            displacements=past.displacements[body],
            asperity_forces=past.forces[body],
            asperity_displacements=past.asperity_displacements[body],
        )


def cycle(contact: Contact, *, maximum: float, minimum: float | None = None) -> Cycle:
    """The steady cycle between two shear forces [force]; `minimum` defaults to -maximum.

    Raises InputError where the scene has no friction, the minimum exceeds the maximum, or either
    exceeds f P in size.
    """
    return cycles(contact, [maximum], None if minimum is None else [minimum])[0]


def cycles(contact: Contact, maximum: ArrayLike, minimum: ArrayLike | None = None) -> list[Cycle]:
    """`cycle` for many amplitudes at once: (m,) maxima, and minima if not the negatives."""
    upper = checks.array("maximum", maximum)
    lower = -upper if minimum is None else checks.array("minimum", minimum, length=len(upper))
    for i, (high, low) in enumerate(zip(upper, lower, strict=True)):
        check_force(contact, f"maximum[{i}]", high)
        check_force(contact, f"minimum[{i}]", low)
        if low > high:
            raise InputError(f"minimum[{i}]", found=low, expected=f"at most the maximum {high}")
    if contact.load == 0.0:
        return [_empty(contact, high, low) for high, low in zip(upper, lower, strict=True)]

    family = _Family(contact)
    problem, scene = family.problem, contact.scene
    totals = problem.limited((upper - lower) / (2.0 * family.force_unit))
    states = family.states(totals)
    bounds = judge_states(problem, contact.certificate, states)
    slip = family.spread(family.partial_slip(states), family.energy_unit)
    slide = family.spread(family.sliding(states), family.energy_unit)
    energies = (slip + slide).sum(axis=1)
    others = family.energy_unit * family.trapezoid_error(states)
    defects = np.abs(others - energies) / np.where(energies > 0, energies, 1.0)
    radius_law = hertz.local_coefficient(scene.material.contact_modulus, scene.sphere_radius)
    ratio = hertz.mindlin_ratio(scene.material.poisson_ratio)
    whole = 4.8 * ratio * family.friction**2 * radius_law * contact.load ** (5 / 3)  # W0
    words = np.full(slip.shape, "undecided", dtype="<U9")
    words[:, contact.status == "open"] = "open"
    inside = words[:, problem.touching]
    inside[bounds.partial], inside[bounds.sliding] = "partial", "sliding"
    words[:, problem.touching] = inside
    return [
        Cycle(
            contact=contact,
            maximum=float(upper[i]),
            minimum=float(lower[i]),
            energy=float(energies[i]),
            partial_slip_energies=frozen(slip[i]),
            sliding_energies=frozen(slide[i]),
            balance_defect=float(defects[i]),
            energy_normalised=float(energies[i] / whole),
            smooth_normalised=float(hertz.loss(totals[i] / problem.loads.sum())),
            status=frozen(words[i]),
        )
        for i in range(len(upper))
    ]


def _empty(contact: Contact, maximum: float, minimum: float) -> Cycle:
    zero = frozen(np.zeros(len(contact.scene)))
    return Cycle(contact, maximum, minimum, 0.0, zero, zero, 0.0, 0.0, 0.0, contact.status)


@dataclass(frozen=True, eq=False)
class History:
    """A sequence of shear forces from 0, monotonic from each to the next.

    applied       : (m,) Q [force]
    displacements : (m,) X [length], both bodies
    forces        : (m, n) Q_i [force]
    asperity_displacements : (m, n) X_i + slip_i [length]
    slips         : (m, n) gross slip [length]
    energy        : (m,) lost since the beginning [force length]
    """

    contact: Contact
    applied: Array
    displacements: Array
    forces: Array
    asperity_displacements: Array
    slips: Array
    energy: Array


class _Step(NamedTuple):
    """How one step is looked up: state = base + scale * family(total)."""

    base: int  # the step at the turning point, -1 for the virgin state
    scale: float  # +-2 on a branch, +-1 on first loading
    total: float  # T
    lost: list[tuple[float, float]]  # (factor, T): the step costs sum factor * w(T)


def history(contact: Contact, *, forces: ArrayLike) -> History:
    """Any sequence of shear forces (m,) [force], |Q| <= f P, from the freshly pressed contact."""
    applied = checks.array("forces", forces)
    for i, force in enumerate(applied):
        check_force(contact, f"forces[{i}]", force)
    if contact.load == 0.0 or len(applied) == 0:
        none = frozen(np.zeros((len(applied), len(contact.scene))))
        zero = frozen(np.zeros(len(applied)))
        return History(contact, applied, zero, none, none, none, zero)
    family = _Family(contact)
    steps = _remember(applied / family.force_unit)
    totals = [step.total for step in steps]
    costs = [total for step in steps for _, total in step.lost]
    distinct, back = np.unique(
        family.problem.limited(np.array(totals + costs)), return_inverse=True
    )
    states = family.problem.solve(distinct)
    w = (family.partial_slip(states) + family.sliding(states)).sum(axis=1)
    deflections = family.problem.deflections(states.increments) + states.slips

    looked_up = (states.rises[:, None], states.increments, deflections, states.slips)
    results = [np.empty((len(steps), field.shape[1])) for field in looked_up]
    energy, spent = np.empty(len(steps)), iter(back[len(steps) :])
    lost = 0.0
    for m, step in enumerate(steps):
        for result, field in zip(results, looked_up, strict=True):
            base = result[step.base] if step.base >= 0 else 0.0
            result[m] = base + step.scale * field[back[m]]
        lost += sum(factor * w[next(spent)] for factor, _ in step.lost)
        energy[m] = lost
    rises, increments, deflections, slips = results
    return History(
        contact=contact,
        applied=applied,
        displacements=frozen(rises[:, 0] * family.length_unit),
        forces=frozen(family.spread(increments, family.force_unit)),
        asperity_displacements=frozen(family.spread(deflections, family.length_unit)),
        slips=frozen(family.spread(slips, family.length_unit)),
        energy=frozen(energy * family.energy_unit),
    )


def _remember(applied: Array) -> list[_Step]:
    """Masing's rule with memory: which turning point each step hangs on. T-units: Q / f.

    The stack holds turning points (Q, step) that are not yet wiped out. The costs of a step are
    differences of w along the branches it runs through: 1/4 of a cycle on first loading, 1/2 on
    a branch.
    """
    stack: list[tuple[float, int]] = []
    steps: list[_Step] = []
    now = 0.0
    for m, target in enumerate(applied):
        origin, direction = now, np.sign(target - now)
        heading = np.sign(now - stack[-1][0]) if stack else np.sign(now)
        if direction != 0 and heading == -direction:
            stack.append((now, m - 1))  # a new turning point
        lost: list[tuple[float, float]] = []
        while stack:
            turn = stack[-1][0]
            # The branch closes where it meets the point before; the first one, on first loading.
            close = stack[-2][0] if len(stack) > 1 else -turn
            end = min(target * direction, close * direction) * direction
            lost += [(0.5, abs(end - turn) / 2), (-0.5, abs(origin - turn) / 2)]
            if direction == 0 or target * direction < close * direction:
                break
            origin = close
            del stack[-2:]
        if not stack:
            lost += [(0.25, abs(target)), (-0.25, abs(origin))]
            steps.append(_Step(-1, float(np.sign(target)), abs(target), lost))
        else:
            turn, step = stack[-1]
            total = abs(target - turn) / 2
            steps.append(_Step(step, 2.0 * float(np.sign(target - turn)), total, lost))
        now = target
    return steps


def onset_of_sliding(contact: Contact) -> Array:
    """(n,) [force] the shear force at which each asperity starts to slide on first loading.

    The same as the amplitude (maximum - minimum) / 2 of a steady cycle below which its sliding has
    shaken down to partial slip. nan where the asperity carries no load.
    """
    from scipy.optimize.elementwise import find_root  # 0.1 s to import: only when asked

    onsets = np.full(len(contact.scene), np.nan)
    if contact.load == 0.0:
        return frozen(onsets)
    family = _Family(contact)
    problem = family.problem
    limit = float(problem.loads.sum())

    def beyond(totals: Array, index: Array) -> Array:
        states = problem.solve(totals)
        rows = np.arange(len(totals))
        which = index.astype(int)
        margin: Array = states.deflections[rows, which] - problem.ceilings[which]
        return margin

    n = len(problem.loads)
    found = find_root(
        beyond,
        (np.zeros(n), np.full(n, limit)),
        args=(np.arange(n),),
        tolerances={"xrtol": 1e-15, "xatol": 0.0, "frtol": 0.0, "fatol": 0.0},
    )
    onsets[problem.touching] = found.x * family.force_unit
    return frozen(onsets)
