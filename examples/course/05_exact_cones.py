r"""
5. The exact cones: powers of the contact radius
================================================

**Claim.** In powers of the contact radius, the energy that no modelling language accepts becomes a
second-order cone program with four cones per asperity. If no contact discs overlap, the program is
exact: it has the same minimum and the same loads.

The shell lemma (lesson 3) leaves for each asperity the local energy
:math:`h(P) = \tfrac 3 5 k P^{5/3} - \tfrac 1 2 \sigma P^2` with :math:`\sigma = 1 / (\pi E^* s)`.
It is convex up to some load :math:`B`, but it is written as a difference of convex functions. Let
:math:`t` be the contact radius divided by that at :math:`P = B`. Then :math:`P = B t^3`, and with
:math:`S = \sigma / (\tfrac 2 3 k B^{-1/3}) \le 1`

.. math:: h = k B^{5/3} \Big[ \tfrac 3 5 t^5 - \tfrac S 3 t^6 \Big], \qquad 0 \le t \le 1 .
"""

# %%
# The naive form
# --------------
#
# The bracket is a polynomial. Minimise it with CVXPY.

from fractions import Fraction
from itertools import product

import cvxpy as cp
import matplotlib.pyplot as plt
import numpy as np

import convexrough as cr

plt.rcParams["font.size"] = 14  # readable from the last row

S = 0.8
t = cp.Variable(nonneg=True)
naive = cp.Problem(cp.Minimize(0.6 * cp.power(t, 5) - S / 3 * cp.power(t, 6)), [t <= 1])
try:
    naive.solve()
except cp.error.DCPError as refusal:
    print(refusal)
    refused = True
assert refused

# %%
# The usual remedy is a *lift*: introduce variables :math:`y_3, y_5, y_6` for
# :math:`t^3, t^5, t^6`, and require only convex relations between them. Here the term with the
# minus sign prevents this: the minimum makes :math:`y_6` as large as it can, and a convex upper
# bound such as :math:`y_6 \le y_5` is too weak.

y3, y5, y6 = (cp.Variable(nonneg=True) for _ in range(3))
slope = 0.3  # stands for the approach: minimise h - slope * load
loose = cp.Problem(
    cp.Minimize(0.6 * y5 - S / 3 * y6 - slope * y3),
    [cp.power(y3, 5 / 3) <= y5, y5 <= 1, y6 <= y5],
)
loose.solve(solver=cp.CLARABEL)
radii = np.linspace(0, 1, 100001)
true_least = float((0.6 * radii**5 - S / 3 * radii**6 - slope * radii**3).min())
print(f"least energy {true_least:.6f}, by this relaxation {loose.value:.6f}")
assert loose.value < true_least - 0.005

# %%
# The repair: four cones
# ----------------------
#
# Introduce variables :math:`y_2, \dots, y_5` for :math:`t^2, \dots, t^5` and :math:`z` for
# :math:`t^5 - t^6`. Then the objective is :math:`(\tfrac 3 5 - \tfrac S 3) y_5 + \tfrac S 3 z`,
# without a minus sign. Powers of one number satisfy four rotated cones :math:`x y \ge w^2`, each
# with equality:
#
# .. math:: 1 \cdot y_4 \ge y_2^2, \quad (y_2 - y_3)(y_4 - y_5) \ge (y_3 - y_4)^2,
#           \quad y_3 y_5 \ge y_4^2, \quad (y_3 - y_4) z \ge (y_4 - y_5)^2 .


def lifted(S: float, slope: float) -> tuple[float, float]:
    """Minimum of the lifted energy minus slope * y3, and y3 at the minimum."""
    y2, y3, y4, y5, z = (cp.Variable() for _ in range(5))

    def rotated(x: cp.Expression, y: cp.Expression, w: cp.Expression) -> cp.SOC:
        return cp.SOC(x + y, cp.hstack([x - y, 2 * w]))

    cones = [
        rotated(cp.Constant(1), y4, y2),
        rotated(y2 - y3, y4 - y5, y3 - y4),
        rotated(y3, y5, y4),
        rotated(y3 - y4, z, y4 - y5),
    ]
    problem = cp.Problem(cp.Minimize((0.6 - S / 3) * y5 + S / 3 * z - slope * y3), cones)
    assert problem.is_dcp()
    return float(problem.solve(solver=cp.CLARABEL)), float(y3.value)


exact, load = lifted(S, slope)
print(f"least energy {true_least:.9f}, by four cones {exact:.9f}")
assert abs(exact - true_least) < 1e-7

# %%
# The picture shows the four cones, and the curve of true powers for :math:`t` from 0 to 1. The
# curve lies on the surface of each cone, and so do the solutions of the program.

figure = plt.figure(figsize=(11, 10), layout="constrained")
t = np.linspace(0, 1, 60)
one = np.ones_like(t)
curves = [
    (one, t**4, t**2, "1", "y_4", "y_2"),
    (t**2 - t**3, t**4 - t**5, t**3 - t**4, "y_2-y_3", "y_4-y_5", "y_3-y_4"),
    (t**3, t**5, t**4, "y_3", "y_5", "y_4"),
    (t**3 - t**4, t**5 - t**6, t**4 - t**5, "y_3-y_4", "z", "y_4-y_5"),
]
for place, (x, y, w, *names) in enumerate(curves, start=1):
    axes = figure.add_subplot(2, 2, place, projection="3d", computed_zorder=False)
    u, v = np.meshgrid(np.linspace(0, 1.05 * x.max(), 25), np.linspace(0, 1.05 * y.max(), 25))
    axes.plot_surface(u, v, np.sqrt(u * v), color="0.85", alpha=0.6, edgecolor="0.7", lw=0.3)
    axes.plot(x, y, w, "k-", lw=3, zorder=5)
    axes.set(xlabel=f"${names[0]}$", ylabel=f"${names[1]}$", zlabel=f"${names[2]}$")
    axes.set_title(f"$({names[0]}) \\cdot ({names[1]}) \\geq ({names[2]})^2$")
    axes.tick_params(labelsize=11)
    axes.locator_params(nbins=3)
    axes.view_init(25, -50)
    axes.set_box_aspect(None, zoom=0.85)  # room for the names of the axes
    axes.xaxis.labelpad = axes.yaxis.labelpad = axes.zaxis.labelpad = 10
    assert np.allclose(x * y, w**2)
