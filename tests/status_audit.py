"""The status audit: every status and bound of random and hostile scenes against ball arithmetic.

    PYTHONPATH=tests python tests/status_audit.py 3000        prints what docs/tests.md says

Comparisons are in exact arithmetic, so that a bound too small by a roundoff is found too.
"""

import sys
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import multiprecision
import numpy as np
from flint import arb, ctx
from friction_scenes import FRICTION, with_friction
from multiprecision import Friction, slide, solve_vectors, travel_of
from scenes import on_lattice, on_sphere, operators, scaled, scattered, solve_exactly

import convexrough as cr
from convexrough.arrays import Array

DIGITS = 60  # of the exact states, whose differences lose some where Q is small
BITS = 4096  # nothing is rounded in a comparison

#: How scenes are made hostile.
KINDS = ("usual", "crowded", "ring", "grazing", "near", "units")

#: Of f P: how far the contacts are sheared.
FRACTIONS = (1e-12, 1e-6, 0.1, 0.4, 0.8, 0.999, 1 - 1e-9, 1 - 1e-13, 1.0)


class Dragged(Exception):
    """Others drag an asperity along further than the sphere moves: the theorem is not for this."""


class Wrong(AssertionError):
    """A status or a bound that is not true."""


class Tally(Counter[Any]):
    """How many scenes were tried, refused, and unsolved by the oracle (or their vector states).

    And statuses, and those of them that are undecided, by kind of scene and stage.
    """

    def count(self, kind: str, stage: str, statuses: Any) -> None:
        self[kind, stage] += len(statuses)
        self[kind, stage, "undecided"] += int((statuses == "undecided").sum())


def require(holds: Any, message: str) -> None:
    if not bool(holds):
        raise Wrong(message)


def compare(stage: str, bounds: Any, values: Any, exact: Any) -> None:
    """Bound by bound, of numbers or vectors."""
    with ctx.workprec(BITS):
        for bound, value, true in zip(bounds, values, exact, strict=True):
            off = multiprecision.exact(np.atleast_1d(value)) - np.atleast_1d(true)
            within = bound == np.inf or (off * off).sum() <= arb(float(bound)) ** 2
            require(within, f"{stage} bound {bound} of {value}")


def draw(seed: int) -> tuple[str, cr.Scene, float]:
    """A kind, a scene with friction, and an approach."""
    rng = np.random.default_rng(seed)
    kind = KINDS[seed % len(KINDS)]
    make = on_lattice if rng.random() < 0.5 else scattered
    crowding = rng.uniform(0.9, 2.0) if kind == "crowded" else rng.uniform(0.05, 0.8)
    roughness = float(rng.choice([0.0, 0.1, 0.5]))
    count = int(rng.integers(1, 8))
    if kind == "ring":
        angles = 2 * np.pi * np.arange(count) / count + rng.uniform(0, 1)
        scene = on_sphere(3e-3 * np.column_stack((np.cos(angles), np.sin(angles))))
        approach = float(rng.uniform(2e-5, 9e-5))
    else:
        scene, approach = make(int(rng.integers(2**32)), count, crowding, roughness)
    if kind == "grazing":
        scene = _grazing(scene, approach, rng)
    if kind == "near":  # two asperities much closer than the others
        a = scene.asperities
        beside = a.positions[0] + 1e-2 * np.abs(a.positions).max()
        scene = _grown(scene, beside, 1e-7 * a.tip_radii[0], 0.0)
    if kind == "units":
        length, modulus = 10.0 ** rng.uniform(-40, 40), 10.0 ** rng.uniform(-40, 40)
        scene = scaled(scene, length, modulus / scene.material.contact_modulus)
        approach *= length
    return kind, replace(scene, friction=FRICTION), approach


def _grown(scene: cr.Scene, point: Any, tip_radius: float, height: float) -> cr.Scene:
    """With one asperity more."""
    a = scene.asperities
    points, heights = np.vstack((a.positions, point)), np.append(a.heights, height)
    more = cr.Asperities(points, np.append(a.tip_radii, tip_radius), heights)
    return replace(scene, asperities=more)


