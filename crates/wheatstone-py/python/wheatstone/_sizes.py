"""Sizes of pictures, as users give them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Union, cast

import numpy as np

from .errors import ArgumentError

ImageSize = Union[tuple[int, int], Sequence["tuple[int, int] | None"], None]
"""Width and height of the pictures: one pair for all cameras, or one a camera."""


def image_sizes(size: ImageSize, cameras: int) -> list[list[int] | None]:
    """One width and height a camera."""
    if size is None:
        return [None] * cameras
    if len(size) == 2 and all(isinstance(side, (int, np.integer)) for side in size):
        pair = cast("tuple[int, int]", size)
        return [[int(pair[0]), int(pair[1])]] * cameras
    each = cast("Sequence[tuple[int, int] | None]", size)
    if len(each) != cameras:
        raise ArgumentError(
            f"{len(each)} image sizes for {cameras} cameras", hint="give (width, height), or one a camera"
        )
    return [None if pair is None else [int(pair[0]), int(pair[1])] for pair in each]
