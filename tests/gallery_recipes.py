"""How the scenes of the gallery were made: `cases.json` of the package holds the numbers.

Only operations that IEEE 754 rounds correctly, so that every machine builds the same float64
numbers, to the last bit. Heights that were fitted to 60 digits (`gallery_answers.tune`) are read.
"""

import math
import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TypeAlias

import convexrough as cr
from convexrough.gallery.cases import FRICTION, MATERIAL
from convexrough.scene.scene import Geometry

Point: TypeAlias = tuple[float, float]

#: The source paper's example, sphere radius 1: spacing, tip radius and approach.
SPACING, TIP_RADIUS, APPROACH = 0.0025, 0.02, 5e-5


@dataclass(frozen=True)
class Recipe:
    """A case without its answer.

    family   : cases of one kind of hardness
    why      : what is hard about it
    approach [length] or load [force] : what is prescribed, exactly one
    fraction : shear force over f P
    reversals : the name of the history by which the shear force is reached
    """

    family: str
    why: str
    scene: cr.Scene
    approach: float | None = None
    load: float | None = None
    fraction: float = 0.4
    reversals: str = ""


#: Recipes by the names of their cases.
Recipes: TypeAlias = dict[str, Callable[[], Recipe]]


def placed(
    points: Sequence[Point],
    tip_radii: float | Sequence[float] = TIP_RADIUS,
    heights: float | Sequence[float] = 0.0,
    *,
    sphere_radius: float = 1.0,
    geometry: Geometry = "summit",
) -> cr.Scene:
    """Asperities at these points, of the usual material."""
    asperities = cr.Asperities(points, tip_radii, heights)
    return cr.Scene(sphere_radius, asperities, MATERIAL, FRICTION, geometry)


def hexagon(rings: int, spacing: float = SPACING) -> list[Point]:
    """A hexagonal patch, 1 + 3 rings (rings + 1) points from the middle outwards."""
    steps = range(-rings, rings + 1)
    sites = [(i, j) for i in steps for j in steps if abs(i + j) <= rings]
    sites.sort(key=lambda site: (site[0] ** 2 + site[0] * site[1] + site[1] ** 2, site))
    return [((i + 0.5 * j) * spacing, math.sqrt(0.75) * j * spacing) for i, j in sites]


def roughness(count: int, seed: int) -> list[float]:
    """Random numbers of mean 0 and deviation 1, bell-shaped: sums of twelve uniform ones."""
    numbers = random.Random(seed)
    return [math.fsum(numbers.random() for _ in range(12)) - 6.0 for _ in range(count)]


def manufactured(
    points: Sequence[Point],
    tip_radii: Sequence[float],
    contact_radii: Sequence[float],
    gaps: Sequence[float],
    *,
    sphere_radius: float = 1.0,
) -> tuple[cr.Scene, float]:
    """Heights and an approach with (almost) these contact radii, and gaps where those are 0.

    D_i = a_i^2 / R_i + (4 / (3 pi)) sum_j a_j^3 / (R_j r_ij) - g_i: docs/theory/convexity.md, (1),
    in contact radii. The heights are rounded, so the answer is near the radii and not at them.
    """
    relative = [1.0 / (1.0 / sphere_radius + 1.0 / tip) for tip in tip_radii]
    volumes = [a * a * a / R for a, R in zip(contact_radii, relative, strict=True)]

    def asked(i: int) -> float:
        others = math.fsum(
            volumes[j] / math.dist(points[i], points[j]) for j in range(len(points)) if j != i
        )
        own = contact_radii[i] * contact_radii[i] / relative[i]
        return own + 4.0 / (3.0 * math.pi) * others - gaps[i]

    prescribed = [asked(i) for i in range(len(points))]
    approach = max(prescribed)
    drops = [(x * x + y * y) / (2.0 * sphere_radius) for x, y in points]
    heights = [D - approach + drop for D, drop in zip(prescribed, drops, strict=True)]
    return placed(points, tip_radii, heights, sphere_radius=sphere_radius), approach


# The ends of the convex range, of the model, and of float64.

#: Two asperities this far apart.
APART: list[Point] = [(0.0, 0.0), (SPACING, 0.0)]

