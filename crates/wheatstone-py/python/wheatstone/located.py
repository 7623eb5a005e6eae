"""Located points: where they are, how sure that is, and whether the fit had data there."""

from __future__ import annotations

import enum
from typing import Any

import numpy as np
import numpy.typing as npt

from ._arrays import FloatArray, pyarrow
from .errors import NotComputedError

__all__ = ["Located", "Trust"]


class Trust(enum.IntEnum):
    """Whether a point lies where the fit had data."""

    INSIDE = 0
    """Within the calibrated volume."""
    EDGE = 1
    """Beyond it by no more than a twentieth of its width."""
    OUTSIDE = 2
    """Further beyond: error bars are extrapolated there."""
    NOT_LOCATED = 3
    """The point was not located."""


_TRUST = ("inside", "edge", "outside")


class Located:
    """Located points, in the order of their pixels; NaN where a point was not located.

    Attributes are views of one block of memory, column by column; nothing is copied.

    Examples
    --------
    >>> import wheatstone as ws
    >>> data = ws.synth(noise=0.1, count=300)
    >>> located = ws.fit(data, method="brown", validate=False).locate(data.pixels)
    >>> good = (located.trust <= ws.Trust.EDGE) & ~located.mismatch
    >>> located.points[good].shape[1], bool((located.sigmas[good] < 1.0).all())
    (3, True)
    """

    __slots__ = ("_codes", "_columns", "unit")
    unit: str
    """The unit of lengths."""

    def __init__(self, columns: FloatArray, codes: npt.NDArray[np.uint8], unit: str) -> None:
        self._columns = columns
        self._codes = codes
        self.unit = unit

    def __len__(self) -> int:
        return int(self._columns.shape[1])

    def __repr__(self) -> str:
        located = int(np.count_nonzero(~np.isnan(self._columns[0])))
        return f"<wheatstone.Located: {located} of {len(self)} points, {self.unit}>"

    @property
    def points(self) -> FloatArray:
        """(n, 3), X, Y, Z in the world, in `unit`."""
        columns: Any = self._columns
        points: FloatArray = columns[0:3].T
        return points

    @property
    def sigmas(self) -> FloatArray:
        """(n, 3), standard deviations of X, Y, Z, in `unit`."""
        columns: Any = self._columns
        sigmas: FloatArray = columns[3:6].T
        return sigmas

    @property
    def residual(self) -> FloatArray:
        """(n,), rms reprojection error of each point over its pixel coordinates, in pixels."""
        residual: FloatArray = self._columns[6]
        return residual

    @property
    def covariance(self) -> FloatArray:
        """(n, 3, 3), covariance of X, Y, Z, in `unit` squared; needs ``locate(..., covariance=True)``."""
        if len(self._columns) < 13:
            raise NotComputedError(
                "no covariance was asked for", hint="ask for it: `locate(..., covariance=True)`"
            )
        xx, xy, xz, yy, yz, zz = self._columns[7:13]
        full: FloatArray = np.empty((len(self), 3, 3))
        for row, values in enumerate(((xx, xy, xz), (xy, yy, yz), (xz, yz, zz))):
            for column, value in enumerate(values):
                full[:, row, column] = value
        return full

    @property
    def trust(self) -> npt.NDArray[np.uint8]:
        """(n,), a value of `Trust` each."""
        trust: npt.NDArray[np.uint8] = self._codes[0]
        return trust

    @property
    def mismatch(self) -> npt.NDArray[np.bool_]:
        """(n,), whether the rays do not intersect: the pixels are probably mismatched."""
        mismatch: npt.NDArray[np.bool_] = self._codes[1].view(np.bool_)
        return mismatch

    def to_arrow(self) -> Any:
        """A pyarrow table with columns X, Y, Z, sX, sY, sZ, residual, trust, mismatch; nulls where not located.

        Needs pyarrow.
        """
        pa = pyarrow()
        names = ["X", "Y", "Z", "sX", "sY", "sZ", "residual"]
        columns: dict[str, Any] = {
            name: pa.array(column, from_pandas=True)
            for name, column in zip(names, self._columns)
        }
        codes = pa.array(self.trust, mask=self.trust == Trust.NOT_LOCATED)
        columns["trust"] = pa.DictionaryArray.from_arrays(codes.cast(pa.int8()), pa.array(_TRUST))
        columns["mismatch"] = pa.array(self.mismatch)
        covariances = ["cXX", "cXY", "cXZ", "cYY", "cYZ", "cZZ"]
        for name, column in zip(covariances, self._columns[7:]):
            columns[name] = pa.array(column, from_pandas=True)
        return pa.table(columns)
