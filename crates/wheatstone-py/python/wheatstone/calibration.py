"""A fitted model: from matched pixels to points with error bars."""

from __future__ import annotations

import hashlib
import json
import threading
import weakref
from collections.abc import Callable, Sequence
from typing import Any, cast

import numpy as np
import numpy.typing as npt

from ._arguments import share
from ._arrays import FloatArray, Numbers, Table, arrow_table, pyarrow, same_kind
from ._inputs import Data, as_dataset, has_own_places, pixels_of
from ._model_cameras import ModelCameras
from ._named import Columns, column_names, has_names
from ._sigmas import sigma_or_columns, sigmas_of, typical
from .data import Dataset, Progress
from .errors import ArgumentError, warn
from .evaluation import BoardEvaluation, Evaluation
from .findings import CameraMotion
from .located import Located
from .results import Report

__all__ = ["Calibration"]


class Calibration(ModelCameras):
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

    __slots__ = ()

    def __reduce__(self) -> tuple[Callable[[str, bytes], Calibration], tuple[str, bytes]]:
        data = self.to_bytes()
        return _unpickled, (hashlib.sha256(data).hexdigest(), data)

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
        pixel_sigma: npt.ArrayLike | None = None,
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
        pixel_sigma : float, or array, (n,) or (n, cameras), optional
            Standard deviation of a coordinate of these pixels, in pixels: of all of them, of those of each row, or of
            each pixel. Error bars and mismatches are then for that noise, not for that of the points to which the model
            was fitted. The points stay the same: they are not weighted by it. Where standard deviations of a row's
            pixels differ much, some more correct matches than `false_alarm` are called mismatches.

        Returns
        -------
        Located
            Points, standard deviations, residuals, trust, mismatch.

        Warns
        -----
        DataWarning
            Where the first pixels scatter by more than the error bars are for, seem to come from exchanged cameras, or
            do not belong together.

        Examples
        --------
        >>> import wheatstone as ws
        >>> data = ws.synth(rig="paper", noise=0.1, count=300)
        >>> cal = ws.fit(data, method="brown", validate=False)
        >>> located = cal.locate(data.pixels[:5], covariance=True)
        >>> bool((located.trust <= ws.Trust.EDGE).all()), located.covariance.shape
        (True, (5, 3, 3))
        """
        alarms = share(false_alarm, "false_alarm")
        array = pixels_of(pixels, self.cameras, columns)
        sigma = None if pixel_sigma is None else sigmas_of(pixel_sigma, len(array), self.cameras)
        figures = np.empty((13 if covariance else 7, len(array)))
        codes = np.empty((2, len(array)), dtype=np.uint8)
        self.handle.locate(array, figures, codes, (alarms, sigma))
        self._warn_of(array, (alarms, typical(sigma, array)))
        return Located(figures, codes, self.unit)

    def _warn_of(self, pixels: Numbers, test: tuple[float, float | None]) -> None:
        """Warns of pixels that this model does not fit, by the first of them."""
        if len(pixels) < 30:
            return
        noisier, exchanged, mismatched = self.handle.doubts(np.asarray(pixels[:512], dtype=float), test)
        if exchanged is not None:
            first, second = (camera + 1 for camera in exchanged)
            warn(
                f"the pixels are mismatched, but would match with cameras {first} and {second} exchanged: "
                "give their columns in the order of the cameras that the model was fitted to"
            )
        elif noisier is not None:
            sigma, assumed = noisier
            warn(
                f"the pixels scatter by about {sigma:.3g} px, and the error bars are for {assumed:.3g} px: they are too "
                f"short, and correct matches are called mismatches; pixel_sigma={sigma:.3g} has both for such pixels; if "
                "they should be as good as those of the calibration, a camera may have moved (`camera_motion`)"
            )
        elif mismatched is not None:
            warn(
                f"{mismatched:.0%} of the first {len(pixels[:512])} points have rays that do not intersect: does this "
                "model belong to these cameras?"
            )

    def locate_arrow(
        self,
        table: Table,
        *,
        covariance: bool = False,
        false_alarm: float = 0.001,
        pixel_sigma: float | str | Sequence[str] | None = None,
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
        covariance, false_alarm
            As in `locate`.
        pixel_sigma : float, str, or sequence of str, optional
            Standard deviation of a pixel coordinate, as in `locate`; or the name of the column that has it, or the
            names of columns, one for each camera. Rows in which a camera sees the point and its standard deviation is
            missing or not above 0 have no error bars and no mismatch.
        columns : mapping or sequence, optional
            What the table calls its columns; see `read`.

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
        test = share(false_alarm, "false_alarm"), sigma_or_columns(pixel_sigma)
        stream = self.handle.locate_stream(arrow_table(table), covariance, test, column_names(columns))
        return same_kind(table, stream)

    def located_schema(self, schema: Any, *, covariance: bool = False) -> Any:
        """The pyarrow schema of what `locate_arrow` gives for a table of this schema, itself one of pyarrow's; nothing is
        located. With `covariance`, that of ``locate_arrow(..., covariance=True)``."""
        return pyarrow().schema(self.handle.located_schema(schema, covariance))

    def relative(self) -> Calibration:
        """The same model with error bars within its frame: without the errors of shift, scale and skew that all
        points share, for models fitted with `stage_sigma`."""
        return Calibration(self.handle.relative())

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
        progress : callable, optional
            Called as ``progress(task, done, total)``.

        Returns
        -------
        Evaluation, or BoardEvaluation for boards whose poses nobody knows
            Lengths are in the unit of the points.

        Examples
        --------
        >>> import wheatstone as ws
        >>> cal = ws.fit(ws.synth(noise=0.1, count=300), method="brown", validate=False)
        >>> new = ws.synth(noise=0.1, count=300, seed=1)
        >>> found = cal.evaluate(new.pixels, new.points, unit="cm")
        >>> found.n, found.unit, bool(found.rms < 1.0)
        (300, 'cm', True)
        """
        data = as_dataset(
            pixels,
            points,
            board=board,
            views=views,
            unit=unit or (None if has_own_places(pixels) and points is None and board is None else self.unit),
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
        unit : str, optional
            The unit of the points; that of the model otherwise.
        progress : callable, optional
            Called as ``progress(task, done, total)``.

        Returns
        -------
        CameraMotion
            Which camera moved, by how much, and how sure that is.

        Examples
        --------
        >>> import wheatstone as ws
        >>> data = ws.synth(noise=0.1, count=300)
        >>> cal = ws.fit(data, method="brown", validate=False)
        >>> cal.camera_motion(ws.synth(noise=0.1, count=300, seed=1)).moved
        False
        >>> pixels = data.pixels + [0.0, 0.0, 5.0, 0.0]
        >>> cal.camera_motion(pixels, data.points).changes[0].cameras
        (1,)
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
            Of the page.
        held_out : bool
            Fit once more without each view, so that errors are those on points that the fit has not seen.
        progress : callable, optional
            Called as ``progress(task, done, total)``.

        Returns
        -------
        Report
        """
        page, summary, verdict = self.handle.report(title, held_out, progress)
        return Report(page, verdict, json.loads(summary))


_MODELS: weakref.WeakValueDictionary[str, Calibration] = weakref.WeakValueDictionary()
_MODELS_LOCK = threading.Lock()


def _to_fill(out: Any, rows: int) -> FloatArray:
    """An array that places can be written to."""
    told = f"a {type(out).__name__}"
    if isinstance(out, np.ndarray):
        array = cast("npt.NDArray[Any]", out)
        if array.dtype == np.dtype(np.float64) and array.ndim == 2:
            return array
        told = f"an array of {array.dtype}, shape {array.shape}"
    raise ArgumentError(f"out is {told}", hint=f"give a C-contiguous array of float64, shape ({rows}, 3)")


def _unpickled(digest: str, data: bytes) -> Calibration:
    """A model that was pickled; once a process, however often it comes."""
    with _MODELS_LOCK:
        known = _MODELS.get(digest)
        if known is None:
            known = Calibration.from_bytes(data)
            _MODELS[digest] = known
        return known
