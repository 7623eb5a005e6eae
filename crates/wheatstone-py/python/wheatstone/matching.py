"""Dense matching of rectified pairs."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

import wheatstone._wheatstone as _w
from ._arguments import several_whole
from ._arrays import FloatArray
from ._pictures import Image, as_picture

__all__ = ["DisparityMap", "match_pair"]


@dataclass(frozen=True)
class DisparityMap:
    """Disparities of every pixel of the left picture of a rectified pair.

    Attributes
    ----------
    disparity : (height, width) float32
        x on the left less x on the right, in pixels; NaN where there is none.
    confidence : (height, width) float32
        The probability that the disparity is less than one pixel off; 0 where there is none, or where it was filled
        in.
    sigma : (height, width) float32
        Its standard deviation in pixels, where it is no gross error.
    vertical_offset : float or None
        How many rows lower the right picture shows things, as the median of corners; None where too few were found
        again. A pair that is rectified well has less than half a pixel.
    """

    disparity: npt.NDArray[np.float32] = field(repr=False)
    confidence: npt.NDArray[np.float32] = field(repr=False)
    sigma: npt.NDArray[np.float32] = field(repr=False)
    vertical_offset: float | None

    def density(self, confidence: float = 0.9) -> float:
        """The share of all pixels, of 0 to 1, whose confidence is above a bound."""
        return float(np.mean(self.confidence > confidence))

    def pixels(self, confidence: float = 0.9) -> FloatArray:
        """Matched pixels (n, 4), left then right, whose confidence is above a bound: what `Calibration.locate` takes
        of a model of the rectified pair."""
        rows, columns = np.nonzero(self.confidence > confidence)
        across = columns - self.disparity[rows, columns].astype(np.float64)
        return np.stack([columns, rows, across, rows], axis=1).astype(np.float64)


def match_pair(
    left: Image,
    right: Image,
    range: tuple[int, int],
    *,
    refine: bool = True,
    fill: bool = False,
    bgr: bool = False,
) -> DisparityMap:
    """Matches a rectified pair: what both pictures show lies in one row.

    Parameters
    ----------
    left, right : arrays, (height, width) or (height, width, 3)
        uint8, uint16, or floating-point numbers of 0 to 255.
    range : (int, int)
        Disparities to search, from the first to before the second. They may be negative.
    refine : bool
        Whether disparities are refined by least squares.
    fill : bool
        Whether gaps are filled with the disparities of what is behind, with no confidence.
    bgr : bool
        Whether colours stand in OpenCV's order (blue first).

    Returns
    -------
    DisparityMap

    Raises
    ------
    ArgumentError
        Where the pictures have two sizes, or the range is empty, too large or leads out of the picture.

    Examples
    --------
    >>> import numpy as np, wheatstone as ws
    >>> texture = np.random.default_rng(1).integers(0, 255, (60, 120), dtype=np.uint8)
    >>> found = ws.match_pair(texture[:, :100], texture[:, 5:105], (0, 16))
    >>> float(np.nanmedian(found.disparity).round(1))
    5.0
    """
    first, end = several_whole(range, 2, "range", "give the first disparity, and that after the last: (0, 64)")
    pair = (as_picture(left), as_picture(right))
    return DisparityMap(*_w.match_pair(pair, (first, end), refine, fill, bgr))
