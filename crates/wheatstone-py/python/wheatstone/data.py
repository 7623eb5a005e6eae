"""Correspondences: what cameras saw of points, and where these are."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

import wheatstone._wheatstone as _w
from ._arguments import unit_name
from ._arrays import FloatArray, PathLike, doubles, labels, pixels_array, places_array
from ._named import Columns, board_of_table, has_names, pixels_of_table, places_of_table, reading
from .errors import ArgumentError, warn

__all__ = ["Dataset", "Progress", "read"]

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
        drop_duplicates: bool = False,
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
        drop_duplicates : bool
            Keep the first of rows that stand there twice: the same pixels, places and view, to the last digit.

        Returns
        -------
        Dataset

        Warns
        -----
        DataWarning
            Where rows stand there twice and are kept: held-out errors look smaller than they are.

        Raises
        ------
        ArgumentError
            For arrays of the wrong shape, and numbers that are no pixels or places.
        """
        made = of_arrays(pixels, points, board=board, views=views, ids=ids, unit=unit)
        first = _first_equal(made)
        again = np.flatnonzero(first != np.arange(len(made)))
        if len(again) and drop_duplicates:
            return _rows_of(made, np.unique(first))
        if len(again):
            others = f", and {len(again) - 1} more stand there twice" if len(again) > 1 else ""
            warn(
                f"row {again[0]} is the same as row {first[again[0]]}{others}: copies make held-out errors look small; "
                "`drop_duplicates=True` of `fit` and `Dataset.from_arrays` keeps the first of each"
            )
        return made

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
        """Writes a table of points: CSV, Parquet or Arrow, by the extension of `path`.

        Raises
        ------
        FileError
            Where it cannot be written.
        """
        self.handle.save(path)


def of_arrays(
    pixels: npt.ArrayLike,
    points: npt.ArrayLike | None = None,
    *,
    board: npt.ArrayLike | None = None,
    views: Sequence[object] | npt.NDArray[Any] | None = None,
    ids: Sequence[object] | npt.NDArray[Any] | None = None,
    unit: str = "mm",
) -> Dataset:
    """As `Dataset.from_arrays`, whatever rows stand there twice."""
    matched: Any = pixels
    known: Any = points
    if has_names(pixels):
        # By its names or, where they say nothing, by position.
        found = pixels_of_table(pixels, None, None)
        matched = pixels if found is None else found
    if has_names(points):
        found = places_of_table(points, unit)
        known = points if found is None else found
    if has_names(board):
        board = board_of_table(board)
    if known is not None:
        known = doubles(known, "points")
    count = len(known) if known is not None and known.ndim == 2 else None
    array = pixels_array(matched, None, count)
    rows, columns = array.shape
    if columns % 2 or not columns:
        raise ArgumentError(
            f"pixels has {columns} columns", hint="give two for each camera: x1, y1, x2, y2, ..."
        )
    if known is not None:
        known = places_array(known, "points", 3, rows)
    on_board = None if board is None else places_array(board, "board", 2, rows)
    return Dataset(
        _w.Dataset.of_arrays(
            array.astype(np.float64, copy=False),
            known,
            on_board,
            labels(views, "views", rows),
            labels(ids, "ids", rows),
            unit_name(unit) or "mm",
        )
    )


def _first_equal(data: Dataset) -> npt.NDArray[np.intp]:
    """(n,), the first row that each equals to the last bit, itself mostly; rows that no camera saw equal no other."""
    rows: Any = np.ascontiguousarray(np.column_stack([data.pixels, data.points, data.board, data.views]))
    rows[np.isnan(rows)] = np.nan
    unseen = np.isnan(data.pixels).all(axis=1)
    rows[unseen, 0] = np.flatnonzero(unseen)
    keys: npt.NDArray[np.void] = rows.view(np.dtype((np.void, rows.itemsize * rows.shape[1])))[:, 0]
    _, first, group = np.unique(keys, return_index=True, return_inverse=True)
    return first[group]


def _rows_of(data: Dataset, rows: npt.NDArray[np.intp]) -> Dataset:
    names, known = data.view_names, data.ids
    kept: list[int] = rows.tolist()
    ids = [known[row] for row in kept]
    views: list[int] = data.views[rows].tolist()
    return of_arrays(
        data.pixels[rows],
        data.points[rows],
        board=data.board[rows],
        views=[names[view] for view in views] if names else None,
        ids=None if None in ids else ids,
        unit=data.unit,
    )


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

    Raises
    ------
    MissingFileError, FileError, MalformedError
        For a file that there is not, that cannot be read, or that says no points; the message names file and line.
    """
    settings = reading(unit, columns, drop_duplicates, whole_pixels, follow)
    return Dataset(_w.Dataset.read(path, settings, progress))
