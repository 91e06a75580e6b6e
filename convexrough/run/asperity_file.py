"""Files of asperities, which the table [asperities] of a scene file names."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from convexrough import checks
from convexrough.errors import InputError, blamed_on
from convexrough.progress import LOGGER, NOTE
from convexrough.scene.asperities import Asperities
from convexrough.tabular.roles import AS_IT_IS, Reading, columns_key, is_index, shortened
from convexrough.tabular.table import read_table, summary_in_last
from convexrough.tabular.units import bare, parsed

#: Names of columns with results, which are ignored in a table of asperities.
RESULTS = ("load", "contact_radius", "mean_pressure", "gap", "load_error", "force", "pressure",
           "area", "contact")  # fmt: skip

#: Largest number of columns that a message names.
MOST_NAMED = 5


def read_summits(
    path: Path, *, tip_radius: ArrayLike | None, how: Reading = AS_IT_IS
) -> Asperities:
    """The asperities in a file with columns x and y, and perhaps height (or z) and tip_radius.

    tip_radius : [length] one number or (n,); None if the file has a column tip_radius

    Raises FileError, or InputError with the column or row, if the table is wrong.
    """
    table = read_table(path, required=("x", "y"), optional=("height", "tip_radius"), how=how)
    columns = table.columns
    unread = [
        shortened(name)
        for name, cells in table.others.items()
        if cells.dtype.kind == "f"
        and not (name.isdecimal() or is_index(name) or bare(name).lower() in RESULTS)
    ]
    some = ", ".join(unread[:MOST_NAMED]) + ", ..." * (len(unread) > MOST_NAMED)
    if "height" not in columns and unread:  # one of them may contain heights
        named = f"; {columns_key(how.columns, ['height'])}, or no such column"
        if "depth" in unread[0].lower():
            named = ", which grows towards the sphere: write depths as negative heights"
        raise InputError("columns", found=f"{some}, but no height",
                         expected=f"a column height{named}", where=str(path))  # fmt: skip
    for name, said in table.units.items():
        if parsed(said) and not how.units.length:
            expected = f'[units] length in the scene file, as "{said}"'
            raise InputError(f"column {name}", found=f"{said}, and a scene without units",
                             expected=expected, where=str(path))  # fmt: skip
    for name, cells in table.others.items():
        if is_index(name) and checks.is_permuted(cells):
            found = f"{cells[0]:g}, {cells[1]:g}, ..."
            expected = "the rows in increasing order, or no such column"
            raise InputError(f"column {name}", found=found, expected=expected, where=str(path))
    own = [*columns.values()][2:]  # without, it may be the asperity in the middle of an array
    regular = len(table.rows) < 4 or not own or any(np.ptp(each[:-1]) == 0 for each in own)
    if what := "" if regular else summary_in_last(np.column_stack([*columns.values()])):
        raise InputError(table.rows[-1], found=f"the {what} of the other rows",
                         expected="an asperity: remove this row", where=str(path))  # fmt: skip
    given = columns.get("tip_radius")
    if (given is None) == (tip_radius is None):
        found = "neither" if given is None else "both"
        expected = "either a column tip_radius or the key tip_radius in the scene file"
        if given is None and unread:
            key = columns_key(how.columns, ["tip_radius"])
            expected += f"; not used: {some}; {key} names radii (half of diameters)"
        raise InputError("tip radii", found=found, expected=expected, where=str(path))
    positions = np.column_stack((columns["x"], columns["y"]))
    radii = tip_radius if given is None else given
    assert radii is not None  # one of the two is given
    notes = [table.style] if '" of ' in table.style else []  # one of several sheets
    if unread and "elliptic_load" not in unread:  # a column of summits.csv
        notes.append(f"not used: {some}")
    if table.comments:
        notes.append(f"comments not used: {shortened(' '.join(table.comments))}")
    if notes:
        LOGGER.log(NOTE, f"{path}: {', '.join(notes)}")
    with blamed_on(f"{path} ({table.rows[0]} holds asperity 0)"):
        return Asperities(positions, radii, columns.get("height", 0.0))
