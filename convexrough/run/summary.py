"""The contents of summary.json, which `--json` prints; the printed report; and the warnings."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

from convexrough.atomic import to_json as to_json
from convexrough.plausibility import cautions
from convexrough.run.stage import Result, Summary
from convexrough.run.stages.normal import NormalResult
from convexrough.version import __version__

#: Version of the keys of summary.json and of the columns of tables.
SCHEMA = 2


def headed(**contents: Any) -> Summary:
    """A summary of these contents, with the schema and the version of the package."""
    return {"schema": SCHEMA, "version": __version__, **contents}


def summarise(results: Iterable[Result]) -> Summary:
    """The summary of a run: the results of all stages, in the scene's units."""
    return headed(**{result.name: result.summary() for result in results})


def describe(results: Iterable[Result]) -> list[str]:
    """The printed report of all stages, in aligned lines."""
    first, *others = results
    return [*first.lines(), *(line for it in others for line in ("", *it.lines()))]


def warnings(results: Iterable[Result]) -> Iterator[str]:
    """Warnings about results that are not proved and about limits of the model."""
    for result in results:
        yield from result.doubts()
        if isinstance(result, NormalResult):
            yield from cautions(result.known[0], result.units)
