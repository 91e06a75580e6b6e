"""The words and bounds of vector friction under attack: wrong states, and loads in doubt."""

from dataclasses import replace

import numpy as np
import pytest
from friction_scenes import FRICTION, lengths, pressed
from hypothesis import given, settings
from hypothesis import strategies as st
from scenes import scattered

import convexrough as cr
from convexrough import FrictionNewton, shear_vector
from convexrough.sphere import hertz
from convexrough.vector_shear.judgement import judge_vectors
from convexrough.vector_shear.problem import VectorProblem


@settings(max_examples=80, deadline=None)
@given(
    st.sampled_from(["paper", "rough"]),
    st.floats(1e-6, 0.999),
    st.sampled_from(["swap", "perturb", "turn", "drop", "zero", "rise", "slip"]),
    st.integers(0, 2**32 - 1),
)
def test_attacks_on_the_words(name: str, fraction: float, kind: str, seed: int) -> None:
    """States that are wrong must not be given a wrong word, nor a bound that is too small."""
    contact = pressed(name, nu=0.5)
    problem = VectorProblem.of(contact)
    total = np.array([0.8, 0.6]) * fraction * problem.scalar.loads.sum()
    good = FrictionNewton().solve(problem, total)
    rng = np.random.default_rng(seed)
    q, rise, slips = good.increments.copy(), good.rise, good.slips.copy()
    size = 10.0 ** rng.uniform(-14, -1)
    if kind == "swap":
        i, j = rng.integers(len(q), size=2)
        q[[i, j]] = q[[j, i]]
    elif kind == "perturb":
        q *= 1 + size * rng.standard_normal(q.shape)
    elif kind == "turn":
        q += size * rng.standard_normal((len(q), 1)) * q[:, ::-1] * [-1, 1]
    elif kind == "drop":
        q[rng.integers(len(q))] = 0.0
    elif kind == "zero":
        q[:] = 0.0
    elif kind == "slip":
        slips[rng.integers(len(q))] += size * rise
    else:
        rise = rise * (1 + size * rng.standard_normal(2))
    q /= np.maximum(lengths(q) / problem.scalar.loads, 1.0)[:, None]
    wrong = good._replace(increments=q, rise=rise, slips=slips)
    bounds = judge_vectors(problem, wrong, gross=False)
    sliding = lengths(good.slips) > 0
    assert not (bounds.sliding[0] & ~sliding).any()
    assert not (bounds.partial[0] & sliding).any()
    assert (lengths(q - good.increments) <= bounds.increments[0] * (1 + 1e-9)).all()
    assert (lengths(wrong.slips - good.slips) <= bounds.slips[0] * (1 + 1e-9)).all()
    assert np.hypot(*(rise - good.rise)) <= bounds.rises[0] * (1 + 1e-9)


@pytest.mark.parametrize("size", [1e-9, 1e-4, 1e-2])
def test_the_bounds_are_needed(size: float) -> None:
    """Two asperities, and an error of their forces that changes neither total nor symmetry.

    What the normal map makes of such a state is off too, by less than the state itself.
    """
    scene = cr.Scene(1.0, cr.Asperities([[-2e-3, 0], [2e-3, 0]], 0.01), cr.Material(1, 0.5), 0.5)
    contact = cr.press(scene, approach=1e-4)
    problem = VectorProblem.of(contact)
    good = FrictionNewton().solve(problem, np.array([0.3, 0.1]) * problem.scalar.loads.sum())
    error = size * problem.scalar.loads[:, None] * np.array([[1.0, 0.5], [-1.0, -0.5]])
    wrong = good._replace(increments=good.increments + error)
    bounds = judge_vectors(problem, wrong, gross=False)
    assert bounds.proved[0]
    assert (lengths(error) <= bounds.increments[0]).all()
    assert bounds.increments[0].max() < 4 * lengths(error).max()


@pytest.mark.parametrize("size", [1e-6, 1e-3, 1e-2])
@pytest.mark.parametrize("fraction", [1e-6, 0.3, 0.6, 0.9])
def test_bounds_from_loads_that_are_just_as_far_off_as_said(fraction: float, size: float) -> None:
    contact = pressed("rough")
    loaded = contact.loads > 0
    rng = np.random.default_rng(5)
    off = np.where(loaded, size * rng.choice([-1.0, 1.0], len(loaded)), 0.0)
    loads = contact.loads * (1 + off)
    known = replace(contact.certificate, load_errors=1.001 * np.abs(loads - contact.loads))
    doubtful = replace(
        contact,
        loads=loads,
        load=float(loads.sum()),
        contact_radii=hertz.contact_radius(loads, 1.0, contact.scene.relative_radii),
        certificate=known,
    )
    force = fraction * FRICTION * contact.load
    truth, state = shear_vector(contact, force=force), shear_vector(doubtful, force=force)
    assert (lengths(state.forces - truth.forces) <= state.certificate.force_errors).all()
    assert (lengths(state.slips - truth.slips) <= state.certificate.slip_errors).all()
    travel = np.hypot(*(state.displacement - truth.displacement))
    assert travel <= state.certificate.displacement_error
    sliding = lengths(truth.slips) > 0
    assert not (state.status[sliding] == "partial").any()
    assert not (state.status[~sliding] == "sliding").any()
    if size < 1e-5:
        assert state.certificate.holds


