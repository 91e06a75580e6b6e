"""`write_programs`: all programs of a scene in one folder, with an index."""

from __future__ import annotations

import json
from collections.abc import Collection
from pathlib import Path
from typing import Any

from convexrough.atomic import replacing
from convexrough.errors import ConvexroughError, InputError
from convexrough.programs.program import FORMS, WRITERS, solved, stated
from convexrough.scene.scene import Scene
from convexrough.version import __version__

#: File endings, with the contents and the programs that read them.
FORMATS = {
    "cbf": "cones and their dual in the Conic Benchmark Format: MOSEK, PICOS, SCIP-SDP, ...",
    "json": "the same for clarabel.load_from_file",
    "mps": "rows of bristles, QUADOBJ: HiGHS (which has no second-order cones), Gurobi, CPLEX, ...",
    "npz": "all: sparse matrices of the cones; bristles for qpsolvers.Problem.load, dense",
}


def write_programs(
    folder: Path,
    name: str,
    scene: Scene,
    *,
    approach: float | None = None,
    load: float | None = None,
    formats: Collection[str] = tuple(FORMATS),
    bristles: int = 64,
) -> tuple[list[Path], dict[str, Any]]:
    """Write NAME.FORM.ENDING for each form and format, then index.json; return paths and index.

    approach, load : [length], [force] the prescribed quantity, exactly one of the two
    formats        : some of `FORMATS`
    bristles       : number of bristles per asperity

    A program that would not be equivalent to the contact law is left out; the index says why.
    Raises InputError, with the last reason, if no program remains, and FileError.
    """
    problem, own = solved(scene, approach, load)
    about: dict[str, Any] = {}
    left_out: dict[str, str] = {}
    written: list[Path] = []
    for form in FORMS:
        endings = [ending for ending in WRITERS[form] if ending in formats]
        try:
            program = stated(problem, own, form, bristles) if endings else None
        except ConvexroughError as error:
            left_out[form] = str(error)
            continue
        for ending in endings:
            assert program is not None
            path = folder / f"{name}.{form}.{ending}"
            try:
                program.save(path)
            except InputError as error:
                left_out[path.name] = str(error)
                continue
            written.append(path)
            about[path.name] = program.about()
    if not written:
        last = [*left_out.values()][-1]
        expected = "a scene with a convex program: a smaller approach or load, or sharper tips"
        raise InputError("programs", found=last, expected=expected)
    index = {
        "schema": 1,
        "version": __version__,
        "prescribed": {"approach": approach, "load": load},
        "asperities": len(scene),
        "programs": about,
        "left_out": left_out,
    }
    with replacing(path := folder / "index.json") as temporary:
        temporary.write_text(json.dumps(index, indent=2) + "\n", encoding="utf-8")
    return [*written, path], index
