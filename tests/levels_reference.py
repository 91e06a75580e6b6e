"""Normal solutions at any load in 130 digits and all that friction makes of them: the reference.

Two levels make friction states by `multiprecision.slide`; where order fails `Bristles` follow.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
from flint import arb, ctx
from friction_scenes import FRICTION, pressed
from gradient_oracle import DIGITS, Balls, Judge, Oracle, Setup, exact, press
from multiprecision import cube_root, slide, travel_of

import convexrough as cr
from convexrough.arrays import Array


class Level(Oracle):
    """The normal solution of a setup; who touches is taken from float64 and then proved by signs.

    start : a contact of the same scene, pressed nearly as the setup asks; or a level
    """

    def __init__(self, setup: Setup, start: "cr.Contact | Level") -> None:
        if isinstance(start, Level):
            super().__init__(setup, start.loads, start.approach, 3)
        else:
            super().__init__(setup, exact(start.loads), arb(start.approach), 7)
        assert all(load > 0 for load in self.P)
        assert all(gap > 0 for gap in np.delete(self.gaps, self.touching))
        on = self.touching
        self.load = self.P.sum() if len(self.P) else arb(0)
        own = 3 * self.thresholds[on] / 5 + self.inner @ self.P / 2 - self.offsets[on]
        self.energy = own @ self.P  # V(L)


class Friction:
    """A friction state under the force Q = f T, and the cycle between +-Q, by two levels."""

    def __init__(self, pressed: Level, held: Level, T: Balls) -> None:
        s = held.setup
        self.pressed, self.held, self.T, self.f = pressed, held, T, s.friction
        self.loads = pressed.loads
        found = slide(s.friction, s.poisson_ratio, pressed, held)
        self.forces, self.slips, self.displacement, self.energies, self.energy = found
        relative = 1 / (1 / s.sphere_radius + 1 / s.tip_radii)
        self.stick_radii = cube_root(3 * held.loads * relative / (4 * s.contact_modulus))
        self.sticks = np.array([bool(load > 0) for load in held.loads])


def of_setup(setup: Setup, contact: cr.Contact, near: Friction | None = None) -> Friction:
    """A state under a shear force below f P; near : one of nearly the same setup."""
    upper = Level(setup, near.pressed if near else contact)
    T = setup.forces[0] / setup.friction
    left = (upper.load - T).mid()
    start = near.held if near else cr.press(contact.scene, load=float(left))
    return Friction(upper, Level(replace(setup, control=left, by_load=True), start), T)


def judge_of(
    number: Callable[[Any], Any], contact: cr.Contact, holding: str, *force: float
) -> Judge:
    """Of numbers of the contact, or of its state under a shear force."""

    def value(setup: Setup, near: Any) -> tuple[Any, Any]:
        make = of_setup(setup, contact, near) if force else press(contact, setup, near)
        return number(make), make

    return Judge(Setup.of(contact, holding, force), value)


def loss_and_displacement(state: Friction) -> Balls:
    return np.array([state.energy, state.displacement])


def displaced(contact: cr.Contact, displacement: float, holding: str) -> Friction:
    """Moved by X [length]: the level at the approach D0(P) - X / (c_t f)."""
    with ctx.workdps(DIGITS):
        upper = Level(Setup.of(contact, holding), contact)
        travel = travel_of(upper.setup.friction, upper.setup.poisson_ratio)
        left = (upper.approach - arb(displacement) / travel).mid()
        start = cr.press(contact.scene, approach=float(left))
        lower = Level(replace(upper.setup, control=left, by_load=False), start)
        return Friction(upper, lower, upper.load - lower.load)


@cache
def reference(name: str, fraction: float, holding: str = "approach") -> Friction:
    """One of SCENES at Q = fraction f P, kept."""
    contact = pressed(name, control=holding)
    with ctx.workdps(DIGITS):
        setup = Setup.of(contact, holding, [fraction * FRICTION * contact.load])
        return of_setup(setup, contact)


class Bristles:
    """Shear in steps, whatever order asperities move in, in float64.

    Each asperity is a row of bristles in parallel, which together carry Mindlin's law (Popov's
    dimensional reduction): at the part s of a contact radius, s uniform on (0, reach), a bristle
    is bent by at most C - s^2 C0, where C = k P^(2/3) is the indentation and C0 that of `contact`.
    It is clamped to that, and remembers the rest. The error falls as the square of their number,
    and with the steps.
    """

    def __init__(self, contact: cr.Contact, count: int = 1000, reach: float = 1.0) -> None:
        self.scene, self.on = contact.scene, contact.loads > 0
        scene, on, P = contact.scene, self.on, contact.loads[self.on]
        nu, E = scene.material.poisson_ratio, scene.material.contact_modulus
        self.f, self.ratio = scene.friction or 0.0, (2 - nu) / (2 * (1 - nu))
        points = scene.contact_points[on]
        apart = np.hypot(*np.moveaxis(points[:, None] - points, -1, 0))
        np.fill_diagonal(apart, np.inf)
        self.A = 1 / (np.pi * E * apart)
        self.k = np.cbrt(9 / (16 * E**2) / scene.relative_radii[on])
        self.C = self.k * np.cbrt(P) ** 2
        self.stiffness = 1.5 * P / self.C * reach
        self.below = self.C[:, None] * (reach * (np.arange(count) + 0.5) / count) ** 2
        self.bent = np.zeros((len(P), count))
        self.deflection, self.delta, self.lost = np.zeros(len(P)), 0.0, 0.0

    @property
    def forces(self) -> Array:
        return self.f * self.stiffness * self.bent.mean(axis=1)

    @property
    def displacement(self) -> float:
        return self.ratio * self.f * self.delta

    def to(self, forces: Array, loads: Array | None = None) -> "Bristles":
        """Follow the force Q through these values, and the load, if it is not that of `contact`."""
        for i, Q in enumerate(forces):
            P = None if loads is None else cr.press(self.scene, load=float(loads[i])).loads[self.on]
            C = self.C if P is None else self.k * np.cbrt(P) ** 2
            self._step(float(Q) / self.f, np.maximum(C[:, None] - self.below, 0.0))
        return self

    def _step(self, T: float, limits: Array) -> None:
        """eta + A u(eta) = Delta, sum u = T, by Newton on the clamped bristles."""
        eta, delta, n = self.deflection, self.delta, len(self.C)
        for _ in range(60):
            tried = self.bent + (eta - self.deflection)[:, None]
            bent = np.clip(tried, -limits, limits)
            u, c = self.stiffness * bent.mean(axis=1), self.stiffness * (tried == bent).mean(1)
            matrix = np.block([[np.eye(n) + self.A * c, -np.ones((n, 1))], [c, np.zeros((1, 1))]])
            change = np.linalg.solve(matrix, -np.append(eta + self.A @ u - delta, u.sum() - T))
            eta, delta = eta + change[:n], delta + change[n]
            if np.abs(change[:n]).max() <= 1e-13 * self.C.max():
                break
        else:
            raise ArithmeticError("Newton did not arrive: take smaller steps")
        slid = self.stiffness @ (np.abs(tried - bent) * limits).mean(axis=1)
        self.lost += self.ratio * self.f**2 * float(slid)
        self.bent, self.deflection, self.delta = bent, eta, delta


def cycle_loss(contact: cr.Contact, force: float, steps: int = 50, count: int = 700) -> float:
    """The energy of the steady cycle between +-Q, by `Bristles`."""
    state = Bristles(contact, count).to(np.linspace(0, force, steps + 1)[1:])
    down = np.linspace(force, -force, 2 * steps + 1)[1:]
    state.to(np.concatenate((down, -down)))
    before = state.lost
    return state.to(np.concatenate((down, -down))).lost - before
