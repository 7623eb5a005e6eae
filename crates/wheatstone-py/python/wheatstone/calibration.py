"""A fitted model: from matched pixels to points with error bars."""

from __future__ import annotations

import hashlib
import json
import threading
import warnings
import weakref
from collections.abc import Callable, Sequence
from typing import Any, Literal, overload

import numpy as np
import numpy.typing as npt

import wheatstone._wheatstone as _w
from ._arguments import is_whole, items, number, positive, refused
from ._arrays import (
    FloatArray,
    PathLike,
    Table,
    arrow_table,
    is_path,
    is_table,
    places_array,
    pyarrow,
    same_kind,
)
from ._named import Columns, column_names, has_names, pixels_of_camera
from ._sizes import ImageSize, image_sizes, one_size
from .data import Data, Dataset, Progress, as_dataset, pixels_of, places_of
from .errors import ArgumentError, DataWarning, MismatchError
from .evaluation import BoardEvaluation, Evaluation, Validation
from .findings import CameraMotion, Finding
from .located import Located
from .results import Rectification, Report

__all__ = ["Calibration"]


class Calibration:
    """A fitted model. Made by `fit`, `calibrate`, `from_opencv`, `read_cameras` and `Calibration.load`.

    Cameras count from 0. Pixel (0, 0) is the centre of the top-left pixel, x right, y down. World lengths are in
    `unit`. A row's result depends on the model and on that row alone: the same bits in any order, in any cut into
    calls, with any number of threads and on any worker.

    Examples
    --------
    >>> import wheatstone as ws
    >>> data = ws.synth(rig="paper", noise=0.1, count=300)
    >>> cal = ws.fit(data, method="brown", validate=False)
    >>> cal
    <wheatstone.Calibration: brown, 2 cameras, cm>
    >>> located = cal.locate(data.pixels)
    >>> located.points.shape, located.sigmas.shape
    ((300, 3), (300, 3))
    """

    __slots__ = ("__weakref__", "_evidence_cache", "handle")
    handle: _w.Model
    """The extension module's object, for this package's own use."""
    _evidence_cache: dict[str, Any] | None

    def __init__(self, model: _w.Model) -> None:
        self.handle = model
        self._evidence_cache = None

    # The file

    @classmethod
    def load(cls, path: PathLike) -> Calibration:
        """Reads a model file.

        Raises
        ------
        MissingFileError, FileError, MalformedError
        """
        return cls(_w.Model.load(path))

    @classmethod
    def from_bytes(cls, data: bytes) -> Calibration:
        """Reads what `to_bytes` gave."""
        return cls(_w.Model.from_bytes(data))

    def save(self, path: PathLike) -> None:
        """Writes the model file; what was there before stays until the new one is whole."""
        self.handle.save(path)

    def to_bytes(self) -> bytes:
        """The content of the model file: JSON in UTF-8."""
        return self.handle.to_bytes()

    def __reduce__(self) -> tuple[Callable[[str, bytes], Calibration], tuple[str, bytes]]:
        data = self.to_bytes()
        return _unpickled, (hashlib.sha256(data).hexdigest(), data)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Calibration) and (
            self.handle is other.handle or self.to_bytes() == other.to_bytes()
        )

    def __hash__(self) -> int:
        return hash(self.to_bytes())

    def __repr__(self) -> str:
        return f"<wheatstone.Calibration: {self.method}, {self.cameras} cameras, {self.unit}>"

    # What it is

    @property
    def cameras(self) -> int:
        """The number of cameras."""
        return self.handle.cameras

    @property
    def unit(self) -> str:
        """The unit of world lengths."""
        return self.handle.unit

    @property
    def method(self) -> str:
        """The method that was fitted; that which `auto` chose."""
        return self.handle.method

    @property
    def data(self) -> Dataset:
        """The points that it was fitted to."""
        return Dataset(self.handle.data())

    @property
    def _evidence(self) -> dict[str, Any]:
        cached = self._evidence_cache
        if cached is None:
            told: dict[str, Any] = json.loads(self.handle.evidence())
            self._evidence_cache = cached = told
        return cached

    @property
    def training(self) -> Evaluation:
        """The error on the points that it was fitted to: no measure of its error on new ones."""
        return Evaluation.of_figures(self._evidence["training"])

    @property
    def validation(self) -> Validation | None:
        """The held-out error: leave-one-view-out cross-validation; None where it was not asked for."""
        told = self._evidence["validation"]
        return None if told is None else Validation.of_figures(told)

    @property
    def findings(self) -> list[Finding]:
        """Faults that were found in the data before the fit."""
        return [Finding.of_figures(told, first_camera=1) for told in self._evidence["findings"]]

    @property
    def broken(self) -> str | None:
        """Why the model is unusable, if it is."""
        return self.handle.broken

    @property
    def viewpoint(self) -> FloatArray | None:
        """(3,), the middle of the cameras in the world, where it is known."""
        told = self._evidence["viewpoint"]
        return None if told is None else np.asarray(told, dtype=np.float64)

    @property
    def image_sizes(self) -> list[tuple[int, int] | None]:
        """Width and height of each camera's pictures, where they are known."""
        return [None if size is None else (size[0], size[1]) for size in self._evidence["sizes"]]

    @property
    def intrinsics(self) -> list[dict[str, Any]] | None:
        """Intrinsic parameters of each camera with standard deviations and correlations; None for a map without
        cameras."""
        told: list[dict[str, Any]] | None = self._evidence["intrinsics"]
        return told

    @property
    def outliers(self) -> list[dict[str, Any]]:
        """Points that were excluded as gross outliers: ``view``, ``id``, ``cameras`` (from 1), ``residual`` (px)."""
        told: list[dict[str, Any]] = self._evidence["outliers"]
        return told

    # Points

    def predict(
        self, pixels: Data, out: FloatArray | None = None, *, columns: Columns | None = None
    ) -> FloatArray:
        """Places of matched pixels: points alone, the fast way.

        Parameters
        ----------
        pixels : array, (n, 2 * cameras), (n, cameras, 2) or (cameras, n, 2); or Dataset, table, or path
            In pixels; NaN where a camera did not see a point. float64 and float32 of any strides are read as they
            stand, without a copy. The columns of a table are found by their names, as in `fit`, and others passed over;
            a DataFrame without names (0, 1, 2, 3) is read as an array is, and names that say nothing are refused.
        out : array, (n, 3), optional
            float64 in C order, to be filled.
        columns : mapping or sequence, optional
            What a table calls its columns; see `read`.

        Returns
        -------
        array, (n, 3)
            X, Y, Z in the world, in `unit`; NaN where a point cannot be located.

        Raises
        ------
        ArgumentError
            For arrays of the wrong shape.
        """
        array = pixels_of(pixels, self.cameras, columns)
        if out is None:
            out = np.empty((len(array), 3))
        self.handle.predict(array, _to_fill(out, len(array)))
        return out

    def locate(
        self,
        pixels: Data,
        *,
        covariance: bool = False,
        false_alarm: float = 0.001,
        pixel_sigma: float | None = None,
        columns: Columns | None = None,
    ) -> Located:
        """Places of matched pixels with error bars.

        Parameters
        ----------
        pixels, columns
            As in `predict`.
        covariance : bool
            Whether to keep the whole covariance of each point.
        false_alarm : float
            The share of correct matches that may be called a mismatch.
        pixel_sigma : float, optional
            Standard deviation of a coordinate of these pixels: error bars and mismatches are then for that noise, not
            for that of the points to which the model was fitted.

        Returns
        -------
        Located
            Points, standard deviations, residuals, trust, mismatch.

        Examples
        --------
        >>> import wheatstone as ws
        >>> data = ws.synth(rig="paper", noise=0.1, count=300)
        >>> cal = ws.fit(data, method="brown", validate=False)
        >>> located = cal.locate(data.pixels[:5], covariance=True)
        >>> bool((located.trust <= ws.Trust.EDGE).all()), located.covariance.shape
        (True, (5, 3, 3))
        """
        share = _share(false_alarm)
        sigma = None if pixel_sigma is None else positive(pixel_sigma, "pixel_sigma", "give a value above 0, in pixels")
        array = pixels_of(pixels, self.cameras, columns)
        figures = np.empty((13 if covariance else 7, len(array)))
        codes = np.empty((2, len(array)), dtype=np.uint8)
        self.handle.locate(array, figures, codes, (share, sigma))
        return Located(figures, codes, self.unit)

    def locate_arrow(
        self,
        table: Table,
        *,
        covariance: bool = False,
        false_alarm: float = 0.001,
        columns: Columns | None = None,
    ) -> Any:
        """A table with places appended: the same rows, in the same order.

        Appended are ``X, Y, Z``, their standard deviations ``sX, sY, sZ``, ``residual``, ``trust`` and ``mismatch``,
        as `wheatstone locate` writes them, and with `covariance` ``cXX, cXY, cXZ, cYY, cYZ, cZZ``. Rows that cannot
        be located keep their place, with nulls; so do rows whose pixels are none (infinite, one coordinate alone).

        Parameters
        ----------
        table : pyarrow Table or RecordBatch, polars or pandas DataFrame, mapping of columns, or any Arrow stream
            With columns ``x1, y1, x2, y2, ...``, or those that `columns` names.

        Returns
        -------
        table of the same kind
            For other Arrow streams an object with ``__arrow_c_stream__``, whose batches are located when they are
            asked for.

        Raises
        ------
        ArgumentError
            For an array, a path, and whatever else is no table.
        """
        if not has_names(table):
            raise ArgumentError(
                f"a {type(table).__name__} is no table with named columns",
                hint="give a DataFrame or a pyarrow table; `locate` takes arrays and paths",
            )
        stream = self.handle.locate_stream(
            arrow_table(table), covariance, _share(false_alarm), column_names(columns)
        )
        return same_kind(table, stream)

    def located_schema(self, schema: Any, *, covariance: bool = False) -> Any:
        """The pyarrow schema of what `locate_arrow` gives for a table of this schema."""
        return pyarrow().schema(self.handle.located_schema(schema, covariance))

    def project(self, points: Data, camera: int) -> FloatArray:
        """Where a camera sees points of the world.

        Parameters
        ----------
        points : array, (n, 3), in `unit`; or Dataset, table, or path
            Of a table the columns ``X, Y, Z``, as in `fit`, in `unit` unless it says its own.
        camera : int, from 0

        Returns
        -------
        array, (n, 2)
            Pixels; NaN where the camera does not see the point, and for maps that are no cameras (`network`,
            `interpolation`).
        """
        return self.handle.project(self._camera(camera), places_of(points, self.unit))

    def rays(self, pixels: npt.ArrayLike, camera: int) -> tuple[FloatArray, FloatArray]:
        """Where pixels of a camera look.

        Parameters
        ----------
        pixels : array, (n, 2)
            Columns of a table are found by their names: x2, y2 for camera 1, or x, y.
        camera : int, from 0

        Returns
        -------
        origins, directions : arrays, (n, 3)
            A point of each ray, in `unit`, and its direction, a unit vector; NaN for maps that are no cameras.
        """
        if has_names(pixels):
            table: Any = pixels
            pixels = pixels_of_camera(table, self._camera(camera))
        rays = self.handle.rays(self._camera(camera), places_array(pixels, "pixels", 2, None))
        return rays[:, :3], rays[:, 3:]

    def _camera(self, camera: int) -> int:
        if not (is_whole(camera) and camera < self.cameras):
            raise ArgumentError(
                f"there is no camera {camera!r}", hint=f"cameras count from 0 to {self.cameras - 1}"
            )
        return int(camera)

    def _pair(self, cameras: Any) -> list[int]:
        """Two cameras that differ."""
        pair = items(cameras)
        if len(pair) != 2 or pair[0] == pair[1]:
            raise refused("cameras", cameras, "give two different ones, counted from 0: (0, 1)")
        return [self._camera(camera) for camera in pair]

    def _sizes_with(self, given: list[list[int] | None]) -> list[list[int] | None]:
        """The sizes of the pictures, with those that are given where the model knows none."""
        known: list[list[int] | None] = self._evidence["sizes"]
        for camera, (own, size) in enumerate(zip(known, given)):
            if own is not None and size is not None and own != size:
                raise MismatchError(
                    f"size of the pictures of camera {camera}: the model has {own[0]} x {own[1]}, "
                    f"image_size is {size[0]} x {size[1]}",
                    hint="leave image_size out, or use the model of pictures of that size; "
                    "`size=` is that of the rectified pictures",
                    code="mismatch",
                )
        return [own or size for own, size in zip(known, given)]

    def relative(self) -> Calibration:
        """The same model with error bars within its frame: without the errors of shift, scale and skew that all
        points share, for models fitted with `stage_sigma`."""
        return Calibration(self.handle.relative())

    # How good it is

    def evaluate(
        self,
        pixels: Data,
        points: npt.ArrayLike | None = None,
        *,
        views: Sequence[object] | npt.NDArray[Any] | None = None,
        board: npt.ArrayLike | None = None,
        align: bool = False,
        unit: str | None = None,
        columns: Columns | None = None,
        progress: Progress | None = None,
    ) -> Evaluation | BoardEvaluation:
        """The error on points with known places, that were not fitted.

        Parameters
        ----------
        pixels, points, views, board, columns
            As in `fit`.
        align : bool
            First move the points' frame to that of the model by the best rigid motion.
        unit : str, optional
            The unit of the points; that of the model otherwise.

        Returns
        -------
        Evaluation, or BoardEvaluation for boards whose poses nobody knows
        """
        data = as_dataset(
            pixels,
            points,
            board=board,
            views=views,
            unit=unit or (self.unit if _are_arrays(pixels, points, board) else None),
            columns=columns,
            progress=progress,
        )
        told = json.loads(self.handle.evaluate(data.handle, align, progress))
        return BoardEvaluation.of_figures(told) if told["kind"] == "boards" else Evaluation.of_figures(told)

    def camera_motion(
        self,
        pixels: Data,
        points: npt.ArrayLike | None = None,
        *,
        views: Sequence[object] | npt.NDArray[Any] | None = None,
        board: npt.ArrayLike | None = None,
        unit: str | None = None,
        progress: Progress | None = None,
    ) -> CameraMotion:
        """Whether the cameras still stand as they did when this model was fitted.

        Parameters
        ----------
        pixels, points, views, board
            As in `fit`; matched pixels alone do, but hide motions of all cameras together.

        Returns
        -------
        CameraMotion
            Which camera moved, by how much, and how sure that is.
        """
        data = as_dataset(
            pixels,
            points,
            board=board,
            views=views,
            unit=unit or (None if isinstance(pixels, Dataset) else self.unit),
            progress=progress,
        )
        return CameraMotion.of_figures(json.loads(self.handle.camera_motion(data.handle, progress)))

    def report(
        self, title: str = "model", *, held_out: bool = True, progress: Progress | None = None
    ) -> Report:
        """The report: accuracy, reprojection errors, coverage, a 3-D view; one HTML page.

        Parameters
        ----------
        title : str
        held_out : bool
            Fit once more without each view, so that errors are those on points that the fit has not seen.
        """
        page, summary, verdict = self.handle.report(title, held_out, progress)
        return Report(page, verdict, json.loads(summary))

    # Other programs

    @overload
    def export(
        self, format: Literal["opencv"], path: None = None, *, image_size: ImageSize = None
    ) -> dict[str, Any]: ...
    @overload
    def export(self, format: str, path: PathLike, *, image_size: ImageSize = None) -> list[str]: ...
    def export(
        self, format: str, path: PathLike | None = None, *, image_size: ImageSize = None
    ) -> dict[str, Any] | list[str]:
        """Writes the cameras for another program; a model that the format cannot hold is approximated.

        Parameters
        ----------
        format : str
            One of `wheatstone.FORMATS`.
        path : path
            The file, or the folder for formats of several files. Without it ``"opencv"`` gives what `to_opencv` does.
        image_size : (width, height) or one a camera, optional

        Returns
        -------
        list of str
            The files that were written.

        Warns
        -----
        DataWarning
            Where the cameras that were written are not those of the model: by how many pixels they differ.
        """
        if path is None:
            if format == "opencv":
                return self.to_opencv(image_size=image_size)
            raise ArgumentError(f"`{format}` is a format of files", hint="give a path")
        sizes = image_sizes(image_size, self.cameras)
        files, text = self.handle.export(format, path, sizes)
        loss: dict[str, Any] | None = json.loads(text)
        if loss is not None and loss["largest"] > _ROUNDING:
            warnings.warn(
                f"`{format}` files do not hold this model as it is: a {loss['form']} was fitted to it, which differs by "
                f"{_pixels(loss['rms'])} px rms, {_pixels(loss['largest'])} px at most",
                DataWarning,
                stacklevel=2,
            )
        return [str(file) for file in files]

    def to_opencv(self, *, fisheye: bool = False, image_size: ImageSize = None) -> dict[str, Any]:
        """The cameras as OpenCV's arrays.

        Parameters
        ----------
        fisheye : bool
            Coefficients of ``cv2.fisheye``.
        image_size : (width, height) or one a camera, optional
            Where the model does not know it.

        Returns
        -------
        dict
            ``K1, D1, K2, D2, ...`` and ``R, T`` (``x2 = R x1 + T``; ``R3, T3`` of a third camera, from the first, and
            so on), as ``cv2.stereoRectify`` takes them: T is (3, 1). Then ``camera_from_world`` (cameras, 3, 4),
            ``image_size``, ``unit``, and ``loss``: None where the arrays say all, otherwise how far they are from the
            model in pixels (``rms``, ``largest``).

        Examples
        --------
        >>> import wheatstone as ws
        >>> cal = ws.fit(ws.synth(rig="paper", noise=0.1, count=300), method="brown", validate=False)
        >>> told = cal.to_opencv()
        >>> [told[name].shape for name in ("K1", "D1", "R", "T")]
        [(3, 3), (5,), (3, 3), (3, 1)]
        """
        sizes = image_sizes(image_size, self.cameras)
        cameras, loss = self.handle.matrices(fisheye, sizes)
        told: dict[str, Any] = {}
        poses = np.stack([camera["camera_from_world"] for camera in cameras])
        for number, camera in enumerate(cameras, start=1):
            told[f"K{number}"], told[f"D{number}"] = camera["K"], camera["D"]
            if number > 1:
                rotation = poses[number - 1][:, :3] @ poses[0][:, :3].T
                end = "" if number == 2 else str(number)
                told[f"R{end}"] = rotation
                # A column, as OpenCV's functions want it: stereoRectify takes no T of shape (3,).
                told[f"T{end}"] = poses[number - 1][:, 3:] - rotation @ poses[0][:, 3:]
        told["camera_from_world"] = poses
        told["image_size"] = [
            None if camera["size"] is None else tuple(camera["size"]) for camera in cameras
        ]
        told["unit"], told["loss"] = self.unit, json.loads(loss)
        return told

    def rectify(
        self,
        cameras: tuple[int, int] = (0, 1),
        *,
        image_size: ImageSize = None,
        size: tuple[int, int] | None = None,
        focal: float | None = None,
    ) -> Rectification:
        """A virtual rectified pair of two cameras, of any method.

        Parameters
        ----------
        cameras : (int, int)
            Counted from 0; the one to the left becomes the left one.
        image_size : (width, height) or one a camera, optional
            Of the pictures, where the model does not know it.
        size : (width, height), optional
            Of the rectified pictures.
        focal : float, optional
            Focal length of the rectified pictures, in pixels.

        Raises
        ------
        MismatchError
            For an `image_size` that is not that of the model's pictures.
        """
        known = self._sizes_with(image_sizes(image_size, self.cameras))
        wanted = None if size is None else one_size(size, "size")
        length = None if focal is None else positive(focal, "focal", "give a focal length above 0, in pixels")
        maps, text = self.handle.rectify(self._pair(cameras), known, wanted, length)
        told = json.loads(text)
        rotation: Any = np.asarray(told["rotation"])
        back = np.empty((3, 4))
        back[:, :3] = rotation.T
        back[:, 3] = -rotation.T @ np.asarray(told["translation"])
        made = told["pair"]
        return Rectification(
            (maps[0], maps[1]),
            (maps[2], maps[3]),
            np.asarray(told["P1"]),
            np.asarray(told["P2"]),
            np.asarray(told["Q"]),
            back,
            (made["cameras"][0], made["cameras"][1]),
            (made["size"][0], made["size"][1]),
            made["focal"],
            made["baseline"],
            made["unit"],
            told["leftover"],
        )


