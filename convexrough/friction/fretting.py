"""Fretting: how far each asperity slips, what that costs, and the shear tractions that it bears.

Slip in a contact disc of radius a whose stick disc has the radius c grows towards the rim, where
its amplitude in a steady cycle is  f c_t [g + (a^2/R) h(c/a)],

    h(x) = 1/2 - x^2 + [(2 x^2 - 1) asin(x) + x sqrt(1 - x^2)] / pi:

g is the amplitude of gross slip over f c_t, 0 where a disc sticks, and the other term Hertz's gap
at r = a of a contact of radius c. The traction of first loading to the largest force is f p outside
the stick disc, and falls inwards from its edge: the largest is f p0 sqrt(1 - c^2/a^2).
Source: Johnson, Contact Mechanics (1985), sections 4.2 and 7.2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from convexrough import checks
from convexrough.arrays import Array, frozen
from convexrough.contact import Contact
from convexrough.errors import InputError
from convexrough.friction.cycle import Cycle
from convexrough.friction.shear import shear
from convexrough.plottable import Plottable
from convexrough.record import Along, Table
from convexrough.sphere import hertz, mindlin


@dataclass(frozen=True, eq=False, repr=False)
class Fretting(Table, Plottable):
    """Fretting of each asperity in a steady cycle at constant load; arrays are (n,), 0 where open.

    status           : that of the cycle
    slip_amplitudes  : [length] half the range of slip at the rim, where it is largest
    gross_slip_amplitudes : [length] half the range of slip of the whole disc, 0 where some sticks
    losses           : [force length] energy lost per cycle
    mean_tractions   : [force / length^2] |Q_i| / (pi a_i^2) at the largest force of the cycle
    largest_tractions : [force / length^2] the largest on the disc then

    >>> worn = cr.fretting(cr.cycle(contact, maximum=0.25 * contact.load))
    >>> print(f"{worn.slip_amplitudes.max():.3g}", worn.losses.argmax())
    3.21e-06 31
    """

    _along: ClassVar[Along] = {
        ("asperity",): (
            *("status", "slip_amplitudes", "gross_slip_amplitudes", "losses"),
            *("mean_tractions", "largest_tractions"),
        )
    }

    contact: Contact
    maximum: float
    minimum: float
    status: NDArray[np.str_]
    slip_amplitudes: Array
    gross_slip_amplitudes: Array
    losses: Array
    mean_tractions: Array
    largest_tractions: Array


def fretting(cycle: Cycle) -> Fretting:
    """The fretting of each asperity in a steady cycle. Raises InputError where the load varies.

    >>> worn = cr.fretting(cr.cycle(contact, maximum=0.1 * contact.load))
    >>> bool((worn.mean_tractions <= worn.largest_tractions).all())
    True
    """
    checks.instance("cycle", cycle, Cycle)
    if np.ptp(cycle.loads) > 0:
        raise InputError("cycle", found="a load that varies", expected="a constant normal load")
    contact, scene = cycle.contact, cycle.scene
    f, a, R = checks.friction(scene.friction), contact.contact_radii, scene.relative_radii
    peak = max(cycle.maximum, cycle.minimum, key=abs)
    state = shear(contact, force=peak)
    gross = cycle.slips / 2.0
    rim = f * float(mindlin.ratio(scene.material.poisson_ratio)) * a**2 / R
    in_part = rim * rim_gap(np.minimum(_over(cycle.stick_radii, a), 1.0))
    limits = f * hertz.peak_pressure(a, scene.material.contact_modulus, R)
    stuck = np.minimum(_over(state.stick_radii, a), 1.0)
    return Fretting(
        contact=contact,
        maximum=cycle.maximum,
        minimum=cycle.minimum,
        status=cycle.status,
        slip_amplitudes=frozen(gross + in_part),
        gross_slip_amplitudes=frozen(gross),
        losses=cycle.asperity_losses,
        mean_tractions=frozen(_over(np.abs(state.forces), np.pi * a**2)),
        largest_tractions=frozen(limits * np.sqrt((1.0 - stuck) * (1.0 + stuck))),
    )


def rim_gap(x: Array) -> Array:
    """h(x): Hertz's gap at the radius a over a^2 / R, of a contact of the radius x a."""
    root = np.sqrt((1.0 - x) * (1.0 + x))
    return np.maximum(0.5 - x**2 + ((2.0 * x**2 - 1.0) * np.arcsin(x) + x * root) / np.pi, 0.0)


def fretting_columns(worn: Sequence[Fretting]) -> dict[str, NDArray[Any]]:
    """The columns of fretting.csv: a row for each touching asperity in each cycle."""
    names = ("slip_amplitude", "gross_slip_amplitude", "mean_traction", "largest_traction")
    kept = [(each, np.flatnonzero(each.contact.loads)) for each in worn]

    def column(values: Any) -> NDArray[Any]:
        return np.concatenate([np.asarray(values(each, here)) for each, here in kept])

    return {
        "maximum": column(lambda each, here: np.full(len(here), each.maximum)),
        "minimum": column(lambda each, here: np.full(len(here), each.minimum)),
        "asperity": column(lambda each, here: here),
        "x": column(lambda each, here: each.contact.scene.asperities.positions[here, 0]),
        "y": column(lambda each, here: each.contact.scene.asperities.positions[here, 1]),
        "status": column(lambda each, here: each.status[here]),
        "loss": column(lambda each, here: each.losses[here]),
        **{name: column(lambda each, here, n=name: getattr(each, n + "s")[here]) for name in names},
    }


def _over(part: Array, whole: Array) -> Array:
    """(n,) part over whole, 0 where there is none."""
    quotient: Array = np.divide(part, whole, out=np.zeros(len(whole)), where=whole > 0)
    return quotient
