"""Slopes of the surface, which gradients by positions are made of, by every kind of operator."""

import numpy as np
import pytest
from scenes import MATERIAL, on_lattice, operators, scattered

import convexrough as cr
from convexrough.influence import couple


@pytest.mark.sample(3)
@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("count", [2, 30, 200])
def test_slopes_of_the_surface_are_its_derivative(seed: int, count: int) -> None:
    """Pair by pair here, from the formula."""
    for scene in (
        on_lattice(seed, count, 0.5, 0.0)[0],
        scattered(seed, min(count, 90), 0.5, 0.0)[0],
    ):
        points, rng = scene.contact_points, np.random.default_rng(seed)
        loads = rng.normal(size=len(points))
        apart = points[:, None, :] - points[None, :, :]
        r = np.sqrt((apart**2).sum(axis=2))
        np.fill_diagonal(r, np.inf)
        expected = -0.7 * (apart * (loads / r**3)[:, :, None]).sum(axis=1)
        sizes = 0.7 * (np.abs(apart) * (np.abs(loads) / r**3)[:, :, None]).sum(axis=1)
        for kind in operators(scene):
            found = couple(scene, np.arange(len(scene)), 0.7, kind).slopes(loads)
            assert np.abs(found - expected).max() <= 1e-12 * sizes.max(), kind


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
