"""The figures of the pages, drawn again:  python docs/figures.py

Those of performance.md show what was measured, so `convexrough bench --page docs/performance.md`
draws them with its tables.
"""

from pathlib import Path
from runpy import run_path

import numpy as np
from matplotlib.figure import Figure

from convexrough.paper import example
from convexrough.paper.figures import paper_figures

FOLDER = Path(__file__).parent / "figures"
EXAMPLES = Path(__file__).parents[1] / "examples"


def once_differentiable() -> Figure:
    """Load, slope and curvature of a sphere that makes contact: of theory/why-gradients-...md."""
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


def main() -> None:
    figures = paper_figures(example.findings().contact)
    figures["pressure"] = figures.pop("fig3_pressure")  # also at the top of the README
    figures["once-differentiable"] = once_differentiable()
    for name, figure in figures.items():
        path = FOLDER / f"{name}.png"
        figure.savefig(path, dpi=150)
        print(path)
    example_of_design = run_path(str(EXAMPLES / "design_a_damper.py"))
    example_of_design["draw"](str(FOLDER / "design.png"))
    example_of_design["draw"](str(FOLDER / "design-fine.png"), 4)


if __name__ == "__main__":
    main()
