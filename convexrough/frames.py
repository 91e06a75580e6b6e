"""Named arrays as a pandas data frame or an xarray data set."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from convexrough.errors import needed

if TYPE_CHECKING:
    import pandas
    import xarray

#: By name: the dimensions of an array, and the array. Those of the first are the rows of a frame.
Variables: TypeAlias = dict[str, tuple[tuple[str, ...], NDArray[Any]]]

#: For a dimension: the names of the components of a vector, or of the sides of a point of a path.
NAMED = {"direction": ["x", "y"], "side": ["below", "above"]}


def dataframe(variables: Variables, attributes: dict[str, Any]) -> pandas.DataFrame:
    """A data frame of the arrays with the dimensions (rows) or (rows, direction)."""
    rows, _ = next(iter(variables.values()))
    columns: dict[str, NDArray[Any]] = {}
    for name, (along, values) in variables.items():
        if along == rows:
            columns[name] = values
        elif along == (*rows, "direction"):
            columns |= {f"{name}_x": values[:, 0], f"{name}_y": values[:, 1]}
    frame: pandas.DataFrame = needed("pandas").DataFrame(columns, copy=True)
    frame.index.name = rows[0]
    frame.attrs.update(attributes)
    return frame


def of_rows(columns: Mapping[str, NDArray[Any]], **attributes: Any) -> pandas.DataFrame:
    """A data frame of columns with equal lengths."""
    return dataframe({name: (("row",), it) for name, it in columns.items()}, attributes)


def dataset(variables: Variables, attributes: dict[str, Any]) -> xarray.Dataset:
    """A data set with writable copies of all arrays."""
    arrays = {name: (along, np.array(values)) for name, (along, values) in variables.items()}
    known = {"x", "y", "asperity"} & set(arrays)
    used = {dimension for along, _ in arrays.values() for dimension in along}
    named = {dimension: names for dimension, names in NAMED.items() if dimension in used}
    dataset: xarray.Dataset = needed("xarray").Dataset(arrays, named, attributes)
    return dataset.set_coords(sorted(known))
