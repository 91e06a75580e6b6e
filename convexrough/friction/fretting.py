"""Fretting: slip, energy loss and shear traction of each asperity in a steady cycle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from convexrough import checks
from convexrough.arrays import Array, frozen
from convexrough.contact import Contact, mean_pressures
from convexrough.friction.cycle import Cycle
from convexrough.friction.levels import FrictionLevels
from convexrough.friction.state import states_of, stick_radii
from convexrough.plottable import Plottable
from convexrough.progress import LOGGER
from convexrough.record import Along, Table
from convexrough.sphere import hertz, mindlin

#: The largest traction in a contact disc is sought at the contact radii at the vertices of the
#: memory curve (exact at constant load), and at about this number of other distances (to 0.1 %).
DISTANCES = 64


@dataclass(frozen=True, eq=False, repr=False)
class Fretting(Table, Plottable):
    """Fretting of each asperity in a steady cycle. Arrays are (n,), and 0 where open.

    contact          : the contact of the cycle
    maximum, minimum : [force] the largest and the smallest shear force of the cycle
    status           : `Cycle.status`
    slip_amplitudes  : [length] half the range of slip at the edge of the contact disc at the lowest
        load of the cycle; nan where contact is lost in the cycle ("intermittent"). The relative
        error is about 1e-7 for a cycle of 1e-6 f P at constant load, and grows at smaller forces
    gross_slip_amplitudes : [length] the same for the whole disc; 0 if some of it sticks
    losses, loss_errors : [force length] `Cycle.asperity_losses`, the energy lost per cycle, and
        bounds on their errors. If the load varies, their sum is less exact than `Cycle.loss`
    mean_tractions   : [force / length^2] the largest |shear force of the asperity / area of its
        contact disc| at the points of the path
    largest_tractions : [force / length^2] the largest absolute shear traction on the contact disc,
        over the points of the path; the error is about 0.1 % where the load varies

    If general steps give the results of the cycle (see `Cycle.order`), `loss_errors` is infinite,
    and all other arrays except the status are nan.
    """

    _along: ClassVar[Along] = {
        ("asperity",): (
            *("status", "slip_amplitudes", "gross_slip_amplitudes", "losses"),
            *("loss_errors", "mean_tractions", "largest_tractions"),
        )
    }

    contact: Contact
    maximum: float
    minimum: float
    status: NDArray[np.str_]
    slip_amplitudes: Array
    gross_slip_amplitudes: Array
    losses: Array
    loss_errors: Array
    mean_tractions: Array
    largest_tractions: Array


def fretting(cycle: Cycle) -> Fretting:
    """The fretting of each asperity in a steady cycle, which `cycle` or `steady` returns.

    docs/theory/losses.md, "Slip and traction inside a contact", gives the formulas.

    Raises InputError if `cycle` is not a `Cycle`.

    >>> worn = cr.fretting(cr.cycle(contact, maximum=0.1 * contact.load))
    >>> bool((worn.mean_tractions <= worn.largest_tractions).all())
    True
    """
    checks.instance("cycle", cycle, Cycle)
    contact, scene, walk = cycle.contact, cycle.scene, cycle._walk
    f, R, levels = checks.friction(scene.friction), scene.relative_radii, walk.levels
    modulus = scene.material.contact_modulus
    unknown = np.nan if walk.general is not None else 0.0  # the memory curve does not hold
    # Gaps are half the range of the slip of asperities that slide.
    gaps = -levels.to_scene(levels.depths(walk.stuck[0]))
    travel = f * float(mindlin.ratio(scene.material.poisson_ratio))
    gross = np.where(cycle.slips > 0, travel * np.maximum(gaps, 0.0), cycle.slips) + unknown
    a = stick_radii(levels, levels.at(walk.least))[0]
    rim = travel * a**2 / R
    stuck = np.divide(cycle.stick_radii, a, out=np.zeros(len(a)), where=a > 0)
    in_part = rim * rim_gap(np.minimum(stuck, 1.0))
    mean = largest = np.full(len(scene), unknown)
    known = cache(lambda load: stick_radii(levels, levels.at(load))[0])
    every = levels.to_scene(states_of(levels, walk.steady).forces.value)
    for k, (curve, forces) in enumerate(zip(walk.steady, every, strict=True), 1):
        LOGGER.info(f"tractions at point {k:,} of {len(every):,}")
        bends = [(load, float(bend)) for load, bend in curve.bends if bend and load]
        mean = np.maximum(mean, mean_pressures(np.abs(forces), known(curve.load)))
        radii = [known(load) for load, _ in bends]
        largest = np.maximum(largest, _largest(np.array([bend for _, bend in bends]), radii))
    return Fretting(
        contact=contact,
        maximum=cycle.maximum,
        minimum=cycle.minimum,
        status=cycle.status,
        slip_amplitudes=frozen(gross + in_part),
        gross_slip_amplitudes=frozen(gross),
        losses=cycle.asperity_losses,
        loss_errors=cycle.asperity_loss_errors,
        mean_tractions=frozen(mean),
        largest_tractions=frozen(f * hertz.peak_pressure(largest, modulus, R)),
    )


def _largest(bends: Array, radii: Sequence[Array]) -> Array:
    """(n,) the largest |sum_k b_k sqrt(a_k^2 - r^2)| over r; radii : a_k (n,), increasing."""
    squares = np.square(radii)
    parts = np.linspace(1.0, 0.0, max(4, DISTANCES // max(1, len(radii))), endpoint=False)
    largest = np.zeros(squares.shape[1:])
    for low, high in pairwise([0.0, *squares]):
        for part in parts:
            roots = np.sqrt(np.maximum(squares - low - (high - low) * (1.0 - part**2), 0.0))
            largest = np.maximum(largest, np.abs(bends @ roots))
    return largest


def rim_gap(x: Array) -> Array:
    """h(x): the gap of a Hertz contact of radius x r at the distance r, divided by r^2 / R."""
    root = np.sqrt((1.0 - x) * (1.0 + x))
    return np.maximum(0.5 - x**2 + ((2.0 * x**2 - 1.0) * np.arcsin(x) + x * root) / np.pi, 0.0)


def fretting_columns(worn: Sequence[Fretting]) -> dict[str, NDArray[Any]]:
    """The columns of fretting.csv; for each cycle there is a row for each asperity that touches."""
    rows = list[dict[str, NDArray[Any]]]()
    for each in worn:
        x, y = each.contact.scene.asperities.positions.T
        every = {name: np.full(len(x), getattr(each, name)) for name in ("maximum", "minimum")}
        every |= {"asperity": np.arange(len(x)), "x": x, "y": y}
        every |= each.columns("status", "losses", "loss_errors")  # these columns come first
        every |= each.columns()
        loaded = each.contact.cached(FrictionLevels).loads > 0
        rows.append({name: column[loaded] for name, column in every.items()})
    return {name: np.concatenate([row[name] for row in rows]) for name in rows[0]}
