"""`shear`: the friction state of a pressed contact (Ciavarella-Jaeger), from a certified Contact.

With u the increments of `convexrough.shearing.problem`, f the friction and c_t Mindlin's ratio: the
asperity forces are Q_i = f u_i, displacements are c_t f times those of the normal problem. At
every loaded asperity the displacement of the deep points is, [A16] of the source doubled,

    X = displacement_i + sum_j c_t A_ij Q_j,    displacement_i = X_i + slip_i.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from convexrough import checks
from convexrough.arrays import Array, Indices, frozen
from convexrough.contact import Contact
from convexrough.errors import InputError
from convexrough.normal.judgement import Scope
from convexrough.progress import Announce
from convexrough.shearing.certificate import judge_states
from convexrough.shearing.newton import by_matrices
from convexrough.shearing.problem import States, TangentialProblem
from convexrough.sphere import mindlin

#: Of more loaded asperities than this, coupled by an operator, the onset of some only is found.
MOST_ONSETS = 256


@dataclass(frozen=True, eq=False)
class ShearCertificate:
    """What is proved of a friction state. Arrays are (n,), in the caller's order.

    scope : that of the contact it starts from, or "none" where nothing is proved
    status : "sliding" (proved to slide as a whole), "partial" (proved to keep a stick disc),
        "open" (proved to carry no load) or "undecided"
    force_errors : [force];  slip_errors : [length] bounds on the distance to the solution
    displacement_error : [length] likewise
    """

    scope: Scope
    status: NDArray[np.str_]
    force_errors: Array
    slip_errors: Array
    displacement_error: float

    @property
    def holds(self) -> bool:
        """Every asperity is proved to slide, to stick in part, or to be open."""
        return self.scope != "none" and not bool((self.status == "undecided").any())


@dataclass(frozen=True, eq=False)
class ShearState:
    """A friction state. Arrays are (n,), in the order of the scene's asperities.

    force         : Q [force];  displacement : X of the deep points, both bodies [length]
    forces        : Q_i [force], sum Q
    displacements : X_i + slip_i [length]: own deflection and slip, without the others' influence
    slips         : [length] gross slip, 0 where not sliding
    stick_radii   : c_i [length], 0 where sliding
    """

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


def shear(contact: Contact, *, force: float, announce: Announce | None = None) -> ShearState:
    """Apply a shear force Q [force] to a pressed contact, first loading, at constant normal load.

    announce : told in a line how far long work has come

    Raises InputError if the scene has no friction or |Q| exceeds f P (gross sliding), and
    SolverError where Newton's method stops without an answer.
    """
    scene = contact.scene
    friction = checks.friction(scene.friction)
    given = checks.bearable("force", force, friction * contact.load)
    if given.ndim:
        raise InputError("force", found=f"shape {given.shape}", expected="one number")
    force = float(given)
    sign = float(np.sign(force))
    if contact.load == 0.0:
        return _nothing_loaded(contact)
    problem = TangentialProblem.of(contact)
    total = abs(force) / friction / problem.units.force
    states = problem.solve(problem.limited(np.array([total])), announce=announce)
    bounds = judge_states(problem, contact, states)

    touching, force_unit, length_unit = problem.touching, problem.units.force, problem.units.length
    travel = mindlin.ratio(scene.material.poisson_ratio) * friction * length_unit

    def everywhere(values: Array, unit: float) -> Array:
        full = np.zeros(len(scene))
        full[touching] = values * unit
        return full

    increments, slips = states.increments[0], states.slips[0]
    left = np.maximum(1.0 - np.abs(increments) / problem.loads, 0.0)
    errors = np.where(contact.loads > 0, 0.0, contact.certificate.load_errors)
    slip_errors = np.where((contact.loads > 0) | (contact.status == "open"), 0.0, np.inf)
    words = np.full(len(scene), "undecided", dtype="<U9")
    words[contact.status == "open"] = "open"
    words[touching[bounds.partial[0]]] = "partial"
    words[touching[bounds.sliding[0]]] = "sliding"
    certificate = ShearCertificate(
        scope=contact.certificate.scope if bounds.proved[0] else "none",
        status=frozen(words),
        force_errors=frozen(
            friction * errors + everywhere(bounds.increments[0], friction * force_unit)
        ),
        slip_errors=frozen(slip_errors + everywhere(bounds.slips[0], travel)),
        displacement_error=float(bounds.rises[0]) * travel,
    )
    return ShearState(
        contact=contact,
        force=force,
        displacement=sign * float(states.rises[0]) * travel,
        forces=frozen(everywhere(sign * increments, friction * force_unit)),
        displacements=frozen(everywhere(sign * states.deflections[0], travel)),
        slips=frozen(everywhere(sign * slips, travel)),
        stick_radii=frozen(everywhere(contact.contact_radii[touching] * np.cbrt(left), 1.0)),
        certificate=certificate,
    )


def onset_of_sliding(contact: Contact, *, which: ArrayLike | None = None) -> Array:
    """(n,) [force] the shear force at which each asperity starts to slide on first loading.

    The same as the amplitude (maximum - minimum) / 2 of a steady cycle below which its sliding has
    shaken down to partial slip. nan where the asperity carries no load.

    which : indices of the asperities to look at, in this order; default all. Each takes about
        ten friction states of the contact, so of many loaded asperities some must be named.
    """
    from scipy.optimize.elementwise import find_root  # 0.1 s to import: only when asked

    friction = checks.friction(contact.scene.friction)
    asked = _asperities(contact, which)
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
    onsets[loaded] = found.x * friction * problem.units.force
    return frozen(onsets)


def _asperities(contact: Contact, which: ArrayLike | None) -> Indices:
    """Indices of asperities of the scene, checked."""
    n = len(contact.scene)
    if which is None:
        return np.arange(n)
    asked = np.atleast_1d(np.asarray(which))
    whole = asked.ndim == 1 and (np.issubdtype(asked.dtype, np.integer) or asked.size == 0)
    if not whole or (asked < 0).any() or (asked >= n).any():
        expected = f"whole numbers from 0 to {n - 1}: indices of asperities of the scene"
        raise InputError("which", found=repr(which)[:60], expected=expected)
    return asked.astype(np.intp)


def _nothing_loaded(contact: Contact) -> ShearState:
    zero = frozen(np.zeros(len(contact.scene)))
    certificate = ShearCertificate(contact.certificate.scope, contact.status, zero, zero, 0.0)
    return ShearState(contact, 0.0, 0.0, zero, zero, zero, zero, certificate)
