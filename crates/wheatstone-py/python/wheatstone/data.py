"""Correspondences: what cameras saw of points, and where these are."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, Union

import numpy as np
import numpy.typing as npt

import wheatstone._wheatstone as _w
from ._arguments import unit_name
from ._arrays import (
    FloatArray,
    Numbers,
    PathLike,
    Table,
    arrow_table,
    doubles,
    is_path,
    is_table,
    labels,
    pixels_array,
    places_array,
    table_columns,
)
from ._named import (
    Columns,
    board_of_table,
    has_names,
    in_unit,
    pixels_and_views,
    pixels_of_table,
    places_of_table,
    reading,
)
from .errors import ArgumentError

__all__ = ["Dataset", "Progress", "read", "read_caliscope"]

Progress = Callable[[str, int, int], object]
"""Called with the task, what is done of it, and the total; an exception that it raises cancels the work."""


class Dataset:
    """Correspondences: points that cameras saw, a row each.

    Made by `Dataset.from_arrays`, `read`, `read_caliscope`, `detect_all` and `synth`; taken wherever data are taken.

    Examples
    --------
    >>> import numpy as np, wheatstone as ws
    >>> pixels = np.array([[310.2, 205.7, 290.1, 206.0], [412.9, 210.3, np.nan, np.nan]])
    >>> points = np.array([[0.0, 0.0, 500.0], [30.0, 0.0, 500.0]])
    >>> data = ws.Dataset.from_arrays(pixels, points, views=["near", "near"], unit="mm")
    >>> data
    <wheatstone.Dataset: 2 points, 2 cameras, 1 view, mm>
    >>> data.pixels.shape
    (2, 4)
    """

    __slots__ = ("handle",)
    handle: _w.Dataset
    """The extension module's object, for this package's own use."""

    def __init__(self, data: _w.Dataset) -> None:
        self.handle = data

    @classmethod
    def from_arrays(
        cls,
        pixels: npt.ArrayLike,
        points: npt.ArrayLike | None = None,
        *,
        board: npt.ArrayLike | None = None,
        views: Sequence[object] | npt.NDArray[Any] | None = None,
        ids: Sequence[object] | npt.NDArray[Any] | None = None,
        unit: str = "mm",
    ) -> Dataset:
        """Of arrays.

        Parameters
        ----------
        pixels : array, (n, 2 * cameras), (n, cameras, 2) or (cameras, n, 2)
            x and y in each camera, in pixels; (0, 0) is the centre of the top-left pixel. NaN for both where a camera
            did not see the point. Columns of a table are found by their names, in whatever order they are.
        points : array, (n, 3), optional
            X, Y, Z in the world, in `unit`; NaN where they are not known. Columns of a table are found by their names.
        board : array, (n, 2), optional
            Places on a board whose pose is not known, in `unit`: a board in the hand. Columns ``board_x, board_y`` of a
            table.
        views : sequence of n labels, optional
            Which view (placement of the chart, picture) each row belongs to. Held-out errors leave out whole views.
        ids : sequence of n labels, optional
            The name of each point within its view.
        unit : str
            The unit of lengths: ``"mm"``, ``"cm"``, ``"m"``, ``"um"``, ``"in"``, ``"ft"``.

        Returns
        -------
        Dataset

        Raises
        ------
        ArgumentError
            For arrays of the wrong shape, and numbers that are no pixels or places.
        """
        if has_names(pixels):
            # By its names or, where they say nothing, by position.
            table: Any = pixels
            found = pixels_of_table(table, None, None)
            pixels = pixels if found is None else found
        if has_names(points):
            places: Any = points
            points = places_of(places, unit)
        if has_names(board):
            on_its_board: Any = board
            board = board_of_table(on_its_board)
        known = None if points is None else doubles(points, "points")
        count = len(known) if known is not None and known.ndim == 2 else None
        array = pixels_array(pixels, None, count)
        rows, columns = array.shape
        if columns % 2 or not columns:
            raise ArgumentError(
                f"pixels has {columns} columns", hint="give two for each camera: x1, y1, x2, y2, ..."
            )
        if known is not None:
            known = places_array(known, "points", 3, rows)
        on_board = None if board is None else places_array(board, "board", 2, rows)
        return cls(
            _w.Dataset.of_arrays(
                array.astype(np.float64, copy=False),
                known,
                on_board,
                labels(views, "views", rows),
                labels(ids, "ids", rows),
                unit_name(unit) or "mm",
            )
        )

    def __reduce__(self) -> tuple[Callable[[bytes], Dataset], tuple[bytes]]:
        return _unpickled, (self.handle.to_bytes(),)

    def __len__(self) -> int:
        return len(self.handle)

    def __repr__(self) -> str:
        views = len(self.view_names)
        plural = "" if views == 1 else "s"
        return f"<wheatstone.Dataset: {len(self)} points, {self.cameras} cameras, {views} view{plural}, {self.unit}>"

    @property
    def cameras(self) -> int:
        """The number of cameras."""
        return self.handle.cameras

    @property
    def unit(self) -> str:
        """The unit of lengths."""
        return self.handle.unit

    @property
    def pixels(self) -> FloatArray:
        """(n, 2 * cameras), in pixels; NaN where a camera did not see the point."""
        return self.handle.pixels()

    @property
    def points(self) -> FloatArray:
        """(n, 3), places in the world in `unit`; NaN where they are not known."""
        return self.handle.points()

    @property
    def board(self) -> FloatArray:
        """(n, 2), places on a board whose pose is not known, in `unit`; NaN elsewhere."""
        return self.handle.board()

    @property
    def view_names(self) -> list[str]:
        """The names of the views."""
        return self.handle.view_names

    @property
    def views(self) -> npt.NDArray[np.int64]:
        """(n,), the index of each row's view in `view_names`: groups for cross-validation."""
        return self.handle.views()

    @property
    def ids(self) -> list[str | None]:
        """The name of each row's point within its view, where it has one."""
        return self.handle.ids()

    def save(self, path: PathLike) -> None:
        """Writes a table of points: CSV, Parquet or Arrow, by the extension of `path`."""
        self.handle.save(path)


