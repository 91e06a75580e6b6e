"""Check a proof of which asperities touch, and which slide: python checker.py proof.json

This file needs only the standard library and trusts no claim of the proof. Asperity i of a scene
has the contact radius a_i, which is 0 where the asperity is open, and carries the load
P_i = 4 E* a_i^3 / (3 R_i). Here E* is the contact modulus, and 1 / R_i the curvature of the tip
plus the mean curvature of the *base*, which is the sphere, or a flat, cylinder or ellipsoid in its
place. With the distances r_ij between contact points, the contact law is

    a_i^2 / R_i + sum_j 4 a_j^3 / (3 pi R_j r_ij)  =  D_i  where a_i > 0,  >=  D_i  where a_i = 0,

where the sum leaves out j = i. D_i = D0 + d_i is the approach D0 of the bodies plus the offset d_i
of the asperity: its height minus the distance there between the base and the plane that touches the
base on the axis. Below, A_ij = 1 / (pi E* r_ij) and A_ii = 0.

A proof file contains a scene, radii near its solution, a box of radii, an argument that the energy
is convex on this box, and claims. Its numbers are float64 in hexadecimal. The checker computes with
rationals and with intervals between rationals. Equation (1) is in docs/theory/proof-file.md; (2) to
(12) are in proof-file-steps.md in the same folder.

Exit status: 0 if all claims are proved; 1 if a claim is refused, with the reason; 2 if the file is
not a proof.
"""

from __future__ import annotations

import hashlib
import json
import logging
import math
import sys
from collections.abc import Iterator, Sequence
from decimal import ROUND_CEILING, ROUND_FLOOR, Context
from fractions import Fraction
from operator import le, mul
from pathlib import Path
from typing import Any, NamedTuple

FORMAT = "convexrough proof 2"
MOST_ASPERITIES, MOST_BYTES = 3000, 1 << 24
MOST_INVERTED = 600  # most touching asperities for which order is proved with an inverse
BITS = 128  # significant bits to which the ends of an interval are rounded, outwards
GRID = 200  # bits of the largest coordinate as an integer; points are rounded to this grid
NEAREST = 1 << 100  # asperities nearer than this on the grid are refused
UNIT = 1 << 320  # inverse distances are integers / UNIT, too small by at most the factor SLACK
SLACK = 1 + Fraction(1, 1 << 96)
FAR = 1 << 400  # stands for the distance of an asperity from itself, which it does not displace
ROOT_BITS = 60  # bits of the integer Cholesky factor
ONE_BITS = 80  # binary places of fixed-point numbers in the proof of order
ONE = 1 << ONE_BITS

LOGGER = logging.getLogger("convexrough")  # of progress


class Refused(Exception):
    """A claim is not proved."""


class Unreadable(Exception):
    """The file is not a proof."""


