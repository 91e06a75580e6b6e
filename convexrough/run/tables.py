"""Reading of text files, and of the file of asperities that a scene file names."""

from __future__ import annotations

from io import BytesIO, TextIOWrapper
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from convexrough.arrays import Array
from convexrough.errors import FileError, InputError, blamed_on
from convexrough.scene.asperities import Asperities
from convexrough.tabular.arrays import reading
from convexrough.tabular.table import AS_IT_IS, INDEX, Reading, read_table
from convexrough.tabular.text import bare
from convexrough.tabular.units import parsed

#: Names of columns with results, which are ignored in a table of asperities.
RESULTS = ("load", "contact_radius", "gap", "load_error", "force", "pressure", "area", "contact")

#: Relative rounding error that is allowed for means and sums in the last row of a table.
ROUNDED = 1e-3


def read_text(path: Path, most: int) -> str:
    """The text of a UTF-8 file of at most `most` bytes, with or without a byte-order mark."""
    with reading(path), path.open("rb") as file:
        contents = file.read(most + 1)
        if len(contents) > most:
            raise FileError(f"{path}: more than {most / 2**20:g} MiB")
        return TextIOWrapper(BytesIO(contents), encoding="utf-8-sig").read()


def unknown(column: str) -> bool:
    """True if a column with this header (not a number, its name without one) may be heights."""
    return not column.isdecimal() and bare(column).lower() not in (*INDEX, *RESULTS)


def read_summits(
    path: Path, *, tip_radius: ArrayLike | None, how: Reading = AS_IT_IS
) -> Asperities:
    """Asperities from the columns x and y of a file, and height (or z) and tip_radius if present.

    tip_radius : [length] one number or (n,), if the file has no column tip_radius; else None
    """
    table = read_table(
        path,
        required=("x", "y"),
        optional=("height", "tip_radius"),
        how=how,
    )
    columns = table.columns
    unread = [it for it, cells in table.others.items() if cells.dtype.kind == "f" and unknown(it)]
    if "height" not in columns and unread:
        named = 'columns = {height = "' + unread[0] + '"} in [asperities], or no such column'
        raise InputError("columns", found=f"{', '.join(unread)}, but no height",
                         expected=f"a column height; {named}", where=str(path))  # fmt: skip
    for name, said in table.units.items():
        if parsed(said) and not how.units.length:
            expected = f'[units] length in the scene file, as "{said}"'
            raise InputError(f"column {name}", found=f"{said}, and a scene without units",
                             expected=expected, where=str(path))  # fmt: skip
    for name, cells in table.others.items():
        if bare(name).lower() in INDEX and is_permuted(cells):
            found = f"{cells[0]:g}, {cells[1]:g}, ..."
            expected = "the rows in increasing order, or no such column"
            raise InputError(f"column {name}", found=found, expected=expected, where=str(path))
    if what := _summary_in_last_row([*columns.values()]):
        raise InputError(table.rows[-1], found=f"the {what} of the other rows",
                         expected="an asperity: remove this row", where=str(path))  # fmt: skip
    given = columns.get("tip_radius")
    if (given is None) == (tip_radius is None):
        found = "neither" if given is None else "both"
        expected = "either a column tip_radius or the key tip_radius in the scene file"
        raise InputError("tip radii", found=found, expected=expected, where=str(path))
    positions = np.column_stack((columns["x"], columns["y"]))
    radii = tip_radius if given is None else given
    assert radii is not None  # one of the two
    with blamed_on(f"{path} ({table.rows[0]} holds asperity 0)"):
        return Asperities(positions, radii, columns.get("height", 0.0))


def _summary_in_last_row(columns: list[Array]) -> str:
    """ "means" or "sums" if the last row has those of the rows above in all columns; else ""."""
    if (
        len(columns[0]) < 4
        or any(np.ptp(each[:-1]) == 0 for each in columns[2:])
        or not columns[2:]
    ):
        return ""  # the middle of a regular array is its mean
    for what, of in (("means", np.mean), ("sums", np.sum)):
        if all(abs(each[-1] - of(each[:-1])) <= ROUNDED * np.ptp(each[:-1]) for each in columns):
            return what
    return ""


def is_permuted(cells: NDArray[Any]) -> bool:
    """True if the cells are the numbers 0, 1, ... or 1, 2, ... in another order."""
    if cells.dtype.kind != "f" or len(cells) < 2:
        return False
    ordered = np.sort(cells)
    counts = ordered[0] in (0, 1) and (np.diff(ordered) == 1).all()
    return bool(counts and (ordered != cells).any())
