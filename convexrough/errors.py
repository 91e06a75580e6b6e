"""The errors of the package. A message says what is wrong and, for input, what is expected."""

from __future__ import annotations

import copyreg
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pathlib import Path

    import numpy as np
    from numpy.typing import NDArray


class ConvexroughError(Exception):
    """Base class of all errors that this package raises.

    >>> try:
    ...     cr.press(scene, approach="deep")
    ... except cr.ConvexroughError as error:
    ...     print(error)
    approach: found 'deep', expected a finite number
    """

    def __reduce__(self) -> tuple[object, ...]:
        """Pickle the error with its message, unchanged."""
        return copyreg.__newobj__, (type(self), *self.args), self.__dict__  # type: ignore[attr-defined]


class InputError(ConvexroughError, ValueError):
    """A value given by the user is wrong.

    what     : name of the value
    found    : the value given
    expected : a description of valid values ("a positive number")
    where    : file, table, row or column, if known

    >>> wrong = cr.InputError("load", found=-1.0, expected="a positive number")
    >>> print(wrong.located("scene.toml", table="normal"))
    scene.toml: [normal] load: found -1.0, expected a positive number
    """

    def __init__(self, what: str, *, found: object, expected: str, where: str = "") -> None:
        self.what, self.found, self.expected, self.where = what, found, expected, where
        place = f"{where}: " if where else ""
        super().__init__(f"{place}{what}: found {found}, expected {expected}")

    def located(self, where: str, table: str = "") -> InputError:
        """The same error, with `where` (a file, for example) at the beginning of the message.

        table : a table of this file; its name in brackets is put before the name of the value
        """
        place = f"{where}: {self.where}" if self.where else where
        what = f"[{table}] {self.what}" if table else self.what
        return InputError(what, found=self.found, expected=self.expected, where=place)


@contextmanager
def blamed_on(where: object, table: str = "", *, unless_known: bool = False) -> Iterator[None]:
    """A context manager: `InputError.located` for the errors of the body but MistakesErrors and,
    with `unless_known`, those that already name a place."""
    try:
        yield
    except InputError as error:
        stage = error.where.startswith("[")  # a table, not a file
        if isinstance(error, MistakesError) or (unless_known and error.where and not stage):
            raise
        raise error.located(str(where), table) from error


class MistakesError(InputError):
    """All mistakes of a scene file or a table; the message has one line per mistake."""

    def __init__(self, path: object, mistakes: Sequence[str]) -> None:
        super().__init__("mistakes", found=len(mistakes), expected="none", where=str(path))
        self.mistakes = tuple(f"{path}: {mistake}" for mistake in mistakes)

    def __str__(self) -> str:
        return "\n".join(self.mistakes)


class FileError(ConvexroughError):
    """A file or folder cannot be read or written, or must not be overwritten.

    >>> try:
    ...     cr.read_scene("missing.toml")
    ... except cr.FileError as error:
    ...     print(error)
    missing.toml: cannot be read: No such file or directory
    """


@contextmanager
def file_errors(path: Path, what: str) -> Iterator[None]:
    """A context manager: turn an OSError of the body into a FileError: `path` "cannot" `what`."""
    try:
        yield
    except OSError as error:
        raise FileError(f"{path}: cannot {what}: {error.strerror or error}") from error


class SolverError(ConvexroughError):
    """A solver stopped without a solution. Solvers of users may raise it, too.

    what    : the reason, with the number that shows it
    solver  : name of the solver
    advice  : what to try, or ""
    iterate : [force] the loads (n,), or shear forces (n,) or (n, 2), of the last iteration, or None

    >>> print(cr.SolverError("no descent after 3 steps", solver="mine", advice="a smaller load"))
    mine: no descent after 3 steps; a smaller load
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
    """Nothing could be proved; the message says why.

    >>> twins = cr.Asperities([[-5e-5, 0.0], [5e-5, 0.0]], 0.02)
    >>> try:
    ...     cr.press(cr.Scene(1.0, twins, scene.material), load=6.6e-8).proof()
    ... except cr.ProofError as error:
    ...     print(str(error).split(":")[0])
    nothing is proved
    """


#: For an extra whose name is not that of its package: the packages to install.
PACKAGES = {"parquet": "pyarrow", "dask": "'dask[dataframe]' distributed"}


class ExtraError(ConvexroughError, ImportError):
    """An optional package is missing; the message says what to install.

    extra : the name of the extra that contains the package
    """

    def __init__(self, extra: str) -> None:
        self.extra = extra
        packages = PACKAGES.get(extra, extra)
        super().__init__(f"needs {packages.split()[-1]}: pip install {packages}")


def needed(module: str, extra: str = "") -> Any:
    """The module of an optional package; ExtraError, with the `extra`, if it is not installed."""
    try:
        return import_module(module)
    except ImportError as error:
        raise ExtraError(extra or module) from error


class WorkerError(ConvexroughError):
    """Worker processes of a sweep stopped, or have another version of a package.

    Computed rows are kept; `cr.sweep` with `resume=True` computes the other rows.

    >>> try:
    ...     table = cr.sweep([scene], load=3e-7, measure=["load"], out=folder / "c", workers=1)
    ... except cr.WorkerError:
    ...     table = cr.sweep([scene], load=3e-7, measure=["load"], out=folder / "c", resume=True)
    """
