r"""
10. The memory curve
====================

**Claim.** Let normal load :math:`P` and shear :math:`Q = f T` move together along any path. The
whole tangential state of the array, of however many asperities, is *one curve in the plane of*
:math:`P` *and* :math:`T`. Ruler and pencil are enough to draw it: no elasticity enters. Elasticity
is asked only in the end, once at each corner of the curve.
"""

# %%
# The naive form
# --------------
#
# :doc:`09_loop_and_loss` had constant :math:`P`: what a contact remembers is its turning points of
# :math:`Q`, and a way back is the way there at twice the size. So let us follow a path in which
# :math:`P` moves, too, and at each point shear the contact as it is pressed then: the history of
# :math:`Q` at that :math:`P`. Four points: press; shear; press further at constant :math:`Q`;
# and let the load go again, at constant :math:`Q`.

from fractions import Fraction
from itertools import pairwise

import matplotlib.pyplot as plt
import numpy as np
from numpy.typing import NDArray

import convexrough as cr

plt.rcParams["font.size"] = 14  # to be read from the last row

Array = NDArray[np.float64]
NU, FRICTION = 0.3, 0.5
ratio = (2 - NU) / (2 * (1 - NU))  # c_t

asperities = cr.Asperities.hexagonal(spacing=0.0025, tip_radius=0.02, within=0.0102)
scene = cr.Scene(
    1.0, asperities, cr.Material(contact_modulus=1.0, poisson_ratio=NU), FRICTION, geometry="summit"
)
whole = cr.press(scene, approach=5e-5).load

corners = [(0.6, 0.0), (0.6, 0.3), (1.0, 0.3), (0.5, 0.3)]  # (P, T) over the largest load


def naive(point: int) -> float:
    """X after a point, were only the forces at the load of that point to count."""
    pressed = cr.press(scene, load=corners[point][0] * whole)
    past = [FRICTION * t * whole for _, t in corners[: point + 1]]
    return float(cr.history(pressed, forces=past).displacements[-1])


P, T = np.array(corners).T * whole
path = cr.load_path(scene, loads=P, forces=FRICTION * T)
for k, moved in enumerate(path.displacements):
    print(f"point {k + 1}: naive X = {naive(k):.4e}, true X = {moved:.4e}")
assert abs(naive(1) / path.displacements[1] - 1) < 1e-12
assert naive(2) < 0.8 * path.displacements[2]

# %%
# Right while :math:`P` rests, and wrong by a fifth as soon as it moves: by the naive form pressing
# harder at constant :math:`Q` would move the bodies *back*. In truth new contact is laid around the
# old one, it is laid without shear, and nothing moves at all. (At point 4 the naive form is right
# again: so much slips on the way down that what came between is forgotten. That, too, should follow
# from a rule.)

assert path.displacements[2] == path.displacements[1]

# %%
# The repair
# ----------
#
# Give the state a curve :math:`\vartheta(s)` over levels :math:`0 \le s \le P`, no steeper than 45
# degrees, from the origin to the present point :math:`(P, T)`. It says with which slope each layer
# of the contact was laid down. A straight piece of path changes it by one of three rules.
#
# 1. :math:`P` rises, and :math:`T` no faster: everything sticks. Draw the piece onto the end.
# 2. The path runs back along the curve: nothing slips. Rub that part out.
# 3. Else slip, of sign :math:`c`: lay a ruler of slope :math:`c` through the new point. Below the
#    level :math:`L` where it meets the curve nothing changes; above, the ruler is the curve.
#
# Ten lines, in fractions. (What is left out: a falling path that meets the old curve again. There
# all above is forgotten, and the rest of the piece starts afresh.)

Curve = list[tuple[Fraction, Fraction]]


def draw(curve: Curve, P: Fraction, T: Fraction) -> Curve:
    """The three rules, for one straight piece from the end of the curve to (P, T)."""
    (s, h), displacement, shear = curve[-1], P - curve[-1][0], T - curve[-1][1]
    if displacement == shear == 0:
        return curve
    if displacement > 0 and abs(shear) <= displacement:
        return [*curve, (P, T)]
    slope = (h - curve[-2][1]) / (s - curve[-2][0])
    lean = shear - slope * displacement if displacement < 0 else shear
    if lean == 0:  # to the end of the top layer, and what is left of the piece from there
        back = curve[:-1]
        return draw(back, P, T) if back[-1][0] >= P else [*back, (P, T)]
    c = 1 if lean > 0 else -1
    kept = list(curve)
    while c * (T - c * (P - kept[-1][0]) - kept[-1][1]) >= 0:  # the ruler has not met it yet
        last = kept.pop()
    (s0, h0), (s1, h1) = kept[-1], last
    slope = (h1 - h0) / (s1 - s0)
    L = (T - c * P - h0 + slope * s0) / (slope - c)
    return [*kept, (L, T - c * (P - L)), (P, T)]


