"""`Plan`: the scenes of a sweep, the columns of its table, and the size of its parts."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from convexrough.errors import InputError
from convexrough.sweeps.batch import VERSIONS, Batch
from convexrough.sweeps.measures import FAILURES, Column, Stages, chosen, unit
from convexrough.sweeps.scenes import Source, Tables
from convexrough.tabular.units import UnitNames
from convexrough.version import __version__

#: Largest number of scenes in a batch; about the largest number of asperities in one; and least
#: number of batches, if there are enough scenes.
MOST_SCENES, MOST_ASPERITIES, LEAST_BATCHES = 1000, 100_000, 32

#: At most this many scenes are computed in order to find out which numbers can be measured.
TRIED = 5


@dataclass(frozen=True)
class Plan:
    """The computation of a sweep.

    size     : number of scenes in a batch or part;  manifest : the contents of manifest.json
    """

    source: Source
    columns: tuple[Column, ...]
    size: int
    manifest: Mapping[str, Any]

    @property
    def parts(self) -> int:
        """The number of parts."""
        return -(-self.source.count // self.size)

    def part(self, number: int) -> range:
        first = number * self.size
        return range(first, min(first + self.size, self.source.count))

    def batch(self, part: range) -> Batch:
        return Batch(self.source.part(part), self.columns, part)


def planned(
    source: Source,
    measures: Sequence[str],
    said: Mapping[str, Any],
    units: UnitNames,
    **given: Any,
) -> Plan:
    """The plan for the scenes of `source`; the first that is solved shows which numbers exist.

    said  : entries of the manifest that describe the origin of the sweep
    given : all input on which the numbers depend, except `measures` and the version

    Raises InputError for an unknown measure, and the error of the first five scenes if all fail.
    """
    ask = source.part(range(tried := min(source.count, TRIED))).opened()
    for number in range(tried):
        try:
            asked = ask(number)
            contact = asked.press()
            columns = chosen(contact, asked.stages, measures)
            break
        except FAILURES as error:
            if number == tried - 1:
                if isinstance(error, InputError) and not error.where:
                    raise error.within(str(said["source"])) from error
                raise
    few = -(-source.count // LEAST_BATCHES)
    size = max(1, min(MOST_SCENES, MOST_ASPERITIES // len(contact.scene), few))
    contents = {"version": __version__, "measure": list(measures), **given}
    text = json.dumps(contents, sort_keys=True, default=repr)
    grid = source.grid if isinstance(source, Tables) else None
    labels = list(source.labels(range(0)))
    numbers = {key: key for key in labels} | {it.name: it.number for it in columns}
    used = {"normal", *(column.stage for column in columns)}
    manifest = {
        "schema": 2,
        "version": __version__,
        "sweep": hashlib.sha256(text.encode()).hexdigest(),  # of all that numbers depend on
        "scenes": source.count,
        "each": 1 if grid is None else grid.each,  # scenes that differ only in the seed
        "batch": size,
        "columns": ["scene", *labels, "status", "message", *(it.name for it in columns)],
        "drawn": [] if grid is None else [draw.key for draw in grid.draws],
        "not_measured": [name for name in asked.stages if name not in used],
        "own_loads": _own_loads(asked.stages, used, labels) if grid else [],
        "units": {name: it for name, end in numbers.items() if (it := unit(end, units))},
        **said,
        "versions": VERSIONS,
    }
    return Plan(source, columns, size, manifest)


def _own_loads(stages: Stages, used: set[str], swept: list[str]) -> list[str]:
    """The measured tables whose loads stay as they are in a sweep over the load of [normal]."""
    if not {"normal.load", "normal.approach"} & {*swept}:
        return []
    own = [name for name, stage in stages.items() if name in used and stage.highest_load]
    return [name for name in own if not any(key.startswith(f"{name}.") for key in swept)]
