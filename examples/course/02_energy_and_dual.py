r"""
2. The energy, its dual, and the word "optimal"
===============================================

**Claim.** From any loads, right or wrong, one can compute their energy, which is at least the
minimum, and a dual bound, which is at most the minimum. The difference, the *duality gap*, limits
the error of the loads. The status that a solver reports does not.

Seven Hertzian tips stand on short elastic stems. The load :math:`P_i` compresses tip :math:`i` by
:math:`k P_i^{2/3}`. Stems and substrate move by :math:`(M P)_i` with a symmetric, positive
definite matrix :math:`M`. (The compliance of the stems is the diagonal of :math:`M`; lesson 3
treats asperities without stems.) If displacements :math:`D_i` are prescribed, the loads minimise

.. math:: \Phi(P) = \sum_i \tfrac 3 5 k P_i^{5/3} + \tfrac 1 2 P^\top M P - D^\top P,
          \qquad P \ge 0,

which is convex, so a modelling language accepts it as it is.
"""

# %%
# Units in which the solver fails
# -------------------------------
#
# Write the program in units in which the sphere's radius and the modulus are 1. Then approaches
# are about :math:`10^{-5}` and loads about :math:`10^{-9}`.

import cvxpy as cp
import matplotlib.pyplot as plt
import numpy as np
from numpy.typing import NDArray

plt.rcParams["font.size"] = 14  # readable from the last row

Array = NDArray[np.float64]

spacing, tip = 0.0025, 0.02
angles = np.arange(6) * np.pi / 3
points = np.vstack([[0, 0], spacing * np.column_stack([np.cos(angles), np.sin(angles)])])
distances = np.hypot(*(points[:, None] - points[None]).transpose(2, 0, 1))
np.fill_diagonal(distances, spacing / 2)  # the stems
M = 1 / (np.pi * distances)
k = np.full(7, (9 / (16 * tip)) ** (1 / 3))
D = 1.5e-5 - (points**2).sum(axis=1) / 2


def solve(k: Array, M: Array, D: Array) -> tuple[str, Array]:
    """Status and loads, from Clarabel through CVXPY."""
    P = cp.Variable(7)
    energy = 0.6 * k @ cp.power(P, 5 / 3) + cp.quad_form(P, M) / 2 - D @ P
    problem = cp.Problem(cp.Minimize(energy), [P >= 0])
    problem.solve(solver=cp.CLARABEL)
    return str(problem.status), np.array(P.value)


status, poor = solve(k, M, D)
print(status, poor)

# %%
# The solver reports "optimal". Check the loads themselves: the displacements that they cause
# should equal the prescribed ones.

print("prescribed:      ", D[:2])
print("what these cause:", (k * np.maximum(poor, 0) ** (2 / 3) + M @ poor)[:2])
assert status == "optimal"
assert abs((k * np.maximum(poor, 0) ** (2 / 3) + M @ poor)[0] / D[0] - 1) > 1

# %%
# The solver stops when its residuals are below :math:`10^{-8}`. The exact loads are smaller than
# this tolerance, so the solver accepts values that are far too large. It did what it promises, but
# the tolerance does not fit the size of these numbers.
#
# The repair: a bound from the loads alone
# ----------------------------------------
#
# Let :math:`p` be trial loads. For any loads :math:`x`, :math:`(x - p)^\top M (x - p) \ge 0`, so
# :math:`\tfrac 1 2 x^\top M x \ge p^\top M x - \tfrac 1 2 p^\top M p`. With this bound in place of
# the quadratic term, the energy of :math:`x` is a sum of one term per tip,
# :math:`\tfrac 3 5 k x_i^{5/3} - \lambda x_i` with :math:`\lambda = (D - M p)_i`, and a constant. A
# term is smallest at :math:`x_i = (\lambda / k)^{3/2}`, where it is
# :math:`-\tfrac 2 5 \lambda^{5/2} k^{-3/2}`; if :math:`\lambda < 0`, its minimum is 0. So
#
# .. math:: \min \Phi \; \ge \; - \tfrac 1 2 p^\top M p
#           - \tfrac 2 5 \sum_i k^{-3/2} \max(D - M p, 0)_i^{5/2} \quad \text{for every } p.


def energy_of(p: Array) -> float:
    return float(0.6 * k @ p ** (5 / 3) + p @ M @ p / 2 - D @ p)


def dual_bound(p: Array) -> float:
    room = np.maximum(D - M @ p, 0.0)
    return float(-p @ M @ p / 2 - 0.4 * (k**-1.5) @ room**2.5)


