"""Check a proof of which asperities touch, and which slide: python checker.py proof.json

Needs the standard library only and believes nothing in the file. The contact law asks of n contact
radii a_i, with loads P_i = 4 E* a_i^3 / (3 R_i), 1 / R_i = 1 / R + 1 / rho_i and D_i = D0 + d_i,

    a_i^2 / R_i + sum_j 4 a_j^3 / (3 pi R_j r_ij)  =  D_i  where a_i > 0,  >=  D_i  where a_i = 0.

The file states a scene, radii near its solution, a box of radii, why the energy is convex on that
box, and what it claims. Its numbers are float64 in hexadecimal: exact rationals. Numbers computed
here are rational, too, or enclosed between rationals. Pages
docs/theory/proof-file-pressing.md and docs/theory/proof-file-friction.md derive (1) - (10).

Exit status: 0 all that is claimed is proved; 1 refused, with the reason; 2 unreadable.
"""

from __future__ import annotations

import hashlib
import json
import math
import sys
from collections.abc import Callable, Iterator, Sequence
from decimal import ROUND_CEILING, ROUND_FLOOR, Context
from fractions import Fraction
from operator import mul
from pathlib import Path
from typing import Any, NamedTuple

FORMAT = "convexrough proof 1"
MOST_ASPERITIES, MOST_BYTES = 3000, 1 << 24
BITS = 128  # significant bits to which the ends of an interval are rounded, outwards
GRID = 160  # bits of the largest coordinate as an integer: points are known to 1 on that grid
NEAREST = 1 << 80  # asperities nearer than this on the grid are refused
UNIT = 1 << 240  # an inverse distance is an integer over this, too small by SLACK at most
SLACK = 1 + Fraction(1, 1 << 70)
FAR = 1 << 400  # stands for the distance of an asperity to itself, as it does not push itself
ROOT_BITS = 60  # of the integer Cholesky factor

Tell = Callable[[str], object]


class Refused(Exception):
    """Something that is claimed is not proved."""


class Unreadable(Exception):
    """This is not a proof."""


# Numbers ------------------------------------------------------------------------------------------


