r"""
1. Two asperities by hand
=========================

**Claim.** Which of two asperities touch is decided by four systems of equations, of which exactly
one gives an answer that is allowed. The same answer is the lowest point of an energy on the
quadrant of loads that are not negative.

A flat stamp is lowered on two asperities, 1 and 2. It wants asperity :math:`i` to give way by
:math:`D_i`. A loaded asperity gives way in two ways: it is squashed, and it sits in the dent that
the other one makes. To keep the hand calculation linear, let each be a spring here. The next
scripts return to Hertz's law.

.. math:: w_1 = P_1 + A P_2, \qquad w_2 = A P_1 + P_2, \qquad 0 < A < 1.

Each asperity either touches, then :math:`w_i = D_i` and :math:`P_i \ge 0`; or it does not, then
:math:`P_i = 0` and its gap :math:`g_i = w_i - D_i` is not negative. Load and gap are never both
positive: they are *complementary*.
"""

# %%
# The naive form
# --------------
#
# Both asperities are meant to give way, so solve the two equations for two loads.

import itertools
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

plt.rcParams["font.size"] = 14  # to be read from the last row

Array = NDArray[np.float64]

A = 0.6
D = np.array([1.0, 0.4])
stiffness = np.array([[1.0, A], [A, 1.0]])

naive = np.linalg.solve(stiffness, D)
print("loads:", naive)
assert naive[1] < 0

# %%
# The second load is negative: asperity 2 would have to *pull* on the stamp. Nothing glues them
# together, so this is not an answer, though every equation holds. The lower asperity lies in the
# dent made by the taller one.
#
# Cutting the negative load off does not mend it. Asperity 1 then no longer gives way by what is
# asked of it.

cut = np.maximum(naive, 0.0)
print("asked of asperity 1:", D[0], "  after cutting:", (stiffness @ cut)[0])
assert abs((stiffness @ cut)[0] - D[0]) > 0.1

# %%
# The repair: four cases
# ----------------------
#
# Each asperity touches or does not: :math:`2 \cdot 2` cases. In each one the loads of the open ones
# are 0 and the gaps of the others are 0, which leaves as many equations as unknowns. Then look at
# the signs.


def solve_case(
    touching: tuple[int, ...], asked: Array, stiffness: Array = stiffness
) -> tuple[Array, Array]:
    """Loads and gaps if exactly these asperities touch; signs are not looked at."""
    loads = np.zeros(2)
    among = list(touching)
    if among:
        loads[among] = np.linalg.solve(stiffness[np.ix_(among, among)], asked[among])
    return loads, stiffness @ loads - asked


def allowed(loads: Array, gaps: Array) -> bool:
    return bool((loads >= 0).all() and (gaps >= -1e-12).all())


CASES: list[tuple[int, ...]] = [(), (0,), (1,), (0, 1)]
for case in CASES:
    loads, gaps = solve_case(case, D)
    label = "allowed" if allowed(loads, gaps) else ""
    print(f"touching {[i + 1 for i in case]!s:7} loads {loads}  gaps {gaps}  {label}")

answers = [solve_case(case, D)[0] for case in CASES if allowed(*solve_case(case, D))]
assert len(answers) == 1
answer = answers[0]
assert np.allclose(answer, [1.0, 0.0])

# %%
# One case passes: asperity 1 carries :math:`P_1 = D_1 = 1`, and asperity 2 has a gap of :math:`A
# D_1 - D_2 = 0.2`. That there is never a second answer is due to :math:`A < 1`; the exercise shows
# what happens beyond.
#
# The picture
# -----------
#
# The loads are the first-order conditions of a minimum. With the energy
#
# .. math:: \Phi(P) = \tfrac 1 2 P_1^2 + \tfrac 1 2 P_2^2 + A P_1 P_2 - D_1 P_1 - D_2 P_2
#
# the gap is its slope, :math:`g = \nabla \Phi`. At the lowest point of the quadrant :math:`P \ge 0`
# a slope is 0, or the point is on the edge and the slope points uphill into the quadrant. That is
# the contact law, word for word. Left: the energy, its free minimum (a cross, the naive answer) and
# the minimum on the quadrant (a dot). Right: which of the four cases answers, for all that may be
# asked.


