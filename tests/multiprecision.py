"""A proved multiprecision solution of the normal contact of rough spheres: the test oracle.

Float64 inputs are taken as exact numbers. The contact law
P >= 0, g = k P^(2/3) + A P - d - D0 >= 0, P_i g_i = 0 is solved as its *normal map* F = 0, with
an equation for each asperity and one for the control,

    delta + A P - d - D0 = 0,         P = (max(delta, 0) / k)^(3/2),
    D0 - approach = 0   or   u (sum P / load - 1) = 0,      u a length, so every row is a length,

whose solution has delta_i > 0 (the indentation) where asperities touch and delta_i < 0 (minus
the gap) where they do not. Damped Newton finds the point; one interval Newton step, in ball
arithmetic, proves it. The oracle shares no code with the package that it judges.

`solve_vectors` does the same for friction states with the full tangential kernel. Loads P_i > 0 are
given as balls. Forces over f and displacements over c_t f, with bias = nu / (2 - nu) and d the unit
vector between two asperities, solve

    F = ( eta_i + sum_j A_ij [(1 - bias) I + 2 bias d d'] q_j - X,    sum_j q_j - T ) = 0,

where q_i is along eta_i and of the length P_i [1 - (1 - min(|eta_i| / kappa_i, 1))^(3/2)]: what an
asperity must take up, its slip included, is eta (docs/theory/vector-friction.md, "Newton's
method"). The state is the only one where the energy is convex, which is not tested here.
"""

from dataclasses import dataclass
from fractions import Fraction
from math import inf, log2
from types import SimpleNamespace
from typing import Any, Literal, NamedTuple, TypeAlias

import numpy as np
from flint import arb, arb_mat, ctx
from numpy.typing import ArrayLike, NDArray

Array: TypeAlias = NDArray[np.float64]
Balls: TypeAlias = Any  # an arb, or an object array of arb: no dtype of numpy can say so

GUARD_DIGITS = 30  # carried beyond the digits promised
NEWTON_STEPS, HALVINGS = 200, 40  # generous: about ten steps are usual
ZERO: Balls = arb(0)
ONE: Balls = arb(1)

exact = np.vectorize(arb, otypes=[object])
fractions = np.vectorize(Fraction, otypes=[object])
mid = np.vectorize(arb.mid, otypes=[object])
cube_root = np.vectorize(lambda ball: ZERO if ball == 0 else ball.root(3), otypes=[object])


def middle(ball: Any) -> Any:
    """The middle of a ball of the package, or of each, at working precision."""
    return exact(ball.mid.high) + exact(ball.mid.low)


def quotient(x: Fraction) -> arb:
    return arb(x.numerator) / arb(x.denominator)


class NotProved(ArithmeticError):
    """Newton did not arrive, or its answer could not be proved with this number of digits."""


class Reference(NamedTuple):
    """A proved contact state: every ball contains the true value."""

    loads: tuple[arb, ...]  # [force], exactly zero where the asperity is open
    gaps: tuple[arb, ...]  # max(0, (A P)_i - D_i) [length], exactly zero where it touches
    approach: arb  # D0, both bodies together [length]
    load: arb  # the total, sum P [force]
    thresholds: tuple[arb, ...]  # k P^(2/3) [length], which friction multiplies


def solve(
    scene: Any,
    *,
    approach: float | None = None,
    load: float | arb | None = None,
    digits: int = 50,
    start: ArrayLike | None = None,
) -> Reference:
    """Solve one contact and prove it: all loads and gaps to `digits` significant digits.

    scene : a `Scene`, of which only what is given is read, or what has the same names
    start : (n,) loads [force] to begin Newton at, which it may need if contact discs overlap

    Proved: a state exists in which exactly these asperities touch, and no other state is near it.
    That it is the only one anywhere follows if the energy is convex, which is not tested here.
    """
    by_load = load is not None
    with ctx.workdps(digits + GUARD_DIGITS):
        control = arb(approach if load is None else load)
        points, shape, law = of_scene(scene)
        influence = coupling(points, arb(float(scene.material.contact_modulus)))

        # u: the indentation of one asperity, or the largest prescribed D_i
        alone = law[0] * (control * control).root(3) if by_load else (shape + control).max()
        unit = abs(alone).mid()
        problem = NormalMap(influence, law, shape, control, by_load, unit)
        first = problem.begin(None if start is None else exact(start))
        point = newton(problem, first, tolerance=unit / arb(10) ** (digits + 20))
        state = prove(problem, point, radius=unit / arb(10) ** (digits + 10))
        loads, depth = problem.loads(state), state[-1] if by_load else control
        gaps = np.where(loads > 0, ZERO, influence @ loads - shape - depth)
        if any(ball.rel_accuracy_bits() < digits * log2(10) for ball in (*loads, *gaps)):
            raise NotProved("an asperity nearly grazes and lost significance: ask for more digits")
        total = control if by_load else loads.sum(initial=ZERO)
        thresholds = law * cube_root(loads * loads)
        return Reference(tuple(loads), tuple(gaps), depth, total, tuple(thresholds))


