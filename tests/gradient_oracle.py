"""Contacts, friction states and losses in 130 digits, for differences of them: the test oracle.

Written from the formulas of physics alone, in the scene's own units, and sharing no code with the
package: Hertz's law k P^(2/3), Boussinesq's coupling, Mindlin's law at constant load, odd in the
force, and the loss as eight times the error of the trapezoid rule. Who touches and who slides is
taken from a state in float64 and must not change within a step.
"""

import itertools
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import numpy as np
from flint import arb, arb_mat, ctx

import convexrough as cr
from convexrough.arrays import Array

DIGITS = 130
STEP = "1e-25"  # of each parameter over its own size
Balls: TypeAlias = Any  # an arb, or an object array of arb

exact = np.vectorize(lambda value: arb(float(value)), otypes=[object])


@dataclass(frozen=True)
class Setup:
    """Everything a result depends on; `control` is P or D0, `forces` are shear forces."""

    positions: Balls
    tip_radii: Balls
    heights: Balls
    sphere_radius: Balls
    contact_modulus: Balls
    poisson_ratio: Balls
    friction: Balls
    control: Balls
    forces: Balls
    geometry: str
    by_load: bool

    @classmethod
    def of(cls, contact: cr.Contact, holding: str, forces: Any = ()) -> "Setup":
        scene, material = contact.scene, contact.scene.material
        prescribed = contact.prescribed_load
        load = contact.load if prescribed is None else prescribed
        control = load if holding == "load" else contact.approach
        numbers = scene.sphere_radius, material.contact_modulus, material.poisson_ratio
        return cls(
            exact(scene.asperities.positions),
            exact(scene.asperities.tip_radii),
            exact(scene.asperities.heights),
            *(arb(float(value)) for value in (*numbers, scene.friction or 1.0, control)),
            exact(np.asarray(forces, dtype=float)) if np.size(forces) else np.zeros(0, object),
            scene.geometry,
            holding == "load",
        )

    def moved(self, name: str, by: Balls) -> "Setup":
        return replace(self, **{name: getattr(self, name) + by})


