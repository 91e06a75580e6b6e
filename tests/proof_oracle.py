"""What a proof file claims, judged by the 50-digit reference; knows nothing of the checker."""

from types import SimpleNamespace
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
    slid = multiprecision.slide(f, nu, pressed, held)
    false = _outside("displacement", claim["displacement"], slid.displacement)
    for i, status in enumerate(claim["status"]):
        P, p = pressed.loads[i], held.loads[i]
        if p > P:
            false.append(f"the theorem does not hold at asperity {i}")
        true = "open" if not P > 0 else "partial" if p > 0 else "sliding"
        if status not in (true, "undecided"):
            false.append(f"asperity {i} is {true}, not {status}")
        false += _outside(f"force {i}", claim["forces"][i], slid.forces[i])
        false += _outside(f"slip {i}", claim["slips"][i], slid.slips[i])
    if claim["loss"] is None:
        return false
    between = _solved(scene, state["held"]["radii"], {"load": pressed.load - force / (2 * f)})
    for low, middle, high in zip(held.loads, between.loads, pressed.loads, strict=True):
        if not low <= middle <= high:
            false.append("a loss without order")
    return false + _outside("loss", claim["loss"], slid.energy)


def _solved(scene: Any, radii: list[list[str]], control: Any) -> multiprecision.Reference:
    columns = (scene[key] for key in ("x", "y", "heights", "tip_radii"))
    x, y, heights, tips = (np.array([*map(float.fromhex, column)]) for column in columns)
    a = np.array([sum(map(float.fromhex, radius)) for radius in radii])
    modulus, sphere = float.fromhex(scene["contact_modulus"]), scene["sphere_radius"]
    along = tuple(map(float.fromhex, sphere if isinstance(sphere, list) else [sphere] * 2))
    read = SimpleNamespace(
        asperities=SimpleNamespace(positions=np.stack([x, y], 1), tip_radii=tips, heights=heights),
        material=SimpleNamespace(contact_modulus=modulus),
        sphere_radius=along,
        geometry=scene["geometry"],
    )
    start = 4 * modulus * a**3 * (sum(1 / R for R in along) / 2 + 1 / tips) / 3
    return multiprecision.solve(read, digits=DIGITS, start=start, **control)


def _number(text: str) -> arb:
    return arb(float.fromhex(text))


def _outside(what: str, bounds: list[str], true: arb) -> list[str]:
    low, high = (_number(text) for text in bounds)
    return [] if low <= true <= high else [f"{what} is {true}, outside its bounds"]
