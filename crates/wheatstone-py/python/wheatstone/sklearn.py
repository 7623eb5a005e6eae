"""Calibration as a scikit-learn regressor: from matched pixels to points.

Needs scikit-learn 1.6 or later: ``pip install wheatstone[sklearn]``.
"""

# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false, reportUnknownVariableType=false, reportUnknownArgumentType=false
# scikit-learn has no types.

from __future__ import annotations

from collections.abc import Sequence
from numbers import Integral
from typing import Any, Literal, Union, overload

import numpy as np
import numpy.typing as npt
from sklearn.base import BaseEstimator, MultiOutputMixin, RegressorMixin
from sklearn.metrics import r2_score
from sklearn.utils import check_random_state
from sklearn.utils.validation import check_is_fitted, validate_data

from ._arrays import FloatArray, doubles
from ._named import has_names, in_order_of_cameras
from .calibration import Calibration
from .data import of_arrays
from .errors import (
    ArgumentError,
    DegenerateError,
    MismatchError,
    TooFewError,
    warn,
)
from .fitting import fit

__all__ = ["EXPECTED_FAILED_CHECKS", "StereoRegressor"]

EXPECTED_FAILED_CHECKS: dict[str, str] = {}
"""Checks of `sklearn.utils.estimator_checks` that `StereoRegressor` fails, and why."""

_UNFIT = (ArgumentError, DegenerateError, MismatchError, TooFewError)
"""What says that the data determine no camera model."""