class Oracle:
    """The state of a setup, solved from one near it, in multiprecision.

    near : loads (n,) and the approach; of another oracle, or of a contact
    """

    def __init__(self, setup: Setup, loads: Balls, approach: Balls, steps: int = 4) -> None:
        s = self.setup = setup
        self.touching = np.flatnonzero([bool(load > 0) for load in loads])
        rho, R, E = s.tip_radii, s.sphere_radius, s.contact_modulus
        self.k = cube_root(arb(9) / 16 / (E * E) * (1 / R + 1 / rho))
        r2 = (s.positions**2).sum(axis=1)
        closest = s.geometry == "closest"
        far = R + rho if closest else R + 0 * rho
        points = s.positions * (R / (R + rho))[:, None] if closest else s.positions
        self.offsets = s.heights - r2 / (2 * far)
        apart = points[:, None, :] - points[None, :, :]
        squares = (apart * apart).sum(axis=2)
        np.fill_diagonal(squares, arb(1))
        self.A = 1 / (arb.pi() * E * np.sqrt(squares))
        np.fill_diagonal(self.A, arb(0))
        on = self.touching
        self.inner = self.A[np.ix_(on, on)]
        self.P, self.approach = self._press(mid(loads[on]), approach, steps)
        self.thresholds = self.k[on] * cube_root(self.P) ** 2

    def _press(self, P: Balls, approach: Balls, steps: int) -> tuple[Balls, Balls]:
        k, d, s = self.k[self.touching], self.offsets[self.touching], self.setup
        approach = approach if s.by_load else s.control
        for _ in range(steps):
            root = cube_root(P)
            defect = k * root**2 + self.inner @ P - d - approach
            n = len(P)
            matrix = np.full((n + 1, n + 1), arb(0))
            matrix[:n, :n] = self.inner + np.diag(2 * k / (3 * root))
            matrix[:n, n] = arb(-1)
            matrix[n, :n], right = arb(1), np.append(defect, P.sum() - s.control)
            if not s.by_load:
                matrix, right = matrix[:n, :n], defect
            step = solve(matrix, right)
            P = mid(P - step[:n])
            approach = (approach - step[n]).mid() if s.by_load else approach
        return P, approach

    @property
    def loads(self) -> Balls:
        full = np.full(len(self.offsets), arb(0))
        full[self.touching] = self.P
        return full

    @property
    def gaps(self) -> Balls:
        gaps = self.A @ self.loads - self.offsets - self.approach
        gaps[self.touching] = arb(0)
        return gaps

    @property
    def smooth_loss(self) -> Balls:
        """W0 = 9 (2 - nu) f^2 P^2 / (5 G a), G = (1 - nu) E*, a that of the smooth sphere."""
        s, P = self.setup, self.P.sum()
        a = (3 * P * s.sphere_radius / (4 * s.contact_modulus)).root(3)
        nu, f = s.poisson_ratio, s.friction
        return 9 * (2 - nu) * f * f * P * P / (5 * (1 - nu) * s.contact_modulus * a)

    @property
    def ratio(self) -> Balls:
        nu = self.setup.poisson_ratio
        return (2 - nu) / (2 * (1 - nu))

    def friction(self, T: Balls, eta: Balls, steps: int = 4) -> "Sheared":
        """The increments u with sum T: eta + A u(eta) = Delta, from eta near it."""
        C, n, displacement = self.thresholds, len(self.P), arb(0)
        eta = mid(eta)
        for step in range(steps + 1):
            size = np.array([abs(e) for e in eta]) / C
            left = np.sqrt(np.array([max(1 - (z.mid()), arb(0)) for z in size]))
            sign = np.array([arb(1 if e > 0 else -1) for e in eta])
            u, c = sign * self.P * (1 - left**3), 3 * self.P * left / (2 * C)
            if step == steps:
                break
            matrix = np.full((n + 1, n + 1), arb(0))
            matrix[:n, :n] = self.inner * c + np.diag(np.full(n, arb(1)))
            matrix[:n, n], matrix[n, :n] = arb(-1), c
            change = solve(matrix, np.append(eta + self.inner @ u - displacement, u.sum() - T))
            eta, displacement = mid(eta - change[:n]), (displacement - change[n]).mid()
        return Sheared(self, T, eta, u, displacement)


@dataclass(frozen=True)
class Sheared:
    """A friction state, in the scene's units over f or c_t f; delta is X over c_t f."""

    oracle: Oracle
    T: Balls
    eta: Balls
    u: Balls
    delta: Balls

    @property
    def displacement(self) -> Balls:
        return self.oracle.ratio * self.oracle.setup.friction * self.delta

    @property
    def forces(self) -> Balls:
        return self.oracle.setup.friction * self.u

    @property
    def slips(self) -> Balls:
        beyond = [
            e - c if e > c else e + c if e < -c else arb(0)
            for e, c in zip(self.eta, self.oracle.thresholds, strict=True)
        ]
        return self.oracle.ratio * self.oracle.setup.friction * np.array(beyond)

    @property
    def loss(self) -> Balls:
        """8 c_t f^2 (T Delta / 2 - Psi)."""
        P, u = self.oracle.P, self.u
        t = np.array([abs(each) for each in u / P])
        left = np.array([max((1 - each).mid(), arb(0)) for each in t])
        psi = t - arb(3) / 5 * (1 - cube_root(left) ** 5)
        energy = (P * self.oracle.thresholds * psi).sum() + (u @ (self.oracle.inner @ u)) / 2
        f = self.oracle.setup.friction
        return 8 * self.oracle.ratio * f * f * (self.T * self.delta / 2 - energy)


