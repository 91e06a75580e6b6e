"""A hard case for the developers of solvers: its programs as files, and what to know of them."""

from __future__ import annotations

from typing import Any

import numpy as np

from convexrough.arrays import Array
from convexrough.errors import ConvexroughError
from convexrough.gallery.cases import HardCase
from convexrough.gallery.formats import cbf, clarabel_json, qpsolvers_npz
from convexrough.normal.certificate import certify
from convexrough.normal.problem import NormalProblem
from convexrough.solvers.bristles import LARGEST_S, BristleProgram
from convexrough.solvers.cone_boxes import Boxes, TooDenseError
from convexrough.solvers.conic import LiftedProgram
from convexrough.solvers.programs import ConeProgram

#: Bristles of each asperity; fewer where a program would have more variables than this, as its file
#: is dense. Heuristics, for files that are read in no time.
BRISTLES, FEWEST_BRISTLES, VARIABLES = 64, 8, 520

#: Cone programs of at most so many asperities are written as CBF, too.
SMALL = 20

#: A program by the name of its file, without what it holds: what the index says.
About = dict[str, Any]


def packed(case: HardCase) -> tuple[About, dict[str, bytes]]:
    """What the index says of a case, and its files by name.

    A program is left out, with the reason, where the answer lies beyond the boxes in which it is
    exact.
    """
    problem = NormalProblem.assemble(case.scene, **case.control, influence="dense")
    loads = np.array([float(digits) for digits in case.loads])
    own = loads[problem.candidates] / problem.units.force
    about: About = {
        "family": case.family,
        "why": case.why,
        "scene": _written(case),
        "prescribed": case.control,
        **_hardness(problem, own),
        "certificate": _proved(case, loads),
        "answer": _answer(case),
        "programs": {},
        "left_out": {},
    }
    files: dict[str, bytes] = {}
    for kind, make in (("cones", _cones), ("bristles", _bristles)):
        try:
            described, made = make(case, problem, own)
        except ConvexroughError as error:
            about["left_out"][kind] = str(error)
            continue
        about["programs"] |= described
        files |= made
    return about, files


def _cones(case: HardCase, problem: NormalProblem, own: Array) -> tuple[About, dict[str, bytes]]:
    """Four cones an asperity where the answer is in their boxes, else five."""
    theta = problem.shells / problem.stiffness(own)
    boxes = Boxes.choose(problem)
    if (beyond := boxes.cut & (own[boxes.members] >= boxes.loads)).any():
        boxes = Boxes.choose(problem, five=True)
        beyond = boxes.cut & (own[boxes.members] >= boxes.loads)
    if beyond.any():
        raise boxes.too_dense(problem, "cones", np.where(beyond, theta[boxes.members], 0.0))
    program = LiftedProgram.accept(problem, boxes).apply()
    about = {
        "form": f"second-order cones, {5 if boxes.five else 4} an asperity",
        **_sizes(program.linear, program.constant, program.quadratic, program.constraints),
        **_way_back(problem, boxes.members),
        "objective": _objective(program, boxes, own),
    }
    files = {f"{case.name}.cones.json": clarabel_json(program)}
    if len(boxes.members) <= SMALL:
        files[f"{case.name}.cbf"] = cbf(program)
    return dict.fromkeys(files, about), files


