"""`shear`: the friction state of a pressed contact after monotonic shear at constant load."""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from convexrough import checks
from convexrough.arrays import Array, frozen
from convexrough.contact import Contact
from convexrough.errors import InputError
from convexrough.friction.curve import MemoryCurve
from convexrough.friction.general_step import followed
from convexrough.friction.levels import FrictionLevels, rounded
from convexrough.friction.order import Order
from convexrough.friction.state import stick_radii
from convexrough.friction.walk import Walk
from convexrough.normal.boxes import Scope
from convexrough.plottable import Plottable
from convexrough.progress import LOGGER
from convexrough.record import Along, Table
from convexrough.roundoff import SAFETY

if TYPE_CHECKING:
    from convexrough.gradients.change import Direction, ShearChange
    from convexrough.gradients.gradient import Gradient, Holding

#: An asperity keeps the status "sliding" of the solution if the error bound of its given force is
#: smaller than this fraction of the friction limit f P_i.
NEAR_SLIDING = 1e-2


@dataclass(frozen=True, eq=False, repr=False)
class ShearCertificate(Table):
    """What is proved about a friction state, independent of how it was computed.

    Arrays are (n,), in the order of the scene's asperities.

    scope  : scope of the certificate of the pressed contact; "none" where nothing is proved
    order  : "proved": no indentation falls as the load rises from P - Q/f to P (load P, shear force
        Q, coefficient of friction f), so statuses and bounds hold for the true state; "proved for
        one step": they hold for the result of one general step (docs/theory/without-order.md);
        "fails": nothing is proved
    status : "sliding" (proved to slide as a whole), "partial" (proved to keep a stick disc),
        "open" (proved to carry no load) or "undecided"
    force_errors : [force] bounds on |force - solution|
    slip_errors, stick_radius_errors : [length] bounds on the errors of slips and stick radii
    force_error : [force] bound on the error of the shear force; 0 if it is prescribed
    displacement_error : [length] bound on the error of the displacement; 0 if it is prescribed

    >>> judged = cr.shear(contact, force=0.25 * contact.load).certificate
    >>> judged.scope, judged.holds, (judged.status == "sliding").sum().item()
    ('global', True, 6)
    """

    _shown = ("holds",)
    _along: ClassVar[Along] = {
        ("asperity",): ("status", "force_errors", "slip_errors", "stick_radius_errors")
    }

    scope: Scope
    order: Order
    status: NDArray[np.str_]
    force_errors: Array
    slip_errors: Array
    stick_radius_errors: Array
    force_error: float
    displacement_error: float

    @property
    def holds(self) -> bool:
        """True if every asperity is proved to slide, to keep a stick disc, or to be open."""
        return self.scope != "none" and not bool((self.status == "undecided").any())


