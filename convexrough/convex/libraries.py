"""The solvers that nobody here wrote: imported when first used, missed in words."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from convexrough.errors import SolverError


def load_library(package: str, solver: str) -> Any:
    """The module `package`, or a SolverError of `solver` that says what to install."""
    try:
        return import_module(package)
    except ImportError as error:
        raise SolverError(
            f"needs the package {package}, which cannot be imported ({error}); "
            f"pip install {package}",
            solver=solver,
        ) from error