def rounded(x: Fraction | int, up: bool) -> Fraction:
    """To BITS significant bits."""
    n, d = x.as_integer_ratio()
    shift = BITS - n.bit_length() + d.bit_length()
    n, d = n << max(shift, 0), d << max(-shift, 0)
    whole = -(-n // d) if up else n // d
    return Fraction(whole << max(-shift, 0), 1 << max(shift, 0))


def root(x: Fraction, up: bool) -> Fraction:
    """The square root to about BITS bits."""
    if x <= 0:
        return Fraction(0)
    scale = Fraction(2) ** (BITS + (x.denominator.bit_length() - x.numerator.bit_length()) // 2)
    square = x * scale * scale
    return (math.isqrt(math.ceil(square)) + 1 if up else math.isqrt(math.floor(square))) / scale


class Interval:
    """Holds a real number between two rationals."""

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
            raise Refused("a number that is divided by may be 0")
        return self * Interval(1 / other.high, 1 / other.low)

    def positive_part(self) -> Interval:
        return Interval(max(self.low, Fraction(0)), max(self.high, Fraction(0)))

    def root(self) -> Interval:
        """Of a number that is not negative."""
        return Interval(root(self.low, up=False), root(self.high, up=True))

    def wider(self, by: Fraction) -> Interval:
        return Interval(self.low - by, self.high + by)

    def size(self) -> Fraction:
        """The largest magnitude."""
        return max(-self.low, self.high)


def interval(x: Interval | Fraction | int) -> Interval:
    return x if isinstance(x, Interval) else Interval(x)


PI = Interval(*(Fraction(31415926535897932384626433832795028841971 + i, 10**40) for i in (0, 1)))


# Reading ------------------------------------------------------------------------------------------


def read(path: str) -> Any:
    """The file as JSON without numbers, and without keys that are there twice."""

    def once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        if len(dict(pairs)) < len(pairs):
            raise Unreadable("a key is there twice")
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
        raise Unreadable(f"no JSON: {error}") from error
    except RecursionError as error:
        raise Unreadable("nested too deeply") from error


def table(value: Any, *keys: str) -> list[Any]:
    """The values of these keys; there may be no others, which would not be checked."""
    if not isinstance(value, dict) or set(value) != set(keys):
        found = ", ".join(value) if isinstance(value, dict) else type(value).__name__
        raise Unreadable(f"expected a table of {', '.join(keys)}, found {found[:200]}")
    return [value[key] for key in keys]


def listed(values: Any, n: int | None = None) -> list[Any]:
    if not isinstance(values, list) or (n is not None and len(values) != n):
        raise Unreadable("expected a list" + (f" of {n}" if n is not None else ""))
    return values


def number(text: Any) -> Fraction:
    """A float64 as float.hex writes it, and no other way: so nothing is rounded in reading."""
    try:
        value = float.fromhex(text)
        if math.isfinite(value) and value.hex() == text:
            return Fraction(value)
    except (TypeError, ValueError, OverflowError):
        pass
    raise Unreadable(f"{str(text)[:40]!r} is not a finite float64 in hexadecimal")


def numbers(values: Any, n: int | None = None) -> list[Fraction]:
    return [number(text) for text in listed(values, n)]


def digest(scene: Any, prescribed: Any) -> str:
    """SHA-256 of both as one JSON object with sorted keys and without blanks."""
    given = {"prescribed": prescribed, "scene": scene}
    text = json.dumps(given, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()


class Scene(NamedTuple):
    """What is given; lengths are exact."""

    modulus: Fraction  # E*, which only turns radii into loads
    ratio: Fraction  # Poisson's
    friction: Fraction
    radii: list[Fraction]  # R_i
    offsets: list[Interval]  # d_i
    points: list[tuple[int, int]]  # where asperities touch, in grid units, rounded down
    grid: Fraction  # grid units per unit of length


def read_scene(given: Any) -> Scene:
    single, several = ("sphere_radius", "contact_modulus"), ("x", "y", "heights", "tip_radii")
    others = ("poisson_ratio", "friction", "geometry")
    *values, nu, f, geometry = table(given, *single, *several, *others)
    radius, modulus = number(values[0]), number(values[1])
    ratio, friction = number(nu), Fraction(0) if f is None else number(f)
    x, y, heights, tips = (numbers(value, len(listed(values[2]))) for value in values[2:])
    if not 0 < len(x) <= MOST_ASPERITIES:
        raise Refused(f"{len(x)} asperities; from 1 to {MOST_ASPERITIES} can be checked in minutes")
    if min(radius, modulus, *tips) <= 0 or friction < 0 or not 0 <= ratio <= Fraction(1, 2):
        raise Refused("a radius, the modulus, the friction or Poisson's ratio is out of range")
    if geometry not in ("summit", "closest"):
        raise Unreadable("the geometry is neither summit nor closest")
    further = [tip if geometry == "closest" else Fraction(0) for tip in tips]  # beyond R
    drops = [(p * p + q * q) / (2 * (radius + t)) for p, q, t in zip(x, y, further, strict=True)]
    x, y = ([p * radius / (radius + t) for p, t in zip(ps, further, strict=True)] for ps in (x, y))
    largest = max(map(abs, x + y)) or Fraction(1)
    grid = Fraction(2) ** (GRID - largest.numerator.bit_length() + largest.denominator.bit_length())
    return Scene(
        modulus=modulus,
        ratio=ratio,
        friction=friction,
        radii=[1 / (1 / radius + 1 / tip) for tip in tips],
        offsets=[Interval(z - drop) for z, drop in zip(heights, drops, strict=True)],
        points=[(math.floor(p * grid), math.floor(q * grid)) for p, q in zip(x, y, strict=True)],
        grid=grid,
    )


# Convexity ----------------------------------------------------------------------------------------


def distances(scene: Scene, among: list[int], tell: Tell) -> Iterator[tuple[int, list[int]]]:
    """Of each asperity: its number, and integers m with m - 2 < r_ij < m + 3 for `among` (1)."""
    place = {j: k for k, j in enumerate(among)}
    points = [scene.points[j] for j in among]
    for i, (p, q) in enumerate(scene.points):
        apart = [math.isqrt((x - p) ** 2 + (y - q) ** 2) for x, y in points]
        if i in place:
            apart[place[i]] = FAR
        if min(apart, default=FAR) < NEAREST:
            raise Refused(f"asperity {i} is too near another for their distance to be enclosed")
        if i % 100 == 0:
            tell(f"asperity {i} of {len(scene.points)}")
        yield i, apart


class Box(NamedTuple):
    """Radii 0 <= a_i <= b_i, where the Hessian is at least 1 - theta of its local part."""

    radii: list[Fraction]  # b_i; those with b_i = 0 are left out
    able: list[int]  # the others
    theta: Fraction


def read_box(scene: Scene, argument: Any, tell: Tell) -> Box:
    """Proves that A + diag(theta / (2 E* b)) is positive semidefinite (2)."""
    box, convexity_number, shells = table(argument, "box", "convexity_number", "shells")
    b, theta = numbers(box, len(scene.points)), number(convexity_number)
    able = [i for i in range(len(b)) if b[i] > 0]
    if min(b) < 0 or not 0 < theta < 1:
        raise Refused("the box is negative, or the convexity number not between 0 and 1")
    if shells is None:
        prove_definite(scene, [b[i] / theta for i in able], able, tell)
    else:
        prove_apart(scene, numbers(shells, len(b)), [b[i] / theta for i in able], able, tell)
    return Box(b, able, theta)


def prove_apart(
    scene: Scene, shells: list[Fraction], radii: list[Fraction], able: list[int], tell: Tell
) -> None:
    """That spheres about the asperities, of these or larger radii times 2 / pi, do not overlap."""
    room = {i: math.ceil(shells[i] * scene.grid) for i in able}
    if any(PI.low * shells[i] < 2 * radius for i, radius in zip(able, radii, strict=True)):
        raise Refused("a shell is too small for its box")
    for i, apart in distances(scene, able, tell):
        if i in room and any(room[i] + room[j] > m - 2 for j, m in zip(able, apart, strict=True)):
            raise Refused(f"the shell of asperity {i} overlaps another")


def prove_definite(scene: Scene, radii: list[Fraction], able: list[int], tell: Tell) -> None:
    """That A + diag(1 / (2 E* radii)) is, by a Cholesky factorisation in integers (3)."""
    scale = [math.isqrt(math.floor(2 * c * scene.grid * 4**ROOT_BITS)) for c in radii]
    wholes, parts = (PI.high * UNIT).as_integer_ratio()
    factor: list[list[int]] = []
    for i, apart in distances(scene, able, tell):
        if len(factor) == len(able) or i != able[len(factor)]:
            continue
        k, row = len(factor), list[int]()
        for j in range(k):
            entry = scale[k] * scale[j] * (UNIT // (apart[j] + 3)) * parts // wholes
            row.append((entry - sum(map(mul, row, factor[j]))) // factor[j][j])
        rest = math.floor(scale[k] ** 2 / (2 * radii[k] * scene.grid)) - sum(map(mul, row, row))
        if (rest := rest - (4 * len(able) << ROOT_BITS)) <= 0:
            raise Refused("the energy is not proved convex: its Cholesky factorisation breaks down")
        factor.append([*row, math.isqrt(rest)])


# The solution -------------------------------------------------------------------------------------


class State(NamedTuple):
    """Where a solution is proved to be, and the radii near it. Loads are over E*."""

    near: list[Interval]  # loads of those radii, scaled to the prescribed total, if any
    local: list[Interval]  # a_i^2 / R_i of them
    pushed: list[Interval]  # (A P)_i of them
    approach: Interval  # D0 of the solution
    depths: list[Interval]  # D_i - (A P)_i of it: the indentation, or minus the gap


def prove_state(
    scene: Scene,
    box: Box,
    contact_radii: list[Fraction],
    approach: Fraction,
    load: Interval | None,
    tell: Tell,
) -> State:
    """That the asperities of the box have one solution in it, with this approach or load."""
    a, b, R, d = contact_radii, box.radii, scene.radii, scene.offsets
    everyone = range(len(a))
    if min(a) < 0 or any(a[i] > b[i] for i in everyone):
        raise Refused("a contact radius is negative, or outside the box")
    exact = [4 * a[i] ** 3 / (3 * R[i]) for i in everyone]
    pushed, spread = push(scene, box, exact, tell)
    loads, local = [Interval(p) for p in exact], [Interval(a[i] ** 2 / R[i]) for i in everyone]
    if load is not None:  # (4) scaled to the total
        share = load / sum(loads, Interval(0))
        scaling = Interval(1).wider((share - 1).size())
        loads, local, pushed = ([x * scaling for x in xs] for xs in (loads, local, pushed))

    # (5) How far away the solution is in energy, so in each load (6): it is inside the box.
    trial = [d[i] + approach - pushed[i] for i in everyone]
    gaps = [local[i] - trial[i] for i in everyone]
    off = [gaps[i].size() if a[i] > 0 else max(-gaps[i].low, Fraction(0)) for i in everyone]
    squares = sum((Interval(off[i]) * off[i] * (2 * b[i]) for i in box.able), Interval(0))
    distance = squares.root() / (1 - box.theta)
    doubt = [(distance * interval(2 * radius).root()).high for radius in b]
    if any(loads[i].high + doubt[i] >= 4 * b[i] ** 3 / (3 * R[i]) for i in box.able):
        raise Refused("the solution may be outside the box")

    # (7) How deep each asperity is pressed: by the approach, less what the others push.
    moved = [(distance * s.root()).high for s in spread]
    shift = Fraction(0)
    if load is not None:
        known = [
            (local[i] * doubt[i] / loads[i] + gaps[i].size() + moved[i]).high
            for i in box.able
            if doubt[i] < loads[i].low
        ]
        if not known:
            raise Refused("no asperity is sure enough to touch to tell the approach")
        shift = min(known)
    depths = [trial[i].wider(moved[i] + shift) for i in everyone]
    return State(loads, local, pushed, Interval(approach).wider(shift), depths)


def push(
    scene: Scene, box: Box, loads: list[Fraction], tell: Tell
) -> tuple[list[Interval], list[Interval]]:
    """(A P)_i and a bound on sum_j A_ij^2 2 b_j, from sums of integers (1)."""
    force = max(loads) / 2**GRID or Fraction(1)
    parts = [math.floor(loads[j] / force) for j in box.able]
    weights = [math.ceil(2 * box.radii[j] * scene.grid) for j in box.able]
    pushed, spread = [], []
    for _, apart in distances(scene, box.able, tell):
        inverse = [UNIT // (m + 3) for m in apart]
        least = sum(map(mul, inverse, parts))
        most = (least + sum(inverse)) * SLACK
        pushed.append(Interval(least, most) * (force * scene.grid / UNIT) / PI)
        most = sum(map(mul, map(mul, inverse, inverse), weights)) * SLACK**2
        spread.append(Interval(0, most) * (scene.grid / UNIT**2) / PI / PI)
    return pushed, spread


def scope(scene: Scene, box: Box, state: State, load: Interval | None) -> str:
    """Whether all solutions of the contact law are in the box: "global", else "local" (8)."""
    R, d, b = scene.radii, scene.offsets, box.radii
    ceiling = state.approach.high
    if load is not None:
        pairs = list(zip(state.local, state.pushed, strict=True))
        least = max(w.high for _, w in pairs)
        most = max((u * Fraction(2, 3) + w).high for u, w in pairs)
        ceiling = min(
            ceiling_at(scene, box, state, load, least + (most - least) * Fraction(3, 4) ** k)
            for k in range(12)
        )
    deepest = [(offset + ceiling).high for offset in d]
    if any(b[i] <= 0 < deepest[i] for i in range(len(b))):
        raise Refused("an asperity that could touch is left out of the box")
    return "global" if all(b[i] ** 2 >= R[i] * deepest[i] for i in box.able) else "local"


def ceiling_at(scene: Scene, box: Box, state: State, load: Interval, top: Fraction) -> Fraction:
    """A bound on the approach of all solutions with this load, for any top from max A P on (8)."""
    total = Interval(0)
    for i in (i for i in box.able if state.near[i].high > 0):
        q, below = state.near[i] / load, Interval(top) - state.pushed[i]
        total += q * (state.near[i] / below) * (state.near[i] / below) / (12 * scene.radii[i])
        total -= q * scene.offsets[i]
    return (total + top).high


def load_of(scene: Scene, i: int, depth: Interval) -> Interval:
    """P = (4/3) (R delta^3)^(1/2), over E*."""
    delta = depth.positive_part()
    return (delta * delta * delta * scene.radii[i]).root() * Fraction(4, 3)


def gap_of(depth: Interval) -> Interval:
    return (depth * -1).positive_part()


def word(depth: Interval, positive: str, negative: str) -> str:
    return positive if depth.low > 0 else negative if depth.high < 0 else "undecided"


def loss_of(pressed: Interval, held: Interval) -> Interval:
    """Of partial slip in a cycle, over 4 P c_t f^2: (6/5) delta e, from depths at P and P - Q/f."""
    stuck = (held.positive_part() / pressed).root() if pressed.low > 0 else Interval(0, 1)
    slipped = (Interval(1) - stuck).positive_part()
    e = slipped * slipped * slipped * (stuck * stuck + stuck * 3 + 1) / 6
    return pressed.positive_part() * e * Fraction(6, 5)


# Claims -------------------------------------------------------------------------------------------

KEYS = ("format", "scene", "prescribed", "sha256", "argument", "pressed", "sheared", "claims")


def prove(document: Any, tell: Tell) -> dict[str, Any]:
    """All that is proved: words, and intervals of what can be claimed within bounds."""
    form, given, prescribed, named, argument, pressed, sheared, _ = table(document, *KEYS)
    if form != FORMAT:
        raise Unreadable(f"expected the format {FORMAT!r}")
    if named != digest(given, prescribed):
        raise Refused("the sha256 is not that of this scene and what is prescribed")
    scene, load = read_scene(given), None
    radii, approach = table(pressed, "radii", "approach")
    if isinstance(prescribed, dict) and "load" in prescribed:
        load = Interval(number(*table(prescribed, "load")) / scene.modulus)
    elif number(*table(prescribed, "approach")) != number(approach):
        raise Refused("the approach is not the one prescribed")
    n = len(scene.points)
    box = read_box(scene, argument, tell)
    state = prove_state(scene, box, numbers(radii, n), number(approach), load, tell)
    loads = [load_of(scene, i, depth) for i, depth in enumerate(state.depths)]
    total = load or sum(loads, Interval(0))
    return {
        "scope": scope(scene, box, state, load),
        "approach": state.approach,
        "load": total * scene.modulus,
        "status": [word(depth, "contact", "open") for depth in state.depths],
        "loads": [load * scene.modulus for load in loads],
        "gaps": [gap_of(depth) for depth in state.depths],
        "shear": [prove_shear(scene, box, state, total, entry, tell) for entry in listed(sheared)],
    }


def prove_shear(
    scene: Scene, box: Box, pressed: State, total: Interval, entry: Any, tell: Tell
) -> dict[str, Any]:
    """A friction state: the difference of two pressed ones (9)."""
    force, radii, approach = table(entry, "force", "radii", "approach")
    f, n = scene.friction, len(pressed.depths)
    if number(force) <= 0 or f <= 0:
        raise Refused("a shear force or the coefficient of friction is not positive")
    left = total - number(force) / (f * scene.modulus)
    if left.low <= 0:
        raise Refused("a shear force is not proved to be below what friction can carry")
    held = prove_state(scene, box, numbers(radii, n), number(approach), left, tell)
    mindlin = f * (2 - scene.ratio) / (2 * (1 - scene.ratio))
    words, forces, slips, energy = list[str](), list[Interval](), list[Interval](), Interval(0)
    for i, (at, after) in enumerate(zip(pressed.depths, held.depths, strict=True)):
        load, rest = load_of(scene, i, at), load_of(scene, i, after)
        if rest.high > load.low and after.high > 0:
            raise Refused(f"asperity {i} may be dragged along by the others, against the theorem")
        touches = word(at, "contact", "open")
        words.append(word(after, "partial", "sliding") if touches == "contact" else touches)
        forces.append((load - rest) * (f * scene.modulus))
        slips.append(gap_of(after) * mindlin if at.high > 0 else Interval(0))
        energy += load * (loss_of(at, after) * mindlin + slips[i]) * (4 * f * scene.modulus)
    displacement = (pressed.approach - held.approach) * mindlin
    return {
        "status": words,
        "forces": forces,
        "slips": slips,
        "displacement": displacement,
        "energy": energy,
    }


def hold(what: str, claimed: Any, proved: Any) -> None:
    """Hold claims against what is proved: words and bounds, in tables and lists."""
    if isinstance(proved, dict):
        for key, claim in zip(proved, table(claimed, *proved), strict=True):
            hold(f"{what} {key}", claim, proved[key])
    elif isinstance(proved, list):
        for i, claim in enumerate(listed(claimed, len(proved))):
            hold(f"{what} [{i}]", claim, proved[i])
    elif isinstance(proved, str):
        weaker = {"global": "local", "local": "local"}.get(proved, "undecided")
        if claimed not in (proved, weaker):
            raise Refused(f"{what}: claimed {str(claimed)[:20]!r}, proved {proved!r}")
    else:
        low, high = numbers(claimed, 2)
        if not low <= proved.low <= proved.high <= high:
            raise Refused(f"{what}: not proved to be within the claimed bounds")


def sentence(document: Any) -> str:
    """What the claims say: a line of the contact, and one of each shear force."""
    claims, ((control, value),) = document["claims"], document["prescribed"].items()
    bounds = [numbers(pair, 2) for pair in claims["loads"]]
    largest = max(high for _, high in bounds) or Fraction(1)
    widest = min(max(high - low for low, high in bounds) / largest, Fraction(1))
    known = Context(1, ROUND_CEILING).create_decimal(float(widest))
    alone = "the only one" if claims["scope"] == "global" else "the only one inside its box"
    lines = [
        f"proved: under the {control} {float.fromhex(value):.10g} there is a solution, {alone}",
        f"{counted(claims, 'contact', 'open')}, loads known to {known:g} of the largest",
    ]
    for entry, claim in zip(document["sheared"], claims["shear"], strict=True):
        low, high = map(float.fromhex, claim["energy"])
        lines.append(
            f"under the shear force {float.fromhex(entry['force']):.10g}: "
            f"{counted(claim, 'sliding', 'partial')}, a cycle loses {outwards(low, high)}"
        )
    return "\n  ".join([*lines, f"scene {document['sha256'][:12]}"])


def outwards(low: float, high: float) -> str:
    """Ten digits of each, rounded away from the other: bounds still."""
    down, up = (Context(10, rounding) for rounding in (ROUND_FLOOR, ROUND_CEILING))
    return f"{down.create_decimal(low):g} to {up.create_decimal(high):g}"


def counted(claims: Any, *words: str) -> str:
    return ", ".join(f"{claims['status'].count(word)} {word}" for word in (*words, "undecided"))


def check(document: Any, tell: Tell) -> str:
    """What is proved, in words. Raises Refused where more is claimed, and Unreadable."""
    proved = prove(document, tell)
    hold("claims", document["claims"], proved)
    return sentence(document)


def main(arguments: Sequence[str]) -> int:
    def tell(line: str) -> None:
        if sys.stderr.isatty():
            print(f"\r{line}\033[K", end="\r", file=sys.stderr, flush=True)

    if len(arguments) != 1:
        print("usage: python checker.py proof.json", file=sys.stderr)
        return 2
    try:
        print(check(read(arguments[0]), tell))
        return 0
    except Refused as error:
        print(f"refused: {error}", file=sys.stderr)
        return 1
    except (Unreadable, RecursionError) as error:
        print(f"unreadable: {arguments[0]}: {error}", file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
