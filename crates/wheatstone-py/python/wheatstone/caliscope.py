"""Points as caliscope writes them: a row a camera and point."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from ._arrays import FloatArray, PathLike, Table, doubles, is_path, is_table, table_columns
from .data import Dataset
from .errors import ArgumentError, FileError, MalformedError, MissingFileError

__all__ = ["is_caliscope", "read_caliscope"]

CALISCOPE = ("sync_index", "cam_id", "keypoint_id", "img_loc_x", "img_loc_y")
_OPTIONAL = ("object_id", "board_loc_x", "board_loc_y")


def read_caliscope(table: Table | PathLike, *, unit: str = "m") -> Dataset:
    """Points in caliscope's columns, one row a camera and point.

    Parameters
    ----------
    table : DataFrame, pyarrow table, mapping of columns, or path of a CSV file
        With columns ``sync_index, cam_id, keypoint_id, img_loc_x, img_loc_y``, and where there are any ``object_id``,
        and ``board_loc_x, board_loc_y`` (formerly ``obj_loc_x, obj_loc_y``) of a board in the hand. Cameras take the
        order of their `cam_id`; a `sync_index` is a view.
    unit : str
        The unit of the places on the board; caliscope's is the metre.

    Returns
    -------
    Dataset
        One row for each `sync_index`, object and keypoint.

    Raises
    ------
    ArgumentError
        Where columns are missing or of different lengths, a row has no camera, view or point, or two rows of a point
        and camera contradict each other.
    MissingFileError, FileError, MalformedError
        For a file that cannot be read.
    """
    columns = _csv_columns(table) if is_path(table) else table_columns(table)
    old = {"port": "cam_id", "point_id": "keypoint_id"}
    old |= {"obj_loc_x": "board_loc_x", "obj_loc_y": "board_loc_y"}
    columns = {old.get(name, name): column for name, column in columns.items()}
    missing = [name for name in CALISCOPE if name not in columns]
    if missing:
        raise ArgumentError(
            f"there is no column {', '.join(missing)}", hint=f"caliscope's are {', '.join(CALISCOPE)}"
        )
    shapes = {name: column.shape for name, column in columns.items() if name in (*CALISCOPE, *_OPTIONAL)}
    count = len(np.ravel(columns["cam_id"]))
    if set(shapes.values()) != {(count,)}:
        told = ", ".join(f"{name} {shape}" for name, shape in shapes.items())
        raise ArgumentError(f"the columns have shapes {told}", hint="give columns of one length")
    columns.setdefault("object_id", np.zeros(count, dtype=np.int64))
    cameras, camera = _numbered(columns, "cam_id")
    views, view = _numbered(columns, "sync_index")
    things, thing = _numbered(columns, "object_id")
    keypoints, keypoint = _numbered(columns, "keypoint_id")
    keys, row = np.unique(np.stack([view, thing, keypoint], axis=1), axis=0, return_inverse=True)
    row = np.ravel(row)
    seen = _two_columns(columns, "img_loc_x", "img_loc_y")
    pixels = np.full((len(keys), len(cameras), 2), np.nan)
    pixels[row, camera] = seen
    twice = ~_is_same(pixels[row, camera], seen)
    board = None
    if "board_loc_x" in columns and "board_loc_y" in columns:
        places = _two_columns(columns, "board_loc_x", "board_loc_y")
        # Only some rows of a point may say where it is on the board.
        known = ~np.isnan(places).any(axis=1)
        board = np.full((len(keys), 2), np.nan)
        board[row[known]] = places[known]
        twice |= known & ~_is_same(board[row], places)
    if twice.any():
        first = int(np.argmax(twice))
        named = [name for name in ("sync_index", "cam_id", "object_id", "keypoint_id") if name in shapes]
        raise ArgumentError(
            f"another row contradicts that of {', '.join(f'{name} {columns[name][first]}' for name in named)}",
            hint="leave one row of each point and camera, and one place on the board for each point",
        )
    several = len(things) > 1
    names = [
        f"{things[k[1]]}:{keypoints[k[2]]}" if several else str(keypoints[k[2]]) for k in keys
    ]
    return Dataset.from_arrays(
        pixels, board=board, views=[views[k[0]] for k in keys], ids=names, unit=unit
    )


def _numbered(columns: Mapping[str, npt.NDArray[Any]], name: str) -> tuple[npt.NDArray[Any], npt.NDArray[np.intp]]:
    """The labels of a column in their order, and which of them each row has."""
    column = columns[name]
    missing = [row for row, label in enumerate(column.tolist()) if label is None or label != label]
    if missing:
        raise ArgumentError(f"row {missing[0]} has no {name}", hint="give every row one, or leave the row out")
    try:
        return np.unique(column, return_inverse=True)
    except TypeError:
        raise ArgumentError(f"{name} mixes numbers and names", hint="give one kind of them") from None


def _two_columns(columns: Mapping[str, npt.NDArray[Any]], x: str, y: str) -> FloatArray:
    pair = [doubles(columns[name], f"column `{name}`") for name in (x, y)]
    return np.stack(pair, axis=1)


def _is_same(left: FloatArray, right: FloatArray) -> npt.NDArray[np.bool_]:
    """(n,), whether two places are one; places that are not known are."""
    same: npt.NDArray[np.bool_] = ((left == right) | (np.isnan(left) & np.isnan(right))).all(axis=1)
    return same


def _csv_columns(path: Any) -> dict[str, npt.NDArray[Any]]:
    try:
        # Given a name, NumPy would read addresses of the web, too.
        with open(path, encoding="utf-8") as file:
            table = np.genfromtxt(file, delimiter=",", names=True, dtype=None, encoding="utf-8")
    except OSError as problem:
        kind = MissingFileError if isinstance(problem, FileNotFoundError) else FileError
        raise kind(
            f"cannot read `{path}`: {problem.strerror}", hint="check the spelling of the path", code="io"
        ) from None
    except (ValueError, IndexError) as problem:
        raise MalformedError(
            f"{path} is no table: {problem}", hint=f"caliscope's columns are {', '.join(CALISCOPE)}", code="malformed"
        ) from None
    names = table.dtype.names or ()
    return {name: np.atleast_1d(table[name]) for name in names}


def is_caliscope(table: object) -> bool:
    """Whether a table has caliscope's columns."""
    if not is_table(table):
        return False
    named: Any = table
    names = named.keys() if isinstance(table, Mapping) else getattr(named, "columns", ())
    names = named.column_names if hasattr(named, "column_names") else names
    found = {str(name) for name in names}
    return {"img_loc_x", "img_loc_y"} <= found
