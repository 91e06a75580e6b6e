"""Normal solutions at any load in 100 digits and all that friction makes of them: the reference.

At a total load L: loads P_i, approach D0, gaps, energy V = sum (3/5) k P^(5/3) + P'AP/2 - d'P, and
its tangent (2k/(3 P^(1/3)) + A) q = S, sum q = 1. Of two such levels, P above and L = P - Q/f:

    Q_i = f (P_i(P) - P_i(L)),   X = c_t f (D0(P) - D0(L)),   slip_i = c_t f gap_i(L),
    W = 8 c_t f^2 [V(P) - V(L) - T (D0(P) + D0(L)) / 2],      T = Q / f,

where every indentation grows with the load. Where one does not, `Bristles` follows the load in
steps and remembers. Nothing of the package is used but float64 loads to begin Newton at.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache, cached_property, wraps
from typing import Any, Literal, NamedTuple

import numpy as np
from flint import arb, ctx
from friction_scenes import FRICTION, with_friction
from gradient_oracle import DIGITS, Balls, Oracle, Setup, cube_root, exact, solve
from scenes import MATERIAL, NAMED

import convexrough as cr
from convexrough.arrays import Array

Holding = Literal["load", "approach"]

#: name -> (scene, approach), with friction; "dense" has the crowding 0.88.
SCENES = {name: (with_friction(scene), approach) for name, (scene, approach) in NAMED.items()}
SCENES["dense"] = (
    with_friction(
        cr.Scene(
            1.0,
            cr.Asperities.hexagonal(
                spacing=0.0025, tip_radius=0.07, within=0.0102, height_std=1e-6, seed=3
            ),
            MATERIAL,
            geometry="summit",
        )
    ),
    5e-5,
)


class Slopes(NamedTuple):
    """Derivatives of a number by everything it depends on; `control` is the load or approach."""

    heights: Balls
    tip_radii: Balls
    positions: Balls
    sphere_radius: Balls
    contact_modulus: Balls
    poisson_ratio: Balls
    friction: Balls
    control: Balls
    force: Balls


def in_digits(function: Callable[..., Any]) -> Callable[..., Any]:
    """The function, evaluated in DIGITS wherever it is called."""

    @wraps(function)
    def inside(*arguments: Any) -> Any:
        with ctx.workdps(DIGITS):
            return function(*arguments)

    return inside


class Level(Oracle):
    """The normal solution of a setup; who touches is taken from float64 and then proved by signs.

    start : a contact of the same scene, pressed nearly as the setup asks
    """

    def __init__(self, setup: Setup, start: cr.Contact) -> None:
        super().__init__(setup, exact(start.loads), arb(start.approach), 7)
        left = self.thresholds + self.inner @ self.P - self.offsets[self.touching] - self.approach
        assert max(abs(left), default=arb(0)) < abs(self.approach) * arb(10) ** (15 - DIGITS)
        assert all(load > 0 for load in self.P)
        assert all(gap > 0 for gap in np.delete(self.gaps, self.touching))

    @cached_property
    @in_digits
    def load(self) -> Balls:
        return self.P.sum() if len(self.P) else arb(0)

    @cached_property
    @in_digits
    def energy(self) -> Balls:
        """V(L)."""
        own = 3 * self.thresholds / 5 + self.inner @ self.P / 2 - self.offsets[self.touching]
        return own @ self.P

    @cached_property
    @in_digits
    def tangent(self) -> tuple[Balls, Balls]:
        """q = dP_i/dL of those that touch, and S = dD0/dL."""
        matrix = self.inner + np.diag(2 * self.thresholds / (3 * self.P))
        y = solve(matrix, np.full(len(self.P), arb(1)))
        return y / y.sum(), 1 / y.sum()

    @cached_property
    @in_digits
    def energy_slopes(self) -> Slopes:
        """dV = -P'dd + (3/5) P^(5/3)'dk + P'dA P / 2 + D0 dL."""
        root = cube_root(self.P)
        return self._slopes(self.P, 3 * root**5 / 5, self.P / 2, self.approach)

    @cached_property
    @in_digits
    def approach_slopes(self) -> Slopes:
        """dD0 = -q'dd + (q P^(2/3))'dk + q'dA P + S dL."""
        q, S = self.tangent
        return self._slopes(q, q * cube_root(self.P) ** 2, q, S)

    def _slopes(self, alpha: Balls, kappa: Balls, left: Balls, by_load: Balls) -> Slopes:
        """Of a number that changes by -alpha'dd + kappa'dk + left'dA P + by_load dL."""
        s, on = self.setup, self.touching
        R, E, rho, x = s.sphere_radius, s.contact_modulus, s.tip_radii[on], s.positions[on]
        closest = s.geometry == "closest"
        far = R + rho if closest else R + 0 * rho
        share = R / far if closest else 1 + 0 * rho  # contact points c = share x
        points = x * share[:, None]
        weights = self.inner**3 * (np.outer(left, self.P) + np.outer(self.P, left))
        weights *= -(arb.pi() ** 2) * E * E
        pulls = points * weights.sum(axis=1)[:, None] - weights @ points  # by contact points
        far_off, along = (x * x).sum(axis=1) / (2 * far * far), (pulls * x).sum(axis=1) / far**2
        bent = -kappa * self.k[on] / (3 * (1 / R + 1 / rho))
        tips = bent / rho**2 - (alpha * far_off + along * R if closest else 0 * rho)
        sphere = bent / R**2 - alpha * far_off + (along * rho if closest else 0 * rho)
        modulus = -(2 * (kappa @ self.k[on]) / 3 + left @ (self.inner @ self.P)) / E
        places = (alpha / far)[:, None] * x + pulls * share[:, None]
        heights, tip_radii, positions = (self._spread(each) for each in (-alpha, tips, places))
        none = arb(0)
        return Slopes(
            heights, tip_radii, positions, sphere.sum(), modulus, none, none, by_load, none
        )

    def _spread(self, values: Balls) -> Balls:
        full = np.full((len(self.offsets), *values.shape[1:]), arb(0))
        full[self.touching] = values
        return full