#: Convexity numbers where something ends, and what.
THRESHOLDS = {
    "21/25": (21 / 25, "where the cone program needs a fifth cone"),
    "1": (1.0, "where shells prove convexity no longer"),
}

#: Relative distance from a threshold.
ASIDE = 1e-9

#: The load of the paper's example, of which loads are parts.
REFERENCE = 3.6e-7


def _solved(threshold: str, side: int) -> Recipe:
    """The contact radii of the solution are at the threshold: a = theta (pi/4) r."""
    theta, what = THRESHOLDS[threshold]
    radius = theta * (1 + side * ASIDE) * math.pi / 4 * SPACING
    scene, approach = manufactured(APART, [TIP_RADIUS] * 2, [radius] * 2, [0.0] * 2)
    side_name = "above" if side > 0 else "below"
    why = f"convexity number 1e-9 {side_name} {threshold}, {what}; the discs overlap"
    return Recipe("convexity", why, scene, approach=approach)


def _bounded(threshold: str, side: int) -> Recipe:
    """Those of the a priori bound are: R D = a^2."""
    theta, what = THRESHOLDS[threshold]
    radius = theta * (1 + side * ASIDE) * math.pi / 4 * SPACING
    scene = placed(APART, sphere_radius=1e6)
    relative = 1.0 / (1e-6 + 1.0 / TIP_RADIUS)
    side_name = "above" if side > 0 else "below"
    why = f"convexity number of the a priori box 1e-9 {side_name} {threshold}, {what}"
    return Recipe("convexity", why, scene, approach=radius * radius / relative)


def _ending(part: float, what: str) -> Recipe:
    """The a priori box ends at this part of a = (pi/2) r, where A + diag(1 / (2 E* a)) does."""
    radius = part * math.pi / 2 * SPACING
    relative = 1.0 / (1e-6 + 1.0 / TIP_RADIUS)
    scene = placed(APART, sphere_radius=1e6)
    why = f"the energy is {what} on the a priori box of a pair: no global proof reaches further"
    return Recipe("convexity", why, scene, approach=radius * radius / relative)


def _unequal(crowding: float) -> Recipe:
    """A large contact amid six small ones, for which shells must be fitted to the loads.

    That of the large one is (0.9 * 0.8 + 0.1 / 2) r, so its convexity number reaches 1 at a
    crowding of 0.77 pi / 1.6 (docs/theory/certificate.md, "Which box", 3).
    """
    large, small = 0.8 * crowding * SPACING, 0.2 * crowding * SPACING
    tips = [25 * TIP_RADIUS, *[TIP_RADIUS] * 6]
    scene, approach = manufactured(hexagon(1), tips, [large] + [small] * 6, [0.0] * 7)
    why = f"a large contact amid small ones, crowding {crowding:g}: fitted shells end at 1.512"
    return Recipe("convexity", why, scene, approach=approach)


def _discs(count: int, crowding: float, side_name: str) -> Recipe:
    """Equal contacts whose radii sum to this part of their distance."""
    points = APART if count == 2 else hexagon(1)
    radii = [0.5 * crowding * SPACING] * count
    scene, approach = manufactured(points, [TIP_RADIUS] * count, radii, [0.0] * count)
    why = f"{count} equal contacts, discs {side_name}: (a_i + a_j) / r_ij = {crowding:g}"
    return Recipe("discs", why, scene, approach=approach)


def _loaded(part: float, why: str) -> Recipe:
    return Recipe("loads", why, placed(hexagon(2)), load=part * REFERENCE)


