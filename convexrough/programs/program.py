"""The convex programs of a scene, as objects and as files in a folder with an index.

The forms are a cone program, its dual, and a quadratic program.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Collection
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import ArrayLike

from convexrough import checks
from convexrough.arrays import Array, Indices, frozen
from convexrough.atomic import write_text
from convexrough.errors import ConvexroughError, InputError, SolverError
from convexrough.normal.problem import NormalProblem
from convexrough.programs.formats import cbf, clarabel_json, cone_npz, mps, qpsolvers_npz, sizes
from convexrough.record import Record
from convexrough.scene.scene import Scene
from convexrough.solvers import Newton
from convexrough.solvers.bristles import BristleProgram, BristleQP
from convexrough.solvers.conic import ConeBoxes, lifted_program
from convexrough.solvers.programs import ConeProgram, QuadraticProgram
from convexrough.version import __version__

Form: TypeAlias = Literal["cones", "dual", "bristles"]
FORMS: tuple[Form, ...] = get_args(Form)

#: The writers of each form, by file ending.
_OF_CONES: dict[str, Callable[[Any], bytes]] = {"cbf": cbf, "json": clarabel_json, "npz": cone_npz}
WRITERS: dict[Form, dict[str, Callable[[Any], bytes]]] = {
    "cones": _OF_CONES,
    "dual": _OF_CONES,
    "bristles": {"npz": qpsolvers_npz, "mps": mps},
}


@dataclass(frozen=True, eq=False, repr=False)
class Program(Record):
    """A convex program in standard form for a contact problem.

    form        : "cones", "dual" or "bristles"
    what        : description of the form
    data        : the arrays of the program, a ConeProgram or a QuadraticProgram
    asperities  : (m,) indices of the asperities in the program; the others carry no load, or less
        than 1e-12 of the largest upper bound on a load
    count       : number of asperities of the scene
    force_unit  : [force] unit of the loads in the program
    energy_unit : [force length] unit of the objective
    objective   : minimum of the objective, in energy_unit; for bristles the value that OSQP finds,
        nan if OSQP fails
    constant    : energy in energy_unit minus objective (for the dual, plus objective); 0 for
        bristles, and for a prescribed approach
    load_error_estimate : estimated difference between the exact minimiser and the solution of the
        contact law, as a fraction of the largest load; 0 for cones and dual

    >>> program = cr.program(scene, "bristles", approach=5e-5, bristles=16)
    >>> program.what, len(program.asperities)
    ('quadratic, 16 bristles an asperity', 61)
    >>> energy, about = program.energy(program.objective), program.about()
    >>> print(f"{energy:.3g}", about["variables"], about["constraints"])
    -6.49e-12 1037 1037
    >>> program.save(folder / "bristles.mps")
    """

    form: Form
    what: str
    data: ConeProgram | QuadraticProgram
    asperities: Indices
    count: int
    force_unit: float
    energy_unit: float
    objective: float
    constant: float
    load_error_estimate: float

    def loads(self, values: ArrayLike) -> Array:
        """(n,) [force] loads of all asperities of the scene, from a solver's solution.

        values : the solution x, with or without the last variable that a file in CBF adds. For the
            dual, the multipliers of the equations, or of all constraints, in the order of the file;
            solvers differ in the sign of multipliers, and both signs are accepted

        Raises InputError for a wrong number of values.

        >>> program = cr.program(scene, approach=5e-5)
        >>> program.loads(np.zeros(330)).shape
        (61,)
        """
        m, data = len(self.asperities), self.data
        given = checks.array("values", checks.numbers("values", values).ravel())
        valid = [len(data.linear), len(data.linear) + 1]
        if isinstance(data, ConeProgram) and self.form == "dual":
            valid = [data.equalities, len(data.constant)]
        if len(given) not in valid:
            expected = " or ".join(f"{each:,}" for each in valid)
            raise InputError("values", found=f"{len(given):,} numbers", expected=expected)
        own = np.abs(given[:m]) if self.form == "dual" else np.maximum(given[:m], 0.0)
        loads = np.zeros(self.count)
        loads[self.asperities] = self.force_unit * own
        return loads

    def energy(self, objective: float) -> float:
        """[force length] the energy of the contact for a value of the objective in `energy_unit`.

        Raises InputError for an objective that is not finite.
        """
        sign = -1.0 if self.form == "dual" else 1.0
        return self.energy_unit * (sign * checks.finite("objective", objective) + self.constant)

    def save(self, path: Path | str) -> None:
        """Write the program to a file in the format of its ending: .cbf, .json (Clarabel) or .npz
        (sparse matrices); for bristles .mps or .npz (qpsolvers, dense).

        Raises InputError for other endings, and FileError if the file cannot be written.
        """
        path, valid = Path(path), WRITERS[self.form]
        if (ending := path.suffix.removeprefix(".")) not in valid:
            expected = f"one of .{', .'.join(valid)} for the form {self.form}"
            raise InputError(str(path), found=f"the ending {path.suffix!r}", expected=expected)
        write_text(path, valid[ending](self.data))

    def about(self) -> dict[str, Any]:
        """Sizes, units and values of the program without its arrays, for an index of files."""
        data = self.data
        return {
            "form": self.what,
            "variables": len(data.linear),
            "constraints": data.constraints.shape[0],
            "nonzeros": int(data.quadratic.nnz + data.constraints.nnz),
            "force_unit": self.force_unit,
            "energy_unit": self.energy_unit,
            "asperities": self.asperities.tolist(),
            "objective": self.objective,
            "constant": self.constant,
            "load_error_estimate": self.load_error_estimate,
        }


def program(
    scene: Scene,
    form: Form = "cones",
    *,
    approach: float | None = None,
    load: float | None = None,
    bristles: int = 64,
) -> Program:
    """The contact problem of a scene as a convex program in standard form.

    form     : "cones" (equivalent to the contact law), "dual" (of the cone program) or "bristles"
        (a quadratic program, with errors of loads of about `load_error_estimate`)
    approach, load : [length], [force] the prescribed quantity, exactly one of the two
    bristles : number of bristles per asperity, for the form "bristles"

    docs/theory/exact-cones.md derives the cones. Newton's method first solves the problem. Raises
    SolverError if it finds no solution; TooDenseError if the solution lies outside the boxes in
    which the program is exact; InputError for wrong values.

    >>> program = cr.program(scene, approach=5e-5)
    >>> program.data.cones
    220
    """
    checks.instance("scene", scene, Scene)
    checks.whole("bristles", bristles)
    return stated(*solved(scene, approach, load), form, bristles)


def solved(scene: Scene, approach: float | None, load: float | None) -> tuple[NormalProblem, Array]:
    """The problem of a scene, with a dense matrix, and the scaled loads (n,) by Newton's method."""
    problem = NormalProblem.assemble(scene, approach=approach, load=load, influence="dense")
    if len(problem) == 0:
        expected = "an approach at which an asperity touches"
        raise InputError("approach", found=approach, expected=expected)
    return problem, Newton().solve(problem).loads


