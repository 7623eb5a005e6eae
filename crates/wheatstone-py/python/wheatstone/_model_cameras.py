"""The cameras of a model: where they look, and how they go over to other programs."""

from __future__ import annotations

import json
from typing import Any, Literal, overload

import numpy as np
import numpy.typing as npt

from ._arguments import camera_number, items, positive, refused
from ._arrays import FloatArray, PathLike, places_array
from ._inputs import Data, places_of
from ._model_file import ModelFile
from ._named import has_names, pixels_of_camera
from ._sizes import ImageSize, image_sizes, one_size
from .errors import ArgumentError, MismatchError, warn
from .results import Rectification

__all__ = ["ModelCameras"]

_ROUNDING = 1e-6
"""Pixels that differ by less are the same but for rounding."""


class ModelCameras(ModelFile):
    """A model whose cameras are asked for, and exported."""

    __slots__ = ()

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

        Raises
        ------
        ArgumentError
            For an array that is not (n, 3), and a camera that there is not.

        Examples
        --------
        >>> import numpy as np, wheatstone as ws
        >>> K = np.array([[800.0, 0, 320], [0, 800, 240], [0, 0, 1]])
        >>> cal = ws.from_opencv(K, None, K, None, np.eye(3), [-60.0, 0, 0])
        >>> cal.project([[0.0, 0.0, 1000.0], [10.0, 0.0, 1000.0]], camera=1).round(6).tolist()
        [[272.0, 240.0], [280.0, 240.0]]
        """
        return self.handle.project(camera_number(camera, self.cameras), places_of(points, self.unit))

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
            A point of each ray, in `unit`, and its direction, a unit vector, both in the world; NaN for maps that are
            no cameras.

        Raises
        ------
        ArgumentError
            For an array that is not (n, 2), and a camera that there is not.

        Examples
        --------
        >>> import numpy as np, wheatstone as ws
        >>> K = np.array([[800.0, 0, 320], [0, 800, 240], [0, 0, 1]])
        >>> cal = ws.from_opencv(K, None, K, None, np.eye(3), [-60.0, 0, 0])
        >>> origins, directions = cal.rays([[320.0, 240.0]], camera=1)
        >>> origins.round(6).tolist(), directions.round(6).tolist()
        ([[60.0, 0.0, 0.0]], [[0.0, 0.0, 1.0]])
        """
        number = camera_number(camera, self.cameras)
        if has_names(pixels):
            pixels = pixels_of_camera(pixels, number)
        rays = self.handle.rays(number, places_array(pixels, "pixels", 2, None))
        return rays[:, :3], rays[:, 3:]

    def _pair(self, cameras: Any) -> list[int]:
        """Two cameras that differ."""
        pair = items(cameras)
        if len(pair) != 2 or pair[0] == pair[1]:
            raise refused("cameras", cameras, "give two different ones, counted from 0: (0, 1)")
        return [camera_number(camera, self.cameras) for camera in pair]

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
            warn(
                f"`{format}` files do not hold this model as it is: a {loss['form']} was fitted to it, which differs by "
                f"{_pixels(loss['rms'])} px rms, {_pixels(loss['largest'])} px at most"
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

        Returns
        -------
        Rectification
            Maps for ``cv2.remap``, and the projection matrices of the virtual cameras.

        Raises
        ------
        MismatchError
            For an `image_size` that is not that of the model's pictures.
        ArgumentError
            For cameras that there are not, and sizes and lengths that are none.

        Examples
        --------
        >>> import numpy as np, wheatstone as ws
        >>> K = np.array([[800.0, 0, 320], [0, 800, 240], [0, 0, 1]])
        >>> cal = ws.from_opencv(K, None, K, None, np.eye(3), [-60.0, 0, 0], (640, 480))
        >>> pair = cal.rectify(size=(320, 240))
        >>> pair.left_map[0].shape, round(pair.baseline, 6), pair.unit
        ((240, 320), 60.0, 'mm')
        """
        known = self._sizes_with(image_sizes(image_size, self.cameras))
        wanted = None if size is None else one_size(size, "size")
        length = None if focal is None else positive(focal, "focal", "give a focal length above 0, in pixels")
        maps, text = self.handle.rectify(self._pair(cameras), known, wanted, length)
        return Rectification.of_figures(maps, json.loads(text))


def _pixels(figure: float) -> str:
    return f"{figure:.0f}" if figure >= 100.0 else f"{figure:.3g}"