@dataclass(frozen=True)
class NormalMap:
    """The map F of the module's docstring; its argument x = (delta_1, .., delta_n, D0) [length]."""

    influence: Balls  # (n, n) A_ij [length / force]
    law: Balls  # (n,) k_i [length / force^(2/3)]
    shape: Balls  # (n,) d_i = D_i - D0 [length]
    control: Balls  # the load [force] where `by_load`, else the approach [length]
    by_load: bool
    unit: Balls  # u [length]

    def begin(self, loads: Balls | None) -> Balls:
        """The state x of these loads; by default each alone (approach) or all equal (load)."""
        if loads is None and self.by_load:
            loads = np.full(len(self.law), self.control / len(self.law))
        elif loads is None:
            loads = self.loads(np.append(mid(self.shape + self.control), self.control))
        delta = self.law * cube_root(loads * loads)
        below = self.influence @ loads - self.shape  # D0 - delta of a solution
        depth = loads @ (delta + below) / loads.sum() if self.by_load else self.control
        opened = np.minimum(mid(depth - below), ZERO)
        return mid(np.append(np.where(loads > 0, delta, opened), depth))

    def loads(self, x: Balls) -> Balls:
        """P = (max(delta, 0) / k)^(3/2)."""
        ratio = _positive_part(x[:-1]) / self.law
        return ratio * np.sqrt(ratio)

    def residual(self, x: Balls) -> Balls:
        """F(x) = (delta + A P - d - D0, the control equation)."""
        delta, depth, loads = x[:-1], x[-1], self.loads(x)
        contact = delta + self.influence @ loads - self.shape - depth
        if self.by_load:
            return np.append(contact, self.unit * (loads.sum() / self.control - 1))
        return np.append(contact, depth - self.control)

    def jacobian(self, x: Balls) -> Balls:
        """dF/dx = [[I + A C, -1], [the control's row]], C = diag(dP/d delta) = diag(2 E* a)."""
        stiffness = 3 * np.sqrt(_positive_part(x[:-1]) / self.law) / (2 * self.law)
        matrix = np.full((len(x), len(x)), ZERO)
        matrix[:-1, :-1] = self.influence * stiffness
        np.fill_diagonal(matrix, ONE)
        matrix[:-1, -1] = -ONE
        if self.by_load:
            matrix[-1] = np.append(self.unit / self.control * stiffness, ZERO)
        return matrix


def newton(problem: Any, x: Balls, *, tolerance: arb) -> Balls:
    """The point x with sum |F(x)| <= tolerance [length], by Newton steps that shrink this sum."""
    residual = mid(problem.residual(x))
    for _ in range(NEWTON_STEPS):
        size = np.abs(residual).sum()
        if size <= tolerance:
            return x
        step = solve_linear(problem.jacobian(x), residual, "approx")
        for share in (ONE / 2**halvings for halvings in range(HALVINGS)):
            trial = mid(x - share * step)
            after = mid(problem.residual(trial))
            if np.abs(after).sum() <= (1 - share / 1000) * size:
                break
        else:
            raise NotProved("no part of Newton's step shrinks the residual")
        x, residual = trial, after
    raise NotProved("Newton did not arrive")


