"""The stages of a run in which the normal load varies: what is asked for, and found."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import NamedTuple

from convexrough.arrays import Array
from convexrough.contact import Contact
from convexrough.errors import InputError
from convexrough.friction.cycle import Cycle, steady
from convexrough.friction.path import LoadPath, load_path
from convexrough.friction.phases import PhaseLosses, phase_losses
from convexrough.melan.shakedown import Shakedown, Theory, shakedown
from convexrough.progress import Announce


class Points(NamedTuple):
    """(m,) P and (m,) Q of the points of a path [force]."""

    loads: Array
    forces: Array


class Phases(NamedTuple):
    """An ellipse, in the words of `phase_losses` [force], and which phases and factors of it."""

    load: float
    load_amplitude: float
    force: float
    force_amplitude: float
    phases: tuple[float, ...]
    factors: tuple[float, ...]
    chords: int


class Limit(NamedTuple):
    """A mean P and Q [force], and amplitudes (m,) to be scaled; Q (2,) and (m, 2) by "vector"."""

    loads: float
    forces: Array
    load_amplitudes: Array
    force_amplitudes: Array
    kind: Theory


class Varied(NamedTuple):
    """What was found; None where it was not asked for."""

    path: LoadPath | None = None
    steady: Cycle | None = None
    phase_losses: PhaseLosses | None = None
    shakedown: Shakedown | None = None


class Varying(NamedTuple):
    """What is asked for.

    path, steady : a path from no load, and a closed path;  phases : of an ellipse
    shakedown    : how far a path may be scaled
    """

    path: Points | None = None
    steady: Points | None = None
    phases: Phases | None = None
    shakedown: Limit | None = None

    def compute(self, contact: Contact, announce: Announce | None = None) -> Varied:
        """All of it, on the scene of a contact and with its kind of coupling."""
        scene, influence = contact.scene, contact.influence
        path = closed = losses = limit = None
        if self.path is not None:
            with _blamed_on("path"):
                path = load_path(
                    scene, **self.path._asdict(), influence=influence, announce=announce
                )
        if self.steady is not None:
            with _blamed_on("steady"):
                closed = steady(
                    scene, **self.steady._asdict(), influence=influence, announce=announce
                )
        if self.phases is not None:
            with _blamed_on("steady"):
                losses = phase_losses(
                    scene, **self.phases._asdict(), influence=influence, announce=announce
                )
        if self.shakedown is not None:
            with _blamed_on("shakedown"):
                limit = shakedown(
                    scene, **self.shakedown._asdict(), influence=influence, announce=announce
                )
        return Varied(path, closed, losses, limit)


@contextmanager
def _blamed_on(table: str) -> Iterator[None]:
    try:
        yield
    except InputError as error:
        raise error.within(f"[{table}]") from error
