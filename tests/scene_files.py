"""Scene files and files of loads that several tests write."""

from pathlib import Path
from typing import Any

import convexrough as cr

HEXAGONAL = """
pattern = "hexagonal"
spacing = 0.0025
tip_radius = 0.02
geometry = "summit"
"""


def scene_text(asperities: str = HEXAGONAL, normal: str = "approach = 5e-5", more: str = "") -> str:
    return f"""
[sphere]
radius = 1.0
[material]
contact_modulus = 1.0
poisson_ratio = 0.3
[asperities]
{asperities}
[normal]
{normal}
{more}
"""


def write_loads(path: Path, scene: cr.Scene, loads: Any, order: Any) -> Path:
    points = scene.asperities.positions
    rows = [f"{float(points[i, 0])},{float(loads[i])},{float(points[i, 1])}" for i in order]
    path.write_text("\n".join(["x,load,y", *rows]))
    return path