def prove(problem: Any, x: Balls, *, radius: arb) -> Balls:
    """Balls that hold a zero of F, the only one in the box X = x +/- radius [length].

    Interval Newton: if x - J^-1 F(x) lies inside X for every matrix J with entries in dF/dx(X),
    then (mean value and Brouwer) F has one zero in X, and it is among those x - J^-1 F(x).
    """
    box = np.array([arb(centre, radius) for centre in x])
    inside = x - solve_linear(problem.jacobian(box), problem.residual(x))
    if not all(whole.contains_interior(part) for whole, part in zip(box, inside, strict=True)):
        raise NotProved("the interval Newton step leaves its box")
    return inside


def inverse_sum(points: Balls, loads: Balls, target: Balls, power: int = 1) -> Balls:
    """sum_j P_j / r_j^power over the points (n, 2) that are not the target; (n,) or (n, k) P."""
    away = target - points
    squares = (away * away).sum(axis=1)
    apart = np.flatnonzero(squares != 0)
    return np.array([square.rsqrt() ** power for square in squares[apart]]) @ loads[apart]


def inverse_sums(
    targets: Array, points: Array, loads: Array, scale: float = 1.0, power: int = 1
) -> tuple[Array, Array]:
    """`scale` times these sums of 160 bits, as pairs of float64 numbers."""
    with ctx.workprec(160):
        places, forces = exact(points), arb(scale) * exact(loads)
        sums = [inverse_sum(places, forces, target, power) for target in exact(targets)]
        high = np.array(sums).astype(float)
        return high, (np.array(sums) - exact(high)).astype(float)


def assert_sums(found: Any, points: Balls, loads: Any, rows: Any) -> float:
    """Balls of the sums of P_j / r_ij in these rows hold the true ones; how far off any is."""
    with ctx.workprec(400):
        forces, off = exact(loads.high) + exact(loads.low), [ZERO]
        for row in rows:
            off.append(abs(middle(found[row]) - inverse_sum(points, forces, points[row])))
            assert off[-1] <= arb(float(found.radius[row]))
        return float(max(off).mid())


def pulled(points: Array, loads: Array, i: int, scale: float) -> Balls:
    """The derivatives of scale sum_j P_j / r_ij with respect to the coordinates of point i."""
    with ctx.workprec(160):
        places = exact(points)
        along = exact(loads)[:, None] * (places[i] - places)
        return -arb(scale) * inverse_sum(places, along, places[i], 3)


def gaps(scene: Any, loads: Balls, approach: arb, rows: Any) -> Balls:
    """k_i P_i^(2/3) + (A P)_i - D_i of some asperities of a scene, whatever the loads are."""
    local, sunk, shape = _terms(scene, loads, rows)
    return local + sunk - shape - approach


def energy(scene: Any, loads: Balls, approach: arb) -> arb:
    """Phi(P) = sum P_i (3/5 k_i P_i^(2/3) + (A P)_i / 2 - D_i)."""
    local, sunk, shape = _terms(scene, loads, np.arange(len(loads)))
    return (loads * (3 * local / 5 + sunk / 2 - shape - approach)).sum(initial=ZERO)


def _terms(scene: Any, loads: Balls, rows: Any) -> tuple[Balls, Balls, Balls]:
    """k_i P_i^(2/3), (A P)_i and d_i of some asperities."""
    points, shape, law = of_scene(scene)
    sunk = np.array([inverse_sum(points, loads, points[i]) for i in rows])
    scale = arb.pi() * arb(float(scene.material.contact_modulus))
    return law[rows] * cube_root(loads[rows]) ** 2, sunk / scale, shape[rows]


def off(values: Any, true: Any) -> Array:
    """(m,) upper bounds on |values - true|."""
    both = zip(np.atleast_1d(values), np.atleast_1d(true), strict=True)
    with ctx.workdps(80):
        return np.array([float(abs(arb(float(value)) - it).upper()) for value, it in both])


def travel_of(f: arb, nu: arb) -> arb:
    """f c_t, the tangential over the normal approach: c_t = (2 - nu) / (2 (1 - nu))."""
    return f * (2 - nu) / (2 * (1 - nu))


class Friction(NamedTuple):
    """A friction state of first loading, and the cycle of this amplitude: balls."""

    forces: Balls  # Q_i [force]
    slips: Balls  # slip_i [length]
    displacement: Balls  # X [length]
    energies: Balls  # lost in a cycle, by asperities [force length]
    energy: Balls  # their sum


