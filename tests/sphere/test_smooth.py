"""Smooth spheres and ellipsoids, and the fields of asperities: quadrature, 60 digits, balances."""

from typing import Any

import numpy as np
import pytest
from flint import arb, ctx
from friction_scenes import pressed
from numpy.testing import assert_allclose
from scenes import MATERIAL
from scipy.integrate import quad
from scipy.special import ellipe, ellipk

import convexrough as cr
from convexrough import fields
from convexrough.sphere import ellipse, hertz, surface_shear
from convexrough.sphere.smooth import smooth_reference

RELATIVE, FRICTION = 0.31, 0.35
ALONE = cr.Asperities([(0.0, 0.0)], 1.0)  # of no consequence
LOAD = 2e-6
PARTS = np.array([0.0, 0.25, 0.5, 0.95, 1.2])  # of the contact radius


def smoothed(radii: Any = RELATIVE, load: float = LOAD, nu: float = 0.3) -> Any:
    scene = cr.Scene(radii, ALONE, cr.Material(3.0, nu), FRICTION, geometry="summit")
    return cr.smooth(scene, load=load)


def exact(t: Any, nu: Any) -> dict[str, Any]:
    """The formulas of Cattaneo, Mindlin and Deresiewicz as printed, in 60 digits."""
    with ctx.workdps(60):
        f, P, radius, E, t, nu = map(arb, (FRICTION, LOAD, RELATIVE, 3.0, t, nu))
        G, a = E * (1 - nu), (3 * P * radius / (4 * E)).root(3)
        left = (1 - t).root(3)  # c / a
        scale = 9 * (2 - nu) * f**2 * P**2 / (5 * G * a)
        loss = 1 - left**5 - 5 * t / 6 * (1 + left**2)
        p0, squares = 2 * E * a / (arb.pi() * radius), [arb(part) ** 2 for part in PARTS]
        roots = [[(s**2 - r).nonnegative_part().sqrt() for r in squares] for s in (arb(1), left)]
        whole, stuck = np.array(roots)
        return {
            "displacement": float(3 * (2 - nu) * f * P / (8 * G * a) * (1 - left**2)),
            "stick_radius": float(a * left),
            "energy": float(scale * loss),
            "energy_scale": float(scale),
            "traction": (f * p0 * (whole - stuck)).astype(float),
        }


@pytest.mark.sample(6)
@pytest.mark.parametrize("nu", [0.0, 0.3, 0.5])
@pytest.mark.parametrize("t", [1e-15, 1e-9, 1e-3, 0.05, 0.3, 0.49, 0.51, 0.8, 1 - 1e-6])
def test_sixty_digits(t: float, nu: float) -> None:
    hertz, true = smoothed(nu=nu), exact(t, nu)
    Q, a = t * hertz.largest_force, hertz.contact_radius
    tolerance = 1e-14 + 1e-16 / (1 - t)
    assert hertz.energy_scale == pytest.approx(true["energy_scale"], rel=1e-14)
    for name in ("displacement", "stick_radius", "energy"):
        assert getattr(hertz, name)(Q) == pytest.approx(true[name], rel=tolerance), name
    assert hertz.displacement(-Q) == -hertz.displacement(Q)
    moved, half = true["displacement"], exact(t / 2, nu)["displacement"]
    back = hertz.branch([Q, 0.0, -Q], Q)
    assert_allclose(back, [moved, moved - 2 * half, -moved], rtol=0, atol=3 * tolerance * moved)
    assert_allclose(hertz.branch([-Q, 0.0, Q], -Q), -back, rtol=0)
    assert_allclose(hertz.traction(PARTS * a, Q), true["traction"], rtol=1e-13)
    assert_allclose(hertz.traction(PARTS * a, -Q), -hertz.traction(PARTS * a, Q))