LIMITS: Recipes = {
    f"convexity-{kind}-{threshold.replace('/', '-')}-{side_name}": partial(make, threshold, side)
    for kind, make in (("solution", _solved), ("bound", _bounded))
    for threshold in THRESHOLDS
    for side_name, side in (("below", -1), ("above", 1))
}
LIMITS |= {
    f"convexity-fitted-{side_name}": partial(_unequal, crowding)
    for side_name, crowding in (("below", 1.51), ("above", 1.513))
}
LIMITS |= {
    "convexity-end-below": partial(_ending, 0.998, "just convex"),
    "convexity-end-above": partial(_ending, 1 + ASIDE, "no longer convex"),
}
LIMITS |= {
    f"discs-{count}-{name}": partial(_discs, count, crowding, word)
    for count in (2, 7)
    for name, crowding, side in (
        ("almost-touching", 0.999, "that almost touch"),
        ("overlapping", 1.05, "that overlap, where the model has ended"),
    )
}
LIMITS |= {
    f"load-{part}": partial(_loaded, float(part), f"a load of {part} of the paper's, on 19")
    for part in ("1e-15", "1e-12", "1e-9", "1e-6", "1e-3")
}
LIMITS["load-end"] = partial(
    _loaded, 5.8, "the largest load on 19 before the discs overlap, where the model ends"
)
LIMITS["one"] = lambda: Recipe(
    "few", "one contact: no neighbours, no shells, an answer in closed form",
    placed([(0.0, 0.0)]), approach=APPROACH,
)  # fmt: skip
LIMITS["one-under-load"] = lambda: Recipe(
    "few", "one contact under a load: the approach is the only unknown",
    placed([(0.0, 0.0)]), load=1e-8,
)  # fmt: skip
LIMITS["two-equal"] = lambda: Recipe(
    "few", "two equal contacts: the smallest that interact, the root of a cubic",
    placed([(-0.5 * SPACING, 0.0), (0.5 * SPACING, 0.0)]), approach=APPROACH,
)  # fmt: skip


# Asperities that hardly touch, or hardly do not, and such as lose what they had.

#: How near to 0, over the approach or the largest load.
NEAR = ("1e-6", "1e-9", "1e-12", "1e-15")

#: What is that small, in the last of the asperities.
KINDS = {
    "gap": "a gap of {} of the approach: open, and closed by an error of that size",
    "indentation": "an indentation of {} of the approach: it touches, with next to no load",
    "load": "a load of {} of the largest: it touches, and solvers of that accuracy drop it",
}


#: On which side of touching.
SIDES = {"gap": "open", "indentation": "in contact"}


def _grazing(kind: str, near: str, height: float) -> Recipe:
    """Seven asperities of the paper's example, and one beside them, of this height."""
    points = [*hexagon(1), (0.0035, 0.0029)]
    scene = placed(points, TIP_RADIUS, [0.0] * 7 + [height])
    return Recipe("grazing", KINDS[kind].format(near), scene, approach=APPROACH)


def _ringed(kind: str, near: str, height: float) -> Recipe:
    """A short asperity amid six tall, blunt ones, which hold the sphere off it."""
    tips = [TIP_RADIUS, *[2.5 * TIP_RADIUS] * 6]
    scene = placed(hexagon(1), tips, [height] + [0.0] * 6)
    side = SIDES[kind]
    why = f"a short asperity amid six tall ones, {near} of the approach from touching: {side}"
    return Recipe("ringed", why, scene, approach=3e-5)


#: What makes a case from a height, which is fitted to 60 digits, and whose height that is.
FITTED: dict[str, tuple[Callable[[float], Recipe], int]] = {
    f"grazing-{kind}-{near}": (partial(_grazing, kind, near), 7) for kind in KINDS for near in NEAR
}
FITTED |= {f"ringed-{kind}-1e-9": (partial(_ringed, kind, "1e-9"), 0) for kind in SIDES}


def _dragged() -> Recipe:
    scene = placed(hexagon(1), [TIP_RADIUS, *[5 * TIP_RADIUS] * 6], [-1e-5] + [0.0] * 6)
    why = "the short one loses load as the total rises, so shear gives it some; the discs overlap"
    return Recipe("ringed", why, scene, approach=7.6e-5, fraction=0.01)


#: Contact radii of three equal asperities, over their distance to the short one amid them, and the
#: shear; the last one's leaves p_i(P - Q / f) where the short one touches.
STAGES = {
    "before": (0.82, 0.4, "not yet touching"),
    "touching": (0.8512, 0.4, "touching, at its deepest"),
    "after": (0.8655, 0.0487, "open again"),
}