@dataclass(frozen=True, eq=False, repr=False)
class ShearState(Table, Plottable):
    """A friction state after monotonic shear. Arrays are (n,), in the order of the asperities.

    force         : [force] shear force Q on the contact
    displacement  : [length] relative tangential displacement of distant points of the two bodies
    forces        : [force] shear forces on the asperities; their sum is Q
    displacements : [length] own deflection plus slip, without the effect of other asperities
    slips         : [length] gross slip; 0 where the asperity does not slide
    stick_radii   : [length] radii of the stick discs; 0 where the asperity slides

    >>> state = cr.shear(contact, displacement=9.88e-6)
    >>> print(f"{state.force / contact.load:.3f}", (state.status == "sliding").sum())
    0.250 6
    """

    _shown = ("status",)
    _along: ClassVar[Along] = {
        ("asperity",): ("status", "forces", "displacements", "slips", "stick_radii")
    }

    contact: Contact
    force: float
    displacement: float
    forces: Array
    displacements: Array
    slips: Array
    stick_radii: Array
    certificate: ShearCertificate

    @property
    def status(self) -> NDArray[np.str_]:
        """(n,) "sliding", "partial", "open" or "undecided"; each of the first three is proved."""
        return self.certificate.status

    @property
    def order(self) -> Order:
        """Whether order is proved: as in `ShearCertificate`."""
        return self.certificate.order

    def gradient(
        self,
        *,
        displacement: float | None = None,
        forces: ArrayLike | None = None,
        slips: ArrayLike | None = None,
        holding: Holding | None = None,
    ) -> Gradient:
        """Derivatives of a weighted sum of results with respect to the scene.

        displacement  : weight of the displacement
        forces, slips : (n,) weights of the forces and slips of the asperities
        holding : quantity kept constant, as in `Contact.gradient`. The shear force is constant,
            too; `Gradient` says how to keep a prescribed displacement constant

        Raises InputError if there is no derivative. In gross sliding there is none if the approach
        is kept constant, or if several asperities slide last, at the same force.

        >>> gradient = cr.shear(contact, force=0.25 * contact.load).gradient(displacement=1.0)
        >>> print(f"{gradient.value:.4g}", f"{gradient.force:.4g}")
        9.88e-06 124.6
        """
        from convexrough.gradients.results import state_gradient  # a higher layer

        weights = {"displacement": displacement, "forces": forces, "slips": slips}
        return state_gradient(self, holding, **weights)

    def change(self, direction: Direction) -> ShearChange:
        """First-order changes of forces, slips and displacement when the scene changes.

        Raises InputError in gross sliding.
        """
        from convexrough.gradients.change import shear_change  # a higher layer

        return shear_change(self, direction)


def shear(
    contact: Contact,
    *,
    force: float | None = None,
    displacement: float | None = None,
) -> ShearState:
    """The friction state of a pressed contact after monotonic shear at constant load P.

    Prescribe one of the two:

    force        : [force] shear force Q. If its relative difference from the friction limit f P is
        at most 16 * 2^-53, it counts as f P, which means gross sliding
    displacement : [length] relative tangential displacement of distant points

    Raises InputError if the scene has no friction, if |Q| exceeds f P, or if the displacement
    exceeds that of gross sliding; SolverError if a normal problem is not solved.

    >>> state = cr.shear(contact, force=0.25 * contact.load)
    >>> print((state.status == "sliding").sum(), f"{state.displacement:.3g}")
    6 9.88e-06
    """
    checks.instance("contact", contact, Contact)
    friction = checks.friction(contact.scene.friction)
    checks.exactly_one("force", force, "displacement", displacement)
    LOGGER.info("pressing at the load P - Q / f")
    levels = contact.cached(FrictionLevels)
    if displacement is None:
        force = one_force("force", force, friction * contact.load)
        height = levels.height(force)
    else:
        displacement = checks.finite("displacement", displacement)
        height = levels.load - levels.displaced(abs(displacement))
        height = height if displacement >= 0 else -height
    return _state(contact, levels, height, force, displacement)


def one_force(what: str, value: Any, limit: float) -> float:
    """The shear force as a number, after a check that it does not exceed the friction limit."""
    if shape := np.shape(value):
        raise InputError(what, found=f"shape {shape}", expected="one number")
    return float(checks.bearable(what, np.asarray(checks.finite(what, value)), limit))