@pytest.mark.parametrize("radii", [(1.0, 1.001), (2.0, 0.7), (0.1, 4.0), (1.0, 1e6)])
def test_semi_axes_and_approach_by_legendres_integrals(radii: tuple[float, float]) -> None:
    """Johnson (3.26), with a the longer axis and e^2 = 1 - b^2/a^2."""
    hertz = smoothed(radii)
    a, b = sorted(hertz.semi_axes, reverse=True)
    assert (hertz.semi_axes[0] > hertz.semi_axes[1]) == (radii[0] > radii[1])
    m = 1 - (b / a) ** 2
    size = hertz.peak_pressure / 3.0 * b / (m * a**2)  # p0 / E* and so on
    flatter, sharper = max(radii), min(radii)
    rel = 1e-9 if m < 0.01 else 1e-12  # K - E cancels near a sphere
    assert size * (ellipk(m) - ellipe(m)) == pytest.approx(1 / (2 * flatter), rel=rel)
    across = size * ((a / b) ** 2 * ellipe(m) - ellipk(m))
    assert across == pytest.approx(1 / (2 * sharper), rel=rel)
    assert hertz.approach == pytest.approx(hertz.peak_pressure / 3.0 * b * ellipk(m), rel=1e-12)
    assert hertz.peak_pressure * 2 / 3 * np.pi * a * b == pytest.approx(2e-6, rel=1e-14)
    sphere = 4.0 * np.sqrt(np.sqrt(flatter * sharper)) * hertz.approach**1.5  # of the mean radius
    assert ellipse.load_ratio(flatter / sharper) == pytest.approx(2e-6 / sphere, rel=1e-8)


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9])
def test_loss_is_eight_times_the_error_of_the_trapezoid(share: float) -> None:
    """W = 8 c_t f^2 {V(P) - V(L) - (P - L) (D0(P) + D0(L)) / 2}, L = P - Q / f, V' = D0."""
    load, radii, nu = 4e-6, (1.0, 3.0), 0.2
    hertz, left = smoothed(radii, load, nu), (1 - share) * load
    area = quad(lambda P: smoothed(radii, P).approach, left, load, epsabs=0, epsrel=1e-12)[0]
    trapezoid = (load - left) * (hertz.approach + smoothed(radii, left).approach) / 2
    loss = 8 * (2 - nu) / (2 * (1 - nu)) * FRICTION**2 * (area - trapezoid)
    assert hertz.energy(share * hertz.largest_force) == pytest.approx(loss, rel=1e-6)
    stick = hertz.stick_radius(share * hertz.largest_force) / hertz.contact_radius
    assert stick == pytest.approx(np.cbrt(1 - share), rel=1e-14)


@pytest.mark.parametrize(("base", "name"), [(np.inf, "a flat"), ((np.inf, 1.0), "a cylinder")])
def test_bases_without_a_smooth_reference_say_so(base: Any, name: str) -> None:
    scene = cr.Scene(base, ALONE, MATERIAL, friction=0.5, geometry="summit")
    assert smooth_reference(scene, 1.0) is None
    with pytest.raises(cr.InputError, match=f"scene: found {name}, expected a sphere or an"):
        cr.smooth(scene, load=1.0)
    cycle = cr.cycle(cr.press(scene, load=1e-6), maximum=1e-7)
    assert cycle.loss > 0
    assert np.isnan([cycle.loss_normalised, cycle.smooth_normalised]).all()


A, PEAK, G = 0.7, 2.0, 3.0


def cerruti(r: float, angle: float, nu: float, a: float, q0: float) -> float:
    """Both surfaces' displacement along x at (r, angle), from q0 sqrt(1 - r^2/a^2) on a disc.

    Lines through the point are chords; the integral of the traction along one is that of a circle.
    """
    half = np.arcsin(min(a / r, 1.0)) if r > 0 else np.pi / 2  # directions that meet the disc

    def along_a_line(w: float) -> float:
        line = q0 * np.pi * max(a**2 - (r * np.sin(w)) ** 2, 0.0) / (2 * a)
        return float(line * (1 - nu + nu * np.cos(angle + w) ** 2) / (np.pi * G))

    return float(quad(along_a_line, -half, half, epsabs=0, epsrel=1e-10)[0])


