"""Numbers of a scene in the hands of optimisers, jax, torch and autograd."""

from typing import Any

import numpy as np
import pytest
from friction_scenes import FRICTION, with_friction
from scenes import NAMED

import convexrough as cr


def of_loss(by: Any = ("heights",), **changes: Any) -> cr.Objective:
    scene = with_friction(NAMED["rough"][0])
    given: dict[str, Any] = dict(of="loss", by=by, load=3.6e-7, force=0.4 * FRICTION * 3.6e-7)
    return cr.Objective(scene=scene, **given | changes)


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
    places = np.cumsum([np.size(objective._own(each)) for each in objective.by])
    assert places[-1] == len(x)
    for each, part in zip(objective.by, np.split(np.arange(len(x)), places[:-1]), strict=True):
        v, scale = np.zeros(len(x)), 5e-5 if each == "heights" else np.abs(x[part]).max()
        v[part] = scale * rng.choice([-1.0, 1.0], size=len(part))
        ends = [objective(x + s * 1e-6 * v)[0] for s in (-2, -1, 1, 2)]
        found = (ends[0] - 8 * ends[1] + 8 * ends[2] - ends[3]) / 12e-6  # of fourth order
        assert found == pytest.approx(slopes @ v, rel=1e-5, abs=1e-9 * abs(value)), each


@pytest.mark.parametrize("package", ["jax", "torch", "autograd"])
def test_in_other_packages(package: str) -> None:
    """Bit by bit; torch only where it is installed: its wheel is as large as all that is needed."""
    library = pytest.importorskip(package, reason=f"needs the extra {package}")
    objective = of_loss(("heights", "friction"))
    function, x = getattr(objective, f"to_{package}")(), objective.start
    value, slopes = objective(x)
    if package == "torch":
        given = library.tensor(x.copy(), requires_grad=True)
        (2.0 * function(given)).backward()
        assert function(given).item() == value
        np.testing.assert_array_equal(given.grad.numpy(), 2.0 * slopes)
        return
    if package == "jax":
        library.config.update("jax_enable_x64", True)
        several = np.stack([x, x * 1.001])
        both = library.vmap(library.value_and_grad(function))(several)
        np.testing.assert_array_equal(both[0], [objective(each)[0] for each in several])
        np.testing.assert_array_equal(both[1][1], objective(several[1])[1])
        np.testing.assert_array_equal(library.jit(library.grad(function))(x), slopes)
    assert float(function(x)) == value
    np.testing.assert_array_equal(library.grad(function)(x), slopes)
    squared = library.grad(lambda y: function(y) ** 2)(x)
    np.testing.assert_allclose(squared, 2 * value * slopes, rtol=1e-14)


def test_a_force_without_use_is_refused() -> None:
    with pytest.raises(cr.InputError, match=r"force: found .*, expected none, as the load does"):
        of_loss(of="load", load=None, approach=5e-5)
