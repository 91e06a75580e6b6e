"""The normal map of friction, evaluated: states of one contact, many at once. Own units.

The unknown is eta, the displacement that each asperity must take up: its own deflection up to the
ceiling, and slip beyond. With increments u(eta) that add up to T the law is

    F(eta) = eta + A u(eta) - rise = 0        (docs/theory/shear.md, "Increments").
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from convexrough.arrays import Array, Indices
from convexrough.roundoff import ROUNDOFF
from convexrough.shearing.energy import TangentialEnergy


class States(NamedTuple):
    """Friction states at m total increments of the n touching asperities; own units.

    totals : (m,) T;  deflections : (m, n) eta;  increments : (m, n) u;  rises : (m,)
    slips  : (m, n) what eta exceeds the ceiling by, 0 where not sliding
    """

    totals: Array
    deflections: Array
    increments: Array
    rises: Array
    slips: Array

    def take(self, rows: slice | Indices) -> States:
        """Some of the states."""
        return States(*(field[rows] for field in self))


class Iterates(NamedTuple):
    """Newton's method at m states; `rises` is the best estimate, `defects` F = eta + A u - rise.

    residuals : (m,) the largest |F|
    """

    deflections: Array
    increments: Array
    coupling: Array
    slopes: Array
    defects: Array
    rises: Array
    energies: Array
    residuals: Array


def evaluate(energy: TangentialEnergy, eta: Array, totals: Array) -> Iterates:
    """Every number of m states, shifted to their totals."""
    eta, u, slopes = _shifted(energy, eta, totals)
    coupling = energy.couple(u)
    weight = slopes.sum(axis=1)
    rises = (slopes * (eta + coupling)).sum(axis=1) / np.where(weight > 0, weight, 1.0)
    # How far a sliding asperity slides does not matter: take what the rise leaves to it, if that
    # slides.
    left = rises[:, None] - coupling
    sign = np.sign(eta)
    eta = np.where(slopes > 0, eta, sign * np.maximum(sign * left, energy.ceilings))
    defects = eta - left
    energies = energy.energies(eta, u, coupling)
    residuals = np.abs(defects).max(axis=1)
    return Iterates(eta, u, coupling, slopes, defects, rises, energies, residuals)


def gradients(
    energy: TangentialEnergy, deflections: Array, coupling: Array, rises: Array | float
) -> Array:
    """Of the energy in the increments, less the multiplier of their sum."""
    found: Array = np.clip(deflections, -energy.ceilings, energy.ceilings) + coupling - rises
    return found


def slips(energy: TangentialEnergy, deflections: Array) -> Array:
    """What deflections have beyond the ceilings; 0 where not sliding."""
    beyond: Array = deflections - np.clip(deflections, -energy.ceilings, energy.ceilings)
    return beyond


def gross_sliding(energy: TangentialEnergy) -> tuple[Array, Array, float]:
    """eta, u and the rise at T = sum P, which the last asperity to slide fixes."""
    coupling = energy.couple(energy.loads)
    rise = float((energy.ceilings + coupling).max())
    return rise - coupling, energy.loads, rise


def elastic_deflections(energy: TangentialEnergy, totals: Array) -> Array:
    """(m, n) eta under the elastic shares of m totals."""
    return energy.deflections(np.minimum(totals[:, None] * energy.elastic, energy.loads))


def _shifted(energy: TangentialEnergy, eta: Array, totals: Array) -> tuple[Array, Array, Array]:
    """eta shifted so that the increments add up to T, with those and their slopes.

    Newton's method inside a bracket: the sum grows with the shift, from -sum P to sum P.
    """
    low = (-energy.ceilings - eta).min(axis=1)
    high = (energy.ceilings - eta).max(axis=1)
    shifts = np.zeros(len(totals))
    for _ in range(100):
        moved = eta + shifts[:, None]
        u, slopes = energy.respond(moved)
        excess = u.sum(axis=1) - totals
        low, high = np.where(excess < 0, shifts, low), np.where(excess > 0, shifts, high)
        slope = slopes.sum(axis=1)
        following = shifts - excess / np.where(slope > 0, slope, np.inf)
        outside = ~((following > low) & (following < high)) & (excess != 0)
        following = np.where(outside, (low + high) / 2, following)
        settled = np.abs(following - shifts) <= 1e-15 * np.abs(moved).max(axis=1)
        if (settled | (np.abs(excess) <= 2 * ROUNDOFF * totals)).all():
            break
        shifts = following
    return moved, u, slopes
