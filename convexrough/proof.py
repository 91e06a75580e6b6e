"""`prove`: proofs of contacts and friction states, for `convexrough.checker` or another checker.

docs/theory/proof-file.md describes the files. A proof needs an argument why the energy is convex on
a box of contact radii. `TrialState` computes possible arguments in floating point. They may be
wrong, so the checker verifies one after another in exact arithmetic, until it accepts one.
docs/theory/proof-file-steps.md defines box, convexity number theta (2) and shells (3).
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import LinAlgError, cholesky
from scipy.spatial.distance import cdist

from convexrough import checker, checks
from convexrough.arithmetic.pairs import Pair
from convexrough.arrays import Array, among_zeros
from convexrough.atomic import replacing
from convexrough.errors import InputError, ProofError
from convexrough.normal.problem import NormalProblem
from convexrough.normal.refine import Trial, trial_of
from convexrough.record import Record
from convexrough.scene.scene import Scene
from convexrough.sphere import hertz

#: For boxes that contain every solution: relative distance of their upper ends from bounds on the
#: radii, and smallest upper end divided by the largest. The first pair of these two numbers is for
#: accurate radii, the second for inaccurate ones.
ROOM = ((1e-6, 1e-2), (5e-2, 3e-1))

#: Relative room for rounding in this module.
ROUNDING = 1e-9

#: Convexity numbers tried with overlapping shells, and with Cholesky factorisation.
CROWDED = (0.9, 0.99, 0.999, 0.9999)

#: Radii of overlapping shells, divided by the smallest radii that are enough without overlap.
WIDTHS = (2.0, 4.0, 8.0)

#: For boxes in which all asperities that do not touch are fixed open: relative distance from the
#: radii to the upper ends, for radii with thirty digits, in float64, and less accurate.
LEEWAY = (1e-12, 1e-6, 1e-2)


class ShearedState(Protocol):
    """A friction state after first loading, such as that which `convexrough.shear` returns."""

    @property
    def force(self) -> float: ...


@dataclass(frozen=True, eq=False, repr=False)
class Proof(Record):
    """A checked proof: statuses of all asperities, and bounds on loads, gaps, forces and losses.

    document : contents of the proof file (docs/theory/proof-file.md)
    proved   : summary in sentences, as the checker prints it

    >>> proof = cr.press(scene, approach=1e-6).proof()
    >>> proof.document["claims"]["scope"], "1 contact, 60 open" in proof.proved
    ('global', True)
    >>> proof.save(folder / "proof.json")
    """

    document: dict[str, Any]
    proved: str

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the file that `convexrough check` and `python checker.py` read.

        path : file name; if writing fails, an existing file remains unchanged

        Raises FileError if the file cannot be written.
        """
        with replacing(Path(path)) as temporary:
            temporary.write_text(json.dumps(self.document, indent=0) + "\n", encoding="utf-8")


def prove(
    scene: Scene,
    loads: ArrayLike | Trial,
    *,
    approach: float | None = None,
    load: float | None = None,
    sheared: Sequence[tuple[float, Trial]] = (),
) -> Proof:
    """A proof of the solution near given loads, which may come from any source.

    loads    : (n,) [force] not negative, in the order of the scene's asperities; or a `Trial`
    approach : [length] prescribed approach, if no load is given
    load     : [force] prescribed load P, if no approach is given
    sheared  : friction states to prove, with the losses of cycles from -Q to Q. Each is a pair: the
        shear force Q [force], and the `Trial` of the contact without shear at the load P - Q/f,
        with the coefficient of friction f (docs/theory/proof-file.md)

    The checker computes the bounds, so a proof takes as long as a check.

    Raises InputError for invalid values and for scenes too large for the checker; ProofError if no
    solution is proved, because the loads are too inaccurate or the contacts overlap too much.
    """
    checks.exactly_one("approach", approach, "load", load)
    refuse_many(scene)
    if not isinstance(loads, Trial):
        loads = _trial(scene, loads, approach, load)
    modulus = scene.material.contact_modulus
    states = np.array([_exact_loads(near) for near in (loads, *(it for _, it in sheared))])
    radii = hertz.contact_radius(states.astype(np.float64), modulus, scene.relative_radii)
    trial = TrialState(scene, radii[0], radii.max(axis=0), approach)
    document = _document(scene, {"approach": approach} if load is None else {"load": load})
    document["pressed"] = _place(document, loads)
    document["sheared"] = [
        {"force": abs(force).hex(), "held": _place(document, near)} for force, near in sheared
    ]
    refusal = "contacts overlap too much for the energy to be proved convex near these loads"
    for argument in trial.arguments():
        document["argument"] = _written(argument)
        try:
            proved = checker.prove(document)
        except checker.Refused as error:
            refusal = str(error)
        else:
            document["claims"] = _written(proved)
            return Proof(document, checker.sentence(document))
    raise ProofError(f"nothing is proved: {refusal}")


