"""What a proof file claims, judged by the 50-digit reference; knows nothing of the checker."""

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
        for i, word in enumerate(claims["status"]):
            true = "contact" if pressed.loads[i] > 0 else "open"
            if word not in (true, "undecided"):
                false.append(f"asperity {i} is {true}, not {word}")
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
    held = _solved(scene, state["radii"], {"load": pressed.load - force / f})
    travel = f * (2 - nu) / (2 * (1 - nu))
    modulus, radius = _number(scene["contact_modulus"]), _number(scene["sphere_radius"])
    false = _outside(
        "displacement", claim["displacement"], travel * (pressed.approach - held.approach)
    )
    energy = arb(0)
    for i, word in enumerate(claim["status"]):
        P, p = pressed.loads[i], held.loads[i]
        if p > P:
            false.append(f"the theorem does not hold at asperity {i}")
        true = "open" if not P > 0 else "partial" if p > 0 else "sliding"
        if word not in (true, "undecided"):
            false.append(f"asperity {i} is {true}, not {word}")
        slip = travel * held.gaps[i] if P > 0 else arb(0)
        false += _outside(f"force {i}", claim["forces"][i], f * (P - p))
        false += _outside(f"slip {i}", claim["slips"][i], slip)
        if P > 0:
            relative = 1 / (1 / radius + 1 / _number(scene["tip_radii"][i]))
            ceiling = (9 * P * P / (16 * modulus * modulus * relative)).root(3)
            t = 1 - p / P
            e = 1 - (1 - t) * _cube_root(1 - t) ** 2 - 5 * t / 6 * (1 + _cube_root(1 - t) ** 2)
            energy += arb(24) / 5 * travel * f * ceiling * P * e + 4 * f * P * slip
    return false + _outside("energy", claim["energy"], energy)


def _cube_root(x: arb) -> arb:
    return x.root(3) if x > 0 else arb(0)


def _solved(scene: Any, radii: list[str], control: Any) -> multiprecision.Reference:
    x, y, heights, tips, a = (
        np.array([float.fromhex(text) for text in values])
        for values in (scene["x"], scene["y"], scene["heights"], scene["tip_radii"], radii)
    )
    radius, modulus = (float.fromhex(scene[key]) for key in ("sphere_radius", "contact_modulus"))
    return multiprecision.solve(
        np.stack([x, y], axis=1),
        tips,
        heights,
        sphere_radius=radius,
        contact_modulus=modulus,
        geometry=scene["geometry"],
        digits=DIGITS,
        start=4 * modulus * a**3 * (1 / radius + 1 / tips) / 3,
        **control,
    )


def _number(text: str) -> arb:
    return arb(float.fromhex(text))


def _outside(what: str, bounds: list[str], true: arb) -> list[str]:
    low, high = (_number(text) for text in bounds)
    return [] if low <= true <= high else [f"{what} is {true}, outside its bounds"]
