"""What is right today, for six scenes: values, bounds and statuses, and how to pin them again.

    PYTHONPATH=tests python -m golden_values

writes tests/golden/*.json: what was asked; values, from the reference in 100 digits where there is
one (`source`), else from the package; and the bounds that the package proves for its own values.
"""

import json
from collections import Counter
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from flint import ctx
from friction_scenes import FRICTION
from gradient_oracle import DIGITS, Setup
from levels_reference import SCENES, Friction, Level, friction_state
from scenes import MATERIAL

import convexrough as cr

FOLDER = Path(__file__).parent / "golden"
FRACTIONS = (0.01, 0.37, 0.9)
Values = dict[str, Any]


def _many(within: float, scattered: bool) -> cr.Scene:
    made = cr.Asperities.hexagonal(
        spacing=0.0004, tip_radius=0.0033, within=within, height_std=1e-6, seed=3
    )
    if not scattered:
        return cr.Scene(1.0, made, MATERIAL, FRICTION, geometry="summit")
    moved = np.random.default_rng(1).uniform(-7e-5, 7e-5, made.positions.shape)
    asperities = cr.Asperities(made.positions + moved, 0.0033, made.heights)
    return cr.Scene(1.0, asperities, MATERIAL, FRICTION, geometry="summit")


def _everywhere(name: str) -> tuple[cr.Scene, float]:
    """The scene with rounded radii and heights: a logarithm's last bit depends on the machine."""
    scene, approach = SCENES[name]
    made = scene.asperities
    asperities = cr.Asperities(made.positions, made.tip_radii.round(9), made.heights.round(15))
    return replace(scene, asperities=asperities), approach


#: name -> (scene, approach, influence)
GOLDEN: dict[str, tuple[cr.Scene, float, Any]] = {
    **{name: (*SCENES[name], "dense") for name in ("paper", "steel")},
    **{name: (*_everywhere(name), "dense") for name in ("rough", "rough, closest")},
    "dense": (*SCENES["dense"], "dense"),
    "lattice": (_many(0.0102, scattered=False), 5e-5, "lattice"),
    "scattered": (_many(0.0075, scattered=True), 2.5e-5, "scattered"),
}


def asked(name: str) -> dict[str, Any]:
    """The controls of one scene, and the asperities that are told one by one."""
    contact = _pressed(name, approach=GOLDEN[name][1])
    order = np.argsort(contact.loads)[::-1]
    touching = int((contact.loads > 0).sum())
    return {
        "approach": GOLDEN[name][1],
        "load": contact.load,
        "forces": [fraction * FRICTION * contact.load for fraction in FRACTIONS],
        "asperities": [int(order[i]) for i in (0, touching // 2, touching - 1)],
    }


@cache
def _pressed(name: str, **control: float) -> cr.Contact:
    scene, _, influence = GOLDEN[name]
    return cr.press(scene, **control, influence=influence)  # type: ignore[arg-type]


def found(name: str, given: dict[str, Any]) -> tuple[Values, Values, Values]:
    """Values and proved bounds by what they are, and how often each status is said."""
    contact, by_load = (_pressed(name, **{key: given[key]}) for key in ("approach", "load"))
    some, judged = given["asperities"], contact.certificate
    values: Values = {"load": contact.load, "approach": by_load.approach}
    # The total is that of float64 numbers, rounded once.
    bounds: Values = {
        "load": float(judged.load_errors.sum() + np.spacing(contact.load)),
        "approach": by_load.certificate.approach_error,
    }
    values["loads"], bounds["loads"] = contact.loads[some], judged.load_errors[some]
    statuses: Values = {"pressed": Counter(contact.status), "scope": judged.scope}
    for Q in given["forces"]:
        state, cycle = cr.shear(contact, force=Q), cr.cycle(contact, maximum=Q)
        errors = state.certificate.force_errors[some]
        left = contact.loads[some] - state.forces[some] / FRICTION
        stuck = np.where(left > 0, left, np.inf)
        share = (judged.load_errors[some] + errors / FRICTION) / stuck / 3
        each = {
            "forces": (state.forces[some], errors),
            "displacement": (state.displacement, state.certificate.displacement_error),
            "stick radii": (state.stick_radii[some], state.stick_radii[some] * (share + 1e-15)),
        }
        if cycle.order == "proved":  # else no loss is proved
            each["loss"] = (cycle.loss, cycle.loss_error)
        for what, (value, bound) in each.items():
            values[f"{what} at {Q!r}"], bounds[f"{what} at {Q!r}"] = value, bound
        statuses[f"at {Q!r}"] = Counter(state.status)
    plain = {key: np.asarray(value).tolist() for key, value in values.items()}
    return plain, {key: np.asarray(value).tolist() for key, value in bounds.items()}, statuses


def true(name: str, given: dict[str, Any]) -> Values:
    """The same values, as strings of 30 digits."""
    contact, by_load = (_pressed(name, **{key: given[key]}) for key in ("approach", "load"))
    some = given["asperities"]
    with ctx.workdps(DIGITS):
        level, other = (
            Level(Setup.of(each, holding), each)
            for each, holding in ((contact, "approach"), (by_load, "load"))
        )
        values: Values = {"load": level.load, "approach": other.approach}
        values["loads"] = level.loads[some]
        for Q in given["forces"]:
            state: Friction = friction_state(contact, Q, "approach")
            values[f"forces at {Q!r}"] = state.forces[some]
            values[f"displacement at {Q!r}"] = state.displacement
            values[f"loss at {Q!r}"] = state.energy
            values[f"stick radii at {Q!r}"] = state.stick_radii[some]
        return {
            key: [_text(each) for each in value] if isinstance(value, np.ndarray) else _text(value)
            for key, value in values.items()
        }


def _text(value: Any) -> str:
    return str(value.mid().str(30, radius=False))


def main() -> None:
    for name in GOLDEN:
        given = asked(name)
        values, bounds, statuses = found(name, given)
        source = "reference" if name in SCENES else "package"
        pinned = {
            "given": given,
            "source": source,
            "values": true(name, given) if source == "reference" else values,
            "bounds": bounds,
            "statuses": statuses,
        }
        path = FOLDER / f"{name.replace(', ', '-')}.json"
        lines = [f"{json.dumps(key)}: {_lined(value)}" for key, value in pinned.items()]
        path.write_text("{\n" + ",\n".join(lines) + "\n}\n", "utf-8")


def _lined(value: Any) -> str:
    """One entry of a table in each line."""
    if not isinstance(value, dict):
        return json.dumps(value)
    lines = [f" {json.dumps(key)}: {json.dumps(each)}" for key, each in value.items()]
    return "{\n" + ",\n".join(lines) + "\n}"


if __name__ == "__main__":
    main()
