"""The source paper's appendix [A1]-[A15], as a comparison: slip from the fields at the surface.

The forces and stick discs are Ciavarella and Jaeger's, of `shear`. But what an asperity slips by is
read off the surface displacement u at its centre, the sum of [A3] and [A4] over all asperities: the
mean of u over the asperities that still stick in part ("adhered") stands for the displacement of
the deep points, and slip is what u at a sliding asperity falls short of it.

An adhered asperity is displaced with the deep points, so u should be the same at all of them. It is
not quite: at Poisson's ratio 0 because here each force is spread over its disc and there it acts at
a point, and at any other because displacement reaches further along the shear than across it, which
Ciavarella and Jaeger average. So slips differ around a ring of asperities, and may be backwards;
over hexagonal and square rings they sum to the same at every Poisson's ratio, but for the factor
c_t of all displacements.

Nothing here is certified. Displacements and energies are both bodies', twice the source's.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from convexrough import checks, fields
from convexrough.arrays import Array, frozen
from convexrough.contact import Contact
from convexrough.errors import InputError
from convexrough.friction.shear import ShearState, shear
from convexrough.sphere import mindlin


def displacements(state: ShearState) -> Array:
    """(n,) [length] surface displacement along the shear at each loaded asperity; nan elsewhere."""
    contact = state.contact
    touching = np.flatnonzero(contact.loads)
    found = np.full(len(contact.loads), np.nan)
    found[touching] = fields.shear_displacement(state, contact.scene.contact_points[touching])
    return frozen(found)


def slips(state: ShearState) -> Array:
    """(n,) [length] mean displacement of the adhered less a sliding asperity's own; else 0.

    Signed as the shear where forwards. At |Q| = f P none adheres: the last asperity to slide, which
    is displaced furthest, then stands for them.
    """
    u, adhered, sliding = displacements(state), _adhered(state), _sliding(state)
    slips = np.zeros(len(u))
    if sliding.any():
        furthest = u[sliding][np.argmax(np.abs(u[sliding]))]
        slips[sliding] = (u[adhered].mean() if adhered.any() else furthest) - u[sliding]
    return frozen(slips)


def scatter(state: ShearState) -> float:
    """Standard deviation over mean of the displacement of the adhered, which should be 0.

    nan where nothing is displaced, or none adheres.
    """
    u = displacements(state)[_adhered(state)]
    return float(u.std() / abs(u.mean())) if u.any() else float("nan")


def energies(state: ShearState) -> Array:
    """(n,) [force length] lost at each asperity by a steady cycle between Q and -Q.

    W_i e(|Q_i| / (f P_i)) + 4 f P_i |s_i|, with W_i = 9 (2 - nu) f^2 P_i^2 / (5 G a_i); a slip
    backwards counts as negative.
    """
    contact, scene = state.contact, state.contact.scene
    friction = checks.friction(scene.friction)
    limits = friction * contact.loads
    indentations = contact.contact_radii**2 / scene.relative_radii
    scales = 4.8 * mindlin.ratio(scene.material.poisson_ratio) * friction * indentations
    shares = np.minimum(np.abs(state.forces) / np.where(limits > 0, limits, 1.0), 1.0)
    forwards = np.sign(state.force) * slips(state)
    return frozen(limits * (scales * mindlin.loss(shares) + 4.0 * forwards))


def cycle_energy(contact: Contact, maximum: float, minimum: float | None = None) -> float:
    """Energy lost per steady cycle between two shear forces [force length].

    The sum of `energies` at Q = (maximum - minimum) / 2; the minimum defaults to -maximum.
    """
    limit = checks.friction(contact.scene.friction) * contact.load
    upper = float(checks.bearable("maximum", maximum, limit))
    lower = -upper if minimum is None else float(checks.bearable("minimum", minimum, limit))
    if lower > upper:
        expected = f"at least the minimum, {lower}"
        raise InputError("maximum", found=upper, expected=expected)
    return float(energies(shear(contact, force=(upper - lower) / 2.0)).sum())


def _adhered(state: ShearState) -> NDArray[np.bool_]:
    return state.stick_radii > 0


def _sliding(state: ShearState) -> NDArray[np.bool_]:
    return (state.contact.loads > 0) & ~_adhered(state)
