"""The gallery as a folder: index.md, index.json, and the optimisation programs of each case."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np

from convexrough.atomic import to_json
from convexrough.errors import ConvexroughError
from convexrough.gallery.cases import HardCase, case, stored
from convexrough.normal.certificate import certify
from convexrough.normal.problem import NormalProblem
from convexrough.programs.formats import sizes
from convexrough.programs.program import WRITERS, Form, scaled_eigenvalues, stated
from convexrough.progress import LOGGER
from convexrough.tabular.columns import markdown
from convexrough.version import __version__

#: Number of bristles (springs) of each asperity; its smallest value; the number of variables above
#: which fewer bristles are used; and the largest number of asperities of a cone program that is
#: also written as CBF. These heuristics keep files small.
BRISTLES, FEWEST_BRISTLES, VARIABLES, SMALL = 64, 8, 520, 20

HEADING = ["case", "what is hard", "files", "asperities", "touching", "variables", "condition"]
HEADING += ["spread", "proved"]

INTRODUCTION = """# Hard contact problems, with answers

Each row is a contact of a sphere with asperities, written as programs for solvers. The first
variables of a program, times `force_unit`, are the loads of the asperities that `index.json` lists.
`index.json` also has the scenes, the answers to 50 digits, and the reason for each missing program.

- `.cones.json`: read by `clarabel.load_from_file`; the contact law without approximation
- `.cbf`: the same with a linear objective, for readers of the Conic Benchmark Format
- `.bristles.npz`: read by `qpsolvers.Problem.load`; an approximation, the error of whose loads is
  about `load_error_estimate` of the largest load

condition: condition number of the Hessian at the answer, scaled to a diagonal of 1. spread:
smallest load / largest load, of the asperities that touch. proved: the answer is proved to be the
only solution (global), the only one nearby (local), or neither (none).
"""


#: What the index contains of a stored case, in this order.
SCENE = ("sphere_radius", "contact_modulus", "poisson_ratio", "friction", "geometry", "positions",
         "tip_radii", "heights")  # fmt: skip

#: The entry of a case in the index.
About = dict[str, Any]


def exported(names: Iterable[str]) -> Iterator[tuple[str, bytes]]:
    """Pairs of the name and contents of each file of these cases; last index.md and index.json."""
    index: dict[str, About] = {}
    for name in names:
        LOGGER.info(name)
        index[name], files = _packed(case(name))
        yield from files.items()
    document = {"schema": 1, "version": __version__, "cases": index}
    table = [HEADING, *(_row(name, about) for name, about in index.items())]
    yield "index.md", "\n".join([INTRODUCTION, *markdown(table, left=3), ""]).encode()
    yield "index.json", f"{to_json(document)}\n".encode()


def _packed(case: HardCase) -> tuple[About, dict[str, bytes]]:
    """The entry of a case in the index, with reasons for missing programs; its files by name."""
    problem = NormalProblem.assemble(case.scene, **case.control, influence="dense")
    loads = np.array([float(digits) for digits in case.loads])
    own = loads[problem.candidates] / problem.units.force
    proof, data = certify(case.scene, loads, **case.control), stored()[case.name]
    low, high = scaled_eigenvalues(problem, own)[[0, -1]]
    answer = {name: data["answer"][name] for name in ("approach", "load", "loads", "gaps")}
    answer |= {"shear_force": case.shear_force, "shear_forces": list(case.forces)}
    answer |= {"slips": list(case.slips), "displacement": case.displacement}
    about: About = {
        "family": case.family,
        "why": case.why,
        "scene": {name: data[name] for name in SCENE},
        "prescribed": case.control,
        "asperities": len(problem.scene),
        "touching": int(np.count_nonzero(own)),
        "condition": float(high / low) if low > 0 else None,
        "spread": float(own[own > 0].min() / own.max()),
        "certificate": {
            "scope": proof.scope,
            "convexity_number": proof.convexity_number,
            "load_error": float(proof.load_errors.max()),
            "undecided": np.flatnonzero(proof.status == "undecided").tolist(),
        },
        "answer": answer,
        "programs": {},
        "left_out": {},
    }
    bristles = int(np.clip(VARIABLES // len(problem) - 1, FEWEST_BRISTLES, BRISTLES))
    files: dict[str, bytes] = {}
    kinds: dict[Form, list[str]] = {"cones": ["json"], "bristles": ["npz"]}
    for form, endings in kinds.items():
        try:
            program = stated(problem, own, form, bristles)
        except ConvexroughError as error:
            about["left_out"][form] = str(error)
            continue
        if form == "cones" and len(program.asperities) <= SMALL:
            endings.append("cbf")
        for ending in endings:
            name = f"{case.name}.{ending if ending == 'cbf' else f'{form}.{ending}'}"
            files[name] = WRITERS[form][ending](program.data)
            about["programs"][name] = program.about() | sizes(ending, files[name])
    return about, files


def _row(name: str, about: About) -> list[str]:
    programs, condition = about["programs"], about["condition"]
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
