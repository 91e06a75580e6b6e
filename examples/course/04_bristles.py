r"""
4. One asperity as a quadratic program of bristles
==================================================

**Claim.** Hertz's law, with its power of 3/2, follows from a quadratic program: a row of
independent linear springs that can only push. Each spring obeys its own complementarity condition.
The load converges at second order in the number of springs.

A sphere of radius :math:`R` (the relative radius of both surfaces) is pressed by an approach
:math:`\delta` and carries the load :math:`P = \tfrac 4 3 E^* \sqrt R \, \delta^{3/2}`. Take
:math:`E^* = R = 1`.
"""

# %%
# The naive form
# --------------
#
# Solvers of quadratic programs are robust and fast. Try to minimise Hertz's energy,
# :math:`\tfrac 3 5 k P^{5/3} - \delta P`, with such a solver.

from typing import Any

import cvxpy as cp
import matplotlib.pyplot as plt
import numpy as np
import osqp
import scipy.sparse as sp
from numpy.typing import NDArray

import convexrough as cr

plt.rcParams["font.size"] = 14  # readable from the last row

Array = NDArray[np.float64]

delta, modulus, radius = 0.01, 1.0, 1.0
hertz = 4 / 3 * modulus * np.sqrt(radius) * delta**1.5

load = cp.Variable(nonneg=True)
k = (9 / (16 * modulus**2 * radius)) ** (1 / 3)
problem = cp.Problem(cp.Minimize(0.6 * k * cp.power(load, 5 / 3) - delta * load))
try:
    problem.solve(solver=cp.OSQP)
except cp.error.SolverError as refusal:
    print(refusal)
    refused = True
assert refused

# %%
# A power of 5/3 is not quadratic, and no parabola approximates it near 0, where its slope is 0 and
# its curvature is infinite.
#
# The repair: bristles
# --------------------
#
# Place springs, the *bristles*, side by side on a line through the centre. Each has the width
# :math:`\Delta x` and the stiffness :math:`E^* \Delta x`. The sphere is replaced by the profile
# :math:`x^2 / R`, *twice* that of the sphere. With this profile the row carries the same load as
# the half-space (method of dimensionality reduction). The forces :math:`f_j` of the bristles
#
# .. math:: \text{minimise } \sum_j \frac{f_j^2}{2 E^* \Delta x} + \frac{x_j^2}{R} f_j - \delta f_j,
#           \qquad f \ge 0 .
#
# This is a quadratic program. A bristle that touches is shortened by :math:`\delta - x^2/R`; all
# others have a gap. For narrow bristles the sum of the forces over
# :math:`|x| \le a = \sqrt{R \delta}` becomes
#
# .. math:: P = \int_{-a}^{a} E^* \Big( \delta - \frac{x^2}{R} \Big) dx
#           = E^* \Big( 2 a \delta - \frac{2 a^3}{3 R} \Big)
#           = \tfrac 4 3 E^* a \delta = \tfrac 4 3 E^* \sqrt R \, \delta^{3/2}.


def bristles(count: int, reach: float, approach: float) -> tuple[Array, Array]:
    """Places and forces of `count` bristles over -reach .. reach, from OSQP."""
    width = 2 * reach / count
    x: Any = -reach + width * (np.arange(count) + 0.5)
    unit = modulus * width * approach  # scaled: forces and energies are about 1
    solver = osqp.OSQP()
    solver.setup(
        P=sp.identity(count, format="csc"),
        q=x**2 / radius / approach - 1,
        A=sp.identity(count, format="csc"),
        l=np.zeros(count),
        u=np.full(count, np.inf),
        eps_abs=1e-9,
        eps_rel=1e-9,
        polishing=True,
        verbose=False,
    )
    forces: Array = unit * np.maximum(solver.solve(raise_error=True).x, 0.0)
    return x, forces


a = np.sqrt(radius * delta)
x, f = bristles(64, 1.4 * a, delta)
assert np.allclose(f, modulus * (x[1] - x[0]) * np.maximum(delta - x**2 / radius, 0), atol=1e-9)
print(f"64 bristles: load {f.sum():.6e}, Hertz {hertz:.6e}, error {f.sum() / hertz - 1:.1e}")
assert abs(f.sum() / hertz - 1) < 1e-3

# %%
# The order of convergence
# ------------------------
#
# The force on a bristle has a kink where contact ends. The error of the midpoint rule there
# depends on where the edge of the contact lies within a strip. To average this out, take the root
# mean square over many approaches. The order is then 2.

counts = np.array([16, 32, 64, 128, 256])
errors = []
for count in counts:
    squares = []
    for approach in delta * np.linspace(0.6, 1.0, 41):
        x_all = -1.4 * a + 2.8 * a / count * (np.arange(count) + 0.5)
        exact = 2.8 * a / count * np.maximum(approach - x_all**2 / radius, 0)  # the QP's solution
        squares.append((exact.sum() / (4 / 3 * radius**0.5 * approach**1.5) - 1) ** 2)
    errors.append(float(np.sqrt(np.mean(squares))))
