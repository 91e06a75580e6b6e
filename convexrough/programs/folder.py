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

#: File endings, with the contents and the software that reads them.
FORMATS = {
    "cbf": "the cone program and its dual in the Conic Benchmark Format: MOSEK, PICOS, ...",
    "json": "the same for clarabel.load_from_file",
    "mps": "the quadratic program of bristles: HiGHS (which has no cones), Gurobi, CPLEX, ...",
    "npz": "all programs: cones as sparse matrices, bristles for qpsolvers.Problem.load",
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
    """Write a file NAME.FORM.ENDING for each form and format, and index.json.

    Returned are the paths of all files, and the contents of the index.

    approach, load : [length], [force] the prescribed quantity, exactly one of the two
    formats        : some of `FORMATS`
    bristles       : number of bristles per asperity

    A program is left out if the solution is not in the box on which it is exact, or if a file would
    not fit in memory; the index gives the reason. Raises InputError, with the reason for the last
    one left out, if no program remains, and FileError if a file cannot be written.
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
