r"""
7. A proof one can check by hand
================================

**Claim.** Fractions alone can prove that two given loads have errors below 0.002, and that both
asperities touch. No number in the proof is rounded, and no solver is trusted.

Choose units in which an asperity of contact radius :math:`a` carries :math:`P = a^3` and is
indented by :math:`a^2` (:math:`E^* = \tfrac 3 4`, :math:`R = 1`). A unit load on one of two
asperities displaces the other by :math:`A = \tfrac 1 4`. The prescribed displacements are
:math:`D = (1, \tfrac 3 5)`:

.. math:: a_1^2 + \tfrac 1 4 a_2^3 = 1, \qquad a_2^2 + \tfrac 1 4 a_1^3 = \tfrac 3 5 .
"""

# %%
# The naive form
# --------------
#
# Solve numerically and insert the solution into the equations.

import math
from fractions import Fraction

import matplotlib.pyplot as plt
import numpy as np

import convexrough as cr

plt.rcParams["font.size"] = 14  # readable from the last row

Pair = tuple[Fraction, Fraction]
A = Fraction(1, 4)
D: Pair = (Fraction(1), Fraction(3, 5))


def residuals(a: Pair) -> Pair:
    """Displacements by the loads minus the prescribed ones. Exact for fractions."""
    return a[0] ** 2 + A * a[1] ** 3 - D[0], a[1] ** 2 + A * a[0] ** 3 - D[1]


coupling, (d1, d2) = float(A), map(float, D)
a1, a2 = d1, d2
for _ in range(100):
    a1, a2 = max(d1 - coupling * a2**3, 0) ** 0.5, max(d2 - coupling * a1**3, 0) ** 0.5
near = [
    (x, y)
    for x in a1 + np.spacing(a1) * np.arange(-3, 4)
    for y in a2 + np.spacing(a2) * np.arange(-3, 4)
]
solved = [(x, y) for x, y in near if min(x, y) >= 0 and x**2 + coupling * y**3 == d1]
print("pairs that solve the first equation in float64 arithmetic:", len(solved))
assert len(solved) > 1

# %%
# In float64 several neighbouring pairs solve the first equation exactly. In exact arithmetic:

for x, y in solved[:3]:
    off = residuals((Fraction(float(x)), Fraction(float(y))))
    print(f"a = ({x:.16f}, {y:.16f}): residual {float(off[0]):.1e}")
    assert off[0] != 0

# %%
# None of them is exact. The solution is irrational, so no fraction satisfies the equations
# exactly. An *inequality* can be checked in fractions.
#
# The repair, step by step
# ------------------------
#
# **1. Trial values**, from any source. Three digits are enough.

a: Pair = (Fraction(round(1000 * a1), 1000), Fraction(round(1000 * a2), 1000))
P: Pair = (a[0] ** 3, a[1] ** 3)
print("a =", *a, "  P =", *P)

# %%
# **2. Their residuals.** With the residuals :math:`e = w(P) - D`, the trial loads solve the
# contact law exactly for :math:`D + e` instead of :math:`D`.

e = residuals(a)
print("e =", *e)
assert all(abs(value) < Fraction(1, 500) for value in e)

# %%
# **3. A box.** No asperity carries more than it would alone: :math:`a_i^2 \le D_i`. The box
# :math:`b` consists of fractions above the square roots of the :math:`D_i`:

b: Pair = (Fraction(math.ceil(9 * d1**0.5), 9), Fraction(math.ceil(9 * d2**0.5), 9))
print("b =", *b)
assert all(b[i] ** 2 >= D[i] and b[i] >= a[i] for i in range(2))

# %%
# **4. Stiffness.** The indentation :math:`P^{2/3}` has the slope
# :math:`\tfrac 2 3 P^{-1/3} = 2 / (3 a)`. In the box it is at least :math:`h_i = 2 / (3 b_i)`:

h: Pair = (2 / (3 * b[0]), 2 / (3 * b[1]))
print("h =", *h)

# %%
# **5. Convexity.** For any two loads :math:`P, P^*` in the box with the difference
# :math:`d = P - P^*`, the displacements :math:`w` satisfy
#
# .. math:: d^\top (w(P) - w(P^*)) \ge h_1 d_1^2 + h_2 d_2^2 + 2 A d_1 d_2
#           \ge (h_1 - A) d_1^2 + (h_2 - A) d_2^2 \ge (1 - \theta) (h_1 d_1^2 + h_2 d_2^2)
#
# with :math:`\theta = \max A / h_i`, because :math:`2 d_1 d_2 \ge - d_1^2 - d_2^2`.

theta = max(A / h[0], A / h[1])
print("theta =", theta)
assert theta == Fraction(3, 8)

# %%
# **6. Complementarity.** The true gaps :math:`g^*` are not negative, and 0 where :math:`P^* > 0`.
# So
#
# .. math:: d^\top (w(P) - w(P^*)) = d^\top (e - g^*) = d^\top e - P^\top g^* \le d^\top e .
#
# **7. Together**, by the inequality of Cauchy and Schwarz with the weights :math:`h`, the square
# of the distance, :math:`h_1 d_1^2 + h_2 d_2^2`, is at most
# :math:`\sum_i e_i^2 / h_i / (1 - \theta)^2`:

square = (e[0] ** 2 / h[0] + e[1] ** 2 / h[1]) / (1 - theta) ** 2 if theta < 1 else math.inf
bounds = [square / h[i] for i in range(2)]  # on d_1^2 and d_2^2
print("errors squared at most:", *(f"{float(bound):.2e}" for bound in bounds))
assert max(bounds) < Fraction(2, 1000) ** 2

