"""Cameras that other programs calibrated: OpenCV's arrays, and files."""

from __future__ import annotations

from collections.abc import Sequence
import numpy as np
import numpy.typing as npt

import wheatstone._wheatstone as _w
from ._arguments import known_unit, positive, unit_name
from ._arrays import FloatArray, PathLike, doubles
from ._sizes import ImageSize, image_sizes, one_size, size_list
from .calibration import Calibration
from .errors import ArgumentError

__all__ = ["from_opencv", "read_cameras"]


def from_opencv(
    K1: npt.ArrayLike,
    D1: npt.ArrayLike | None,
    K2: npt.ArrayLike,
    D2: npt.ArrayLike | None,
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
        Camera matrices, in pixels.
    D1, D2 : arrays or None
        0, 4, 5, 8, 12 or 14 coefficients; 4 for `fisheye`. None for a lens without distortion.
    R, T : arrays, (3, 3), and (3, 1) or (3,)
        From the frame of camera 0 to that of camera 1; T in `unit`.
    image_size : (width, height) or one a camera, optional
        Of the pictures, for exports and rectification.
    unit : str
        The unit of `T`: ``"mm"``, ``"cm"``, ``"m"``, ``"um"``, ``"in"``, ``"ft"``.
    fisheye : bool
        Whether the coefficients are those of ``cv2.fisheye``.
    pixel_sigma : float
        Standard deviation of a pixel coordinate, which OpenCV does not tell: error bars follow it.

    Returns
    -------
    Calibration
        Its accuracy is unknown until `Calibration.evaluate` measures it; every point is ``OUTSIDE`` its data.

    Raises
    ------
    ArgumentError
        For what no calibration of a pair gives: a transposed K, a focal length of 0, no baseline, NaN.

    Examples
    --------
    >>> import numpy as np, wheatstone as ws
    >>> K = np.array([[800.0, 0, 320], [0, 800, 240], [0, 0, 1]])
    >>> cal = ws.from_opencv(K, np.zeros(5), K, np.zeros(5), np.eye(3), [-60.0, 0, 0], (640, 480))
    >>> cal.predict([[320.0, 240.0, 272.0, 240.0]]).round(6).tolist()
    [[0.0, 0.0, 1000.0]]
    """
    sizes = image_sizes(image_size, 2)
    sigma = positive(pixel_sigma, "pixel_sigma", _SIGMA_HINT)
    translation = _array(T, "T", (3,), (3, 1), (1, 3))
    if not translation.any():
        raise ArgumentError(
            "T is 0, and cameras that stand in one place locate no points",
            hint="give the translation of `cv2.stereoCalibrate`, whose length is the baseline",
        )
    rotation = _array(R, "R", (3, 3), hint="give the matrix; `cv2.Rodrigues` makes it of a vector")
    given = [
        (_camera_matrix(K1, "K1"), _coefficients(D1, "D1", fisheye), np.eye(3), np.zeros(3), sizes[0]),
        (_camera_matrix(K2, "K2"), _coefficients(D2, "D2", fisheye), rotation, translation, sizes[1]),
    ]
    cameras = [(_flat(k), _flat(d), _flat(r), _flat(t), size) for k, d, r, t, size in given]
    return Calibration(_w.from_matrices(cameras, known_unit(unit), fisheye, sigma))


_SIGMA_HINT = "give a standard deviation above 0, in pixels"


def _camera_matrix(value: npt.ArrayLike, name: str) -> FloatArray:
    matrix = _array(value, name, (3, 3))
    if not np.array_equal(matrix[2], (0.0, 0.0, 1.0)):
        is_transposed = np.array_equal(matrix[:, 2], (0.0, 0.0, 1.0))
        raise ArgumentError(
            f"the last row of {name} is {_told(matrix[2])}, and not 0, 0, 1",
            hint=f"it is transposed: give `{name}.T`" if is_transposed else "give [[fx, 0, cx], [0, fy, cy], [0, 0, 1]]",
        )
    focal = matrix[[0, 1], [0, 1]]
    if not (focal > 0.0).all() or matrix[1, 0] != 0.0:
        raise ArgumentError(
            f"{name} has focal lengths of {_told(focal)} px, and {matrix[1, 0]:g} before the second",
            hint="give [[fx, 0, cx], [0, fy, cy], [0, 0, 1]], fx and fy above 0",
        )
    return matrix


def _coefficients(value: npt.ArrayLike | None, name: str, fisheye: bool) -> FloatArray:
    """Coefficients of distortion; None for none."""
    if value is None:
        return np.zeros(4 if fisheye else 0)
    return _array(value, name)


def _array(value: npt.ArrayLike, name: str, *shapes: tuple[int, ...], hint: str | None = None) -> FloatArray:
    """Finite numbers of one of these shapes, or of any."""
    array = doubles(value, name)
    if shapes and array.shape not in shapes:
        wanted = " or ".join(str(shape) for shape in shapes)
        raise ArgumentError(f"{name} has shape {array.shape}", hint=hint or f"give an array of shape {wanted}")
    if not np.isfinite(array).all():
        raise ArgumentError(f"{name} has numbers that are not finite", hint="give what OpenCV's calibration returned")
    return array


def _flat(array: FloatArray) -> list[float]:
    numbers: list[float] = np.ravel(array).tolist()
    return numbers


def _told(numbers: FloatArray) -> str:
    return ", ".join(f"{number:g}" for number in _flat(numbers))


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
        Of the pictures, where the files do not say it.
    unit : str, optional
        Of the model's lengths. Files that say theirs, and formats that have only one (Kalibr and ROS: metres), are
        converted to it; others are in it. Without it the file's, else mm.
    pixel_sigma : float
        Standard deviation of a pixel coordinate, which such files do not tell.

    Returns
    -------
    Calibration
        Its accuracy is unknown until `Calibration.evaluate` measures it.

    Raises
    ------
    MissingFileError, FileError, MalformedError
        For files that there are not, that cannot be read, or that hold no cameras.

    Examples
    --------
    >>> import wheatstone as ws
    >>> cal = ws.read_cameras("stereo.yml", image_size=(1280, 960), unit="mm")  # doctest: +SKIP
    """
    if not paths:
        raise ArgumentError("there is no file to read", hint="name the files of all cameras")
    sizes = [] if image_size is None else size_list(image_size)
    whole = [one_size(size) for size in sizes]
    sigma = positive(pixel_sigma, "pixel_sigma", _SIGMA_HINT)
    return Calibration(_w.read_cameras(list(paths), format, whole, unit_name(unit), sigma))
