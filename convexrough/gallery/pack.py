"""A hard case for developers of solvers: optimisation programs as files, and data about them."""

from __future__ import annotations

from typing import Any

import numpy as np

from convexrough.arrays import Array
from convexrough.errors import ConvexroughError
from convexrough.gallery.cases import HardCase
from convexrough.normal.certificate import certify
from convexrough.normal.problem import NormalProblem
from convexrough.programs.program import WRITERS, Form, scaled_eigenvalues, stated

#: Number of bristles (springs) of each asperity; its smallest value; and the number of variables
#: above which fewer bristles are used. These heuristics keep files small.
BRISTLES, FEWEST_BRISTLES, VARIABLES = 64, 8, 520

#: Largest number of asperities of a cone program that is also written as CBF.
SMALL = 20

#: The entry of a case in the index.
About = dict[str, Any]


def packed(case: HardCase) -> tuple[About, dict[str, bytes]]:
    """The entry of a case in the index, with reasons for missing programs; its files by name."""
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
            about["programs"][name] = program.about()
            files[name] = WRITERS[form][ending](program.data)
    return about, files


def _hardness(problem: NormalProblem, own: Array) -> About:
    """The condition number of the scaled Hessian, and the smallest load over the largest load."""
    eigenvalues = scaled_eigenvalues(problem, own)
    positive = eigenvalues[0] > 0
    return {
        "asperities": len(problem.scene),
        "touching": int(np.count_nonzero(own)),
        "condition": float(eigenvalues[-1] / eigenvalues[0]) if positive else None,
        "spread": float(own[own > 0].min() / own.max()),
    }


def _proved(case: HardCase, loads: Array) -> About:
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
