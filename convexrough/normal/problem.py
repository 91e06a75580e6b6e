"""The normal contact problem in scaled units: energy, gap, residual, bounds, convexity.

Equations (1) and (2) of docs/theory/convexity.md, "The model", state the problem:

    minimise  Phi(P) = sum (3/5) k_i P_i^(5/3) + (1/2) P'AP - D'P   over P >= 0

for the loads P, with the coefficients k of the local law, the compliance operator A, and
D_i = D0 + d_i for the approach D0 and the offsets d. Under approach control D0 is prescribed. Under
load control sum P_i is prescribed, and D0 is the multiplier of this constraint. The first-order
conditions are the contact law, with the gaps g:

    P >= 0,   g = k P^(2/3) + A P - D >= 0,   P_i g_i = 0.
"""

from __future__ import annotations

from contextlib import AbstractContextManager
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from convexrough import checks, threads
from convexrough.arithmetic.balls import Ball, replaced
from convexrough.arithmetic.pairs import Pair
from convexrough.arrays import Array, Indices, among_zeros, evenly, frozen, largest, taken
from convexrough.convex.newton_step import correct
from convexrough.influence import Influence, Kind, couple
from convexrough.influence.coupling import Coupling
from convexrough.influence.dense import DenseInfluence
from convexrough.influence.lattice import LatticeInfluence
from convexrough.influence.sliced_matrix import MatrixSums
from convexrough.normal.exact import Data, Units, exact_data
from convexrough.normal.load_control import approach_bound, highest_approach
from convexrough.roundoff import ROUNDOFF, SAFETY
from convexrough.scene.scene import Scene
from convexrough.sphere import hertz

#: Number of rows of a stored matrix up to which a product to thirty digits takes less time than the
#: rest of `press`.
ALL_SHARP = 700

#: If no load changes by more than this part of the largest load, A P is updated by a product of A
#: with the changes in float64, and keeps 29 digits. Unless a matrix of at most `ALL_SHARP` rows is
#: stored, A P is always updated in this way.
NEARBY = 1e-13

#: Number of pairs of an asperity that can touch and another one up to which a stored matrix is not
#: replaced by transforms for displacements of the others. Affects speed only.
FEW_PAIRS = 2**17

#: Factor by which one correction by conjugate gradients is meant to reduce the residual.
REDUCTION = 1e-12


