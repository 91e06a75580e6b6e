r"""
8. Shear as a difference of two pressings
=========================================

**Claim.** Press a contact with the load :math:`P`, then shear it with the force :math:`Q`. The
shear force on every asperity is the coefficient of friction :math:`f` times the load that it would
lose if the total load were reduced by :math:`Q / f`. The asperities that would lose contact are
those that slide. So a solver for normal contact also solves shear.

This is Ciavarella and Jäger's theorem. It has two conditions: a tangential force displaces the
surface as a normal force does, up to a factor :math:`c_t = (2 - \nu) / (2 (1 - \nu))`, and no
indentation falls as the load rises.
"""

# %%
# The naive form
# --------------
#
# Friction is proportional to load. So assume that every asperity carries a share in proportion to
# its load, :math:`Q_i = Q P_i / P`.

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.patches import Circle
from numpy.typing import NDArray

import convexrough as cr

plt.rcParams["font.size"] = 14  # readable from the last row

Array = NDArray[np.float64]
NU, FRICTION = 0.3, 0.5

asperities = cr.Asperities.hexagonal(spacing=0.0025, tip_radius=0.02, within=0.0102)
material = cr.Material(contact_modulus=1.0, poisson_ratio=NU)
scene = cr.Scene(1.0, asperities, material, friction=FRICTION, geometry="summit")
pressed = cr.press(scene, approach=5e-5)
touching = np.flatnonzero(pressed.loads)
limit = FRICTION * pressed.load  # gross sliding

points = asperities.positions
distances = np.hypot(*(points[:, None] - points[None]).transpose(2, 0, 1))
np.fill_diagonal(distances, np.inf)
A = 1 / (np.pi * distances)
ratio = (2 - NU) / (2 * (1 - NU))  # c_t


def own_displacement(forces: Array) -> Array:
    """Displacement of each touching asperity by Mindlin's law, both bodies together."""
    P, a = pressed.loads[touching], pressed.contact_radii[touching]
    part = np.clip(forces[touching] / (FRICTION * P), 0, 1)
    scale = 3 * (2 - NU) * FRICTION * P / (8 * material.shear_modulus * a)
    return np.asarray(scale * (1 - (1 - part) ** (2 / 3)))


def needed(forces: Array) -> Array:
    """Displacement of the bodies at which each touching asperity carries its force without slip."""
    return np.asarray(own_displacement(forces) + ratio * (A @ forces)[touching])


Q = 0.5 * limit  # any part above 0 and below 1
shares = needed(Q * pressed.loads / pressed.load)
print(f"needed displacements: from {shares.min():.2e} to {shares.max():.2e}")
assert shares.max() > 1.2 * shares.min()

# %%
# All asperities connect the same two bodies, so all must have the same displacement, not 37
# different ones. Inner asperities are displaced more by their neighbours, so the assumption gives
# them too much force, and the outer ones too little. The assumption also gives a result beyond the
# limit of friction, where no equilibrium exists:

try:
    cr.shear(pressed, force=1.01 * limit)
except cr.InputError as refusal:
    print(refusal)
    refused = True
assert refused

# %%
# The repair: two pressings
# -------------------------
#
# Let :math:`p_i(L)`, :math:`D_0(L)`, :math:`g_i(L)` be loads, approach and gaps at a total load of
# :math:`L = P - Q / f`. Then
#
# .. math:: Q_i = f (P_i - p_i), \qquad X = c_t f (D_0(P) - D_0(L)), \qquad s_i = c_t f g_i(L) .
#
# The reason: for an asperity that touches in both pressings, subtract its contact law at the total
# load :math:`L` from that at :math:`P`. Its own compression gives
# :math:`k P_i^{2/3} - k p_i^{2/3}`, which is Mindlin's displacement over :math:`c_t f`; the
# interaction gives :math:`A (P - p)`; the right side is the difference of the approaches, the same
# for all asperities.
# An asperity that is open in the second pressing has :math:`p_i = 0`, so :math:`Q_i = f P_i`. It
# slides, and its slip is :math:`c_t f` times its gap.

