"""`cycle`, `cycles` and `steady`: steady cycles between two shear forces, and of closed paths."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from convexrough import checks
from convexrough.contact import Contact
from convexrough.errors import InputError
from convexrough.friction.curve import MemoryCurve
from convexrough.friction.cycle import Cycle, steady_cycles
from convexrough.friction.levels import FrictionLevels
from convexrough.friction.path import points_of, pressed_for
from convexrough.influence import Kind
from convexrough.progress import LOGGER
from convexrough.scene.scene import Scene


def cycle(
    contact: Contact,
    *,
    maximum: float | None = None,
    minimum: float | None = None,
    displacement: float | None = None,
) -> Cycle:
    """The steady cycle between two shear forces at constant load (docs/theory/losses.md).

    maximum, minimum : [force] largest and smallest shear force; the minimum defaults to -maximum
    displacement     : [length] displacement amplitude of a symmetric cycle, instead of forces

    As in `shear`, a force or displacement that differs only by rounding from its value at the onset
    of gross sliding is replaced by that value, also in the result.

    Raises InputError if the scene has no friction, if the minimum exceeds the maximum, if a force
    exceeds the friction limit f P, or if the displacement exceeds that of gross sliding.

    >>> cycle = cr.cycle(contact, maximum=0.25 * contact.load)
    >>> print(f"{cycle.loss:.4g}", (cycle.status == "sliding").sum())
    1.367e-13 6
    """
    given = {"maximum": maximum, "minimum": minimum, "displacement": displacement}
    for name, value in given.items():
        if value is not None and (shape := np.shape(value)):
            expected = "one number; `cycles` computes several cycles"
            raise InputError(name, found=f"shape {shape}", expected=expected)
    upper, lower, moved = (None if value is None else [value] for value in given.values())
    return cycles(contact, upper, lower, displacement=moved)[0]


def cycles(
    contact: Contact,
    maximum: ArrayLike | None = None,
    minimum: ArrayLike | None = None,
    *,
    displacement: ArrayLike | None = None,
) -> list[Cycle]:
    """The steady cycles of several ranges of shear force at constant load, computed together.

    maximum, minimum, displacement : (m,) as in `cycle`

    Raises the errors of `cycle`.

    >>> several = cr.cycles(contact, contact.load * np.array([0.1, 0.2, 0.4]))
    >>> print([f"{cycle.loss_normalised:.2g}" for cycle in several])
    ['0.00021', '0.0028', '0.048']
    """
    checks.instance("contact", contact, Contact)
    f = checks.friction(contact.scene.friction)
    limit, levels = f * contact.load, contact.cached(FrictionLevels)
    checks.exactly_one("maximum", maximum, "displacement", displacement)
    if displacement is not None:
        if minimum is not None:
            expected = "no minimum: a cycle of given displacement is symmetric"
            raise InputError("minimum", found=minimum, expected=expected)
        amplitudes = checks.array("displacement", displacement, sign="not negative")
        checks.some("displacement", amplitudes)
        tops = [levels.load - levels.displaced(x) for x in amplitudes]
        heights = [(T, -T) for T in tops]
    else:
        assert maximum is not None  # exactly_one
        upper = checks.bearable("maximum", checks.array("maximum", maximum), limit)
        checks.some("maximum", upper)
        lower = -upper
        if minimum is not None:
            lower = checks.array("minimum", minimum, length=len(upper), one="maximum")
            lower = checks.bearable("minimum", lower, limit)
        if (upper < lower).any():
            i = int(np.argmax(upper < lower))
            expected = f"at least the minimum, {lower[i]:g} (-maximum by default)"
            raise InputError(f"maximum[{i}]", found=upper[i], expected=expected)
        ends = zip(upper.tolist(), lower.tolist(), strict=True)
        heights = [(levels.height(high), levels.height(low)) for high, low in ends]
        LOGGER.info("pressing at the load P - T of each cycle")
    paths = [[(levels.load, T) for T in each] for each in heights]
    return steady_cycles(contact, MemoryCurve.pressed(levels.load), paths)


def steady(
    scene: Scene, *, loads: ArrayLike, forces: ArrayLike, influence: Kind | None = None
) -> Cycle:
    """The steady state of a closed path of load and shear force that is repeated.

    docs/theory/paths.md, "Closed paths", derives it.

    loads, forces : (m,) [force] load P and shear force Q at the points of the path, |Q| <= f P;
        segments between points are straight, and the last segment returns to the first point. As
        in `shear`, Q counts as f P if they differ only by rounding
    influence : how the compliance matrix is stored, as in `press`

    Raises the errors of `load_path`.

    >>> P = contact.load
    >>> settled = cr.steady(scene, loads=[P, P / 2], forces=[0.3 * P, -0.1 * P])
    >>> f"{settled.level / P:.4f}", int((settled.status == "sliding").sum())
    ('0.3500', 12)
    """
    points = points_of(scene, loads, forces)
    contact = pressed_for(scene, [load for load, _ in points], influence)
    return steady_cycles(contact, MemoryCurve(), [points])[0]
