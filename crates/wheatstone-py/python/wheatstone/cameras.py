"""Cameras that other programs calibrated: OpenCV's arrays, and files."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

import wheatstone._wheatstone as _w
from ._arrays import PathLike
from ._sizes import ImageSize, image_sizes
from .calibration import Calibration
from .errors import ArgumentError

__all__ = ["from_opencv", "read_cameras"]


def from_opencv(
    K1: npt.ArrayLike,
    D1: npt.ArrayLike,
    K2: npt.ArrayLike,
    D2: npt.ArrayLike,
    R: npt.ArrayLike,
    T: npt.ArrayLike,
    image_size: ImageSize = None,
    *,
    unit: str = "mm",
    fisheye: bool = False,
    pixel_sigma: float = 0.5,
) -> Calibration:
    """A model of a stereo pair that OpenCV calibrated: ``x2 = R x1 + T``; the world is camera 0's frame.

    Parameters
    ----------
    K1, K2 : arrays, (3, 3)
    D1, D2 : arrays
        0, 4, 5, 8, 12 or 14 coefficients; 4 for `fisheye`.
    R, T : arrays, (3, 3) and (3,)
    image_size : (width, height), optional
    unit : str
        The unit of `T`.
    fisheye : bool
        Whether the coefficients are those of ``cv2.fisheye``.
    pixel_sigma : float
        Standard deviation of a pixel coordinate, which OpenCV does not tell: error bars follow it.

    Returns
    -------
    Calibration
        Its accuracy is unknown until `Calibration.evaluate` measures it; every point is ``OUTSIDE`` its data.

    Examples
    --------
    >>> import numpy as np, wheatstone as ws
    >>> K = np.array([[800.0, 0, 320], [0, 800, 240], [0, 0, 1]])
    >>> cal = ws.from_opencv(K, np.zeros(5), K, np.zeros(5), np.eye(3), [-60.0, 0, 0], (640, 480))
    >>> cal.predict([[320.0, 240.0, 272.0, 240.0]]).round(6).tolist()
    [[0.0, 0.0, 1000.0]]
    """
    sizes = image_sizes(image_size, 2)
    identity = (np.eye(3), np.zeros(3))
    given = [(K1, D1, *identity, sizes[0]), (K2, D2, R, T, sizes[1])]
    cameras = [
        (
            _numbers(k, "K", 9),
            _numbers(d, "D", None),
            _numbers(r, "R", 9),
            _numbers(t, "T", 3),
            size,
        )
        for k, d, r, t, size in given
    ]
    return Calibration(_w.from_matrices(cameras, unit, fisheye, float(pixel_sigma)))


def _numbers(value: npt.ArrayLike, name: str, count: int | None) -> list[float]:
    array = np.asarray(value, dtype=np.float64)
    if (count is not None and array.size != count) or not bool(np.isfinite(array).all()):
        raise ArgumentError(
            f"{name} has shape {array.shape}", hint=f"give {count or 'a few'} finite numbers"
        )
    numbers: list[float] = np.ravel(array).tolist()
    return numbers


def read_cameras(
    *paths: PathLike,
    format: str | None = None,
    image_size: tuple[int, int] | Sequence[tuple[int, int]] | None = None,
    unit: str | None = None,
    pixel_sigma: float = 0.5,
) -> Calibration:
    """A model of cameras in files of OpenCV, ROS, Kalibr, mrcal, COLMAP, Anipose, OpenPTV, MyPTV, DLT, ...

    Parameters
    ----------
    *paths : path
        The files, or the folder, of all cameras.
    format : str, optional
        One of `wheatstone.FORMATS`; guessed from the files otherwise.
    image_size : (width, height) or one a camera, optional
    unit : str, optional
        Of the model's lengths. Files that say theirs, and formats that have only one (Kalibr and ROS: metres), are
        converted to it; others are in it. Without it the file's, else mm.
    pixel_sigma : float
        Standard deviation of a pixel coordinate, which such files do not tell.
    """
    if not paths:
        raise ArgumentError("there is no file to read", hint="name the files of all cameras")
    size: Any = image_size
    sizes = [] if size is None else [size] if isinstance(size[0], (int, np.integer)) else list(size)
    whole = [[int(width), int(height)] for width, height in sizes]
    return Calibration(_w.read_cameras(list(paths), format, whole, unit, float(pixel_sigma)))
