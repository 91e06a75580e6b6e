r"""
1. Two asperities by hand
=========================

**Claim.** Which of two asperities touch follows from four systems of equations: exactly one of them
has an admissible solution (on a border, two have the same). This solution is also the minimum of an
energy over the loads that are not negative.

A flat stamp is lowered on two asperities, 1 and 2. It prescribes the displacement :math:`D_i` of
asperity :math:`i` if the asperity touches. The displacement :math:`w_i` of an asperity has two
parts: its own load :math:`P_i` compresses it, and the load on the other asperity lowers the
surface under it. To keep the hand calculation linear, each asperity is a spring here. The next
scripts return to Hertz's law.

.. math:: w_1 = P_1 + A P_2, \qquad w_2 = A P_1 + P_2, \qquad 0 < A < 1.

If an asperity touches, :math:`w_i = D_i` and :math:`P_i \ge 0`. If it does not, :math:`P_i = 0`
and its gap :math:`g_i = w_i - D_i` is not negative. Load and gap are never both positive: they are
*complementary*.
"""

# %%
# The naive form
# --------------
#
# Assume that both asperities touch, and solve the two equations :math:`w = D` for two loads.

import itertools
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize

plt.rcParams["font.size"] = 14  # readable from the last row

Array = NDArray[np.float64]

A = 0.6
D = np.array([1.0, 0.4])
stiffness = np.array([[1.0, A], [A, 1.0]])

naive = np.linalg.solve(stiffness, D)
print("loads:", naive)
assert naive[1] < 0

# %%
# The second load is negative: asperity 2 would have to *pull* on the stamp. There is no adhesion,
# so this is not a solution, although both equations hold. The taller asperity has lowered the
# surface under the lower one so far that the stamp does not reach it.
#
# Setting the negative load to zero does not help: the displacement of asperity 1 then differs from
# the prescribed one.

cut = np.maximum(naive, 0.0)
print("displacement of asperity 1: prescribed", D[0], "with these loads", (stiffness @ cut)[0])
assert abs((stiffness @ cut)[0] - D[0]) > 0.1

# %%
# The repair: four cases
# ----------------------
#
# Each asperity touches or does not: :math:`2 \cdot 2` cases. In each case the loads of the open
# asperities and the gaps of the others are 0, so there are as many equations as unknowns. A case
# is admissible if no load and no gap in its solution is negative.


def solve_case(
    touching: tuple[int, ...], asked: Array, stiffness: Array = stiffness
) -> tuple[Array, Array]:
    """Loads and gaps if exactly these asperities touch, whatever their signs."""
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
    label = "admissible" if allowed(loads, gaps) else ""
    print(f"touching {[i + 1 for i in case]!s:7} loads {loads}  gaps {gaps}  {label}")

answers = [solve_case(case, D)[0] for case in CASES if allowed(*solve_case(case, D))]
assert len(answers) == 1
answer = answers[0]
assert np.allclose(answer, [1.0, 0.0])

# %%
# One case is admissible: asperity 1 carries :math:`P_1 = D_1 = 1`, and asperity 2 has a gap of
# :math:`A D_1 - D_2 = 0.2`. There is never a second solution because :math:`A < 1`; the exercise
# shows what happens if :math:`A > 1`.
#
# The picture
# -----------
#
# The contact law is the first-order condition of a minimum. With the energy
#
# .. math:: \Phi(P) = \tfrac 1 2 P_1^2 + \tfrac 1 2 P_2^2 + A P_1 P_2 - D_1 P_1 - D_2 P_2
#
# the gap is its gradient, :math:`g = \nabla \Phi`. At the minimum over the quadrant
# :math:`P \ge 0` each component of the gradient is 0, or the load is 0 and the component is not
# negative. This is the contact law. Left: the energy, its free minimum (a cross, the naive
# solution) and the minimum over the quadrant (a dot). Right: the admissible case for each pair
# :math:`D_1, D_2`.


def energy(P: Array) -> Any:
    """Energy of loads (2, ...)."""
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
right.set(xlabel="prescribed $D_1$ [length]", ylabel="prescribed $D_2$ [length]")
right.set(title="which asperities touch", aspect="equal")
plt.show()

# %%
# An independent check
# --------------------
#
# First, on a grid of prescribed displacements exactly one of the four cases is admissible at every
# point that is not on a border. Second, a general-purpose solver for minimisation with bounds,
# which does not use the cases, finds the same loads.

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
# Let the asperities be so close that :math:`A = 1.5`, and let both displacements be equal,
# :math:`D = (1, 1)`. How many of the four cases are admissible? Draw the energy before you count.
#
# *Answer.* There are three: either asperity alone touches (the other has a gap of 0.5), or both
# touch with :math:`P_1 = P_2 = 1 / (1 + A) = 0.4`. The energy is a saddle: along
# :math:`P_1 + P_2 = \text{const}` it is highest in the middle, so the state in which both touch is
# not even a local minimum. Beyond :math:`A = 1` the energy is not convex, and several solutions
# exist if :math:`D_1` and :math:`D_2` are nearly equal. The shell lemma of lesson 3 shows how large
# contact radii may be for given distances.

closer = np.array([[1.0, 1.5], [1.5, 1.0]])
crowded = [case for case in CASES if allowed(*solve_case(case, np.ones(2), closer))]
print("admissible:", crowded)
assert crowded == [(0,), (1,), (0, 1)]
assert np.allclose(solve_case((0, 1), np.ones(2), closer)[0], 0.4)