def energy(P: Array) -> Any:
    """Of loads (2, ...)."""
    return P[0] ** 2 / 2 + P[1] ** 2 / 2 + A * P[0] * P[1] - D[0] * P[0] - D[1] * P[1]


figure, (left, right) = plt.subplots(1, 2, figsize=(11, 5.2), layout="constrained")
axis = np.linspace(-0.7, 1.7, 200)
P1, P2 = np.meshgrid(axis, axis)
levels = left.contour(
    P1, P2, energy(np.array([P1, P2])), np.arange(-0.6, 1.6, 0.15), cmap="Greys_r"
)
left.clabel(levels)
left.fill_between([0, 1.7], 0, 1.7, color="tab:blue", alpha=0.12)
left.plot(*naive, "kx", ms=9, mew=2, label="free minimum: one load negative")
left.plot(*answer, "ko", ms=8, label="minimum where no load is negative")
left.set(xlabel="load $P_1$ [force]", ylabel="load $P_2$ [force]", title="energy [force length]")
left.set(aspect="equal", ylim=(-0.7, 1.7))
left.legend(loc="upper right")

asked = np.linspace(-0.6, 1.2, 181)
region = np.full((len(asked), len(asked)), -1)
for (row, D2), (column, D1) in itertools.product(enumerate(asked), enumerate(asked)):
    held = [k for k, case in enumerate(CASES) if allowed(*solve_case(case, np.array([D1, D2])))]
    region[row, column] = held[0]
right.contourf(asked, asked, region, [-0.5, 0.5, 1.5, 2.5, 3.5], cmap="Greys", alpha=0.6)
for at, label in [((-0.3, -0.3), "none"), ((0.7, -0.1), "1 only"), ((-0.2, 0.7), "2 only")]:
    right.text(*at, label, ha="center")
right.text(0.75, 0.85, "both", ha="center", color="white")
right.plot(*D, "ko", ms=8)
right.set(xlabel="asked of 1: $D_1$ [length]", ylabel="asked of 2: $D_2$ [length]")
right.set(title="which asperities touch", aspect="equal")
plt.show()

# %%
# An independent check
# --------------------
#
# Two of them. On a grid over what may be asked, one of the four cases is allowed at every point
# that is not on a border. And a general-purpose solver of bounded problems, which knows no cases,
# finds the same loads.

interior = [
    sum(allowed(*solve_case(case, np.array([D1, D2]))) for case in CASES)
    for D1, D2 in itertools.product(np.linspace(-0.613, 1.197, 40), repeat=2)
]
assert set(interior) == {1}

found = minimize(energy, [0.5, 0.5], bounds=[(0, None)] * 2, tol=1e-12)
print("by a bounded minimiser:", found.x)
assert np.allclose(found.x, answer, atol=1e-6)

# %%
# Exercise
# --------
#
# Let the asperities be so close that :math:`A = 1.5`, and ask the same of both, :math:`D = (1, 1)`.
# How many of the four cases are allowed? Draw the energy before you count.
#
# *Answer.* Three. Either asperity alone (the other one lies in its dent, with a gap of 0.5), and
# both together with :math:`P_1 = P_2 = 1 / (1 + A) = 0.4`. The energy is a saddle: along :math:`P_1
# + P_2 = \text{const}` it is highest in the middle, so "both" is not even a local minimum.
# Uniqueness is lost exactly where the energy stops being convex, at :math:`A = 1`. Real asperities
# do not sit in each other: how near is near enough is the shell lemma of
# :doc:`03_why_cvxpy_refuses`.

closer = np.array([[1.0, 1.5], [1.5, 1.0]])
crowded = [case for case in CASES if allowed(*solve_case(case, np.ones(2), closer))]
print("allowed:", crowded)
assert crowded == [(0,), (1,), (0, 1)]
assert np.allclose(solve_case((0, 1), np.ones(2), closer)[0], 0.4)
