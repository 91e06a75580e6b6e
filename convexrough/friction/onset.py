"""The load at which an asperity first touches, and the shear force at which it starts to slide.

The onset of an asperity is the load at which its indentation rises to 0. On first loading it slides
once P - Q / f is below its onset (load P, shear force Q, coefficient of friction f). The onset
comes from Newton's method; proofs that the asperity is open at a slightly smaller load and touches
at a slightly larger load enclose it.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from convexrough import checks
from convexrough.arrays import Array, Indices, frozen
from convexrough.contact import Contact
from convexrough.errors import InputError, SolverError
from convexrough.friction.levels import FrictionLevels

MOST_ONSETS = 256  # in one call, if no compliance matrix is stored

#: Relative distances of loads from the computed onset at which proofs are tried, smallest first.
#: Levels that are known already are tried first if their distance is from TRIED[0] to
#: TRIED[ENOUGH].
TRIED, ENOUGH = tuple(10.0**-k for k in range(13, 3, -1)), 2

#: The largest number of Newton steps, and the change of L, relative to P, at which they end.
STEPS, SETTLED = 60, 2.0**-54


class Onset(NamedTuple):
    """Loads [force] between which an asperity first touches, if no indentation falls on the way."""

    load: Fraction  # at which it first touches, as computed
    lower: Fraction  # proved open at this load; 0 if none is proved
    upper: Fraction  # proved to touch at this load; P if no lower load is proved


def onset_of_sliding(contact: Contact, *, which: ArrayLike | None = None) -> Array:
    """(n,) [force] the shear force at which each asperity starts to slide on first loading.

    It is f (P - the load of the first touch): docs/theory/states.md, "First loading". In a steady
    cycle at constant load, the asperity slides if the amplitude of the shear force exceeds it. The
    result is nan for an asperity without load, where nothing is proved about the first touch, and
    if order (docs/theory/states.md) "fails" between it and the load of the contact: the asperity
    may then start to slide at another force.

    which : indices of asperities, in the order of the result; default: all. Several normal problems
        are solved for each

    Raises InputError if the scene has no friction, or if more than 256 loaded asperities are chosen
    and no compliance matrix is stored.

    >>> onsets = cr.onset_of_sliding(contact, which=[0, 36])
    >>> print((onsets / contact.load).round(3))
    [0.5   0.176]
    """
    checks.instance("contact", contact, Contact)
    f = Fraction(checks.friction(contact.scene.friction))
    asked = indices("which", which, len(contact.scene))
    levels = contact.cached(FrictionLevels)
    onsets, loaded = np.full(len(asked), np.nan), np.flatnonzero(levels.loads[asked])
    if not levels.top.touching.any():  # nothing is proved
        return frozen(onsets)
    if not levels.top.problem.influence.stored and len(loaded) > MOST_ONSETS:
        expected = f"at most {MOST_ONSETS}: for each, several normal problems are solved"
        raise InputError("which", found=f"{len(loaded):,} loaded asperities", expected=expected)
    found = enclosed(levels, asked[loaded].tolist())
    lowest = min((each.load for each in found.values()), default=levels.load)
    ordered = levels.order([lowest]) != "fails"
    for k in loaded.tolist():
        load, lower, upper = found[int(asked[k])]
        nothing = lower == 0 and upper == levels.load  # is proved
        if not nothing and (ordered or levels.order([load]) != "fails"):
            onsets[k] = float(f * (levels.load - load))
    return frozen(onsets)


def enclosed(levels: FrictionLevels, which: Sequence[int]) -> dict[int, Onset]:
    """The onsets of asperities that touch at P, by index. A bound that is not proved is 0 or P."""
    depths = levels.top.indentation.value[levels.top.problem.places[which]]
    return {which[k]: _enclosed(levels, which[k]) for k in np.argsort(depths).tolist()}


def _enclosed(levels: FrictionLevels, asperity: int) -> Onset:
    """The onset of one asperity, with bounds."""
    place = int(levels.top.problem.places[asperity])
    found = root(levels, place)
    around = [Fraction(part) * (found or levels.load) for part in TRIED]
    near = [s for s in levels.known if around[0] <= abs(s - found) <= around[ENOUGH]]
    below = [*(s for s in near if s < found), *(found - part for part in around)]
    farther = (found + Fraction(part) * levels.load for part in TRIED)  # if `found` is tiny
    above = [*(s for s in near if s > found), *(found + part for part in around), *farther]
    lower = next((s for s in below if levels.has(s) and levels.at(s).open[place]), Fraction(0))
    sure = (s for s in above if s < levels.load and levels.has(s) and levels.at(s).touching[place])
    return Onset(found, lower, next(sure, levels.load))


def root(levels: FrictionLevels, place: int) -> Fraction:
    """The load at which the indentation of the asperity `levels.candidates[place]` is 0."""

    def depth(load: Fraction) -> float:
        return float(levels.at(load).indentation.value[place])

    if not levels.at(Fraction(0)).open[place]:  # it may be the asperity that touches first of all
        return Fraction(0)
    high = min((load for load in levels.known if depth(load) > 0), default=levels.load)
    low = max((load for load in levels.known if depth(load) <= 0), default=Fraction(0))
    here = min((low, high), key=lambda s: abs(depth(s))) if low else high
    for _ in range(STEPS):
        value = depth(here)
        low, high = (low, min(high, here)) if value > 0 else (max(low, here), high)
        try:
            rate = float(levels.at(here).rates[place]) / levels.units.force  # dn_i/dL
            step = Fraction(value / rate)
        except SolverError:  # near the load 0
            step = here - (low + high) / 2
        following = here - step
        if abs(step) <= Fraction(SETTLED) * levels.load or value == 0:
            return min(max(following, low), high)
        if not low < following < high:
            following = (low + high) / 2
        here = Fraction(float(following))
        here += Fraction(float(following - here))  # a fraction with few digits
        if not levels.has(here):  # 0 up to rounding
            return Fraction(0)
    return here


def last_to_touch(levels: FrictionLevels) -> tuple[int, Onset]:
    """The index and the onset of the asperity that touches last as the load rises to P."""
    touching: Indices = np.flatnonzero(levels.top.loads.value > 0)
    depths = levels.top.indentation.value[touching]
    last = int(touching[np.argmin(depths)])
    while True:
        found = _enclosed(levels, int(levels.candidates[last]))
        there = levels.at(found.load).indentation
        farthest = int(touching[np.argmin(there.value[touching])])
        if farthest == last or there.value[farthest] >= -there.radius[farthest]:
            return int(levels.candidates[last]), found
        last = farthest


def indices(what: str, which: ArrayLike | None, n: int) -> Indices:
    """The checked indices of asperities of a scene with n asperities; all if None is given."""
    if which is None:
        return np.arange(n)
    asked = np.atleast_1d(np.asarray(which))
    whole = asked.ndim == 1 and (np.issubdtype(asked.dtype, np.integer) or asked.size == 0)
    if not whole or (asked < 0).any() or (asked >= n).any():
        expected = f"whole numbers from 0 to {n - 1}: indices of asperities of the scene"
        raise InputError(what, found=repr(which)[:60], expected=expected)
    return asked.astype(np.intp)
