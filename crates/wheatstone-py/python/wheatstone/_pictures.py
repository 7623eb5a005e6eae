"""Pictures that users hand over, as the extension module takes them."""

from __future__ import annotations

from typing import Any, Union, cast

import numpy as np
import numpy.typing as npt

from ._arrays import is_path
from .errors import ArgumentError

Image = Union[npt.NDArray[np.integer[Any]], npt.NDArray[np.floating[Any]]]
"""A picture: (height, width) or (height, width, 3) of uint8, uint16, or floating-point numbers of 0 to 255.

Whole numbers of another type are taken for uint8 where all are 0 to 255, and otherwise for uint16.
"""


def as_picture(image: Any) -> npt.NDArray[Any]:
    """An array of uint8, uint16 or float32, the given one wherever it is one already."""
    if is_path(image):
        raise ArgumentError(f"{image} is a path", hint="read the picture, with `cv2.imread` or Pillow, say")
    array: Any = np.asarray(image)
    if array.ndim not in (2, 3):
        raise ArgumentError(
            f"a picture of shape {array.shape}", hint="give (height, width) or (height, width, 3)"
        )
    if array.dtype == np.bool_:
        array = array.astype(np.uint8) * np.uint8(255)
    elif array.dtype.kind in "iu":
        array = _of_whole_numbers(array)
    elif array.dtype.kind == "f":
        array = _of_floats(array)
    else:
        raise ArgumentError(f"a picture of {array.dtype}", hint="give uint8, uint16, or floats of 0 to 255")
    return cast("npt.NDArray[Any]", np.require(array, requirements="A"))


def _of_whole_numbers(array: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """As uint8 or uint16 in the machine's order of bytes, by the type, or else by the values."""
    if array.dtype.kind == "u" and array.dtype.itemsize <= 2:
        return array.astype(np.uint8 if array.dtype.itemsize == 1 else np.uint16, copy=False)
    least, most = (int(array.min()), int(array.max())) if array.size else (0, 0)
    if least < 0 or most > 65535:
        raise ArgumentError(
            f"a picture of {array.dtype} with values from {least} to {most}",
            hint="scale it to 0..255 and give uint8, or to 0..65535 and give uint16",
        )
    return array.astype(np.uint8 if most <= 255 else np.uint16)


def _of_floats(array: npt.NDArray[Any]) -> npt.NDArray[np.float32]:
    """As float32. What is not finite shows nothing."""
    most = np.max(array, where=np.isfinite(array), initial=0.0)
    if most > 255.5:
        raise ArgumentError(
            f"a picture of {array.dtype} with values up to {most:g}",
            hint="scale or clip it to 0..255, or give uint16, of which 65535 is white: `picture.astype(np.uint16)`",
        )
    with np.errstate(over="ignore"):
        return array.astype(np.float32, copy=False)
