"""`shakedown`: the largest factor by which a load path may be scaled so that sliding dies out.

Slip at the edges of contacts goes on. docs/theory/shakedown.md derives the limit with partial slip,
and Melan's limit for asperities that stick until they slide as a whole.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Any, ClassVar, Literal, cast

import numpy as np
from numpy.typing import ArrayLike

from convexrough import checks
from convexrough.arrays import Array, frozen
from convexrough.contact import Contact, press
from convexrough.errors import InputError, SolverError
from convexrough.friction.levels import FrictionLevels
from convexrough.friction.onset import MOST_ONSETS, Onset, enclosed, last_to_touch
from convexrough.friction.order import Order
from convexrough.friction.path import LEAST_PART
from convexrough.influence import Kind
from convexrough.melan.program import solve
from convexrough.plottable import Plottable
from convexrough.record import Along, Table, Variables
from convexrough.roundoff import SAFETY
from convexrough.scene.scene import Scene
from convexrough.vector_shear.problem import FrictionProblem, in_plane

Theory = Literal["exact", "elastic", "vector"]

#: The numbers of an array as exact fractions.
fractions: Any = np.frompyfunc(Fraction, 1, 1)


@dataclass(frozen=True, eq=False, repr=False)
class Shakedown(Table, Plottable):
    """The shakedown limit of a load path: the largest factor at which sliding dies out.

    The path has m points (P0, Q0) + factor (p, q) of normal load and shear force. The scene has n
    asperities and the coefficient of friction f.

    scene   : the scene
    kind    : "exact": with partial slip, for any path. "elastic" and "vector": for asperities that
        stick until they slide as a whole, by Melan's theorem at constant load. "elastic" uses the
        scalar tangential kernel, "vector" the full one, with shear forces in the plane
    factor  : the largest factor, at most `gross`, at which after some cycles no asperity that
        touches at P0 slides as a whole or opens
    limited_by : what happens in every cycle at larger factors: "sliding" of asperities as a whole,
        or "opening"; None if the factor is infinite
    lower, upper : proved bounds on `factor`; 0 and infinite without a proof
    factors : (n,) the same limit for each asperity alone; nan if it is not computed or the asperity
        does not touch at P0; for "vector" all are equal
    gross   : the factor at which the path reaches the friction limit f P of the whole contact
    witness : (n,) or (n, 2) [force] residual shear forces with which none slides at `lower`
    mechanism : (n,) slips at a factor slightly above `upper`, the largest scaled to 1; where
        opening limits the factor, gaps; for "vector" (m, n, 2), at each point of the path
    order   : for "exact" as `Cycle.order`; bounds are proved only if it is "proved". Else None
    load, force : [force] P0 and Q0; Q0 is (2,) for "vector"
    load_amplitudes, force_amplitudes : (m,) [force] p and q; q is (m, 2) for "vector"
    """

    _along: ClassVar[Along] = {
        ("asperity",): ("factors", "witness", "mechanism"),
        ("vertex",): ("load_amplitudes", "force_amplitudes"),
    }

    scene: Scene
    kind: Theory
    factor: float
    lower: float
    upper: float
    factors: Array
    gross: float
    witness: Array
    mechanism: Array
    load: float
    force: float | Array
    load_amplitudes: Array
    force_amplitudes: Array
    limited_by: Literal["sliding", "opening"] | None
    order: Order | None = None

    @property
    def gap(self) -> float:
        """(upper - lower) / factor; 0 if the factor is infinite."""
        return (self.upper - self.lower) / self.factor if np.isfinite(self.factor) else 0.0

    @property
    def proved(self) -> bool:
        """True if bounds on the factor are proved."""
        return self.lower > 0 and bool(self.upper < np.inf or self.factor == np.inf)

    def _variables(self) -> Variables:
        found = super()._variables()
        if self.kind == "vector":
            for name, along in (
                ("witness", ("asperity", "direction")),
                ("mechanism", ("vertex", "asperity", "direction")),
                ("force_amplitude", ("vertex", "direction")),
            ):
                found[name] = along, found[name][1]
        return found


def shakedown(
    scene: Scene,
    *,
    load: float,
    force: ArrayLike = 0.0,
    load_amplitudes: ArrayLike = 0.0,
    force_amplitudes: ArrayLike,
    kind: Theory = "exact",
    influence: Kind | None = None,
) -> Shakedown:
    """The largest factor by which a closed path may be scaled so that sliding dies out.

    The points of the path are (load, force) + factor (load_amplitudes, force_amplitudes).
    `Shakedown.factor` says when sliding dies out; docs/theory/shakedown.md derives the limits.

    load, force : [force] mean load P0 and shear force Q0; Q0 is (2,) for "vector"
    load_amplitudes : [force] (m,) or one number for all points; must be 0 unless `kind` is "exact"
    force_amplitudes : (m,) [force]; (m, 2) for "vector"
    kind      : "exact", "elastic" or "vector", as in `Shakedown`
    influence : compliance operator, as in `load_path`

    Raises InputError for invalid values, if |Q0| >= f P0 with the coefficient of friction f, or if
    all points of the path are equal.

    Example: in the scene of Dini and Hills (2009), sliding dies out for all amplitudes up to
    0.3517 f P. Here f = 0.5, so Q is 0.1 f P, and the largest amplitude is factor / 10 times f P.

    >>> Q = 0.05 * contact.load
    >>> limit = cr.shakedown(scene, load=contact.load, force_amplitudes=[Q, -Q])
    >>> f"{limit.factor / 10:.4f}"
    '0.3517'
    """
    checks.instance("scene", scene, Scene)
    f = checks.friction(scene.friction)
    P0 = checks.positive("load", load)
    if kind not in ("exact", "elastic", "vector"):
        raise InputError("kind", found=repr(kind), expected='"exact", "elastic" or "vector"')
    Q0: Any
    if kind == "vector":
        Q0, q = in_plane(force), checks.numbers("force_amplitudes", force_amplitudes)
        if q.ndim != 2 or q.shape[1] != 2 or not np.isfinite(q).all():
            expected = "finite numbers of shape (m, 2)"
            raise InputError("force_amplitudes", found=f"shape {q.shape}", expected=expected)
    else:
        Q0 = checks.finite("force", cast("float", force))
        q = checks.array("force_amplitudes", np.atleast_1d(np.asanyarray(force_amplitudes)))
    p = checks.array("load_amplitudes", load_amplitudes, length=len(q), one="force amplitude")
    t0, t = Q0 / f, q / f
    if kind != "vector":  # exactly, as the factor can depend on small differences
        t0, t, p = Fraction(Q0) / Fraction(f), fractions(q) / Fraction(f), fractions(p)
    if (np.hypot(*t0) if kind == "vector" else abs(t0)) >= P0:
        raise InputError("force", found=force, expected=f"less than f P = {f * P0:g} in size")
    if len(q) == 0 or not (np.ptp(p) > 0 or np.ptp(q, axis=0).any()):
        expected = "a path that moves: at least two points, such as [Q, -Q]"
        given = "one point" if len(q) else "none"
        raise InputError("force_amplitudes", found=given, expected=expected)
    if kind != "exact" and np.any(p):
        expected = 'none, as the kind is not "exact": the normal load must be constant'
        raise InputError("load_amplitudes", found=str([*map(float, p)])[:60], expected=expected)
    size = float(max(np.abs(q).max() / f, np.abs(p).max()))
    if size < LEAST_PART * P0:
        expected = f"at least {LEAST_PART:g} of the load"
        found = f"up to {size:g} (forces divided by f)"
        raise InputError("force_amplitudes", found=found, expected=expected)
    contact = press(scene, load=P0, influence=influence)
    if kind == "exact":
        limit = _exact(contact, t0, p, t)
    else:
        limit = (_elastic if kind == "elastic" else solve)(contact, t0, t)
    limit["witness"] = f * limit["witness"]
    for name in ("factors", "witness", "mechanism"):
        limit[name] = frozen(limit[name])
    return Shakedown(
        scene=scene,
        kind=kind,
        **limit,
        load=P0,
        force=frozen(Q0) if kind == "vector" else float(Q0),
        load_amplitudes=frozen(np.asarray(p, dtype=np.float64)),
        force_amplitudes=frozen(q),
    )


def _exact(contact: Contact, t0: Fraction, p: Any, t: Any) -> dict[str, Any]:
    """Fields of the result with partial slip; the shear forces t0 and t are divided by f."""
    levels = contact.cached(FrictionLevels)
    P0 = levels.load
    plus, minus = (-(p + t)).max(), (-(p - t)).max()
    fall = (plus + minus) / 2  # of the load L* per unit of the factor
    gross = min((P0 + c * t0) / r if r > 0 else np.inf for c, r in ((1, plus), (-1, minus)))
    touching = np.flatnonzero(contact.loads)
    last, worst = last_to_touch(levels)
    few = touching.tolist() if len(touching) <= MOST_ONSETS else []
    found = {last: worst} | enclosed(levels, few)

    def factor(onset: Fraction) -> float:
        """The factor at which L* (docs/theory/shakedown.md) is `onset`, or that of gross
        sliding."""
        return float(min((P0 - onset) / fall if fall > 0 else np.inf, gross))

    factors = np.full(len(contact.scene), np.nan)
    for asperity, onset in found.items():
        factors[asperity] = factor(onset.load)
    limit, opens = float(factors[last]), fall <= max(-p) * (1 + SAFETY)
    if limit == float(gross) < np.inf:  # where P - |T| is 0, sliding as a whole needs a force
        heights = abs(t0 + Fraction(limit) * t)
        opens = heights[np.argmin(P0 + Fraction(limit) * p - heights)] <= SAFETY * P0
    sure, top = levels.at(worst.upper), levels.top
    lower, upper = factor(worst.upper), factor(worst.lower)
    highest = float(P0) + float(max(p)) * upper * (1 + SAFETY) if max(p) > 0 else 0.0
    order = _order(contact, worst, highest)
    proved = order == "proved" and bool((top.touching | top.open).all())
    proved = proved and bool(levels.to_scene(sure.touching)[touching].all())
    gaps = np.maximum(-levels.to_scene(levels.depths(worst.lower)), 0.0) * (contact.loads > 0)
    # The point (L*, T*) at the lower bound, or at the factor 0 if there is no limit.
    part = Fraction(lower * (1 - SAFETY)) if lower < np.inf else Fraction(0)
    at_last = worst.upper if lower < float(gross) else min(P0, P0 - part * fall)
    height = min(max(t0 - part * (plus - minus) / 2, -at_last), at_last)
    rest = levels.to_scene(levels.at(at_last).loads.value * levels.units.force)
    return {
        "factor": limit,
        "limited_by": None if limit == np.inf else "opening" if opens else "sliding",
        "lower": lower * (1 - SAFETY) if proved else 0.0,
        "upper": upper * (1 + SAFETY) if proved else np.inf,
        "factors": factors,
        "gross": float(gross),
        "witness": float(height / (at_last or 1)) * rest,
        "mechanism": gaps / (gaps.max() or 1.0),
        "order": order,
    }


def _order(contact: Contact, onset: Onset, highest: float) -> Order:
    """What is proved about order from loads near the `onset` to the highest load of the path."""
    levels = contact.cached(FrictionLevels)
    if highest > levels.load:
        if not (np.isfinite(highest) and contact.certificate.scope == "global"):
            return "fails"
        try:
            levels = press(contact.scene, load=highest).cached(FrictionLevels)
        except (InputError, SolverError):  # also for loads beyond the range of numbers
            return "fails"
    return levels.order({onset.lower, onset.upper})


def _elastic(contact: Contact, t0: Fraction, t: Any) -> dict[str, Any]:
    """Fields of the result with the scalar kernel: the least factor of asperities and of gross
    sliding. The elastic shares q are the derivatives of the normal loads by the total load.
    """
    problem, high, low = contact.cached(FrictionProblem), t.max(), t.min()
    unit, total = problem.units.force, problem.levels.load
    P, q = problem.levels.top.loads[problem.places], problem.elastic
    each = P / q * (2.0 * unit / float(high - low))  # where the range of a shear force is 2 P_i
    ends = (total - t0, high), (total + t0, -low)
    gross = float(min(room / run if run > 0 else np.inf for room, run in ends))
    limits = np.abs(each.value)
    factor = min(float(limits.min()), gross)
    sure = problem.levels.top.touching | problem.levels.top.open
    proved = bool(q.positive.all() and sure.all())  # the solution holds for positive shares only
    critical = np.arange(len(P)) == int(np.argmin(limits)) if factor < gross else np.ones(len(P))
    # The force at rest may lie from -P_i - factor q_i low to P_i - factor q_i high.
    travelled = np.outer(factor * q.value / unit, (float(low), float(high)))
    room_low, room_high = -P.value - travelled.min(axis=1), P.value - travelled.max(axis=1)
    width = room_high - room_low
    part = (float(t0) / unit - room_low.sum()) / (width.sum() or 1.0)
    factors = np.full(len(contact.scene), np.nan)
    factors[problem.touching] = limits
    return {
        "factor": factor,
        "limited_by": "sliding",
        "lower": max(min(float(each.lower.min()), gross), 0.0) * (1 - SAFETY) if proved else 0.0,
        "upper": min(float(each.upper.min()), gross) * (1 + SAFETY) if proved else np.inf,
        "factors": factors,
        "gross": gross,
        "witness": problem.to_scene(unit * (room_low + part * width)),
        "mechanism": problem.to_scene(np.asarray(critical, dtype=np.float64)),
    }
