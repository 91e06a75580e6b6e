"""How the proof and the model error of a contact depend on the pruning of its summits.

Pruning removes hills of small prominence, which is the height of a maximum above the highest pass
to a taller maximum. With weak pruning many summits are close to others. Two summits with
overlapping contact discs are one contact, which the model of point forces does not describe. The
energy of crowded summits can also be nonconvex, and then the solution cannot be proved.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from convexrough import checks
from convexrough.arrays import Array, Indices, frozen
from convexrough.contact import Contact
from convexrough.errors import SolverError
from convexrough.plausibility import FEW
from convexrough.plottable import Plottable
from convexrough.progress import LOGGER
from convexrough.record import Along, Table
from convexrough.scene.asperities import Asperities
from convexrough.surface.summits import Summits

#: Default prunings, as fractions of the height Sz of the map.
LEVELS = (0.0, 0.002, 0.005, 0.01, 0.02, 0.03, 0.05, 0.07, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5)

#: Crowding above which contact discs overlap, and largest trusted model error.
OVERLAP, TOO_FAR = 1.0, 0.05

#: A function that presses a sphere on asperities.
Press = Callable[[Asperities], Contact]


@dataclass(frozen=True, eq=False, repr=False)
class Provability(Table, Plottable):
    """Contacts of the summits left by m prunings, the weakest pruning first. Arrays are (m,).

    prune, heights : least prominence of the hills that are left, as a fraction of the height Sz of
        the map and as a [length]
    summits, contacts, undecided : numbers of summits, of summits that are proved to touch, and of
        undecided summits; without a proof, summits with a load count as touching
    scope       : scope of the certificate; "failed" if no solution was found
    crowding, model_error : as in `Contact`; nan if no solution was found
    approaches, loads : [length] approach and [force] load of each contact

    An example is under `provability`.
    """

    _shown = ("trusted_from",)
    _along: ClassVar[Along] = {
        ("level",): (
            "prune", "heights", "summits", "contacts", "undecided", "scope", "crowding",
            "model_error", "approaches", "loads", "trusted", "doubts",
        ),
    }  # fmt: skip

    prune: Array
    heights: Array
    summits: Indices
    contacts: Indices
    undecided: Indices
    scope: NDArray[np.str_]
    crowding: Array
    model_error: Array
    approaches: Array
    loads: Array

    @property
    def doubts(self) -> NDArray[np.str_]:
        """(m,) the first assumption of the asperity model that is not met; "" if all are met."""
        proved = np.isin(self.scope, ("global", "local")) & (self.undecided == 0)
        assumed = {
            "status not proved": proved,
            "discs overlap": self.crowding <= OVERLAP,
            f"model error above {TOO_FAR:.0%}": self.model_error <= TOO_FAR,
            f"fewer than {FEW} contacts": self.contacts >= FEW,
        }
        return frozen(np.select([~met for met in assumed.values()], [*assumed], ""))

    @property
    def trusted(self) -> NDArray[np.bool_]:
        """(m,) True if statuses are proved, no discs overlap, errors are <= 5 %, and 5 touch."""
        return frozen(self.doubts == "")

    @property
    def trusted_from(self) -> float:
        """The smallest pruning that is trusted together with all stronger ones, apart from those
        that leave fewer than 5 contacts; nan if there is none."""
        doubted = np.flatnonzero(~self.trusted & (self.contacts >= FEW))
        rest = slice(int(doubted[-1]) + 1 if len(doubted) else 0, None)
        trusted = self.prune[rest][self.trusted[rest]]
        return float(trusted[0]) if len(trusted) else float("nan")


def provability(summits: Summits, press: Press, *, levels: Sequence[float] = LEVELS) -> Provability:
    """The contacts of the summits that are left at each pruning.

    summits : summits found with a pruning of at most the smallest one in `levels`, such as 0
    press   : function that returns the Contact of asperities
    levels  : prunings, as fractions of Sz; the curve ends where no summit is left

    >>> summits = cr.surface.self_affine(0.8, 0.1, 32.0, seed=1).summits(prune=0.0)
    >>> material = cr.Material(1.0, 0.3)
    >>> def press(asperities):
    ...     return cr.press(cr.Scene(1e4, asperities, material), load=10.0)
    >>> curve = cr.surface.provability(summits, press)
    >>> print(curve.trusted_from, curve.doubts[-1])
    0.0 fewer than 5 contacts
    """
    checks.instance("summits", summits, Summits)
    rows = []
    for prune in sorted({checks.between("levels", each, 0.0, 1.0) for each in levels}):
        if not (summits.prominences >= prune * summits.origin.max_height).any():
            break
        left = summits.pruned(prune)
        LOGGER.info(f"pruning {prune:.3g}: {len(left):,} summits")
        rows.append((prune, left.origin.threshold, len(left), *_pressed(left, press)))
    columns = [np.array(column) for column in zip(*rows, strict=True)]
    return Provability(*map(frozen, columns))


def crowded(contact: Contact, above: float = OVERLAP) -> tuple[Indices, Array]:
    """(m, 2) pairs of asperities with a crowding above a value, and (m,) their crowdings.

    The crowding of a pair is (a_i + a_j) / r_ij, with contact radii a and the distance r. The most
    crowded pairs are first.

    >>> pairs, values = cr.surface.crowded(contact, above=0.5)
    >>> print(len(pairs), f"{values.max() / contact.crowding:.6g}")
    12 1
    """
    checks.instance("contact", contact, Contact)
    touching = np.flatnonzero(contact.contact_radii)
    points, radii = contact.scene.contact_points[touching], contact.contact_radii[touching]
    reach = 2 * radii.max(initial=0.0) / above
    pairs = cKDTree(points).query_pairs(reach, output_type="ndarray")
    i, j = pairs.T
    values = (radii[i] + radii[j]) / np.hypot(*(points[i] - points[j]).T)
    worst = np.argsort(-values, kind="stable")
    worst = worst[values[worst] > above]
    return frozen(touching[pairs[worst]]), frozen(values[worst])


def _pressed(summits: Summits, press: Press) -> tuple[int, int, str, *tuple[float, ...]]:
    try:
        contact = press(summits)
    except SolverError:
        return 0, len(summits), "failed", *[np.nan] * 4
    statuses, scope = contact.status, contact.certificate.scope
    touching = np.count_nonzero(contact.loads if scope == "none" else statuses == "contact")
    undecided = np.count_nonzero(statuses == "undecided")
    numbers = contact.crowding, contact.model_error, contact.approach, contact.load
    return int(touching), int(undecided), scope, *numbers
