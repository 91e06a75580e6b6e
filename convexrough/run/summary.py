"""summary.json, which `--json` prints, with the printed report and the exit status."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

from convexrough.atomic import to_json as to_json
from convexrough.run.stage import Result, Summary
from convexrough.run.stages.normal import Pressed, cautions
from convexrough.tabular.units import UnitNames
from convexrough.version import __version__

#: Of the keys of summary.json and the columns of tables.
SCHEMA = 2


def headed(**contents: Any) -> Summary:
    """What every summary begins with."""
    return {"schema": SCHEMA, "version": __version__, **contents}


def summarise(results: Iterable[Result]) -> Summary:
    """The summary of a run, in the scene's units: of each stage what was found."""
    return headed(**{result.name: result.summary() for result in results})


def describe(results: Iterable[Result], units: UnitNames) -> list[str]:
    """Aligned lines for people, of all stages."""
    first, *others = results
    return [*first.lines(units), *(line for it in others for line in ("", *it.lines(units)))]


def warnings(results: Iterable[Result], units: UnitNames) -> Iterator[str]:
    """What a user must not overlook: what is not proved, and where the model ends."""
    for result in results:
        yield from result.doubts()
        if isinstance(result, Pressed):
            yield from cautions(result.known[0], units)
