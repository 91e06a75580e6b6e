"""Order that is proved when asked, and shares of a loss where the load varies."""

from fractions import Fraction

import numpy as np
import pytest
from levels_reference import SCENES
from scenes import NAMED

import convexrough as cr
from convexrough.friction import order
from convexrough.friction.curve import MemoryCurve
from convexrough.friction.levels import FrictionLevels
from convexrough.friction.loss import shared
from convexrough.friction.walk import follow


def test_order_is_proved_when_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither row sums nor the cheap search prove it here, so no loss is; asked once, all."""
    scene, approach = SCENES["dense"]

    def loss_error(contact: cr.Contact) -> float:
        return cr.cycle(contact, maximum=0.1 * contact.load).loss_error

    asked, unasked = (cr.press(scene, approach=approach) for _ in range(2))
    monkeypatch.setattr(order, "INVERTED", 0)
    monkeypatch.setattr(FrictionLevels.order, "__defaults__", (5,))
    assert np.isinf(loss_error(unasked))
    assert cr.prove_order(asked, most=5) == "proved for one step"
    assert cr.prove_order(asked) == "proved"
    assert loss_error(asked) < 1e-12 * cr.cycle(asked, maximum=0.1 * asked.load).loss


def test_shares_of_a_loss_where_the_load_varies() -> None:
    """Bounds by cells against the integral of the rate, by Gauss's rule, and against the whole."""
    scene, approach = NAMED["paper"]
    scene = cr.Scene(scene.sphere_radius, scene.asperities, scene.material, friction=0.5)
    largest = cr.press(scene, approach=approach).load
    found = cr.steady(
        scene, loads=[0.9 * largest, 0.5 * largest], forces=np.array([0.2, -0.2]) * largest
    )
    levels = found.contact.cached(FrictionLevels)
    start = MemoryCurve.pressed(0)
    points = [
        (Fraction(p), Fraction(q) * 2) for p, q in zip(found.loads, found.forces, strict=True)
    ]
    curves, _ = follow(start, [*points, points[0]])
    _, costs = follow(curves[-1], [*points[1:], points[0]])
    pieces = [piece for cost in costs for piece in cost if piece.slope * piece.sign != 1]
    nodes, weights = np.polynomial.legendre.leggauss(40)
    total = np.zeros(len(levels.candidates))
    k = levels.top.problem.coefficients
    for piece in pieces:
        for node, weight in zip((nodes + 1) / 2, weights / 2, strict=True):
            part = Fraction(float(node))
            high = levels.at(piece.load_before + part * (piece.load_after - piece.load_before))
            low = levels.at(piece.top + part * (piece.bottom - piece.top))
            N, n = (np.maximum(each.indentation.value, 0.0) for each in (high, low))
            law = (N / k) ** 1.5 - (n / k) ** 1.5 - 1.5 * np.sqrt(n / k) / k * (N - n)
            run = float(piece.top - piece.bottom) / levels.units.force
            total += float(1 - piece.sign * piece.slope) * weight * run * law * low.rates
    total *= float(levels.loss_unit.value)
    known = found.asperity_losses[levels.candidates]
    errors = found.asperity_loss_errors[levels.candidates]
    assert (np.abs(known - total) <= errors + 1e-6 * total.max()).all()
    assert np.abs(known - total).max() < 2e-3 * total.max()
    assert 0 < errors.max() < 0.1 * total.max()
    assert abs(known.sum() - found.loss) <= errors.sum()
    slip, slide = shared(levels, pieces, 4)  # wider cells: wider bounds, which hold, too
    assert (np.abs((slip + slide).value - total) <= (slip + slide).error + 1e-6 * total.max()).all()