@dataclass(frozen=True, eq=False)
class NormalProblem:
    """The asperities of a scene that could touch, and what is prescribed, in scaled units.

    A stack (`normal.stack.Stack`) is many problems, one per row. Its arrays are (m, n), or (n,)
    where all rows are equal, and `control` and `highest` are (m, 1).
    """

    scene: Scene
    units: Units
    candidates: Indices  # (n,) in the scene; no other asperity touches in any solution
    coefficients: Array  # (n,) k
    offsets: Array  # (n,) d
    offset_errors: Array  # (n,) bound on the rounding error of D_i, without that of D0
    influence: Influence  # A
    shells: Array  # (n,) 1 / (pi E* s_i), so large that A + diag(shells) is semidefinite
    control: Ball  # the prescribed load if `by_load` is True, else the prescribed approach D0
    by_load: bool
    highest: float  # bound on D0 at any solution; if infinite, `approach_bound` computes one
    #: True if loads are refined to as many digits as friction needs
    sharp: bool = field(default=False, kw_only=True)

    def __post_init__(self) -> None:
        # A solver, which may be any class, gets these arrays, and later the proof uses them.
        for each in (*vars(self).values(), *vars(self.influence).values()):
            if isinstance(each, np.ndarray):
                frozen(each)

    def __len__(self) -> int:
        return len(self.candidates)

    def one_thread(self) -> AbstractContextManager[object]:
        """`threads.one_thread` where products with A use several threads themselves."""
        numbers = 4 if self.influence.stored else 100  # about that many for each asperity
        return threads.one_where(numbers * len(self))

    @cached_property
    def exact(self) -> Data:
        """The coefficients k, the offsets d and 1 / (pi E*) to about thirty digits."""
        sizes = self.offset_errors / ROUNDOFF
        return exact_data(self.scene, self.candidates, self.units, sizes)

    @cached_property
    def approach_bound(self) -> float:
        """An upper bound on D0 at every solution."""
        if not self.by_load or self.highest < np.inf:
            return self.highest
        load = self.load * self.units.force
        return highest_approach(self.scene, load, self.influence.name) / self.units.length

    @cached_property
    def load(self) -> Any:
        """The prescribed load, a number or (m, 1) for a stack; None under approach control."""
        return _numbers(self.control) if self.by_load else None

    @cached_property
    def approach(self) -> Any:
        """The prescribed approach D0, a number or (m, 1); None under load control."""
        return None if self.by_load else _numbers(self.control)

    def at_load(self, load: Ball) -> Self:
        """The sharp problem of the same asperities under a total load, by which the approach must
        be at most `approach_bound`."""
        return self._at(load, by_load=True)

    def sharpened(self) -> Self:
        """The same problem, `sharp`."""
        return self._at(self.control, self.by_load)

    def at_approach(self, approach: Ball) -> Self:
        """The sharp problem of the same asperities at an approach of at most `approach_bound`."""
        return self._at(approach, by_load=False)

    def _at(self, control: Ball, by_load: bool) -> Self:
        other = replace(self, control=control, by_load=by_load, sharp=True)
        for name in ("exact", "row_norm", "largest_entry"):
            other.__dict__[name] = getattr(self, name)
        for name in ("squares", "screened", "onto_screened"):
            if name in self.__dict__:
                other.__dict__[name] = getattr(self, name)
        return other

    @cached_property
    def squares(self) -> Array:
        """(n,) [length^2] squared distances of the summits from the axis."""
        return frozen(self.scene.asperities.distances[self.candidates] ** 2)

    @cached_property
    def screened(self) -> Indices:
        """(m,) the indices of the asperities that cannot touch, as approach plus offset is at most
        0 in every solution."""
        left = np.ones(len(self.scene), dtype=bool)
        left[self.candidates] = False
        return left.nonzero()[0]

    @cached_property
    def onto_screened(self) -> Coupling:
        """The map from loads to displacements of the asperities `screened`."""
        pairs = len(self) * len(self.screened)
        influence = self.influence if pairs <= FEW_PAIRS else self.unstored().influence
        return influence.onto(self.scene.contact_points[self.screened])

    def unstored(self) -> NormalProblem:
        """The same problem, with an operator that is not a matrix."""
        A = self.influence
        if not A.stored:
            return self
        kind: Kind = "scattered" if self.scene.lattice is None else "lattice"
        return replace(self, influence=couple(self.scene, self.candidates, A.scale, kind))

    @cached_property
    def places(self) -> Indices:
        """(N,) for each asperity of the scene its index in `candidates`, or -1."""
        places = np.full(len(self.scene), -1)
        places[self.candidates] = np.arange(len(self))
        return places

    def apply(self, loads: Array) -> Array:
        """(n,) A P in float64."""
        return self.influence.apply(loads)

    def product(self, loads: Pair) -> Ball:
        """(n,) A P to about thirty digits."""
        return self.influence.sums(loads) * self.exact.scale

    def plain_product(self, loads: Pair) -> Ball:
        """(n,) A P for loads >= 0, computed in float64, with bounds on the rounding errors."""
        product, off = self.influence.apply(loads.high), self.influence.rounding(loads.high)
        most = np.maximum(product, 0.0) + off.of(product)
        errors = off.of(product) + (off.relative + 2 * ROUNDOFF) * most
        return Ball.around(product, errors * (1 + SAFETY))

    @property
    def few(self) -> bool:
        """True for a stored matrix of so few rows that each `product` is cheap."""
        return self.influence.stored and len(self) <= ALL_SHARP

    @property
    def precise(self) -> bool:
        """True if `pressed_product` has all digits that friction needs."""
        A = self.influence
        if self.sharp or not isinstance(A, LatticeInfluence | DenseInfluence):
            return True
        return A.slices == A.least_slices if isinstance(A, LatticeInfluence) else self.few

    def pressed_product(self, loads: Pair) -> Ball:
        """(n,) A P for loads P >= 0, precise enough for a press: unless the problem is `precise`,
        fewer digits than `product` on a lattice and, for a matrix, where loads are 0."""
        if self.precise:
            return self.product(loads)
        if isinstance(self.influence, LatticeInfluence):
            sums = self.influence.sums(loads, self.influence.least_slices)
            return sums * self.exact.scale
        assert isinstance(self.influence, DenseInfluence)
        found, some, every = self.plain_product(loads), loads.high.nonzero()[0], self.influence.sums
        matrix = MatrixSums(every.points.at(some), every.point_error)
        return replaced(found, some, matrix(loads.at(some)) * self.exact.scale)

    def correct(self, slopes: Array, defect: Array, enough: Any = 0.0, todo: Any = True) -> Array:
        """(n,) one Newton step for the equation F(delta) = 0 of docs/theory/newton.md.

        slopes : (n,) dP/d(delta), 0 where open;  defect : (n,) F(delta)
        enough : fraction of the defect that the step may leave;  todo : used only by `Stack`
        """
        some, influence = np.arange(len(self)), self.influence
        if not influence.stored:  # save the time for asperities that do not move
            some = ((slopes > 0) | (defect != 0)).nonzero()[0]
            influence = influence.restricted(some)
        parts = influence, taken(self.shells, some), np.sqrt(slopes[some]), defect[some]
        step = correct(*parts, balanced=self.by_load, tolerance=float(enough) or REDUCTION)
        return among_zeros(step, some, len(self))

    def moved(self, loads: Pair, product: Ball, others: Pair) -> Ball:
        """(n,) A times `others`, if possible from `product`, which is A times `loads`."""
        change = (others - loads).high
        small = NEARBY * float(loads.high.max())
        if self.few and float(np.abs(change).max()) > small:
            return self.product(others)
        moved, off = self.influence.apply(change), self.influence.rounding(change)
        most = self.row_norm * float(np.linalg.norm(change))  # bounds A |change|
        error = (off.relative + 2 * ROUNDOFF) * most + off.each
        return product + Ball.around(moved, error * (1 + SAFETY))

    @cached_property
    def row_norm(self) -> Any:
        """Bound on the largest 2-norm of a row of A: a number, or (m, 1) for a stack."""
        return self.influence.row_norm

    @cached_property
    def largest_entry(self) -> Any:
        """Bound on the largest entry of A: a number, or (m, 1) for a stack."""
        nearest = float(self.influence.separations().min(initial=np.inf))
        return self.influence.scale / nearest * (1 + SAFETY) if nearest > 0 else np.inf

    @classmethod
    def assemble(
        cls,
        scene: Scene,
        *,
        approach: float | None = None,
        load: float | None = None,
        influence: Kind | None = None,
        highest: float | None = None,
    ) -> NormalProblem:
        """The problem of a scene. Give exactly one of `approach` [length] and `load` [force].

        influence : compliance operator; None for the cheapest
        highest   : [length] upper bound on the approach under `load`, or inf to make all asperities
            candidates; default: that of `highest_approach`
        """
        checks.exactly_one("approach", approach, "load", load)
        offsets, errors = scene.offsets, scene.offset_errors
        modulus = scene.material.contact_modulus
        coefficients = evenly(partial(hertz.local_coefficient, modulus), scene.relative_radii)
        if approach is not None:
            highest = given = checks.finite("approach", approach)
        else:
            assert load is not None  # exactly_one
            given = checks.positive("load", load)
            if highest is None:
                highest = highest_approach(scene, given, influence)

        # An asperity with D_i <= 0 cannot touch: A P >= 0, so its gap is at least -D_i.
        prescribed = highest + offsets + errors + 6 * ROUNDOFF * abs(highest)
        candidates = scene.asperities.layout.sorted(prescribed > 0)
        top = float(prescribed.max(initial=0.0)) or 1.0
        if highest == np.inf:  # take the indentation of one asperity under the whole load
            top = float(hertz.indentation(given, coefficients.max()))
        some = np.sort(coefficients[:: max(1, len(coefficients) // 1000)])
        units = Units.of(top, float(some[len(some) // 2]))
        about = _about(scene, candidates, taken(coefficients, candidates), units, influence)
        control = Ball.exact(given / (units.length if load is None else units.force))
        by_load, highest = load is not None, highest / units.length
        return cls(scene, units, **about, control=control, by_load=by_load, highest=highest)

    def restricted(self, which: Indices) -> NormalProblem:
        """The problem in which only the candidates with these indices may carry loads."""
        part = replace(
            self,
            candidates=self.candidates[which],
            coefficients=taken(self.coefficients, which),
            offsets=self.offsets[which],
            offset_errors=self.offset_errors[which],
            influence=self.influence.restricted(which),
            shells=taken(self.shells, which),
        )
        if "exact" in self.__dict__:
            part.__dict__["exact"] = self.exact.at(which)
        return part

    def widened(self, which: Indices) -> NormalProblem:
        """The sharp problem with more candidates: the asperities `which` of the scene."""
        modulus, radii = self.scene.material.contact_modulus, self.scene.relative_radii[which]
        coefficients = hertz.local_coefficient(modulus, radii)
        about = _about(self.scene, which, coefficients, self.units, None)
        return replace(self, **about, sharp=True)

    def radii(self, compliance: Array) -> Array:
        """[length] contact radii a_i = 1 / (2 E* h_i) for local compliances h."""
        return np.asarray((np.pi / 2.0) * self.influence.scale / compliance)

    def energy(self, loads: Array, displacement: Array) -> float:
        """The energy Phi(P), with D0 = 0 under load control; `displacement` is A P."""
        local = 0.6 * loads @ hertz.indentation(loads, self.coefficients)
        prescribed = self.offsets + (self.approach or 0.0)
        return float(local + loads @ (0.5 * displacement - prescribed))

    def gap(self, loads: Array, displacement: Array, approach: float) -> Array:
        """(n,) g = k P^(2/3) + A P - D, the gradient of Phi; `displacement` is A P."""
        local: Array = hertz.indentation(loads, self.coefficients)
        return local + displacement - self.offsets - approach

    def residual(self, loads: Array, approach: float, displacement: Array | None = None) -> float:
        """The largest |g_i| where P_i > 0 and max(-g_i, 0) elsewhere; `displacement` is A P."""
        if displacement is None:
            displacement = self.influence.apply(loads)
        gap = self.gap(loads, displacement, approach)
        return float(np.where(loads > 0, np.abs(gap), np.maximum(-gap, 0.0)).max(initial=0.0))

    def bounds(self, approach_bound: float) -> Array:
        """(n,) upper bounds (max(D_i, 0) / k_i)^(3/2) on the loads of every solution, from an upper
        bound on the approach D0 in D_i = D0 + d_i."""
        rounding = self.offset_errors + 6 * ROUNDOFF * abs(approach_bound)
        alone: Array = hertz.load(approach_bound + self.offsets + rounding, self.coefficients)
        return alone * (1 + SAFETY)

    def compliance(self, loads: Array, which: Indices | slice = slice(None)) -> Array:
        """(n,) the local part h_i = (2/3) k_i P_i^(-1/3) = 1 / (2 E* a_i) of the Hessian of Phi."""
        with np.errstate(divide="ignore"):
            return np.asarray((2.0 / 3.0) * self.coefficients[which] / np.cbrt(loads))

    def convexity_number(self, loads: Array) -> float:
        """The largest shells_i / h_i with the `compliance` h at `loads`; below 1 the energy is
        convex for all loads from 0 up to `loads`: (3) of docs/theory/convexity.md."""
        return float(convexity_number(self.shells, self.compliance(loads)))

    def overhang(self, weights: Array, displacement: Ball) -> Any:
        """An upper bound on D0 at every solution: a number, or (m, 1) for a stack.

        weights : (n,) not negative, not all 0;  displacement : A times weights
        """
        if not self.by_load:
            return self.highest
        given = self.coefficients, self.offsets - self.offset_errors, self.control.upper
        return np.fmin(self.highest, approach_bound(weights, displacement.upper, *given))

    def to_scene(self, values: NDArray[Any]) -> Array:
        """(N,) values of the candidates, and 0 for all other asperities of the scene."""
        return among_zeros(values, self.candidates, len(self.scene))


def _about(
    scene: Scene, which: Indices, coefficients: Array, units: Units, kind: Kind | None
) -> dict[str, Any]:
    """The fields of the problem in which the asperities `which` may touch; k is not scaled."""
    scale = units.force / units.length / (np.pi * scene.material.contact_modulus)
    influence = couple(scene, which, scale, kind)
    return {
        "candidates": which,
        "coefficients": evenly(lambda k: k * units.local, coefficients),
        "offsets": scene.offsets[which] / units.length,
        "offset_errors": scene.offset_errors[which] / units.length,
        "influence": influence,
        "shells": influence.shells,
    }


def convexity_number(shells: Array, compliance: Array) -> Any:
    """The largest of shells / compliance: one number for (n,); (m, 1), one per row, for (m, n)."""
    return largest(shells / compliance) * (1 + SAFETY)


def _numbers(control: Ball) -> Any:
    return control.value if control.shape else float(control.value)