def _state(
    contact: Contact,
    levels: FrictionLevels,
    height: Fraction,
    force: float | None,
    displacement: float | None,
) -> ShearState:
    """The state at T = Q / f: by normal solutions, or by general steps if order fails."""
    start, loaded = MemoryCurve.pressed(levels.load), contact.loads > 0
    walk = Walk(levels, start, [(levels.load, height)])
    if walk.general is not None and displacement is not None:
        walk = Walk(levels, start, [(levels.load, _by_steps(levels, displacement))])
    found, order = walk.states(), walk.order
    if walk.general is not None:
        squared = contact.scene.relative_radii * walk.general.fronts[0]
        radii, radius_errors = np.where(loaded, np.sqrt(squared), 0.0), np.zeros(len(loaded))
        total = float(walk.points[0][1]) * checks.friction(contact.scene.friction)
        force_uncertainty = 0.0
    else:
        level = levels.at(levels.load - abs(height))
        radii, radius_errors = stick_radii(levels, level)
        size, off = rounded((levels.top.load - level.load) * levels.force_unit)
        total, force_uncertainty = float(np.copysign(size, displacement or 0.0)), float(off)
    error = float(found.displacement_errors[0]) if displacement is None else 0.0
    unsure = ~levels.to_scene(levels.top.touching) & levels.to_scene(~levels.top.open)
    most = np.abs(found.drifts[0]) + found.drift_errors[0]  # its slip is 0 if it does not touch
    slip_errors = np.where(loaded, found.drift_errors[0], 0.0) + np.where(unsure, most, 0.0)
    if order == "fails":
        error = force_uncertainty = np.inf
        slip_errors, radius_errors = slip_errors + np.inf, radius_errors + np.inf
    status = walk.status()[0]
    certificate = ShearCertificate(
        scope=contact.certificate.scope if levels.proved and order != "fails" else "none",
        order=order,
        status=frozen(np.where(status == "stuck", "partial", status)),
        force_errors=found.force_errors[0],
        slip_errors=frozen(slip_errors),
        stick_radius_errors=frozen(radius_errors),
        force_error=force_uncertainty if force is None else 0.0,
        displacement_error=error,
    )
    return ShearState(
        contact=contact,
        force=total if force is None else force,
        displacement=float(found.displacements[0]) if displacement is None else displacement,
        forces=found.forces[0],
        displacements=frozen(np.where(loaded, found.asperity_displacements[0], 0.0)),
        slips=frozen(np.where(loaded, found.drifts[0], 0.0)),
        stick_radii=frozen(radii),
        certificate=certificate,
    )


def _by_steps(levels: FrictionLevels, displacement: float) -> Fraction:
    """The value of T = Q / f for which general steps give this displacement."""
    from scipy.optimize import brentq  # 0.1 s to import: only when asked

    start = MemoryCurve.pressed(levels.load)

    def beyond(part: float) -> float:
        height = Fraction(part) * levels.load
        moved = followed(levels, start, [(levels.load, height)]).states.displacements[0]
        return float(moved - displacement)

    root = brentq(beyond, -1.0, 1.0, xtol=1e-12)
    return Fraction(root) * levels.load


def certify_shear(contact: Contact, forces: ArrayLike, *, force: float) -> ShearCertificate:
    """The certificate of given shear forces after monotonic shear.

    forces : (n,) [force] shear forces in the order of the scene's asperities
    force  : [force] the prescribed sum of the shear forces

    `force_errors` are bounds on the differences between the given forces and the solution. An
    asperity gets the status that it has in the solution if it is open there, or if its entry of
    `force_errors` is small enough. For "sliding" it must be below 1 % of the friction limit f P_i;
    for "partial" it must be below the margin f P_i - |Q_i|, with the force Q_i of the solution.
    Otherwise the asperity is "undecided". The rest of the certificate is that of the solution.

    Raises InputError if the scene has no friction, the force exceeds the friction limit f P, or
    the forces are not finite numbers.

    >>> force = 0.25 * contact.load
    >>> state = cr.shear(contact, force=force)
    >>> cr.certify_shear(contact, state.forces, force=force).holds
    True
    """
    checks.instance("contact", contact, Contact)
    checks.in_order("forces", forces)
    given = checks.array("forces", forces, length=len(contact.scene))
    return against(shear(contact, force=checks.finite("force", force)), given)


def against(state: ShearState, given: Array) -> ShearCertificate:
    """The certificate of given forces (n,) [force], from a comparison with a proved state."""
    contact = state.contact
    apart = np.abs(given - state.forces)
    errors = (apart + state.certificate.force_errors) * (1 + SAFETY)
    limits = checks.friction(contact.scene.friction) * contact.loads
    left = np.where(state.status == "sliding", NEAR_SLIDING * limits, limits - np.abs(state.forces))
    implied = (errors < left) | (state.status == "open")
    return replace(
        state.certificate,
        status=frozen(np.where(implied, state.status, "undecided")),
        force_errors=frozen(errors),
    )
