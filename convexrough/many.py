"""Press many scenes with equal numbers of asperities at once, and compute a cycle of each.

Scenes that differ only in heights and friction share one compliance matrix. Where possible, scenes
are solved and proved together; the others are pressed one by one.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from operator import index
from typing import Any, ClassVar, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from convexrough import checks, threads
from convexrough.arrays import Array, frozen
from convexrough.contact import Contact, press
from convexrough.errors import InputError, SolverError
from convexrough.friction.cycle import Cycle
from convexrough.friction.steady import cycle, force_ranges
from convexrough.plausibility import cautions_about
from convexrough.record import Along, Table, in_text, singular
from convexrough.roundoff import ROUNDOFF, SAFETY
from convexrough.rows import CYCLE, MATRICES, TOTALS, PressedRows, in_rows
from convexrough.scene.scene import Scene


@dataclass(frozen=True, eq=False, repr=False)
class Contacts(Table):
    """The contacts of m scenes with n asperities each; fields named `..._errors` are proved bounds.

    `contacts[k]` is the `Contact` that `press` returns for scene k, made on first access.

    controls : (m,) the prescribed loads [force] if `by_load` is True, else approaches [length]
    loads, approaches : (m,) total loads [force], and approaches [length]
    load_errors, approach_errors : (m,) bounds on the errors of `loads` and `approaches`
    asperity_loads, asperity_load_errors : (m, n) [force] loads, and bounds on their errors
    status   : (m, n) "contact" or "open" where that is proved, else "undecided"
    """

    _along: ClassVar[Along] = {
        ("scene",): ("controls", "loads", "load_errors", "approaches", "approach_errors"),
        ("scene", "asperity"): ("asperity_loads", "asperity_load_errors", "status"),
    }

    scenes: tuple[Scene, ...]
    by_load: bool
    controls: Array
    loads: Array
    load_errors: Array
    approaches: Array
    approach_errors: Array
    asperity_loads: Array
    asperity_load_errors: Array
    status: NDArray[np.str_]

    def __len__(self) -> int:
        return len(self.scenes)

    def _headline(self) -> str:
        m, n = self.status.shape
        return f"Contacts: {in_text(self.status)}; {m:,} scenes of {n:,} asperities"

    def __getitem__(self, k: int) -> Contact:
        """The contact of scene k. Raises IndexError if there is none."""
        if not -len(self) <= index(k) < len(self):
            raise IndexError(f"scene {k}: expected an index from 0 to {len(self) - 1:,}")
        k = index(k) % len(self)
        if k not in self._known:
            name, start = "load" if self.by_load else "approach", self.asperity_loads[k]
            self._known[k] = _pressed(self.scenes[k], name, self.controls[k], start)
        return self._known[k]

    def cycles(self, maximum: ArrayLike, minimum: ArrayLike | None = None) -> Cycles:
        """The steady cycle of each contact between two shear forces.

        maximum, minimum : (m,) [force] largest and smallest shear force, or one number for all
            contacts; the default minimum is -maximum

        Raises InputError if a scene has no friction, if a minimum exceeds its maximum, or if the
        absolute value of a force exceeds the limiting shear force f P of its contact.

        >>> found = cr.press_many([scene, scene], load=3.6e-7).cycles([9e-8, 4e-8])
        >>> print([f"{loss:.4g}" for loss in found.losses], found.order.tolist())
        ['1.364e-13', '6.542e-15'] ['proved', 'proved']
        """
        (m, n), f = self.status.shape, [checks.friction(scene.friction) for scene in self.scenes]
        limits = np.array(f) * self.loads
        upper, lower = force_ranges(maximum, minimum, limits, length=m, one="scene")
        fields: dict[str, NDArray[Any]] = {name: np.zeros(m) for name in CYCLE}
        fields |= {"maximum": upper.copy(), "minimum": lower.copy()}
        fields["order"] = np.full(m, "proved", dtype="<U19")
        fields["status"], alone = np.full((m, n), "open", dtype="<U12"), np.ones(m, dtype=bool)
        with threads.one_where(MATRICES):
            for rows in self._together:
                at = rows.places
                good, found = rows.cycles(upper[at], lower[at], np.array(f)[at])
                places = at[good]
                alone[places] = False
                for name, values in found.items():
                    fields[name][places] = values[good]
        for k in np.flatnonzero(alone).tolist():
            one = cycle(self[k], maximum=float(upper[k]), minimum=float(lower[k]))
            for name, values in fields.items():
                values[k] = getattr(one, singular(name))
        return Cycles(contacts=self, **{name: frozen(values) for name, values in fields.items()})

    @cached_property
    def warnings(self) -> tuple[str, ...]:
        """The warnings: a line for each kind (its text without numbers), with the first scene."""
        kinds = dict[str, list[str]]()
        given = zip(self.scenes, self.asperity_loads, self.approaches.tolist(), strict=True)
        for k, known in enumerate(given):
            pressed = "undecided" in self.status[k]
            for line in self[k].warnings if pressed else cautions_about(*known):
                kinds.setdefault(re.sub(r"\d\S*", "", line), []).append(f"scenes[{k}]: {line}")
        return tuple(
            lines[0].replace("]", f"], the first of {len(lines):,}" if lines[1:] else "]", 1)
            for lines in kinds.values()
        )

    @cached_property
    def _known(self) -> dict[int, Contact]:
        """The contacts made so far, by the indices of their scenes."""
        return {}

    @cached_property
    def _together(self) -> list[PressedRows]:
        """The scenes that were proved together; computed again for an unpickled object."""
        return in_rows(self.scenes, self.controls, self.by_load)


@dataclass(frozen=True, eq=False, repr=False)
class Cycles(Table):
    """The steady cycles of m contacts. Arrays are (m,), `status` is (m, n); `Cycle` explains them.

    `cycles[k]` is the `Cycle` of contact k.
    """

    _along: ClassVar[Along] = {
        ("scene",): ("maximum", "minimum", *CYCLE, "order"),
        ("scene", "asperity"): ("status",),
    }

    contacts: Contacts
    maximum: Array
    minimum: Array
    losses: Array
    loss_errors: Array
    displacement_amplitudes: Array
    displacement_errors: Array
    order: NDArray[np.str_]
    status: NDArray[np.str_]

    def __len__(self) -> int:
        return len(self.contacts)

    def __getitem__(self, k: int) -> Cycle:
        """The cycle of contact k."""
        ends = {"maximum": float(self.maximum[k]), "minimum": float(self.minimum[k])}
        return cycle(self.contacts[k], **ends)


def press_many(
    scenes: Sequence[Scene], *, approach: ArrayLike | None = None, load: ArrayLike | None = None
) -> Contacts:
    """The contacts of many scenes with equal numbers of asperities.

    approach [length] or load [force] : the prescribed quantity, (m,) or one number for all scenes

    Results agree with those of `press` for each scene to within their error bounds. Raises
    InputError for scenes with different numbers of asperities, and the errors of `press`.

    >>> contacts = cr.press_many([scene, scene], load=[3e-7, 2e-7])
    >>> bool((contacts[1].loads == contacts.asperity_loads[1]).all())
    True
    """
    checks.exactly_one("approach", approach, "load", load)
    by_load = load is not None
    checks.sequence("scenes", scenes, "a list of scenes")
    scenes = tuple(scenes)
    for k, scene in enumerate(scenes):
        checks.instance(f"scenes[{k}]", scene, Scene)
        if len(scene) != len(scenes[0]):
            expected = f"{len(scenes[0])}, as in scenes[0]: all scenes need as many asperities"
            raise InputError(f"scenes[{k}]", found=f"{len(scene)} asperities", expected=expected)
    m, n = len(scenes), len(scenes[0]) if scenes else 0
    name, given = ("approach", approach) if load is None else ("load", load)
    sign = "positive" if by_load else ""
    controls = checks.array(name, cast("ArrayLike", given), length=m, sign=sign, one="scene")
    fields: dict[str, NDArray[Any]] = {each: np.zeros(m) for each in TOTALS}
    fields |= {each: np.zeros((m, n)) for each in ("asperity_loads", "asperity_load_errors")}
    fields["status"], alone = np.full((m, n), "undecided"), np.ones(m, dtype=bool)
    rows = in_rows(scenes, controls, by_load)
    for each in rows:
        alone[each.places] = False
        for found, values in each.contacts().items():
            fields[found][each.places] = values
    known = dict[int, Contact]()
    for k in np.flatnonzero(alone).tolist():
        try:
            one = known[k] = _pressed(scenes[k], name, controls[k])
        except SolverError as error:
            what, solver, advice = f"scenes[{k}]: {error.what}", error.solver, error.advice
            raise SolverError(what, solver=solver, advice=advice, iterate=error.iterate) from error
        proof = one.certificate
        errors = proof.load_errors.sum() + n * ROUNDOFF * one.load  # and the rounding of the sum
        own = one.load, errors * (1 + SAFETY), one.approach, proof.approach_error
        arrays = one.loads, proof.load_errors, proof.status
        for values, value in zip(fields.values(), (*own, *arrays), strict=True):
            values[k] = value
    contacts = Contacts(
        scenes=scenes,
        by_load=by_load,
        controls=controls,
        **{each: frozen(values) for each, values in fields.items()},
    )
    contacts.__dict__.update(_together=rows, _known=known)
    return contacts


def _pressed(scene: Scene, name: str, control: float, start: Array | None = None) -> Contact:
    prescribed: dict[str, Any] = {name: float(control)}
    return press(scene, start=start, **prescribed)