def slide(f: arb, nu: arb, full: Any, held: Any) -> Friction:
    """By Ciavarella and Jaeger's theorem, of the normal states at P and at P - Q / f:

    Q_i = f (P_i - p_i), slip_i = f c_t gap_i, X = f c_t (D0 - d0), and
    W_i = (24/5) c_t f^2 P_i k P_i^(2/3) e_i + 4 f P_i slip_i.
    """
    travel = travel_of(f, nu)
    above, below = np.array(full.loads), np.array(held.loads)
    slips = np.where(above > 0, travel * np.array(held.gaps), ZERO)
    left = np.where(above > 0, below, ZERO) / np.where(above > 0, above, ONE)
    e = 1 - cube_root(left) ** 5 - 5 * (1 - left) / 6 * (1 + cube_root(left) ** 2)
    energies = (24 * travel / 5 * np.array(full.thresholds) * e + 4 * slips) * f * above
    moved = travel * (full.approach - held.approach)
    return Friction(f * (above - below), slips, moved, energies, energies.sum(initial=ZERO))


def of_scene(scene: Any) -> tuple[Balls, Balls, Balls]:
    """As `assemble`; the sphere has one radius, or one along x and one along y, and inf is flat."""
    R, a, modulus = scene.sphere_radius, scene.asperities, scene.material.contact_modulus
    radii = R if isinstance(R, tuple) else (R, R)
    bends = np.array([ZERO if inf == each else 1 / arb(float(each)) for each in radii])
    parts = map(exact, (a.positions, a.tip_radii, a.heights))
    return assemble(*parts, bends, arb(float(modulus)), scene.geometry)


def assemble(
    summits: Balls, tips: Balls, heights: Balls, bends: Balls, modulus: arb, geometry: str
) -> tuple[Balls, Balls, Balls]:
    """Where asperities touch, (n, 2) [length], d_i = D_i - D0 and k_i, both (n,)."""
    # r R / (R + rho), with 1 / R
    points = summits if geometry == "summit" else summits / (1 + tips[:, None] * bends)
    law = cube_root(9 / (16 * modulus * modulus) * (bends.sum() / 2 + 1 / tips))
    return points, heights - (summits * points * bends).sum(axis=1) / 2, law


def coupling(points: Balls, modulus: arb) -> Balls:
    """A_ij = 1 / (pi E* r_ij), A_ii = 0 [length / force]."""
    offsets = points[:, None, :] - points[None, :, :]
    squares = (offsets * offsets).sum(axis=2)
    np.fill_diagonal(squares, ONE)
    influence = 1 / (arb.pi() * modulus * np.sqrt(squares))
    np.fill_diagonal(influence, ZERO)
    return influence


def _positive_part(delta: Balls) -> Balls:
    """max(delta, 0), where every sign is known."""
    if any(ball.contains(0) and ball != 0 for ball in delta):
        raise NotProved("an asperity touches or slides, or fails to, by less than its ball")
    return np.where(delta > 0, delta, ZERO)


def solve_linear(matrix: Balls, right: Balls, algorithm: Literal["approx"] | None = None) -> Balls:
    """matrix^-1 right, in balls that hold it; "approx" is quicker and only near it."""
    try:
        column = arb_mat(len(right), 1, list(right))
        solution: Balls = arb_mat(matrix.tolist()).solve(column, algorithm=algorithm).entries()
        return np.array(solution)
    except ZeroDivisionError as error:
        raise NotProved("the Jacobian may be singular") from error


# Friction with the full tangential kernel


class VectorReference(NamedTuple):
    """A proved state of the loaded asperities; every ball contains the true value."""

    forces: Balls  # (n, 2) over f [force]
    slips: Balls  # (n, 2) over c_t f [length]
    displacement: Balls  # (2,) X over c_t f [length]
    sliding: list[bool]