poor = np.maximum(poor, 0.0)
print(f"poor loads: energy {energy_of(poor):.3e}, dual bound {dual_bound(poor):.3e}")
assert energy_of(poor) > 0 > dual_bound(poor)

# %%
# Zero loads have the energy 0: the solver's "optimum" has more energy than no contact at all. In
# units in which displacements and loads are about 1, the solver solves the same program
# accurately, and the duality gap shows it.

length = D[0]
force = (length / k[0]) ** 1.5
status, scaled = solve(k * force ** (2 / 3) / length, M * force / length, D / length)
loads = np.maximum(scaled, 0.0) * force
gap = energy_of(loads) - dual_bound(loads)
print(f"scaled: {status}, gap over energy {gap / abs(energy_of(loads)):.1e}")
assert 0 <= gap < 1e-6 * abs(energy_of(loads))

# %%
# From a gap to loads
# -------------------
#
# The Hessian of the energy minus :math:`M` is positive semidefinite. So loads whose energy exceeds
# the minimum by no more than the gap differ from the exact loads by at most
# :math:`\sqrt{2\, \text{gap} / \mu}`, where :math:`\mu` is the smallest eigenvalue of :math:`M`.
# Because of the root, eight digits of the energy give only four digits of the loads. The picture
# shows trial loads on the way from the poor loads to the accurate ones.

mu = float(np.linalg.eigvalsh(M)[0])
rest = np.logspace(0, -5, 60)  # 1: the poor loads; 0: the accurate ones
trials = [loads + part * (poor - loads) for part in rest]
above, below = [energy_of(p) for p in trials], [dual_bound(p) for p in trials]
unit = abs(energy_of(loads))

figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.6), layout="constrained")
left.semilogx(rest, np.array(above) / unit, "k-", label="energy $\\Phi(p)$")
left.semilogx(rest, np.array(below) / unit, "k--", label="dual bound from the same loads")
left.axhline(-1, color="0.6", lw=0.8)
left.set(xlabel="part of the way back to the poor loads [1]", ylabel="energy / $|\\Phi^*|$ [1]")
left.set_yscale("symlog")
left.legend(loc="lower left")
gaps = np.maximum(np.array(above) - np.array(below), 1e-16 * unit)
error = np.array([np.linalg.norm(p - loads) for p in trials])
right.loglog(gaps / unit, error / loads.max(), "ko", ms=3, label="true error")
right.loglog(gaps / unit, np.sqrt(2 * gaps / mu) / loads.max(), "k-", label="proved from the gap")
right.set(xlabel="duality gap / $|\\Phi^*|$ [1]", ylabel="error of the loads / largest load [1]")
right.legend()
plt.show()

# %%
# An independent check
# --------------------
#
# Solve the contact law itself by Newton's method, in the indentations :math:`\delta` of the tips:
# :math:`\delta + M P(\delta) = D` with :math:`P = (\max(\delta, 0) / k)^{3/2}`. This does not use
# the energy. The bound must hold, and the energy and the dual bound must enclose the minimum.

delta = D.copy()
for _ in range(50):
    P = (np.maximum(delta, 0) / k) ** 1.5
    slope = 1.5 * np.sqrt(np.maximum(delta, 0) / k) / k
    delta -= np.linalg.solve(np.eye(7) + M * slope, delta + M @ P - D)
reference = (np.maximum(delta, 0) / k) ** 1.5
true_error = float(np.linalg.norm(loads - reference))
print(f"true error {true_error:.1e}, proved {np.sqrt(2 * gap / mu):.1e}, of {loads.max():.1e}")
assert true_error <= np.sqrt(2 * gap / mu) + 1e-14 * loads.max()
assert dual_bound(loads) <= energy_of(reference) * (1 - 1e-12)
assert abs(dual_bound(reference) / energy_of(reference) - 1) < 1e-9
assert energy_of(reference) <= energy_of(loads) * (1 - 1e-12)

# %%
# Exercise
# --------
#
# Insert :math:`p = 0` into the dual bound. Of which contact is this bound the minimum of the
# energy? How far is it from the minimum of the energy here?
#
# *Answer.* :math:`\min \Phi \ge -\tfrac 2 5 \sum k^{-3/2} D_i^{5/2}`, the energy of seven tips
# without stems that do not interact. Neighbours and stems make the contact more compliant, so they
# reduce the loads. The absolute value of the bound is 1.67 times that of the minimum.

alone = dual_bound(np.zeros(7))
print("bound from zero loads over the minimum:", alone / energy_of(reference))
assert alone < energy_of(reference) < 0
assert abs(alone / energy_of(reference) - 1.67) < 0.005