def _grazing(scene: cr.Scene, approach: float, rng: np.random.Generator) -> cr.Scene:
    """One asperity more, which touches or fails to by 1e-6 to 1e-17 of the approach."""
    a, low = scene.asperities, -2.0 * approach
    point = (float(np.abs(a.positions).max()) or approach) * rng.uniform(1.2, 1.5, 2)
    tip = float(np.median(a.tip_radii))
    gap = cr.press(_grown(scene, point, tip, low), approach=approach).gaps[-1]
    off = rng.choice([-1, 1]) * 10.0 ** rng.uniform(-17, -6) * approach
    return _grown(scene, point, tip, float(low + gap + off))


def audit(seeds: Iterator[int] | range) -> Tally:
    """Raises Wrong at the first wrong status or bound, with the seed of its scene."""
    tally = Tally()
    for seed in seeds:
        tally["tried"] += 1
        try:
            _audit_scene(seed, tally)
        except Wrong as wrong:
            raise Wrong(f"seed {seed}: {wrong}") from wrong
        except multiprecision.NotProved:
            tally["unsolved"] += 1
        except (cr.InputError, cr.SolverError):
            tally["refused"] += 1
    return tally


def _audit_scene(seed: int, tally: Tally) -> None:
    rng = np.random.default_rng((seed, 1))
    kind, scene, approach = draw(seed)
    operator = str(rng.choice(operators(scene)))
    given: Any = {"approach": approach}
    contact = cr.press(scene, **given, influence=operator)
    if contact.load == 0:
        return
    if rng.random() < 0.5:
        given = {"load": contact.load}
        contact = cr.press(scene, **given, influence=operator)
    exact = solve_exactly(scene, **given, start=contact.loads, digits=DIGITS)
    proof = contact.certificate
    tally.count(kind, "press", proof.status)
    if proof.scope == "none":
        require((proof.status == "undecided").all(), "a status without a proof")
        return
    assert_honest(proof, contact.loads, exact)
    _audit_shear(kind, contact, exact, float(rng.choice(FRACTIONS)), tally)


def assert_honest(proof: cr.Certificate, loads: Any, exact: Any) -> None:
    """Every status agrees with the proved solution, and every bound covers the distance to it."""
    for status, load, gap in zip(proof.status, exact.loads, exact.gaps, strict=True):
        require(status in ("contact", "open", "undecided"), f"the status {status}")
        require(status != "contact" or load > 0, "contact of an open asperity")
        require(status != "open" or gap > 0, "open of one that touches")
    compare("load", proof.load_errors, loads, exact.loads)
    compare("gap", proof.gap_errors, proof.gaps, exact.gaps)
    compare("approach", [proof.approach_error], [proof.approach], [exact.approach])


def assert_agree(one: Any, other: Any, *names: str) -> None:
    """Loads, forces or what else of two results are within the errors of both."""
    for name in names:
        off = getattr(one, f"{name}s") - getattr(other, f"{name}s")
        errors = sum(getattr(each.certificate, f"{name}_errors") for each in (one, other))
        assert (np.linalg.norm(off.reshape(len(off), -1), axis=1) <= errors).all(), name


def excess(scene: cr.Scene, loads: Array, exact: Any, total: float | None = None) -> float:
    """The energy of loads, in many digits scaled to a prescribed total, above that of `exact`."""
    with ctx.workdps(120):
        given, least = multiprecision.exact(loads), np.array(exact.loads)
        if total is not None:
            given = arb(total) * given / given.sum()
        one, other = (multiprecision.energy(scene, P, exact.approach) for P in (given, least))
        return float((one - other).mid())


