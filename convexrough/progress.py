"""The logger `convexrough`, to which long computations report their progress."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

LOGGER = logging.getLogger("convexrough")

#: The level, between INFO and WARNING, of records that commands print and keep.
NOTE = 25


def log_step(solver: str, step: int, objective: float, residual: float) -> None:
    """Log a step of an iteration at level DEBUG; `args` of the record has the four values."""
    LOGGER.debug(
        "%(solver)s: step %(step)d, objective %(objective).12g, residual %(residual).1e",
        {"solver": solver, "step": step, "objective": objective, "residual": residual},
    )


@contextmanager
def logged(
    call: Callable[[logging.LogRecord], object], least: int = logging.INFO
) -> Iterator[None]:
    """Pass every log record of at least the level `least` to `call` while the body runs."""

    handler, level = logging.Handler(least), LOGGER.level
    handler.emit = call  # type: ignore[method-assign, assignment]
    LOGGER.addHandler(handler)
    LOGGER.setLevel(least)
    try:
        yield
    finally:
        LOGGER.removeHandler(handler)
        LOGGER.setLevel(level)


@contextmanager
def logged_steps() -> Iterator[list[Mapping[str, Any]]]:
    """A context manager that yields a list, to which each logged step of the body is appended."""
    steps: list[Mapping[str, Any]] = []

    def keep(record: logging.LogRecord) -> None:
        if isinstance(record.args, Mapping):
            steps.append(record.args)

    with logged(keep, logging.DEBUG):
        yield steps