def refuse_many(scene: Scene) -> None:
    """Raise InputError for a scene too large to be checked in minutes."""
    if len(scene) > checker.MOST_ASPERITIES:
        most = f"at most {checker.MOST_ASPERITIES:,}, as proofs are checked in exact arithmetic"
        raise InputError("asperities of a scene to prove", found=f"{len(scene):,}", expected=most)


def _trial(scene: Scene, loads: ArrayLike, approach: float | None, load: float | None) -> Trial:
    """The trial of given loads (n,) [force], in which all asperities may touch under a load."""
    given = checks.array("loads", loads, length=len(scene), sign="not negative")
    if load is not None and not given.any():
        raise InputError("loads", found="none", expected="a load on some asperity")
    control: Any = {"approach": approach} if load is None else {"load": load, "highest": np.inf}
    problem = NormalProblem.assemble(scene, **control, influence="dense").sharpened()
    return trial_of(problem, given[problem.candidates] / problem.units.force)


def _exact_loads(trial: Trial) -> list[Fraction]:
    """(n,) [force] the loads of a trial, with all their digits, of all asperities of the scene."""
    problem, found = trial.problem, [Fraction(0)] * len(trial.problem.scene)
    for i, high, low in zip(problem.candidates, *trial.loads, strict=True):
        found[i] = (Fraction(high) + Fraction(low)) * Fraction(problem.units.force)
    return found


def _document(scene: Scene, prescribed: dict[str, Any]) -> dict[str, Any]:
    """The contents of the file; `argument`, `pressed`, `sheared` and `claims` are still None."""
    material, asperities = scene.material, scene.asperities
    single = scene.sphere_radius, material.contact_modulus, material.poisson_ratio, scene.friction
    several = *asperities.positions.T, asperities.heights, asperities.tip_radii
    names = (*checker.SINGLE, *checker.SEVERAL)
    given = _written(dict(zip(names, (*single, scene.geometry, *several), strict=True)))
    found = {"format": checker.FORMAT, "scene": given, "prescribed": _written(prescribed)}
    found["sha256"] = checker.digest(given, found["prescribed"])
    return dict.fromkeys(checker.KEYS) | found


def _place(document: dict[str, Any], near: Trial) -> dict[str, Any]:
    """The entry of the file for a state: contact radii to thirty digits, and the approach."""
    scene, (high, low) = checker.read_scene(document["scene"]), near.approach.mid
    approach = (Fraction(float(high)) + Fraction(float(low))) * Fraction(near.problem.units.length)
    radii = []
    for load, R in zip(_exact_loads(near), scene.radii, strict=True):
        cube = load * R * Fraction(3, 4) / scene.modulus
        radius = Fraction(math.cbrt(cube))
        radii.append(radius + (cube - radius**3) / (3 * radius**2) if radius else radius)
    return {"radii": [_digits(radius) for radius in radii], "approach": _digits(approach)}


def _digits(x: Fraction) -> list[str]:
    """One or two float64 numbers in hexadecimal, whose sum is x to about thirty digits."""
    high, low = Pair.nearest(x)
    return [high.hex(), low.hex()] if low else [high.hex()]


def _written(value: Any) -> Any:
    """A value as JSON: numbers in hexadecimal, intervals as pairs that are rounded outwards."""
    if value is None or isinstance(value, str):
        return value
    if isinstance(value, dict):
        return {key: _written(item) for key, item in value.items()}
    if isinstance(value, float | int):
        return float(value).hex()
    if isinstance(value, checker.Interval):
        low, high = float(value.low), float(value.high)
        low = math.nextafter(low, -math.inf) if low > value.low else low
        high = math.nextafter(high, math.inf) if high < value.high else high
        return [low.hex(), high.hex()]
    return [_written(item) for item in value]