def attack(kind: str, loads: Array, rng: np.random.Generator) -> Array:
    """Wrong loads: each a mistake that a user or a solver could make; of other kinds the same."""
    places, loaded = np.arange(len(loads)), np.flatnonzero(loads)
    (i, j), digits = rng.integers(len(loads), size=2), int(rng.integers(1, 16))
    added, off = 10.0 ** rng.uniform([-16, -15], [0, -1])
    smallest = loaded[np.argsort(loads[loaded])]
    kinds = {
        "dropped": np.where(np.isin(places, rng.permutation(loaded)[:1]), 0.0, loads),
        "smallest dropped": np.where(np.isin(places, smallest[:1]), 0.0, loads),
        "added": loads + added * loads.max() * (places == i),
        "perturbed": np.maximum(loads * (1 + off * rng.standard_normal(len(loads))), 0.0),
        "swapped": loads[np.where(places == i, j, np.where(places == j, i, places))],
        "zero": 0.0 * loads,
        "random": loads.max() * rng.random(len(loads)) ** 4,
        "huge": loads * 1e6,
        "scaled": loads * rng.uniform(0.9, 1.1),
        "rounded": np.array([float(f"{load:.{digits}e}") for load in loads]),
        "single precision": loads.astype(np.float32).astype(np.float64),
    }
    return kinds.get(kind, loads.copy())


ATTACKS = (
    *("none", "dropped", "smallest dropped", "added", "perturbed", "swapped", "zero", "random"),
    *("huge", "scaled", "rounded", "single precision"),
)


def slid_from(contact: cr.Contact, full: Any, force: Any, digits: int = DIGITS) -> Friction | None:
    """The exact state of first loading; none at gross sliding."""
    scene, friction = contact.scene, contact.scene.friction
    left = full.load - arb(force) / arb(friction)
    if not left > 0:
        return None
    found = cr.shear(contact, force=float(force)).forces
    start = np.maximum(contact.loads - found / friction, 0.0) + 1e-30 * contact.load
    reduced = solve_exactly(scene, load=left, start=start, digits=digits)
    slid = slide(arb(friction), arb(scene.material.poisson_ratio), full, reduced)
    if any(q < 0 for q in slid.forces):
        raise Dragged
    return slid


def _audit_shear(kind: str, contact: cr.Contact, full: Any, fraction: float, tally: Tally) -> None:
    kind = kind if fraction < 1 else "limit"
    force = fraction * FRICTION * contact.load
    with ctx.workdps(DIGITS + 30):
        try:
            # f P to rounding is read as f P
            exact = None if fraction == 1 else slid_from(contact, full, force)
        except Dragged:
            return
        forces = exact.forces if exact else [FRICTION * p for p in full.loads]
    state, cycle = cr.shear(contact, force=force), cr.cycle(contact, maximum=force)
    # At nu = 0 the tensor is the scalar kernel, and the theorem holds for vectors along x.
    scalar = replace(contact, scene=with_friction(contact.scene, nu=0.0))
    vector = cr.shear_vector(scalar, force=force)
    for stage, found in (("shear", state), ("cycle", cycle), ("vector", vector)):
        for i, (status, load) in enumerate(zip(found.status, full.loads, strict=True)):
            slides = exact is None or exact.slips[i] > 0
            require(status != "sliding" or (load > 0 and slides), f"{stage}: sliding of {i}")
            require(status != "partial" or (load > 0 and not slides), f"{stage}: partial of {i}")
            require(status != "open" or not load > 0, f"{stage}: open of {i}")
        tally.count(kind, stage, found.status)
    proof = state.certificate
    compare("force", proof.force_errors, state.forces, forces)
    compare("vector force", vector.certificate.force_errors, vector.forces[:, 0], forces)
    _audit_vectors(kind, contact, full, force, tally)
    if exact:
        compare("slip", proof.slip_errors, state.slips, exact.slips)
        error = proof.displacement_error
        compare("displacement", [error], [state.displacement], [exact.displacement])
        compare("loss", [cycle.loss_error], [cycle.loss], [exact.energy])
        if force < FRICTION * contact.load:
            _audit_history(contact, full, force, exact)


