"""Columns of tables, found by their names as the reader of tables finds them."""

from __future__ import annotations

import importlib
import json
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeGuard, Union

import numpy as np
import numpy.typing as npt

import wheatstone._wheatstone as _w
from ._arguments import unit_name
from ._arrays import FloatArray, Table, doubles, is_table, library_of, pyarrow_for
from .errors import ArgumentError, MalformedError

Columns = Union[Mapping[str, str], Sequence[str], str]

PIXELS = ("x1", "y1", "x2", "y2")

_AXIS = re.compile(r"(?<![a-z])[uvxyz](?![a-z])|^[uvxy][a-hlr]$", re.IGNORECASE)
"""An axis in the name of a column: x1, u_left, X [mm], xa."""

_PLACE = re.compile(r"[XYZ]( *[\[(].*|_[a-z]{1,2})?|board_[xy].*")
"""A coordinate of a place, with its unit or without: X, X [mm], X_mm, board_x."""

_PIXEL_NAMES = "x1, y1, x2, y2, ... (or say by `columns=` which is which)"

_NO_NAME = re.compile(r"(column_?)?\d+")
"""What libraries call columns that were given no name: 0, 1, ...; column_0, column_1, ..."""


def column_names(columns: Columns | None) -> str | None:
    """What the table reader takes: ``x1=u_left,...``, or all names in order."""
    if columns is None or isinstance(columns, str):
        return columns
    if isinstance(columns, Mapping):
        return ",".join(f"{name}={column}" for name, column in columns.items())
    return ",".join(columns)


def reading(
    unit: str | None,
    columns: Columns | None,
    drop_duplicates: bool = False,
    whole_pixels: bool = False,
    follow: bool = False,
) -> str:
    """How the extension module reads a table."""
    return json.dumps(
        {
            "unit": unit_name(unit),
            "columns": column_names(columns),
            "drop_duplicates": drop_duplicates,
            "whole_pixels": whole_pixels,
            "follow": follow,
        }
    )


class _Frame:
    """The columns of a table of any library, in order."""

    def __init__(self, table: Table) -> None:
        given: Any = table
        self.metadata: Any = None
        self.library = library_of(table)
        self.labels: list[object]
        self._column: Callable[[int], Any]
        if isinstance(table, Mapping):
            self.labels = list(table)
            self._column = list(table.values()).__getitem__
        elif self.library == "pandas":
            self.labels = list(given.columns)
            self._column = lambda index: _of_pandas(given.iloc[:, index])
        elif self.library == "polars":
            self.labels = list(given.columns)
            self._column = given.to_series
        else:
            whole = pyarrow_for(self.library).table(given)
            self.labels, self.metadata = list(whole.schema.names), whole.schema.metadata
            self._column = whole.column

    @property
    def names(self) -> list[str]:
        return [str(label) for label in self.labels]

    def rows(self, columns: Sequence[int]) -> FloatArray:
        """These columns as an array, (n, columns)."""
        found = [self._numbers(column) for column in columns]
        if len({column.shape for column in found}) != 1 or found[0].ndim != 1:
            shapes = ", ".join(str(column.shape) for column in found)
            raise ArgumentError(f"the columns have shapes {shapes}", hint="give columns of one length")
        stacked: Any = np.stack(found)
        rows: FloatArray = stacked.T
        return rows

    def values(self, index: int) -> Any:
        """A column as it is."""
        column = self._column(index)
        return column.to_numpy() if hasattr(column, "to_numpy") else column

    def _numbers(self, index: int) -> FloatArray:
        return doubles(self.values(index), f"column `{self.labels[index]}`")

    def like(self, names: Sequence[str], values: FloatArray) -> Any:
        """A table with these names that says as much of its unit."""
        columns: list[FloatArray] = [np.ascontiguousarray(values[:, index]) for index in range(len(names))]
        if self.library == "polars":
            return importlib.import_module("polars").DataFrame(dict(zip(names, columns)))
        pa = pyarrow_for(self.library)
        made = pa.Table.from_arrays([pa.array(column) for column in columns], list(names))
        return made.replace_schema_metadata(self.metadata)


def _of_pandas(column: Any) -> Any:
    """Its values; what is missing is NaN in columns of objects and of nullable types, too."""
    if column.dtype.kind in "fiub" and isinstance(column.dtype, np.dtype):
        return column.to_numpy()
    return column.to_numpy(dtype=object, na_value=np.nan)


def has_names(value: object) -> TypeGuard[Table]:
    """Whether it is a table, and not one column of one."""
    is_column = hasattr(type(value), "type") if library_of(value) == "pyarrow" else hasattr(type(value), "dtype")
    return is_table(value) and not is_column


def _by_position(frame: _Frame, table: Table) -> bool:
    """Whether no column was given a name."""
    return not isinstance(table, Mapping) and all(_NO_NAME.fullmatch(name) for name in frame.names)


def _refuse_unknown(frame: _Frame, wanted: str) -> None:
    """Refuses names of which none says what its column holds: their order may be any."""
    if not any(_AXIS.search(name) for name in frame.names):
        raise ArgumentError(
            f"the names of the columns do not say what they hold: {', '.join(frame.names)}",
            hint=f"rename the columns to {wanted}, or give an array in that order: `table.to_numpy()`",
        )


def _own(names: Sequence[str], wanted: Sequence[str], alike: Callable[[str], object]) -> list[int] | None:
    """The columns that have our own names, where these are all that are like them: the reader need not be asked."""
    if sorted(filter(alike, names)) != sorted(wanted):
        return None
    return [names.index(name) for name in wanted]


