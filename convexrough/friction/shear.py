"""`shear`: the friction state of a pressed contact after monotonic shear at constant load."""

from __future__ import annotations

from dataclasses import dataclass, field
from fractions import Fraction
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from convexrough import checks
from convexrough.arithmetic.balls import Ball, of_rows
from convexrough.arrays import Array, frozen
from convexrough.contact import Contact
from convexrough.errors import InputError
from convexrough.friction.curve import MemoryCurve
from convexrough.friction.levels import FrictionLevels
from convexrough.friction.order import Order
from convexrough.friction.state import stick_radii
from convexrough.friction.walk import Walk
from convexrough.normal.boxes import Scope
from convexrough.plottable import Plottable
from convexrough.progress import LOGGER
from convexrough.record import Along, Proved, Table

if TYPE_CHECKING:
    from convexrough.gradients.change import Direction, ShearChange
    from convexrough.gradients.gradient import Gradient, Holding


@dataclass(frozen=True, eq=False, repr=False)
class ShearCertificate(Proved):
    """What is proved about a friction state, however it was computed. Arrays are (n,), in the
    order of the scene's asperities.

    scope  : as in `Certificate`, for the pressed contact; "none" if nothing is proved
    order  : what is proved about order from the load P - |Q|/f to P (docs/theory/states.md,
        "Order"). "proved": statuses and bounds hold for the true state. "proved for one step": they
        hold for the solution of one general step (docs/theory/without-order.md) from rest to Q,
        the true state unless an asperity's deflection by its own force decreased on the way.
        "fails": nothing is proved
    status : "sliding" (proved to slide as a whole), "partial" (proved to keep a stick disc),
        "open" (proved to carry no load) or "undecided"
    force_errors : [force] bounds on |force - solution|
    slip_errors, stick_radius_errors : [length] bounds on the errors of slips and stick radii
    force_error : [force] bound on the error of the shear force; 0 if it is prescribed and below f P
    displacement_error : [length] bound on the error of the displacement; 0 if it is prescribed,
        unless the contact slides as a whole; infinite if `order` is "fails"

    >>> judged = cr.shear(contact, force=0.25 * contact.load).certificate
    >>> judged.scope, judged.all_proved, (judged.status == "sliding").sum().item()
    ('global', True, 6)
    """

    _shown = ("all_proved",)
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
    def all_proved(self) -> bool:
        """True if every asperity is proved to slide, to keep a stick disc, or to be open.

        It does not judge given forces: see `force_errors`, or use `verify_shear`.
        """
        return self.scope != "none" and not bool((self.status == "undecided").any())


@dataclass(frozen=True, eq=False, repr=False)
class ShearState(Table, Plottable):
    """A friction state after monotonic shear. Arrays are (n,), in the order of the asperities.

    contact       : the pressed contact
    force         : [force] shear force Q on the contact
    displacement  : [length] relative tangential displacement of distant points of the two bodies
    forces        : [force] shear forces on the asperities; their sum is Q
    displacements : [length] tangential displacement of each asperity by its own force, plus slip
    slips         : [length] gross slip; 0 where the asperity does not slide
    stick_radii   : [length] radii of the stick discs; 0 where the asperity slides or is open
    certificate   : what is proved about this state
    height        : [force] Q / f, without rounding

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
    height: Fraction = field(repr=False)

    @property
    def status(self) -> NDArray[np.str_]:
        """(n,) "sliding", "partial", "open" or "undecided"; each of the first three is proved."""
        return self.certificate.status

    @property
    def order(self) -> Order:
        """Whether indentations are proved to rise with the load, as in `ShearCertificate.order`."""
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

        displacement, forces, slips : weights of the displacement and, (n,), of forces and slips
        holding : quantity kept constant, as in `Contact.gradient`. The shear force is constant,
            too; `Gradient` says how to keep a prescribed displacement constant

        Raises InputError if there is no derivative. In gross sliding there is none if the approach
        is kept constant, or if several asperities start to slide last, at the same shear force.

        >>> gradient = cr.shear(contact, force=0.25 * contact.load).gradient(displacement=1.0)
        >>> print(f"{gradient.value:.4g}", f"{gradient.force:.4g}")
        9.88e-06 124.6
        """
        from convexrough.gradients.results import state_gradient  # a higher layer

        return state_gradient(self, holding, displacement=displacement, forces=forces, slips=slips)

    def change(self, direction: Direction) -> ShearChange:
        """First-order changes of forces, slips and displacement when the scene changes.

        direction : changes of the scene, of the load or approach, and of the shear force

        Raises InputError in gross sliding, or if `direction` changes both load and approach.

        >>> state = cr.shear(contact, force=0.25 * contact.load)
        >>> state.change(cr.Direction(friction=0.01)).displacement < 0
        True
        """
        from convexrough.gradients.change import shear_change  # a higher layer

        return shear_change(self, direction)


