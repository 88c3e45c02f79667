"""Results as pandas and xarray objects, and as tables in notebooks."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import fields
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

AXES = ("x", "y", "z")


def columns_of(result: Any) -> dict[str, np.ndarray]:
    """Returns every array with one row per sample: fields of the result, and entries of its mappings."""
    rows = len(result.t)
    found: dict[str, np.ndarray] = {}
    for field in fields(result):
        value = getattr(result, field.name)
        if isinstance(value, np.ndarray) and value.ndim in (1, 2) and len(value) == rows:
            found[field.name] = value
        elif isinstance(value, Mapping) and field.name == "torques":
            found |= {f"torques.{name}": column for name, column in value.items() if len(column) == rows}
    return found


def part_names(column: np.ndarray, name: str) -> list[str]:
    """Returns the names of a column's parts: x, y, z for vectors in base axes, numbers for joints."""
    width = column.shape[1]
    is_vector = width == 3 and name.endswith(("_m", "_n", "_m_per_s", "_n_per_m", "_n_s_per_m", "_m_per_s2"))
    return list(AXES) if is_vector else [str(joint) for joint in range(width)]


def to_pandas(result: Any) -> pd.DataFrame:
    """Returns one row per sample, indexed by ``t``; parts of a column are named ``q.0`` or ``tip_position_m.x``."""
    import pandas as pd

    flat: dict[str, np.ndarray] = {}
    for name, column in columns_of(result).items():
        if name == "t":
            continue
        if column.ndim == 1:
            flat[name] = column
        else:
            for part, values in zip(part_names(column, name), column.T, strict=True):
                flat[f"{name}.{part}"] = values
    return pd.DataFrame(flat, index=pd.Index(result.t, name="t"))


def to_xarray(result: Any) -> xr.Dataset:
    """Returns one variable per column, over ``t`` and ``joint`` or ``axis``."""
    import xarray as xr

    variables: dict[str, Any] = {}
    joints = 0
    for name, column in columns_of(result).items():
        if name == "t":
            continue
        if column.ndim == 1:
            variables[name] = ("t", column)
        elif part_names(column, name) == list(AXES):
            variables[name] = (("t", "axis"), column)
        else:
            joints = column.shape[1]
            variables[name] = (("t", "joint"), column)
    coordinates: dict[str, Any] = {"t": result.t}
    if any("axis" in dims for dims, _ in variables.values()):
        coordinates["axis"] = list(AXES)
    if joints:
        coordinates["joint"] = np.arange(joints)
    return xr.Dataset(variables, coordinates)


class Tabular:
    """Mixin of results with one row per sample and the times in ``t``."""

    def to_pandas(self) -> pd.DataFrame:
        """The samples as a pandas data frame, indexed by ``t`` (s).

        Columns of several numbers are split: ``q.0`` for joints, ``tip_position_m.x`` for base axes. Needs
        pandas.
        """
        return to_pandas(self)

    def to_xarray(self) -> xr.Dataset:
        """The samples as an xarray data set over ``t``, ``joint`` and ``axis``. Needs xarray."""
        return to_xarray(self)

    def _repr_html_(self) -> str:
        columns = columns_of(self)
        rows = [(name, shape(column), text_range(column)) for name, column in columns.items()]
        return table(repr(self), ("column", "shape", "range"), rows)


def shape(column: np.ndarray) -> str:
    """Returns a column's shape as text."""
    return " x ".join(str(size) for size in column.shape)


def text_range(column: np.ndarray) -> str:
    """Returns the least and greatest value as text; for a column of names, the distinct names."""
    if column.dtype.kind in "US":
        return ", ".join(dict.fromkeys(column.tolist()))
    if column.size == 0:
        return ""
    if column.dtype == np.bool_:
        return f"{int(column.sum())} of {column.size}"
    return f"{np.nanmin(column):.4g} .. {np.nanmax(column):.4g}"


def table(caption: str, head: Iterable[str], rows: Iterable[Iterable[object]]) -> str:
    """Returns an HTML table."""
    cells = "".join(f"<th>{escape(str(cell))}</th>" for cell in head)
    body = "".join(
        "<tr>" + "".join(f"<td>{escape(str(cell))}</td>" for cell in row) + "</tr>" for row in rows
    )
    return f"<table><caption>{escape(caption)}</caption><tr>{cells}</tr>{body}</table>"