curve: Curve = [(Fraction(0), Fraction(0))]
curves = []
for p, t in corners:
    curve = draw(curve, Fraction(p).limit_denominator(100), Fraction(t).limit_denominator(100))
    curves.append(curve)
    print(" -> ".join(f"({float(s):g}, {float(h):g})" for s, h in curve))

# %%
# The picture
# -----------
#
# Each step of the drawing: the path in grey, the curve in black, the ruler dashed; a dot marks the
# front :math:`L`, down to which the contact slipped. Unloading at constant shear, the last step,
# slips though :math:`Q` rests: friction gives way under it.

figure, places = plt.subplots(
    2, 2, figsize=(11, 8.5), sharex=True, sharey=True, layout="constrained"
)
for k, axes in enumerate(places.flat):
    s, h = np.array([[float(x) for x in point] for point in curves[k]]).T
    way = np.array([(0, 0), *corners[: k + 1]])
    axes.plot([0, 1], [0, 1], "k:", lw=0.7)
    axes.plot([0, 1], [0, -1], "k:", lw=0.7)
    axes.plot(*way.T, "o-", color="0.65", ms=4, label="path")
    axes.plot(s, h, "k-", lw=2, label="memory curve")
    if (front := path.curves[k].front) is not None:
        L = float(front) / whole
        reach = np.array([0.0, s[-1]])
        axes.plot(reach, h[-1] - (s[-1] - reach), "k--", lw=0.7, label="ruler")
        axes.plot([L], [h[-1] - (s[-1] - L)], "o", mfc="white", mec="k", label="front")
    axes.set(title=f"point {k + 1}", aspect="equal")
    axes.set(xlim=(0, 1.05), ylim=(-0.5, 0.8))
figure.supxlabel("load $P$ or level $s$ / $P^*$ [1]")
figure.supylabel("$T = Q / f$ / $P^*$ [1]")
places[0, 1].legend(loc="lower left")
plt.show()

# %%
# Why it needs no elasticity
# --------------------------
#
# Cut each contact into bristles, springs side by side, which bear :math:`f_b(s)` at total load
# :math:`s`. Whatever slope :math:`\theta(s)` within :math:`\pm 1` we choose, let bristle :math:`b`
# carry :math:`q_b = f \int \theta\, df_b`. Geometry says at every load that approach = own
# indentation + what the others displace. That is *linear*, so multiply it by
# :math:`c_t f\, \theta` and integrate over :math:`s`: it becomes the balance of tangential
# displacements. So every curve is an equilibrium, whatever the shapes, heights or elasticity. And
# it respects friction, :math:`|q_b| \le f f_b`, as slopes stay within 45 degrees. Which curve it
# is, is decided by which bristles slip: those that join above :math:`L`. The ruler meets the curve
# where as much force as asked for is found; and forces are *loads*, which add up to :math:`P` on
# any scene.
#
# The elastic problem is asked once per corner :math:`s_k`, as normal contact. With the bends
# :math:`c_k` of the curve there,
#
# .. math:: Q_i = f \sum_k c_k P_i(s_k), \qquad X = c_t f \sum_k c_k D_0(s_k) .


def read_off(curve: Curve) -> tuple[float, Array]:
    """X and Q_i from presses at the corners of the curve."""
    layers = [float((h1 - h0) / (s1 - s0)) for (s0, h0), (s1, h1) in pairwise(curve)]
    bends = -np.diff([0.0, *layers, 0.0])
    X, Q = 0.0, np.zeros(len(scene))
    for (s, _), bend in zip(curve, bends, strict=True):
        if s > 0:
            pressed = cr.press(scene, load=float(s) * whole)
            X += ratio * FRICTION * bend * pressed.approach
            Q += FRICTION * bend * pressed.loads
    # Before the first touch approach counts from the highest summit, here 0.
    return X, Q


for k, each in enumerate(curves):
    X, Q = read_off(each)
    assert abs(X - path.displacements[k]) < 1e-10 * path.displacements.max()
    assert np.allclose(Q, path.asperity_forces[k], atol=1e-10 * whole)
print(f"{len(curves[-1]) - 1} presses for the last state, {path.presses} for all four")

# %%
# An independent check
# --------------------
#
# One contact, and no curve at all: 4000 bristles of one sphere on a plane, each of which sticks or
# slips by itself. A parabola cut into bristles of stiffness :math:`E^* \Delta x` at :math:`\pm x`,
# indented by :math:`\delta - x^2 / R`, is Hertz and Mindlin exactly. Move the two bodies in small
# steps along the same four corners.