@pytest.mark.sample(6)
@pytest.mark.parametrize("nu", [0.0, 0.3, 0.5])
@pytest.mark.parametrize("ratio", [0.0, 0.3, 0.6, 0.95, 1.05, 1.5, 4.0, 30.0])
def test_displacement_is_cerrutis_integral(ratio: float, nu: float) -> None:
    """Where all slides, and where all within 0.84 of the radius sticks."""
    r, c = ratio * A, A * (1 - 0.4) ** (1 / 3)
    for angle in (0.0, 0.7, np.pi / 2, 2.5):
        x, y = r * np.cos(angle), r * np.sin(angle)
        whole, stuck = cerruti(r, angle, nu, A, PEAK), cerruti(r, angle, nu, c, PEAK * c / A)
        for share, true, rel in ((1.0, whole, 1e-6), (0.4, whole - stuck, 3e-6)):
            moved = surface_shear.surface_displacement(x, y, A, share, PEAK, G, nu)
            assert moved == pytest.approx(true, rel=rel)


@pytest.mark.sample(4)
@pytest.mark.parametrize("fraction", [0.01, 0.5, -0.5, 0.95, 1.0])
@pytest.mark.parametrize("name", ["paper", "rough, closest", "steel"])
def test_fields_of_each_asperity_integrate_to_its_forces(name: str, fraction: float) -> None:
    """Tractions to forces, pressures to loads; outside the discs is no pressure."""
    contact = pressed(name)
    state = cr.shear(contact, force=fraction * 0.5 * contact.load)
    touching = contact.loads > 0
    centres, a = contact.scene.contact_points[touching], contact.contact_radii[touching]
    c = state.stick_radii[touching]
    nodes, weights = np.polynomial.legendre.leggauss(24)
    phi, weights = np.pi / 4 * np.array([nodes + 1, weights])[:, :, None]
    forces, loads = np.zeros((2, len(a)))
    for inner, outer in ((0 * c, c), (c, a)):  # r^2 = outer^2 - (outer^2 - inner^2) cos^2(phi)
        squared = outer**2 - inner**2
        r = np.sqrt(outer**2 - squared * np.cos(phi) ** 2)
        points, rings = centres + r[..., None] * [0.6, 0.8], np.pi * squared * np.sin(2 * phi)
        forces += (weights * rings * fields.traction(state, points)).sum(axis=0)
        loads += (weights * rings * fields.pressure(contact, points)).sum(axis=0)
    assert_allclose(forces, state.forces[touching], rtol=1e-7)
    assert_allclose(loads, contact.loads[touching], rtol=1e-7)
    assert forces.sum() == pytest.approx(state.force, rel=1e-7)
    for radius, inside in (((1 - 1e-6) * a, True), ((1 + 1e-6) * a, False)):
        rim = centres + radius[:, None] * [0.6, 0.8]
        assert ((fields.pressure(contact, rim) > 0) == inside).all()
    assert not fields.pressure(contact, contact.scene.contact_points[~touching]).any()


@pytest.mark.parametrize("distance", [1.2, 2.0, 7.0])
def test_displacement_outside_is_boussinesqs_integral(distance: float) -> None:
    modulus, radius = 3.0, 0.7
    a = float(hertz.contact_radius(2e-5, modulus, radius))
    r, peak = distance * a, float(hertz.peak_pressure(a, modulus, radius))

    def by_ring(s: float) -> float:  # at a distance s from the axis
        line = 4 * s / (r + s) * ellipk(4 * r * s / (r + s) ** 2)
        return float(hertz.pressure(s, a, peak) * line / (np.pi * modulus))

    integral = quad(by_ring, 0, a, epsabs=0, epsrel=1e-10)[0]
    assert hertz.surface_displacement(r, a, radius) == pytest.approx(integral, rel=1e-9)
    rim = hertz.surface_displacement(a * np.array([1 - 1e-9, 1 + 1e-9]), a, radius)
    assert rim[0] == pytest.approx(rim[1], rel=1e-8)  # inside it is the shape of the sphere
