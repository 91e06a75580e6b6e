"""How strongly to prune: what is proved of the contact, and how far its model holds, by pruning.

The weaker the pruning, the more summits stand on the shoulders of others. Two summits whose
contacts overlap are one contact with two bumps, which the model of point forces does not know; and
summits that crowd keep the energy from being convex, and so the answer from being proved.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from convexrough import checks
from convexrough.arrays import Array, Indices, frozen
from convexrough.contact import Contact
from convexrough.errors import SolverError
from convexrough.plottable import Plottable
from convexrough.progress import LOGGER
from convexrough.record import Along, Table
from convexrough.scene.asperities import Asperities
from convexrough.surface.summits import Summits

#: Parts of the largest height by which a curve is drawn.
LEVELS = (0.0, 0.002, 0.005, 0.01, 0.02, 0.03, 0.05, 0.07, 0.1, 0.15, 0.2, 0.3, 0.4, 0.5)

#: Crowding above which contact discs overlap, and the model error that is too much with it.
OVERLAP, TOO_FAR = 1.0, 0.05

#: What presses a sphere on asperities.
Press = Callable[[Asperities], Contact]


@dataclass(frozen=True, eq=False, repr=False)
class Provability(Table, Plottable):
    """Contacts at stronger and stronger pruning. Arrays are (m,), a value for each pruning.

    prune, heights : part of Sz, and [length] that a hill must be prominent
    summits     : how many there are;  contacts, undecided : how many touch, and may or may not
    scope       : of the certificate; "failed" where no solution was found
    crowding, model_error : as of `Contact`; nan where no solution was found
    approaches, loads : [length] and [force]

    >>> summits = cr.surface.self_affine(0.8, 0.1, 32.0, seed=1).summits(prune=0.0)
    >>> def press(asperities):
    ...     return cr.press(cr.Scene(1e4, asperities, cr.Material(1.0, 0.3)), load=10.0)
    >>> curve = cr.surface.provability(summits, press, levels=[0.0, 0.1])
    >>> curve.trusted.tolist()
    [True, True]
    """

    _shown = ("trusted_from",)
    _along: ClassVar[Along] = {
        ("level",): (
            "prune", "heights", "summits", "contacts", "undecided", "scope", "crowding",
            "model_error", "approaches", "loads", "trusted",
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
    def trusted(self) -> NDArray[np.bool_]:
        """(m,) all statuses are proved, no discs overlap, and the model error is below 5 %."""
        proved = np.isin(self.scope, ("global", "local")) & (self.undecided == 0)
        return frozen(proved & (self.crowding <= OVERLAP) & (self.model_error <= TOO_FAR))

    @property
    def trusted_from(self) -> float:
        """The pruning from which on every stronger one is trusted; nan where the last is not."""
        doubted = np.flatnonzero(~self.trusted)
        first = int(doubted[-1]) + 1 if len(doubted) else 0
        return float(self.prune[first]) if first < len(self.prune) else float("nan")


def provability(
    summits: Summits,
    press: Press,
    *,
    levels: Sequence[float] = LEVELS,
) -> Provability:
    """Press what is left of the summits at each pruning, and look how far that can be trusted.

    summits : found with a pruning no stronger than the weakest, such as 0
    press   : what makes a Contact of asperities, all of which it presses in the same way
    levels  : prunings, as parts of Sz; those at which nothing is left end the curve

    >>> summits = cr.surface.self_affine(0.8, 0.1, 32.0, seed=1).summits(prune=0.0)
    >>> material = cr.Material(1.0, 0.3)
    >>> def press(asperities):
    ...     return cr.press(cr.Scene(1e4, asperities, material), load=10.0)
    >>> cr.surface.provability(summits, press).trusted_from
    0.0
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
    """Pairs (m, 2) of asperities with a crowding (a_i + a_j) / r_ij above a value, and that, (m,).

    The most crowded first.

    >>> pairs, values = cr.surface.crowded(contact, above=0.5)
    >>> print(len(pairs), f"{values.max() / contact.crowding:.6g}")
    12 1
    """
    from scipy.spatial import cKDTree  # 0.1 s to import: only when asked

    checks.instance("contact", contact, Contact)
    touching = np.flatnonzero(contact.contact_radii)
    points, radii = contact.scene.contact_points[touching], contact.contact_radii[touching]
    if len(touching) < 2:
        return np.zeros((0, 2), dtype=np.intp), np.zeros(0)
    pairs = cKDTree(points).query_pairs(2 * radii.max() / above, output_type="ndarray")
    i, j = pairs.T
    values = (radii[i] + radii[j]) / np.hypot(*(points[i] - points[j]).T)
    worst = np.argsort(-values, kind="stable")
    worst = worst[values[worst] > above]
    return frozen(touching[pairs[worst]]), frozen(values[worst])


def model_errors(contact: Contact) -> Array:
    """(n,) of each asperity what `Contact.model_error` is the largest of; 0 where it is open.

    The pressure of a neighbour displaces the surface by a_j^2 / (10 r_ij^2) of P_j / (pi E* r_ij)
    more than a point force does; in parts of the asperity's own prescribed approach.

    >>> print(f"{cr.surface.model_errors(contact).max() / contact.model_error:.6g}")
    1
    """
    checks.instance("contact", contact, Contact)
    scene, errors = contact.scene, np.zeros(len(contact.loads))
    touching = np.flatnonzero(contact.loads)
    points = scene.contact_points[touching]
    strengths = (contact.loads * contact.contact_radii**2)[touching]
    prescribed = (contact.approach + scene.offsets)[touching]
    scale = 10 * np.pi * scene.material.contact_modulus
    for some in np.array_split(np.arange(len(touching)), 1 + len(touching) // 1000):
        apart = np.hypot(*(points[some, None] - points).transpose(2, 0, 1))
        apart[np.arange(len(some)), some] = np.inf
        errors[touching[some]] = (strengths / apart**3).sum(axis=1) / scale / prescribed[some]
    return frozen(errors)


def _pressed(summits: Summits, press: Press) -> tuple[int, int, str, float, float, float, float]:
    try:
        contact = press(summits)
    except SolverError:
        unknown = float("nan")
        return 0, len(summits), "failed", unknown, unknown, unknown, unknown
    statuses, proof = contact.status, contact.certificate
    touching = np.count_nonzero(contact.loads if proof.scope == "none" else statuses == "contact")
    return (
        int(touching),
        int(np.count_nonzero(statuses == "undecided")),
        proof.scope,
        contact.crowding,
        contact.model_error,
        contact.approach,
        contact.load,
    )
