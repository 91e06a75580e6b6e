"""The answers of the gallery, in ball arithmetic: convexrough/gallery/cases.json is its output.

    PYTHONPATH=tests python tests/gallery_answers.py            computes all anew and writes them
    PYTHONPATH=tests python tests/gallery_answers.py one collinear   only those

Every digit is proved by an interval Newton step (`multiprecision`). Friction is Ciavarella and
Jaeger's theorem, Q_i = f (P_i - p_i(P - Q / f)), of two such states.
"""

import json
import sys
from math import log2
from pathlib import Path
from typing import Any

import numpy as np
from flint import arb, ctx
from gallery_recipes import FITTED, RECIPES, Recipe
from multiprecision import NotProved
from scenes import solve_exactly

import convexrough as cr
from convexrough.gallery import cases
from convexrough.sphere import hertz

PATH = Path(cr.gallery.__file__).with_name(cases.DATA)
DIGITS, KEPT = 75, 50  # near Q = 0 a difference loses 12


def tune(name: str) -> float:
    """The height with the gap, indentation or load that the name says, over approach or load."""
    make, which = FITTED[name]
    _, kind, near = name.split("-", 2)
    low = make(-1.0)  # far below all others
    contact = cr.press(low.scene, approach=low.approach)
    exact = solve_exactly(low.scene, approach=low.approach, start=contact.loads, digits=DIGITS)
    with ctx.workdps(DIGITS):
        touches = arb(-1.0) + exact.gaps[which]
        size = arb(near)
        if kind == "load":
            R = low.scene.relative_radii[which]
            k = arb(float(hertz.local_coefficient(1.0, R)))
            heaviest = max(exact.loads, key=lambda load: float(load.mid()))
            off = k * (size * heaviest) ** (arb(2) / 3)
        else:
            off = size * arb(low.approach) * (-1 if kind == "gap" else 1)
        return float((touches + off).mid())


def digits(ball: arb) -> str:
    if ball == 0:
        return "0"
    if ball.rel_accuracy_bits() < KEPT * log2(10):
        raise NotProved("fewer digits than promised")
    with ctx.workdps(DIGITS):
        return str(ball.str(KEPT, radius=False))


def stored(recipe: Recipe) -> dict[str, Any]:
    """All that is stored of a case."""
    scene, a = recipe.scene, recipe.scene.asperities
    given = {"approach": recipe.approach} if recipe.load is None else {"load": recipe.load}
    contact = cr.press(scene, **given)
    full = solve_exactly(scene, **given, start=contact.loads, digits=DIGITS)
    force = recipe.fraction * scene.friction * float(full.load.mid())
    return {
        "family": recipe.family,
        "why": recipe.why,
        "sphere_radius": scene.sphere_radius,
        "contact_modulus": scene.material.contact_modulus,
        "poisson_ratio": scene.material.poisson_ratio,
        "friction": scene.friction,
        "geometry": scene.geometry,
        "positions": a.positions.tolist(),
        "tip_radii": a.tip_radii.tolist(),
        "heights": a.heights.tolist(),
        "prescribed": given,
        "shear_force": force,
        "reversals": recipe.reversals,
        "answer": {
            "approach": digits(full.approach),
            "load": digits(full.load),
            "loads": [digits(load) for load in full.loads],
            "gaps": [digits(gap) for gap in full.gaps],
            **sheared(recipe, full, force),
        },
    }


def sheared(recipe: Recipe, full: Any, force: float) -> dict[str, Any]:
    """Nothing where an asperity would be dragged along."""
    scene = recipe.scene
    with ctx.workdps(DIGITS + 30):
        f, nu = arb(scene.friction), arb(scene.material.poisson_ratio)
        travel = f * (2 - nu) / (2 * (1 - nu))
        left = full.load - arb(force) / f
        loads = np.array([float(load.mid()) for load in full.loads])
        start = loads * float((left / full.load).mid())
        contact = cr.press(scene, load=float(left.mid()), start=start)
        reduced = solve_exactly(scene, load=left, start=contact.loads, digits=DIGITS)
        forces = [f * (a - b) for a, b in zip(full.loads, reduced.loads, strict=True)]
        if any(each < 0 for each in forces):
            return {"forces": [], "slips": [], "displacement": ""}
        touch = [load > 0 for load in full.loads]
        pairs = zip(reduced.gaps, touch, strict=True)
        slips = [travel * gap if touches else arb(0) for gap, touches in pairs]
        return {
            "forces": [digits(each) for each in forces],
            "slips": [digits(each) for each in slips],
            "displacement": digits(travel * (full.approach - reduced.approach)),
        }


def true_statuses(case: cr.gallery.HardCase, statuses: Any) -> bool:
    """No status of a pressed contact is wrong."""
    allowed = np.where(case.touching, "contact", "open")
    return bool(((statuses == allowed) | (statuses == "undecided")).all())


def write(wanted: list[str]) -> None:
    """A line for each case. A height that is fitted is stored first, and read by its recipe."""
    found = json.loads(PATH.read_text())
    for name in wanted:
        if name in FITTED:
            make, _ = FITTED[name]
            heights = make(tune(name)).scene.asperities.heights.tolist()
            found[name] = {**found[next(iter(FITTED))], **found.get(name, {}), "heights": heights}
            _save(found)
        found[name] = stored(RECIPES[name]())
        print(name, found[name]["answer"]["load"][:12])
    _save({name: found[name] for name in RECIPES})


def _save(found: dict[str, Any]) -> None:
    lines = [f"{json.dumps(name)}: {json.dumps(case)}" for name, case in found.items()]
    PATH.write_text("{\n" + ",\n".join(lines) + "\n}\n")
    cases._cases.cache_clear()


if __name__ == "__main__":
    write(sys.argv[1:] or list(RECIPES))