@dataclass(frozen=True)
class Past:
    """A history by Masing's rule, in multiprecision.

    forces : (m,) Q;  etas : deflections at each T that was asked for, to start from
    """

    oracle: Oracle
    forces: Balls
    etas: dict[tuple[int, int], Balls]

    def state(self, i: int, j: int) -> Sheared:
        """First loading to T = |Q_i - Q_j| / 2 f, or to |Q_i| / f where j is -1."""
        friction = self.oracle.setup.friction
        T = abs(self.forces[i]) if j < 0 else abs(self.forces[i] - self.forces[j]) / 2
        found = self.oracle.friction(T / friction, self.etas[i, j], 4)
        self.etas[i, j] = found.eta
        return found

    @property
    def displacements(self) -> Balls:
        """By the extremes that are remembered: the farthest, the farthest back since, and on."""
        found = []
        for m in range(len(self.forces)):
            extremes, begin, ahead = [-1], 0, 0
            while begin <= m:
                left = range(begin, m + 1)
                size = [float(self.forces[i]) * (ahead or 1) for i in left]
                if not ahead:
                    size = [abs(each) for each in size]
                farthest = max(left, key=lambda i: (size[i - begin], i))
                extremes.append(farthest)
                ahead = -ahead or (-1 if self.forces[farthest] > 0 else 1)
                begin = farthest + 1
            X = arb(0)
            for before, after in itertools.pairwise(extremes):
                step = self.forces[after] - (self.forces[before] if before >= 0 else 0)
                if step != 0:
                    sign = (1 if step > 0 else -1) * (1 if before < 0 else 2)
                    X += sign * self.state(after, before).displacement
            found.append(X)
        return np.array(found)

    @property
    def energies(self) -> Balls:
        """A branch costs half of a cycle of its range, first loading a quarter."""
        found, lost, turns, now = [], arb(0), [], -1
        for m, force in enumerate(self.forces):
            here = self.forces[now] if now >= 0 else arb(0)
            if force != here:
                up = 1 if force > here else -1
                if now >= 0 and self._direction(turns, now) != up:
                    turns.append(now)
                lost += self._along(turns, now, m, up)
            found.append(lost)
            now = m
        return np.array(found)

    def _direction(self, turns: list[int], now: int) -> int:
        before = self.forces[turns[-1]] if turns else 0
        return 1 if self.forces[now] > before else -1

    def _along(self, turns: list[int], now: int, to: int, up: int) -> Balls:
        """From one force to another, over the branches that close in between."""
        lost = arb(0)
        while turns:
            turn = turns[-1]
            closing = self.forces[turns[-2]] if len(turns) > 1 else -self.forces[turn]
            lost -= self._half(now, turn)
            if up * (self.forces[to] - closing) < 0:
                return lost + self._half(to, turn)
            lost += self._half(turns[-2], turn) if len(turns) > 1 else self._half(turn, -1)
            now = turns[-2] if len(turns) > 1 else turn
            del turns[-2:]
        return lost + (self._half(to, -1) - self._half(now, -1)) / 2

    def _half(self, i: int, j: int) -> Balls:
        return self.state(i, j).loss / 2 if i >= 0 and i != j else arb(0)


class Judge:
    """Derivatives of a number by differences of it: value(setup, near) -> (number, state)."""

    def __init__(self, setup: Setup, value: Callable[[Setup, Any], tuple[Balls, Any]]) -> None:
        self.setup, self.value = setup, value
        with ctx.workdps(DIGITS):
            self.at, self.near = value(setup, None)

    def slope(self, name: str, direction: Balls) -> float:
        """The derivative along `direction` of one parameter, as a float."""
        return float(self.difference(name, direction))

    def difference(self, name: str, direction: Balls) -> Balls:
        """The same to 100 digits."""
        with ctx.workdps(DIGITS):
            h = arb(STEP)
            ends = [
                self.value(self.setup.moved(name, s * h * direction), self.near) for s in (1, -1)
            ]
            return ((ends[0][0] - ends[1][0]) / (2 * h)).mid()

    def off(self, name: str, direction: Balls, slopes: Array) -> float:
        """How far slopes times a direction are from that, not rounded in between."""
        found = self.difference(name, direction)
        with ctx.workdps(DIGITS):
            return float(abs((exact(slopes) * direction).sum() - found))


def press(contact: cr.Contact, setup: Setup, near: Oracle | None) -> Oracle:
    if near is None:
        return Oracle(setup, exact(contact.loads), arb(contact.approach), 5)
    return Oracle(setup, near.loads, near.approach, 3)


def cube_root(values: Balls) -> Balls:
    return np.vectorize(lambda v: arb(0) if v == 0 else v.root(3), otypes=[object])(values)


