"""From data to models: fits, comparisons of methods, and checks of data."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

import wheatstone._wheatstone as _w
from ._arguments import items, refused
from ._arrays import is_path
from ._inputs import Data, as_dataset, has_own_places
from ._named import Columns
from ._settings import Baseline, Gauge, baseline_of, settings_of
from ._sizes import ImageSize, image_sizes, refuse_beyond
from .calibration import Calibration
from .charts import Chart, detect_in_pictures
from .data import Dataset, Progress
from .errors import ArgumentError, FaultyError, warn
from .evaluation import Comparison
from .findings import Examination
from .results import Report

__all__ = [
    "calibrate",
    "check",
    "compare",
    "fit",
    "report",
]

QUICK = ("dlt", "tsai", "brown", "kannala-brandt", "soloff", "neural-camera")
"""The methods that take seconds."""


def fit(
    pixels: Data,
    points: npt.ArrayLike | None = None,
    *,
    method: str = "auto",
    preset: str | None = None,
    views: Sequence[object] | npt.NDArray[Any] | None = None,
    board: npt.ArrayLike | None = None,
    seed: int = 0,
    unit: str | None = None,
    stage_sigma: float | None = None,
    expect_baseline: Baseline | None = None,
    gauge: Gauge = "first-view",
    intrinsics: Calibration | Sequence[Calibration] | None = None,
    image_size: ImageSize = None,
    epochs: int | None = None,
    validate: bool = True,
    fix: bool = False,
    force: bool = False,
    keep_outliers: bool = False,
    columns: Columns | None = None,
    drop_duplicates: bool = False,
    progress: Progress | None = None,
) -> Calibration:
    """Calibrates: fits a map from matched pixels to points.

    Parameters
    ----------
    pixels : array, Dataset, table, or path
        Matched pixels (n, 2 * cameras): x and y in each camera, NaN where a camera did not see the point. Or all data
        at once: a `Dataset`, a DataFrame of pandas or polars or a pyarrow table with columns ``x1, y1, x2, y2, ...``
        and ``X, Y, Z`` (or ``board_x, board_y``, and ``view``), or the path of a table or a capture. A table of pixels
        alone goes with `points` or `board`.
    points : array, (n, 3), or table, optional
        Where the points are in the world, in `unit`; of a table the columns ``X, Y, Z``.
    method : str
        One of `wheatstone.METHODS`; ``"auto"`` chooses by held-out error.
    preset : str, optional
        Ready-made settings of the method, such as ``"paper"`` for ``"network"``.
    views : sequence of n labels, optional
        Which placement of the chart each row belongs to. Without views, held-out errors leave out slabs of depth.
    board : array, (n, 2), optional
        In place of `points`: places on a board in the hand, whose poses are estimated by bundle adjustment.
    seed : int
        Of every random choice. The same data and seed give the same bits, those of the program `wheatstone fit`.
    unit : str, optional
        The unit of lengths; millimetres where nothing says another.
    stage_sigma : float, optional
        Standard deviation of the given chart positions, in `unit`: the true positions are then estimated too.
    expect_baseline : float or (float, float), optional
        The distance of cameras 0 and 1 as measured on the rig, and the relative tolerance (0.01): a wrong scale is
        then noticed.
    gauge : "first-view" or "first-camera"
        The world frame where no chart pose is given.
    intrinsics : Calibration or one a camera, optional
        Keep these lenses, and estimate only where the cameras stand, from one view or more.
    image_size : (width, height) or one a camera, optional
        Of the pictures, for exports and rectification. One that the pixels exceed is refused.
    epochs : int, optional
        Epochs of training, for ``"network"`` with preset ``"paper"``.
    validate : bool
        Leave-one-view-out cross-validation, which takes one more fit a view: `Calibration.validation`.
    fix : bool
        Correct faults of the data where that is safe, and not by an estimate from the pixels unless ``force`` is given.
    force : bool
        Go on in spite of faults that make a fit worthless.
    keep_outliers : bool
        Fit gross outliers too.
    columns
        What a table calls its columns; see `read`.
    drop_duplicates : bool
        Keep the first of rows that stand there twice. Otherwise a table with such rows is refused, and arrays are
        fitted as they are, with a warning.
    progress : callable, optional
        Called as ``progress(task, done, total)``; an exception that it raises cancels the fit. So does Ctrl-C.

    Returns
    -------
    Calibration

    Warns
    -----
    DataWarning
        For faults of the data that do not stop the fit, and rows of arrays that stand there twice.

    Raises
    ------
    FaultyError
        Where the data, or the model that comes out, are worthless; `code` names the fault.
    TooFewError, DegenerateError
        Where the data do not determine the method.

    Examples
    --------
    >>> import wheatstone as ws
    >>> data = ws.synth(rig="water", noise=0.1, count=400)
    >>> cal = ws.fit(data.pixels, data.points, views=data.views, unit="cm")
    >>> held_out = cal.validation.all
    >>> held_out.unit, bool(held_out.rms < 1.0)
    ('cm', True)
    """
    data = as_dataset(
        pixels,
        points,
        board=board,
        views=views,
        unit=unit,
        columns=columns,
        drop_duplicates=drop_duplicates,
        progress=progress,
    )
    _require_places(pixels, points, board)
    lenses = _lenses(intrinsics)
    name = os.path.basename(str(pixels)) if is_path(pixels) else "arrays"
    sizes = [] if image_size is None else image_sizes(image_size, data.cameras)
    if any(sizes):
        refuse_beyond(data.pixels, sizes)
    settings = settings_of(
        method=method,
        preset=preset,
        epochs=epochs,
        seed=seed,
        validate=validate,
        fix=fix,
        force=force,
        keep_outliers=keep_outliers,
        stage_sigma=stage_sigma,
        expect_baseline=expect_baseline,
        gauge=gauge,
        sizes=sizes,
        source={"name": name, "frame": _frame(data, gauge)},
    )
    model = Calibration(_w.fit(data.handle, settings, [lens.handle for lens in lenses], progress))
    for finding in model.findings:
        if finding.severity != "information" and not finding.fixable:
            warn(f"{finding.explanation} ({finding.code})")
    broken = model.broken
    if broken is not None:
        if not force and preset != "paper":
            raise FaultyError(
                f"the model is unusable: {broken}",
                hint="`wheatstone.check` looks for faults in the data; `force=True` gives the model anyway",
                code="broken-model",
            )
        warn(f"the model is unusable: {broken}")
    return model


def _lenses(intrinsics: Any) -> list[Calibration]:
    if intrinsics is None or isinstance(intrinsics, Calibration):
        return [] if intrinsics is None else [intrinsics]
    lenses = items(intrinsics)
    if not lenses or not all(isinstance(lens, Calibration) for lens in lenses):
        raise refused("intrinsics", intrinsics, "give a Calibration, or one a camera")
    return lenses


def _require_places(pixels: Data, *places: object) -> None:
    """Refuses an array of pixels alone: what else there is may have places of its own."""
    if not has_own_places(pixels) and all(given is None for given in places):
        raise ArgumentError(
            "pixels alone do not tell where the points are",
            hint="give `points=`, (n, 3); or `board=`, (n, 2), of a board in the hand",
        )


def _frame(data: Dataset, gauge: str) -> str:
    if not bool(np.isnan(data.points).all()):
        return "that of the given points"
    if gauge == "first-camera":
        return "camera 1's: X right, Y down, Z forward; its origin is the projection centre"
    return "the board's in the first view: X along board_x, Y along board_y, Z into the board"


def calibrate(
    pictures: Sequence[Sequence[Any]],
    chart: Chart,
    *,
    translations: npt.ArrayLike | None = None,
    rotations: npt.ArrayLike | None = None,
    view_names: Sequence[object] | None = None,
    unit: str = "mm",
    bgr: bool = False,
    progress: Progress | None = None,
    **settings: Any,
) -> Calibration:
    """Calibrates from pictures of a chart, held by hand or on a stage.

    Parameters
    ----------
    pictures : one sequence a camera, of one picture a view
        Arrays or paths; None where a camera has no picture of a view. ``[left_pictures, right_pictures]``.
    chart : Chart
        What was shown.
    translations, rotations : arrays, (views, 3), optional
        Where the chart stood, if that is known; see `detect_all`.
    view_names : sequence of labels, optional
        The views' names; their numbers otherwise.
    unit : str
        The unit of the chart's lengths.
    bgr : bool
        Whether colours stand in OpenCV's order (blue first).
    progress : callable, optional
        Called as ``progress(task, done, total)``.
    **settings
        Of `fit`: `method`, `seed`, `expect_baseline`, `gauge`, ...

    Returns
    -------
    Calibration

    Raises
    ------
    ArgumentError
        For pictures that are no lists of one length, and charts' places that are not a row a view.

    Examples
    --------
    >>> from glob import glob
    >>> import wheatstone as ws
    >>> pictures = [sorted(glob("left/*.png")), sorted(glob("right/*.png"))]
    >>> cal = ws.calibrate(pictures, ws.Chart.chessboard(9, 6, 30.0), unit="mm")  # doctest: +SKIP
    """
    data, sizes = detect_in_pictures(
        pictures, chart, view_names, translations, rotations, unit, bgr, progress
    )
    settings.setdefault("image_size", sizes)
    return fit(data, progress=progress, **settings)


def compare(
    pixels: Data,
    points: npt.ArrayLike | None = None,
    *,
    methods: str | Sequence[str] = QUICK,
    views: Sequence[object] | npt.NDArray[Any] | None = None,
    board: npt.ArrayLike | None = None,
    seed: int = 0,
    unit: str | None = None,
    stage_sigma: float | None = None,
    fix: bool = False,
    force: bool = False,
    columns: Columns | None = None,
    progress: Progress | None = None,
) -> Comparison:
    """Compares methods by leave-one-view-out cross-validation.

    Parameters
    ----------
    pixels, points, views, board, seed, unit, stage_sigma, fix, force, columns, progress
        As in `fit`.
    methods : str or sequence of str
        Of `wheatstone.METHODS`; those that take seconds otherwise.

    Returns
    -------
    Comparison

    Examples
    --------
    >>> import wheatstone as ws
    >>> found = ws.compare(ws.synth(rig="paper", noise=0.1, count=300), methods=["dlt", "brown"])
    >>> found.chosen
    'brown'
    """
    names = [methods] if isinstance(methods, str) else items(methods)
    if not names or not all(isinstance(name, str) for name in names):
        raise refused("methods", methods, "give names of `wheatstone.METHODS`")
    for name in names:
        _w.require_method(name)
    data = as_dataset(
        pixels, points, board=board, views=views, unit=unit, columns=columns, progress=progress
    )
    _require_places(pixels, points, board)
    settings = settings_of(seed=seed, stage_sigma=stage_sigma, fix=fix, force=force)
    told = _w.compare_methods(data.handle, names, settings, progress)
    return Comparison.of_figures(json.loads(told))


def check(
    pixels: Data,
    points: npt.ArrayLike | None = None,
    *,
    views: Sequence[object] | npt.NDArray[Any] | None = None,
    board: npt.ArrayLike | None = None,
    unit: str | None = None,
    expect_baseline: Baseline | None = None,
    columns: Columns | None = None,
    progress: Progress | None = None,
) -> Examination:
    """Looks for faults of data: swapped cameras, a turned board, a wrong pitch, mixed units, and others.

    Parameters
    ----------
    pixels, points, views, board, unit, expect_baseline, columns, progress
        As in `fit`.

    Returns
    -------
    Examination
        A sequence of `Finding`, the worst first, and what these data cannot show.

    Examples
    --------
    >>> import wheatstone as ws
    >>> data = ws.synth(rig="paper", noise=0.1)
    >>> [finding.code for finding in ws.check(data) if finding.severity != "information"]
    []
    >>> swapped = data.pixels.copy()
    >>> swapped[data.views == 2] = swapped[data.views == 2][:, [2, 3, 0, 1]]
    >>> ws.check(swapped, data.points, views=data.views, unit="cm")[0].code
    'cameras-swapped'
    """
    data = as_dataset(
        pixels, points, board=board, views=views, unit=unit, columns=columns, progress=progress
    )
    return Examination(_w.check(data.handle, baseline_of(expect_baseline), progress))


def report(
    model: Calibration,
    title: str = "model",
    *,
    held_out: bool = True,
    progress: Progress | None = None,
) -> Report:
    """The report on a model: `Calibration.report`, with the same arguments."""
    return model.report(title, held_out=held_out, progress=progress)
