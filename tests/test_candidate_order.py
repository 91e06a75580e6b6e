"""Results do not depend on the order in which a problem holds the asperities."""

from collections.abc import Iterator
from dataclasses import fields, replace
from typing import Any, Literal

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scenes import hexagonal

import convexrough as cr
from convexrough.contact import levels_of
from convexrough.scene import layout


def results(geometry: Literal["summit", "closest"]) -> Iterator[Any]:
    """One result of each kind, of an array of which all asperities could touch."""
    scene = replace(hexagonal(height_std=2e-7, seed=1), friction=0.5, geometry=geometry)
    contact = cr.press(scene, approach=5.5e-5)
    load, force, n = contact.load, 0.2 * contact.load, len(scene)
    weights = np.arange(n) - 0.4 * n
    assert contact.candidates == n
    yield contact
    yield contact.certificate
    yield cr.onset_of_sliding(contact)
    yield cr.onset_gradient(contact, int(np.argmin(np.where(contact.loads > 0, contact.loads, 9))))
    yield contact.gradient(loads=weights)
    yield contact.gradient(gaps=weights)
    state = cr.shear(contact, force=force)
    yield state
    yield state.gradient(forces=weights, slips=weights)
    cycle = cr.cycle(contact, maximum=force)
    yield cycle
    yield cycle.loop(20)
    yield cycle.gradient()
    yield cr.fretting(cycle)
    yield cr.certify_shear(contact, state.forces * (1 + 1e-9), force=force)
    yield cr.shear_vector(contact, force=force)
    for kind in ("exact", "elastic"):
        amplitudes = [0.05 * load, -0.05 * load]
        yield cr.shakedown(scene, load=load, force_amplitudes=amplitudes, kind=kind)
    path: dict[str, Any] = dict(loads=[load, 0.8 * load], forces=[0.0, 0.15 * load])
    yield cr.load_path(scene, **path)
    yield cr.load_path(scene, general_steps=2, **path)
    yield cr.steady(scene, loads=[load, 0.8 * load], forces=[0.1 * load, -0.1 * load])


@pytest.mark.parametrize("geometry", ["summit", "closest"])
def test_results_do_not_depend_on_the_order_of_candidates(monkeypatch: Any, geometry: Any) -> None:
    usual = list(results(geometry))
    monkeypatch.setattr(layout, "MANY", 0)  # as on large lattices, whose points have another order
    other = list(results(geometry))
    order = levels_of(other[0]).problem.candidates
    assert (np.diff(order) < 0).any()
    for one, two in zip(usual, other, strict=True):
        if isinstance(one, np.ndarray):
            assert_allclose(one, two, rtol=1e-9)
            continue
        for name in (each.name for each in fields(one)):
            left, right = getattr(one, name), getattr(two, name)
            if isinstance(left, np.ndarray) and "err" not in name:
                if left.dtype.kind != "f":
                    assert (left == right).all(), (type(one), name)
                    continue
                largest = np.abs(left[np.isfinite(left)]).max(initial=0.0)
                assert_allclose(left, right, rtol=0, atol=1e-9 * largest, err_msg=name)
