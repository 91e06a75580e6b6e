"""`shear`: the friction state of a pressed contact (Ciavarella-Jaeger), from a certified Contact.

With u the increments of `shearing.problem`, f the friction and c_t Mindlin's ratio: the
asperity forces are Q_i = f u_i, displacements are c_t f times those of the normal problem. At
every loaded asperity the displacement of the deep points is, [A16] of the source doubled,

    X = displacement_i + sum_j c_t A_ij Q_j,    displacement_i = X_i + slip_i.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from convexrough import checks
from convexrough.arrays import Array, Indices, frozen
from convexrough.contact import Contact
from convexrough.drawn import Drawn
from convexrough.errors import InputError
from convexrough.progress import Announce
from convexrough.record import Along, Table
from convexrough.shearing.certificate import ShearCertificate
from convexrough.shearing.judgement import judge_states
from convexrough.shearing.many_states import by_matrices
from convexrough.shearing.normal_map import States, gross_sliding
from convexrough.shearing.problem import TangentialProblem

if TYPE_CHECKING:
    from convexrough.gradients.adjoint import Holding
    from convexrough.gradients.change import Direction, ShearChange
    from convexrough.gradients.gradient import Gradient

#: Of more loaded asperities than this, coupled by an operator, the onset of some only is found.
MOST_ONSETS = 256


@dataclass(frozen=True, eq=False, repr=False)
class ShearState(Table, Drawn):
    """A friction state. Arrays are (n,), in the order of the scene's asperities.

    force         : Q [force];  displacement : X of the deep points, both bodies [length]
    forces        : Q_i [force], sum Q
    displacements : X_i + slip_i [length]: own deflection and slip, without the others' influence
    slips         : [length] gross slip, 0 where not sliding
    stick_radii   : c_i [length], 0 where sliding

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

    def gradient(
        self,
        *,
        displacement: float | None = None,
        forces: ArrayLike | None = None,
        slips: ArrayLike | None = None,
        holding: Holding | None = None,
        tolerance: float = 1e-9,
    ) -> Gradient:
        """Derivatives of a weighted sum of results with respect to the scene.

        displacement : weight on X;  forces, slips : (n,) weights on those of the asperities
        holding, tolerance : as in `Contact.gradient`; the shear force is held, also where a
            displacement was prescribed: `Gradient` says how to hold that

        Raises InputError in gross sliding where several asperities slide last, or the approach is
        held: there is no derivative.

        >>> gradient = cr.shear(contact, force=0.25 * contact.load).gradient(displacement=1.0)
        >>> print(f"{gradient.value:.4g}", f"{gradient.force:.4g}")
        9.88e-06 124.6
        """
        from convexrough.gradients.states import state_gradient  # a floor above: when asked

        return state_gradient(
            self,
            displacement=displacement,
            forces=forces,
            slips=slips,
            holding=holding,
            tolerance=tolerance,
        )

    def change(self, direction: Direction, *, tolerance: float = 1e-9) -> ShearChange:
        """How forces, slips and the displacement change, to first order, when the scene does.

        direction : of what, by how much;  tolerance : as in `gradient`

        Raises InputError in gross sliding.
        """
        from convexrough.gradients.change import shear_change  # a floor above: when asked

        return shear_change(self, direction, tolerance=tolerance)


def shear(
    contact: Contact,
    *,
    force: float | None = None,
    displacement: float | None = None,
    announce: Announce | None = None,
) -> ShearState:
    """Shear a pressed contact, first loading, at constant normal load.

    force [force] Q or displacement [length] X of the deep points : exactly one. The displacement
        grows with the force, which is solved for; the certificate is that of the state found.
    announce : told in a line how far long work has come

    Raises InputError if the scene has no friction or |Q| exceeds f P (gross sliding) or X its
    displacement there, and SolverError where Newton's method stops without an answer.

    >>> state = cr.shear(contact, force=0.25 * contact.load)
    >>> print((state.status == "sliding").sum(), f"{state.displacement:.3g}")
    6 9.88e-06
    """
    checks.instance("contact", contact, Contact)
    friction = checks.friction(contact.scene.friction)
    checks.exactly_one("force", force, "displacement", displacement)
    if displacement is not None:
        moved = checks.finite("displacement", displacement)
        force = float(np.copysign(forces_at(contact, np.array([abs(moved)]))[0], moved))
    assert force is not None  # exactly_one
    given = checks.bearable("force", force, friction * contact.load)
    if given.ndim:
        raise InputError("force", found=f"shape {given.shape}", expected="one number")
    force = float(given)
    if contact.load == 0.0:
        return _nothing_loaded(contact)
    problem = TangentialProblem.of(contact)
    total = abs(force) / friction / problem.units.force
    states = problem.solve(problem.limited(np.array([total])), announce=announce)
    bounds = judge_states(problem, states)

    def in_scene(values: Array, unit: float) -> Array:
        return frozen(problem.to_scene(values * unit))

    sign = float(np.sign(force))
    increments, touching = states.increments[0], problem.touching
    left = np.maximum(1.0 - np.abs(increments) / problem.loads, 0.0)
    return ShearState(
        contact=contact,
        force=force,
        displacement=sign * float(states.rises[0]) * problem.travel_unit,
        forces=in_scene(sign * increments, problem.force_unit),
        displacements=in_scene(sign * states.deflections[0], problem.travel_unit),
        slips=in_scene(sign * states.slips[0], problem.travel_unit),
        stick_radii=in_scene(contact.contact_radii[touching] * np.cbrt(left), 1.0),
        certificate=ShearCertificate.of(problem, bounds),
    )


