"""Sizes of pictures, as users give them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Union

import numpy as np

from ._arguments import is_whole, items, refused
from ._arrays import FloatArray
from .errors import ArgumentError

ImageSize = Union[tuple[int, int], Sequence["tuple[int, int] | None"], None]
"""Width and height of the pictures: one pair for all cameras, or one a camera."""

_GROSS = 0.05
"""The share of pixels that may be errors, as in the program."""


def one_size(size: Any, name: str = "image_size") -> list[int]:
    """One width and height."""
    sides = items(size)
    if len(sides) != 2 or not all(is_whole(side, 1) and side < 2**31 for side in sides):
        raise refused(name, size, "give width and height, whole numbers above 0: (1280, 960)")
    return [int(side) for side in sides]


def image_sizes(size: ImageSize, cameras: int) -> list[list[int] | None]:
    """One width and height a camera."""
    if size is None:
        return [None] * cameras
    each = size_list(size)
    if len(each) == 1 and _is_pair(size):
        return each * cameras
    if len(each) != cameras:
        raise ArgumentError(
            f"{len(each)} image sizes for {cameras} cameras", hint="give (width, height), or one a camera"
        )
    return each


def size_list(size: Any) -> list[list[int] | None]:
    """The sizes that are given, of however many cameras."""
    if _is_pair(size):
        return [one_size(size)]
    return [None if pair is None else one_size(pair) for pair in items(size)]


def _is_pair(size: Any) -> bool:
    """Whether it is one size and no list of some."""
    parts = items(size)
    return not parts or all(part is not None and np.ndim(part) == 0 for part in parts)


def refuse_beyond(pixels: FloatArray, sizes: Sequence[Sequence[int] | None]) -> None:
    """Refuses a size that the pixels of a camera, (n, 2 * cameras), exceed but for gross errors."""
    for camera, size in enumerate(sizes):
        x, y = pixels[:, 2 * camera], pixels[:, 2 * camera + 1]
        seen = int(np.count_nonzero(~np.isnan(x)))
        if size is None or not seen:
            continue
        width, height = size
        # The first pixel's centre or corner, or 1, may be the origin.
        beyond = int(np.count_nonzero((x < -1.0) | (x > width + 1.0) | (y < -1.0) | (y > height + 1.0)))
        if beyond > _GROSS * seen:
            raise ArgumentError(
                f"camera {camera}: {beyond} of {seen} pixels lie outside of {width} x {height} pictures",
                hint=f"give the size of the pictures in which they were measured, width first; the largest x is "
                f"{np.nanmax(x):.0f}, and the largest y {np.nanmax(y):.0f}",
            )
