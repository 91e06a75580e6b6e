"""Vary normal load and shear force together: how the energy loss depends on their phase.

First, one smooth sphere is compared with the incremental law of Mindlin and Deresiewicz in the form
of Thornton and Yin, integrated numerically. Then a rough contact goes through cycles with the shear
force in phase with the normal load, and a quarter of a cycle behind it. On a straight path no
energy is lost if the shear force changes by less than the coefficient of friction times the change
of the load. On a steeper path the loss has a closed form with mean values of D0. At the end, the
loss is computed for several phases, together with that of a smooth sphere, and drawn to
phase_losses.png.

    python examples/normal_and_shear_together.py
"""

from collections.abc import Callable
from typing import Any

import numpy as np

import convexrough as cr
from convexrough import plots

Pairs = list[tuple[str, float, float]]

FRICTION = 0.5
MATERIAL = cr.Material(contact_modulus=1.0, poisson_ratio=0.3)
RATIO = (2 - 0.3) / (2 * (1 - 0.3))  # ratio of tangential to normal compliance


def one_sphere() -> Pairs:
    """The displacement if the load grows, and Q / f grows twice as fast."""
    asperity = cr.Asperities(positions=[[0.0, 0.0]], tip_radii=1.0)
    scene = cr.Scene(1.0, asperity, MATERIAL, friction=FRICTION, geometry="summit")
    first, last, shear = 1e-6, 1.4e-6, 0.8e-6  # first and last P; last T = Q / f
    path = cr.load_path(scene, loads=[first, last], forces=[0.0, FRICTION * shear])

    # dX = (dQ - f dP (1 - th)) / (8 G* a th), th = (L / P)^(1/3), with the front L = P - T.
    nodes, weights = np.polynomial.legendre.leggauss(60)
    part, weights = (nodes + 1) / 2, weights / 2
    P, T = first + part * (last - first), part * shear
    radius = np.cbrt(3 * P * 0.5 / 4)  # contact radius; the relative radius is 1/2
    th = np.cbrt((P - T) / P)
    rate = FRICTION * (shear - (last - first) * (1 - th)) / (2 * radius / RATIO * th)
    return [("one sphere, X by increments", float(path.displacements[-1]), float(rate @ weights))]


def array() -> tuple[cr.Scene, float]:
    """The array of Dini and Hills (2009), and the mean load of its cycles."""
    asperities = cr.Asperities.hexagonal(spacing=0.0025, tip_radius=0.02, within=0.0102)
    scene = cr.Scene(1.0, asperities, MATERIAL, friction=FRICTION, geometry="summit")
    return scene, cr.press(scene, approach=4e-5).load


def on_a_line(approach: Callable[[Any], Any], P: float, p: float, t: float) -> float:
    """The loss on a straight path with the amplitudes p of P and t > p of Q / f, in closed form."""
    nodes, weights = np.polynomial.legendre.leggauss(4)

    def mean(low: float, high: float, panels: int = 12) -> float:
        ends = np.linspace(low, high, panels + 1)
        loads = ends[:-1, None] + (nodes + 1) / 2 * np.diff(ends)[:, None]
        return float(np.mean(approach(loads) @ weights / 2))

    bracket = mean(P - t, P + p) + mean(P - t, P - p) - mean(P - p, P + p) - approach(P - t)
    return 4 * RATIO * FRICTION**2 * t * float(bracket)


def rough() -> Pairs:
    """Three cycles between the same loads: a steep line, a gentle line, and an ellipse."""
    scene, P = array()
    p, t = 0.2 * P, 0.4 * P  # amplitudes of P and of Q / f

    in_phase = cr.steady(scene, loads=[P + p, P - p], forces=[FRICTION * t, -FRICTION * t])
    gentle = cr.steady(
        scene, loads=[P + p, P - p], forces=[0.9 * FRICTION * p, -0.9 * FRICTION * p]
    )
    loads, forces = cr.elliptic_path(
        load=P, load_amplitude=p, force_amplitude=FRICTION * t, friction=FRICTION, chords=48
    )
    behind = cr.steady(scene, loads=loads, forces=forces)

    line = on_a_line(np.vectorize(lambda load: cr.press(scene, load=load).approach), P, p, t)
    return [
        ("line in phase, loss / closed form", in_phase.loss / line, 1.0),
        ("line that follows the load, loss", gentle.loss / in_phase.loss, 0.0),
        ("quarter of a cycle behind, stuck level / P", behind.level / P, 1 - np.hypot(0.2, 0.4)),
    ]


def against_phase() -> cr.PhaseLosses:
    """Losses of the cycle for several phases and two sizes, and those of a smooth sphere."""
    scene, P = array()
    return cr.phase_losses(
        scene,
        load=P,
        load_amplitude=0.2 * P,
        force_amplitude=FRICTION * 0.4 * P,
        phases=np.linspace(0, np.pi, 7),
        factors=[0.5, 1.0],
        chords=8,
    )


def phases() -> Pairs:
    """Losses and stuck levels at several phases; in phase the loss is small."""
    losses = against_phase()
    P, p, t = losses.load, losses.load_amplitude, losses.force_amplitude / FRICTION

    in_step = on_a_line(lambda load: (0.75 * load) ** (2 / 3), P, p, t)
    whole = losses.factors == 1.0
    reach = [np.hypot(0.2, 0.4), (np.sqrt(0.2 + 0.08) + np.sqrt(0.2 - 0.08)) / 2]
    return [
        ("smooth sphere in step, loss / closed form", losses.smooth[whole][3] / in_step, 1.0),
        ("quarter behind, stuck level / P", losses.levels[whole][0] / P, 1 - reach[0]),
        ("30 degrees, stuck level / P", losses.levels[whole][1] / P, 1 - reach[1]),
        ("in phase more loss than at 30 degrees", float(losses.losses[10] > losses.losses[8]), 0),
    ]


def compare() -> Pairs:
    """Return (quantity, computed value, reference value)."""
    return one_sphere() + rough() + phases()


if __name__ == "__main__":
    for name, computed, reference in compare():
        print(f"{name:<46} {computed:14.9g} {reference:14.9g}")
    figure = plots.phase_figures(against_phase())["phase_losses"]
    figure.savefig("phase_losses.png", dpi=200)
