r"""
10. The memory curve
====================

**Claim.** Let the normal load :math:`P` and the shear force :math:`Q = f T` vary together along
any path, with the coefficient of friction :math:`f`. *One curve in the plane of* :math:`P` *and*
:math:`T` describes the whole tangential state, for any number of asperities. It can be drawn with
ruler and pencil, without elasticity. Forces and displacements then need one normal contact for
each corner of the curve.
"""

# %%
# The naive form
# --------------
#
# Lesson 9 had constant :math:`P`: a contact remembers the turning points of
# :math:`Q`, and the branch after a turning point is the first loading at twice the size. Now
# :math:`P` varies as well. The naive form takes the contact pressed by the present :math:`P` and
# applies the history of :math:`Q` to it. The path has four points: press; shear; increase the load
# at constant :math:`Q`; reduce it again at constant :math:`Q`.

from fractions import Fraction
from itertools import pairwise

import matplotlib.pyplot as plt
import numpy as np
from numpy.typing import NDArray

import convexrough as cr

plt.rcParams["font.size"] = 14  # readable from the last row

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
    """X after a point, as if the load had always been that of the point."""
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
# The result is right while :math:`P` is constant, and wrong by 23 % as soon as it changes: by the
# naive form a larger load at constant :math:`Q` would move the bodies *back*. In fact new
# contact forms around the old one, it carries no shear at first, and nothing moves. (At point 4
# the naive form is right again: so much slips during unloading that the contact forgets the third
# point. The rules below give this result, too.)

assert path.displacements[2] == path.displacements[1]

# %%
# The repair
# ----------
#
# Describe the state by a curve :math:`\vartheta(s)` over the levels :math:`0 \le s \le P`, from
# the origin to the present point :math:`(P, T)`, nowhere steeper than 45 degrees. The *layer* at
# the level :math:`s` is the contact that is added as the load grows from :math:`s` to
# :math:`s + ds`; the slope of the curve there, times :math:`f`, is the shear that the layer
# carries per unit of load. A straight piece of the path changes the curve by one of three rules.
#
# 1. :math:`P` rises, and :math:`T` changes no faster: everything sticks. Append the piece to the
#    curve.
# 2. The path runs back along the curve: nothing slips. Remove that part of the curve.
# 3. Otherwise the contact slips, with a sign :math:`c = \pm 1`. Draw a line of slope :math:`c`
#    through the new point. Below the level :math:`L` where it meets the curve, the curve remains;
#    above, the line replaces it.
#
# The following function applies the rules in fractions. (It omits one case: a falling path that
# meets the old curve again. Then the part of the curve above this point is removed, and the rules
# apply anew to the rest of the piece.)

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
    while c * (T - c * (P - kept[-1][0]) - kept[-1][1]) >= 0:  # the line has not met it yet
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
# The picture shows each step: the path in grey, the curve in black, the line of rule 3 dashed. A
# circle marks the front :math:`L`: all layers above it have slipped. In the last step the contact
# slips although :math:`Q` is constant, because the limit of friction falls with the load.

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
        axes.plot(reach, h[-1] - (s[-1] - reach), "k--", lw=0.7, label="line of rule 3")
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
# Cut each contact into bristles, springs side by side, which carry the normal forces :math:`N_b(s)`
# at the total load :math:`s`. Choose any slope :math:`\theta(s)` within :math:`\pm 1`, and let
# bristle :math:`b` carry the shear force :math:`q_b = f \int \theta\, dN_b`. By the contact law, at
# every load the approach minus a constant equals the bristle's own indentation plus the
# displacement due to the loads on the other asperities. This law is *linear*. Multiply its
# derivative by :math:`c_t f\, \theta`, where :math:`c_t` is the ratio of tangential to normal
# compliance, and integrate over :math:`s`: the result is the balance of tangential displacements.
# So every curve is an equilibrium, for any shapes, heights and elasticity. It also respects
# friction, :math:`|q_b| \le f N_b`, because no slope exceeds 45 degrees. Slip determines the curve:
# the bristles that come into contact above :math:`L` slip. The level :math:`L` follows from the
# total shear force alone, because the forces :math:`N_b` add up to the total load in any scene.
#
# The elastic problem is solved once per corner :math:`s_k`, as a normal contact with loads
# :math:`P_i(s_k)` and approach :math:`D_0(s_k)`. Let :math:`c_k` be the slope below the corner
# minus the slope above it; beyond the ends of the curve the slope is 0. The shear forces and the
# displacement are
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
    # A corner at s = 0 adds nothing: there the approach and all loads are 0.
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
# This check uses one contact and no curve: a sphere on a plane as 4000 bristles, each of which
# sticks or slips by itself. As their number grows, bristles of stiffness :math:`E^* \Delta x` at
# :math:`\pm x` with the indentation :math:`\delta - x^2 / R` give the laws of Hertz and Mindlin
# exactly. Move the two bodies in small steps along the same path.

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
# The rules assume **order**: as the load rises, no indentation falls and no gap opens. Then the
# contact at a smaller load is part of the contact at a larger one, and the level at which a
# bristle comes into contact is well defined. The field ``order`` of a result says whether order is
# proved. It can fail: place a low, small summit between five crowded ones. Under a large load they
# lower the surface under it faster than the sphere approaches. (Contact discs overlap here, so this
# example shows only the mathematics; one without overlap is ``examples/losing_contact.py``.)

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
failing = cr.load_path(shaded, loads=[0.8 * heavy, heavy], forces=[0.0, 0.4 * FRICTION * heavy])
print("load of the shaded summit:", ", ".join(f"{load:.2e}" for load in loads))
print(f"order: of the array {path.order}; with the shaded summit {failing.order}")
assert loads[2] < loads[1]
assert (path.order, failing.order) == ("proved", "fails")
assert np.isinf(failing.displacement_errors).all()  # general steps instead, and nothing is proved

# %%
# Exercise
# --------
#
# A closed path is repeated. Let :math:`m_\pm` be the smallest :math:`P \pm T` along it. Draw the
# two lines :math:`T = s - m_-` and :math:`T = m_+ - s`. Why does the curve always pass through
# their crossing? At which level is the crossing for the four corners above?
#
# *Answer.* When the path reaches :math:`P - T = m_-`, the curve ends on the first line. It is
# nowhere steeper than this line, so it lies above the line. In the same way it lies below the
# second line once the path has reached :math:`P + T = m_+`. At the crossing,
# :math:`L^* = (m_+ + m_-)/2`, only one point satisfies both. Later lines of rule 3 never meet the
# curve below this level. So everything below :math:`L^*` sticks for ever: here :math:`m_+ = 0.6`,
# :math:`m_- = 0.2`, and :math:`L^* = 0.4`.

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
