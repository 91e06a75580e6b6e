r"""
3. Why CVXPY refuses the energy
===============================

**Claim.** A modelling language does not accept the energy of interacting asperities as convex, and
indeed the energy is not convex everywhere. An argument with charged shells shows where it is
convex: for equal discs, up to radii 57 % larger than those at which neighbouring discs touch.

The load :math:`P_j` of an asperity on an elastic half-space acts on asperity :math:`i` at the
distance :math:`r_{ij}` as a point force, and displaces it by :math:`A_{ij} P_j` with
:math:`A_{ij} = 1 / (\pi E^* r_{ij})`. Hertz's law :math:`k_i P_i^{2/3}` already contains the
effect of a load on its own asperity, so :math:`A_{ii} = 0`. With prescribed displacements
:math:`D_i` the energy is

.. math:: \Phi(P) = \sum_i \tfrac 3 5 k_i P_i^{5/3} + \tfrac 1 2 P^\top A P - D^\top P .
"""

# %%
# The naive form
# --------------
#
# Write this energy in CVXPY, for the 19 asperities nearest to the axis in the example of Dini and
# Hills (2009).

import cvxpy as cp
import matplotlib.pyplot as plt
import numpy as np
from numpy.typing import NDArray

import convexrough as cr

plt.rcParams["font.size"] = 14  # readable from the last row

Array = NDArray[np.float64]

SPACING = 0.0025
asperities = cr.Asperities.hexagonal(spacing=SPACING, tip_radius=0.02, within=0.0051)
scene = cr.Scene(
    1.0, asperities, cr.Material(contact_modulus=1.0, poisson_ratio=0.3), geometry="summit"
)


def point_forces(points: Array) -> Array:
    """A_ij = 1 / (pi r_ij), and 0 on the diagonal."""
    distances = np.hypot(*(points[:, None] - points[None]).transpose(2, 0, 1))
    np.fill_diagonal(distances, np.inf)
    return np.asarray(1 / (np.pi * distances))


length, force = 1.5e-5, 1e-8  # units in which the numbers are about 1
A = point_forces(asperities.positions) * force / length
k = (9 / (16 * scene.relative_radii)) ** (1 / 3) * force ** (2 / 3) / length
D = (1.5e-5 + scene.offsets) / length

P = cp.Variable(len(D))
naive = cp.Minimize(0.6 * k @ cp.power(P, 5 / 3) + cp.quad_form(P, A) / 2 - D @ P)
problem = cp.Problem(naive, [P >= 0])
try:
    problem.solve()
except cp.error.DCPError as refusal:
    print(refusal)
    refused = True
assert refused

# %%
# The message names the quadratic form, and rightly so. A matrix with zeros on its diagonal has the
# trace 0, so if it has positive eigenvalues it also has negative ones.

eigenvalues = np.linalg.eigvalsh(A)
print(f"eigenvalues of A: from {eigenvalues[0]:.3f} to {eigenvalues[-1]:.3f}")
assert eigenvalues[0] < 0 < eigenvalues[-1]
assert abs(eigenvalues.sum()) < 1e-10

# %%
# The function ``psd_wrap`` turns the check off: with it the user asserts that the matrix is
# positive semidefinite. This assertion is false, and for crowded asperities the solver's result is
# wrong, too. An example with two asperities whose discs overlap:

crowded = cp.quad_form(P[:2], cp.psd_wrap(np.array([[0.0, 2.0], [2.0, 0.0]]))) / 2
hertz = 0.6 * cp.sum(cp.power(P[:2], 5 / 3))
lying = cp.Problem(cp.Minimize(hertz + crowded - cp.sum(P[:2])), [P >= 0])
lying.solve(solver=cp.CLARABEL)
better = 3 / 5 - 1  # of P = (1, 0)
found, low_point = P.value[:2].round(3), float(lying.value)
print(f"{lying.status}: P = {found}, energy {low_point:.3f}; but P = (1, 0) has {better:.3f}")
assert lying.status == "optimal"
assert lying.value > better + 0.1

# %%
# The repair: shells
# ------------------
#
# Give each point force a spherical shell of radius :math:`s_i`, such that no two shells overlap,
# and spread the force evenly over it, as if it were electric charge. By Newton's theorem two
# shells act on each other as two points do, with energy :math:`P_i P_j / r_{ij}`. Each shell also
# has an energy of its own, :math:`P_i^2 / (2 s_i)`. The total energy of charges is never negative.
# Hence
#
# .. math:: M = A + \operatorname{diag}\Big(\frac{1}{\pi E^* s_i}\Big)
#           \; \text{ is positive semidefinite if } s_i + s_j \le r_{ij} .
#
# Half the distance to the nearest neighbour is always a valid :math:`s_i`.

s = SPACING / 2
M = A + np.eye(len(D)) / (np.pi * s) * force / length
print(f"least eigenvalue of M: {np.linalg.eigvalsh(M)[0]:.3f}")
assert np.linalg.eigvalsh(M)[0] > 0