def _probe(frame: _Frame, names: list[str], settings: str) -> _w.Dataset:
    """What the reader makes of a row of ones, and of one where each column holds its own number."""
    values = np.stack([np.ones(len(names)), np.arange(len(names), dtype=np.float64)])
    return _w.Dataset.of_table(frame.like(names, values), settings)


def pixels_of_table(table: Table, cameras: int | None, columns: Columns | None) -> FloatArray | None:
    """Matched pixels (n, 2 * cameras), a row each, of so many cameras or all that are named; None where no column has a
    name. Names that say nothing are refused."""
    frame = _Frame(table)
    if columns is None:
        if _by_position(frame, table):
            return None
        _refuse_unknown(frame, _PIXEL_NAMES)
    return frame.rows(_pixel_columns(frame, cameras, columns))


def pixels_and_views(table: Table, columns: Columns | None) -> tuple[FloatArray, npt.NDArray[Any] | None]:
    """Matched pixels (n, 2 * cameras) of a table whose points are given beside it, and the labels of its views."""
    frame = _Frame(table)
    places = [name for name in frame.names if _PLACE.fullmatch(name)]
    if places:
        raise ArgumentError(
            f"points are given twice, for the table has {', '.join(places)}",
            hint="give the table alone, or leave these columns out of it",
        )
    if columns is None and _by_position(frame, table):
        return frame.rows(range(len(frame.labels))), None
    if columns is None:
        _refuse_unknown(frame, _PIXEL_NAMES)
    views = np.asarray(frame.values(frame.names.index("view"))) if "view" in frame.names else None
    return frame.rows(_pixel_columns(frame, None, columns)), views


def in_order_of_cameras(table: Any) -> Any:
    """A DataFrame's or pyarrow table's columns x1, y1, x2, y2, ...; the whole table where its names do not say which."""
    frame = _Frame(table)
    if not any(_AXIS.search(name) for name in frame.names):
        return table
    try:
        found = _pixel_columns(frame, None, None)
    except MalformedError:
        return table
    if frame.library == "pandas":
        return table.iloc[:, found]
    return table.select([frame.names[column] for column in found]) if hasattr(table, "select") else table


def _pixel_columns(frame: _Frame, cameras: int | None, columns: Columns | None) -> list[int]:
    """The columns of x1, y1, x2, y2, ..., of so many cameras or all that are named."""
    if cameras is None:
        cameras = len([name for name in frame.names if re.fullmatch(r"x\d+", name)])
    ours = [f"{axis}{camera}" for camera in range(1, cameras + 1) for axis in "xy"]
    own = _own(frame.names, ours, re.compile(r"[xy]\d+").fullmatch)
    if columns is None and own:
        return own
    found = _probe(frame, frame.names, reading(None, columns))
    return [int(column) for column in found.pixels()[1]]


def pixels_of_camera(table: Table, camera: int) -> FloatArray:
    """Pixels of one camera (n, 2), a row each: of its own columns, or of those of the only camera that is named."""
    frame = _Frame(table)
    for x, y in ((f"x{camera + 1}", f"y{camera + 1}"), ("x1", "y1"), ("x", "y"), ("u", "v")):
        if x in frame.names and y in frame.names:
            return frame.rows([frame.names.index(x), frame.names.index(y)])
    if len(frame.labels) != 2 or not _by_position(frame, table):
        raise ArgumentError(
            f"no columns `x{camera + 1}`, `y{camera + 1}`; found: {', '.join(frame.names)}",
            hint="give a table with these columns, or an array, (n, 2)",
        )
    return frame.rows([0, 1])


def places_of_table(table: Table, unit: str) -> FloatArray | None:
    """X, Y, Z (n, 3) in `unit`, a row each; None where no column has a name. Names that say nothing are refused."""
    frame = _Frame(table)
    if _by_position(frame, table):
        return None
    _refuse_unknown(frame, "X, Y, Z")
    own = _own(frame.names, "XYZ", "XYZ".__contains__)
    if frame.metadata is None and own is not None:
        return frame.rows(own)
    # The reader takes no table without pixels.
    names = [*frame.names, *(name for name in PIXELS if name not in frame.names)]
    try:
        found = _probe(frame, names, reading(unit, None)).points()
    except MalformedError as problem:
        told = str(problem.args[0]).replace(", ".join(names), ", ".join(frame.names))
        raise MalformedError(told, hint=problem.hint, code=problem.code) from None
    if np.isnan(found).any():
        raise ArgumentError(
            f"no column `X`, `Y`, `Z`; found: {', '.join(frame.names)}",
            hint="give a table with these columns, or an array, (n, 3)",
        )
    factor = found[0, 0]
    places: FloatArray = factor * frame.rows([round(column / factor) for column in found[1]])
    return places


def board_of_table(table: Table) -> FloatArray:
    """board_x, board_y (n, 2), a row each; columns without any name by position."""
    frame = _Frame(table)
    if _by_position(frame, table):
        return frame.rows(range(len(frame.labels)))
    if not {"board_x", "board_y"} <= set(frame.names):
        raise ArgumentError(
            f"no columns `board_x`, `board_y`; found: {', '.join(frame.names)}",
            hint="give a table with these columns, or an array, (n, 2)",
        )
    return frame.rows([frame.names.index("board_x"), frame.names.index("board_y")])


def in_unit(places: FloatArray, own: str, unit: str) -> FloatArray:
    """Places that are in a unit of their own, in another one."""
    if own == unit:
        return places
    axes = {f"{axis} [{own}]": places[:, column] for column, axis in enumerate("XYZ")}
    found = places_of_table(axes, unit)
    return places if found is None else found