def _losing(stage: str) -> Recipe:
    """Three asperities with contact radii a at distance r from a fourth between them.

    Its indentation rises as (a / r)^2 - c (a / r)^3, c = (4 / (3 pi)) (3 - 2 / sqrt(3)), so it
    falls from a = 2 r / (3 c) = 0.8512 r on, and discs first overlap at a = 0.866 r.
    """
    distance = 0.01
    half, rise = -0.5 * distance, math.sqrt(0.75) * distance
    points = [(0.0, 0.0), (distance, 0.0), (half, rise), (half, -rise)]
    radius = STAGES["touching"][0] * distance
    tips = [TIP_RADIUS, *[2.0] * 3]
    scene, _ = manufactured(points, tips, [0.0] + [radius] * 3, [-2e-8, 0.0, 0.0, 0.0])
    part, fraction, side = STAGES[stage]
    relative = 1.0 / (1.0 + 1.0 / tips[1])
    radius = part * distance
    load = 4.0 * radius * radius * radius / relative
    why = f"a short asperity that loses contact as the load rises, no discs overlapping: {side}"
    return Recipe("losing-contact", why, scene, load=load, fraction=fraction)


def _fitted(name: str) -> Recipe:
    make, which = FITTED[name]
    return make(float(cr.gallery.case(name).scene.asperities.heights[which]))


GRAZING: Recipes = {name: partial(_fitted, name) for name in FITTED}
GRAZING |= {f"losing-contact-{stage}": partial(_losing, stage) for stage in STAGES}
GRAZING["ringed-dragged"] = _dragged


# Where asperities stand, how sharp and how tall they are.


def _six_decades() -> Recipe:
    points = hexagon(2, 0.03)[:13]
    tips = [2.0 / math.sqrt(10.0**i) for i in range(13)]
    scene = placed(points, tips, sphere_radius=1e4)
    why = "tip radii over six decades, so loads over three and stiffnesses alike"
    return Recipe("radii", why, scene, approach=APPROACH)


def _tall() -> Recipe:
    numbers = random.Random(1)
    heights = [-10 * APPROACH * numbers.random() for _ in range(61)]
    scene = placed(hexagon(4), TIP_RADIUS / 4, heights)
    why = "heights random over ten times the approach: they alone decide who touches"
    return Recipe("heights", why, scene, approach=APPROACH)


def _rough(geometry: str) -> Recipe:
    heights = [1e-6 * height for height in roughness(37, 2)]
    tips = [TIP_RADIUS * (1 + 0.1 * size) for size in roughness(37, 3)]
    scene = placed(hexagon(3), tips, heights, geometry="closest" if geometry else "summit")
    why = "random heights and tip radii" + (", closest-point geometry" if geometry else "")
    return Recipe("heights", why, scene, approach=APPROACH)


def _many() -> Recipe:
    """On a flatter sphere, so that most of them touch."""
    heights = [1e-5 * height for height in roughness(169, 9)]
    scene = placed(hexagon(7), TIP_RADIUS / 2, heights, sphere_radius=10.0)
    why = "169 asperities with random heights: the low ones are open amid the others"
    return Recipe("heights", why, scene, approach=APPROACH)


def _collinear() -> Recipe:
    points = [(SPACING * (i - 6), 0.0) for i in range(13)]
    why = "all on one line: no lattice in the plane, no hull"
    return Recipe("layout", why, placed(points), approach=APPROACH)


def _clustered() -> Recipe:
    corners = [(1.0, 0.2), (-0.7, 0.9), (-0.4, -1.1)]
    points: list[Point] = [
        (0.004 * X + 1e-3 * x, 0.004 * Y + 1e-3 * y)
        for X, Y in corners
        for x, y in hexagon(1, SPACING)
    ]
    scene = placed(points, 2e-8, geometry="closest")
    why = "clusters a thousand times smaller than the distances between them"
    return Recipe("layout", why, scene, approach=APPROACH)


def _vacancies() -> Recipe:
    numbers = random.Random(4)
    points = [point for point in hexagon(3) if numbers.random() < 0.7]
    heights = [2e-7 * height for height in roughness(len(points), 5)]
    why = "a lattice with sites left empty, where its operator must not put loads"
    return Recipe("layout", why, placed(points, TIP_RADIUS, heights), approach=APPROACH)