def _share(false_alarm: float) -> float:
    found = number(false_alarm)
    if not 0.0 < found < 1.0:
        raise refused("false_alarm", false_alarm, "give a value between 0 and 1")
    return found


_ROUNDING = 1e-6
"""Pixels that differ by less are the same but for rounding."""


def _pixels(figure: float) -> str:
    return f"{figure:.0f}" if figure >= 100.0 else f"{figure:.3g}"


def _are_arrays(pixels: object, points: object, board: object) -> bool:
    """Whether data have no unit of their own."""
    if points is not None or board is not None:
        return True
    return not (isinstance(pixels, Dataset) or is_path(pixels) or is_table(pixels))


_MODELS: weakref.WeakValueDictionary[str, Calibration] = weakref.WeakValueDictionary()
_MODELS_LOCK = threading.Lock()


def _to_fill(out: Any, rows: int) -> FloatArray:
    """An array that places can be written to."""
    if isinstance(out, np.ndarray) and out.dtype == np.dtype(np.float64) and out.ndim == 2:
        return out
    is_array = isinstance(out, np.ndarray)
    given = f"an array of {out.dtype}, shape {out.shape}" if is_array else f"a {type(out).__name__}"
    raise ArgumentError(f"out is {given}", hint=f"give a C-contiguous array of float64, shape ({rows}, 3)")


def _unpickled(digest: str, data: bytes) -> Calibration:
    """A model that was pickled; once a process, however often it comes."""
    with _MODELS_LOCK:
        known = _MODELS.get(digest)
        if known is None:
            known = Calibration.from_bytes(data)
            _MODELS[digest] = known
        return known
