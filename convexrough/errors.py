"""What can go wrong, in words a user can act on."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


class ConvexroughError(Exception):
    """Base of every error this package raises on purpose."""

    def __reduce__(self) -> tuple[object, ...]:
        """Pickled with its message, so that it passes between processes unchanged."""
        return _again, (type(self), self.args), self.__dict__


def _again(kind: type[ConvexroughError], arguments: tuple[object, ...]) -> ConvexroughError:
    return kind.__new__(kind, *arguments)


class InputError(ConvexroughError, ValueError):
    """A value the user gave is wrong.

    what     : the value, by the name the user knows it by
    found    : what was given
    expected : what is accepted, as a phrase ("a positive number")
    where    : file, table, row or column, where known
    """

    def __init__(self, what: str, *, found: object, expected: str, where: str = "") -> None:
        self.what, self.found, self.expected, self.where = what, found, expected, where
        place = f"{where}: " if where else ""
        super().__init__(f"{place}{what}: found {found}, expected {expected}")

    def within(self, where: str) -> InputError:
        """The same error, seen from further out (a file, say)."""
        place = f"{where}: {self.where}" if self.where else where
        return InputError(self.what, found=self.found, expected=self.expected, where=place)


class MistakesError(InputError):
    """Everything that is wrong in a file; the message has one line per mistake."""

    def __init__(self, path: str, mistakes: Sequence[str]) -> None:
        super().__init__("mistakes", found=len(mistakes), expected="none", where=path)
        self.mistakes = tuple(f"{path}: {mistake}" for mistake in mistakes)

    def __str__(self) -> str:
        return "\n".join(self.mistakes)


class SceneFileError(MistakesError):
    """Everything that is wrong in a scene file."""


class TableError(MistakesError):
    """Everything that is wrong in a file of numbers."""


class FileError(ConvexroughError):
    """A file or folder cannot be read, or may not be written."""


class SolverError(ConvexroughError):
    """A solver stopped without an answer.

    what    : what was wrong, with the number that was too large
    solver  : its name
    advice  : what to try; "" where nothing is known to help
    iterate : the last loads (n,) or forces, (n,) or (n, 2), [force] in the scene's order; None
        where there are none
    """

    def __init__(
        self,
        what: str,
        *,
        solver: str = "",
        advice: str = "",
        iterate: NDArray[np.float64] | None = None,
    ) -> None:
        self.what, self.solver, self.advice, self.iterate = what, solver, advice, iterate
        place = f"{solver}: " if solver else ""
        super().__init__(place + what + (f"; {advice}" if advice else ""))


class ProofError(ConvexroughError):
    """Nothing could be proved; the message says why."""


#: What extras hold, where that is not what they are called.
PACKAGES = {"parquet": "pyarrow", "dask": "'dask[dataframe]' distributed"}


class ExtraError(ConvexroughError, ImportError):
    """A package that is not among the requirements is missing; the message says what to install.

    extra : the name of the extra that holds it
    """

    def __init__(self, extra: str) -> None:
        self.extra = extra
        packages = PACKAGES.get(extra, extra)
        super().__init__(f"needs {packages.split()[-1]}: pip install {packages}")


class WorkerError(ConvexroughError):
    """Those who should compute are gone, or are not the same program; what is done is kept."""