order = float(-np.polyfit(np.log(counts), np.log(errors), 1)[0])
print("errors:", *(f"{error:.1e}" for error in errors), f" order {order:.2f}")
assert abs(order - 2) < 0.1

figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.6), layout="constrained")
left.bar(x / a, f / f.max(), width=2.8 / 64, color="0.75", edgecolor="0.3", label="bristles")
fine = np.linspace(-1, 1, 101)
left.plot(fine, 1 - fine**2, "k-", label="$\\delta - x^2 / R$")
left.plot(fine, np.sqrt(1 - fine**2), "k--", label="Hertz pressure / $p_0$")
left.set(xlabel="$x / a$ [1]", ylabel="force / largest force [1]")
left.legend(loc="lower center")
right.loglog(counts, errors, "ko", label="error of the load")
right.loglog(counts, errors[0] * (counts[0] / counts) ** 2.0, "k-", lw=0.8, label="second order")
right.set(xlabel="number of bristles", ylabel="relative error [1]")
right.set_xticks(counts, labels=counts, minor=False)
right.minorticks_off()
right.legend()
plt.show()

# %%
# An independent check
# --------------------
#
# The bristles also determine the pressure. It is the Abel transform of their force per length
# :math:`q(x)`, :math:`p(r) = -\tfrac 1 \pi \int_r^a q'(x) / \sqrt{x^2 - r^2}\, dx`. The
# substitution :math:`x = \sqrt{r^2 + t^2}` removes the singularity. On the axis and at half the
# radius the pressure must be :math:`p_0 \sqrt{1 - r^2/a^2}` with :math:`p_0 = 2 E^* a / (\pi R)`.
# The minimum of the energy must be :math:`-\tfrac 2 5 \delta P`, as for any law of power 3/2.

p0 = 2 * modulus * a / (np.pi * radius)
x, f = bristles(512, 1.4 * a, delta)
q = f / (2.8 * a / 512)
pressures = []
for r in (0.0, 0.5 * a):
    t = np.linspace(0, np.sqrt(a**2 - r**2), 400)
    at = np.sqrt(r**2 + t**2)
    slope_over_x = np.interp(at, x[257:-1], (np.gradient(q, x) / x)[257:-1])
    pressures.append(float(-np.trapezoid(slope_over_x, t) / np.pi))
    print(
        f"p({r / a:.1f} a) / p0 = {pressures[-1] / p0:.4f}, Hertz {np.sqrt(1 - (r / a) ** 2):.4f}"
    )
assert np.allclose(pressures, p0 * np.sqrt([1, 0.75]), rtol=5e-3)

energy = float((f**2 / (2 * modulus * 2.8 * a / 512) + (x**2 / radius - delta) * f).sum())
print(f"energy / (delta P) = {energy / (delta * f.sum()):.6f}")
assert abs(energy / (delta * f.sum()) + 0.4) < 1e-4

# %%
# The package solves the same program for any number of asperities. Each asperity has its own
# bristles; the asperities interact through their total loads.

material = cr.Material(contact_modulus=1.0, poisson_ratio=0.3)
asperities = cr.Asperities.hexagonal(spacing=0.0025, tip_radius=0.02, within=0.0102)
scene = cr.Scene(1.0, asperities, material, geometry="summit")
by_newton = cr.press(scene, approach=5e-5)
as_solved = cr.press(scene, approach=5e-5, solver=cr.solvers.BristleQP(newton_step=False))
apart = abs(as_solved.loads - by_newton.loads).max() / by_newton.loads.max()
print(f"37 asperities, 64 bristles each: {apart:.1e} of the largest load")
assert apart < 1e-3

# %%
# Exercise
# --------
#
# A cone with the slope :math:`\tan \theta` has the bristle profile
# :math:`\tfrac \pi 2 |x| \tan\theta`. Derive its law from the bristles, and compare with Sneddon's
# law, :math:`P = 2 E^* \delta^2 / (\pi \tan\theta)`.
#
# *Answer.* Contact ends at :math:`a = 2 \delta / (\pi \tan\theta)`, and :math:`P = 2 E^* \int_0^a
# (\delta - \tfrac \pi 2 x \tan\theta)\, dx = E^* a \delta`: Sneddon's law.

slope = 0.1
edge = 2 * delta / (np.pi * slope)
places = edge * (np.arange(1000) + 0.5) / 1000
cone = float(2 * modulus * (delta - np.pi / 2 * places * slope).sum() * edge / 1000)
print(f"cone: {cone:.8e}, Sneddon {2 * modulus * delta**2 / (np.pi * slope):.8e}")
assert abs(cone / (2 * modulus * delta**2 / (np.pi * slope)) - 1) < 1e-9