def rounded(x: Fraction | int, up: bool) -> Fraction:
    """x rounded up or down to BITS significant bits."""
    n, d = x.as_integer_ratio()
    shift = BITS - n.bit_length() + d.bit_length()
    n, d = n << max(shift, 0), d << max(-shift, 0)
    whole = -(-n // d) if up else n // d
    return Fraction(whole << max(-shift, 0), 1 << max(shift, 0))


def root(x: Fraction, up: bool) -> Fraction:
    """The square root of x, rounded up or down to about BITS bits."""
    if x <= 0:
        return Fraction(0)
    scale = Fraction(2) ** (BITS + (x.denominator.bit_length() - x.numerator.bit_length()) // 2)
    square = x * scale * scale
    return (math.isqrt(math.ceil(square)) + 1 if up else math.isqrt(math.floor(square))) / scale


class Interval:
    """An interval between two rationals, which contains a real number."""

    def __init__(self, low: Fraction | int, high: Fraction | int | None = None) -> None:
        self.low = rounded(low, up=False)
        self.high = rounded(low if high is None else high, up=True)

    def __add__(self, other: Interval | Fraction | int) -> Interval:
        other = interval(other)
        return Interval(self.low + other.low, self.high + other.high)

    def __mul__(self, other: Interval | Fraction | int) -> Interval:
        other = interval(other)
        ends = [x * y for x in (self.low, self.high) for y in (other.low, other.high)]
        return Interval(min(ends), max(ends))

    def __sub__(self, other: Interval | Fraction | int) -> Interval:
        return self + interval(other) * -1

    def __truediv__(self, other: Interval | Fraction | int) -> Interval:
        other = interval(other)
        if other.low <= 0:
            raise Refused("a divisor may be 0 or negative")
        return self * Interval(1 / other.high, 1 / other.low)

    def positive_part(self) -> Interval:
        return Interval(max(self.low, Fraction(0)), max(self.high, Fraction(0)))

    def negative_part(self) -> Interval:
        return (self * -1).positive_part()

    def root(self) -> Interval:
        """The square root of a number that is not negative."""
        return Interval(root(self.low, up=False), root(self.high, up=True))

    def wider(self, by: Fraction) -> Interval:
        return Interval(self.low - by, self.high + by)

    def size(self) -> Fraction:
        """The largest magnitude."""
        return max(-self.low, self.high)


def interval(x: Interval | Fraction | int) -> Interval:
    return x if isinstance(x, Interval) else Interval(x)


PI = Interval(*(Fraction(31415926535897932384626433832795028841971 + i, 10**40) for i in (0, 1)))


def read(path: str) -> Any:
    """The contents of a JSON file in which all numbers are strings and no key is repeated."""

    def once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        if len(dict(pairs)) < len(pairs):
            raise Unreadable("a key appears twice")
        return dict(pairs)

    def refuse(text: str) -> None:
        raise Unreadable(f"the number {text[:40]}: numbers are strings, float64 in hexadecimal")

    try:
        with Path(path).open("rb") as file:
            contents = file.read(MOST_BYTES + 1)
        if len(contents) > MOST_BYTES:
            raise Unreadable(f"more than {MOST_BYTES} bytes")
        hooks: Any = dict.fromkeys(("parse_int", "parse_float", "parse_constant"), refuse)
        return json.loads(contents.decode(), object_pairs_hook=once, **hooks)
    except OSError as error:
        raise Unreadable(error.strerror or "no file") from error
    except ValueError as error:
        raise Unreadable(f"not JSON: {error}") from error
    except RecursionError as error:
        raise Unreadable("nested too deeply") from error


def table(value: Any, *keys: str) -> list[Any]:
    """The values of the given keys. Other keys are refused, as they would not be checked."""
    if not isinstance(value, dict) or set(value) != set(keys):
        kind = type(value).__name__
        found = ", ".join(value) or "none of them" if isinstance(value, dict) else kind
        raise Unreadable(f"expected a table of {', '.join(keys)}, found {found[:200]}")
    return [value[key] for key in keys]


def as_list(values: Any, what: str, n: int | None = None) -> list[Any]:
    if not isinstance(values, list) or (n is not None and len(values) != n):
        raise Unreadable(f"{what}: expected a list" + (f" of {n}" if n is not None else ""))
    return values


def number(text: Any, what: str) -> Fraction:
    """The float64 number that `float.hex` writes as this text. Reading rounds nothing."""
    try:
        value = float.fromhex(text)
        if math.isfinite(value) and value.hex() == text:
            return Fraction(value)
    except (TypeError, ValueError, OverflowError):
        pass
    raise Unreadable(f"{what}: {str(text)[:40]!r} is not a finite float64, as float.hex writes it")


def numbers(values: Any, what: str, n: int | None = None) -> list[Fraction]:
    return [number(text, f"{what} [{i}]") for i, text in enumerate(as_list(values, what, n))]


def digest(scene: Any, prescribed: Any) -> str:
    """SHA-256 of the scene and the prescribed quantity, as JSON with sorted keys and no spaces."""
    given = {"prescribed": prescribed, "scene": scene}
    text = json.dumps(given, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


class Scene(NamedTuple):
    """The scene. Points are rounded down to a grid, offsets to intervals; all else is exact."""

    modulus: Fraction  # E*, used only for loads from radii
    ratio: Fraction  # Poisson's ratio
    friction: Fraction
    radii: list[Fraction]  # R_i
    offsets: list[Interval]  # d_i
    points: list[tuple[int, int]]  # contact points in grid units, rounded down
    grid: Fraction  # grid units per unit of length


def curvatures(value: Any) -> list[Fraction]:
    """Curvatures of the base along x and y, from one radius or two; 0 for "inf"."""
    radii = as_list(value, "sphere_radius", 2) if isinstance(value, list) else [value, value]
    found = [Fraction(0) if text == "inf" else number(text, "sphere_radius") for text in radii]
    if any(text != "inf" and radius <= 0 for text, radius in zip(radii, found, strict=True)):
        raise Refused("a radius of the sphere is not positive")
    return [1 / radius if radius else radius for radius in found]


SINGLE = ("sphere_radius", "contact_modulus", "poisson_ratio", "friction", "geometry")
SEVERAL = ("x", "y", "heights", "tip_radii")


def read_scene(given: Any) -> Scene:
    base, E, nu, f, geometry, *values = table(given, *SINGLE, *SEVERAL)
    bends, modulus = curvatures(base), number(E, "contact_modulus")
    ratio = number(nu, "poisson_ratio")
    friction = Fraction(0) if f is None else number(f, "friction")
    n = len(as_list(values[0], "x"))
    x, y, heights, tips = (numbers(*each, n) for each in zip(values, SEVERAL, strict=True))
    if not 0 < len(x) <= MOST_ASPERITIES:
        raise Refused(f"{len(x)} asperities; from 1 to {MOST_ASPERITIES} can be checked in minutes")
    if min(modulus, *tips) <= 0 or friction < 0 or not 0 <= ratio <= Fraction(1, 2):
        raise Refused("a radius, the modulus, friction or Poisson's ratio is out of range")
    if geometry not in ("summit", "closest"):
        raise Unreadable("the geometry is neither summit nor closest")
    drops = [Fraction(0)] * len(x)
    for ps, c in zip((x, y), bends, strict=True):
        for i, tip in enumerate(tips):
            p, ps[i] = ps[i], ps[i] / (1 + c * tip * (geometry == "closest"))  # p R / (R + rho)
            drops[i] += c * p * ps[i] / 2
    largest = max(map(abs, x + y)) or Fraction(1)
    grid = Fraction(2) ** (GRID - largest.numerator.bit_length() + largest.denominator.bit_length())
    radii = [1 / (sum(bends, Fraction(0)) / 2 + 1 / tip) for tip in tips]
    offsets = [Interval(z - drop) for z, drop in zip(heights, drops, strict=True)]
    points = [(math.floor(p * grid), math.floor(q * grid)) for p, q in zip(x, y, strict=True)]
    return Scene(modulus, ratio, friction, radii, offsets, points, grid)


def distances(
    scene: Scene, some: Sequence[int], chosen: list[int]
) -> Iterator[tuple[int, list[int]]]:
    """Yields, for each i of `some`, i and the integers m of (1), one for each j of `chosen`."""
    place = {j: k for k, j in enumerate(chosen)}
    points = [scene.points[j] for j in chosen]
    for i in some:
        p, q = scene.points[i]
        apart = [math.isqrt((x - p) ** 2 + (y - q) ** 2) for x, y in points]
        if i in place:
            apart[place[i]] = FAR
        if min(apart, default=FAR) < NEAREST:
            raise Refused(f"asperity {i} is too near another to bound their distance")
        if i % 100 == 0:
            LOGGER.info("asperity %d of %d", i, len(scene.points))
        yield i, apart


class Box(NamedTuple):
    """A box 0 <= a_i <= b_i on which the Hessian is at least (1 - theta) diag(1 / (2 E* b))."""

    radii: list[Fraction]  # b_i; asperities with b_i = 0 are fixed open
    able: list[int]  # the indices with b_i > 0
    theta: Fraction


def read_box(scene: Scene, given: Sequence[Any]) -> Box:
    """The box. Proves that A + diag(theta / (2 E* b)) is positive semidefinite (2)."""
    b, theta = numbers(given[0], "box", len(scene.points)), number(given[1], "convexity_number")
    able = [i for i in range(len(b)) if b[i] > 0]
    if min(b) < 0 or not 0 < theta < 1:
        raise Refused("the box is negative, or the convexity number not between 0 and 1")
    radii = [b[i] / theta for i in able]
    if given[2] is None:
        prove_definite(scene, radii, able)
    else:
        prove_by_shells(scene, numbers(given[2], "shells", len(b)), radii, able)
    return Box(b, able, theta)


def prove_by_shells(
    scene: Scene, shells: list[Fraction], radii: list[Fraction], able: list[int]
) -> None:
    """Prove A + diag(1 / (2 E* radii)) >= 0 by spherical shells (3), which may overlap."""
    sizes = [math.floor(shells[i] * scene.grid) for i in able]
    if min(sizes, default=1) <= 0:
        raise Refused("a shell is not positive")
    rows = distances(scene, able, able)
    for size, radius, (i, apart) in zip(sizes, radii, rows, strict=True):
        overlap = 0
        for other, m in zip(sizes, apart, strict=True):
            if (over := size + other - m + 2) > 0:
                overlap -= -over * over // (4 * (m - 2))
        if overlap > size * (size * PI.low / (2 * radius * scene.grid) - 1):
            raise Refused(f"the shell of asperity {i} is too small, or overlaps others too much")


def prove_definite(scene: Scene, radii: list[Fraction], able: list[int]) -> None:
    """Prove A + diag(1 / (2 E* radii)) >= 0 by a Cholesky factorisation in integers (4)."""
    scale = [math.isqrt(math.floor(2 * c * scene.grid * 4**ROOT_BITS)) for c in radii]
    wholes, parts = (PI.high * UNIT).as_integer_ratio()
    factor: list[list[int]] = []
    for k, (_, apart) in enumerate(distances(scene, able, able)):
        row = list[int]()
        for j in range(k):
            entry = scale[k] * scale[j] * (UNIT // (apart[j] + 3)) * parts // wholes
            row.append((entry - sum(map(mul, row, factor[j]))) // factor[j][j])
        rest = math.floor(scale[k] ** 2 / (2 * radii[k] * scene.grid)) - sum(map(mul, row, row))
        if (rest := rest - (4 * len(able) << ROOT_BITS)) <= 0:
            raise Refused("the energy is not proved convex: its Cholesky factorisation breaks down")
        factor.append([*row, math.isqrt(rest)])


class State(NamedTuple):
    """A solution and trial loads, as intervals. Forces and energies are divided by E*."""

    near: list[Interval]  # trial loads, from the given radii, scaled to a prescribed total
    pushed: list[Interval]  # displacements (A P)_i of the trial loads
    approach: Interval  # D0 of the solution
    depths: list[Interval]  # D_i - (A P)_i of the solution: the indentation, or minus the gap
    loads: list[Interval]  # P_i of the solution
    total: Interval  # sum of the P_i
    energy: Interval  # the energy of the solution, the least for this total (9)


def prove_state(scene: Scene, box: Box, place: Any, load: Interval | None) -> State:
    """The solution, proved to be in the box, at the total `load` or, if None, the given approach.

    place : the entry of the file with radii and approach; each is a sum of float64 numbers
    """
    radii, centre = table(place, "radii", "approach")
    b, R, d, everyone = box.radii, scene.radii, scene.offsets, range(len(scene.points))
    sums = [numbers(x, f"radii [{i}]") for i, x in enumerate(as_list(radii, "radii", len(b)))]
    a = [sum(parts, Fraction(0)) for parts in sums]
    approach = sum(numbers(centre, "approach"), Fraction(0))
    if min(a) < 0 or any(a[i] > b[i] for i in everyone):
        raise Refused("a contact radius is negative, or outside the box")
    exact = [4 * a[i] ** 3 / (3 * R[i]) for i in everyone]
    pushed, spread = push(scene, box, exact)
    near, local = [Interval(p) for p in exact], [Interval(a[i] ** 2 / R[i]) for i in everyone]
    if load is not None:  # (5) scaled to the total
        scaling = Interval(1).wider((load / sum(near, Interval(0)) - 1).size())
        near, local, pushed = ([x * scaling for x in xs] for xs in (near, local, pushed))

    # (6) Bound the distance to the solution in the energy norm, (7) in each load; check the box.
    trial = [d[i] + approach - pushed[i] for i in everyone]
    gaps = [local[i] - trial[i] for i in everyone]
    off = [gaps[i].size() if a[i] > 0 else max(-gaps[i].low, Fraction(0)) for i in everyone]
    squares = [Interval(off[i]) * off[i] * (2 * b[i]) for i in box.able]
    misfit = sum(squares, Interval(0)).root()
    distance = misfit / (1 - box.theta)
    error = [(distance * interval(2 * radius).root()).high for radius in b]
    if any(near[i].high + error[i] >= 4 * b[i] ** 3 / (3 * R[i]) for i in box.able):
        raise Refused("the solution may be outside the box")

    # (8) Enclose the depth of each asperity: D_i minus the displacement (A P)_i by the others.
    moved = [(distance * s.root()).high for s in spread]
    shift = Fraction(0)
    if load is not None:
        known = [
            (local[i] * error[i] / near[i] + gaps[i].size() + moved[i]).high
            for i in box.able
            if error[i] < near[i].low
        ]
        if not known:
            raise Refused("no asperity is proved to touch, so the approach is not bounded")
        shift = min(known)
    D0 = Interval(approach).wider(shift)
    depths = [trial[i].wider(moved[i] + shift) for i in everyone]
    depths = [Interval(x.low, min(x.high, (D0 + d[i]).high)) for i, x in enumerate(depths)]
    if any(b[i] == 0 and depths[i].high > 0 for i in everyone):
        raise Refused("an asperity that may touch is fixed open")
    deep = [depth.positive_part() for depth in depths]
    loads = [(x * x * x * R[i]).root() * Fraction(4, 3) for i, x in enumerate(deep)]

    # (9) The energy of the solution is at most distance * misfit below that of the trial loads.
    mean = [local[i] * Fraction(3, 5) + pushed[i] * Fraction(1, 2) - d[i] for i in everyone]
    energy = sum([near[i] * mean[i] for i in everyone if a[i] > 0], Interval(0))
    energy += Interval(-(distance * misfit).high, 0)
    if load is None:
        load = sum(loads, Interval(0))
        energy += (load - sum(near, Interval(0))) * approach
    return State(near, pushed, D0, depths, loads, load, energy)


def push(scene: Scene, box: Box, loads: list[Fraction]) -> tuple[list[Interval], list[Interval]]:
    """Intervals for (A P)_i, P = `loads`, and for sum_j A_ij^2 2 b_j, from sums of integers (1)."""
    force = max(loads) / 2**GRID or Fraction(1)
    parts = [math.floor(loads[j] / force) for j in box.able]
    weights = [math.ceil(2 * box.radii[j] * scene.grid) for j in box.able]
    pushed, spread = [], []
    for _, apart in distances(scene, range(len(scene.points)), box.able):
        inverse = [UNIT // (m + 3) for m in apart]
        least = sum(map(mul, inverse, parts))
        most = (least + sum(inverse)) * SLACK
        pushed.append(Interval(least, most) * (force * scene.grid / UNIT) / PI)
        most = sum(map(mul, map(mul, inverse, inverse), weights)) * SLACK**2
        spread.append(Interval(0, most) * (scene.grid / UNIT**2) / PI / PI)
    return pushed, spread


def scope(scene: Scene, box: Box, state: State, top: Fraction | None) -> str:
    """The scope: "global" if every solution is proved to be in the box, else "local" (10).

    top : None if the approach is prescribed; else the ceiling of the file. If it does not exceed
        all (A P)_i of the trial loads, the scope is "local"
    """
    ceiling = state.approach  # an upper bound on D0 of every solution
    if top is not None:
        ceiling = Interval(top)
        for p, w, d, R in zip(state.near, state.pushed, scene.offsets, scene.radii, strict=True):
            if w.high >= top:
                return "local"
            if p.high > 0:
                part = p / (w * -1 + top)
                ceiling += p / state.total * (part * part / (12 * R) - d)
    squares = [R * (d + ceiling).high for R, d in zip(scene.radii, scene.offsets, strict=True)]
    return "global" if all(map(le, squares, (b * b for b in box.radii))) else "local"


def ordered_fall(scene: Scene, box: Box, state: State) -> Fraction:
    """A decrease of D0 from this state over which order is proved (11); 0 if none is.

    The rate of an asperity is the derivative of its indentation with respect to D0. `missed` holds
    a lower bound on each rate, times -ONE. It must be negative for all asperities that may touch.
    For an open asperity it may be positive if the decrease is so small that the gap stays open.
    """
    near = [i for i, x in enumerate(state.depths) if x.high > 0]
    radii = [min(root(scene.radii[i] * state.depths[i].high, up=True), box.radii[i]) for i in near]
    weights = [math.ceil(2 * a * scene.grid) for a in radii]
    parts, wholes = (ONE / PI.high).as_integer_ratio()
    rows: dict[int, list[int]] = {}  # rows of F (11) times ONE, too small by less than `rounding`
    sums: dict[int, int] = {}
    able = [i for i, d in enumerate(scene.offsets) if (state.approach + d).high > 0]
    for i, apart in distances(scene, able, near):
        row = [w * parts // ((m + 3) * wholes) for w, m in zip(weights, apart, strict=True)]
        sums[i] = sum(row)
        if len(near) <= MOST_INVERTED:
            rows[i] = row
    rounding = 2 + (max(sums.values(), default=0) >> 68)
    missed = {i: Fraction(each + rounding * len(near) - ONE) for i, each in sums.items()}
    if any(missed[i] > 0 for i in near):
        missed = missed_by_inverse(rows, near, rounding) if rows else {near[0]: Fraction(1)}
    if any(missed[i] >= 0 for i in near):
        return Fraction(0)
    falls = [-state.depths[i].high * ONE / each for i, each in missed.items() if each > 0]
    return min(falls, default=Fraction(FAR))


def missed_by_inverse(
    rows: dict[int, list[int]], near: list[int], rounding: int
) -> dict[int, Fraction]:
    """`missed` of `ordered_fall`, by the bounds (11) with weights from an approximate inverse."""
    n, place = len(near), {i: k for k, i in enumerate(near)}
    X = [[*rows[i][:k], ONE, *rows[i][k + 1 :]] for k, i in enumerate(near)]
    for k in range(n):  # Gauss-Jordan elimination in place
        if X[k][k] <= 0:
            return dict.fromkeys(rows, Fraction(1))
        LOGGER.info("inverting: %d of %d", k, n)
        pivot, X[k][k] = X[k][k], ONE
        X[k] = [ONE * x // pivot for x in X[k]]
        for i in range(n):
            if i != k:
                factor, X[i][k] = X[i][k], 0
                X[i] = [x - (factor * t >> ONE_BITS) for x, t in zip(X[i], X[k], strict=True)]
    inverse = list(zip(*X, strict=True))
    columns, found = list(zip(*(rows[i] for i in near), strict=True)), {}
    for i, row in rows.items():
        if i in place:
            k = place[i]
            weights = [-ONE * x // max(X[k][k], 1) for x in X[k]]
            weights[k] = 0
        else:
            weights = [sum(map(mul, row, column)) // ONE for column in inverse]
        swept = [ONE * w + sum(map(mul, weights, x)) for w, x in zip(weights, columns, strict=True)]
        short = sum(max(ONE * x - y, 0) for x, y in zip(row, swept, strict=True))
        lost = n * rounding * (ONE + sum(map(abs, weights)))
        total = sum(max(w, 0) for w in weights)
        found[i] = Fraction(short + lost, ONE) + total - ONE
    return found


def prove_shear(
    scene: Scene, box: Box, pressed: State, ordered: Fraction, entry: Any
) -> dict[str, Any]:
    """What is proved about a friction state, which is a difference of two solutions (12)."""
    force, place = table(entry, "force", "held")
    f, unit = scene.friction, scene.friction * scene.modulus
    if number(force, "force") <= 0 or f <= 0:
        raise Refused("a shear force or the coefficient of friction is not positive")
    fall = number(force, "force") / unit
    if (pressed.total - fall).low <= 0:
        raise Refused("a shear force is not proved to be below the friction limit")
    held = prove_state(scene, box, place, pressed.total - fall)
    drop, mean = pressed.approach - held.approach, pressed.approach + held.approach
    in_order, travel = drop.high < ordered, f * (2 - scene.ratio) / (2 * (1 - scene.ratio))
    statuses, slips = list[str](), list[Interval]()
    for i, (at, after) in enumerate(zip(pressed.depths, held.depths, strict=True)):
        if not in_order and after.high > 0 and held.loads[i].high > pressed.loads[i].low:
            raise Refused(f"asperity {i} may be dragged along: under less load it may carry more")
        touches, slip = status(at, "contact", "open"), after.negative_part() * travel
        statuses.append(status(after, "partial", "sliding") if touches == "contact" else touches)
        slips.append(Interval(slip.low if at.low > 0 else 0, slip.high if at.high > 0 else 0))
    excess = pressed.energy - held.energy - mean * (fall / 2)
    return {
        "order": "proved" if in_order else "proved for one step",
        "status": statuses,
        "forces": [(pressed.loads[i] - rest) * unit for i, rest in enumerate(held.loads)],
        "slips": slips,
        "displacement": drop * travel,
        "loss": (excess * (8 * travel * unit)).positive_part() if in_order else None,
    }


KEYS = ("format", "scene", "prescribed", "sha256", "argument", "pressed", "sheared", "claims")
WEAKER = {"global": "local", "local": "local", "proved": "proved for one step"}


def prove(document: Any) -> dict[str, Any]:
    """All that is proved: statuses, and intervals for loads, gaps, forces, slips and losses."""
    form, given, prescribed, named, argument, pressed, sheared, _ = table(document, *KEYS)
    if form != FORMAT:
        raise Unreadable(f"expected the format {FORMAT!r}")
    if named != digest(given, prescribed):
        raise Refused("the sha256 is not that of this scene and its prescribed load or approach")
    scene, load, top = read_scene(given), None, None
    *convexity, ceiling = table(argument, "box", "convexity_number", "shells", "ceiling")
    if isinstance(prescribed, dict) and "load" in prescribed:
        (total,) = table(prescribed, "load")
        load, top = Interval(number(total, "load") / scene.modulus), number(ceiling, "ceiling")
    elif [*table(prescribed, "approach")] != table(pressed, "radii", "approach")[1]:
        raise Refused("the approach is not the one prescribed")
    elif ceiling is not None:
        raise Unreadable("the ceiling must be null if the approach is prescribed")
    box = read_box(scene, convexity)
    state = prove_state(scene, box, pressed, load)
    ordered = ordered_fall(scene, box, state) if as_list(sheared, "sheared") else Fraction(0)
    return {
        "scope": scope(scene, box, state, top),
        "approach": state.approach,
        "load": state.total * scene.modulus,
        "status": [status(depth, "contact", "open") for depth in state.depths],
        "loads": [load * scene.modulus for load in state.loads],
        "gaps": [depth.negative_part() for depth in state.depths],
        "shear": [prove_shear(scene, box, state, ordered, entry) for entry in sheared],
    }


def status(depth: Interval, positive: str, negative: str) -> str:
    return positive if depth.low > 0 else negative if depth.high < 0 else "undecided"


def hold(what: str, claimed: Any, proved: Any) -> None:
    """Compare claims with what is proved. Raises Refused if a claim is not proved."""
    if isinstance(proved, dict):
        for key, claim in zip(proved, table(claimed, *proved), strict=True):
            if key != "loss" or claim is not None:  # null claims no loss
                hold(f"{what} {key}", claim, proved[key])
    elif isinstance(proved, list):
        for i, claim in enumerate(as_list(claimed, what, len(proved))):
            hold(f"{what} [{i}]", claim, proved[i])
    elif not isinstance(proved, Interval):
        if claimed not in (proved, WEAKER.get(proved, proved and "undecided")):
            raise Refused(f"{what}: claimed {str(claimed)[:20]!r}, proved {proved!r}")
    else:
        low, high = numbers(claimed, what, 2)
        if not low <= proved.low <= proved.high <= high:
            raise Refused(f"{what}: not proved to be within the claimed bounds")


def sentence(document: Any) -> str:
    """The claims in sentences: one about the contact, and one for each shear force."""
    claims, ((control, value),) = document["claims"], document["prescribed"].items()

    def counts(some: Any, *statuses: str) -> str:
        return ", ".join(f"{some['status'].count(it)} {it}" for it in (*statuses, "undecided"))

    bounds = [numbers(pair, "claims loads", 2) for pair in claims["loads"]]
    widest, largest = max(high - low for low, high in bounds), max(low for low, _ in bounds)
    known = "without a bound relative to the largest"
    if largest > 0 or widest == 0:
        part = (widest / (largest or 1)).as_integer_ratio()
        known = f"known to {Context(1, ROUND_CEILING).divide(*part):g} of the largest"
    alone = "the only one" if claims["scope"] == "global" else "the only one inside its box"
    lines = [
        f"proved: under the {control} {float.fromhex(value):.10g} there is a solution, {alone}",
        f"{counts(claims, 'contact', 'open')}, loads {known}",
    ]
    for entry, claim in zip(document["sheared"], claims["shear"], strict=True):
        lost = "no loss is proved"
        if claim["loss"] is not None:
            low, high = map(float.fromhex, claim["loss"])  # ten digits, rounded outwards
            down, up = (Context(10, rounding) for rounding in (ROUND_FLOOR, ROUND_CEILING))
            lost = f"a cycle loses {down.create_decimal(low):g} to {up.create_decimal(high):g}"
        force = f"under the shear force {float.fromhex(entry['force']):.10g}"
        lines.append(f"{force} ({claim['order']}): {counts(claim, 'sliding', 'partial')}, {lost}")
    return "\n  ".join([*lines, f"scene {document['sha256'][:12]}"])


def check(document: Any) -> str:
    """The claims in sentences. Raises Refused if one is not proved, Unreadable for other files."""
    proved = prove(document)  # also proves that the document has the keys
    hold("claims", document["claims"], proved)
    return sentence(document)


def main(arguments: Sequence[str]) -> int:
    if sys.stderr is not None and sys.stderr.isatty():  # then a line shows the progress
        progress = logging.StreamHandler()
        progress.terminator = "\033[K\r"
        LOGGER.addHandler(progress)
        LOGGER.setLevel(logging.INFO)
    if len(arguments) != 1 or arguments[0].startswith("-"):
        print("usage: python checker.py proof.json", file=sys.stderr)
        return 2
    try:
        print(check(read(arguments[0])))
        return 0
    except Refused as error:
        print(f"refused: {error}", file=sys.stderr)
        return 1
    except (Unreadable, RecursionError) as error:
        print(f"unreadable: {arguments[0]}: {error}", file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
