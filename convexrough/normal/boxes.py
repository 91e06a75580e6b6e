"""Boxes of loads on which the energy is convex: docs/theory/certificate.md, "Which box".

In crowded contacts a box may limit the loads of the touching asperities only, and assume all others
open: docs/theory/crowded.md. A stack is many problems, one per row (`normal.stack`). Symbols: h is
the local compliance at the upper ends of a box (`NormalProblem.compliance`), H the diagonal matrix
of the h, and A the compliance operator. On the box the Hessian of the energy is at least mu H with
mu = 1 - `convexity_number`, the margin of convexity.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array, Indices, even
from convexrough.convex.definite import largest, proved_margin
from convexrough.influence.coupling import Influence
from convexrough.influence.shells import fitted_shells
from convexrough.normal.overlap import Nearest, overlapping_margin
from convexrough.normal.problem import FITTED, NormalProblem
from convexrough.normal.stack import Stack
from convexrough.roundoff import ROUNDOFF, SAFETY

Scope = Literal["global", "local", "none"]

#: Shells are fitted to the contact radii if the convexity number is above this. A heuristic.
FIT_FROM = 0.8

#: Margins mu with which a Cholesky factorisation is tried, the largest first. A heuristic.
MARGINS = (0.1, 1e-3)

#: The upper ends of a box of touching asperities exceed each load by at least LEEWAY times the load
#: plus LEAST_LEEWAY times the largest load. Heuristics: the proof allows any box.
LEEWAY, LEAST_LEEWAY = 3e-4, 1e-12

#: Number of touching asperities up to which a Cholesky factorisation costs no more than a proof by
#: overlapping shells.
FACTORISED = 1500

#: Margins mu that are tried on a box of touching asperities, where the energy may be barely convex.
CROWDED_MARGINS = tuple((1e-4 * 2.0 ** np.arange(12)).tolist())


class Box(NamedTuple):
    """A box of loads, and the convexity of the energy on it; for one problem or for a stack."""

    scope: Scope  # "global" if every solution lies in the box
    problem: NormalProblem | Stack  # its shells may prove the convexity
    loads: Array  # (n,) upper ends of the box; the lower ends are 0
    compliance: Array  # (n,) h at the upper ends
    convexity_number: Any  # 1 - mu
    faces: Array  # (n,) the proof must show that loads are below these; infinite where not needed
    fixed_open: NDArray[np.bool_]  # (n,) True where assumed open, which the proof must then show

    def at(self, rows: Indices, problem: Stack) -> Box:
        """The boxes of some rows of a stack, with `problem` as the stack of these rows."""
        return self._replace(
            problem=problem,
            loads=self.loads[rows],
            compliance=self.compliance[rows],
            convexity_number=self.convexity_number[rows],
            faces=self.faces[rows],
            fixed_open=self.fixed_open[rows],
        )

    @property
    @np.errstate(divide="ignore", invalid="ignore")
    def closed(self) -> Box:
        """A box that contains this one, to be tried at another load or approach.

        The solution there may lie outside, so `faces` makes the proof show that it is inside.
        Where shells prove the convexity of this box, an upper end moves up to the load at which
        the convexity number of its asperity equals that of the box. So also asperities at the rim
        of the contact, with small loads, get upper ends far above the error bounds of their loads.
        """
        it, theta = self.problem, self.convexity_number
        ends = (2.0 / 3.0 * it.coefficients * theta / it.shells) ** 3
        shelled = it.convexity_at(self.compliance) <= theta * (1 + 4 * SAFETY)
        wider = shelled & (self.loads > 0) & (ends > self.loads) & np.isfinite(ends)
        loads = np.where(wider, ends, self.loads)
        h = np.where(wider, it.compliance(loads), self.compliance)
        theta = np.where(shelled, np.maximum(theta, it.convexity_at(h)), theta)
        faces = np.where(loads > 0, loads, np.inf)
        return self._replace(loads=loads, compliance=h, convexity_number=theta, faces=faces)


def tried(problem: NormalProblem, loads: Array, displacement: Array) -> Iterator[Box]:
    """At most one box on which convexity is proved: that of all solutions, else one near `loads`.

    displacement : (n,) A `loads`
    """
    highest = problem.overhang(loads, displacement)
    corner = np.maximum(problem.bounds(highest), loads)  # the box must hold both states
    h = problem.compliance(corner)
    nowhere, none = even(np.inf, len(problem)), np.zeros(len(problem), dtype=bool)
    if (theta := problem.convexity_at(h)) < 1:
        yield Box("global", problem, corner, h, theta, nowhere, none)
        return
    if (margin := convex_margin(problem.influence, h, MARGINS)) > 0:
        yield Box("global", problem, corner, h, 1.0 - margin, nowhere, none)
        return
    theta = problem.convexity_number(loads)
    if theta > FIT_FROM:
        radii = problem.radii(problem.compliance(loads))
        fitted = replace(problem, shells=fitted_shells(problem.influence, radii, FITTED))
        if (number := fitted.convexity_number(loads)) < theta:
            problem, theta = fitted, number
    if theta < 1:
        theta = (1.0 + theta) / 2.0
        # The faces a_i = theta (pi/2) s_i, where h_i = shell_i / theta.
        faces = (2.0 / 3.0 * problem.coefficients * theta / problem.shells) ** 3
        local = np.minimum(corner, faces)
        beyond = np.where(faces < corner, faces, np.inf)
        yield Box("local", problem, local, problem.compliance(local), theta, beyond, none)


def box_of_touching(
    problem: NormalProblem, loads: Array, touching: NDArray[np.bool_], room: Array
) -> Box | None:
    """A local box for the touching asperities, with all others fixed open.

    None if convexity on the box is not proved.

    room : (n,) the upper ends of the box exceed `loads` by at least this
    """
    which = np.flatnonzero(touching)
    influence = problem.influence.restricted(which)
    least = LEEWAY * loads + LEAST_LEEWAY * float(loads.max(initial=0.0))
    box = np.where(touching, loads + np.maximum(least, room), 0.0)
    h = problem.compliance(box)
    shells = np.zeros(len(h))
    shells[which] = fitted_shells(influence, problem.radii(h[which]), FITTED)
    shelled = replace(problem, shells=shells)
    number = shelled.convexity_at(h)
    if not number < 1:
        number = 1.0 - crowded_margin(influence, h[which])
    if not number < 1:
        return None
    return Box("local", shelled, box, h, number, np.where(touching, box, np.inf), ~touching)


def crowded_margin(influence: Influence, compliance: Array) -> float:
    """The largest mu of CROWDED_MARGINS proved for asperities of this compliance (n,); 0 if none.

    The proof is by Cholesky's factorisation or by overlapping shells.
    """
    if not influence.stored and len(influence) > FACTORISED:
        return overlapping_margin(influence, influence.scale / compliance, CROWDED_MARGINS)
    scaled, error = _scaled(influence, compliance), influence.entry_error + 8 * ROUNDOFF
    return largest(CROWDED_MARGINS, lambda each: proved_margin(scaled, (each,), error) > 0)


def _scaled(influence: Influence, compliance: Array) -> Array:
    """The matrix H^(-1/2) A H^(-1/2), with the diagonal H of `compliance`."""
    root = 1.0 / np.sqrt(compliance)
    scaled: Array = influence.matrix * root * root[:, None]
    return scaled


def crowded(problem: NormalProblem, loads: Array) -> Indices:
    """Indices of loaded asperities that probably prevent a proof of convexity.

    They are the asperities of pairs that are too close for convexity. If there is no such pair,
    they are the asperities whose shells meet other shells; if no shells meet, all with a load.
    """
    which = np.flatnonzero(loads)
    if len(which) < 2:
        return which
    influence = problem.influence.restricted(which)
    near = Nearest.of(influence.points, influence.scale / problem.compliance(loads)[which])
    for poor in (near.closest >= 1.0 - CROWDED_MARGINS[0], near.meeting):
        if poor.any():
            return which[poor]
    return which


def convex_margin(influence: Influence, compliance: Array, margins: Sequence[float]) -> float:
    """The first mu of `margins` with  I + H^(-1/2) A H^(-1/2) >= mu I  proved.

    0 if there is none, or if A is not stored as a matrix.
    """
    if not influence.stored:
        return 0.0
    error = influence.entry_error + 8 * ROUNDOFF
    return proved_margin(_scaled(influence, compliance), margins, error)
