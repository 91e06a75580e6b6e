"""Friction states close to gross sliding, judged by what the shear force leaves unused.

docs/theory/shear-errors.md, "Close to gross sliding". Letters and arrays as in `judgement`.
"""

from __future__ import annotations

import numpy as np

from convexrough.roundoff import ROUNDOFF
from convexrough.shearing.bounds import OWN_ROUNDOFFS, SHARE_ROUNDOFFS, Bounds, Given, bounds_of
from convexrough.shearing.load_errors import couple_above
from convexrough.shearing.loss_errors import Nearness

#: Roundoffs, for each asperity, of sum P and of T, which is moved to sum P where it is that to
#: rounding (`TangentialEnergy.at_limit`): 2 (n - 1) and 2 (4 + log2 n), and a few of Q / f.
LIMIT_ROUNDOFFS = 12


def by_exhaustion(given: Given) -> Bounds:
    """docs/theory/shear-errors.md, "Close to gross sliding": each u_i is within sum P - T of P_i.

    With c = Delta - A u - ceiling: no c* of a loaded asperity is less than -`shortfall`, which
    bounds the rise from below and tells who slides; the least c* is not positive, which bounds it
    from above. Nothing is claimed of T beyond its rounding: not even that it is below sum P*.
    """
    problem, known, states = given.problem, given.known, given.states
    P, u, ceilings, sure = problem.loads, states.increments, problem.ceilings, known.sure
    complete = known.stray == 0 and bool(sure.all())
    doubt = known.errors.sum() + known.stray + LIMIT_ROUNDOFFS * len(P) * ROUNDOFF * P.sum()
    unused = (P.sum() - states.totals)[:, None]
    most = unused + doubt
    errors = known.errors + np.minimum(most + (P - u), P + np.abs(u))
    uncertainty = couple_above(problem, errors) + given.rounding + given.each[:, None]
    uncertainty += OWN_ROUNDOFFS * ROUNDOFF * ceilings
    uncertainty += ceilings * known.relative + known.stray_effect
    lacking = 1.5 * most / P
    shortfall = ceilings * np.maximum(lacking, lacking ** (2 / 3))
    beyond = given.available - ceilings  # c
    above = np.where(sure, beyond + shortfall + uncertainty, np.inf).min(axis=1)  # Delta - Delta*
    below = (uncertainty.max(axis=1) - beyond.min(axis=1)) if complete else np.inf
    sliding = sure & (beyond - uncertainty > above[:, None])
    rise_errors = np.maximum(above, below)
    # Where all but one are sure to slide, and not all can, that one does not.
    alone = complete & (unused[:, 0] > doubt) & (sliding.sum(axis=1) == len(P) - 1)
    partial = ~sliding & alone[:, None]
    slip_errors = uncertainty + rise_errors[:, None]
    each = errors + np.abs(u) * (known.relative + SHARE_ROUNDOFFS * ROUNDOFF)  # u* from t P*
    unknown = np.full(len(u), np.inf)
    near = Nearness(
        unknown, each, each, given.available, slip_errors, rise_errors, sliding, partial
    )
    return bounds_of(given, near, complete | sliding.any(axis=1), errors)
