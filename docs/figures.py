"""The figures of the pages, drawn again:  python docs/figures.py

Those of performance.md show what was measured, so `convexrough bench --page docs/performance.md`
draws them with its tables.
"""

from collections.abc import Callable
from functools import cache, partial
from pathlib import Path
from runpy import run_path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Patch

from convexrough import press, shear
from convexrough.paper import example
from convexrough.paper.example import PaperStates
from convexrough.paper.figures import paper_figures

FOLDER = Path(__file__).parent / "figures"
EXAMPLES = Path(__file__).parents[1] / "examples"

#: Of the paper's example: names of files, and what its figures are called. The first is also at the
#: top of the README.
PAPER = {"pressure": "fig3_pressure"} | {
    name: name
    for name in ("fig4_rings", "fig5_traction", "fig6_section", "fig7_asperities", "fig8_loops",
                 "fig9_energy")
}  # fmt: skip


def once_differentiable() -> Figure:
    """Load, slope and curvature of a sphere that makes contact: of theory/gradients.md."""
    figure = Figure(figsize=(7.0, 2.4), layout="constrained")
    delta = np.linspace(-1.0, 1.0, 801)
    pressed = np.maximum(delta, 0.0)
    bent = np.full_like(delta, 0.0)
    bent[delta > 0] = 0.75 / np.sqrt(delta[delta > 0])
    rows = (("load $P$", pressed**1.5), ("slope $c$", 1.5 * np.sqrt(pressed)), ("curvature", bent))
    for axes, (name, values) in zip(figure.subplots(1, 3), rows, strict=True):
        axes.plot(delta, values, color="0.1", lw=1.4)
        axes.axvline(0.0, color="0.7", lw=0.8)
        axes.set(title=name, xlabel="gap  $<$  0  $<$  indentation", ylim=(-0.08, 3.0))
        axes.set(xticks=[0.0], yticks=[0.0, 1.0, 2.0, 3.0])
    for axes, top in zip(figure.axes, (1.1, 1.7, 6.0), strict=True):
        axes.set(ylim=(-0.05 * top, top), yticks=[0.0, round(top / 2)] if top > 2 else [0.0, 1.0])
    return figure


def stick_zone() -> Figure:
    """Two pressings and the sheared contact that is their difference: of theory/states.md."""
    contact = press(example.scene(), approach=example.APPROACH)
    scene, load = contact.scene, contact.load
    assert scene.friction is not None
    share = 0.7
    smaller = press(scene, load=(1 - share) * load)
    stick = shear(contact, force=share * scene.friction * load).stick_radii
    unit = float(np.abs(scene.contact_points).max())
    points = scene.contact_points / unit
    figure = Figure(figsize=(7.0, 2.75), layout="constrained")
    titles = ("pressed with $P$", f"pressed with $L = {1 - share:.1f}\\,P$",
              f"sheared with $Q = {share:.1f}\\,f P$")  # fmt: skip
    layers = (
        ((contact.contact_radii, "#7f9cb8"),),
        ((smaller.contact_radii, "#b9d0e5"),),
        ((contact.contact_radii, "#e0842a"), (stick, "#b9d0e5")),
    )
    for axes, title, discs in zip(figure.subplots(1, 3, sharey=True), titles, layers, strict=True):
        axes.plot(*points[contact.loads == 0].T, ".", color="0.6", ms=2)
        for radii, colour in discs:
            for point, radius in zip(points, radii / unit, strict=True):
                axes.add_patch(Circle(tuple(point), radius, color=colour, lw=0))
        axes.set(title=title, aspect="equal", xlim=(-1.1, 1.1), ylim=(-1.1, 1.1))
        axes.set(xticks=[], yticks=[])
    slides = (contact.loads > 0) & (stick == 0)
    for point, radius in zip(points[slides], contact.contact_radii[slides] / unit, strict=True):
        figure.axes[2].add_patch(Circle(tuple(point), radius, color="#701c05", lw=0))
    figure.axes[1].plot(*points[slides].T, ".", color="0.6", ms=2)
    keys = {"touches": "#7f9cb8", "stick disc": "#b9d0e5", "slip": "#e0842a", "slides": "#701c05"}
    handles = [Patch(color=colour, label=name) for name, colour in keys.items()]
    figure.legend(handles=handles, loc="outside lower center", ncols=4, frameon=False)
    return figure


def drawings() -> dict[str, Callable[[Path], object]]:
    """What draws each file, by its name: given the path to write."""
    pressed = press(example.scene(), approach=example.APPROACH)
    paper = cache(lambda: paper_figures(PaperStates(pressed)))
    design = cache(lambda: run_path(str(EXAMPLES / "design_a_damper.py"))["draw"])
    return {f"{name}.png": partial(_save, paper, stem) for name, stem in PAPER.items()} | {
        "once-differentiable.png": lambda path: once_differentiable().savefig(path, dpi=150),
        "stick-zone.png": lambda path: stick_zone().savefig(path, dpi=150),
        "design.png": lambda path: design()(str(path)),
        "design-fine.png": lambda path: design()(str(path), 4),
    }


def _save(figures: Callable[[], dict[str, Figure]], stem: str, path: Path) -> None:
    figures()[stem].savefig(path, dpi=150)


if __name__ == "__main__":
    for name, draw in drawings().items():
        draw(FOLDER / name)
        print(FOLDER / name)
