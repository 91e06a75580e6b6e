"""Quantities with units, and files as journals want them."""

import re
from pathlib import Path

import pytest
from matplotlib.figure import Figure

from convexrough import plots
from convexrough.plots.style import quantity


@pytest.mark.parametrize(
    ("value", "unit", "said"),
    [
        (4.12e-3, "mm", "4.12 µm"),
        (0.5, "N", "500 mN"),
        (591.0, "N/mm²", "591 MPa"),
        (4.82e-3, "N mm", "4.82 µJ"),
        (0.0, "mm", "0 mm"),
        (4.12e-5, "", r"$4.12\times 10^{-5}$"),
        (12.0, "$", r"12 \$"),
    ],
)
def test_quantities_are_written_one_way(value: float, unit: str, said: str) -> None:
    assert quantity(value, unit) == said


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
