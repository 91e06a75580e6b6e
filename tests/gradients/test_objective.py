"""Numbers of a scene in the hands of optimisers, jax, torch and autograd."""

import sys
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from friction_scenes import FRICTION, with_friction
from scenes import NAMED
from scipy.optimize import minimize

import convexrough as cr
from convexrough.arrays import Array
from convexrough.errors import ExtraError


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


def test_scipy_straight_away() -> None:
    """The load that gives an approach."""
    objective = of_loss(("load",), of="approach", force=None)
    scale, wanted = float(objective.start[0]), 4e-5

    def missed(x: Array) -> tuple[float, Array]:
        value, slopes = objective(scale * x)
        off = value / wanted - 1
        return off**2, 2 * off * slopes * scale / wanted

    found = minimize(missed, [1.0], jac=True, method="BFGS", options={"gtol": 1e-12})
    again = cr.press(objective.scene, load=scale * float(found.x[0]))
    assert again.approach == pytest.approx(wanted, rel=1e-9)


def test_jax() -> None:
    jax = pytest.importorskip("jax", reason="needs the extra jax")
    jax.config.update("jax_enable_x64", True)
    objective = of_loss(("heights", "friction"))
    function, x = objective.to_jax(), objective.start
    value, slopes = objective(x)
    assert float(function(x)) == value
    np.testing.assert_array_equal(jax.grad(function)(x), slopes)
    np.testing.assert_array_equal(jax.jit(jax.grad(function))(x), slopes)
    several = np.stack([x, x * 1.001])
    both = jax.vmap(jax.value_and_grad(function))(several)
    np.testing.assert_array_equal(both[0], [objective(each)[0] for each in several])
    np.testing.assert_array_equal(both[1][1], objective(several[1])[1])
    raised, v = jax.numpy.asarray(x), np.append(np.full(len(x) - 1, 5e-8), 1e-2)
    composed = lambda t: jax.numpy.log(function(raised + t * v)) ** 2  # noqa: E731
    found = differences(composed, np.array(0.0), np.array(1.0), 1e-3)
    assert float(jax.grad(composed)(0.0)) == pytest.approx(found, rel=1e-7)


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
    v = torch.tensor(np.append(np.full(len(slopes) - 1, 5e-8), 1e-2))
    t = torch.tensor(0.0, dtype=torch.float64, requires_grad=True)
    torch.log(function(x.detach() + t * v)).backward()
    found = differences(
        lambda s: np.log(objective(objective.start + s * v.numpy())[0]),
        np.array(0.0), np.array(1.0), 1e-3,
    )  # fmt: skip
    assert t.grad.item() == pytest.approx(found, rel=1e-7)


def test_autograd() -> None:
    autograd = pytest.importorskip("autograd", reason="needs the extra autograd")
    objective = of_loss(("heights", "friction"))
    function, x = objective.to_autograd(), objective.start
    value, slopes = objective(x)
    assert function(x) == value
    np.testing.assert_array_equal(autograd.grad(function)(x), slopes)
    v = np.append(np.full(len(x) - 1, 5e-8), 1e-2)
    composed = lambda t: autograd.numpy.log(function(x + t * v)) ** 2  # noqa: E731
    found = differences(composed, np.array(0.0), np.array(1.0), 1e-3)
    assert autograd.grad(composed)(0.0) == pytest.approx(found, rel=1e-7)
    other = autograd.grad(lambda y: function(y) + function(1.001 * y))(x)
    assert np.abs(other).max() > np.abs(slopes).max()


@pytest.mark.parametrize("extra", ["jax", "torch", "autograd"])
def test_without_an_extra(extra: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, extra, None)
    monkeypatch.setitem(sys.modules, "autograd.extend", None)
    with pytest.raises(ExtraError, match=rf"needs {extra}: pip install {extra}"):
        getattr(of_loss(), f"to_{extra}")()


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"of": "energy"}, "of: found 'energy', expected one of: loss, displacement"),
        ({"force": None}, "force: found none, expected a number, for the loss"),
        ({"by": ["height"]}, "by: found 'height', expected some of: heights"),
        ({"by": ["approach"]}, "by: found 'approach'"),
        ({"approach": 1e-5}, "found both, expected exactly one"),
        (
            {"by": ["heights", "heights"]},
            "by: .* expected a list of names of parameters, each once",
        ),
        ({"by": []}, r"by: found \[\], expected a list"),
        ({"by": None}, "by: found None, expected a list"),
        ({"by": [["heights"]]}, "by: .* expected a list"),
        ({"of": "approach", "by": ["force"]}, "by: found 'force', expected some of: heights"),
        ({"load": "3.6e-7"}, "load: found '3.6e-7', expected a finite number"),
        ({"force": "9e-8"}, "force: found '9e-8', expected a finite number"),
        ({"load": None, "approach": float("nan")}, "approach: found nan, expected a finite"),
    ],
)
def test_mistakes(changes: dict[str, Any], said: str) -> None:
    with pytest.raises(cr.InputError, match=said):
        of_loss(**changes)
    with pytest.raises(cr.InputError, match="found 1 numbers, expected 91: heights"):
        of_loss()([0.0])


def test_a_contact_without_friction_knows_none() -> None:
    scene = NAMED["rough"][0]
    with pytest.raises(cr.InputError, match="by: found 'friction', expected some of: heights"):
        cr.Objective(scene=scene, of="approach", by=["friction"], load=3.6e-7)


def test_a_copy_with_other_numbers() -> None:
    objective = of_loss("heights")
    assert objective.by == ("heights",)
    assert replace(objective, force=1e-8)(objective.start)[0] < objective(objective.start)[0]


@pytest.mark.parametrize(
    ("of", "force", "said"),
    [
        ("loss", 9.0, r"^force: found 9\.0 \(5e\+07 f P: gross sliding\), expected at most f P"),
        ("loss", -1e-8, "^force: found -1e-08, expected a number that is not negative"),
        ("displacement", 9.0, r"^force: found 9\.0 \(5e\+07 f P: gross sliding"),
    ],
)
def test_mistakes_go_by_the_name_that_was_written(of: str, force: float, said: str) -> None:
    objective = of_loss(of=of, force=force)
    with pytest.raises(cr.InputError, match=said):
        objective(objective.start)


def test_gross_sliding_at_an_approach_goes_by_that_name_too() -> None:
    scene = of_loss().scene
    contact = cr.press(scene, approach=5e-5)
    objective = cr.Objective(
        scene=scene, of="loss", approach=5e-5, force=(scene.friction or 0.0) * contact.load
    )
    with pytest.raises(cr.InputError, match=r"^force: .* at constant approach"):
        objective(objective.start)