@dataclass(frozen=True)
class Friction:
    """A friction state under the force Q = f T, and the cycle between +-Q, by two levels."""

    pressed: Level
    held: Level
    T: Balls

    @cached_property
    @in_digits
    def f(self) -> Balls:
        return self.pressed.setup.friction

    @cached_property
    @in_digits
    def travel(self) -> Balls:
        """c_t f."""
        return self.pressed.ratio * self.f

    @cached_property
    @in_digits
    def loads(self) -> Balls:
        return self.pressed.loads

    @cached_property
    @in_digits
    def forces(self) -> Balls:
        return self.f * (self.pressed.loads - self.held.loads)

    @cached_property
    @in_digits
    def displacement(self) -> Balls:
        return self.travel * (self.pressed.approach - self.held.approach)

    @cached_property
    @in_digits
    def slips(self) -> Balls:
        return np.where(self.pressed.loads > 0, self.travel * self.held.gaps, arb(0))

    @cached_property
    @in_digits
    def stick_radii(self) -> Balls:
        """Contact radii at the lower level."""
        s = self.held.setup
        relative = 1 / (1 / s.sphere_radius + 1 / s.tip_radii)
        return cube_root(3 * self.held.loads * relative / (4 * s.contact_modulus))

    @cached_property
    @in_digits
    def sticks(self) -> np.ndarray:
        return np.array([bool(load > 0) for load in self.held.loads])

    @cached_property
    @in_digits
    def energy(self) -> Balls:
        """8 c_t f^2 times the error of the trapezoid rule."""
        high, low = self.pressed, self.held
        mean = (high.approach + low.approach) / 2
        return 8 * self.travel * self.f * (high.energy - low.energy - self.T * mean)

    @cached_property
    @in_digits
    def energies(self) -> Balls:
        """By asperities: those of their annuli, and 4 f P_i slip_i."""
        on = self.pressed.touching
        P, slips = self.pressed.P, self.slips[on]
        left = self.held.loads[on] / P
        e = 1 - cube_root(left) ** 5 - 5 * (1 - left) / 6 * (1 + cube_root(left) ** 2)
        own = arb(24) / 5 * self.travel * self.f * P * self.pressed.thresholds * e
        return self.pressed._spread(own + 4 * self.f * P * slips)

    @in_digits
    def loss_slopes(self, holding: Holding = "load") -> Slopes:
        """dW at constant Q; with the approach held P follows."""
        T, f, unit = self.T, self.f, 8 * self.travel * self.f
        displacement = self.pressed.approach - self.held.approach
        S, s = self.pressed.tangent[1], self.held.tangent[1]
        ends = zip(
            self.pressed.energy_slopes, self.held.energy_slopes,
            self.pressed.approach_slopes, self.held.approach_slopes, strict=True,
        )  # fmt: skip
        partial = Slopes(*(unit * (a - b - T / 2 * (c + d)) for a, b, c, d in ends))
        by_force = unit / (2 * f) * (T * s - displacement)
        return self._held(holding, partial._replace(
            poisson_ratio=self._by_ratio(self.energy),
            friction=2 * self.energy / f - T * by_force,
            control=unit * (displacement - T * (S + s) / 2),
            force=by_force,
        ))  # fmt: skip

    @in_digits
    def displacement_slopes(self, holding: Holding = "load") -> Slopes:
        ends = zip(self.pressed.approach_slopes, self.held.approach_slopes, strict=True)
        partial, X = Slopes(*(self.travel * (a - b) for a, b in ends)), self.displacement
        by_force = self.pressed.ratio * self.held.tangent[1]
        return self._held(holding, partial._replace(
            poisson_ratio=self._by_ratio(X),
            friction=X / self.f - self.T * by_force,
            force=by_force,
        ))  # fmt: skip

    def _by_ratio(self, value: Balls) -> Balls:
        nu = self.pressed.setup.poisson_ratio
        return value / ((1 - nu) * (2 - nu))

    def _held(self, holding: Holding, slopes: Slopes) -> Slopes:
        if holding == "load":
            return slopes
        moved, follows = self.pressed.approach_slopes, slopes.control / self.pressed.tangent[1]
        there = Slopes(*(a - follows * b for a, b in zip(slopes, moved, strict=True)))
        return there._replace(control=follows)