def _bristles(case: HardCase, problem: NormalProblem, own: Array) -> tuple[About, dict[str, bytes]]:
    m = int(np.clip(VARIABLES // len(problem) - 1, FEWEST_BRISTLES, BRISTLES))
    reduction = BristleProgram.accept(problem, m, "bristles")
    if len(beyond := np.flatnonzero(reduction.cut & (own >= reduction.box))):
        ratios = problem.shells[beyond] / problem.stiffness(own[beyond], beyond)
        raise TooDenseError("bristles", problem.candidates[beyond], ratios, LARGEST_S)
    program = reduction.apply()
    about = {
        "form": f"quadratic, {m} bristles an asperity",
        **_sizes(program.linear, program.lower, program.quadratic, program.constraints),
        **_way_back(problem, np.arange(len(problem))),
        "off": _bristle_error(reduction, own),
    }
    name = f"{case.name}.bristles.npz"
    return {name: about}, {name: qpsolvers_npz(program)}


def _bristle_error(reduction: BristleProgram, own: Array) -> float:
    """About how far an exact solution is from the contact's, over the largest load.

    A row of m bristles is off by 0.375 B / m^2 at worst, B the load of its box; the others answer
    to that, by no more than one over the least eigenvalue of the scaled Hessian.
    """
    row = 0.375 * float(reduction.box.max() / own.max()) / reduction.m**2
    return row / float(_scaled_eigenvalues(reduction.problem, own)[0])


def _sizes(linear: Array, constant: Array, quadratic: Any, constraints: Any) -> About:
    return {
        "variables": len(linear),
        "constraints": len(constant),
        "nonzeros": int(quadratic.nnz + constraints.nnz),
    }


def _way_back(problem: NormalProblem, members: Any) -> About:
    """Loads are force_unit times the first variables, of these asperities; others have none."""
    return {
        "force_unit": problem.units.force,
        "asperities": problem.candidates[members].tolist(),
    }


def _objective(program: ConeProgram, boxes: Boxes, own: Array) -> float:
    """The least objective: that of the powers of the answer's contact radii."""
    p = own[boxes.members]
    t = np.cbrt(p / boxes.loads)
    powers = [t, t**2, t**3, t**4, t**5, t**5 - t**6]
    x = np.concatenate((p, *powers[0 if boxes.five else 1 :]))
    upper = program.quadratic
    square = x @ (upper @ x) - 0.5 * x @ (upper.diagonal() * x)
    return float(square + program.linear @ x)


def _hardness(problem: NormalProblem, own: Array) -> About:
    """Numbers that say how hard a case is.

    condition : of the energy's Hessian over the touching ones, scaled to a diagonal of 1
    spread    : smallest over largest load
    """
    eigenvalues = _scaled_eigenvalues(problem, own)
    positive = eigenvalues[0] > 0
    return {
        "asperities": len(problem.scene),
        "touching": int(np.count_nonzero(own)),
        "condition": float(eigenvalues[-1] / eigenvalues[0]) if positive else None,
        "spread": float(own[own > 0].min() / own.max()),
    }


def _scaled_eigenvalues(problem: NormalProblem, own: Array) -> Array:
    """Of the energy's Hessian over the touching ones, scaled to a diagonal of 1; least first."""
    touching = np.flatnonzero(own)
    root = np.sqrt(1.0 / problem.stiffness(own[touching], touching))
    scaled = problem.influence.matrix[np.ix_(touching, touching)] * root * root[:, None]
    np.fill_diagonal(scaled, 1.0)
    return np.asarray(np.linalg.eigvalsh(scaled))


def _proved(case: HardCase, loads: Array) -> About:
    """What the certificate says of the answer rounded to float64."""
    proof = certify(case.scene, loads, **case.control)
    bound = float(proof.load_errors.max())
    return {
        "scope": proof.scope,
        "convexity_number": proof.convexity_number,
        "load_error": bound if np.isfinite(bound) else None,
        "undecided": np.flatnonzero(proof.status == "undecided").tolist(),
    }


def _answer(case: HardCase) -> About:
    return {
        "approach": case.exact_approach,
        "load": case.exact_load,
        "loads": list(case.loads),
        "gaps": list(case.gaps),
        "shear_force": case.shear_force,
        "shear_forces": list(case.forces),
        "slips": list(case.slips),
        "displacement": case.displacement,
    }


def _written(case: HardCase) -> About:
    scene = case.scene
    return {
        "sphere_radius": scene.sphere_radius,
        "contact_modulus": scene.material.contact_modulus,
        "poisson_ratio": scene.material.poisson_ratio,
        "friction": scene.friction,
        "geometry": scene.geometry,
        "positions": scene.asperities.positions.tolist(),
        "tip_radii": scene.asperities.tip_radii.tolist(),
        "heights": scene.asperities.heights.tolist(),
    }
