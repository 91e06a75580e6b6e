"""Fit tip radius and spacing to a curve of load against approach.

Suppose the load was measured at twelve approaches. The asperities are known to be on a hexagonal
lattice, but neither their tip radius nor their spacing is known. A least-squares fit needs the
derivatives of each load with respect to both parameters. One gradient per point of the curve gives
them; finite differences would need three solutions per point. The same derivatives give the
accuracy of the fit. The two parameters are strongly correlated, because sharper tips at a smaller
spacing carry nearly the same load.

Rings of asperities make contact one after the other. So the sum of squares has local minima, and
from some starting values the fit ends in one of them. A large residual shows such a failure.

    python examples/calibrate_asperities.py
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

import convexrough as cr

Array = NDArray[np.float64]
Pair = tuple[str, float, float]  # name, computed value, reference value

TIP, SPACING = 0.02, 0.0025  # the values to be found
APPROACHES = np.linspace(1e-5, 5e-5, 12)
NOISE = 1e-3  # relative, of each load


def curve(parameters: Array) -> tuple[Array, Array]:
    """The logarithm of the load at each approach, and its derivatives.

    parameters : logarithms of tip radius and spacing, by which the derivatives are taken. Each
        derivative is a sum over the asperities, because all of them change together.
    """
    tip, spacing = np.exp(parameters)
    asperities = cr.Asperities.hexagonal(spacing=SPACING, tip_radius=tip, within=0.0125)
    stretched = cr.Asperities(asperities.positions * (spacing / SPACING), asperities.tip_radii)
    scene = cr.Scene(1.0, stretched, cr.Material(1.0, 0.3), geometry="summit")
    loads, slopes = [], []
    for approach in APPROACHES:
        gradient = cr.press(scene, approach=approach).gradient(load=1.0)
        by_tip = gradient.tip_radii @ scene.asperities.tip_radii
        by_spacing = (gradient.positions * scene.asperities.positions).sum()
        loads.append(gradient.value)
        slopes.append([by_tip / gradient.value, by_spacing / gradient.value])
    return np.log(loads), np.array(slopes)


def calibrate(measured: Array, start: Array) -> tuple[Array, Array]:
    """Fitted log tip radius and log spacing, and their covariance for a relative noise of 1."""
    kept: dict[bytes, tuple[Array, Array]] = {}  # loads and their derivatives

    def both(parameters: Array) -> tuple[Array, Array]:
        if (key := parameters.tobytes()) not in kept:
            kept[key] = curve(parameters)
        return kept[key]

    def missed(parameters: Array) -> Array:
        return both(parameters)[0] - measured

    def slopes(parameters: Array) -> Array:
        return both(parameters)[1]

    found: Array = least_squares(missed, start, jac=slopes, xtol=1e-14, ftol=1e-14, gtol=1e-14).x
    information = slopes(found).T @ slopes(found)
    return found, np.asarray(np.linalg.inv(information), dtype=np.float64)


def compare() -> list[Pair]:
    """Fit exact loads, then noisy ones: the errors agree with what the derivatives predict."""
    true = np.log([TIP, SPACING])
    exact, _ = curve(true)
    found, covariance = calibrate(exact, true + np.log([0.5, 1.3]))
    spread = np.sqrt(np.diag(covariance))
    correlation = covariance[0, 1] / spread.prod()
    noisy = exact + NOISE * np.random.default_rng(0).normal(size=len(exact))
    near, _ = calibrate(noisy, found)
    errors = np.abs(near - true) / (NOISE * spread)
    return [
        ("tip radius", float(np.exp(found[0])), TIP),
        ("spacing", float(np.exp(found[1])), SPACING),
        ("noisy: within three standard deviations", float((errors < 3.0).all()), 1.0),
        ("strongly correlated", float(abs(correlation) > 0.9), 1.0),
    ]


def main() -> None:
    true = np.log([TIP, SPACING])
    measured = curve(true)[0] + NOISE * np.random.default_rng(0).normal(size=len(APPROACHES))
    found, covariance = calibrate(measured, true + np.log([0.5, 1.3]))
    spread = np.sqrt(np.diag(covariance))
    for name, value, deviation in zip(("tip radius", "spacing"), found, spread, strict=True):
        print(f"{name:12}{np.exp(value):12.6g}  standard error {NOISE * deviation:.2%}")
    print(f"correlation {covariance[0, 1] / spread.prod():12.3f}")
    for name, computed, reference in compare():
        print(f"{name:32}{computed:16.9g}{reference:16.9g}")


if __name__ == "__main__":
    main()
