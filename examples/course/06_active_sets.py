r"""
6. Active sets without guesswork
================================

**Claim.** A common loop (solve, drop negative loads, add penetrations) can cycle for ever with only
four asperities. Newton's method on the *normal map* guesses nothing, and solves the same scene. A
certificate, which uses neither method, bounds the error of both results.

Which asperities touch is the *active set*. If it were known, the loads would follow from a system
with as many equations as unknowns.
"""

# %%
# The naive form: the guessing loop
# ---------------------------------
#
# Many finite-element codes treat contact in this way. Each pass takes one Newton step for the
# loads of the asperities in the set, drops those whose load has become negative, and adds those
# that penetrate. An asperity that is added starts with the load it would carry alone. The loop
# ends when a pass changes nothing.

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.patches import Circle
from numpy.typing import NDArray

import convexrough as cr

plt.rcParams["font.size"] = 14  # readable from the last row

Array = NDArray[np.float64]
MATERIAL = cr.Material(contact_modulus=1.0, poisson_ratio=0.3)


def law(scene: cr.Scene, approach: float) -> tuple[Array, Array, Array]:
    """k, A and D of the contact law, in units in which the largest D and its load are about 1."""
    points = scene.asperities.positions
    distances = np.hypot(*(points[:, None] - points[None]).transpose(2, 0, 1))
    np.fill_diagonal(distances, np.inf)
    k = (9 / (16 * scene.relative_radii)) ** (1 / 3)
    D = approach + scene.offsets
    length = D.max()
    force = (length / k[0]) ** 1.5
    return k * force ** (2 / 3) / length, force / length / (np.pi * distances), D / length


def guessing_loop(k: Array, A: Array, D: Array, passes: int = 200) -> tuple[Array, list[str]]:
    """Loads of the last pass, and the set of each pass, such as "1101"."""
    alone = (np.maximum(D, 0) / k) ** 1.5
    P, touching, sets = alone.copy(), D > 0, []
    for _ in range(passes):
        sets.append("".join("01"[int(one)] for one in touching))
        i = np.flatnonzero(touching)
        gap = k * P ** (2 / 3) + A @ P - D
        slope = A[np.ix_(i, i)] + np.diag(2 / 3 * k[i] * P[i] ** (-1 / 3))
        step = np.linalg.solve(slope, -gap[i])
        P[i] += step
        dropped = touching & (P <= 0)
        P[dropped] = 0
        added = ~touching & (A @ P < D)
        P[added] = alone[added]
        touching = (touching & ~dropped) | added
        if not dropped.any() and not added.any() and abs(step).max() < 1e-12:
            break
    return P, sets


# %%
# On most scenes this works. The next block finds a scene on which the loop has not ended after 200
# passes: four asperities with random positions and heights, at distances of at least half the
# spacing of Dini and Hills (2009), and without overlapping contact discs.


def random_scene(rng: np.random.Generator) -> cr.Scene:
    """Four asperities whose discs do not overlap when pressed by APPROACH."""
    for _ in range(10_000):
        points = rng.uniform(-0.0015, 0.0015, (4, 2)).round(5)
        heights = rng.uniform(0, 4e-5, 4).round(7)
        apart = np.hypot(*(points[:, None] - points[None]).transpose(2, 0, 1)) + np.eye(4)
        if apart.min() >= 0.0013:
            scene = cr.Scene(1.0, cr.Asperities(points, 0.02, heights), MATERIAL, geometry="summit")
            if cr.press(scene, approach=APPROACH).crowding < 1:
                return scene
    raise SystemExit("contact discs overlap in nearly all scenes: use a smaller APPROACH")


APPROACH = 2e-5
rng = np.random.default_rng(6)
for _ in range(5000):
    scene = random_scene(rng)
    loads, sets = guessing_loop(*law(scene, APPROACH))
    if len(sets) == 200:
        break
else:
    raise SystemExit("the loop has ended on 5,000 scenes: change APPROACH or the heights")
points, heights = scene.asperities.positions, scene.asperities.heights
print("places: ", points.tolist())
print("heights:", heights.tolist())
print("sets of the last passes:", *sets[-6:])
period = next(p for p in range(1, 50) if sets[-40:] == sets[-40 - p : -p])
print("period:", period)
assert period > 1

# %%
# Why? The loads on the other asperities lower one asperity so far that it only just touches. Alone
# it would carry far more, and the loop starts from this larger load. From there Newton's method for
# :math:`x^{2/3}`, which is concave, overshoots zero. The asperity is dropped; then it penetrates
# and is added with the same large load, and so on for ever. The loop decides by the signs of loads
# and gaps before they have converged.
#
# The repair: the normal map
# --------------------------
#
# Describe each asperity by one number :math:`\delta_i`: its indentation if it touches, minus its
# gap if not. Its load is :math:`P_i = (\max(\delta_i, 0) / k_i)^{3/2}`, and the whole contact law
# becomes one square system,
#
# .. math:: F(\delta) = \delta + A P(\delta) - D = 0 .
#
# :math:`F` is once differentiable, so Newton's method applies. The signs of the solution give the
# active set. A step that does not make the residual smaller is halved. If the Hessian of the energy
# is positive definite at the loads of a step (lesson 3), its linear system has a solution.


