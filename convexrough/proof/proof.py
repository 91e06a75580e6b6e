"""Write down which asperities touch and slide, and why, for a checker that believes nothing."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any, Protocol

from numpy.typing import ArrayLike

from convexrough import checker, checks
from convexrough.arrays import Array
from convexrough.errors import InputError, ProofError
from convexrough.progress import Announce
from convexrough.proof.arguments import Argument, Trial
from convexrough.record import Record
from convexrough.scene.scene import Scene
from convexrough.sphere import hertz, mindlin
from convexrough.whole import replacing


class Sheared(Protocol):
    """A friction state on first loading, such as `convexrough.shear` returns."""

    @property
    def force(self) -> float: ...
    @property
    def displacement(self) -> float: ...
    @property
    def stick_radii(self) -> Array: ...


@dataclass(frozen=True, eq=False, repr=False)
class Proof(Record):
    """Words for all asperities, with bounds on every load, gap, shear force, slip and loss.

    document : what the file holds (docs/theory/proof-file.md)
    proved   : the same in words, as the checker says it
    """

    document: dict[str, Any]
    proved: str

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the file that `convexrough check` and `python checker.py` read, or none."""
        with replacing(Path(path)) as temporary:
            temporary.write_text(json.dumps(self.document, indent=0) + "\n", encoding="utf-8")


def prove(
    scene: Scene,
    loads: ArrayLike,
    *,
    approach: float | None = None,
    load: float | None = None,
    sheared: Sequence[Sheared] = (),
    announce: Announce | None = None,
) -> Proof:
    """A proof of the solution near these loads, wherever they came from.

    loads : (n,) [force] not negative, in the order of the scene's asperities
    approach [length] or load [force] : what is prescribed, exactly one
    sheared : friction states to prove, too, with the loss of the cycle from -force to force
    announce : told in a line how far long work has come

    The bounds are those that the checker computes in exact arithmetic, so proving takes as long as
    checking does: a minute for 3,000 asperities.

    Raises InputError for bad values and for scenes too large for the checker; ProofError where no
    solution is proved near these loads: they are too far off, or too crowded.
    """
    checks.exactly_one("approach", approach, "load", load)
    refuse_many(scene)
    given = checks.array("loads", loads, length=len(scene), sign="not negative")
    if load is not None and not given.any():
        raise InputError("loads", found="none", expected="a load on some asperity")
    modulus = scene.material.contact_modulus
    radii = hertz.contact_radius(given, modulus, scene.relative_radii)
    trial = Trial(scene, radii, approach, None if load is None else load / modulus)
    prescribed = {"approach": approach} if load is None else {"load": load}
    refusal = "contacts overlap too much for the energy to be proved convex near these loads"
    for argument in trial.arguments():
        document = _document(trial, prescribed, argument, sheared)
        try:
            proved = checker.prove(document, announce or (lambda line: None))
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


def _document(
    trial: Trial, prescribed: dict[str, Any], argument: Argument, sheared: Sequence[Sheared]
) -> dict[str, Any]:
    """The file, without claims as yet."""
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
    friction = checks.friction(scene.friction) if sheared else 0.0
    travel = mindlin.ratio(scene.material.poisson_ratio) * friction
    states = [
        {
            "force": abs(state.force),
            "radii": state.stick_radii,
            "approach": trial.best_approach - abs(state.displacement) / travel,
        }
        for state in sheared
    ]
    document: dict[str, Any] = {
        "format": checker.FORMAT,
        "scene": _written(given),
        "prescribed": _written(prescribed),
        "sha256": checker.digest(_written(given), _written(prescribed)),
        "argument": _written(argument._asdict()),
        "pressed": _written({"radii": trial.radii, "approach": trial.best_approach}),
        "sheared": _written(states),
        "claims": None,
    }
    return document


def _written(value: Any) -> Any:
    """As JSON: float64 in hexadecimal, intervals as two of them, rounded outwards."""
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
    """The nearest float64 on the side of `end`."""
    value = float(bound)
    if (Fraction(value) - bound) * int(math.copysign(1, end)) < 0:
        value = math.nextafter(value, end)
    return value.hex()