second = cr.press(scene, load=pressed.load - Q / FRICTION)
forces = FRICTION * (pressed.loads - second.loads)
displacement = ratio * FRICTION * (pressed.approach - second.approach)
gaps = np.where(second.loads > 0, 0.0, second.gaps)
slips = ratio * FRICTION * gaps[touching]
print("sliding:", int((slips > 0).sum()), "of", len(touching))
assert (slips > 0).sum() == 6
assert abs(displacement / cr.shear(pressed, force=Q).displacement - 1) < 1e-9
assert abs(forces.sum() / Q - 1) < 1e-12

# %%
# Sticking discs
# --------------
#
# An asperity that does not slide sticks on an inner disc of radius
# :math:`a_i (1 - Q_i / (f P_i))^{1/3}`: the contact disc of the second pressing. In the picture
# dark discs stick; the rings around them and the hatched discs have slipped.

figure, panels = plt.subplots(1, 3, figsize=(11, 4.4), layout="constrained", sharey=True)
smooth_radius = cr.smooth(scene, load=pressed.load).contact_radius
for axes, part in zip(panels, (0.25, 0.5, 0.8), strict=True):
    less = cr.press(scene, load=(1 - part) * pressed.load)
    for i in touching:
        slides = less.loads[i] == 0
        look = dict(fc="0.8", ec="0.3", lw=0.5, hatch="/////" if slides else "")
        axes.add_patch(
            Circle(
                tuple(points[i] / smooth_radius), pressed.contact_radii[i] / smooth_radius, **look
            )
        )
        axes.add_patch(
            Circle(
                tuple(points[i] / smooth_radius), less.contact_radii[i] / smooth_radius, fc="0.15"
            )
        )
    axes.set(xlim=(-1.25, 1.25), ylim=(-1.25, 1.25), aspect="equal", xlabel="$x / a_H$ [1]")
    axes.set_title(f"$Q / (f P)$ = {part}: {int((less.loads[touching] == 0).sum())} slide")
panels[0].set_ylabel("$y / a_H$ [1]")
plt.show()

# %%
# An independent check
# --------------------
#
# There are three checks. Mindlin's law for one asperity, the interaction and the slip must add up
# to the same displacement for every asperity. Slip may occur only at asperities whose shear force
# has reached the limit of friction. And ``shear``, which computes the differences in ball
# arithmetic, must agree, and prove which asperities slide.

balance = needed(forces) + slips
print(f"spread of the displacements: {np.ptp(balance) / displacement:.1e}")
assert np.ptp(balance) < 1e-11 * displacement
assert abs(balance[0] / displacement - 1) < 1e-11
assert ((slips == 0) | (forces[touching] >= FRICTION * pressed.loads[touching])).all()

state = cr.shear(pressed, force=Q)
assert state.certificate.all_proved
assert np.allclose(state.forces, forces, rtol=1e-10, atol=1e-10 * forces.max())
assert ((state.status == "sliding")[touching] == (slips > 0)).all()

# %%
# Exercise
# --------
#
# At which shear force does the outermost ring start to slide? Use ``press`` only.
#
# *Answer.* It slides when it would lose contact: reduce the total load until the ring's load is 0,
# at :math:`L_A`. Then :math:`Q / (f P) = 1 - L_A / P = 0.3517`.

outermost = touching[-1]
low, high = 0.0, pressed.approach
for _ in range(60):
    middle = (low + high) / 2
    low, high = (
        (low, middle) if cr.press(scene, approach=middle).loads[outermost] > 0 else (middle, high)
    )
onset = 1 - cr.press(scene, approach=high).load / pressed.load
print(f"the outermost ring slides from Q / (f P) = {onset:.6f}")
assert abs(onset - 0.3517) < 5e-5
