"""Numbers that rest on an assumption that fails are not returned; mismatched data are refused."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scenes import MATERIAL

import convexrough as cr
from convexrough.bench.scenes import scene as bench_scene
from convexrough.friction.levels import FrictionLevels


def test_no_onset_where_an_indentation_falls() -> None:
    case = cr.gallery.case("losing-contact-after")
    contact = cr.press(replace(case.scene, friction=0.5), load=0.98 * case.control["load"])
    assert cr.prove_order(contact) == "fails"
    assert np.isnan(cr.onset_of_sliding(contact)).all()
    with pytest.raises(cr.ProofError, match="indentations may fall as the load rises"):
        cr.onset_gradient(contact, 0)


def test_gradients_of_losses_have_bounds_only_where_order_is_proved(monkeypatch: Any) -> None:
    contact = cr.press(bench_scene("scattered", 6.0), approach=5e-5)
    monkeypatch.setattr(FrictionLevels.order, "__defaults__", (0,))
    cycle = cr.cycle(contact, maximum=0.1 * contact.load)
    assert cycle.order == "proved for one step"
    gradient = cycle.gradient()
    assert np.isfinite(gradient.heights).all()
    assert gradient.value_error == np.inf
    assert np.isinf(gradient.height_errors[contact.loads > 0]).all()


def test_summits_of_a_map_stay_with_it(tmp_path: Path) -> None:
    surface = cr.surface.self_affine(0.8, 0.1, 32.0, seed=1)
    summits = surface.summits()
    rougher = summits.roughened(height_std=1e-3, seed=1)
    assert type(rougher) is cr.Asperities
    assert "positions" in repr(rougher)
    contact = cr.press(cr.Scene(1e4, summits, MATERIAL), load=10.0)
    with pytest.raises(cr.InputError, match="contact: found summits of another map"):
        cr.surface.press_whole(cr.surface.self_affine(0.8, 0.1, 32.0, seed=2), contact)
    for turned in (surface.heights[::-1], np.rot90(surface.heights), surface.heights.T):
        with pytest.raises(cr.InputError, match="contact: found summits of another map"):
            cr.surface.press_whole(cr.surface.Surface(turned, surface.pixel), contact)
    plain = cr.press(cr.Scene(1e4, rougher, MATERIAL), load=10.0)
    with pytest.raises(cr.InputError, match="contact: found asperities that are no summits of a"):
        cr.surface.press_whole(surface, plain)
    named = cr.surface.Surface(surface.heights, surface.pixel, "µm").summits()
    with pytest.raises(cr.InputError, match="units: found summits in µm, expected"):
        cr.Scene(1e4, named, MATERIAL, units=("mm", "N"))
    assert len(cr.Scene(1e4, named, MATERIAL, units=("um", "N"))) == len(named)