def _audit_history(contact: cr.Contact, full: Any, force: float, there: Friction) -> None:
    """To Q and back, and half of the way back and there again, which is forgotten."""
    past = cr.history(contact, forces=[force, -0.25 * force, force, -force])
    with ctx.workdps(DIGITS + 30):
        try:
            inner = slid_from(contact, full, (arb(force) - arb(-0.25 * force)) / 2)
        except Dragged:
            return
        far = there.displacement
        rises = [far, far - 2 * inner.displacement, far, -far]
        once, back = there.energy / 4, inner.energy / 2
        losses = [once, once + back, once + 2 * back, once + 2 * back + there.energy / 2]
        forces = there.forces - 2 * inner.forces
    compare("past displacement", past.displacement_errors, past.displacements, rises)
    compare("past loss", past.loss_errors, past.losses, losses)
    one, other = (cr.shear(contact, force=Q).certificate for Q in (force, 0.625 * force))
    errors = one.force_errors + 2 * other.force_errors + 1e-14 * abs(force)
    compare("past force", errors, past.asperity_forces[1], forces)


def _audit_vectors(kind: str, contact: cr.Contact, full: Any, force: float, tally: Tally) -> None:
    """The full tangential kernel, any Poisson's ratio and direction, against its own oracle."""
    rng = np.random.default_rng(int.from_bytes(np.float64(force).tobytes(), "little"))
    angle = rng.uniform(0, 2 * np.pi)
    size = min(force, FRICTION * contact.load)
    pair = size * np.array([np.cos(angle), np.sin(angle)])
    if np.hypot(*pair) > FRICTION * contact.load:
        pair *= 1 - 1e-15
    tilted = replace(contact, scene=with_friction(contact.scene, nu=float(rng.uniform(0.0, 0.5))))
    audit_vectors(kind, tilted, full, pair, tally)


def audit_vectors(kind: str, tilted: cr.Contact, full: Any, pair: Any, tally: Tally) -> None:
    """The state of a contact with exact loads `full` under a shear force along x and y."""
    state = cr.shear_vector(tilted, force=pair)
    tally.count(kind, "tensor", state.status)
    for status, load in zip(state.status, full.loads, strict=True):
        require(status in ("open", "undecided") or load > 0, "tensor: status of an open asperity")
        require(status != "open" or not load > 0, "tensor: open of one that touches")
    start = state.forces, state.displacement
    try:
        true = solve_vectors(tilted.scene, full.loads, pair, *start, DIGITS - 20)
    except multiprecision.NotProved:
        tally["unsolved vectors"] += 1
        return
    touching = [i for i, load in enumerate(full.loads) if load > 0]
    gross = np.isinf(state.displacement).any()  # Q counts as f P: all slide, with forces along Q
    for i, slides in zip(touching, true.sliding, strict=True):
        wrong = "partial" if slides or gross else "sliding"
        require(state.status[i] != wrong, f"tensor: status of {i}")
    nu, proof = arb(tilted.scene.material.poisson_ratio), state.certificate
    with ctx.workdps(DIGITS + 30):
        travel, forces = travel_of(arb(FRICTION), nu), FRICTION * true.forces
        slips, far = travel * true.slips, [travel * true.displacement]
        if gross:
            P, along = np.array(full.loads)[touching], multiprecision.exact(pair)
            forces = FRICTION * np.outer(P, along / (along @ along).sqrt())
    compare("tensor force", proof.force_errors[touching], state.forces[touching], forces)
    if np.isfinite(state.displacement).all():
        compare("tensor slip", proof.slip_errors[touching], state.slips[touching], slips)
        compare("tensor displacement", [proof.displacement_error], [state.displacement], far)


def report(tally: Tally) -> str:
    outcomes = "tried", "refused", "unsolved", "unsolved vectors"
    lines = [", ".join(f"{tally[it]:,} {it}" for it in outcomes)]
    for key in sorted(key for key in tally if len(key) == 2):
        undecided = 100 * tally[*key, "undecided"] / tally[key]
        lines.append(f"{' '.join(key)}: {tally[key]:,}, {undecided:.2f} % undecided")
    return "\n".join(lines)


if __name__ == "__main__":
    print(report(audit(range(int(sys.argv[1])))))
