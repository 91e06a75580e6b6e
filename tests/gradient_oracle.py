"""Contacts in 130 digits, for differences of them: the test oracle.

Written from the formulas of physics alone, in the scene's own units, and sharing no code with the
package: Hertz's law k P^(2/3) and Boussinesq's coupling. Who touches is taken from a state in
float64 and must not change within a step. `levels_reference` makes friction of such contacts.
"""

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
    def ratio(self) -> Balls:
        nu = self.setup.poisson_ratio
        return (2 - nu) / (2 * (1 - nu))


class Judge:
    """Derivatives of a number by differences of it: value(setup, near) -> (number, state)."""

    def __init__(self, setup: Setup, value: Callable[[Setup, Any], tuple[Balls, Any]]) -> None:
        self.setup, self.value = setup, value
        with ctx.workdps(DIGITS):
            self.at, self.near = value(setup, None)

    def difference(self, name: str, direction: Balls) -> Balls:
        """The derivative along `direction` of one parameter, to 100 digits."""
        with ctx.workdps(DIGITS):
            h = arb(STEP)
            ends = [
                self.value(self.setup.moved(name, s * h * direction), self.near) for s in (1, -1)
            ]
            return ((ends[0][0] - ends[1][0]) / (2 * h)).mid()


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