@dataclass(frozen=True)
class VectorMap:
    """F and its derivative; the unknowns are eta_x, eta_y of each asperity, then X."""

    loads: Balls
    thresholds: Balls
    kernel: Balls  # (2n, 2n)
    total: Balls  # (2,) T
    unit: Any  # a length over a force, so that every row of F is a length

    def forces(self, x: Balls) -> tuple[Balls, Balls]:
        """q (n, 2) and their derivatives (n, 2, 2)."""
        eta = x[:-2].reshape(-1, 2)
        length = np.sqrt((eta * eta).sum(axis=1))
        if not (length > 0).all():
            raise NotProved("a displacement may be zero")
        root = np.sqrt(_positive_part(1 - length / self.thresholds))  # 0 where it slides
        slope = 3 * self.loads / (2 * self.thresholds) * root
        secant = (self.loads * (1 - root**3) / length)[:, None, None]
        along = eta[:, :, None] * eta[:, None, :] / (length * length)[:, None, None]
        slopes = slope[:, None, None] * along + secant * (exact(np.eye(2)) - along)
        return secant[:, 0] * eta, slopes

    def residual(self, x: Balls) -> Balls:
        q, n = self.forces(x)[0], len(self.loads)
        moved = x[:-2] + self.kernel @ q.reshape(-1) - np.tile(x[-2:], n)
        return np.append(moved, self.unit * (q.sum(axis=0) - self.total))

    def jacobian(self, x: Balls) -> Balls:
        n, slopes = len(self.loads), self.forces(x)[1]
        columns = self.kernel.reshape(2 * n, n, 2)  # those of each asperity
        own = np.concatenate([columns[:, i] @ slope for i, slope in enumerate(slopes)], axis=1)
        balance = self.unit * np.concatenate(slopes, axis=1)
        together, none = exact(np.tile(np.eye(2), (n, 1))), np.full((2, 2), ZERO)
        return np.block([[own + exact(np.eye(2 * n)), -together], [balance, none]])


