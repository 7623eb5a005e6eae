"""What is taken for data: arrays, tables of any library, files and a `Dataset`, given alone or pixels beside points."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Union

import numpy.typing as npt

import wheatstone._wheatstone as _w
from ._arrays import FloatArray, Numbers, PathLike, Table, arrow_table, is_path, pixels_array, places_array
from ._named import (
    Columns,
    has_names,
    in_unit,
    pixels_and_views,
    pixels_of_table,
    places_of_table,
    reading,
)
from .caliscope import is_caliscope, read_caliscope
from .data import Dataset, Progress, read
from .errors import ArgumentError

Data = Union[Dataset, Table, PathLike, npt.ArrayLike]
"""What is taken for data: a `Dataset`, arrays, a table of any library, or a path."""


def has_own_places(pixels: object) -> bool:
    """Whether places and their unit may be told by the data themselves: a `Dataset`, a table or a file."""
    return isinstance(pixels, Dataset) or is_path(pixels) or has_names(pixels)


def as_dataset(
    pixels: Data,
    points: npt.ArrayLike | None = None,
    *,
    board: npt.ArrayLike | None = None,
    views: Sequence[object] | npt.NDArray[Any] | None = None,
    unit: str | None = None,
    columns: Columns | None = None,
    drop_duplicates: bool = False,
    progress: Progress | None = None,
) -> Dataset:
    """Data of any kind."""
    if (points is not None or board is not None) and has_names(pixels) and not is_caliscope(pixels):
        pixels, own_views = pixels_and_views(pixels, columns)
        views = own_views if views is None else views
    arrays = (points, board, views)
    if has_own_places(pixels):
        if any(value is not None for value in arrays):
            raise ArgumentError(
                "points, board and views go with pixels alone",
                hint="give them as columns of the table: X, Y, Z, board_x, board_y, view",
            )
        if isinstance(pixels, Dataset):
            if unit is not None and unit != pixels.unit:
                raise ArgumentError(
                    f"unit is {unit}, and the data are in {pixels.unit}",
                    hint="leave unit out: a Dataset has its own",
                )
            return pixels
        if is_path(pixels):
            return read(
                pixels,
                unit=unit,
                columns=columns,
                drop_duplicates=drop_duplicates,
                progress=progress,
            )
        table: Any = pixels
        if is_caliscope(table):
            return read_caliscope(table, unit=unit or "m")
        settings = reading(unit, columns, drop_duplicates)
        return Dataset(_w.Dataset.of_table(arrow_table(table), settings))
    if points is not None and board is not None:
        raise ArgumentError(
            "points and board are both given",
            hint="give points of charts whose poses are known, or board of those whose poses are to be estimated; "
            "`Dataset.from_arrays` takes both, NaN in one of them a row",
        )
    given: Any = pixels
    return Dataset.from_arrays(
        given, points, board=board, views=views, unit=unit or "mm", drop_duplicates=drop_duplicates
    )


def pixels_of(pixels: Data, cameras: int, columns: Columns | None) -> Numbers:
    """Matched pixels of data of any kind, (n, 2 * cameras), a row each."""
    found: Numbers | None = None
    if isinstance(pixels, Dataset) or is_path(pixels) or is_caliscope(pixels):
        found = as_dataset(pixels, columns=columns).pixels
    elif has_names(pixels):
        found = pixels_of_table(pixels, cameras, columns)
    return pixels_array(pixels, cameras) if found is None else found


def places_of(points: Data, unit: str) -> FloatArray:
    """Places of data of any kind, (n, 3) in `unit`, a row each."""
    found: FloatArray | None = None
    if isinstance(points, Dataset):
        found = in_unit(points.points, points.unit, unit)
    elif is_path(points):
        found = as_dataset(points, unit=unit).points
    elif has_names(points):
        found = places_of_table(points, unit)
    return places_array(points, "points", 3, None) if found is None else found
