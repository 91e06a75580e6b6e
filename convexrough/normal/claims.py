"""Comparison of claimed forces with a proof: the common base of verdicts on loads and on shear."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
import scipy  # its parts are imported when they are used
from numpy.typing import NDArray

from convexrough import checks
from convexrough.arrays import Array, Indices, frozen
from convexrough.errors import InputError
from convexrough.roundoff import SAFETY
from convexrough.scene.scene import Scene

#: Default of `Claim.within`.
WITHIN = 0.01

#: A force is a suspect if its error exceeds this fraction of the largest error.
SUSPICIOUS = 1e-3

#: The prefix of a wrong unit of force, by the power of ten by which it makes forces too large.
PREFIXES = {-9: "G", -6: "M", -3: "k", 3: "m", 6: "\N{MICRO SIGN}", 9: "n"}

#: `_moved` treats points as equal if nearer than SAME_PLACE times the size of the array. `hints`
#: does not explain an error of at most CORRECTED, or at least ABSURD, times the largest force.
SAME_PLACE, CORRECTED, ABSURD = 1e-9, 1e-3, 1e100

#: A common factor of the forces, or a symmetry of the array, explains errors if the correction by
#: it leaves at most this part of the largest error.
REMAINING = 0.1


def tolerance(name: str, within: float) -> float:
    """The tolerance `within`, checked to be above 0 and at most 1."""
    if (number := checks.positive(name, within)) > 1.0:
        expected = "a fraction of the largest force, at most 1; 5 % is 0.05"
        raise InputError(name, found=within, expected=expected)
    return number


class Claim(ABC):
    """Claimed forces, one per asperity, and the statuses that they imply."""

    one: ClassVar[str]  # the term for a force in messages
    many: ClassVar[str]  # its plural
    proved: ClassVar[str]  # the noun before "proved" or "wrong", such as "contact set"
    kinds: ClassVar[Mapping[str, str]]  # attributes with indices of wrong statuses: a text on each
    #: the status claimed where `claimed` is True, and where it is False, such as "contact", "open"
    claims: ClassVar[tuple[str, str]]

    claimed: Any  # (n,) True where claimed to touch or, in a verdict on shear, to slide
    #: largest error allowed: of a force, as a fraction of the largest force; of the total, as a
    #: fraction of the prescribed total
    within: float
    total_prescribed: float | None  # [force] None where it is not prescribed
    certificate: Any  # of the given forces
    solution: Any  # a solution with its own statuses; None where it is not needed or not found

    @property
    @abstractmethod
    def values(self) -> Array:
        """(n,) [force] the given forces."""

    @property
    @abstractmethod
    def of(self) -> Scene:
        """The scene that the claim is about."""

    @property
    @abstractmethod
    def errors_alone(self) -> Array:
        """(n,) [force] bounds on |force - solution| proved from the forces alone, or infinite."""

    @property
    def wrong(self) -> dict[str, Indices]:
        """For each text in `kinds`, the indices of the asperities to which it applies."""
        return {said: getattr(self, name) for name, said in self.kinds.items()}

    @abstractmethod
    def nearby(self) -> tuple[Array, Array] | None:
        """(n,) [force] forces of `solution`, and bounds on their errors; None without one."""

    @cached_property
    def status(self) -> NDArray[np.str_]:
        """(n,) statuses proved from the given forces; where "undecided", those of `solution`."""
        status: NDArray[np.str_] = self.certificate.status
        if self.solution is None:
            return status
        return frozen(np.where(status == "undecided", self.solution.status, status))

    @property
    def basis(self) -> str:
        """What the proof assumes, and whether that is proved; "" if it assumes nothing."""
        return ""

    @property
    def decided_alone(self) -> bool:
        """True if all statuses are proved from the given forces alone."""
        return bool(self.certificate.all_proved)

    @cached_property
    def errors(self) -> Array:
        """(n,) [force] proved bounds on |force - solution|; infinite where nothing is proved."""
        if (nearby := self.nearby()) is None:
            return self.errors_alone
        true, bounds = nearby
        apart = (np.abs(self.values - true) + bounds) * (1 + SAFETY)
        return frozen(np.minimum(self.errors_alone, apart))

    @property
    def holds(self) -> bool:
        """True if all claimed statuses are proved, and forces and total are right to `within`."""
        wrong = len(self.wrongly_claimed) + len(self.undecided)
        return not wrong and self.near_enough and self.total_holds

    def __bool__(self) -> bool:
        """True if the claim `holds`."""
        return self.holds

    @property
    def holds_by_default(self) -> bool:
        """True if the claim `holds`, also with the default of `within`."""
        return self.holds and self.error <= WITHIN

    def hints(self) -> Iterator[str]:
        """Lines that name a possible cause of wrong forces, such as a wrong unit or sign; none if
        the claim holds, also with the default of `within`."""
        if self.holds_by_default or (nearby := self.nearby()) is None:
            return
        with np.errstate(over="ignore"):
            values, true = (each / (self.largest or 1.0) for each in (self.values, nearby[0]))
        apart = np.abs(values - true).max()
        if not CORRECTED < apart < ABSURD:  # below, the statuses are wrong, not the forces
            return
        if moved := self._moved(values, true):
            yield f"the {self.many} are right with {moved}"
            return
        sorted_apart = np.abs(np.sort(values) - np.sort(true)).max()
        if sorted_apart <= WITHIN < np.abs(values - true).max():
            yield f"the {self.many} are those of the solution, in another order of the asperities"
            return
        factor = float(values @ true) / (float(true @ true) or 1.0)
        left, apart, most = (
            float(np.abs(each).max()) for each in (values - factor * true, values - true, values)
        )
        scale = np.maximum(np.abs(factor * true), WITHIN * most)
        uneven = (np.abs(values - factor * true) > 0.5 * scale).any()
        if uneven or left > REMAINING * min(apart, most):  # the forces differ by more than a factor
            factor = self.total_given / (self.total_prescribed or math.inf)
            if not _power_of_ten(factor):
                return
        if factor and abs(factor - 1) > WITHIN:
            yield f"the {self.many} {self._wrong_by(factor)}"

    def _moved(self, values: Array, true: Array) -> str:
        """The symmetries of the array (axes, signs, turns) that correct forces; "" if none."""
        points = self.of.asperities.positions
        tree, size, found = scipy.spatial.cKDTree(points), float(np.abs(points).max()), list[str]()
        for said, moved in (
            ("x and y exchanged", points[:, ::-1]),
            ("the other sign of x", points * [-1, 1]),
            ("the other sign of y", points * [1, -1]),
            ("the other sign of x and y", -points),
            *((f"the array turned by {each} degrees", turned(points, -each))
              for each in (60, -60, 90, -90, 120, -120)),
        ):  # fmt: skip
            distances, partners = map(np.asarray, tree.query(moved))
            left, apart = (np.abs(each - true).max() for each in (values[partners], values))
            if distances.max() <= SAME_PLACE * size and left <= min(WITHIN, REMAINING * apart):
                found.append(said)
        return " or ".join(found)

    def _wrong_by(self, factor: float) -> str:
        size = f"are {abs(factor):.4g} times those of the solution"
        if abs(abs(factor) - 1) <= WITHIN:
            size = ""
        elif power := _power_of_ten(abs(factor)):
            prefix = PREFIXES.get(power)
            unit = self.of.units.force or "N"
            example = f" (as {prefix}N for N)" if prefix and unit == "N" else ""
            modulus = ", or of the modulus" if self.total_prescribed is None else ""
            cause = f"another unit of force{example}{modulus}"
            size = f"are 10^{power} times what they should be: {cause}?"
        sign = "have the opposite sign to the prescribed total" if factor < 0 else ""
        return " and ".join(filter(None, (sign, size)))

    @property
    def wrongly_claimed(self) -> Indices:
        """(m,) indices of asperities whose claimed status is proved wrong."""
        return np.concatenate(list(self.wrong.values()))

    @cached_property
    def undecided(self) -> Indices:
        """(m,) indices of asperities without a proved status."""
        return frozen(np.flatnonzero(self.status == "undecided"))

    @property
    def largest(self) -> float:
        """[force] the largest |force|: of those given, or of the solution if that is smaller.

        Without `solution`, a lower bound on that of the exact solution, if there is one above 0.
        """
        given, nearby = np.abs(self.values), self.nearby()
        if nearby is not None:
            return min(float(given.max()), float(np.abs(nearby[0]).max()))
        proved = float((given - self.errors_alone).max())
        return proved if proved > 0 else float(given.max())

    @property
    def error(self) -> float:
        """The largest of `errors`, as a fraction of the largest force."""
        most = float(self.errors.max())
        return most / self.largest if self.largest > 0 else 0.0 if most == 0 else np.inf

    @cached_property
    def off(self) -> Indices:
        """(m,) indices of asperities with an error above `within`, largest first."""
        order = np.argsort(-self.errors, kind="stable")
        return frozen(order[~(self.errors[order] <= self.within * self.largest)])

    @property
    def near_enough(self) -> bool:
        """True if every force is proved to have an error of at most `within`."""
        return not len(self.off)

    @property
    def total_given(self) -> float:
        """[force] the sum of the forces."""
        return float(self.values.sum())

    @property
    def total_holds(self) -> bool:
        """True if the total is as prescribed, to a relative error of `within`."""
        if self.total_prescribed is None:
            return True
        given, wanted = self.total_given, self.total_prescribed
        return abs(given - wanted) <= self.within * abs(wanted)

    @cached_property
    def suspects(self) -> Indices:
        """(m,) indices of asperities with a wrong status or a wrong force, the likeliest first.

        A single missing, spurious or wrong force comes first; two exchanged forces are the first
        two. Forces with another sum than the solution are also compared after scaling to its sum;
        if that removes most of the error, and more than one force differs, none stands out.
        """
        wrong, nearby = self.wrongly_claimed, self.nearby()
        if nearby is None or self.near_enough:
            return frozen(wrong[np.argsort(-self.errors[wrong], kind="stable")])
        true, bounds = nearby
        scales = [1.0]
        if (total := self.total_given) * (wanted := float(true.sum())) > 0:
            scales.append(wanted / total)
        apart = min((np.abs(scale * self.values - true) for scale in scales), key=np.sum)
        least = np.maximum(np.where(np.isfinite(bounds), bounds, 0.0), SUSPICIOUS * apart.max())
        order, unscaled = np.argsort(-apart, kind="stable"), np.abs(self.values - true)
        stand_out = (apart > least) & (unscaled > least)
        if apart.max() <= REMAINING * unscaled.max():  # all by a common factor, or only one
            stand_out = unscaled > SUSPICIOUS * unscaled.max()
            stand_out &= np.count_nonzero(stand_out) == 1
        stand_out[wrong] = True
        return frozen(order[stand_out[order]])


def turned(points: Array, degrees: float) -> Array:
    """(n, 2) the points, turned about the origin."""
    moved: Array = (points @ np.array([1, 1j]) * np.exp(1j * np.radians(degrees))).view(np.float64)
    return moved.reshape(-1, 2)


def _power_of_ten(factor: float) -> int:
    """The exponent of the power of ten that differs from a factor by less than 1 %; 0 if none."""
    if not (0 < factor < math.inf):
        return 0
    exact = math.log10(factor)
    return round(exact) if abs(exact - round(exact)) < math.log10(1 + WITHIN) else 0