def mid(values: Balls) -> Balls:
    return np.vectorize(lambda v: v.mid(), otypes=[object])(values)


def solve(matrix: Balls, right: Balls) -> Balls:
    column = arb_mat(len(right), 1, list(right))
    return np.array(arb_mat(matrix.tolist()).solve(column, algorithm="approx").entries())


def sheared(contact: cr.Contact, holding: str, force: float) -> Callable[[Setup, Any], Sheared]:
    """From a setup, whose first force is Q, and a state near it to the friction state at Q / f."""
    state, scene = cr.shear(contact, force=abs(force)), contact.scene
    nu, on = scene.material.poisson_ratio, np.flatnonzero(contact.loads)
    travel = (2 - nu) / (2 * (1 - nu)) * (scene.friction or 1.0)

    def solved(setup: Setup, near: Sheared | None) -> Sheared:
        oracle = press(contact, setup, None if near is None else near.oracle)
        start, steps = (
            (exact(state.displacements[on] / travel), 6) if near is None else (near.eta, 3)
        )
        return oracle.friction(setup.forces[0] / setup.friction, start, steps)

    return solved


def remembered(contact: cr.Contact) -> Callable[[Setup, Any], Past]:
    """From a setup, whose forces are those of a history, and a past near it to its past."""

    def solved(setup: Setup, near: Past | None) -> Past:
        oracle = press(contact, setup, None if near is None else near.oracle)
        etas = _Starts(contact, setup.forces)
        etas.update({} if near is None else near.etas)
        return Past(oracle, setup.forces, etas)

    return solved


class _Starts(dict[tuple[int, int], Balls]):
    """Deflections to start from, of float64 states."""

    def __init__(self, contact: cr.Contact, forces: Balls) -> None:
        super().__init__()
        self.contact, self.forces = contact, [float(force) for force in forces]

    def __missing__(self, pair: tuple[int, int]) -> Balls:
        (i, j), Q, scene = pair, self.forces, self.contact.scene
        state = cr.shear(self.contact, force=abs(Q[i]) if j < 0 else abs(Q[i] - Q[j]) / 2)
        nu = scene.material.poisson_ratio
        travel = (2 - nu) / (2 * (1 - nu)) * (scene.friction or 1.0)
        return exact(state.displacements[np.flatnonzero(self.contact.loads)] / travel)


#: Names of the bounds on derivatives.
ERRORS = {"heights": "height_errors", "tip_radii": "tip_radius_errors"}
ERRORS |= {"positions": "position_errors", "forces": "force_errors", "loads": "load_errors"}


def known(gradient: cr.Gradient, name: str) -> tuple[Array, Array]:
    """A derivative and its bound."""
    error = ERRORS.get(name, f"{name}_error")
    return np.asarray(getattr(gradient, name)), np.asarray(getattr(gradient, error))


def assert_slopes(
    judge: Judge, gradient: cr.Gradient, *, seed: int = 0, sharp: float = 0.0
) -> None:
    """Every derivative within its bound of differences, arrays along random signs.

    sharp : what no bound may exceed of the largest derivative of its kind; 0 for any
    """
    rng = np.random.default_rng(seed)
    names = ["heights", "tip_radii", "positions", "sphere_radius", "contact_modulus"]
    names += ["poisson_ratio"] + ["friction"] * (gradient.friction is not None)
    for name in [*names, "control"]:
        slopes, errors = known(gradient, gradient.holding if name == "control" else name)
        v = rng.choice([-1.0, 1.0], size=slopes.shape)
        assert_close(judge.difference(name, exact(v)[()]), slopes * v, errors, name, sharp)


def assert_close(true: Balls, terms: Any, errors: Any, name: str, sharp: float = 0.0) -> None:
    """A difference, and terms whose sum it is within their errors."""
    with ctx.workdps(DIGITS):
        off = float(abs(exact(terms).sum() - true))
    # The difference itself has some 20 digits.
    assert off <= errors.sum() + 1e-18 * abs(float(true)), (name, off, errors.sum(), float(true))
    if sharp:
        assert errors.max() <= sharp * np.abs(terms).max() + 1e-200, name
