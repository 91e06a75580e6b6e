"""Numbers of a scene in the hands of optimisers, jax, torch and autograd."""

from typing import Any

import numpy as np
import pytest
from friction_scenes import FRICTION, with_friction
from scenes import NAMED

import convexrough as cr
from convexrough.arrays import Array


def of_loss(by: Any = ("heights",), **changes: Any) -> cr.Objective:
    scene = with_friction(NAMED["rough"][0])
    given: dict[str, Any] = dict(of="loss", by=by, load=3.6e-7, force=0.4 * FRICTION * 3.6e-7)
    return cr.Objective(scene=scene, **given | changes)


def differences(function: Any, x: Array, v: Array, h: float) -> float:
    """Along v, of fourth order."""
    ends = [float(function(x + s * h * v)) for s in (-2, -1, 1, 2)]
    return (ends[0] - 8 * ends[1] + 8 * ends[2] - ends[3]) / (12 * h)


EVERYTHING = (
    *("heights", "tip_radii", "positions", "sphere_radius", "friction"),
    *("contact_modulus", "poisson_ratio", "load", "force"),
)
OBJECTIVES = {
    "loss": of_loss(EVERYTHING),
    "displacement": of_loss(EVERYTHING, of="displacement"),
    "approach": of_loss(("heights", "load", "sphere_radius"), of="approach", force=None),
    "load": of_loss(("approach", "positions"), of="load", load=None, approach=5e-5, force=None),
}


@pytest.mark.sample(1)
@pytest.mark.parametrize("name", OBJECTIVES)
def test_its_gradient(name: str) -> None:
    objective = OBJECTIVES[name]
    x, rng = objective.start, np.random.default_rng(1)
    value, slopes = objective(x)
    done = 0
    for each in objective.by:
        size = np.size(objective._own(each))
        v, part = np.zeros(len(x)), slice(done, done + size)
        scale = 5e-5 if each == "heights" else np.abs(x[part]).max()
        v[part] = scale * rng.choice([-1.0, 1.0], size=size)
        found = differences(lambda y: objective(y)[0], x, v, 1e-6)
        assert found == pytest.approx(slopes @ v, rel=1e-5, abs=1e-9 * abs(value)), each
        done += size
    assert done == len(x)


def test_jax() -> None:
    jax = pytest.importorskip("jax", reason="needs the extra jax")
    jax.config.update("jax_enable_x64", True)
    objective = of_loss(("heights", "friction"))
    function, x = objective.to_jax(), objective.start
    value, slopes = objective(x)
    assert float(function(x)) == value
    np.testing.assert_array_equal(jax.jit(jax.grad(function))(x), slopes)
    several = np.stack([x, x * 1.001])
    both = jax.vmap(jax.value_and_grad(function))(several)
    np.testing.assert_array_equal(both[0], [objective(each)[0] for each in several])
    np.testing.assert_array_equal(both[1][1], objective(several[1])[1])
    squared = jax.grad(lambda y: function(y) ** 2)(x)
    np.testing.assert_allclose(squared, 2 * value * slopes, rtol=1e-14)


def test_torch() -> None:
    """Where it is installed: the wheel for Linux is as large as all that the tests need else."""
    torch = pytest.importorskip("torch", reason="needs the extra torch")
    objective = of_loss(("heights", "friction"))
    function = objective.to_torch()
    x = torch.tensor(objective.start.copy(), requires_grad=True)
    value, slopes = objective(objective.start)
    (2.0 * function(x)).backward()
    assert function(x).item() == value
    np.testing.assert_array_equal(x.grad.numpy(), 2.0 * slopes)


def test_autograd() -> None:
    autograd = pytest.importorskip("autograd", reason="needs the extra autograd")
    objective = of_loss(("heights", "friction"))
    function, x = objective.to_autograd(), objective.start
    value, slopes = objective(x)
    assert function(x) == value
    np.testing.assert_array_equal(autograd.grad(function)(x), slopes)
    other = autograd.grad(lambda y: function(y) ** 2)(x)
    np.testing.assert_allclose(other, 2 * value * slopes, rtol=1e-14)


def test_a_force_without_use_is_refused() -> None:
    with pytest.raises(cr.InputError, match=r"force: found .*, expected none, as the load does"):
        of_loss(of="load", load=None, approach=5e-5)
