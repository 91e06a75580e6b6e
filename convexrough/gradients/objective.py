"""`Objective`: a result as a function of parameters of a scene, for optimisers and frameworks."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from convexrough import checks
from convexrough.arrays import Array
from convexrough.contact import Contact, press
from convexrough.errors import InputError, needed
from convexrough.friction.shear import shear
from convexrough.friction.steady import cycle
from convexrough.gradients.gradient import Gradient, Holding
from convexrough.influence import Kind
from convexrough.record import Record
from convexrough.scene.asperities import Asperities
from convexrough.scene.base import sphere_radius
from convexrough.scene.scene import Scene

#: The possible values of `of`, each with the quantity that must be prescribed for it.
NUMBERS = {"loss": "force", "displacement": "force", "approach": "load", "load": "approach"}

#: The possible parameters: of asperities, of the scene, of the material, and prescribed quantities.
EACH, WHOLE = ("heights", "tip_radii", "positions"), ("sphere_radius", "friction")
ELASTIC, PRESCRIBED = ("contact_modulus", "poisson_ratio"), ("load", "approach", "force")
PARAMETERS = (*EACH, *WHOLE, *ELASTIC, *PRESCRIBED)


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Objective(Record):
    """A result for a scene as a function of a vector of parameters, with the gradient.

    scene : the scene, with the values of all parameters that are not in the vector
    of    : the result: "loss" of the symmetric cycle with the amplitude `force`, "displacement"
        under `force`, "approach" under `load`, or "load" at `approach`
    by    : names of the parameters in the vector, in the order of the vector: "heights",
        "tip_radii", "positions" (x and y of the first asperity, ...), "sphere_radius",
        "contact_modulus", "poisson_ratio", "friction", "load", "approach", "force"
    load  : [force] the prescribed load, or None
    approach : [length] the prescribed approach, or None
    force : [force] shear force, or amplitude of the cycle
    influence : how the compliance matrix is stored, as in `press`

    `objective(x)` returns (value, gradient), as `scipy.optimize.minimize(..., jac=True)` requires.
    For scipy, divide value and gradient by the initial value, because scipy's tolerances are
    absolute and a loss may be as small as 1e-13. `to_jax`, `to_torch` and `to_autograd` return
    functions for those packages. docs/theory/gradients.md derives the gradient.

    >>> loss = cr.Objective(scene=scene, of="loss", by=["heights"], load=3.6e-7, force=9e-8)
    >>> value, slopes = loss(loss.start)
    >>> print(f"{value:.4g}", len(slopes))
    1.364e-13 61
    >>> from autograd import grad
    >>> bool((grad(loss.to_autograd())(loss.start) == slopes).all())
    True
    """

    scene: Scene
    of: str
    by: Sequence[str] = field(default=("heights",))
    load: float | None = None
    approach: float | None = None
    force: float | None = None
    influence: Kind | None = None

    def __post_init__(self) -> None:
        checks.instance("scene", self.scene, Scene)
        checks.exactly_one("load", self.load, "approach", self.approach)
        if not isinstance(self.of, str) or self.of not in NUMBERS:
            expected = f"one of: {', '.join(NUMBERS)}"
            raise InputError("of", found=repr(self.of), expected=expected)
        required = NUMBERS[self.of]
        if getattr(self, required) is None:
            raise InputError(required, found="none", expected=f"a number, for the {self.of}")
        if self.force is not None and required != "force":
            expected = f"none, as the {self.of} does not depend on it"
            raise InputError("force", found=self.force, expected=expected)
        for name in PRESCRIBED:
            if (given := getattr(self, name)) is not None:
                object.__setattr__(self, name, checks.finite(name, given))
        by = (self.by,) if isinstance(self.by, str) else self.by
        ordered = isinstance(by, Iterable) and not isinstance(by, (set, frozenset))
        by = tuple(by) if ordered else ()
        if not all(isinstance(name, str) for name in by) or not 0 < len(by) == len({*by}):
            expected = "a list of names of parameters, each once"
            raise InputError("by", found=checks.shown(self.by), expected=expected)
        object.__setattr__(self, "by", by)
        if "sphere_radius" in by:
            sphere_radius(self.scene.sphere_radius, "by sphere_radius")
        absent = [name for name in PRESCRIBED if getattr(self, name) is None]
        if required != "force" and self.scene.friction is None:
            absent.append("friction")
        able = [name for name in PARAMETERS if name not in absent]
        for name in by:
            if name not in able:
                expected = f"some of: {', '.join(able)}"
                raise InputError("by", found=repr(name), expected=expected)

    @property
    def start(self) -> Array:
        """(m,) the vector of parameters for the given scene and prescribed quantities."""
        return np.concatenate([np.ravel(self._own(name)) for name in self.by]).astype(np.float64)

    def __call__(self, parameters: ArrayLike) -> tuple[float, Array]:
        """The result as a number, and its gradient (m,).

        parameters : (m,) in the order of `by`, in the scene's units

        Raises InputError for invalid parameters, or if there is no gradient.
        """
        gradient = self.gradient(parameters)
        slopes = {name: getattr(gradient, name) for name in self.by}
        if "force" in slopes and gradient.maximum is not None:
            slopes["force"] = 2.0 * gradient.maximum  # the force also changes the minimum
        return gradient.value, np.concatenate([np.ravel(each) for each in slopes.values()])

    def gradient(self, parameters: ArrayLike) -> Gradient:
        """The `Gradient` of the result at parameters (m,), with derivatives by all parameters.

        Raises InputError as the call does.

        >>> force = cr.Objective(scene=scene, of="load", by=["approach"], approach=5e-5)
        >>> f"{force.gradient([4e-5]).approach:.4g}"
        '0.01089'
        """
        shapes = [np.shape(self._own(name)) for name in self.by]
        ends = np.cumsum([math.prod(shape) for shape in shapes])
        vector = checks.array("parameters", parameters)
        if len(vector) != ends[-1]:
            expected = f"{ends[-1]}: {', '.join(self.by)}"
            raise InputError("parameters", found=f"{len(vector)} numbers", expected=expected)
        parts = zip(self.by, np.split(vector, ends[:-1]), shapes, strict=True)
        given = {name: part.reshape(shape) for name, part, shape in parts}
        load, approach, force = (
            None if (value := given.get(name, getattr(self, name))) is None else float(value)
            for name in PRESCRIBED
        )
        contact = press(self._scene(given), load=load, approach=approach, influence=self.influence)
        if self.of == "loss" and force is not None:
            checks.non_negative("force", force)
        try:
            return gradient_of(contact, self.of, force)
        except InputError as error:
            if not error.what.startswith("maximum"):
                raise
            raise InputError("force", found=error.found, expected=error.expected) from None

    def to_jax(self) -> Callable[[Any], Any]:
        """The result as a function for jax.grad, jax.jit and jax.vmap, without second derivatives.

        The result is computed outside of jax in float64. Without the option `jax_enable_x64`, jax
        rounds the parameters, the value and the gradient to float32. Raises ExtraError if jax is
        not installed.
        """
        jax = needed("jax")

        def outside(x: Any) -> tuple[Any, Any]:
            value, slopes = self(np.asarray(x, dtype=np.float64))
            return np.asarray(value, dtype=x.dtype), np.asarray(slopes, dtype=x.dtype)

        def called(x: Any) -> Any:
            x = jax.numpy.asarray(x, dtype=float)
            shapes = jax.ShapeDtypeStruct((), x.dtype), jax.ShapeDtypeStruct(x.shape, x.dtype)
            return jax.pure_callback(outside, shapes, x, vmap_method="sequential")

        number: Any = jax.custom_vjp(lambda x: called(x)[0])
        number.defvjp(called, lambda slopes, weight: (weight * slopes,))
        found: Callable[[Any], Any] = number
        return found

    def to_torch(self) -> Callable[[Any], Any]:
        """The result as a function for torch that supports `backward`, without second derivatives.

        The result is computed in float64 on the CPU, and rounded to the type of the argument, a
        tensor of floating-point numbers. Raises ExtraError if torch is not installed.
        """
        torch, both = needed("torch"), self

        class Number(torch.autograd.Function):  # type: ignore[misc, name-defined]
            @staticmethod
            def forward(ctx: Any, x: Any) -> Any:
                value, slopes = both(x.detach().double().cpu().numpy())
                ctx.save_for_backward(x, torch.as_tensor(slopes.copy()).to(x))
                return x.new_tensor(value)

            @staticmethod
            def backward(ctx: Any, weight: Any) -> Any:
                return weight * Slopes.apply(*ctx.saved_tensors)

        class Slopes(torch.autograd.Function):  # type: ignore[misc, name-defined]
            @staticmethod
            def forward(ctx: Any, x: Any, slopes: Any) -> Any:
                return slopes.clone()

            @staticmethod
            def backward(ctx: Any, *weights: Any) -> Any:
                raise RuntimeError("an Objective has no second derivatives")

        def number(x: Any) -> Any:
            if not (isinstance(x, torch.Tensor) and x.is_floating_point()):
                expected = "a tensor of floating-point numbers"
                raise InputError("parameters", found=checks.shown(x), expected=expected)
            return Number.apply(x)

        return number

    def to_autograd(self) -> Callable[[Any], Any]:
        """The result as a function for `autograd.grad` (numpy), without second derivatives.

        Raises ExtraError if autograd is not installed.
        """
        extend = needed("autograd.extend", "autograd")

        @lru_cache(maxsize=1)  # the backward pass uses the gradient at the last point
        def at(point: bytes) -> tuple[float, Array]:
            return self(np.frombuffer(point))

        def both(x: Any) -> tuple[float, Array]:
            return at(checks.array("parameters", x).tobytes())

        found: Callable[[Any], Any] = extend.primitive(lambda x: both(x)[0])
        extend.defvjp(found, lambda value, x: lambda weight: weight * both(x)[1])
        return found

    def _own(self, name: str) -> Any:
        """The value of a parameter in `scene`, or the prescribed quantity of this name."""
        scene = self.scene
        if name == "friction":
            return checks.friction(scene.friction)
        owners = (scene.asperities, EACH), (scene.material, ELASTIC), (self, PRESCRIBED)
        owner = next((owner for owner, names in owners if name in names), scene)
        return getattr(owner, name)

    def _scene(self, given: dict[str, Array]) -> Scene:
        """The scene with the given parameters in place of its own."""
        scene = self.scene
        each = {name: given.get(name, getattr(scene.asperities, name)) for name in EACH}
        elastic = {name: float(given[name]) for name in ELASTIC if name in given}
        whole: dict[str, Any] = {name: float(given[name]) for name in WHOLE if name in given}
        material = replace(scene.material, **elastic)
        return replace(scene, asperities=Asperities(**each), material=material, **whole)


def gradient_of(
    contact: Contact, of: str, force: float | None, holding: Holding | None = None
) -> Gradient:
    """The gradient of the result `of`; a loss is that of the cycle between -force and force."""
    if of == "loss":
        return cycle(contact, maximum=force).gradient(holding=holding)
    if of == "displacement":
        return shear(contact, force=force).gradient(displacement=1.0, holding=holding)
    weight: dict[str, Any] = {of: 1.0}  # of the approach or the load
    return contact.gradient(**weight, holding=holding)