def normal_map(k: Array, A: Array, D: Array) -> tuple[Array, int]:
    """Indentations where positive, minus gaps where negative; and the number of steps."""

    def residual(delta: Array) -> Array:
        loads: Array = (np.maximum(delta, 0) / k) ** 1.5
        return delta + A @ loads - D

    delta, steps = D.copy(), 0
    while abs(residual(delta)).max() > 1e-14 * len(D) and steps < 50:
        slope = 1.5 * np.sqrt(np.maximum(delta, 0) / k) / k
        step, part = np.linalg.solve(np.eye(len(D)) + A * slope, -residual(delta)), 1.0
        while (
            np.linalg.norm(residual(delta + part * step)) > np.linalg.norm(residual(delta))
            and part > 1e-8
        ):
            part /= 2
        delta, steps = delta + part * step, steps + 1
    return delta, steps


k, A, D = law(scene, APPROACH)
delta, steps = normal_map(k, A, D)
print(f"{steps} steps; delta / max D =", delta)
assert steps < 12
assert np.allclose(delta + A @ (np.maximum(delta, 0) / k) ** 1.5, D, atol=1e-13)

figure, (left, right) = plt.subplots(1, 2, figsize=(11, 4.8), layout="constrained")
left.imshow([[int(c) for c in one] for one in sets[:24]], cmap="Greys", aspect="auto", vmax=1.6)
left.set(xlabel="asperity", ylabel="pass", xticks=range(4), xticklabels=range(1, 5))
left.set_title("in the set (dark), pass by pass")
contact = cr.press(scene, approach=APPROACH)
right.set(aspect="equal", xlim=(-0.0025, 0.0025), ylim=(-0.0025, 0.0025))
for number, (point, a) in enumerate(zip(points, contact.contact_radii, strict=True), start=1):
    right.add_patch(Circle(tuple(point), max(a, 2e-5), color="0.3" if a > 0 else "0.8"))
    inside = a > 5e-4
    place = point if inside else (point[0] + 4e-4, point[1])
    look = dict(color="white" if inside else "black", ha="center", va="center")
    right.annotate(str(number), place, **look)
right.set(xlabel="x / R [1]", ylabel="y / R [1]", xticks=(-0.002, 0, 0.002))
right.set_title("contact discs of the solution")
plt.show()

# %%
# An independent check: the certificate
# -------------------------------------
#
# ``certify`` takes loads from any source and bounds their distance from the exact solution. Here it
# proves the same statuses from the results of both methods. But the error bound of the loop's loads
# is nearly a third of the largest load; that of the normal map is as small as rounding errors.

force = contact.loads.max() / ((np.maximum(delta, 0) / k) ** 1.5).max()
by_map = force * (np.maximum(delta, 0) / k) ** 1.5
for name, judged in [
    ("guessing loop", cr.certify(scene, force * loads, approach=APPROACH)),
    ("normal map", cr.certify(scene, by_map, approach=APPROACH)),
]:
    error = judged.load_error / contact.loads.max()
    print(f"{name}: proved {judged.all_proved}, {judged.status.tolist()}, loads within {error:.1e}")
good = cr.certify(scene, by_map, approach=APPROACH)
bad = cr.certify(scene, force * loads, approach=APPROACH)
assert good.status.tolist() == bad.status.tolist() == ["contact", "contact", "open", "contact"]
assert good.load_error < 1e-12 * contact.loads.max()
assert bad.load_error > 0.01 * contact.loads.max()
assert (abs(force * loads - contact.loads) <= bad.load_errors).all()

# %%
# The bound is close to the true error of the loop's loads, which is, over the largest load,

off = abs(force * loads - contact.loads).max() / contact.loads.max()
print(f"{off:.3f}")
assert off > 0.01

# %%
# How often does each method fail? Count over random scenes of the same kind:

DRAWN = 200
ended, reached = 0, 0
for _ in range(DRAWN):
    values = law(random_scene(rng), APPROACH)
    ended += len(guessing_loop(*values)[1]) < 200
    reached += normal_map(*values)[1] < 50
print(f"of {DRAWN} scenes the loop solves {ended}, the normal map {reached}")
assert ended < DRAWN == reached

# %%
# Exercise
# --------
#
# Take one asperity alone with the load :math:`x`: :math:`x^{2/3} = \delta`, with :math:`k = 1`. For
# which starting loads does the first step of Newton's method for :math:`x` lead to a negative load?
#
# *Answer.* The step goes to
# :math:`x - \tfrac 3 2 x^{1/3} (x^{2/3} - \delta) = \tfrac 1 2 x^{1/3} (3 \delta - x^{2/3})`. This
# is below zero for all :math:`x > (3 \delta)^{3/2}`, 5.2 times the exact load. In terms of
# :math:`\delta` the same problem is linear, and one step is enough.

start = np.linspace(1, 8, 70001)
after = start - (start ** (2 / 3) - 1) / (2 / 3 * start ** (-1 / 3))
first = float(start[np.argmax(after < 0)])
print("negative from", first, "times the exact load on")
assert abs(first - 3**1.5) < 1e-3
