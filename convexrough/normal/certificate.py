"""Judge loads from any source: how far from the solution they can be, and which asperities touch.

Knows no solver. Every bound holds for the exact solution of the scene whose data are the given
float64 numbers, and includes the rounding of everything computed here. The mathematics is derived
in docs/theory/certificate.md; in short, for loads P with residual e (the gap where loaded, its
negative part where not), a box 0 <= P <= B that holds every solution, H = diag(2/3 k B^(-1/3)),
and mu > 0 with Hessian >= mu H on that box,

    || P - P* ||_H  <=  || e ||_{H^-1} / mu  =:  eps,

so |P_i - P*_i| <= eps / sqrt(h_i), and A P is off by at most eps sqrt(sum_j A_ij^2 / h_j). At the
solution delta* = D - A P* is the indentation where positive and minus the gap where negative.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from convexrough import checks
from convexrough.arrays import Array, Indices, frozen
from convexrough.errors import InputError
from convexrough.influence import DenseInfluence, Influence, Kind
from convexrough.influence.coupling import Coupling, error_reach
from convexrough.normal.problem import NormalProblem
from convexrough.roundoff import ROUNDOFF, SAFETY
from convexrough.scene.scene import Scene
from convexrough.sphere import hertz

Scope = Literal["global", "local", "none"]

#: Roundoffs lost in k P^(2/3) and in adding it, A P and D up.
SUM_ROUNDOFFS = 16

WORDS = np.array(["undecided", "contact", "open"])

#: Convexity number of the loads themselves from which shells fitted to them are tried.
FIT_FROM = 0.8


@dataclass(frozen=True, eq=False)
class Certificate:
    """What is proved of given loads. Arrays are (n,), in the caller's order.

    scope : "global": the scene has one solution, and the bounds are on the distance to it;
        "local": it has one solution with contact radii a_i up to convexity_number (pi/2) s_i,
        where s_i + s_j <= r_ij share out the room between neighbours (by halves, or by the sizes
        of their contacts), and the bounds are on the distance to that;
        "none": nothing is proved, every bound is infinite and every asperity undecided
    convexity_number : where below 1, the energy is strictly convex on the box used: the smallest
        eigenvalue of its Hessian, scaled by its local part, is at least 1 - convexity_number
    status : "contact" (its load is proved positive), "open" (its gap is proved positive) or
        "undecided"
    load_errors : [force] bounds on |load - solution|
    gaps : [length] gaps these loads leave: max(0, (A P)_i - D_i)
    gap_errors : [length] bounds on |gap - solution|
    approach : [length] prescribed, or the one that fits the loads best
    approach_error : [length] bound on |approach - solution|; 0 where prescribed
    duality_gap : [force length] bound on the energy of these loads above that of the solution, by
        a dual point made from the loads alone; 0 to rounding at a solution, infinite where the
        shells do not prove the energy convex up to there
    """

    scope: Scope
    convexity_number: float
    status: NDArray[np.str_]
    load_errors: Array
    gaps: Array
    gap_errors: Array
    approach: float
    approach_error: float
    duality_gap: float

    @property
    def holds(self) -> bool:
        """Every asperity is proved to touch or proved to be open."""
        return self.scope != "none" and not bool((self.status == "undecided").any())

    @property
    def load_error(self) -> float:
        """[force] the largest of `load_errors`."""
        return float(self.load_errors.max())

    @property
    def gap_error(self) -> float:
        """[length] the largest of `gap_errors`."""
        return float(self.gap_errors.max())


def certify(
    scene: Scene,
    loads: ArrayLike,
    *,
    approach: float | None = None,
    load: float | None = None,
    influence: Kind | None = None,
) -> Certificate:
    """Judge loads that came from anywhere.

    loads : (n,) [force], not negative, in the order of the scene's asperities
    approach [length] or load [force] : what is prescribed, exactly one. Under load control the
        loads are judged after scaling them to the prescribed total; the bounds include that.
    influence : how to couple the asperities: "dense", "lattice", "scattered"; None for the cheapest

    Raises InputError for loads of the wrong length, negative or not finite.
    """
    values = checks.array("loads", loads, length=len(scene), sign="not negative")
    problem = NormalProblem.assemble(scene, approach=approach, load=load, influence=influence)
    return judge(problem, values)


def judge(problem: NormalProblem, scene_loads: Array) -> Certificate:
    """`certify` for a problem already assembled; loads (n,) [force] of the whole scene."""
    given = scene_loads[problem.candidates] / problem.units.force
    loads = given if problem.load is None else _scaled_to(problem.load, given)
    fit = _fit(problem, loads)
    box = _find_box(problem, loads, fit.displacement)
    if box is None:
        return _unproved(problem, loads, fit)
    problem = box.problem

    # || P - P* ||_H <= norm, and what that says of each load.
    h = box.stiffness
    norm = _norm(fit, h, box.convexity_number)
    errors = norm / np.sqrt(h)
    if (loads + errors >= box.faces).any():  # the solution may lie outside the local box
        return _unproved(problem, loads, fit)

    # The solution is now known to be near: once more, on the box up to there.
    near = np.minimum(box.loads, loads + errors)
    if (theta := problem.convexity_number(near)) <= box.convexity_number:
        h = problem.stiffness(near)
        norm = _norm(fit, h, theta)
        errors = norm / np.sqrt(h)

    duality_gap = problem.duality_gap(
        loads, fit.displacement, fit.approach, near, fit.rounding + fit.component
    ) * (problem.units.force * problem.units.length)

    # What it says of A P and D0, and so of delta* = D - A P*.
    A = problem.influence
    moved = norm * error_reach(A, A.scale, 1.0 / h) * (1 + SAFETY)
    approach_error = 0.0
    if problem.load is not None:
        approach_error = _approach_error(problem, loads, fit, errors, moved)
    error = moved + fit.rounding + fit.component + approach_error
    touches = (loads > errors) | (fit.indentation > error)

    # delta* gives a second bound on each load, sharper where the load is small.
    low = hertz.load(fit.indentation - error, problem.coefficients) * (1 - SAFETY)
    high = hertz.load(fit.indentation + error, problem.coefficients) * (1 + SAFETY)
    errors = np.minimum(errors, np.maximum(loads - low, high - loads))
    errors += np.abs(loads - given) + 4 * ROUNDOFF * loads

    # Everyone, in the caller's order; the screened asperities carry nothing.
    indentation = problem.to_scene(fit.indentation)
    error = problem.to_scene(error)
    others, without = _screened(problem, loads, fit.approach)
    if without is not None:
        indentation[others] = without.indentation
        moved = norm * error_reach(without.coupling, A.scale, 1.0 / h) * (1 + SAFETY)
        error[others] = moved + without.rounding + approach_error
    load_errors = scene_loads.copy()
    load_errors[problem.candidates] = errors * problem.units.force
    words = np.where(indentation < -error, np.int8(2), np.int8(0))
    words[problem.candidates[touches]] = 1
    return Certificate(
        scope=box.scope,
        convexity_number=box.convexity_number,
        status=frozen(WORDS[words]),
        load_errors=frozen(load_errors),
        gaps=frozen(np.maximum(-indentation, 0.0) * problem.units.length),
        gap_errors=frozen(error * problem.units.length),
        approach=fit.approach * problem.units.length,
        approach_error=approach_error * problem.units.length,
        duality_gap=duality_gap,
    )


class _Fit(NamedTuple):
    """How well loads fit the contact law, with the rounding error of saying so."""

    displacement: Array  # A P
    indentation: Array  # D - A P
    gap: Array  # k P^(2/3) + A P - D
    local: Array  # k P^(2/3)
    rounding: Array  # bound on the error of each of the above, less a remainder
    remainder: float  # bound on the 2-norm of that
    component: float  # bound on each component of it
    residual: Array  # bound on |e|, less the remainder: |gap| where loaded, else its negative part
    approach: float  # D0


class _Box(NamedTuple):
    """A box of loads that holds the solution, and how convex the energy is on it."""

    scope: Scope
    problem: NormalProblem  # with the shells that prove it
    loads: Array  # the upper corner
    stiffness: Array  # h there
    convexity_number: float  # 1 - mu
    faces: Array  # upper faces that the solution must be shown to stay below; else infinite


def _norm(fit: _Fit, stiffness: Array, convexity_number: float) -> float:
    """|| e ||_{H^-1} / (1 - theta)."""
    squared = float(np.sum(fit.residual**2 / stiffness))
    remainder = fit.remainder / np.sqrt(float(stiffness.min(initial=np.inf)))
    return float(np.sqrt(squared) + remainder) / (1.0 - convexity_number) * (1 + SAFETY)


def _scaled_to(load: float, given: Array) -> Array:
    total = float(given.sum())
    if total == 0.0:
        expected = "a load on some asperity that could touch, as the total is prescribed"
        raise InputError("loads", found="none", expected=expected)
    return given / total * load


def _fit(problem: NormalProblem, loads: Array) -> _Fit:
    displacement = problem.influence.apply(loads)
    local = hertz.indentation(loads, problem.coefficients)
    approach = problem.approach
    if approach is None:  # the D0 that fits the touching asperities best
        weights = np.cbrt(loads) / problem.coefficients
        approach = float(weights @ (local + displacement - problem.offsets) / weights.sum())
    indentation = approach + problem.offsets - displacement
    gap = local - indentation
    off = problem.influence.rounding(loads)
    # The relative part is of the true product, which the computed one may miss by the remainder.
    rounding = (
        off.relative * (np.maximum(displacement, 0.0) + off.component) + problem.offset_errors
    )
    rounding += SUM_ROUNDOFFS * ROUNDOFF * (local + np.abs(displacement) + abs(approach))
    residual = np.where(loads > 0, np.abs(gap) + rounding, np.maximum(rounding - gap, 0.0))
    return _Fit(
        displacement, indentation, gap, local, rounding, off.norm, off.component, residual, approach
    )


def _find_box(problem: NormalProblem, loads: Array, displacement: Array) -> _Box | None:
    """Global from the a priori bound by shells, then by Cholesky; else local; else None."""
    ceiling = problem.ceiling
    if problem.load is not None:
        ceiling = min(ceiling, problem.overhang(loads, displacement))
    corner = np.maximum(problem.bounds(ceiling), loads)  # the box must hold both states
    h = problem.stiffness(corner)
    nowhere = np.full(len(problem), np.inf)
    if (theta := problem.convexity_number(corner)) < 1:
        return _Box("global", problem, corner, h, theta, nowhere)
    if (margin := _convex_margin(problem.influence, h)) > 0:
        return _Box("global", problem, corner, h, 1.0 - margin, nowhere)
    theta = problem.convexity_number(loads)
    if theta > FIT_FROM:
        fitted = problem.fitted_to(loads)
        if (number := fitted.convexity_number(loads)) < theta:
            problem, theta = fitted, number
    if theta < 1:
        theta = (1.0 + theta) / 2.0
        # The faces a_i = theta (pi/2) s_i, where h_i = shell_i / theta.
        faces = (2.0 / 3.0 * problem.coefficients * theta / problem.shells) ** 3
        local = np.minimum(corner, faces)
        beyond = np.where(faces < corner, faces, np.inf)
        return _Box("local", problem, local, problem.stiffness(local), theta, beyond)
    return None


def _convex_margin(influence: Influence, stiffness: Array) -> float:
    """A proved mu with  I + H^(-1/2) A H^(-1/2) >= mu I;  0 where none is found.

    Only where there is a matrix: a factorisation costs as the cube of its size.

    A Cholesky factorisation that runs to its end on B proves that B's smallest eigenvalue is not
    below minus some (n + 2) roundoffs of its trace (Rump, BIT 46 (2006) 433). Any mu will do:
    the bounds are sharpened afterwards on a smaller box.
    """
    if not isinstance(influence, DenseInfluence):
        return 0.0
    from scipy.linalg.lapack import dpotrf  # 0.2 s to import: only if the shells do not settle it

    n = len(stiffness)
    root = 1.0 / np.sqrt(stiffness)
    scaled = influence.matrix * root * root[:, None]
    blur = (influence.entry_error + 8 * ROUNDOFF) * float(scaled.sum(axis=1).max())
    slack = 1.1 * (blur + (n + 2) * n * ROUNDOFF)
    for margin in (0.1, 1e-3):
        np.fill_diagonal(scaled, 1.0 - margin - slack)
        if dpotrf(scaled.T, lower=1)[1] == 0:
            return margin
    return 0.0


def _approach_error(
    problem: NormalProblem, loads: Array, fit: _Fit, errors: Array, moved: Array
) -> float:
    """|D0 - D0*|, as D0* = k_i P*_i^(2/3) + (A P*)_i - d_i at every asperity sure to touch."""
    least = hertz.indentation(np.maximum(loads - errors, 0.0), problem.coefficients)
    each = np.abs(fit.gap) + fit.rounding + fit.component + (fit.local - least) + moved
    return float(each.min(where=loads > errors, initial=np.inf))


class _Screened(NamedTuple):
    """Of the asperities that cannot touch."""

    coupling: Coupling  # from the candidates
    indentation: Array  # D - A P
    rounding: Array  # bound on its error


def _screened(
    problem: NormalProblem, loads: Array, approach: float
) -> tuple[Indices, _Screened | None]:
    """Indices in the scene, and what is known of them; None if there are none."""
    scene, length = problem.scene, problem.units.length
    if len(problem) == len(scene):
        return np.zeros(0, dtype=np.intp), None
    untouched = np.ones(len(scene), dtype=bool)
    untouched[problem.candidates] = False
    others = np.flatnonzero(untouched)
    coupling = problem.influence.onto(scene.contact_points[others])
    product, offsets = coupling.apply(loads), scene.offsets[others] / length
    rounding = coupling.rounding(loads).of(product) + scene.offset_errors[others] / length
    rounding += SUM_ROUNDOFFS * ROUNDOFF * (np.abs(product) + np.abs(offsets) + abs(approach))
    return others, _Screened(coupling, approach + offsets - product, rounding)


def _unproved(problem: NormalProblem, loads: Array, fit: _Fit) -> Certificate:
    indentation = problem.to_scene(fit.indentation)
    others, without = _screened(problem, loads, fit.approach)
    if without is not None:
        indentation[others] = without.indentation
    unknown = np.full(len(problem.scene), np.inf)
    return Certificate(
        scope="none",
        convexity_number=max(1.0, problem.convexity_number(loads)),
        status=frozen(np.full(len(problem.scene), "undecided")),
        load_errors=frozen(unknown),
        gaps=frozen(np.maximum(-indentation, 0.0) * problem.units.length),
        gap_errors=frozen(unknown),
        approach=fit.approach * problem.units.length,
        approach_error=0.0 if problem.load is None else np.inf,
        duality_gap=np.inf,
    )