def solve_vectors(
    scene: Any, loads: Any, force: Any, start: Any, displacement: Any, digits: int = 50
) -> VectorReference:
    """The friction state of the asperities with loads > 0, under the force (2,), to `digits`.

    start : (n, 2) forces [force] near the solution;  displacement : (2,) near it
    """
    with ctx.workdps(digits + GUARD_DIGITS):
        problem, x = _problem(scene, loads, force, start, displacement)
        size = max(float(abs(value)) for value in x)
        x = newton(problem, x, tolerance=arb(size) * arb(10) ** (-digits - GUARD_DIGITS // 2))
        x = prove(problem, x, radius=arb(size) * arb(10) ** (-digits))
        eta = x[:-2].reshape(-1, 2)
        beyond = _positive_part(1 - problem.thresholds / np.sqrt((eta * eta).sum(axis=1)))
        slips, sliding = beyond[:, None] * eta, (beyond > 0).tolist()
        return VectorReference(problem.forces(x)[0], slips, x[-2:], sliding)


def _problem(
    scene: Any, loads: Any, force: Any, start: Any, displacement: Any
) -> tuple[VectorMap, Balls]:
    touching = [i for i, load in enumerate(loads) if load > 0]
    P = np.array([loads[i] for i in touching])
    E, nu = arb(scene.material.contact_modulus), arb(scene.material.poisson_ratio)
    points, _, law = (each[touching] for each in of_scene(scene))
    thresholds = law * cube_root(P * P)
    friction = arb(scene.friction)
    kernel = tangential_kernel(points, coupling(points, E), nu / (2 - nu))
    total = np.array([arb(float(each)) for each in force]) / friction
    q = exact(np.asarray(start)[touching].reshape(-1)) / friction
    X = exact(displacement) / travel_of(friction, nu)
    if not np.isfinite(displacement).all():
        X = _near_the_limit(P, kernel, total)
    eta = np.tile(X, len(P)) - kernel @ q
    unit = (X @ X).sqrt() / (total @ total).sqrt()
    return VectorMap(P, thresholds, kernel, total, mid(unit)), mid(np.concatenate((eta, X)))


def _near_the_limit(P: Balls, kernel: Balls, total: Balls) -> Balls:
    """X from what is missing of the total, where all slide: the last formula of friction.md."""
    size = (total @ total).sqrt()
    along, missing = total / size, P.sum() - size
    if not missing > 0:
        raise NotProved("the force is not below what friction can bear")
    across = np.array([-along[1], along[0]])
    side = (kernel @ np.outer(P, along).reshape(-1)).reshape(-1, 2) @ across
    spread = (P * (side - (P * side).sum() / P.sum()) ** 2).sum()
    return along * (spread / (2 * missing)).sqrt()


def tangential_kernel(points: Balls, influence: Balls, bias: Any) -> Balls:
    """(2n, 2n) A_ij [(1 - bias) I + 2 bias d d']."""
    d = points[:, None] - points
    squares = (d * d).sum(axis=2)
    np.fill_diagonal(squares, arb(1))  # where A is 0
    along = 2 * bias * d[..., None] * d[..., None, :] / squares[..., None, None]
    blocks = influence[..., None, None] * (along + (1 - bias) * exact(np.eye(2)))
    return blocks.transpose(0, 2, 1, 3).reshape(2 * len(points), -1)


# What a proof file claims; nothing here knows of the checker.


def false_claims(document: Any) -> list[str]:
    """The claims that do not hold for the file's own scene: none if all is well."""
    claims, scene = document["claims"], document["scene"]
    ((control, value),) = document["prescribed"].items()
    with ctx.workdps(150):
        pressed = _solved(scene, document["pressed"]["radii"], {control: float.fromhex(value)})
        touch = ["contact" if load > 0 else "open" for load in pressed.loads]
        numbers = {"loads": pressed.loads, "gaps": pressed.gaps}
        false = _false(claims, touch, approach=pressed.approach, load=pressed.load, **numbers)
        for state, claim in zip(document["sheared"], claims["shear"], strict=True):
            false += _false_shear(scene, pressed, state, claim)
    return false


def _false_shear(scene: Any, pressed: Reference, state: Any, claim: Any) -> list[str]:
    """The friction state by Ciavarella and Jaeger's theorem, and the loss of its cycle."""
    f, nu, force = (_number(x) for x in (scene["friction"], scene["poisson_ratio"], state["force"]))
    radii = state["held"]["radii"]
    held = _solved(scene, radii, {"load": pressed.load - force / f})
    slid, pairs = slide(f, nu, pressed, held), [*zip(pressed.loads, held.loads, strict=True)]
    slides = ["open" if not P > 0 else "partial" if p > 0 else "sliding" for P, p in pairs]
    numbers = {"forces": slid.forces, "slips": slid.slips, "displacement": slid.displacement}
    false = ["the theorem does not hold"] if any(p > P for P, p in pairs) else []
    if claim["loss"] is not None:
        numbers["loss"] = slid.energy
        between = _solved(scene, radii, {"load": pressed.load - force / (2 * f)}).loads
        if not all(p <= middle <= P for middle, (P, p) in zip(between, pairs, strict=True)):
            false.append("a loss without order")
    return false + _false(claim, slides, **numbers)


def _false(claim: Any, statuses: list[str], **numbers: Balls) -> list[str]:
    """Statuses that are others, and numbers outside their intervals."""
    told = enumerate(zip(claim["status"], statuses, strict=True))
    false = [f"{i} is {it}, not {say}" for i, (say, it) in told if say not in (it, "undecided")]
    for name, true in numbers.items():
        ends = np.reshape(claim[name], (-1, 2))
        for (low, high), it in zip(ends, np.atleast_1d(true), strict=True):
            if not _number(low) <= it <= _number(high):
                false.append(f"{name}: {it} is outside its bounds")
    return false


def _solved(scene: Any, radii: list[list[str]], control: Any) -> Reference:
    columns = (scene[key] for key in ("x", "y", "heights", "tip_radii"))
    x, y, heights, tips = (np.array([*map(float.fromhex, column)]) for column in columns)
    a = np.array([sum(map(float.fromhex, radius)) for radius in radii])
    modulus, sphere = float.fromhex(scene["contact_modulus"]), scene["sphere_radius"]
    along = tuple(map(float.fromhex, sphere if isinstance(sphere, list) else [sphere] * 2))
    asperities = SimpleNamespace(positions=np.stack([x, y], 1), tip_radii=tips, heights=heights)
    material, geometry = SimpleNamespace(contact_modulus=modulus), scene["geometry"]
    given = dict(asperities=asperities, material=material, sphere_radius=along, geometry=geometry)
    start = 4 * modulus * a**3 * (sum(1 / R for R in along) / 2 + 1 / tips) / 3
    return solve(SimpleNamespace(**given), start=start, **control)


def _number(text: str) -> arb:
    return arb(float.fromhex(text))