def stated(problem: NormalProblem, own: Array, form: Form, bristles: int) -> Program:
    """The program of a problem, given the loads (n,) of its solution in scaled units."""
    if form not in FORMS:
        expected = f"a form of program; {checks.nearest(str(form), FORMS)}"
        raise InputError("form", found=repr(form), expected=expected)
    level = problem.approach_bound if problem.load is not None else 0.0
    make = partial(
        Program,
        form=form,
        count=len(problem.scene),
        force_unit=problem.units.force,
        energy_unit=problem.units.force * problem.units.length,
        constant=level * (problem.load or 0.0),
    )
    if form == "bristles":
        rows = BristleProgram.assemble(problem, bristles, form)
        rows.refuse_cut(own)
        data = rows.apply()
        try:
            objective = _value(data, BristleQP(bristles).run(data).x)
        except SolverError:  # another solver may solve it
            objective = np.nan
        return make(
            what=f"quadratic, {bristles} bristles an asperity",
            data=data,
            asperities=frozen(np.array(problem.candidates)),
            constant=0.0,
            objective=objective,
            load_error_estimate=_bristle_error(rows, own),
        )
    boxes = _boxes(problem, own)
    cones = lifted_program(problem, boxes)
    kind = f"second-order cones, {5 if boxes.five else 4} an asperity"
    p = own[boxes.members]
    t = np.cbrt(p / boxes.loads)
    powers = [t, t**2, t**3, t**4, t**5, t**5 - t**6]
    least = _value(cones, np.concatenate((p, *powers[0 if boxes.five else 1 :])))
    dual = form == "dual"
    return make(
        what=f"the dual of {kind}" if dual else kind,
        data=cones.dual() if dual else cones,
        asperities=frozen(problem.candidates[boxes.members]),
        objective=-least if dual else least,
        load_error_estimate=0.0,
    )


