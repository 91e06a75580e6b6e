"""The slider page: what is in the file, and what a browser makes of it."""

import json
import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from playwright.sync_api import Page, sync_playwright

import convexrough as cr
from convexrough.paper import example
from convexrough.plots.slider import slider_html
from convexrough.run.stages.normal import NormalStage

NAMES = ("chromium", "chromium-browser", "google-chrome")
BROWSER = next((found for name in NAMES if (found := shutil.which(name))), None)

CONTACT = cr.press(example.scene(), approach=example.APPROACH)
LIMIT = 0.5 * CONTACT.load
SPHERE = cr.smooth(CONTACT.scene, load=CONTACT.load)


@pytest.fixture(scope="module")
def page() -> str:
    return slider_html(CONTACT, NormalStage(approach=CONTACT.approach).compute(CONTACT).lines())


def test_states_are_those_of_shear_and_cycle(page: str) -> None:
    """In the data that the page carries; it needs nothing else, and is small."""
    assert not re.search(r"https?:|\burl\(|\bimport\b|<link|<img|\bsrc=|fetch\(", page)
    assert len(page.encode()) < 200_000  # of 1 MB
    (found,) = re.findall(r'id="data">(.*?)</script>', page, re.S)
    data = json.loads(found)
    states, discs = data["states"], data["discs"]
    assert states["fraction"] == [round(k / 100, 2) for k in range(101)]
    touching = np.flatnonzero(CONTACT.loads)
    assert discs["index"] == touching.tolist()
    radii = CONTACT.contact_radii[touching]
    assert discs["radius"] == pytest.approx(radii / SPHERE.contact_radius, rel=1e-4)
    for k in (0, 7, 50, 83, 100):
        state = cr.shear(CONTACT, force=states["fraction"][k] * LIMIT)
        cycle = cr.cycle(CONTACT, maximum=states["fraction"][k] * LIMIT)
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


class Opened(NamedTuple):
    page: Page

    def text(self, name: str) -> str:
        return self.page.locator(f"#{name}").inner_text()

    def number(self, name: str) -> float:
        """As Python found it; what is shown has its powers of ten typeset."""
        return float(self.page.locator(f"#{name}").get_attribute("data-value") or "nan")

    def points(self, curve: str) -> np.ndarray[Any, Any]:
        pairs = self.page.locator(curve).get_attribute("points") or ""
        return np.array([pair.split(",") for pair in pairs.split()], dtype=float)


@pytest.fixture
def opened(page: str, tmp_path: Path) -> Iterator[Opened]:
    """The page, which follows asperity 36, asks for nothing, and complains of nothing."""
    file, asked, complaints = tmp_path / "slider.html", [], []
    file.write_text(page, encoding="utf-8")
    with sync_playwright() as player:
        browser = player.chromium.launch(executable_path=BROWSER, args=["--no-sandbox"])
        shown = browser.new_page(viewport={"width": 1400, "height": 900})
        shown.set_default_timeout(5000)
        shown.on("request", lambda request: asked.append(request.url))
        shown.on("console", lambda message: complaints.append(message.text))
        shown.on("pageerror", lambda error: complaints.append(str(error)))
        shown.goto(file.as_uri())
        options = shown.locator("#follow option").all_inner_texts()
        (label,) = [option for option in options if option.startswith("36:")]
        shown.locator("#follow").select_option(label=label)
        yield Opened(shown)
        browser.close()
    assert (asked, complaints) == ([file.as_uri()], [])


def near(values: Any) -> Any:
    """A point of a loop is v_k - 2 v_i, each of five digits: off by 3 x 5e-5 at most."""
    return pytest.approx(values, rel=0.0, abs=1.5e-4 * np.abs(values).max())


def assert_shown(shown: Opened, fraction: float, index: int = 36) -> None:
    """Every number in sight is Python's."""
    state = cr.shear(CONTACT, force=fraction * LIMIT)
    steady = cr.cycle(CONTACT, maximum=fraction * LIMIT)
    X0 = SPHERE.displacement(LIMIT)
    assert float(shown.text("fraction")) == fraction
    share = state.forces[index] / (0.5 * CONTACT.loads[index])
    for name, value in (
        *(("q", fraction * LIMIT), ("x", state.displacement), ("x_part", state.displacement / X0)),
        *(("w", steady.loss_normalised), ("w_smooth", steady.smooth_normalised)),
        *(("load", CONTACT.loads[index]), ("share", share)),
        ("moved", state.displacements[index] / X0),
    ):
        assert shown.number(name) == float(f"{value:.5g}"), name
    assert shown.number("x_error") >= steady.displacement_error
    slide = (state.status == "sliding").sum()
    assert shown.text("said").startswith(f"{slide} of 37 slide")
    assert shown.page.locator("#map circle.sliding").count() == slide
    status = {"partial": "partial slip"}.get(state.status[index], state.status[index])
    assert (shown.text("status"), shown.text("state")) == (CONTACT.status[index], status)
    stick = state.stick_radii[index] / CONTACT.contact_radii[index]
    assert shown.number("stick") == pytest.approx(stick, abs=5e-4)

    # The loops: every point of them is where the force is sheared back and forth to it.
    moved, share = shown.points("#whole .line").T
    past = cr.history(CONTACT, forces=LIMIT * share.clip(-fraction, fraction))
    assert moved == near(past.displacements / X0)
    own_moved, own_share = shown.points("#own .line").T
    assert own_share == near(past.asperity_forces[:, index] / (0.5 * CONTACT.loads[index]))
    assert own_moved == near(past.asperity_displacements[:, index] / X0)
    at = shown.page.locator("#whole .now").first.get_attribute("d")
    assert at == f"M{moved[0]:g} {share[0]:g}h0"


@pytest.mark.skipif(BROWSER is None, reason=f"no browser to open the page in: none of {NAMES}")
def test_the_keyboard_moves_the_force(opened: Opened) -> None:
    opened.page.keyboard.press("Tab")
    assert opened.page.evaluate("document.activeElement.id") == "force"
    assert_shown(opened, 0.5)
    for key, fraction in (("ArrowRight", 0.51), ("ArrowLeft", 0.5), ("PageDown", 0.4), ("End", 1)):
        opened.page.keyboard.press(key)
        assert_shown(opened, fraction)
    opened.page.keyboard.press("Home")
    assert opened.text("said") == "0 of 37 slide, 37 stick"
    said = opened.page.locator("#force").get_attribute("aria-valuetext")
    assert said == "Q/(fP) = 0: 0 of 37 slide, 37 stick"
