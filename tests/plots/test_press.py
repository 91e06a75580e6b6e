"""The figures say what the contact says, and nothing in them collides."""

import dataclasses
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from figure_checks import fits
from matplotlib.figure import Figure
from numpy.testing import assert_allclose
from scenes import PAPER_APPROACH, hexagonal, on_sphere, paper, rough, steel

import convexrough as cr
from convexrough import fields, plots


def few(*points: tuple[float, float]) -> cr.Contact:
    return cr.press(on_sphere(points), approach=PAPER_APPROACH)


def dense(spacing: float) -> cr.Contact:
    return cr.press(hexagonal(spacing, tip_radius=8 * spacing, within=8.5e-3), load=4.5e-7)


CASES: dict[str, Callable[[], cr.Contact]] = {
    "one": lambda: few((0, 0)),
    "three": lambda: few((0, 0), (3e-3, 0), (-1e-3, 2.5e-3)),
    "paper": lambda: cr.press(paper(), approach=PAPER_APPROACH),
    "rough": lambda: cr.press(rough(), approach=PAPER_APPROACH),
    "steel": lambda: cr.press(steel(), approach=0.5e-6),
    "2200": lambda: dense(3e-4),
    "4000": lambda: dense(2.2e-4),
    "nothing": lambda: cr.press(paper(), approach=-1e-6),
}


@pytest.mark.sample(3)
@pytest.mark.parametrize("name", CASES)
def test_fit_to_print(name: str) -> None:
    contact = CASES[name]()
    scene = dataclasses.replace(contact.scene, units=("µm", "mN"))
    for figure in plots.press_figures(dataclasses.replace(contact, scene=scene)).values():
        fits(figure)
        for axes in figure.axes[:2] if contact.loads.any() else ():
            assert axes.get_xlabel()
            assert axes.get_ylabel()


def test_the_colours_and_the_profile_show_the_pressure() -> None:
    contact = CASES["rough"]()
    chart, profile, bar = plots.press_figures(contact)["pressure"].axes
    E, P = 1.0, contact.load
    p0 = (6 * P * E**2 / np.pi**3) ** (1 / 3)  # R = 1
    assert_allclose(bar.get_ylim(), (0, fields.peak_pressures(contact).max() / p0), rtol=1e-12)
    x, y = profile.collections[0].get_paths()[0].vertices.T  # type: ignore[union-attr]
    a_H = (3 * P / 4) ** (1 / 3)
    row = np.column_stack((x * a_H, np.zeros_like(x)))
    shown = y > 1e-3
    assert shown.sum() > 400
    assert_allclose(y[shown], fields.pressure(contact, row)[shown] / p0, rtol=1e-3)
    (smooth,) = profile.lines
    assert_allclose(np.hypot(*smooth.get_data()), 1, rtol=1e-12)
    assert chart.get_xlim() == profile.get_xlim()


def test_files_keep_their_text_and_pixels(tmp_path: Path) -> None:
    figure = Figure(figsize=(1, 1))
    figure.subplots().set_xlabel("load [mN]")
    for form in ("svg", "pdf", "png"):
        plots.save(figure, tmp_path / f"a.{form}", form, dpi=600)
    text = (tmp_path / "a.svg").read_text(encoding="utf-8")
    assert re.search(r"<text[^>]*>load \[mN\]</text>", text)
    assert (tmp_path / "a.pdf").read_bytes().startswith(b"%PDF")
    head = (tmp_path / "a.png").read_bytes()[16:24]
    assert (int.from_bytes(head[:4]), int.from_bytes(head[4:])) == (600, 600)
    before = text
    plots.save(figure, tmp_path / "a.svg", "svg")
    assert (tmp_path / "a.svg").read_text(encoding="utf-8") == before  # no date inside
