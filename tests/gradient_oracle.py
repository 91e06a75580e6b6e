"""Contacts in 130 digits, for differences of them: the test oracle.

By the formulas of physics alone; those that touch are taken from float64 and may not change.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from flint import arb, ctx
from multiprecision import Balls, NormalMap, assemble, coupling, cube_root, exact, mid, solve_linear

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
        numbers = scene.sphere_radius, material.contact_modulus, material.poisson_ratio
        return cls(
            *map(exact, (a.positions, a.tip_radii, a.heights)),
            *(arb(float(value)) for value in (*numbers, scene.friction or 1.0, control)),
            exact(np.asarray(forces, dtype=float)) if np.size(forces) else np.zeros(0, object),
            scene.geometry,
            holding == "load",
        )

    def moved(self, **by: Balls) -> "Setup":
        return replace(self, **{name: getattr(self, name) + each for name, each in by.items()})


class Oracle:
    """The state of a setup, by Newton's steps from one near it, and not proved.

    loads, approach : (n,) and one number, of another oracle or of a contact
    """

    def __init__(self, setup: Setup, loads: Balls, approach: Balls, steps: int = 4) -> None:
        s = self.setup = setup
        bends, modulus = np.array([1 / s.sphere_radius] * 2), s.contact_modulus
        points, self.offsets, law = assemble(
            s.positions, s.tip_radii, s.heights, bends, modulus, s.geometry
        )
        self.A = coupling(points, modulus)
        on = self.touching = np.flatnonzero([bool(load > 0) for load in loads])
        self.inner = self.A[np.ix_(on, on)]
        problem = NormalMap(self.inner, law[on], self.offsets[on], s.control, s.by_load, arb(1))
        x = mid(np.append(law[on] * cube_root(loads[on]) ** 2, approach))
        for _ in range(steps):
            x = mid(x - solve_linear(problem.jacobian(x), problem.residual(x), "approx"))
        defect = max(abs(problem.residual(x)[:-1]), default=arb(0))
        assert defect < abs(x[-1]) * arb(10) ** (15 - DIGITS)
        self.P, self.approach = problem.loads(x), x[-1]
        self.loads, self.thresholds = (np.full(len(law), arb(0)) for _ in range(2))
        self.loads[on], self.thresholds[on] = self.P, x[:-1]
        self.gaps = self.A @ self.loads - self.offsets - self.approach
        self.gaps[on] = arb(0)


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


def press(contact: cr.Contact, setup: Setup, near: Oracle | None) -> Oracle:
    if near is None:
        return Oracle(setup, exact(contact.loads), arb(contact.approach), 5)
    return Oracle(setup, near.loads, near.approach, 3)


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
    judge: Judge, gradient: cr.Gradient, *, seed: int = 0, sharp: float = 0.0
) -> None:
    """Every derivative within its bound of differences, arrays along random signs."""
    rng = np.random.default_rng(seed)
    names = NAMES if gradient.friction is not None else NAMES[:-1]
    for name in (*names, "control"):
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
