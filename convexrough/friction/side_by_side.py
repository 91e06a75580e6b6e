"""Comparison of three methods for a load path: agreement and time.

The memory curve holds only if no indentation falls as the load rises. The general step
(docs/theory/without-order.md), computed by Newton's method, needs no such condition. The conic step
minimises the energy of the same step as a cone program. General and conic step are taken once per
segment, which is exact if no indentation falls as the load rises.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from time import perf_counter
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from convexrough.arrays import Array
from convexrough.contact import Contact
from convexrough.errors import SolverError
from convexrough.friction.conic_step import ConicStepper
from convexrough.friction.order import Order
from convexrough.friction.path import LoadPath, walk
from convexrough.influence import Kind
from convexrough.plottable import Plottable
from convexrough.progress import LOGGER
from convexrough.record import LINE, Record, Table, Variables
from convexrough.scene.scene import Scene

Way = Literal["general step", "memory curve", "conic step"]


@dataclass(frozen=True, eq=False, repr=False)
class PathEntry(Record):
    """The result of one method for a load path.

    way     : the method: "general step", "memory curve" or "conic step"
    outcome : "answered", "refused" (the method does not apply to the path) or "failed"
    message : the reason why there is no result, or ""
    path    : the result; None if there is none
    force_disagreement : largest difference of a shear force Q_i from the result of the first method
        that answered, divided by the largest friction limit f P_i
    displacement_disagreement : largest difference of the displacement X from the same result,
        divided by the largest |X| of that result
    seconds : [s] time, including the normal solutions that were not cached

    >>> found = cr.compare_paths(scene, loads=[contact.load], forces=[0.2 * contact.load])
    >>> found.entries[0].way, found.entries[0].outcome
    ('general step', 'answered')
    """

    way: Way
    outcome: Literal["answered", "refused", "failed"]
    message: str = ""
    path: LoadPath | None = None
    force_disagreement: float = np.nan
    displacement_disagreement: float = np.nan
    seconds: float = np.nan


@dataclass(frozen=True, eq=False, repr=False)
class PathComparison(Table, Plottable):
    """The results of three methods for one load path, the general step first.

    scene : the scene
    loads, forces : (m,) [force] load P and shear force Q at the points of the path
    order : as in `LoadPath`; if it is "fails", the result of the memory curve is refused
    entries : the result of each method

    >>> found = cr.compare_paths(scene, loads=[contact.load], forces=[0.2 * contact.load])
    >>> max(each.displacement_disagreement for each in found.entries) < 1e-4
    True
    """

    scene: Scene
    loads: Array
    forces: Array
    order: Order
    entries: tuple[PathEntry, ...]

    def _rows(self) -> Iterator[tuple[str, str]]:
        yield "order", self.order
        for each in self.entries:
            Q, X = each.force_disagreement, each.displacement_disagreement
            answered = f"differs by {Q:.1e} in Q_i, {X:.1e} in X; {each.seconds:.2g} s"
            found = answered if each.outcome == "answered" else f"{each.outcome}: {each.message}"
            yield each.way, found[:LINE]

    def _variables(self) -> Variables:
        names = (
            *("way", "outcome", "message", "seconds"),
            *("force_disagreement", "displacement_disagreement"),
        )
        arrays: Variables = {
            name: (("entry",), np.array([getattr(each, name) for each in self.entries]))
            for name in names
        }
        nothing = np.full((len(self.loads), len(self.scene)), np.nan)
        paths = [each.path for each in self.entries]
        displacements = [nothing[:, 0] if it is None else it.displacements for it in paths]
        forces = [nothing if it is None else it.asperity_forces for it in paths]
        arrays["displacements"] = ("entry", "point"), np.array(displacements)
        arrays["asperity_forces"] = ("entry", "point", "asperity"), np.array(forces)
        return arrays


def compare_paths(
    scene: Scene,
    *,
    loads: ArrayLike,
    forces: ArrayLike,
    start: Contact | None = None,
    influence: Kind | None = None,
) -> PathComparison:
    """Comparison of the general step, the memory curve and the conic step on one path.

    docs/theory/without-order.md describes the steps, docs/theory/paths.md the memory curve.

    loads, forces, start, influence : as in `load_path`

    Raises InputError for the same reasons as `load_path`, and SolverError if no method answers.

    >>> P = contact.load
    >>> found = cr.compare_paths(scene, loads=[P, P / 2], forces=[0.3 * P, 0.0])
    >>> [each.way for each in found.entries if each.force_disagreement < 1e-4]
    ['general step', 'memory curve', 'conic step']
    """
    given, entries, path = (scene, loads, forces, start, influence), list[PathEntry](), None
    ways: dict[Way, Callable[[], LoadPath]] = {
        "general step": lambda: walk(*given, general_steps=1),
        "memory curve": lambda: walk(*given),
        "conic step": lambda: walk(*given, general_steps=1, stepper=ConicStepper),
    }
    for way, found in ways.items():
        LOGGER.info(way)
        entries.append(_entry(way, found, path))
        path = path or entries[-1].path
    if path is None:
        raise SolverError(entries[0].message, solver="compare_paths", advice="use load_path")
    return PathComparison(scene, path.loads, path.forces, path.order, tuple(entries))


def _entry(way: Way, found: Callable[[], LoadPath], reference: LoadPath | None) -> PathEntry:
    refused = PathEntry(
        "memory curve", "refused", "it is not proved that indentations rise with the load"
    )
    if way == refused.way and reference is not None and reference.order == "fails":
        return refused
    began = perf_counter()
    try:
        path = found()
    except SolverError as error:
        return PathEntry(way, "failed", str(error))
    seconds = perf_counter() - began
    if way == refused.way and path.order == "fails":
        return refused
    if reference is None:
        reference = path
    apart = path.asperity_forces - reference.asperity_forces
    largest = (path.scene.friction or 1.0) * float(path.asperity_loads.max()) or 1.0
    farthest = float(np.abs(reference.displacements).max()) or 1.0
    return PathEntry(
        way=way,
        outcome="answered",
        path=path,
        force_disagreement=float(np.abs(apart).max()) / largest,
        displacement_disagreement=float(
            np.abs(path.displacements - reference.displacements).max() / farthest
        ),
        seconds=seconds,
    )