R, count = 1.0, 4000
one = cr.Scene(
    2.0, cr.Asperities([[0.0, 0.0]], 2.0), cr.Material(1.0, NU), FRICTION, geometry="summit"
)
largest = 1e-6
own = (9 / (16 * R)) ** (1 / 3)  # indentation = own P^(2/3)
edge = 1.01 * np.sqrt(R * own) * largest ** (1 / 3)
dx = edge / count
x = (np.arange(count) + 0.5) * dx
held, displacement = np.zeros(count), 0.0  # forces over f, displacement over c_t f
seen = []
before = (0.0, 0.0)
for corner in corners:
    for part in np.arange(1, 161) / 160:
        P_now, T_now = ((a + part * (b - a)) * largest for a, b in zip(before, corner, strict=True))
        bound = 2 * dx * np.maximum(own * P_now ** (2 / 3) - x**2 / R, 0.0)
        low, high = -1e-3, 1e-3
        for _ in range(60):  # the displacement that makes the forces add up to T
            step = (low + high) / 2
            trial = np.clip(held + 2 * dx * step, -bound, bound)
            low, high = (step, high) if trial.sum() < T_now else (low, step)
        held, displacement = trial, displacement + step
    seen.append(ratio * FRICTION * displacement)
    before = corner
p, t = largest * np.array(corners).T
alone = cr.load_path(one, loads=p, forces=FRICTION * t)
worst = float(np.abs(np.array(seen) - alone.displacements).max() / alone.displacements.max())
print(f"bristles against the curve: X within {worst:.1e}")
assert worst < 2e-3

# %%
# When it is exact
# ----------------
#
# What the rules use is **order**: as the load rises no indentation falls and no gap opens. Then the
# layers of the contact are nested, and "joined above :math:`L`" is a statement on loads alone. On
# most scenes it holds, and ``order`` says how far that is proved. It can fail: put a low, small
# summit between five crowded ones. Pressed far, they push the ground away from under it.

turn = 2 * np.pi * np.arange(5) / 5
points = np.vstack(([0.0, 0.0], np.column_stack((np.cos(turn), np.sin(turn)))))
shaded = cr.Scene(
    1e6,
    cr.Asperities(points, np.r_[0.05, np.ones(5)], np.r_[-0.06, np.zeros(5)]),
    cr.Material(1.0, NU),
    FRICTION,
    geometry="summit",
)
heavy = cr.press(shaded, approach=1.4).load
loads = [cr.press(shaded, load=part * heavy).loads[0] for part in (0.6, 0.8, 1.0)]
failing = cr.load_path(shaded, loads=[0.8 * heavy, heavy], forces=[0.0, 0.2 * heavy])
print("load of the shaded summit:", ", ".join(f"{load:.2e}" for load in loads))
print(f"order: here {path.order}; there {failing.order}")
assert loads[2] < loads[1]
assert (path.order, failing.order) == ("proved", "fails")
assert np.isinf(failing.displacement_errors).all()  # general steps instead, and nothing is proved

# %%
# Exercise
# --------
#
# Let the path be closed and repeat it. Let :math:`m_\pm` be the least :math:`P \pm T` along it.
# Draw the two lines :math:`T = s - m_-` and :math:`T = m_+ - s`. Why does the curve pass through
# their crossing for ever? At which level is it, for the four corners above?
#
# *Answer.* When :math:`P - T = m_-` is reached, the curve ends on the first line and is nowhere
# steeper than it, so it lies above it; and likewise below the second. At the crossing
# :math:`L^* = (m_+ + m_-)/2` both together leave one point. A later ruler never comes below it. So
# everything below :math:`L^*` sticks for ever: here :math:`m_+ = 0.6`, :math:`m_- = 0.2`, and
# :math:`L^* = 0.4`.

settled = cr.steady(scene, loads=P, forces=FRICTION * T)
crossing = (min(p + t for p, t in corners) + min(p - t for p, t in corners)) / 2
print(
    f"L* = {settled.level / whole:.4f}, {int((settled.status == 'sliding').sum())} slide for ever"
)
assert abs(settled.level / whole - crossing) < 1e-12
again = cr.load_path(scene, loads=np.tile(P, 3), forces=FRICTION * np.tile(T, 3))
for state in again.curves[4:]:
    levels, heights = ([float(x) for x in each] for each in (state.levels, state.heights))
    assert abs(np.interp(settled.level, levels, heights) - settled.force_level / FRICTION) < 1e-19
