"""Gradients by every kind of operator, and how many products they take."""

from typing import Any

import numpy as np
import pytest
from friction_scenes import with_friction
from scenes import MATERIAL, NAMED, on_lattice, operators, scattered

import convexrough as cr
from convexrough.arrays import Array
from convexrough.influence import couple


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
    asperities = cr.Asperities(rng.uniform(-1, 1, size=(6000, 2)), 1e-3)
    scene = cr.Scene(1.0, asperities, MATERIAL)
    loads = rng.uniform(0.5, 1.0, size=6000)
    mesh, matrix = (couple(scene, np.arange(6000), 1.0, kind) for kind in ("scattered", "dense"))
    assert mesh._double.splitting.meshed  # type: ignore[attr-defined]
    found, expected = mesh.slopes(loads), matrix.slopes(loads)
    off = np.abs(found - expected).max(axis=1)
    assert (off <= 1e-10 * np.median(np.abs(expected))).all()


@pytest.mark.parametrize("geometry", ["summit", "closest"])
def test_all_operators_agree(geometry: Any) -> None:
    asperities = cr.Asperities.hexagonal(
        spacing=2.5e-4, tip_radius=2e-3, within=6e-3, height_std=3e-8, seed=1
    )
    scene = with_friction(cr.Scene(1.0, asperities, MATERIAL, geometry=geometry))
    known: cr.Gradient | None = None
    for kind in ("dense", "lattice", "scattered"):
        contact = cr.press(scene, load=1e-8, influence=kind)
        gradient = cr.cycle(contact, maximum=0.2 * contact.load).gradient()
        assert gradient.balance_defect < 1e-8
        if known is None:
            known = gradient
            assert gradient.balance_defect < 1e-13
            continue
        for name in ("heights", "tip_radii", "positions"):
            true: Array = getattr(known, name)
            off = np.abs(getattr(gradient, name) - true).max()
            assert off <= 1e-8 * np.abs(true).max(), (kind, name)
        for name in ("sphere_radius", "contact_modulus", "load", "friction", "maximum"):
            assert getattr(gradient, name) == pytest.approx(getattr(known, name), rel=1e-7)


def test_a_smaller_tolerance_is_kept() -> None:
    scene, approach = NAMED["rough"]
    dense = cr.press(with_friction(scene), approach=approach)
    lattice = cr.press(with_friction(scene), approach=approach, influence="lattice")
    true = dense.gradient(load=1.0).heights
    found = lattice.gradient(load=1.0, tolerance=1e-13).heights
    np.testing.assert_allclose(found, true, rtol=0, atol=1e-12 * true.max())
