"""Quantities with units, and files as journals want them."""

import re
from pathlib import Path

from matplotlib.figure import Figure

from convexrough import plots


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
