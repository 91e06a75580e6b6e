"""The gallery as a folder: an index for people and for programs, and the programs of each case."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from convexrough import gallery
from convexrough.gallery.pack import packed
from convexrough.progress import Announce
from convexrough.run.columns import markdown
from convexrough.run.results import beside, write_tables
from convexrough.run.summary import to_json
from convexrough.version import __version__

HEADING = ["case", "what is hard", "files", "asperities", "touching", "variables", "condition"]
HEADING += ["spread", "proved"]

INTRODUCTION = """# Hard contact problems, with answers

Each row is a contact of a sphere with asperities as programs for solvers. Loads are the first
variables times `force_unit`, of the asperities that `index.json` names; it has the scenes, the
answers to 50 digits, and why a program was left out.

- `.cones.json`: `clarabel.load_from_file`; the contact law itself, no approximation
- `.cbf`: the same with a linear objective, for readers of the Conic Benchmark Format
- `.bristles.npz`: `qpsolvers.Problem.load`; its loads are off by up to about `off` of the largest

condition: of the Hessian at the answer, scaled to a diagonal of 1. spread: smallest over largest
load. proved: how far the proof reaches that the answer is the only one.
"""


def write_gallery(folder: Path, names: Iterable[str], announce: Announce) -> list[Path]:
    """Write the programs of these cases, and last index.json and index.md; return the paths.

    Raises FileError; files already written stay.
    """
    write_tables(folder, {})  # begins the list of what was written
    index: dict[str, Any] = {}
    written = []
    for name in names:
        announce(name)
        about, files = packed(gallery.case(name))
        for file, content in files.items():
            with beside(path := folder / file) as temporary:
                temporary.write_bytes(content)
            written.append(path)
        index[name] = about
    document = {"schema": 1, "version": __version__, "cases": index}
    table = [HEADING, *(_row(name, about) for name, about in index.items())]
    page = "\n".join([INTRODUCTION, *markdown(table, left=3), ""])
    for file, text in (("index.md", page), ("index.json", to_json(document) + "\n")):
        with beside(path := folder / file) as temporary:
            temporary.write_text(text, encoding="utf-8")
        written.append(path)
    return written


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