class StereoRegressor(MultiOutputMixin, RegressorMixin, BaseEstimator):  # type: ignore[misc]
    """Places of points from what two or more cameras see of them, as a scikit-learn regressor.

    Parameters
    ----------
    method : str
        One of `wheatstone.METHODS`; ``"auto"`` chooses by held-out error.
    preset : str, optional
        Ready-made settings of the method.
    unit : str
        The unit of `y`, and of all that is predicted.
    random_state : int, RandomState or None
        The seed of every random choice. The same data and seed give the same bits.
    validate : bool
        Leave-one-view-out cross-validation in every fit: ``calibration_.validation``. Off, since scikit-learn
        cross-validates from outside.
    force : bool
        Go on in spite of faults that make a fit worthless.
    fallback : "affine" or None
        What is fitted where no camera model can be, because the columns are not those of two cameras or more,
        `y` has not three, or the data determine no model: an affine map by least squares (that of affine
        cameras), with a `DataWarning`. With None such data raise. Data with a fault that has a name raise
        either way.

    Attributes
    ----------
    calibration_ : Calibration or None
        The fitted model; None where an affine map took its place.
    affine_ : array, (1 + n_features_in_, outputs), or None
        The affine map, where there is one: its first row is the intercept.
    n_features_in_ : int
        Twice the number of cameras.
    feature_names_in_ : array of str
        The names of the columns of X, where it had any, in the order in which they are read.

    Notes
    -----
    Points that a model cannot locate, because fewer than two cameras saw them, are predicted as NaN. `score`
    counts each as if the mean of `y` had been predicted. Metrics of scikit-learn do not take NaN: leave such
    rows out before ``scoring="neg_root_mean_squared_error"`` and the like.

    Examples
    --------
    >>> import wheatstone as ws
    >>> from sklearn.model_selection import LeaveOneGroupOut, cross_val_score
    >>> from wheatstone.sklearn import StereoRegressor
    >>> data = ws.synth(rig="paper", noise=0.1, count=300)
    >>> regressor = StereoRegressor(method="brown", unit="cm")
    >>> left_out = {"groups": data.views, "cv": LeaveOneGroupOut()}
    >>> scores = cross_val_score(regressor, data.pixels, data.points, **left_out)
    >>> bool(scores.min() > 0.9)
    True
    """

    calibration_: Calibration | None
    affine_: FloatArray | None
    n_features_in_: int
    _spread: tuple[FloatArray, FloatArray] | None
    _flat: bool

    def __init__(
        self,
        method: str = "auto",
        *,
        preset: str | None = None,
        unit: str = "mm",
        random_state: int | np.random.RandomState | None = 0,
        validate: bool = False,
        force: bool = False,
        fallback: Literal["affine"] | None = "affine",
    ) -> None:
        self.method = method
        self.preset = preset
        self.unit = unit
        self.random_state = random_state
        self.validate = validate
        self.force = force
        self.fallback = fallback

    def __sklearn_tags__(self) -> Any:
        tags = super().__sklearn_tags__()
        tags.input_tags.allow_nan = True
        tags.target_tags.single_output = False
        return tags

    def fit(
        self,
        X: npt.ArrayLike,
        y: npt.ArrayLike,
        groups: Sequence[object] | npt.NDArray[Any] | None = None,
    ) -> StereoRegressor:
        """Calibrates.

        Parameters
        ----------
        X : array, (n, 2 * cameras)
            x and y in each camera, in pixels; NaN for both where a camera did not see the point. The columns of a
            DataFrame that are named as `wheatstone.fit` knows them, such as ``x1, y1, x2, y2``, are found by their
            names, in whatever order, and others passed over; without such names they are read by position.
        y : array, (n, 3)
            X, Y, Z of the points, in `unit`. What else there is, (n, outputs) or (n,), takes an affine map.
        groups : sequence of n labels, optional
            The view (placement of the chart) of each row; see `wheatstone.fit`.

        Returns
        -------
        StereoRegressor
            This one, fitted.

        Raises
        ------
        ValueError
            For arrays of the wrong shape, and for data that determine no model; its ``hint`` says what to do.
        """
        validated: Any = validate_data
        pixels, points = validated(
            self,
            _in_order(X),
            y,
            dtype=[np.float64, np.float32],
            ensure_all_finite="allow-nan",
            ensure_min_samples=2,
            multi_output=True,
            y_numeric=True,
        )
        self.calibration_, self.affine_, self._spread = None, None, None
        self._flat = points.ndim == 1
        try:
            _require_cameras(pixels, points)
            self.calibration_ = fit(
                # Rows that are resampled stand there twice by right.
                of_arrays(pixels, points, views=groups, unit=self.unit),
                method=self.method,
                preset=self.preset,
                seed=self._seed(),
                validate=self.validate,
                force=self.force,
            )
        except _UNFIT as problem:
            if self.fallback is None:
                raise
            self._fit_affine(pixels, points)
            warn(f"an affine map was fitted, since no camera model could be: {problem.args[0]}")
        return self

    def _seed(self) -> int:
        if isinstance(self.random_state, Integral):
            return int(self.random_state)
        return int(check_random_state(self.random_state).randint(2**31))

    def _fit_affine(self, pixels: npt.NDArray[Any], points: npt.NDArray[Any]) -> None:
        values = points.reshape(len(points), -1).astype(np.float64)
        seen = ~np.isnan(pixels).any(axis=1)
        if not seen.any():
            raise TooFewError(
                "no row has all its pixels", hint="an affine map needs rows that every camera saw"
            )
        rows = _with_one(pixels[seen])
        inverse = np.linalg.pinv(rows)
        affine = inverse @ values[seen]
        free = max(int(seen.sum()) - np.linalg.matrix_rank(rows), 1)
        residuals = values[seen] - rows @ affine
        self.affine_ = affine
        self._spread = (np.sqrt((residuals**2).sum(axis=0) / free), inverse @ inverse.T)

    @overload
    def predict(self, X: npt.ArrayLike, return_std: Literal[False] = False) -> FloatArray: ...
    @overload
    def predict(self, X: npt.ArrayLike, return_std: Literal[True]) -> tuple[FloatArray, FloatArray]: ...
    def predict(
        self, X: npt.ArrayLike, return_std: bool = False
    ) -> Union[FloatArray, tuple[FloatArray, FloatArray]]:
        """Locates points.

        Parameters
        ----------
        X : array, (n, 2 * cameras)
            As in `fit`.
        return_std : bool
            Whether to give standard deviations too.

        Returns
        -------
        points : array, (n, 3)
            X, Y, Z in `unit`; NaN where a point cannot be located. In the shape that `y` had in `fit`.
        sigmas : array, (n, 3)
            Their standard deviations, in `unit`; only with `return_std`.
        """
        check_is_fitted(self)
        validated: Any = validate_data
        pixels = validated(
            self, _in_order(X), reset=False, dtype=[np.float64, np.float32], ensure_all_finite="allow-nan"
        )
        if self.calibration_ is not None:
            if not return_std:
                return self.calibration_.predict(pixels)
            located = self.calibration_.locate(pixels)
            return located.points, located.sigmas
        assert self.affine_ is not None and self._spread is not None
        rows = _with_one(pixels)
        points = self._shaped(rows @ self.affine_)
        if not return_std:
            return points
        sigmas, covariance = self._spread
        leverage = np.einsum("ij,jk,ik->i", rows, covariance, rows)
        return points, self._shaped(np.sqrt(1.0 + leverage)[:, None] * sigmas)

    def _shaped(self, values: FloatArray) -> FloatArray:
        """One dimension where `y` had one."""
        return values[:, 0] if self._flat else values

    def score(
        self, X: npt.ArrayLike, y: npt.ArrayLike, sample_weight: npt.ArrayLike | None = None
    ) -> float:
        """The coefficient of determination R^2 of the distances from the true places.

        That is 1 minus the summed squared distances, divided by those of the true places from their mean.
        Scores of X, Y and Z are not averaged: in a view whose points have one Z, that of Z would say nothing.
        A point that was not located counts as if the mean of `y` had been predicted, so that leaving out
        difficult points does not raise the score.

        Parameters
        ----------
        X : array, (n, 2 * cameras)
        y : array, (n, 3)
        sample_weight : array, (n,), optional

        Returns
        -------
        float
            At most 1.
        """
        true = doubles(y, "y")
        true = true.reshape(len(true), -1)
        weights = None if sample_weight is None else doubles(sample_weight, "sample_weight")
        mean = np.average(true, axis=0, weights=weights)
        found = self.predict(X).reshape(true.shape)
        found = np.where(np.isnan(found), mean, found)
        score = r2_score(true, found, sample_weight=weights, multioutput="variance_weighted")
        return float(score)


def _in_order(X: Any) -> Any:
    """A table's columns as x1, y1, x2, y2, ... where its names say so; else what was given."""
    return in_order_of_cameras(X) if has_names(X) else X


def _require_cameras(pixels: npt.NDArray[Any], points: npt.NDArray[Any]) -> None:
    columns = pixels.shape[1]
    if columns % 2 or columns < 4:
        raise ArgumentError(
            f"X has {columns} columns", hint="give x and y of two cameras or more: x1, y1, x2, y2, ..."
        )
    if points.ndim != 2 or points.shape[1] != 3:
        raise ArgumentError(f"y has shape {points.shape}", hint="give X, Y, Z of each row: (n, 3)")


def _with_one(pixels: npt.NDArray[Any]) -> FloatArray:
    return np.hstack([np.ones((len(pixels), 1)), pixels])