def _accumulating() -> Recipe:
    """Distances halve towards the axis, and contact radii with them: R D = a^2."""
    distances = [0.008 * 0.5**i for i in range(24)]
    points = [(r if i % 2 else 0.6 * r, 0.0 if i % 2 else 0.8 * r) for i, r in enumerate(distances)]
    tips = [0.02 * r * r / APPROACH for r in distances]
    why = "points that accumulate, so with no least distance: contact radii over seven decades"
    return Recipe("layout", why, placed(points, tips), approach=APPROACH)


def _symmetric() -> Recipe:
    why = "a ring of six alike: all slide at once, and none can be told from the last one"
    return Recipe("layout", why, placed(hexagon(1)[1:]), approach=APPROACH)


LAYOUTS: Recipes = {
    "radii-six-decades": _six_decades,
    "heights-ten-approaches": _tall,
    "heights-random": lambda: _rough(""),
    "heights-random-closest": lambda: _rough("closest"),
    "heights-random-169": _many,
    "collinear": _collinear,
    "clustered": _clustered,
    "vacancies": _vacancies,
    "no-least-distance": _accumulating,
    "ring-of-six": _symmetric,
}


# The same contact in units that spread numbers over most of float64.

#: Per metre and newton, and what the numbers then are.
UNITS = {
    "si": (1.0, 1.0, "metres and newtons: loads of a newton beside a modulus of 1e11"),
    "nanometre": (1e9, 1e9, "nanometres and nanonewtons"),
    "astronomical": (6.684587122268446e-12, 1.0, "astronomical units and newtons: 1e-17 and 1e33"),
    "tiny": (
        1e-30,
        1e-20,
        "lengths about 1e-35, loads about 1e-20",
    ),
    "huge": (1e30, 1e20, "lengths about 1e25, loads about 1e20"),
}


def _in_units(unit: str) -> Recipe:
    """Steel on steel: a ball of 10 mm on 19 asperities, half a micron of approach."""
    length, force, why = UNITS[unit]
    modulus = 210e9 / (2 * (1 - 0.3 * 0.3)) * (force / length / length)
    points = [(x * length, y * length) for x, y in hexagon(2, 25e-6)]
    heights = [1e-8 * length * height for height in roughness(len(points), 6)]
    asperities = cr.Asperities(points, 2e-4 * length, heights)
    scene = cr.Scene(
        0.01 * length, asperities, cr.Material(modulus, 0.3), FRICTION, geometry="summit"
    )
    return Recipe("units", why, scene, approach=0.5e-6 * length)


UNITS_OF: Recipes = {f"units-{unit}": partial(_in_units, unit) for unit in UNITS}


# Shear forces next to nothing and next to all that friction bears, and long histories.

#: The load that the contacts are sheared under.
LOAD = 1e-7

#: Shear force over f P, by name.
FRACTIONS = {
    "1e-12-of-nothing": (1e-12, "Q = 1e-12 f P: slip annuli too thin for what is computed of P"),
    "1e-12-of-all": (1 - 1e-12, "Q = (1 - 1e-12) f P: the last stick radii, 1e-4 of the contacts"),
}


def _sheared(fraction: float, why: str) -> Recipe:
    heights = [1e-6 * height for height in roughness(7, 7)]
    scene = placed(hexagon(1), TIP_RADIUS, heights)
    return Recipe("friction", why, scene, load=LOAD, fraction=fraction)


def _turning(reversals: str, why: str) -> Recipe:
    return Recipe("friction", why, _sheared(0.8, why).scene, load=LOAD, fraction=0.8,
                  reversals=reversals)  # fmt: skip


#: What is remembered of 100,000 reversals, by their name.
PASTS = {
    "random": "100,000 random shear forces, repeated ones and zeros among them, then a larger one",
    "nested": "100,000 reversals, each inside the last, all remembered until one larger wipes them "
    "out",
}

FRICTIONS: Recipes = {
    f"shear-{name}": partial(_sheared, fraction, why) for name, (fraction, why) in FRACTIONS.items()
}
FRICTIONS |= {f"reversals-{name}": partial(_turning, name, why) for name, why in PASTS.items()}


RECIPES: Recipes = {**LIMITS, **GRAZING, **LAYOUTS, **UNITS_OF, **FRICTIONS}