def shear(
    contact: Contact, *, force: float | None = None, displacement: float | None = None
) -> ShearState:
    """The friction state of a pressed contact after monotonic shear at constant load P.

    With order it is the difference of two normal solutions, (1) of docs/theory/states.md. If
    `order` is "fails" and the normal solution is proved, it comes from general steps.

    force [force] or displacement [length] : the prescribed one of shear force Q and relative
        tangential displacement of distant points. If `order` is "fails", a displacement gives the
        force of the memory curve, and the result's displacement is that under this force

    If |Q| or the displacement differs from its value at the onset of gross sliding (f P for |Q|) by
    at most 16 * 2^-53 of this value, it counts as that value, also in the result. So does a
    displacement that is larger by at most 1e-14 of it.

    Raises InputError if the scene has no friction, if |Q| exceeds f P, or if |displacement| exceeds
    that at which gross sliding starts; SolverError if a normal problem is not solved; ProofError if
    the approach is prescribed, and the force differs from f P by less than the error bound of f P.

    >>> state = cr.shear(contact, force=0.25 * contact.load)
    >>> print((state.status == "sliding").sum(), f"{state.displacement:.3g}")
    6 9.88e-06
    """
    checks.instance("contact", contact, Contact)
    friction = checks.friction(contact.scene.friction)
    checks.exactly_one("force", force, "displacement", displacement)
    LOGGER.info("pressing at the load P - Q / f")
    levels = contact.cached(FrictionLevels)
    loaded = levels.loads > 0
    P, start = levels.load, MemoryCurve.pressed(levels.load)
    if displacement is None:
        assert force is not None  # exactly_one
        if shape := np.shape(force):
            raise InputError("force", found=f"shape {shape}", expected="one number")
        force = checks.finite("force", force)
        checks.bearable("force", force, friction * float(P))
        height = levels.height(force)
    else:
        displacement = checks.finite("displacement", displacement)
        height = P - levels.displaced(abs(displacement))
        height = height if displacement >= 0 else -height
    walk = Walk(levels, start, [(P, height)])
    order, (moved, *each) = walk.order, (it[0] for it in walk.states())
    carried, asperities, drifts = (of_rows(levels.to_scene, it) for it in each)
    if walk.general is not None:
        squared = contact.scene.relative_radii * levels.to_scene(walk.general.fronts[0])
        radii, radius_errors = np.where(loaded, np.sqrt(squared), 0.0), np.zeros(len(loaded))
        total = Ball.exact(height) * levels.coefficient
    else:
        level = levels.at(P - abs(height))
        radii, radius_errors = stick_radii(levels, level)
        total = (levels.top.load - level.load) * levels.force_unit
        total = total if height >= 0 else -total
    # The given value may differ from gross sliding by rounding; general steps miss a displacement.
    if abs(height) == P or (force is None and walk.general is not None):
        force = displacement = None
    unsure = ~levels.to_scene(levels.top.touching) & levels.to_scene(~levels.top.open)
    most = np.abs(drifts.value) + drifts.error  # the slip is 0 if the asperity does not touch
    slip_errors = np.where(loaded, drifts.error, 0.0) + np.where(unsure, most, 0.0)
    unknown = np.inf if order == "fails" else 0.0
    status = walk.status()[0]
    certificate = ShearCertificate(
        scope=contact.certificate.scope if levels.proved and order != "fails" else "none",
        order=order,
        status=frozen(np.where(status == "stuck", "partial", status)),
        force_errors=frozen(carried.error),
        slip_errors=frozen(slip_errors + unknown),
        stick_radius_errors=frozen(radius_errors + unknown),
        force_error=float(total.error) + unknown if force is None else 0.0,
        displacement_error=float(moved.error) + unknown if displacement is None else unknown,
    )
    return ShearState(
        contact=contact,
        force=float(total.value) if force is None else force,
        displacement=float(moved.value) if displacement is None else displacement,
        forces=frozen(carried.value),
        displacements=frozen(np.where(loaded, asperities.value, 0.0)),
        slips=frozen(np.where(loaded, drifts.value, 0.0)),
        stick_radii=frozen(radii),
        certificate=certificate,
        height=height,
    )