plt.show()

# %%
# An independent check: the identity
# ----------------------------------
#
# Why is the lifted energy never below that of the true powers? A cone :math:`x y \ge w^2` implies
# :math:`x s^2 - 2 w s + y \ge 0` for every :math:`s` (for the first cone with :math:`s^2` in place
# of :math:`s`). Multiply these four inequalities by weights that are not negative, and add them up.
# The sum is the lifted energy minus the tangent of the energy at :math:`t = s`:
#
# .. math:: \big(\tfrac 3 5 - \tfrac S 3\big) y_5 + \tfrac S 3 z - \lambda y_3 + \mu
#           = d\,[s^4 - 2 s^2 y_2 + y_4] + c\,[\cdot] + e\,[\cdot] + \tfrac S 3 [\cdot] \ge 0 .
#
# Each bracket is the left side of one inequality; the code below defines :math:`\lambda`,
# :math:`\mu` and the weights :math:`d, c, e`. Both sides are of first degree in :math:`S` and in
# the :math:`y`, and of degree 6 in :math:`s`. Polynomials of degree 6 that agree at seven points
# are the same. So a finite number of evaluations in exact fractions is a proof.


def difference(s: Fraction, S: Fraction, y: tuple[Fraction, ...]) -> Fraction:
    """Left side minus right side."""
    y2, y3, y4, y5, z = y
    lam = s**2 - Fraction(2, 3) * S * s**3
    mu = Fraction(2, 5) * s**5 - S / 3 * s**6
    c = Fraction(4, 5) * s - Fraction(2, 3) * S * s**2
    d, e = c / 2, Fraction(3, 5) - S / 3 - Fraction(2, 3) * S * s + c
    left = (Fraction(3, 5) - S / 3) * y5 + S / 3 * z - lam * y3 + mu
    right = d * (s**4 - 2 * s**2 * y2 + y4)
    right += c * ((y2 - y3) * s**2 - 2 * (y3 - y4) * s + (y4 - y5))
    right += e * (y3 * s**2 - 2 * y4 * s + y5)
    right += S / 3 * ((y3 - y4) * s**2 - 2 * (y4 - y5) * s + z)
    return left - right


corners = [
    tuple(Fraction(int(i == j)) for i in range(5)) for j in range(-1, 5)
]  # 0 and unit vectors
grid = product([Fraction(i, 7) for i in range(8)], [Fraction(0), Fraction(1)], corners)
checked = [difference(s, S_, y) for s, S_, y in grid]
print(f"{len(checked)} evaluations, all zero:", all(value == 0 for value in checked))
assert len(checked) == 96
assert all(value == 0 for value in checked)

# %%
# For :math:`0 \le s \le 1` the other weights are never negative, so only :math:`e` remains to be
# checked. It is concave in :math:`s`, with :math:`e = \tfrac 3 5 - \tfrac S 3` at 0 and
# :math:`e = \tfrac 5 3 (\tfrac{21}{25} - S)` at 1. So four cones are exact up to :math:`S = 21/25`;
# contacts between equal discs that do not overlap have :math:`S \le 2/\pi = 0.64`.
#
# The program of a whole scene has these cones for every asperity, and one quadratic form. For the
# scene of Dini and Hills (2009) it finds the 37 asperities that touch. Newton's method, which uses
# no cones, finds the same loads.

asperities = cr.Asperities.hexagonal(spacing=0.0025, tip_radius=0.02, within=0.0102)
scene = cr.Scene(
    1.0, asperities, cr.Material(contact_modulus=1.0, poisson_ratio=0.3), geometry="summit"
)
by_cones = cr.press(scene, approach=5e-5, solver=cr.solvers.ConicCVXPY(newton_step=False))
by_newton = cr.press(scene, approach=5e-5)
apart = abs(by_cones.loads - by_newton.loads).max() / by_newton.loads.max()
print(f"largest difference of loads: {apart:.1e} of the largest load")
assert apart < 1e-7
assert (by_newton.status == "contact").sum() == 37

# %%
# Exercise
# --------
#
# What happens with four cones beyond :math:`S = 21/25`? Take :math:`S = 0.97`, and the slope (the
# argument of ``lifted``) for which the energy has its minimum at :math:`t = 0.9`.
#
# *Answer.* The minimum of the cone program is below that of the energy: one weight of the identity
# is negative, and values :math:`y_2, \dots, y_5, z` that are not powers of one number have less
# energy. A fifth cone, with :math:`t` itself as a variable, makes the program exact up to
# :math:`S = 1`, where the energy stops being convex.

edge, at = 0.97, 0.9
steep = at**2 - 2 / 3 * edge * at**3
relaxed = lifted(edge, steep)[0]
least = 0.6 * at**5 - edge / 3 * at**6 - steep * at**3
print(f"S = 0.97: true {least:.6f}, four cones {relaxed:.6f}")
assert relaxed < least - 1e-6
