"""What can go wrong, in words a user can act on."""

from __future__ import annotations

from collections.abc import Sequence


class ConvexroughError(Exception):
    """Base of every error this package raises on purpose."""


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


class SceneFileError(InputError):
    """Everything that is wrong in a scene file; the message has one line per mistake."""

    def __init__(self, path: str, mistakes: Sequence[str]) -> None:
        super().__init__("mistakes", found=len(mistakes), expected="none", where=path)
        self.mistakes = tuple(f"{path}: {mistake}" for mistake in mistakes)

    def __str__(self) -> str:
        return "\n".join(self.mistakes)


class FileError(ConvexroughError):
    """A file or folder cannot be read, or may not be written."""


class SolverError(ConvexroughError):
    """A solver stopped without an answer; the message names it and its last residual."""
