"""`prove`: proofs of contacts and friction states, for a checker in exact arithmetic."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from convexrough import checker, checks
from convexrough.arithmetic.pairs import Pair
from convexrough.arrays import Array
from convexrough.atomic import replacing
from convexrough.errors import InputError, ProofError
from convexrough.normal.level import Level
from convexrough.progress import LOGGER
from convexrough.proof.arguments import TrialState
from convexrough.record import Record
from convexrough.scene.scene import Scene
from convexrough.sphere import hertz


class ShearedState(Protocol):
    """A friction state after first loading, such as `convexrough.shear` returns."""

    @property
    def force(self) -> float: ...


class NearState(NamedTuple):
    """Loads near a solution, with any number of digits.

    loads    : (n,) [force] in the order of the scene's asperities
    approach : [length] approach; None to compute it from the loads
    """

    loads: Sequence[Fraction]
    approach: Fraction | None

    @classmethod
    def given(cls, loads: Array) -> NearState:
        return cls(list(map(Fraction, loads.tolist())), None)

    @classmethod
    def of(cls, level: Level, n: int) -> NearState:
        found, units = [Fraction(0)] * n, level.problem.units
        if level.trial is None:
            return cls(found, None)
        loads, approach = level.trial.loads, level.trial.approach.mid
        for i, high, low in zip(level.problem.candidates, *loads, strict=True):
            found[i] = (Fraction(high) + Fraction(low)) * Fraction(units.force)
        centre = Fraction(float(approach.high)) + Fraction(float(approach.low))
        return cls(found, centre * Fraction(units.length))


@dataclass(frozen=True, eq=False, repr=False)
class Proof(Record):
    """A checked proof: statuses of all asperities, and bounds on loads, gaps, forces and losses.

    document : contents of the proof file (docs/theory/proof-file.md)
    proved   : summary in sentences, as the checker prints it
    """

    document: dict[str, Any]
    proved: str

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the file that `convexrough check` and `python checker.py` read.

        path : file name; if writing fails, an existing file remains unchanged
        """
        with replacing(Path(path)) as temporary:
            temporary.write_text(json.dumps(self.document, indent=0) + "\n", encoding="utf-8")


def prove(
    scene: Scene,
    loads: ArrayLike | NearState,
    *,
    approach: float | None = None,
    load: float | None = None,
    sheared: Sequence[tuple[float, NearState]] = (),
) -> Proof:
    """A proof of the solution near given loads, which may come from any source.

    loads    : (n,) [force] not negative, in the order of the scene's asperities; or a `NearState`
    approach : [length] prescribed approach, if no load is given
    load     : [force] prescribed load P, if no approach is given
    sheared  : friction states to prove, with the losses of cycles from -Q to Q. Each is a pair: the
        shear force Q [force], and the `NearState` of the contact without shear at the load P - Q/f,
        with the coefficient of friction f (docs/theory/proof-file.md)

    The function runs the checker, which computes the bounds, so it takes as long as a check: about
    a minute for 3,000 asperities.

    Raises InputError for invalid values and for scenes too large for the checker; ProofError if no
    solution is proved, because the loads are too inaccurate or the contacts overlap too much.
    """
    checks.exactly_one("approach", approach, "load", load)
    refuse_many(scene)
    if not isinstance(loads, NearState):
        loads = NearState.given(
            checks.array("loads", loads, length=len(scene), sign="not negative")
        )
    if load is not None and not any(loads.loads):
        raise InputError("loads", found="none", expected="a load on some asperity")
    modulus = scene.material.contact_modulus
    rounded = np.array(loads.loads, dtype=np.float64)
    radii = hertz.contact_radius(rounded, modulus, scene.relative_radii)
    trial = TrialState(scene, radii, approach, None if load is None else load / modulus)
    document = _document(trial, {"approach": approach} if load is None else {"load": load})
    document["pressed"] = _place(trial, document, loads, approach)
    document["sheared"] = [
        {"force": abs(force).hex(), "held": _place(trial, document, near, None)}
        for force, near in sheared
    ]
    refusal = "contacts overlap too much for the energy to be proved convex near these loads"
    for argument in trial.arguments():
        document["argument"] = _written(argument._asdict())
        try:
            proved = checker.prove(document, LOGGER.info)
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


def _document(trial: TrialState, prescribed: dict[str, Any]) -> dict[str, Any]:
    """The contents of the file without its entries `argument`, `pressed`, `sheared`, `claims`."""
    scene = trial.scene
    x, y = scene.asperities.positions.T
    given = {
        "sphere_radius": scene.sphere_radius,
        "contact_modulus": scene.material.contact_modulus,
        "poisson_ratio": scene.material.poisson_ratio,
        "friction": scene.friction,
        "geometry": scene.geometry,
        "x": x,
        "y": y,
        "heights": scene.asperities.heights,
        "tip_radii": scene.asperities.tip_radii,
    }
    return {
        "format": checker.FORMAT,
        "scene": _written(given),
        "prescribed": _written(prescribed),
        "sha256": checker.digest(_written(given), _written(prescribed)),
        "argument": None,
        "pressed": None,
        "sheared": [],
        "claims": None,
    }


def _place(
    trial: TrialState, document: dict[str, Any], near: NearState, approach: float | None
) -> dict[str, Any]:
    """The entry of the file for a state: contact radii to thirty digits, and the approach."""
    scene = checker.read_scene(document["scene"])
    radii = [
        _cube_root(load * R * Fraction(3, 4) / scene.modulus)
        for load, R in zip(near.loads, scene.radii, strict=True)
    ]
    centre = Fraction(trial.best_approach) if near.approach is None else near.approach
    if approach is not None:
        centre = Fraction(approach)
    return {"radii": [_digits(radius) for radius in radii], "approach": _digits(centre)}


def _cube_root(x: Fraction) -> Fraction:
    """The cube root of x to about thirty digits."""
    near = Fraction(math.cbrt(x))
    return near + (x - near**3) / (3 * near**2) if near else near


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
        return [_beyond(value.low, -math.inf), _beyond(value.high, math.inf)]
    return [_written(item) for item in value]


def _beyond(bound: Fraction, end: float) -> str:
    """The bound rounded towards `end` to a float64 number in hexadecimal."""
    value = float(bound)
    if (Fraction(value) - bound) * int(math.copysign(1, end)) < 0:
        value = math.nextafter(value, end)
    return value.hex()
