"""Cycles with oscillating load and shear force: their paths, and losses by phase and amplitude."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import ClassVar, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from convexrough import checks
from convexrough.arrays import Array, frozen
from convexrough.errors import blamed_on
from convexrough.friction.cycle import Cycle
from convexrough.friction.order import Order
from convexrough.friction.steady import steady
from convexrough.influence import Kind
from convexrough.plottable import Plottable
from convexrough.progress import LOGGER
from convexrough.record import Along, Table
from convexrough.scene.asperities import Asperities
from convexrough.scene.scene import Scene
from convexrough.sphere.smooth import smooth_reference


def elliptic_path(
    *,
    load: float,
    load_amplitude: float,
    force: float = 0.0,
    force_amplitude: float,
    phase: float = 0.0,
    friction: float,
    chords: int = 96,
) -> tuple[Array, Array]:
    """(m,) loads P and (m,) shear forces Q [force] at points of an ellipse (docs/theory/paths.md).

        P = load + load_amplitude cos t,    Q = force + force_amplitude sin(t + phase)

    phase  : [rad] from -pi to pi; at pi/2 P and Q are in phase, and the ellipse is a straight line
    friction : coefficient of friction f of the scene. The extremes of P, P + Q/f and P - Q/f are
        points of the path, so `Cycle.level` is that of the ellipse
    chords : approximate number of chords that replace the ellipse, at least 6. Their loss
        differs from that along the ellipse by a fraction that falls as 1 / chords^2

    Raises InputError if the phase is not from -pi to pi, or if `friction` is not positive.

    >>> loads, forces = cr.elliptic_path(
    ...     load=1.0, load_amplitude=0.5, force_amplitude=0.1, friction=0.5, chords=8
    ... )
    >>> len(loads), float(loads.max())
    (12, 1.5)
    """
    checks.fits_in_memory("chords", checks.whole("chords", chords, 6), 200, noun="chords")
    p = checks.finite("load_amplitude", load_amplitude)
    q = checks.finite("force_amplitude", force_amplitude)
    t, phase = q / checks.positive("friction", friction), checks.phase("phase", phase)
    across, along = t * np.cos(phase), t * np.sin(phase)
    corners = [0.0, np.arctan2(across, p + along), np.arctan2(-across, p - along)]
    halves = np.sort(np.mod(corners, np.pi))
    ends = np.append(np.concatenate((halves, halves + np.pi)), halves[0] + 2 * np.pi)
    each = ((a, b, chords * (b - a) / (2 * np.pi)) for a, b in pairwise(ends) if b - a > 1e-9)
    arcs = (np.linspace(a, b, max(1, int(np.ceil(part))), endpoint=False) for a, b, part in each)
    angles = np.concatenate([*arcs])
    loads = checks.finite("load", load) + p * np.cos(angles)
    forces = checks.finite("force", force) + q * np.sin(angles + phase)
    return frozen(loads), frozen(forces)


@dataclass(frozen=True, eq=False, repr=False)
class PhaseLosses(Table, Plottable):
    """Energy losses of cycles along c ellipses.

        P = load + factor load_amplitude cos t,    Q = force + factor force_amplitude sin(t + phase)

    In all arrays the ellipses with the first factor come first, one for each phase, then those with
    the second factor, and so on.

    scene   : the scene
    phases, factors : (c,) phase [rad], and factor of both amplitudes
    losses, loss_errors : (c,) [force length] energy lost by both bodies per steady cycle along the
        chords that replace the ellipse, and proved bounds on the errors for these chords
    smooth  : (c,) [force length] losses of the shape without roughness; nan if not known
    levels  : (c,) [force] `Cycle.level`, the load L* up to which the memory curve no longer changes
    sliding : (c,) number of asperities that slide as a whole or lose contact in the steady cycle
    order   : the weakest `Cycle.order` of all cycles
    """

    _along: ClassVar[Along] = {
        ("ellipse",): ("phases", "factors", "losses", "loss_errors", "smooth", "levels", "sliding")
    }

    scene: Scene
    load: float
    load_amplitude: float
    force: float
    force_amplitude: float
    phases: Array
    factors: Array
    losses: Array
    loss_errors: Array
    smooth: Array
    levels: Array
    sliding: NDArray[np.int64]
    order: Order


def phase_losses(
    scene: Scene,
    *,
    load: float,
    load_amplitude: float,
    force: float = 0.0,
    force_amplitude: float,
    phases: ArrayLike,
    factors: ArrayLike = (1.0,),
    chords: int = 24,
    influence: Kind | None = None,
) -> PhaseLosses:
    """The energy losses of cycles along ellipses with several phases and amplitudes.

    docs/theory/paths.md, "Lines and ellipses", explains how the losses depend on the phase.

    load, load_amplitude, force, force_amplitude : [force] as in `elliptic_path`
    phases  : (m,) [rad] from -pi to pi
    factors : (k,) factors by which both amplitudes are multiplied
    chords  : approximate number of chords per ellipse, as in `elliptic_path`
    influence : how the compliance matrix is stored, as in `press`

    Raises the errors of `elliptic_path` and `steady`.

    >>> P = contact.load
    >>> swing = dict(load=P, load_amplitude=0.2 * P, force_amplitude=0.05 * P)
    >>> losses = cr.phase_losses(scene, **swing, phases=[0.0, np.pi / 2], chords=8)
    >>> bool(losses.losses[1] < 1e-9 * losses.losses[0])  # P, Q in phase, |dQ| <= f |dP|: no slip
    True
    """
    checks.instance("scene", scene, Scene)
    f = checks.friction(scene.friction)
    swing = checks.finite("load_amplitude", load_amplitude)
    shear = checks.finite("force_amplitude", force_amplitude)
    turns, sizes = checks.array("phases", phases), checks.array("factors", factors)
    checks.some("phases", turns)
    checks.some("factors", sizes)
    for i, phase in enumerate(turns):
        checks.phase(f"phases[{i}]", phase)
    alone, rough, smooth = None, list[Cycle](), list[float]()
    if (reference := smooth_reference(scene, load)) is not None:  # as a scene with one asperity
        twice = 2.0 * reference.radius
        alone = Scene(twice, Asperities([[0.0, 0.0]], twice), scene.material, scene.friction)
    turn, size_of = np.tile(turns, len(sizes)), np.repeat(sizes, len(turns))
    for k, (phase, size) in enumerate(zip(turn.tolist(), size_of.tolist(), strict=True)):
        LOGGER.info(f"ellipse {k + 1} of {len(turn)}")
        with blamed_on(f"factors[{k // len(turns)}] = {size:g}"):
            given = {"load": load, "force": force, "phase": phase, "friction": f}
            amplitudes = {"load_amplitude": size * swing, "force_amplitude": size * shear}
            P, Q = elliptic_path(**given, **amplitudes, chords=chords)
            rough.append(steady(scene, loads=P, forces=Q, influence=influence))
        smooth.append(steady(alone, loads=P, forces=Q).loss if alone else np.nan)
    sliding = [np.isin(each.status, ("sliding", "intermittent")).sum() for each in rough]
    return PhaseLosses(
        scene=scene,
        load=float(load),
        load_amplitude=swing,
        force=float(force),
        force_amplitude=shear,
        phases=frozen(turn),
        factors=frozen(size_of),
        losses=frozen(np.array([each.loss for each in rough])),
        loss_errors=frozen(np.array([each.loss_error for each in rough])),
        smooth=frozen(np.array(smooth)),
        levels=frozen(np.array([each.level for each in rough])),
        sliding=frozen(np.array(sliding, dtype=np.int64)),
        order=max((each.order for each in rough), key=get_args(Order).index),  # the weakest
    )