def forces_at(contact: Contact, displacements: Array) -> Array:
    """(m,) [force] Q >= 0 that give the deep points displacements X >= 0 [length], first loading.

    X grows with Q, so that each is a root in a bracket; its states start from those found before.
    """
    from scipy.optimize.elementwise import find_root  # 0.1 s to import: only when asked

    farthest = 0.0
    if contact.load > 0.0:
        problem = TangentialProblem.of(contact)
        farthest = gross_sliding(problem)[2] * problem.travel_unit
    if not (displacements <= farthest * (1 + 1e-14)).all():
        raise InputError(
            "displacement",
            found=f"{displacements.max():.17g}: gross sliding",
            expected=f"at most X = {farthest:.17g}, where the last asperity slides",
        )
    if farthest == 0.0:
        return np.zeros(len(displacements))
    near: States | None = None

    def beyond(totals: Array, rise: Array) -> Array:
        nonlocal near
        near = problem.solve(problem.limited(totals), known=near)
        return near.rises - rise

    found = find_root(
        beyond,
        (np.zeros(len(displacements)), np.full(len(displacements), problem.limit)),
        args=(np.minimum(displacements, farthest) / problem.travel_unit,),
        tolerances={"xrtol": 1e-15, "xatol": 0.0, "frtol": 0.0, "fatol": 0.0},
    )
    return np.asarray(found.x * problem.force_unit)


def onset_of_sliding(contact: Contact, *, which: ArrayLike | None = None) -> Array:
    """(n,) [force] the shear force at which each asperity starts to slide on first loading.

    The same as the amplitude (maximum - minimum) / 2 of a steady cycle below which its sliding has
    shaken down to partial slip. nan where the asperity carries no load.

    which : indices of the asperities to look at, in this order; default all. Each takes about
        ten friction states of the contact, so of many loaded asperities some must be named.

    >>> onsets = cr.onset_of_sliding(contact, which=[0, 36])
    >>> print((onsets / contact.load).round(3))
    [0.5   0.176]
    """
    from scipy.optimize.elementwise import find_root  # 0.1 s to import: only when asked

    checks.instance("contact", contact, Contact)
    checks.friction(contact.scene.friction)
    asked = indices("which", which, len(contact.scene))
    onsets = np.full(len(asked), np.nan)
    loaded = np.flatnonzero(contact.loads[asked])
    if len(loaded) == 0:
        return frozen(onsets)
    problem = TangentialProblem.of(contact)
    if not by_matrices(problem) and len(loaded) > MOST_ONSETS:
        raise InputError(
            "which",
            found=f"{len(loaded):,} loaded asperities",
            expected=f"at most {MOST_ONSETS} of them, each of which takes some states of all",
        )
    places = np.searchsorted(problem.touching, asked[loaded])
    near: States | None = None

    def beyond(totals: Array, index: Array) -> Array:
        nonlocal near
        states = near = problem.solve(totals, known=near)
        rows = np.arange(len(totals))
        margin: Array = states.deflections[rows, index] - problem.ceilings[index]
        return np.where(problem.at_limit(totals), np.maximum(margin, 0.0), margin)

    found = find_root(
        beyond,
        (np.zeros(len(loaded)), np.full(len(loaded), problem.limit)),
        args=(places,),
        tolerances={"xrtol": 1e-15, "xatol": 0.0, "frtol": 0.0, "fatol": 0.0},
    )
    onsets[loaded] = found.x * problem.force_unit
    return frozen(onsets)


def indices(what: str, which: ArrayLike | None, n: int) -> Indices:
    """Indices of asperities of a scene of n, checked; default all."""
    if which is None:
        return np.arange(n)
    asked = np.atleast_1d(np.asarray(which))
    whole = asked.ndim == 1 and (np.issubdtype(asked.dtype, np.integer) or asked.size == 0)
    if not whole or (asked < 0).any() or (asked >= n).any():
        expected = f"whole numbers from 0 to {n - 1}: indices of asperities of the scene"
        raise InputError(what, found=repr(which)[:60], expected=expected)
    return asked.astype(np.intp)


def _nothing_loaded(contact: Contact) -> ShearState:
    zero = frozen(np.zeros(len(contact.scene)))
    certificate = ShearCertificate.of_no_load(contact.certificate)
    return ShearState(contact, 0.0, 0.0, zero, zero, zero, zero, certificate)