def friction_state(contact: cr.Contact, force: float, holding: Holding = "load") -> Friction:
    """Of a pressed scene under a shear force below f P, all its float64 numbers taken as exact."""
    with ctx.workdps(DIGITS):
        setup = Setup.of(contact, holding, [force])
        return of_setup(setup, contact)


def of_setup(setup: Setup, contact: cr.Contact) -> Friction:
    upper = Level(setup, contact)
    T = setup.forces[0] / setup.friction
    left = (upper.load - T).mid()
    start = cr.press(contact.scene, load=float(left))
    return Friction(upper, Level(replace(setup, control=left, by_load=True), start), T)


def displaced(contact: cr.Contact, displacement: float, holding: Holding = "load") -> Friction:
    """As `friction_state`, moved by X [length]: the level at the approach D0(P) - X / (c_t f)."""
    with ctx.workdps(DIGITS):
        upper = Level(Setup.of(contact, holding), contact)
        left = (upper.approach - arb(displacement) / (upper.ratio * upper.setup.friction)).mid()
        start = cr.press(contact.scene, approach=float(left))
        lower = Level(replace(upper.setup, control=left, by_load=False), start)
        return Friction(upper, lower, upper.load - lower.load)


@cache
def reference(name: str, fraction: float, holding: Holding = "approach") -> Friction:
    """One of SCENES at Q = fraction f P, kept."""
    contact = pressed(name, holding)
    return friction_state(contact, fraction * FRICTION * contact.load, holding)


