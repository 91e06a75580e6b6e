"""Contacts, what friction makes of them, and derivatives, in 130 digits: the reference.

By the formulas of physics alone; those that touch are taken from float64 and may not change. Two
levels make friction states by `multiprecision.slide`; where order fails `Bristles` follow.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import multiprecision
import numpy as np
from flint import arb, ctx
from friction_scenes import FRICTION, pressed
from multiprecision import Balls, cube_root, exact, mid, off, travel_of

import convexrough as cr
from convexrough.arrays import Array

DIGITS = 130
STEP = "1e-25"  # of each parameter over its own size


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
        scene, a, material = contact.scene, contact.scene.asperities, contact.scene.material
        prescribed = contact.prescribed_load
        load = contact.load if prescribed is None else prescribed
        control = load if holding == "load" else contact.approach
        numbers = material.contact_modulus, material.poisson_ratio
        return cls(
            *map(exact, (a.positions, a.tip_radii, a.heights)),
            exact(np.array(scene.sphere_radius, dtype=float))[()],
            *(arb(float(value)) for value in (*numbers, scene.friction or 1.0, control)),
            exact(np.asarray(forces, dtype=float)) if np.size(forces) else np.zeros(0, object),
            scene.geometry,
            holding == "load",
        )

    def moved(self, **by: Balls) -> "Setup":
        return replace(self, **{name: getattr(self, name) + each for name, each in by.items()})


class Oracle:
    """The state of a setup, by Newton's steps from one near it, and not proved.

    start : a contact of the same scene, pressed nearly as the setup asks; or another oracle
    """

    def __init__(self, setup: Setup, start: "cr.Contact | Oracle") -> None:
        s = self.setup = setup
        self.bends, modulus = exact(np.zeros(2)) + 1 / s.sphere_radius, s.contact_modulus
        points, self.offsets, law = multiprecision.assemble(
            s.positions, s.tip_radii, s.heights, self.bends, modulus, s.geometry
        )
        self.A, loads = multiprecision.coupling(points, modulus), exact(start.loads)
        on = self.touching = np.flatnonzero([bool(load > 0) for load in loads])
        self.inner = self.A[np.ix_(on, on)]
        given = self.inner, law[on], self.offsets[on], s.control, s.by_load, arb(1)
        problem = multiprecision.NormalMap(*given)
        x = mid(np.append(law[on] * cube_root(loads[on]) ** 2, arb(start.approach)))
        x = multiprecision.newton(problem, x, tolerance=abs(x[-1]) * arb(10) ** (10 - DIGITS))
        self.P, self.approach = problem.loads(x), x[-1]
        self.load = self.P.sum() if len(self.P) else arb(0)
        self.loads, self.thresholds = (np.full(len(law), arb(0)) for _ in range(2))
        self.loads[on], self.thresholds[on] = self.P, x[:-1]
        self.gaps = self.A @ self.loads - self.offsets - self.approach
        self.gaps[on] = arb(0)

    @property
    def energy(self) -> Balls:
        """V(L)."""
        own = 3 * self.thresholds / 5 + self.A @ self.loads / 2 - self.offsets
        return own @ self.loads


def level(setup: Setup, start: cr.Contact | Oracle) -> Oracle:
    """The normal solution; who touches is proved by signs."""
    found = Oracle(setup, start)
    assert all(load > 0 for load in found.P)
    assert all(gap > 0 for gap in np.delete(found.gaps, found.touching))
    return found


class Judge:
    """Derivatives of numbers by differences of them: value(setup, near) -> (numbers, state)."""

    def __init__(self, setup: Setup, value: Callable[[Setup, Any], tuple[Balls, Any]]) -> None:
        self.setup, self.value = setup, value
        with ctx.workdps(DIGITS):
            self.at, self.near = value(setup, None)

    def difference(self, name: str, direction: Balls) -> Balls:
        """The derivative along `direction` of one parameter, to 100 digits."""
        with ctx.workdps(DIGITS):
            size = np.abs(np.atleast_1d(getattr(self.setup, name))).max()
            h = arb(STEP) * (size if size > 0 else 1)
            there = (self.setup.moved(**{name: s * h * direction}) for s in (1, -1))
            up, down = (self.value(each, self.near)[0] for each in there)
            return mid((up - down) / (2 * h))[()]


class Friction:
    """A friction state under the force Q = f T, and the cycle between +-Q, by two levels."""

    def __init__(self, pressed: Oracle, held: Oracle, T: Balls) -> None:
        s = held.setup
        self.pressed, self.held, self.T, self.f = pressed, held, T, s.friction
        self.loads = pressed.loads
        found = multiprecision.slide(s.friction, s.poisson_ratio, pressed, held)
        self.forces, self.slips, self.displacement, self.energies, self.energy = found
        relative = 1 / (held.bends.sum() / 2 + 1 / s.tip_radii)
        self.stick_radii = cube_root(3 * held.loads * relative / (4 * s.contact_modulus))
        self.sticks = np.array([bool(load > 0) for load in held.loads])


def of_setup(setup: Setup, contact: cr.Contact, near: Friction | None = None) -> Friction:
    """A state under a shear force below f P; near : one of nearly the same setup."""
    upper = level(setup, near.pressed if near else contact)
    T = setup.forces[0] / setup.friction
    left = (upper.load - T).mid()
    start = near.held if near else cr.press(contact.scene, load=float(left))
    return Friction(upper, level(replace(setup, control=left, by_load=True), start), T)


def judge_of(
    number: Callable[[Any], Any], contact: cr.Contact, holding: str, *force: float
) -> Judge:
    """Of numbers of the contact, or of its state under a shear force."""

    def value(setup: Setup, near: Any) -> tuple[Any, Any]:
        make = of_setup(setup, contact, near) if force else Oracle(setup, near or contact)
        return number(make), make

    return Judge(Setup.of(contact, holding, force), value)


def loss_and_displacement(state: Friction) -> Balls:
    return np.array([state.energy, state.displacement])


def displaced(contact: cr.Contact, displacement: float, holding: str) -> Friction:
    """Moved by X [length]: the level at the approach D0(P) - X / (c_t f)."""
    with ctx.workdps(DIGITS):
        upper = level(Setup.of(contact, holding), contact)
        travel = travel_of(upper.setup.friction, upper.setup.poisson_ratio)
        left = (upper.approach - arb(displacement) / travel).mid()
        start = cr.press(contact.scene, approach=float(left))
        lower = level(replace(upper.setup, control=left, by_load=False), start)
        return Friction(upper, lower, upper.load - lower.load)


@cache
def reference(name: str, fraction: float, holding: str = "approach") -> Friction:
    """One of SCENES at Q = fraction f P, kept."""
    contact = pressed(name, control=holding)
    with ctx.workdps(DIGITS):
        setup = Setup.of(contact, holding, [fraction * FRICTION * contact.load])
        return of_setup(setup, contact)


#: What everything depends on; friction is the last.
NAMES = ("heights", "tip_radii", "positions", "sphere_radius", "contact_modulus",
            "poisson_ratio", "friction")  # fmt: skip

#: Names of the bounds on derivatives.
ERRORS = {"heights": "height_errors", "tip_radii": "tip_radius_errors"}
ERRORS |= {"positions": "position_errors", "forces": "force_errors", "loads": "load_errors"}


def known(gradient: cr.Gradient, name: str) -> tuple[Array, Array]:
    """A derivative and its bound."""
    error = ERRORS.get(name, f"{name}_error")
    return np.asarray(getattr(gradient, name)), np.asarray(getattr(gradient, error))


def assert_slopes(
    judge: Judge, gradient: cr.Gradient, *more: str, seed: int = 0, sharp: float = 0.0
) -> None:
    """The value and every derivative, arrays along random signs, within their bounds."""
    assert off(gradient.value, judge.at) <= gradient.value_error
    rng = np.random.default_rng(seed)
    names = (name for name in NAMES if getattr(gradient, name) is not None)
    for name in (*names, *more):
        slopes, errors = known(gradient, gradient.holding if name == "control" else name)
        v = rng.choice([-1.0, 1.0], size=slopes.shape)
        assert_close(judge.difference(name, exact(v)[()]), slopes * v, errors, name, sharp)


def assert_close(true: Balls, terms: Any, errors: Any, name: str, sharp: float = 0.0) -> None:
    """A difference, and terms whose sum it is within their errors."""
    with ctx.workdps(DIGITS):
        apart = float(abs(exact(terms).sum() - true))
    # The difference itself has some 20 digits.
    assert apart <= errors.sum() + 1e-18 * abs(float(true)), (name, apart, errors, float(true))
    if sharp:
        assert errors.max() <= sharp * np.abs(terms).max() + 1e-200, name


class Bristles:
    """Shear in steps, whatever order asperities move in, in float64.

    Each asperity is a row of bristles in parallel, which together carry Mindlin's law (Popov's
    dimensional reduction): at the part s of a contact radius, s uniform on (0, reach), a bristle
    is bent by at most C - s^2 C0, where C = k P^(2/3) is the indentation and C0 that of `contact`,
    and remembers the rest. The error falls as the square of their number, and with the steps.
    """

    def __init__(self, contact: cr.Contact, count: int = 1000, reach: float = 1.0) -> None:
        self.scene, self.on = contact.scene, contact.loads > 0
        scene, on, P = contact.scene, self.on, contact.loads[self.on]
        nu, E = scene.material.poisson_ratio, scene.material.contact_modulus
        self.f, self.ratio = scene.friction or 0.0, (2 - nu) / (2 * (1 - nu))
        points, _, law = (each[on] for each in multiprecision.of_scene(scene))
        self.A, self.k = multiprecision.coupling(points, arb(E)).astype(float), law.astype(float)
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
    first, second = (state.to(np.concatenate((down, -down))).lost for _ in range(2))
    return second - first
