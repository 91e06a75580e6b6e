"""Scene files and files of loads that several tests write, and tables that they read."""

import csv
from pathlib import Path
from typing import Any

import convexrough as cr

HEXAGONAL = """
pattern = "hexagonal"
spacing = 0.0025
tip_radius = 0.02
geometry = "summit"
"""
WITHIN = f"{HEXAGONAL}within = 0.0102\n"
FRICTION = "[friction]\ncoefficient = 0.5\n"
ONE_BODY = "contact_modulus = 1.0\npoisson_ratio = 0.3\n"
TWO_BODIES = """[material.sphere]
youngs_modulus = 210e3
poisson_ratio = 0.3
hardness = 8e3
[material.base]
youngs_modulus = 70e3
poisson_ratio = 0.33
"""


def scene_text(
    asperities: str = HEXAGONAL,
    normal: str = "approach = 5e-5",
    more: str = "",
    radius: str = "1.0",
    material: str = ONE_BODY,
) -> str:
    return f"""
[sphere]
radius = {radius}
[material]
{material}
[asperities]
{asperities}
[normal]
{normal}
{more}
"""


def rows(path: Path | str) -> list[dict[str, str]]:
    with open(path, encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def write_loads(path: Path, scene: cr.Scene, loads: Any, order: Any) -> Path:
    points = scene.asperities.positions
    rows = [f"{float(points[i, 0])},{float(loads[i])},{float(points[i, 1])}" for i in order]
    path.write_text("\n".join(["x,load,y", *rows]))
    return path
