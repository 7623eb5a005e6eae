"""Calibration charts, and their detection in pictures."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

import wheatstone._wheatstone as _w
from ._arguments import finite, items, unit_name, whole
from ._arrays import FloatArray, is_path, places_array
from ._pictures import Image, as_picture
from .data import Dataset, Progress
from .errors import ArgumentError

__all__ = ["Chart", "Detection", "Image", "detect", "detect_all"]

Origin = Literal["centre", "first-point"]


class Chart:
    """A calibration chart. Lengths are in the unit of the data; counts are those of the chart's points or squares.

    Examples
    --------
    >>> import wheatstone as ws
    >>> board = ws.Chart.chessboard(columns=9, rows=6, pitch=30.0)
    >>> board.points.shape
    (54, 3)
    """

    __slots__ = ("json",)
    json: str
    """The settings as JSON."""

    def __init__(self, settings: str) -> None:
        """Of the settings of ``[chart]`` in ``capture.toml``, as JSON; see the class methods."""
        self.json = _w.chart_settings(settings)

    @classmethod
    def _of(cls, kind: str, **settings: object) -> Chart:
        given = {name: _setting(name, value) for name, value in settings.items() if value is not None}
        return cls(json.dumps({"type": kind, **given}))

    @classmethod
    def chessboard(
        cls, columns: int, rows: int, pitch: float, *, origin: Origin | None = None
    ) -> Chart:
        """A chessboard of `columns` x `rows` *inner* corners (as OpenCV counts), squares of side `pitch`.

        `origin`, of every chart: the middle of its points (``"centre"``, where nothing says another), or the first one.
        """
        return cls._of("chessboard", columns=columns, rows=rows, pitch=pitch, origin=origin)

    @classmethod
    def charuco(
        cls,
        columns: int,
        rows: int,
        pitch: float,
        marker: float,
        dictionary: str = "DICT_4X4_50",
        *,
        legacy: bool = False,
        origin: Origin | None = None,
    ) -> Chart:
        """A ChArUco board of `columns` x `rows` *squares* of side `pitch`, with markers of side `marker`.

        `dictionary` is that of OpenCV's markers, by its name there. `legacy` matters for printing alone: boards of
        OpenCV before 4.6.
        """
        return cls._of(
            "charuco",
            columns=columns,
            rows=rows,
            pitch=pitch,
            marker=marker,
            dictionary=dictionary,
            legacy=legacy,
            origin=origin,
        )

    @classmethod
    def dots(
        cls,
        columns: int,
        rows: int,
        pitch: float,
        *,
        diameter: float | None = None,
        asymmetric: bool = False,
        first_larger: bool = False,
        origin: Origin | None = None,
    ) -> Chart:
        """A grid of `columns` x `rows` dots, rows `pitch` apart.

        `asymmetric`: every second row is moved to the right by the pitch. `first_larger`: the dot with id 0 is larger,
        which shows how the chart is turned. `diameter` matters for printing alone.
        """
        return cls._of(
            "dot-grid",
            columns=columns,
            rows=rows,
            pitch=pitch,
            diameter=diameter,
            asymmetric=asymmetric,
            first_larger=first_larger,
            origin=origin,
        )

    @classmethod
    def lines(
        cls,
        columns: int,
        rows: int,
        pitch: float,
        *,
        line_width: float | None = None,
        origin: Origin | None = None,
    ) -> Chart:
        """A grid of `columns` x `rows` crossings of lines, `pitch` apart."""
        return cls._of(
            "line-grid", columns=columns, rows=rows, pitch=pitch, line_width=line_width, origin=origin
        )

    @classmethod
    def april_grid(
        cls,
        columns: int,
        rows: int,
        tag: float,
        spacing: float,
        *,
        border: int | None = None,
        first: int | None = None,
        dictionary: str | None = None,
        origin: Origin | None = None,
    ) -> Chart:
        """Kalibr's grid of `columns` x `rows` tags of side `tag`, `spacing` tag sides apart.

        `first` is the number of the first tag, 0 where nothing says another; `dictionary` OpenCV's name of the tags,
        ``"DICT_APRILTAG_36h11"`` likewise. `border`, in cells, matters for printing alone.
        """
        return cls._of(
            "april-grid",
            columns=columns,
            rows=rows,
            tag=tag,
            spacing=spacing,
            border=border,
            first=first,
            dictionary=dictionary,
            origin=origin,
        )

    @classmethod
    def of_points(
        cls,
        points: npt.ArrayLike,
        *,
        marks: Literal["patches", "corners"] | None = None,
        diameter: float | None = None,
    ) -> Chart:
        """A rigid body with marks at `points` (n, 3) in its own frame."""
        places = places_array(points, "points", 3, None).tolist()
        return cls._of("point-list", points=places, marks=marks, diameter=diameter)

    @property
    def settings(self) -> dict[str, Any]:
        """All settings, as ``[chart]`` of ``capture.toml`` has them."""
        settings: dict[str, Any] = json.loads(self.json)
        return settings

    @property
    def points(self) -> FloatArray:
        """(n, 3), the places of its points in its own frame: x right, y down, z into the chart."""
        return _w.chart_points(self.json)

    def __repr__(self) -> str:
        return f"<wheatstone.Chart: {self.settings}>"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Chart) and other.json == self.json

    def __hash__(self) -> int:
        return hash(self.json)

    def __reduce__(self) -> tuple[type[Chart], tuple[str]]:
        return Chart, (self.json,)


def _setting(name: str, value: Any) -> Any:
    """A setting of a chart as JSON has it."""
    if name in ("type", "dictionary", "marks", "origin", "points"):
        return value
    if name in ("asymmetric", "first_larger", "legacy"):
        return bool(value)
    if name in ("border", "columns", "first", "rows"):
        return min(whole(value, name, "give a whole number from 0 on"), 2**31)
    return finite(value, name, "give a length above 0")


@dataclass(frozen=True)
class Detection:
    """A chart found in one picture.

    Attributes
    ----------
    ids : (n,) int64
        Which points of `Chart.points`.
    pixels : (n, 2) float64
        Where they are seen; (0, 0) is the centre of the top-left pixel.
    sigmas : (n,) float64
        Standard deviation of each along each axis, in pixels; NaN where it is not told.
    board : (n, 3) float64
        Their places on the chart, in its unit.
    names : list of str
        What the chart calls them.
    readings : int
        In how many ways the picture can be read. More than one: it does not tell which point is which (a board that
        looks the same upside down), and this is the reading whose x axis is nearest to the picture's.
    """

    ids: npt.NDArray[np.int64]
    pixels: FloatArray
    sigmas: FloatArray
    board: FloatArray
    names: list[str]
    readings: int

    def __len__(self) -> int:
        return len(self.ids)


def _seen(item: Any) -> Any:
    """What the extension module takes for a picture: a path, an array, or nothing."""
    if item is None:
        return None
    return os.fspath(item) if is_path(item) else as_picture(item)


def detect(image: Image, chart: Chart, *, bgr: bool = False) -> Detection:
    """Finds a chart in a picture.

    Parameters
    ----------
    image : array, (height, width) or (height, width, 3)
        uint8, uint16, or floating-point numbers of 0 to 255. Any strides. Whole numbers of other types are taken for
        uint8 where all are 0 to 255, otherwise for uint16.
    chart : Chart
        What to look for.
    bgr : bool
        Whether colours stand in OpenCV's order (blue first).

    Returns
    -------
    Detection

    Raises
    ------
    ChartNotFoundError
        Where the picture does not show it; the message says why.

    Examples
    --------
    >>> import numpy as np, wheatstone as ws
    >>> square = np.indices((7, 8)).sum(axis=0) % 2
    >>> picture = np.pad(np.kron(square, np.ones((40, 40))), 30, constant_values=1) * 200.0
    >>> found = ws.detect(picture.astype(np.uint8), ws.Chart.chessboard(7, 6, 25.0))
    >>> len(found), found.pixels.min(axis=0).round(1).tolist()
    (42, [69.5, 69.5])
    """
    return Detection(*_w.detect(as_picture(image), chart.json, bgr))


def detect_all(
    pictures: Sequence[Sequence[Any]],
    chart: Chart,
    *,
    views: Sequence[object] | None = None,
    translations: npt.ArrayLike | None = None,
    rotations: npt.ArrayLike | None = None,
    unit: str = "mm",
    bgr: bool = False,
    progress: Progress | None = None,
) -> Dataset:
    """Finds a chart in the pictures of all cameras, with the points named alike.

    Parameters
    ----------
    pictures : one sequence a camera, of one picture a view
        Arrays or paths; None where a camera has no picture of a view.
    chart : Chart
        What was shown.
    views : sequence of labels, optional
        The views' names; their numbers otherwise.
    translations : array, (views, 3), optional
        Where the chart's origin stood in the world, in `unit`: a chart on a stage. Without it the chart was held by
        hand, and its poses are estimated by the fit.
    rotations : array, (views, 3), optional
        How it was turned: rotation vectors (axis times angle) in radians; zero otherwise.
    unit : str
        The unit of the chart's lengths.
    bgr : bool
        Whether colours stand in OpenCV's order.
    progress : callable, optional
        Called as ``progress(task, done, total)``.

    Returns
    -------
    Dataset
    """
    return detect_in_pictures(
        pictures, chart, views, translations, rotations, unit, bgr, progress
    )[0]


def detect_in_pictures(
    pictures: Sequence[Sequence[Any]],
    chart: Chart,
    views: Sequence[object] | None,
    translations: npt.ArrayLike | None,
    rotations: npt.ArrayLike | None,
    unit: str,
    bgr: bool,
    progress: Progress | None,
) -> tuple[Dataset, list[tuple[int, int] | None]]:
    given = [pictures] if is_path(pictures) else items(pictures)
    if any(is_path(of_camera) for of_camera in given):
        raise ArgumentError(
            "pictures has a path where it should have a list of pictures",
            hint='give one list of pictures a camera: `[sorted(glob("left/*.png")), sorted(glob("right/*.png"))]`',
        )
    cameras = [items(of_camera) for of_camera in given]
    count = len(cameras[0]) if cameras else 0
    if not count or any(len(of_camera) != count for of_camera in cameras):
        raise ArgumentError(
            f"cameras with {[len(of_camera) for of_camera in cameras]} pictures",
            hint="give one sequence a camera, of one picture a view; None where there is none",
        )
    names = [str(name) for name in (range(1, count + 1) if views is None else items(views))]
    if len(names) != count:
        raise ArgumentError(f"{len(names)} views and {count} pictures a camera", hint="give one name a view")
    places: list[tuple[list[float], list[float]] | None] = [None] * count
    if translations is not None:
        moved = places_array(translations, "translations", 3, count)
        turned = np.zeros((count, 3)) if rotations is None else places_array(rotations, "rotations", 3, count)
        places = list(zip(moved.tolist(), turned.tolist()))
    seen = [[_seen(item) for item in of_camera] for of_camera in cameras]
    in_unit = unit_name(unit) or "mm"
    data, sizes = _w.detect_all(seen, chart.json, list(zip(names, places)), (in_unit, bgr), progress)
    return Dataset(data), [None if size is None else (size[0], size[1]) for size in sizes]