def _unpickled(data: bytes) -> Dataset:
    """Data that were pickled."""
    return Dataset(_w.Dataset.from_bytes(data))


def read(
    path: PathLike,
    *,
    unit: str | None = None,
    columns: Columns | None = None,
    drop_duplicates: bool = False,
    whole_pixels: bool = False,
    follow: bool = False,
    progress: Progress | None = None,
) -> Dataset:
    """Reads a table of points, a capture, or points of another program.

    Parameters
    ----------
    path : path
        A table (CSV, Parquet, Arrow) with columns ``x1, y1, x2, y2, ...`` and ``X, Y, Z`` or ``board_x, board_y``;
        a capture (the folder of ``capture.toml``), whose charts are then detected; or files of MyPTV, proPTV,
        OpenPTV, DLTdv or NumPy.
    unit : str, optional
        The unit that is wanted; a table in another one is converted.
    columns : mapping or sequence, optional
        What a table calls its columns: ``{"x1": "u_left", ...}``, or all names in order.
    drop_duplicates : bool
        Keep the first of rows that stand in a table twice, instead of refusing it.
    whole_pixels : bool
        Round detected points to whole pixels (captures only).
    follow : bool
        Read pictures outside of the capture's folder too, where ``capture.toml`` or links lead there.
    progress : callable, optional
        Called as ``progress(task, done, total)``.

    Returns
    -------
    Dataset
    """
    settings = reading(unit, columns, drop_duplicates, whole_pixels, follow)
    return Dataset(_w.Dataset.read(path, settings, progress))


CALISCOPE = ("sync_index", "cam_id", "keypoint_id", "img_loc_x", "img_loc_y")


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
        Where columns are missing, or two rows of a point and camera contradict each other.
    """
    columns = _csv_columns(table) if is_path(table) else table_columns(table)  # type: ignore[arg-type]
    old = {"port": "cam_id", "point_id": "keypoint_id"}
    old |= {"obj_loc_x": "board_loc_x", "obj_loc_y": "board_loc_y"}
    columns = {old.get(name, name): column for name, column in columns.items()}
    missing = [name for name in CALISCOPE if name not in columns]
    if missing:
        raise ArgumentError(
            f"there is no column {', '.join(missing)}", hint=f"caliscope's are {', '.join(CALISCOPE)}"
        )
    count = len(columns["cam_id"])
    objects = columns.get("object_id", np.zeros(count, dtype=np.int64))
    cameras, camera = np.unique(columns["cam_id"], return_inverse=True)
    views, view = np.unique(columns["sync_index"], return_inverse=True)
    things, thing = np.unique(objects, return_inverse=True)
    keypoints, keypoint = np.unique(columns["keypoint_id"], return_inverse=True)
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
        named = [name for name in ("sync_index", "cam_id", "object_id", "keypoint_id") if name in columns]
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


def _two_columns(columns: Mapping[str, npt.NDArray[Any]], x: str, y: str) -> FloatArray:
    pair = [doubles(columns[name], f"column `{name}`") for name in (x, y)]
    return np.stack(pair, axis=1)


def _is_same(left: FloatArray, right: FloatArray) -> npt.NDArray[np.bool_]:
    """(n,), whether two places are one; places that are not known are."""
    same: npt.NDArray[np.bool_] = ((left == right) | (np.isnan(left) & np.isnan(right))).all(axis=1)
    return same


def _csv_columns(path: Any) -> dict[str, npt.NDArray[Any]]:
    table = np.genfromtxt(path, delimiter=",", names=True, dtype=None, encoding="utf-8")
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


Data = Union[Dataset, Table, PathLike, npt.ArrayLike]
"""What is taken for data: a `Dataset`, arrays, a table of any library, or a path."""


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
        beside: Any = pixels
        pixels, own_views = pixels_and_views(beside, columns)
        views = own_views if views is None else views
    arrays = (points, board, views)
    if isinstance(pixels, Dataset) or is_path(pixels) or has_names(pixels):
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
                pixels,  # type: ignore[arg-type]
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
    return Dataset.from_arrays(given, points, board=board, views=views, unit=unit or "mm")


def pixels_of(pixels: Data, cameras: int, columns: Columns | None) -> Numbers:
    """Matched pixels of data of any kind, (n, 2 * cameras), a row each."""
    found: Numbers | None = None
    if isinstance(pixels, Dataset) or is_path(pixels) or is_caliscope(pixels):
        found = as_dataset(pixels, columns=columns).pixels
    elif has_names(pixels):
        found = pixels_of_table(pixels, cameras, columns)  # type: ignore[arg-type]
    return pixels_array(pixels, cameras) if found is None else found  # type: ignore[arg-type]


def places_of(points: Data, unit: str) -> FloatArray:
    """Places of data of any kind, (n, 3) in `unit`, a row each."""
    found: FloatArray | None = None
    if isinstance(points, Dataset):
        found = in_unit(points.points, points.unit, unit)
    elif is_path(points):
        found = as_dataset(points, unit=unit).points
    elif has_names(points):
        found = places_of_table(points, unit)  # type: ignore[arg-type]
    return places_array(points, "points", 3, None) if found is None else found  # type: ignore[arg-type]