@cache
def pressed(name: str, holding: Holding = "approach", influence: Any = "dense") -> cr.Contact:
    scene, approach = SCENES[name]
    contact = cr.press(scene, approach=approach, influence=influence)
    if holding == "load":
        return cr.press(scene, load=contact.load, influence=influence)
    return contact


class Bristles:
    """Shear at constant normal loads in steps, whatever order asperities move in, in float64.

    Each asperity is a row of bristles in parallel, which together carry Mindlin's law: at a
    deflection phi of the largest c_t f k P^(2/3), a bristle of the limit y = 1 - s^2, s uniform on
    (0, 1), carries min(phi, y) on first loading, and what it remembers clamped to +-y after that.
    The error falls as the square of their number, and with the steps.

    positions, loads : of those that touch
    """

    def __init__(self, contact: cr.Contact, count: int = 1000) -> None:
        scene, on = contact.scene, contact.loads > 0
        nu, E = scene.material.poisson_ratio, scene.material.contact_modulus
        self.P, self.f = contact.loads[on], scene.friction or 0.0
        self.ratio = (2 - nu) / (2 * (1 - nu))
        points = scene.contact_points[on]
        apart = np.hypot(*np.moveaxis(points[:, None] - points, -1, 0))
        np.fill_diagonal(apart, np.inf)
        self.A = 1 / (np.pi * E * apart)
        self.C = np.cbrt(9 / (16 * E**2) / scene.relative_radii[on]) * np.cbrt(self.P) ** 2
        s = (np.arange(count) + 0.5) / count
        self.limits = 1 - s * s
        self.bent = np.zeros((len(self.P), count))
        self.deflection, self.delta, self.lost = np.zeros(len(self.P)), 0.0, 0.0

    @property
    def forces(self) -> Array:
        return self.f * 1.5 * self.P * self.bent.mean(axis=1)

    @property
    def displacement(self) -> float:
        return self.ratio * self.f * self.delta

    def to(self, forces: Array) -> "Bristles":
        """Follow the force Q through these values."""
        for Q in forces:
            self._step(float(Q) / self.f)
        return self

    def _step(self, T: float) -> None:
        """eta + A u(eta) = Delta, sum u = T, by Newton on the clamped bristles."""
        eta, delta, n = self.deflection, self.delta, len(self.P)
        for _ in range(60):
            tried = self.bent + ((eta - self.deflection) / self.C)[:, None]
            bent = np.clip(tried, -self.limits, self.limits)
            u, c = 1.5 * self.P * bent.mean(axis=1), 1.5 * self.P / self.C * (tried == bent).mean(1)
            matrix = np.block([[np.eye(n) + self.A * c, -np.ones((n, 1))], [c, np.zeros((1, 1))]])
            change = np.linalg.solve(matrix, np.append(eta + self.A @ u - delta, u.sum() - T))
            eta, delta = eta - change[:n], delta - change[n]
            if np.abs(change[:n]).max() <= 1e-13 * self.C.max():
                break
        else:
            raise ArithmeticError("Newton did not arrive: take smaller steps")
        slid = (np.abs(tried - bent) * self.limits).mean(axis=1)
        self.lost += self.ratio * self.f**2 * 1.5 * float((self.P * self.C) @ slid)
        self.bent, self.deflection, self.delta = bent, eta, delta


def cycle_loss(contact: cr.Contact, force: float, steps: int = 50, count: int = 700) -> float:
    """The energy of the steady cycle between +-Q, by `Bristles`."""
    state = Bristles(contact, count).to(np.linspace(0, force, steps + 1)[1:])
    down = np.linspace(force, -force, 2 * steps + 1)[1:]
    state.to(np.concatenate((down, -down)))
    before = state.lost
    return state.to(np.concatenate((down, -down))).lost - before
