"""The gallery as a folder: index.md, index.json, and the files of each case."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

from convexrough import gallery
from convexrough.atomic import to_json
from convexrough.gallery.pack import packed
from convexrough.progress import LOGGER
from convexrough.tabular.columns import markdown
from convexrough.version import __version__

HEADING = ["case", "what is hard", "files", "asperities", "touching", "variables", "condition"]
HEADING += ["spread", "proved"]

INTRODUCTION = """# Hard contact problems, with answers

Each row is a contact of a sphere with asperities, written as programs for solvers. The first
variables of a program, times `force_unit`, are the loads of the asperities that `index.json` lists.
`index.json` also has the scenes, the answers to 50 digits, and the reason for each missing program.

- `.cones.json`: `clarabel.load_from_file`; the contact law itself, no approximation
- `.cbf`: the same with a linear objective, for readers of the Conic Benchmark Format
- `.bristles.npz`: `qpsolvers.Problem.load`; the error of its loads is about `load_error_estimate`
  of the largest

condition: condition number of the Hessian at the answer, scaled to a diagonal of 1. spread:
smallest load / largest load. proved: scope of the proof that the answer is the only solution.
"""


def exported(names: Iterable[str]) -> Iterator[tuple[str, bytes]]:
    """Pairs of the name and contents of each file of these cases; last index.md and index.json."""
    index: dict[str, Any] = {}
    for name in names:
        LOGGER.info(name)
        about, files = packed(gallery.case(name))
        yield from files.items()
        index[name] = about
    document = {"schema": 1, "version": __version__, "cases": index}
    table = [HEADING, *(_row(name, about) for name, about in index.items())]
    yield "index.md", "\n".join([INTRODUCTION, *markdown(table, left=3), ""]).encode()
    yield "index.json", f"{to_json(document)}\n".encode()


def _row(name: str, about: dict[str, Any]) -> list[str]:
    programs = about["programs"]
    condition = about["condition"]
    variables = dict.fromkeys(str(each["variables"]) for each in programs.values())
    return [
        name,
        about["why"],
        ", ".join(file.removeprefix(f"{name}.") for file in programs) or "none",
        str(about["asperities"]),
        str(about["touching"]),
        ", ".join(variables) or "-",
        "not convex" if condition is None else f"{condition:.3g}",
        f"{about['spread']:.1g}",
        about["certificate"]["scope"],
    ]
