r"""
9. The loop, memory, and the loss
=================================

**Claim.** Shear a contact back and forth at constant normal load. The energy that a cycle
dissipates follows from the curve of approach against load (the *indentation curve*), without any
shear: it is :math:`8 c_t f^2` times the area between this curve and its chord, with :math:`c_t` and
:math:`f` of lesson 8. A contact remembers only the turning points of the force.
"""

# %%
# The naive form
# --------------
#
# By lesson 8 all shear states are differences of pressings. Let :math:`V(L)` be the minimum
# of the energy at the total load :math:`L`; its derivative is the approach :math:`D_0(L)`. With
# :math:`L = P - Q / f` the loss of a cycle between :math:`\pm Q` is
#
# .. math:: W = 8 c_t f^2 \Big\{ V(P) - V(L) - (P - L) \frac{D_0(P) + D_0(L)}{2} \Big\} .
#
# This takes two pressings. The code below compares :math:`W` with the sum of the losses of the
# asperities, which ``cycle`` computes.

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
pressed = cr.press(scene, approach=5e-5)
limit = FRICTION * pressed.load

points = asperities.positions
distances = np.hypot(*(points[:, None] - points[None]).transpose(2, 0, 1))
np.fill_diagonal(distances, np.inf)
A = 1 / (np.pi * distances)
k = (9 / (16 * scene.relative_radii)) ** (1 / 3)


def least_energy(contact: cr.Contact) -> float:
    """V at the load of the contact."""
    P = contact.loads
    return float(0.6 * k @ P ** (5 / 3) + P @ A @ P / 2 - scene.offsets @ P)


def naive_loss(part: float) -> float:
    """W of a cycle of amplitude part * f P, as the formula stands."""
    less = cr.press(scene, load=(1 - part) * pressed.load)
    fall = least_energy(pressed) - least_energy(less)
    trapezoid = (pressed.load - less.load) * (pressed.approach + less.approach) / 2
    return 8 * ratio * FRICTION**2 * (fall - trapezoid)


for part in (0.5, 1e-2, 1e-4, 1e-6):
    cycle = cr.cycle(pressed, maximum=part * limit)
    print(f"Q/(fP) = {part:<6g} naive {naive_loss(part): .6e}  by asperities {cycle.loss:.6e}")
tiny = cr.cycle(pressed, maximum=1e-6 * limit)
assert abs(naive_loss(0.5) / cr.cycle(pressed, maximum=0.5 * limit).loss - 1) < 1e-9
assert abs(naive_loss(1e-6) / tiny.loss - 1) > 10

# %%
# At large amplitudes the result is right. At 1e-4 two digits are right, and at 1e-6 not even the
# sign: energies of size :math:`P D_0` are subtracted, and their difference is of third order in
# :math:`Q`. Dampers work at small amplitudes.
#
# The repair
# ----------
#
# Add up the losses of the asperities, none of which is negative: Mindlin's loss, to which an
# asperity that slides by :math:`s_i` adds :math:`4 f P_i s_i`. ``cycle`` does this.
# Its number ``balance_defect`` is the relative difference from the formula above, evaluated to
# thirty digits; because of cancellation it can reach :math:`10^{-28} (f P / Q)^3`, or some
# thousand times as much on a large lattice, whose products have fewer digits.

print(f"loss over W0 at 1e-6: {tiny.loss_normalised:.10e}, defect {tiny.balance_defect:.0e}")
assert tiny.balance_defect < 1e-28 * 1e6**3

# %%
# The picture
# -----------
#
# Left: the loop, whose area is the loss, and the loop of a smooth sphere. Right: the indentation
# curve between :math:`L` and :math:`P`, and its chord. The grey area between them, times
# :math:`8 c_t f^2`, is the same loss. If the curve were straight, as for a flat punch, nothing
# would slip before gross sliding, and the loss would be 0.

