"""Point clouds of what calibrated cameras see."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any, cast

import numpy as np
import numpy.typing as npt

import wheatstone._wheatstone as _w
from ._arguments import camera_number, finite, items, positive, refused, several, several_whole
from ._arrays import FloatArray, PathLike, doubles
from ._pictures import Image, as_picture
from ._sizes import image_sizes, one_size
from .calibration import Calibration
from .errors import ArgumentError, DegenerateError, warn

__all__ = ["PointCloud", "Reconstructor", "reconstruct"]


@dataclass(frozen=True)
class PointCloud:
    """Points in the world, from pictures of calibrated cameras.

    Attributes
    ----------
    points : (n, 3) float64
        X, Y and Z in the world, in `unit`.
    sigmas : (n, 3) float32
        Their standard deviations, of the match and of the calibration.
    colours : (n, 3) uint8
        Red, green and blue of the left camera's picture.
    confidence : (n,) float32
        The probability that the match is right.
    inside : (n,) bool
        Whether the point lies where the calibration had data.
    pixels : list of (n, 2) float32
        The matched pixels in each camera's own picture; NaN where a camera has none.
    depth : (height, width) float32
        Depths along the axis of the left rectified camera; NaN where there is no point.
    disparity, disparity_confidence : (height, width) float32
        Of the left rectified picture, as the search of the first two cameras found them.
    fault : str or None
        What makes all of it worthless, if something does: exchanged pictures, a camera that has moved, nothing in
        common.
    left_out : list of int
        Cameras whose pictures have next to nothing in common with the reference, or whose depths contradict those of all
        others: they say nothing of the cloud.
    unit : str
        The unit of lengths.
    """

    points: npt.NDArray[np.float64] = field(repr=False)
    sigmas: npt.NDArray[np.float32] = field(repr=False)
    colours: npt.NDArray[np.uint8] = field(repr=False)
    confidence: npt.NDArray[np.float32] = field(repr=False)
    inside: npt.NDArray[np.bool_] = field(repr=False)
    pixels: list[npt.NDArray[np.float32]] = field(repr=False)
    depth: npt.NDArray[np.float32] = field(repr=False)
    disparity: npt.NDArray[np.float32] = field(repr=False)
    disparity_confidence: npt.NDArray[np.float32] = field(repr=False)
    fault: str | None
    left_out: list[int]
    unit: str

    def __len__(self) -> int:
        return len(self.points)

    def save(self, path: PathLike) -> None:
        """Writes the points with their colours, standard deviations and confidence, as the file's extension says: `.ply`
        or `.pcd` (binary), `.e57` or `.laz` (in metres). CloudCompare opens all of them."""
        _w.save_cloud(
            path,
            np.ascontiguousarray(self.points, np.float64),
            np.ascontiguousarray(self.sigmas, np.float32),
            np.ascontiguousarray(self.colours, np.uint8),
            np.ascontiguousarray(self.confidence, np.float32),
            self.unit,
        )


class Reconstructor:
    """Cameras of a model, made ready once for many pictures: a stream of frames, say.

    Parameters
    ----------
    cal : Calibration
        Of any method.
    image_size : (width, height) or one a camera
        Of the pictures.
    cameras : ints, optional
        Two or more, counted from 0, in the order of the pictures; the first two make the pair whose left picture is
        reconstructed. By default all of the model's.
    range : (float, float), optional
        Nearest and farthest depth to search, in the model's unit; by default those that it was fitted to, with a
        margin.
    confidence : float, optional
        Points that are right with a smaller probability are left out; by default 0.95.
    max_sigma : float, optional
        Points with a larger standard deviation of X, Y or Z are left out.
    region : (left, top, width, height), optional
        A part of the left camera's picture, in pixels.
    sparse : bool
        Whether only corners and edges are matched, along epipolar curves: where texture is thin, or time short.

    Attributes
    ----------
    world : (3, 4)
        Rotation and translation from the left rectified camera's frame to the world.
    disparities : (int, int)
        What is searched.
    """

    __slots__ = ("_handle", "_q", "_unit", "cameras", "disparities", "world")
    def __init__(
        self,
        cal: Calibration,
        image_size: tuple[int, int] | Sequence[tuple[int, int]],
        *,
        cameras: Sequence[int] | None = None,
        range: tuple[float, float] | None = None,
        confidence: float | None = None,
        max_sigma: float | None = None,
        region: tuple[int, int, int, int] | None = None,
        sparse: bool = False,
    ) -> None:
        wanted = np.arange(cal.cameras).tolist() if cameras is None else items(cameras)
        if not wanted:
            raise refused("cameras", cameras, "give two or more, counted from 0: (0, 1)")
        chosen = [camera_number(camera, cal.cameras) for camera in wanted]
        sizes = [one_size(size) for size in image_sizes(image_size, len(chosen))]
        hint = "give two depths, the nearer one first: (300, 1500)"
        depths = None if range is None else several(range, 2, "range", hint)
        part = None if region is None else _region(region)
        most = None if max_sigma is None else finite(max_sigma, "max_sigma", "give a length above 0")
        least = None if confidence is None else finite(confidence, "confidence", "give a probability, of 0 to 1")
        self._handle = _w.Reconstructor(
            cal.handle,
            chosen,
            sizes,
            None if depths is None else (depths[0], depths[1]),
            least,
            most,
            part,
            bool(sparse),
        )
        self._unit = cal.unit
        self.cameras: tuple[int, ...] = tuple(chosen)
        q, pose, disparities = self._handle.geometry()
        back: FloatArray = np.transpose(doubles(pose[:3], "pose"))
        self._q = doubles(q, "Q")
        self.world: FloatArray = np.column_stack([back, -back @ doubles(pose[3], "pose")])
        self.disparities: tuple[int, int] = (disparities[0], disparities[1])

    @property
    def Q(self) -> FloatArray:
        """(4, 4), OpenCV's matrix of the first two cameras: from x, y, disparity and 1 to the left rectified camera's
        frame."""
        return self._q

    def __repr__(self) -> str:
        return f"<wheatstone.Reconstructor: cameras {', '.join(map(str, self.cameras))}, {self._unit}>"

    def reconstruct(
        self, images: Sequence[Image], *, force: bool = False, bgr: bool = False
    ) -> PointCloud:
        """The points that pictures show, which were taken at once, one of each camera.

        Parameters
        ----------
        images : arrays, (height, width) or (height, width, 3)
            uint8, uint16, or floating-point numbers of 0 to 255, in the order of `cameras`.
        force : bool
            Whether pictures that do not fit together are reconstructed, too; `fault` says what is wrong with them.
        bgr : bool
            Whether colours stand in OpenCV's order (blue first).

        Returns
        -------
        PointCloud

        Raises
        ------
        DegenerateError
            For exchanged pictures, a camera that has moved, pictures with nothing in common. Of a camera that has moved
            a little there is a `DataWarning`.
        """
        told = self._handle.reconstruct([as_picture(image) for image in images], bgr)
        fault = cast("tuple[int, int, str] | None", told.pop("fault"))
        problem = None if fault is None else f"cameras {fault[0]} and {fault[1]}: {fault[2]}"
        if problem is not None and not force:
            hint = "`range` says at which depths to search; `force=True` reconstructs them anyway"
            raise DegenerateError(problem, hint=hint)
        _warn(told.pop("doubts"))
        return PointCloud(**told, fault=problem, unit=self._unit)

    def fuse(self, frames: Iterable[Sequence[Image]], *, bgr: bool = False) -> PointCloud:
        """The points that several frames show together, of a scene that stands still before cameras that do.

        Disparities that agree are averaged by their variances, and what one frame contradicts is outvoted. Frames are
        taken one after the other, so that memory does not grow with their number.

        Parameters
        ----------
        frames : iterable of sequences of arrays
            The pictures of one moment each, as in `reconstruct`. Those that do not fit together are left out, with a
            `DataWarning`.
        bgr : bool
            Whether colours stand in OpenCV's order (blue first).

        Returns
        -------
        PointCloud

        Raises
        ------
        DegenerateError
            Where no frame could be matched.
        """
        told, faults = self._handle.fuse(
            ([as_picture(image) for image in frame] for frame in frames), bgr
        )
        for fault in faults:
            warn(f"a frame was left out: {fault}")
        del told["fault"]
        _warn(told.pop("doubts"))
        return PointCloud(**told, fault=None, unit=self._unit)

    def locate(
        self,
        matches: npt.ArrayLike,
        images: Sequence[Image],
        *,
        sigma: float = 0.5,
        bgr: bool = False,
    ) -> PointCloud:
        """The points that matches of another program mean, a learned matcher's for instance.

        Parameters
        ----------
        matches : (n, 2 * cameras) or (height, width)
            Matched pixels, one row a point: x and y of each camera, in the order of `cameras`; or disparities of the
            left rectified picture, which has another number of columns. NaN where there is none. Those at depths that
            are not searched are left out.
        images : arrays
            As in `reconstruct`; the points' colours are from the left camera's.
        sigma : float
            The standard deviation of the matches, in pixels.
        bgr : bool
            Whether colours stand in OpenCV's order (blue first).

        Returns
        -------
        PointCloud

        Raises
        ------
        ArgumentError
            For matches that are not of two dimensions, and a standard deviation that is none.
        """
        array = doubles(matches, "matches")
        deviation = positive(sigma, "sigma", "give a standard deviation above 0, in pixels")
        if array.ndim != 2:
            raise ArgumentError(
                f"matches has shape {array.shape}", hint="give rows of pixels, or a map of disparities"
            )
        pictures = [as_picture(image) for image in images]
        if array.shape[1] == 2 * len(self.cameras):
            told = self._handle.locate_pixels(array, deviation, pictures, bgr)
        else:
            told = self._handle.locate_disparities(array, deviation, pictures, bgr)
        del told["fault"]
        _warn(told.pop("doubts"))
        return PointCloud(**told, fault=None, unit=self._unit)


def _warn(doubts: list[str]) -> None:
    """Says what makes standard deviations doubtful."""
    for doubt in doubts:
        warn(f"{doubt}; calibrate again")


def _region(value: Any) -> tuple[int, int, int, int]:
    """Left, top, width and height."""
    hint = "give left, top, width and height, in whole pixels"
    left, top, width, height = several_whole(value, 4, "region", hint)
    if min(left, top, width, height) < 0:
        raise refused("region", value, hint)
    return left, top, width, height


def reconstruct(
    cal: Calibration,
    images: Sequence[Image],
    *,
    cameras: Sequence[int] | None = None,
    range: tuple[float, float] | None = None,
    confidence: float | None = None,
    max_sigma: float | None = None,
    region: tuple[int, int, int, int] | None = None,
    sparse: bool = False,
    force: bool = False,
    bgr: bool = False,
) -> PointCloud:
    """The points that pictures of calibrated cameras show, with their standard deviations.

    Parameters are those of `Reconstructor` and `Reconstructor.reconstruct`; for many frames make a `Reconstructor`
    once.

    Returns
    -------
    PointCloud

    Examples
    --------
    >>> import numpy as np, wheatstone as ws
    >>> K = np.array([[400.0, 0, 160], [0, 400, 120], [0, 0, 1]])
    >>> cal = ws.from_opencv(K, None, K, None, np.eye(3), [-60.0, 0, 0], (320, 240))
    >>> wall = np.kron(np.random.default_rng(1).integers(0, 255, (80, 120)), np.ones((3, 3)))
    >>> cloud = ws.reconstruct(cal, [wall[:, :320], wall[:, 24:344]], range=(500, 2000))
    >>> float(np.median(cloud.points[:, 2]).round()), cloud.unit
    (1000.0, 'mm')
    """
    pictures = [as_picture(image) for image in images]
    count = cal.cameras if cameras is None else len(items(cameras))
    if len(pictures) != count:
        raise ArgumentError(
            f"{count} cameras need as many pictures, not {len(pictures)}",
            hint="give one of each camera; `cameras=(0, 2)` says whose they are",
        )
    sizes = [(int(picture.shape[1]), int(picture.shape[0])) for picture in pictures]
    made = Reconstructor(
        cal,
        sizes,
        cameras=cameras,
        range=range,
        confidence=confidence,
        max_sigma=max_sigma,
        region=region,
        sparse=sparse,
    )
    return made.reconstruct(pictures, force=force, bgr=bgr)