# %%
# **8. Statuses.** An asperity touches if its load exceeds the bound on its error. To avoid roots,
# compare squares.

for i in range(2):
    proved = P[i] ** 2 > bounds[i]
    relation, status = (">", "contact") if proved else ("<=", "not proved")
    comparison = f"P^2 = {float(P[i] ** 2):.4f} {relation} {float(bounds[i]):.1e}"
    print(f"asperity {i + 1}: {comparison}: {status}")
    assert proved

# %%
# This is a proof. Every step can be repeated with pencil and paper. The picture shows how large the
# bound on the distance is for other trial values, and for which of them steps 1 to 8 still prove
# that both asperities touch.

x, y = np.meshgrid(np.linspace(0.7, 1.1, 161), np.linspace(0.4, 0.9, 161))
h1, h2 = float(h[0]), float(h[1])
allowance = np.sqrt(
    ((x**2 + coupling * y**3 - d1) ** 2 / h1 + (y**2 + coupling * x**3 - d2) ** 2 / h2)
    / (1 - float(theta)) ** 2
)
figure, axes = plt.subplots(figsize=(7.5, 6), layout="constrained")
lines = axes.contour(x, y, allowance, [0.05, 0.1, 0.2, 0.4, 0.8], colors="0.3", linewidths=0.9)
axes.clabel(lines)
said = (x**3 > allowance / np.sqrt(h1)) & (y**3 > allowance / np.sqrt(h2))
said &= (x <= float(b[0])) & (y <= float(b[1])) & (theta < 1)
axes.contourf(x, y, said, [0.5, 1.5], colors="0.85")
axes.plot(a1, a2, "ko", ms=6)
axes.set(xlabel="trial $a_1$ [length]", ylabel="trial $a_2$ [length]")
axes.set_title("proved distance; grey: both proved to touch")
plt.show()

# %%
# An independent check
# --------------------
#
# First, bisection in fractions finds 50 digits of the solution, and the true error is compared
# with the bound. Second, the package computes a similar bound in floating-point numbers, rounding
# included.

low, high = Fraction(0), b[0]  # a_1: the second equation gives a_2^2, the first judges
for _ in range(170):
    middle = Fraction(int((low + high) / 2 * 2**180), 2**180)
    square_2 = max(D[1] - A * middle**3, Fraction(0))
    # a_1^2 + A a_2^3 > 1, squared so that it stays in fractions
    rest = D[0] - middle**2
    above = rest < 0 or (A * A * square_2**3 > rest**2)
    low, high = (low, middle) if above else (middle, high)
error_1 = abs(P[0] - low**3)
print(f"true error of P_1 {float(error_1):.2e}, proved {float(bounds[0]) ** 0.5:.2e}")
assert error_1**2 <= bounds[0]

apart = 4 / (3 * np.pi * coupling)  # 1 / (pi E* r) = A
summits = np.array([[-apart / 2, 0.0], [apart / 2, 0.0]])
heights = np.array([d1, d2]) - 1.0 + apart**2 / 16  # pressed by an approach of 1
scene = cr.Scene(
    2.0,
    cr.Asperities(summits, 2.0, heights),
    cr.Material(contact_modulus=0.75, poisson_ratio=0.3),
    geometry="summit",
)
certificate = cr.certify(scene, [float(p) for p in P], approach=1.0)
print(certificate.scope, certificate.status, certificate.load_errors)
assert certificate.all_proved
assert float(error_1) <= certificate.load_errors[0] < 2 * float(bounds[0]) ** 0.5

# %%
# Exercise
# --------
#
# A third asperity stands between them, with :math:`A_{31} = \tfrac 1 4`,
# :math:`A_{32} = \tfrac 1 5` and the prescribed displacement :math:`D_3 = \tfrac 1 5`. Prove that
# it is open.
#
# *Answer.* Its trial load is 0 and its gap
# :math:`g_3 = \tfrac 1 4 P_1 + \tfrac 1 5 P_2 - \tfrac 1 5` is positive, so :math:`e_3 = 0`. The
# box has :math:`b_3 = \tfrac{9}{20}`. In step 5 replace :math:`A` by the sum of row :math:`i` of
# the matrix. The error of the gap is at most the distance in step 7 times
# :math:`(\tfrac 1 {16 h_1} + \tfrac 1 {25 h_2})^{1/2}`.

h3 = 2 / (3 * Fraction(9, 20))
rows = (A + Fraction(1, 4), A + Fraction(1, 5), Fraction(1, 4) + Fraction(1, 5))
theta_3 = max(row / each for row, each in zip(rows, (*h, h3), strict=True))
square_3 = (e[0] ** 2 / h[0] + e[1] ** 2 / h[1]) / (1 - theta_3) ** 2 if theta_3 < 1 else math.inf
gap = P[0] / 4 + P[1] / 5 - Fraction(1, 5)
tolerance = square_3 * (1 / (16 * h[0]) + 1 / (25 * h[1]))
status = "open" if theta_3 < 1 and gap > 0 and gap**2 > tolerance else "not proved"
print(
    f"theta {theta_3}, gap {float(gap):.4f}, error at most {float(tolerance) ** 0.5:.1e}: {status}"
)
assert theta_3 < 1
assert gap > 0
assert gap**2 > tolerance