half = cr.cycle(pressed, maximum=0.8 * limit)
loop = half.loop(200)
smooth = cr.smooth(scene, load=pressed.load)
X0 = smooth.displacement(limit)
figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.8), layout="constrained")
left.plot(loop.displacements / X0, loop.forces / limit, "k-", label="rough")
back = smooth.branch(loop.forces[:101], 0.8 * limit)
left.plot(
    np.append(back, -back) / X0,
    np.append(loop.forces[:101], -loop.forces[:101]) / limit,
    "k--",
    lw=0.8,
    label="smooth sphere",
)
left.set(xlabel="displacement $X / X_0$ [1]", ylabel="shear force $Q / (f P)$ [1]")
left.legend()
share = np.linspace(0.2, 1, 41)
curve = (
    np.array([cr.press(scene, load=x * pressed.load).approach for x in share]) / pressed.approach
)
chord = np.interp(share, share[[0, -1]], curve[[0, -1]])
right.plot(share, curve, "k-", label="indentation curve $D_0(L)$")
right.plot(share, chord, "k--", lw=0.8, label="chord")
right.fill_between(share, chord, curve, color="0.75")
right.set(xlabel="load $L / P$ [1]", ylabel="approach $D_0 / D_0(P)$ [1]")
right.legend()
plt.show()

# %%
# An independent check
# --------------------
#
# Gauss's rule gives the grey area from pressings alone; the intervals end at the loads at which a
# ring begins to touch. A polygon inside the loop gives the area of the loop.

onsets = np.unique((1 - cr.onset_of_sliding(pressed) / limit).round(12))
ends = np.concatenate(([0.2], onsets[(onsets > 0.2) & (onsets < 1)], [1.0]))
nodes, weights = np.polynomial.legendre.leggauss(12)
area = 0.0
for low, high in pairwise(ends):
    loads = (low + (high - low) * (nodes + 1) / 2) * pressed.load
    area += (
        float(weights @ [cr.press(scene, load=load).approach for load in loads]) * (high - low) / 2
    )
first = cr.press(scene, load=0.2 * pressed.load).approach
sliver = pressed.load * (area - 0.8 * (first + pressed.approach) / 2)
by_sliver = 8 * ratio * FRICTION**2 * sliver
print(f"loss {half.loss:.9e}, from the grey area {by_sliver:.9e}, polygon {loop.area:.9e}")
assert abs(by_sliver / half.loss - 1) < 1e-6
assert 0 < half.loss - loop.area < 1e-3 * half.loss

# %%
# Memory
# ------
#
# The displacement is not a function of the force: at :math:`Q / (f P) = 0.3` it differs between the
# way up and the way down. The state depends on the past through the turning points only, and when a
# small loop closes, its two turning points have no further effect. After the detour from -0.1 to
# 0.4 and back, the path continues as if there had been no detour.

plain = cr.history(pressed, forces=np.array([0.3, 0.7, 0.3, -0.5, 0.7]) * limit)
nested = cr.history(pressed, forces=np.array([0.7, -0.1, 0.4, -0.1, -0.5, 0.7]) * limit)
up, down = plain.displacements[0], plain.displacements[2]
print(f"X at Q/(fP) = 0.3: {up:.3e} on the way up, {down:.3e} on the way down")
assert down > 1.3 * up
assert abs(nested.displacements[-1] / plain.displacements[-1] - 1) < 1e-12
assert np.allclose(nested.asperity_forces[-1], plain.asperity_forces[-1], atol=1e-12 * limit)
lost = nested.losses[-1] - plain.losses[-1]
inner = cr.cycle(pressed, maximum=0.4 * limit, minimum=-0.1 * limit)
print(f"the detour costs {lost:.6e}, its loop {inner.loss:.6e}")
assert abs(lost / inner.loss - 1) < 1e-9

# %%
# Exercise
# --------
#
# The amplitude of a small cycle is halved. By which factor does the loss fall? And what is the
# smooth sphere's loss, divided by :math:`W_0`, at small :math:`t = Q / (f P)`?
#
# *Answer.* The factor is 8, because the error of the trapezoid rule is
# :math:`-\tfrac 1 {12} D_0'' (P - L)^3`. For the sphere, expand its loss over :math:`W_0`,
# :math:`e(t) = 1 - (1-t)^{5/3} - \tfrac{5 t}{6} [1 + (1-t)^{2/3}]`: the terms in :math:`t` and
# :math:`t^2` cancel, and :math:`e = \tfrac 5 {162} t^3 + \dots`

small, smaller = (cr.cycle(pressed, maximum=part * limit) for part in (2e-4, 1e-4))
print(f"halved: {small.loss / smaller.loss:.4f}")
print(f"sphere: {tiny.smooth_normalised / 1e-18 * 162:.6f} / 162")
assert abs(small.loss / smaller.loss - 8) < 0.01
