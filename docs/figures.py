"""The figures of the pages, drawn again:  python docs/figures.py

Those of performance.md are the work of `convexrough bench --page docs/performance.md`.
"""

from pathlib import Path

from convexrough.paper import example
from convexrough.paper.figures import paper_figures

FOLDER = Path(__file__).parent / "figures"


def main() -> None:
    figures = paper_figures(example.outcome().contact)
    figures["pressure"] = figures.pop("fig3_pressure")  # also at the top of the README
    for name, figure in figures.items():
        path = FOLDER / f"{name}.png"
        figure.savefig(path, dpi=150)
        print(path)


if __name__ == "__main__":
    main()
