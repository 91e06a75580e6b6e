"""What a proof file claims, judged by the 50-digit reference; knows nothing of the checker."""

from math import inf
from typing import Any

import multiprecision
import numpy as np
from flint import arb, ctx

#: Of the oracle; claims are of float64 numbers.
DIGITS = 50


def false_claims(document: Any) -> list[str]:
    """The claims that do not hold for the file's own scene: none if all is well."""
    claims, scene = document["claims"], document["scene"]
    ((control, value),) = document["prescribed"].items()
    with ctx.workdps(3 * DIGITS):
        pressed = _solved(scene, document["pressed"]["radii"], {control: float.fromhex(value)})
        false = _outside("approach", claims["approach"], pressed.approach)
        false += _outside("load", claims["load"], pressed.load)
        for i, status in enumerate(claims["status"]):
            true = "contact" if pressed.loads[i] > 0 else "open"
            if status not in (true, "undecided"):
                false.append(f"asperity {i} is {true}, not {status}")
            false += _outside(f"load {i}", claims["loads"][i], pressed.loads[i])
            false += _outside(f"gap {i}", claims["gaps"][i], pressed.gaps[i])
        for state, claim in zip(document["sheared"], claims["shear"], strict=True):
            false += _false_shear(scene, pressed, state, claim)
    return false


def _false_shear(
    scene: Any, pressed: multiprecision.Reference, state: Any, claim: Any
) -> list[str]:
    """The friction state by Ciavarella and Jaeger's theorem, and the loss of its cycle."""
    f, nu, force = (_number(x) for x in (scene["friction"], scene["poisson_ratio"], state["force"]))
    held = _solved(scene, state["held"]["radii"], {"load": pressed.load - force / f})
    travel = f * (2 - nu) / (2 * (1 - nu))
    modulus, radii = _number(scene["contact_modulus"]), _radii(scene)
    bend = sum((arb(0) if inf == R else 1 / arb(R) for R in radii), arb(0)) / 2
    false = _outside(
        "displacement", claim["displacement"], travel * (pressed.approach - held.approach)
    )
    loss = arb(0)
    for i, status in enumerate(claim["status"]):
        P, p = pressed.loads[i], held.loads[i]
        if p > P:
            false.append(f"the theorem does not hold at asperity {i}")
        true = "open" if not P > 0 else "partial" if p > 0 else "sliding"
        if status not in (true, "undecided"):
            false.append(f"asperity {i} is {true}, not {status}")
        slip = travel * held.gaps[i] if P > 0 else arb(0)
        false += _outside(f"force {i}", claim["forces"][i], f * (P - p))
        false += _outside(f"slip {i}", claim["slips"][i], slip)
        if P > 0:
            relative = 1 / (bend + 1 / _number(scene["tip_radii"][i]))
            threshold = (9 * P * P / (16 * modulus * modulus * relative)).root(3)
            t = 1 - p / P
            e = 1 - (1 - t) * _cube_root(1 - t) ** 2 - 5 * t / 6 * (1 + _cube_root(1 - t) ** 2)
            loss += arb(24) / 5 * travel * f * threshold * P * e + 4 * f * P * slip
    if claim["loss"] is None:
        return false
    between = _solved(scene, state["held"]["radii"], {"load": pressed.load - force / (2 * f)})
    for low, middle, high in zip(held.loads, between.loads, pressed.loads, strict=True):
        if not low <= middle <= high:
            false.append("a loss without order")
    return false + _outside("loss", claim["loss"], loss)


def _radii(scene: Any) -> tuple[float, float]:
    """Along x and y."""
    given = scene["sphere_radius"]
    x, y = given if isinstance(given, list) else (given, given)
    return float.fromhex(x), float.fromhex(y)


def _cube_root(x: arb) -> arb:
    return x.root(3) if x > 0 else arb(0)


def _solved(scene: Any, radii: list[list[str]], control: Any) -> multiprecision.Reference:
    x, y, heights, tips = (
        np.array([float.fromhex(text) for text in scene[key]])
        for key in ("x", "y", "heights", "tip_radii")
    )
    a = np.array([sum(map(float.fromhex, radius)) for radius in radii])
    modulus = float.fromhex(scene["contact_modulus"])
    return multiprecision.solve(
        np.stack([x, y], axis=1),
        tips,
        heights,
        sphere_radius=_radii(scene),
        contact_modulus=modulus,
        geometry=scene["geometry"],
        digits=DIGITS,
        start=4 * modulus * a**3 * (sum(1 / R for R in _radii(scene)) / 2 + 1 / tips) / 3,
        **control,
    )


def _number(text: str) -> arb:
    return arb(float.fromhex(text))


def _outside(what: str, bounds: list[str], true: arb) -> list[str]:
    low, high = (_number(text) for text in bounds)
    return [] if low <= true <= high else [f"{what} is {true}, outside its bounds"]
