"""The slider page: what is in the file."""

import re

import numpy as np
import pytest

import convexrough as cr
from convexrough.paper import example
from convexrough.plots import slider
from convexrough.run.results import slider_page
from convexrough.run.stages.normal import NormalResult, NormalStage


def pressed_result(contact: cr.Contact) -> NormalResult:
    return NormalStage(approach=contact.approach).compute(contact)


@pytest.fixture(scope="module")
def contact() -> cr.Contact:
    return cr.press(example.scene(), approach=example.APPROACH)


def test_the_file_needs_nothing_else_and_is_small(contact: cr.Contact) -> None:
    text = slider_page(pressed_result(contact))
    assert not re.search(r"https?:|\burl\(|\bimport\b|<link|<img|\bsrc=|fetch\(", text)
    assert len(text.encode()) < 200_000  # of 1 MB


def test_states_are_those_of_shear_and_cycle(contact: cr.Contact) -> None:
    said = pressed_result(contact).lines()
    data, limit = slider.slider_data(slider.Slides.of(contact), said), 0.5 * contact.load
    states, discs = data["states"], data["discs"]
    assert states["fraction"] == [round(k / 100, 2) for k in range(101)]
    a_H = cr.smooth(contact.scene, load=contact.load).contact_radius
    touching = np.flatnonzero(contact.loads)
    assert discs["index"] == touching.tolist()
    radii = contact.contact_radii[touching]
    assert discs["radius"] == pytest.approx(radii / a_H, rel=1e-4)
    for k in (0, 7, 50, 83, 100):
        state = cr.shear(contact, force=states["fraction"][k] * limit)
        cycle = cr.cycle(contact, maximum=states["fraction"][k] * limit)
        assert states["length"][k] == float(f"{state.displacement:.5g}")
        assert states["loss"][k] == float(f"{cycle.loss_normalised:.5g}")
        assert float(states["displacement_error"][k]) >= cycle.displacement_error
        assert states["sliding"][k] == (state.status == "sliding").sum()
        assert states["undecided"][k] == (state.status == "undecided").sum()
        texts = state.status[touching]
        codes = np.array(data["stick"][k])
        assert ((codes == 0) == (texts == "sliding")).all()
        assert ((codes == -1) == (texts == "undecided")).all()
        part = texts == "partial"
        stuck = state.stick_radii[touching] / radii
        assert codes[part] / 1000 == pytest.approx(stuck[part], abs=6e-4)
