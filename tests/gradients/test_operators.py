"""Slopes of the surface, which gradients by positions are made of, on a mesh."""

import numpy as np
from scenes import MATERIAL

import convexrough as cr
from convexrough.influence import couple


def test_slopes_on_a_mesh() -> None:
    rng = np.random.default_rng(1)
    asperities = cr.Asperities(rng.uniform(-1, 1, size=(3000, 2)), 1e-3)
    scene = cr.Scene(1.0, asperities, MATERIAL, geometry="summit")
    loads = rng.uniform(0.5, 1.0, size=3000)
    mesh, matrix = (couple(scene, np.arange(3000), 1.0, kind) for kind in ("scattered", "dense"))
    assert mesh._double.splitting.meshed  # type: ignore[attr-defined]
    found, expected = mesh.slopes(loads), matrix.slopes(loads)
    off = np.abs(found - expected).max(axis=1)
    assert (off <= 1e-10 * np.median(np.abs(expected))).all()