def write_programs(
    write: Callable[[str, bytes], None],
    name: str,
    scene: Scene,
    *,
    approach: float | None,
    load: float | None,
    formats: Collection[str],
    bristles: int,
) -> dict[str, Any]:
    """Write a file NAME.FORM.ENDING for each form and format by `write`, and index.json, whose
    contents are returned.

    formats : file endings; all if there are none

    Other arguments are those of `program`. A program is left out if the solution is not in the box
    on which it is exact, or if its file would not fit in memory; the index gives the reason. If no
    program remains, the last of these reasons is raised, a ConvexroughError.
    """
    problem, own = solved(scene, approach, load)
    about, left_out = dict[str, Any](), dict[str, str]()
    for form, writers in WRITERS.items():
        program, endings = None, [each for each in writers if each in formats or not formats]
        for ending in endings:
            file = f"{name}.{form}.{ending}"
            try:
                program = program or stated(problem, own, form, bristles)
                content = writers[ending](program.data)
            except ConvexroughError as error:
                left_out[file if program else form], last = str(error), error
                continue
            write(file, content)
            about[file] = program.about() | sizes(ending, content)
    if not about:
        raise last
    index = {
        "schema": 1,
        "version": __version__,
        "prescribed": {"approach": approach, "load": load},
        "asperities": len(scene),
        "programs": about,
        "left_out": left_out,
    }
    write("index.json", f"{json.dumps(index, indent=2)}\n".encode())
    return index


def _boxes(problem: NormalProblem, own: Array) -> ConeBoxes:
    """Boxes for four cones per asperity if the solution lies in them, else for five."""
    for five in (False, True):
        boxes = ConeBoxes.choose(problem, five=five)
        if not (beyond := boxes.cut & (own[boxes.members] >= boxes.loads)).any():
            return boxes
    theta = problem.shells / problem.compliance(own)
    raise boxes.too_dense(problem, "cones", np.where(beyond, theta[boxes.members], 0.0))


def _value(program: ConeProgram | QuadraticProgram, x: Array) -> float:
    """The objective at x; the quadratic form is stored as its upper triangle."""
    upper = program.quadratic
    square = x @ (upper @ x) - 0.5 * x @ (upper.diagonal() * x)
    return float(square + program.linear @ x)


def _bristle_error(rows: BristleProgram, own: Array) -> float:
    """Estimated error of the loads of the bristle program, divided by the largest load: at most
    0.375 B / m^2 for one asperity (docs/theory/bristles.md), times up to about 1 / lambda by
    interaction, with the smallest of the `scaled_eigenvalues` as lambda."""
    row = 0.375 * float(rows.box.max() / own.max()) / rows.m**2
    return row / float(scaled_eigenvalues(rows.problem, own)[0])


def scaled_eigenvalues(problem: NormalProblem, own: Array) -> Array:
    """Eigenvalues of the Hessian of touching asperities, scaled to a diagonal of 1, ascending."""
    touching = np.flatnonzero(own)
    root = np.sqrt(1.0 / problem.compliance(own[touching], touching))
    scaled = problem.influence.matrix[np.ix_(touching, touching)] * root * root[:, None]
    np.fill_diagonal(scaled, 1.0)
    return np.asarray(np.linalg.eigvalsh(scaled))
