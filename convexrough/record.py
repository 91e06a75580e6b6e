"""Base classes of results, which print a summary, convert to tables, and can be pickled."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, ClassVar, NoReturn, TypeAlias

import numpy as np
from numpy.typing import NDArray

from convexrough.errors import InputError, needed

if TYPE_CHECKING:
    import pandas
    import xarray

#: For names of dimensions: the attributes whose arrays have these dimensions.
Along: TypeAlias = dict[tuple[str, ...], tuple[str, ...]]

#: By name: the dimensions of an array, and the array. Those of the first are the rows of a frame.
Variables: TypeAlias = dict[str, tuple[tuple[str, ...], NDArray[Any]]]

#: For a dimension: the names of the components of a vector, or of the sides of a point of a path.
NAMED = {"direction": ["x", "y"], "side": ["below", "above"]}

#: Names that `singular` leaves in the plural: counts and times.
COUNTS = ("seconds", "iterations", "presses", "summits", "contacts")

#: Arrays of at most FEW numbers and texts of at most LINE characters are printed in full.
FEW, LINE = 4, 76


@dataclass(frozen=True, eq=False, repr=False)
class Record:
    """Base class of results. `repr` gives a line for each field that is not empty."""

    #: Names of properties that are printed before the fields.
    _shown: ClassVar[tuple[str, ...]] = ()

    def __repr__(self) -> str:
        rows = list(self._rows())
        width = max(len(name) for name, _ in rows)
        return "\n".join((type(self).__name__, *(f"  {name:{width}}  {it}" for name, it in rows)))

    def _repr_html_(self) -> str:
        from html import escape  # only in a notebook

        rows = "".join(
            f"<tr><th style='text-align:left'>{escape(name)}</th>"
            f"<td style='text-align:left'>{escape(it)}</td></tr>"
            for name, it in self._rows()
        )
        table = f"<table><caption>{type(self).__name__}</caption>{rows}</table>"
        picture = self._picture() if hasattr(self, "_picture") else ""  # of `Plottable`
        style = "display:flex;flex-wrap:wrap;align-items:start;gap:1em"
        return f"<div style='{style}'>{table}{picture}</div>"

    def __getstate__(self) -> dict[str, Any]:
        """The fields by name, without results that are cached on the object."""
        return {each.name: getattr(self, each.name) for each in fields(self)}

    def __setstate__(self, state: dict[str, Any]) -> None:
        for value in state.values():
            if isinstance(value, np.ndarray):
                value.flags.writeable = False  # pickles do not store this flag
        self.__dict__.update(state)

    def _rows(self) -> Iterator[tuple[str, str]]:
        for name in (*self._shown, *(each.name for each in fields(self) if each.repr)):
            if text := in_text(getattr(self, name)):  # empty values are left out
                yield name, text
        scene = getattr(getattr(self, "contact", self), "scene", None)
        if units := str(getattr(scene, "units", "")):
            yield "units", units
        scenes = getattr(getattr(self, "contacts", self), "scenes", ())
        if len(scenes) <= 100:  # the warnings of more scenes take seconds
            yield from (("warning", in_text(each)) for each in self.warnings)

    @property
    def warnings(self) -> tuple[str, ...]:
        """Reasons to doubt the result, as sentences: those of its `contact` or `contacts`."""
        pressed = getattr(self, "contact", None) or getattr(self, "contacts", None)
        return getattr(pressed, "warnings", ())

    def _headline(self) -> str:
        parts = [str(getattr(self, name)) for name in ("scope", "solver") if hasattr(self, name)]
        if hasattr(self, "status"):
            parts.append(in_text(self.status))
        if hasattr(self, "__len__"):
            parts.append(f"{len(self):,} asperities")
        return f"{type(self).__name__}: {'; '.join(parts)}" if parts else type(self).__name__


class Table(Record):
    """A result with arrays that have an entry for each asperity, step or point.

    Columns of data frames and files are named in the singular: `load` for `loads`.

    >>> list(contact.columns("loads", "gaps"))
    ['load', 'gap']
    >>> contact.to_dataframe()["load"].gt(0).sum(), contact.to_xarray()["load"].dims
    (np.int64(37), ('asperity',))
    """

    #: The names of arrays for each tuple of dimensions. The first dimension of the first key gives
    #: the rows of a data frame.
    _along: ClassVar[Along] = {}

    def columns(self, *names: str) -> dict[str, NDArray[Any]]:
        """The arrays with these names, or all columns, by their names in the singular.

        Raises InputError for other names.
        """
        wanted = names or next(iter(self._along.values()))
        valid = [name for some in self._along.values() for name in some]
        for name in {*wanted}.difference(valid):
            raise InputError("columns", found=repr(name), expected=f"some of {', '.join(valid)}")
        return {singular(name): getattr(self, name) for name in wanted}

    def to_dataframe(self) -> pandas.DataFrame:
        """A pandas data frame with a row for each asperity, step, point or solver.

        Columns are named in the singular; names of components of vectors end in _x and _y. Fields
        that are one number or text are in `attrs`. Other two-dimensional arrays, such as the forces
        of asperities at each step of a history, are only in `to_xarray`.

        Raises ExtraError if pandas is not installed.
        """
        variables = self._variables()
        rows, _ = next(iter(variables.values()))
        columns: dict[str, NDArray[Any]] = {}
        for name, (along, values) in variables.items():
            if along == rows:
                columns[name] = values
            elif along == (*rows, "direction"):
                columns |= {f"{name}_x": values[:, 0], f"{name}_y": values[:, 1]}
        frame = frame_of(columns, **self._attributes())
        frame.index.name = rows[0]
        return frame

    def to_xarray(self) -> xarray.Dataset:
        """An xarray data set of writable copies of all arrays, with named dimensions.

        Fields that are one number or text are in `attrs`. Raises ExtraError if xarray is not
        installed.
        """
        variables = self._variables()
        arrays = {name: (along, np.array(values)) for name, (along, values) in variables.items()}
        used = {dimension for along, _ in arrays.values() for dimension in along}
        named = {dimension: names for dimension, names in NAMED.items() if dimension in used}
        found: xarray.Dataset = needed("xarray").Dataset(arrays, named, self._attributes())
        return found.set_coords(sorted({"x", "y", "asperity"} & set(arrays)))

    def _variables(self) -> Variables:
        places: Variables = {}
        if (scene := getattr(getattr(self, "contact", self), "scene", None)) is not None:
            x, y = scene.asperities.positions.T
            places = {"x": (("asperity",), x), "y": (("asperity",), y)}
        taken = {name for names in self._along.values() for name in names}
        arrays = {}
        for along, names in self._along.items():
            for name in names:
                if getattr(self, name) is None:  # for example the forces of some gradients
                    continue
                one = singular(name)
                column = f"asperity_{one}" if one != name and one in taken else one
                arrays[column] = along, getattr(self, name)
        rows_first = next(iter(self._along)) == ("asperity",)
        return places | arrays if rows_first else arrays | places

    def _attributes(self) -> dict[str, Any]:
        """The fields whose value is one number or one text, by name, after the `_shown` ones."""
        values = {name: getattr(self, name) for name in self._shown} | self.__getstate__()
        return {name: it for name, it in values.items() if isinstance(it, (str, int, float))}


class Proved(Table):
    """Base class of certificates, which have no truth value: they do not judge the given values."""

    def __bool__(self) -> NoReturn:
        """Raise TypeError, so that `assert certify(...)` does not pass for wrong values."""
        raise TypeError(
            f"{type(self).__name__}: neither true nor false; `all_proved` is about statuses only, "
            "and `verify` judges loads"
        )


def frame_of(columns: Mapping[str, NDArray[Any]], /, **attributes: Any) -> pandas.DataFrame:
    """A data frame of columns with equal lengths."""
    frame: pandas.DataFrame = needed("pandas").DataFrame({**columns}, copy=True)
    frame.index.name = "row"
    frame.attrs.update(attributes)
    return frame


def rows_of(columns: Mapping[str, NDArray[Any]]) -> list[dict[str, Any]]:
    """For each row, its values as Python objects, by the names of the columns."""
    rows = zip(*(values.tolist() for values in columns.values()), strict=True)
    return [dict(zip(columns, row, strict=True)) for row in rows]


def singular(name: str) -> str:
    """The singular of a name: load for loads, radius for radii, loss for losses."""
    for ending, one in (("radii", "radius"), ("losses", "loss"), ("approaches", "approach"),
                        ("ities", "ity")):  # fmt: skip
        if name.endswith(ending):
            return name.removesuffix(ending) + one
    return name if name.endswith(("ss", "us")) or name in COUNTS else name.removesuffix("s")


def in_text(value: Any) -> str:
    """A value as text on one line. Long arrays are summarised by size and range, or by counts."""
    if isinstance(value, Record):
        return value._headline()
    if isinstance(value, np.ndarray):
        return _of_array(value)
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, tuple) and value and all(isinstance(each, Record) for each in value):
        return f"{len(value):,} of {type(value[0]).__name__}"
    text = ", ".join(map(str, value)) if isinstance(value, Mapping) else str(value)
    text = " ".join(text.split())
    return text if len(text) <= LINE else f"{text[: LINE - 3]}..."


def _of_array(values: NDArray[Any]) -> str:
    if values.size == 0:
        return "none"
    if values.dtype.kind == "U":
        counts = Counter(values.ravel().tolist())
        return ", ".join(f"{count:,} {status}" for status, count in counts.items())
    if values.dtype.kind == "b":
        return f"{np.count_nonzero(values):,} of {values.size:,}"
    if values.size <= FEW:
        return ", ".join(f"{value:.6g}" for value in values.ravel())
    size = " x ".join(f"{n:,}" for n in values.shape)
    if values.dtype.kind == "i":
        return f"{size} indices: {', '.join(map(str, values.ravel()[:FEW]))}, ..."
    low, high = np.fmin.reduce(values, axis=None), np.fmax.reduce(values, axis=None)
    return f"{size} from {low:.6g} to {high:.6g}"
