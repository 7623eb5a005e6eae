"""How noisy pixels are, as users say it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from ._arguments import items, positive
from ._arrays import FloatArray, Numbers, doubles
from .errors import ArgumentError

_HINT = "give a value above 0, in pixels"


def sigmas_of(value: npt.ArrayLike, rows: int, cameras: int) -> float | FloatArray:
    """One standard deviation for all pixels of so many rows, or an array (n, cameras) with one for each."""
    if isinstance(value, str) or getattr(value, "shape", None) == () or not hasattr(value, "__len__"):
        return positive(value, "pixel_sigma", _HINT)
    given = doubles(value, "pixel_sigma")
    if given.shape not in ((rows,), (rows, cameras)):
        raise ArgumentError(
            f"pixel_sigma has shape {given.shape}",
            hint=f"give one value, one for each row: shape ({rows},), or one for each pixel: shape ({rows}, {cameras})",
        )
    each: FloatArray = np.broadcast_to(given[:, None] if given.ndim == 1 else given, (rows, cameras))
    return np.ascontiguousarray(each)


def typical(sigmas: float | FloatArray | None, pixels: Numbers) -> float | None:
    """One standard deviation for the first pixels: the root of the mean square of theirs."""
    if not isinstance(sigmas, np.ndarray):
        return sigmas
    seen = np.isfinite(pixels[:512]).reshape(-1, sigmas.shape[1], 2).all(axis=2)
    own = sigmas[:512][seen]
    return float(np.sqrt(np.mean(own * own))) if len(own) else None


def sigma_or_columns(value: float | str | Sequence[str] | None) -> float | list[str] | None:
    """One standard deviation, or the names of the columns that have it."""
    if value is None:
        return None
    if isinstance(value, str):
        return [value]
    names = items(value)
    if names and all(isinstance(name, str) for name in names):
        return names
    return positive(value, "pixel_sigma", f"{_HINT}, or the name of a column, or one for each camera")
