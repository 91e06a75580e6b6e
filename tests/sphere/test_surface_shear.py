"""Surface displacements: Boussinesq's and Cerruti's integrals; pressures and tractions balance."""

from typing import Any

import numpy as np
import pytest
from friction_scenes import FRICTION, pressed
from numpy.testing import assert_allclose
from scenes import NAMED
from scipy.integrate import dblquad, quad

import convexrough as cr
from convexrough import fields
from convexrough.sphere import hertz, surface_shear

A, PEAK, G = 0.7, 2.0, 3.0
RATIOS = [0.0, 0.3, 0.5]
DIRECTIONS = np.array([0.0, 0.7, np.pi / 2, 2.5])


def displacement(r: float, angle: float, nu: float, share: float = 1.0) -> Any:
    x, y = r * np.cos(angle), r * np.sin(angle)
    return surface_shear.surface_displacement(x, y, A, share, PEAK, G, nu)


def cerruti(r: float, angle: float, nu: float, a: float, q0: float) -> float:
    """Both surfaces' displacement along x at (r, angle), from q0 sqrt(1 - r^2/a^2) on a disc.

    Lines through the point are chords; the integral of the traction along one is that of a circle.
    """
    half = np.arcsin(min(a / r, 1.0)) if r > 0 else np.pi / 2  # directions that meet the disc

    def along_a_line(w: float) -> float:
        nearest = r * np.sin(w)
        line = q0 * np.pi * max(a**2 - nearest**2, 0.0) / (2 * a)
        return float(line * (1 - nu + nu * np.cos(angle + w) ** 2) / (np.pi * G))

    return float(quad(along_a_line, -half, half, epsabs=0, epsrel=1e-10)[0])


@pytest.mark.sample(6)
@pytest.mark.parametrize("nu", RATIOS)
@pytest.mark.parametrize("ratio", [0.0, 0.3, 0.6, 0.95, 1.05, 1.5, 4.0, 30.0])
def test_displacement_is_cerrutis_integral(ratio: float, nu: float) -> None:
    r = ratio * A
    for angle in DIRECTIONS:
        whole = cerruti(r, angle, nu, A, PEAK)
        assert displacement(r, angle, nu) == pytest.approx(whole, rel=1e-6)
        c = A * (1 - 0.4) ** (1 / 3)  # 0.84 a: between the fourth and the third distance
        stuck = cerruti(r, angle, nu, c, PEAK * c / A)
        assert displacement(r, angle, nu, 0.4) == pytest.approx(whole - stuck, rel=3e-6)


@pytest.mark.sample(4)
@pytest.mark.parametrize("fraction", [0.01, 0.5, -0.5, 0.95, 1.0])
@pytest.mark.parametrize("name", ["paper", "rough, closest", "steel"])
def test_fields_of_each_asperity_integrate_to_its_forces(name: str, fraction: float) -> None:
    """Tractions to forces, pressures to loads."""
    contact = pressed(name)
    state = cr.shear(contact, force=fraction * FRICTION * contact.load)
    touching = contact.loads > 0
    centres, a = contact.scene.contact_points[touching], contact.contact_radii[touching]
    c = state.stick_radii[touching]
    nodes, weights = np.polynomial.legendre.leggauss(24)
    phi, weights = np.pi / 4 * (nodes + 1), np.pi / 4 * weights
    forces, loads = np.zeros((2, len(a)))
    for inner, outer in ((0 * c, c), (c, a)):  # r^2 = outer^2 - (outer^2 - inner^2) cos^2(phi)
        squared = outer**2 - inner**2
        for angle, weight in zip(phi, weights, strict=True):
            r = np.sqrt(outer**2 - squared * np.cos(angle) ** 2)
            points, ring = centres + r[:, None] * [0.6, 0.8], np.pi * squared * np.sin(2 * angle)
            forces += weight * ring * fields.traction(state, points)
            loads += weight * ring * fields.pressure(contact, points)
    assert_allclose(forces, state.forces[touching], rtol=1e-7)
    assert_allclose(loads, contact.loads[touching], rtol=1e-7)
    assert forces.sum() == pytest.approx(state.force, rel=1e-7)


@pytest.mark.sample(2)
@pytest.mark.parametrize("name", NAMED)
def test_no_pressure_outside_the_discs(name: str) -> None:
    contact = pressed(name)
    touching, phi = contact.loads > 0, 0.1 + 2 * np.pi * np.arange(7) / 7
    centres, a = contact.scene.contact_points[touching], contact.contact_radii[touching]
    circles = a[:, None, None] * np.stack((np.cos(phi), np.sin(phi)), axis=-1)
    assert (fields.pressure(contact, centres[:, None] + (1 - 1e-6) * circles) > 0).all()
    assert (fields.pressure(contact, centres[:, None] + (1 + 1e-6) * circles) == 0.0).all()
    far = 10 * np.abs(contact.scene.contact_points).max()
    assert fields.pressure(contact, [far, 0.0]) == 0.0
    assert (fields.pressure(contact, contact.scene.contact_points[~touching]) == 0.0).all()


@pytest.mark.parametrize("distance", [1.2, 2.0, 7.0])
def test_displacement_outside_is_boussinesqs_integral(distance: float) -> None:
    modulus, radius = 3.0, 0.7
    a = float(hertz.contact_radius(2e-5, modulus, radius))
    r, peak = distance * a, float(hertz.peak_pressure(a, modulus, radius))

    def kernel(angle: float, tilt: float) -> float:  # at a distance s = A sin(tilt) from the axis
        s = a * np.sin(tilt)
        apart = np.sqrt(r**2 + s**2 - 2 * r * s * np.cos(angle))
        ring = hertz.pressure(s, a, peak) * s * a * np.cos(tilt)
        return float(ring / (np.pi * modulus * apart))

    integral = 2 * dblquad(kernel, 0, np.pi / 2, 0, np.pi, epsabs=0, epsrel=1e-10)[0]
    assert hertz.surface_displacement(r, a, radius) == pytest.approx(integral, rel=1e-9)