# %%
# Hertz's energy is convex enough to supply this diagonal. Its second derivative is
# :math:`\tfrac 2 3 k P^{-1/3} = 1 / (2 E^* a)` with the contact radius :math:`a`. This is more
# than :math:`1 / (\pi E^* s)` as long as :math:`a < \tfrac \pi 2 s`. So the energy *is* convex
# where all contact radii are below :math:`\tfrac \pi 2 s_i`. The picture shows the energy of two
# equal asperities as load moves from one to the other: it has a minimum in the middle if the
# contacts are small, and a maximum if they are too large.

figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.8), layout="constrained")
shift = np.linspace(-1, 1, 201)
for radius, style in [(0.5, "-"), (1.2, "--"), (1.7, ":")]:
    # r = 1; loads P (1 +- shift) with 1/(2 a) = (2/3) k P^(-1/3), in units of k P^(5/3)
    coupling = 2 * radius / np.pi * (2 / 3)  # A_12 P^2 / (k P^(5/3))
    energy = 0.6 * ((1 + shift) ** (5 / 3) + (1 - shift) ** (5 / 3) - 2) - coupling * shift**2
    left.plot(shift, energy, "k", ls=style, label=f"contact radius {radius:g} r")
left.set(xlabel="share of load moved from one to the other [1]", ylabel="energy / $k P^{5/3}$ [1]")
left.legend()

rng = np.random.default_rng(3)
bare_least, shell_least = [], []
for _ in range(300):
    points = rng.uniform(-1, 1, (12, 2))
    bare = point_forces(points)
    bare_least.append(float(np.linalg.eigvalsh(bare)[0]))
    nearest = 1 / (np.pi * bare.max(axis=1))
    shell_least.append(float(np.linalg.eigvalsh(bare + np.diag(2 / (np.pi * nearest)))[0]))
right.semilogx(-np.array(bare_least), np.zeros(300), "k|", ms=9, alpha=0.4)
right.semilogx(shell_least, np.ones(300), "k|", ms=9, alpha=0.4)
right.set(
    yticks=[0, 1], yticklabels=["$A$: minus the\nleast eigenvalue", "$M$: the least\neigenvalue"]
)
right.set(xlabel="300 random layouts of 12 points [1/length]", ylim=(-0.5, 1.5))
assert max(bare_least) < 0 < min(shell_least)
plt.show()

# %%
# Still refused
# -------------
#
# The quadratic part is convex now, and each local part
# :math:`\tfrac 3 5 k P^{5/3} - \tfrac{1}{2 \pi E^* s} P^2` is convex for contact radii up to
# :math:`\tfrac \pi 2 s`. But CVXPY judges each term by rules from the form in which it is written,
# and the local part is a difference of two convex functions.

sigma = force / length / (np.pi * s)
local = 0.6 * k @ cp.power(P, 5 / 3) - sigma / 2 * cp.sum_squares(P)
split = cp.Problem(cp.Minimize(local + cp.quad_form(P, M) / 2 - D @ P), [P >= 0])
print("accepted by the rules:", split.is_dcp())
assert not split.is_dcp()

# %%
# Lesson 5 writes the local part in a form that the rules accept.
#
# An independent check
# --------------------
#
# The lemma rests on Newton's theorem. To test the theorem, spread two charges over many points on
# two shells and add up all pairs. The sum must be that of two point charges, whatever the radii,
# as long as the shells do not overlap.


def shell(radius: float, centre: float, count: int = 3000) -> Array:
    """Points spread evenly over a sphere about (centre, 0, 0): a Fibonacci spiral."""
    i = np.arange(count) + 0.5
    z, turn = 1 - 2 * i / count, np.pi * (1 + np.sqrt(5)) * i
    ring = np.sqrt(1 - z**2)
    return radius * np.column_stack([ring * np.cos(turn), ring * np.sin(turn), z]) + [centre, 0, 0]


mutual = []
for radii in [(0.2, 0.3), (0.4, 0.55), (0.6, 0.35)]:
    one, other = shell(radii[0], 0.0), shell(radii[1], 1.0)
    squares = (one**2).sum(axis=1)[:, None] + (other**2).sum(axis=1) - 2 * one @ other.T
    mutual.append(float((1 / np.sqrt(squares)).mean()))
    print(f"shells of radius {radii} at distance 1: mean of 1/r = {mutual[-1]:.6f}")
assert np.allclose(mutual, 1.0, atol=1e-4)

# %%
# Exercise
# --------
#
# Take two equal asperities alone, at distance :math:`r`. Up to which contact radius is their energy
# convex, and up to which radius does the lemma prove this?
#
# *Answer.* The Hessian has :math:`1/(2 E^* a)` on its diagonal and :math:`1/(\pi E^* r)` off it, so
# it is positive definite up to :math:`a = \tfrac \pi 2 r`. The lemma with :math:`s = r/2` proves
# convexity up to half of this radius, because it allows for neighbours on all sides. Discs touch at
# :math:`a = r/2`, below both limits.


def definite(radius: float) -> bool:
    hessian = np.array([[1 / (2 * radius), 1 / np.pi], [1 / np.pi, 1 / (2 * radius)]])  # r = 1
    return bool(np.linalg.eigvalsh(hessian)[0] > 0)


low, high = 0.1, 10.0
for _ in range(60):
    middle = (low + high) / 2
    low, high = (middle, high) if definite(middle) else (low, middle)
print("convex up to a / r =", low)
assert abs(low - np.pi / 2) < 1e-9