@dataclass(frozen=True, eq=False)
class TrialState:
    """Contact radii (n,) [length] near a solution."""

    scene: Scene
    radii: Array
    largest: Array  # (n,) [length] the largest in this and in all friction states
    approach: float | None  # [length] the prescribed approach, or None

    @cached_property
    def apart(self) -> Array:
        """(n, n) [length] distances, with infinity on the diagonal."""
        distances: Array = cdist(self.scene.contact_points, self.scene.contact_points)
        np.fill_diagonal(distances, np.inf)
        return distances

    @cached_property
    def ceiling(self) -> tuple[float | None, float]:
        """A number [length] above all (A P)_i, and the bound on D0 of all solutions that follows.

        If the approach D0 is prescribed, they are None and D0.
        """
        if self.approach is not None:
            return None, self.approach
        radii, R = self.radii, self.scene.relative_radii
        loads = 4 * radii**3 / (3 * R)  # divided by E*
        pushed = (1 / self.apart) @ loads / np.pi  # A P
        least, most = pushed.max(), (2 / 3 * (radii**2 / R) + pushed).max()
        loaded = loads > 0
        p, w, R = loads[loaded], pushed[loaded], R[loaded]
        share = p / p.sum()
        tops = [least + (most - least) * 0.75**k for k in range(12)]
        bounds = [top + float(share @ ((p / (top - w)) ** 2 / (12 * R))) for top in tops]
        best, bound = min(zip(tops, bounds, strict=True), key=lambda each: each[1])
        drop = float(share @ self.scene.offsets[loaded])
        return float(best), bound - drop + ROUNDING * (bound + abs(drop))

    def arguments(self) -> Iterator[dict[str, Any]]:
        """The arguments that hold in floating point; those for the scope "global" come first.

        Each is the entry of the file: (n,) [length] the box, 0 for asperities that are fixed open;
        the convexity number; (n,) [length] radii of shells, or None for a Cholesky factorisation;
        and `ceiling`.
        """
        boxes = [*(self._box(*each) for each in ROOM), *(self.largest * (1 + x) for x in LEEWAY)]
        for box in boxes:
            for number, shells in self._convex(box):
                yield {
                    "box": box,
                    "convexity_number": number,
                    "shells": shells,
                    "ceiling": self.ceiling[0],
                }

    def _box(self, beyond: float, least: float) -> Array:
        """(n,) [length] upper bounds on the radii of every solution; 0 where none can touch."""
        R, offsets = self.scene.relative_radii, self.scene.offsets
        deepest = self.ceiling[1] + offsets
        size = np.abs(offsets) + abs(self.ceiling[1])
        box: Array = np.sqrt(R * np.maximum(deepest, 0.0)) * (1 + beyond)
        box = np.maximum(box, least * max(box.max(), self.largest.max()))
        box[(deepest < -ROUNDING * size) & (self.largest == 0)] = 0.0
        return box

    def _convex(self, box: Array) -> Iterator[tuple[float, Array | None]]:
        """At most two pairs of a convexity number and shells.

        The shells of the first do not overlap, those of the second may. If such shells are not
        found, the second is for a Cholesky factorisation.
        """
        able = np.flatnonzero(box)
        nearest = self.apart[able].min(axis=0, initial=4 * box.max(initial=0.0))
        shells = np.where(box > 0, nearest / 2, 0.0) * (1 - ROUNDING)
        least = float((2 * box[able] / (np.pi * shells[able])).max(initial=ROUNDING))
        if (number := least * (1 + ROUNDING)) < 1:
            yield number, shells
        apart = self.apart[np.ix_(able, able)]
        for number in CROWDED:
            smallest = 2 * box[able] / (np.pi * number)  # t of docs/theory/proof-file-steps.md, (3)
            for width in WIDTHS:
                s = width * smallest
                over = np.maximum(s[:, None] + s - apart, 0.0)
                overlaps = (over**2 / (4 * apart)).sum(axis=1) * (1 + ROUNDING)
                if (overlaps < s * (width - 1)).all():
                    yield number, among_zeros(s * (1 + ROUNDING), able, len(box))
                    return
        root = np.sqrt(2 * box[able])
        scaled = root[:, None] / (np.pi * apart) * root
        for number in CROWDED:
            np.fill_diagonal(scaled, number - ROUNDING)
            with suppress(LinAlgError):
                cholesky(scaled, lower=True, check_finite=False)
                yield number, None
                return