@pytest.mark.parametrize("digits", [3, 5, 8, 12])
@pytest.mark.parametrize("fraction", [1e-6, 0.1, 0.37, 0.6, 0.99])
def test_doubt_about_the_loads_is_counted(fraction: float, digits: int) -> None:
    """Starting from rounded loads, with the certificate of those, the bounds cover the truth."""
    contact = pressed("paper")
    rounded = np.array([float(f"{load:.{digits - 1}e}") for load in contact.loads])
    rounded[1::2] += 10.0 ** (-digits) * rounded[1::2]
    doubtful = replace(
        contact,
        loads=rounded,
        load=float(rounded.sum()),
        contact_radii=hertz.contact_radius(rounded, 1.0, contact.scene.relative_radii),
        certificate=cr.certify(contact.scene, rounded, approach=contact.approach),
    )
    force = fraction * FRICTION * contact.load
    truth, state = shear_vector(contact, force=force), shear_vector(doubtful, force=force)
    known = state.certificate
    assert (lengths(state.forces - truth.forces) <= known.force_errors).all()
    assert (lengths(state.slips - truth.slips) <= known.slip_errors).all()
    assert np.hypot(*(state.displacement - truth.displacement)) <= known.displacement_error
    sliding = lengths(truth.slips) > 0
    assert not (state.status[sliding] == "partial").any()
    assert not (state.status[~sliding] == "sliding").any()
    if digits >= 8:
        assert known.holds
        assert known.force_errors.max() < 10.0 ** (4 - digits) * lengths(truth.forces).max()


@pytest.mark.parametrize("size", [1e-12, 1e-9, 1e-6])
@pytest.mark.parametrize("nu", [0.3, 0.5])
def test_forces_at_the_limit_turn_by_the_root_of_what_is_missing(nu: float, size: float) -> None:
    """f P of loads that are a little too small is not yet the limit of the true ones."""
    contact = pressed("paper", nu=nu)
    loads = contact.loads * (1 - size)
    doubtful = replace(
        contact,
        loads=loads,
        load=float(loads.sum()),
        contact_radii=hertz.contact_radius(loads, 1.0, contact.scene.relative_radii),
        certificate=replace(contact.certificate, load_errors=1.001 * size * contact.loads),
    )
    force = FRICTION * doubtful.load
    state, truth = shear_vector(doubtful, force=force), shear_vector(contact, force=force)
    assert (state.forces[:, 1] == 0).all()
    off = lengths(state.forces - truth.forces)
    assert (off <= state.certificate.force_errors).all()
    loaded = contact.loads > 0
    assert off.max() > 100 * size * truth.forces.max()
    assert state.certificate.force_errors.max() < 1e3 * off.max()
    sliding = lengths(truth.slips) > 0
    assert (state.status[~sliding & loaded] == "undecided").all()
    if size <= 1e-9:
        assert (state.status[loaded] == "sliding").all()


@pytest.mark.parametrize("nu", [0.0, 0.3])
def test_a_row_along_the_force_at_the_limit(nu: float) -> None:
    """Nothing turns: the last to slide may stick, as in the scalar problem."""
    points = [[-3e-3, 0], [0, 0], [3e-3, 0]]
    scene = cr.Scene(1.0, cr.Asperities(points, 0.01), cr.Material(1.0, nu), FRICTION)
    contact = cr.press(scene, approach=1e-4)
    state = shear_vector(contact, force=FRICTION * contact.load)
    assert state.status.tolist() == ["sliding", "undecided", "sliding"]
    alone = cr.Scene(1.0, cr.Asperities([[0, 0]], 0.01), cr.Material(1.0, nu), FRICTION)
    contact = cr.press(alone, approach=1e-4)
    assert shear_vector(contact, force=FRICTION * contact.load).status == ["undecided"]


def test_an_uncertified_contact_gets_no_word() -> None:
    contact = replace(
        pressed("paper"), certificate=replace(pressed("paper").certificate, scope="none")
    )
    for fraction in (0.1, 1.0):
        state = shear_vector(contact, force=fraction * FRICTION * contact.load)
        loaded = contact.loads > 0
        assert (state.status[loaded] == "undecided").all()
        assert state.certificate.scope == "none"
        assert not state.certificate.holds


@pytest.mark.parametrize("count", [1, 2, 3, 5])
@pytest.mark.parametrize("fraction", [1 - 1e-6, 1 - 1e-9, 1 - 1e-11])
def test_the_last_one_is_proved_to_stick(count: int, fraction: float) -> None:
    """Without Poisson's ratio nothing turns, so that below f P not all slide."""
    scene, approach = scattered(count, count, 0.5, 0.1)
    material = cr.Material(scene.material.contact_modulus, 0.0)
    contact = cr.press(replace(scene, friction=0.5, material=material), approach=approach)
    state = shear_vector(contact, force=fraction * FRICTION * contact.load * np.array([0.6, 0.8]))
    assert (state.status == "partial").sum() == 1
    assert (state.status == "sliding").sum() == (contact.loads > 0).sum() - 1


@pytest.mark.parametrize("nu", [0.02, 0.1, 0.3, 0.5])
def test_the_last_one_is_not_said_to_stick_where_all_slide(nu: float) -> None:
    """With it forces turn, and all slide a little below f P: nobody may be said to stick there."""
    all_slide = 0
    for seed in range(6):
        scene, approach = scattered(seed, 2 + seed % 3, 0.6, 0.3)
        material = cr.Material(scene.material.contact_modulus, nu)
        contact = cr.press(replace(scene, friction=0.5, material=material), approach=approach)
        for missing in 10.0 ** np.arange(-12, -2, 0.5):
            force = (1 - missing) * FRICTION * contact.load
            try:
                state = shear_vector(contact, force=force * np.array([0.6, 0.8]))
            except cr.SolverError:
                continue  # so near to gross sliding Newton's method may say that it has no answer
            slides = lengths(state.slips) > 0
            all_slide += bool(slides[contact.loads > 0].all())
            assert not (state.status[slides] == "partial").any()
    assert all_slide > 20
