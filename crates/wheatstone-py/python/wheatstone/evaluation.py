"""How good a model is: errors on known points, held-out errors, methods compared."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

__all__ = [
    "BoardEvaluation",
    "Comparison",
    "Evaluation",
    "Fold",
    "MethodScore",
    "Validation",
    "number",
]


def number(value: object) -> float:
    """A figure as the library writes it: not a number where there is none."""
    return float(value) if isinstance(value, (int, float)) else math.nan


@dataclass(frozen=True)
class Evaluation:
    """The error on points with known places (for one camera: of pixels).

    Attributes
    ----------
    unit : str
        The unit of the lengths below.
    n, located : int
        Points that two cameras saw, and those of them that were located.
    rms, mean, median, p95 : float
        Of the distances from the true places.
    mean_percent : float
        The mean, as a percentage of the points' distances from the cameras.
    rms_xyz : (X, Y, Z)
        Root mean square along each axis.
    coverage : (float, float) or None
        Shares of the points within their 68 % and 95 % error ellipsoids.
    ratio_to_floor : float or None
        The rms error as a multiple of what pixel noise alone causes, where the data tell.
    budget : dict or None
        What the squared error is made of: pixel noise, lens model, chart poses, extrapolation.
    linear : dict or None
        Where most of the error is linear in the coordinates, as for a wrong pitch or a stage that moves obliquely:
        ``slopes``, by how much X, Y, Z are off (rows) for each unit of X, Y, Z (columns), and ``share``, that of the
        squared error.
    fitted_share : float
        The share of the points that the model was fitted to; 0 for new ones.
    """

    unit: str
    n: int
    located: int
    rms: float
    mean: float
    median: float
    p95: float
    mean_percent: float
    rms_xyz: tuple[float, float, float]
    coverage: tuple[float, float] | None = None
    ratio_to_floor: float | None = None
    budget: dict[str, Any] | None = None
    linear: dict[str, Any] | None = None
    fitted_share: float = 0.0

    @classmethod
    def of_figures(cls, told: Mapping[str, Any]) -> Evaluation:
        """Of figures as the library writes them."""
        x, y, z = told["rms_xyz"]
        covered, budget = told.get("coverage"), told.get("budget")
        return cls(
            unit=told["unit"],
            n=told["n"],
            located=told["located"],
            rms=number(told["rms"]),
            mean=number(told["mean"]),
            median=number(told["median"]),
            p95=number(told["p95"]),
            mean_percent=number(told["mean_percent"]),
            rms_xyz=(number(x), number(y), number(z)),
            coverage=None if covered is None else (covered["p68"], covered["p95"]),
            ratio_to_floor=None if budget is None else budget["ratio_to_floor"],
            budget=budget,
            linear=told.get("linear"),
            fitted_share=number(told.get("fitted_share", 0.0)),
        )


@dataclass(frozen=True)
class BoardEvaluation:
    """A model judged on boards whose poses nobody knows: by lengths and flatness, in `unit`.

    `details` has all figures: ``neighbours`` and ``across`` (distances between neighbours, and between the ends),
    ``flatness``, ``shape``, ``cameras`` (reprojection error of each) and ``views``.
    """

    unit: str
    n: int
    located: int
    details: dict[str, Any] = field(repr=False)

    @classmethod
    def of_figures(cls, told: dict[str, Any]) -> BoardEvaluation:
        """Of figures as the library writes them."""
        return cls(told["unit"], told["n"], told["located"], told)

    @property
    def length_error(self) -> float:
        """Mean error of the distances between neighbouring points."""
        return number(self.details["neighbours"]["bias"])

    @property
    def length_rms(self) -> float:
        """Rms error of the distances between neighbouring points."""
        return number(self.details["neighbours"]["error"]["rms"])

    @property
    def flatness_rms(self) -> float:
        """Rms distance of the points from the plane of their board."""
        return number(self.details["flatness"]["rms"])


@dataclass(frozen=True)
class Fold:
    """One view left out of the fit.

    Attributes
    ----------
    view : str
        Its name.
    kind : str
        ``"interpolation"``, or ``"extrapolation"`` for outermost views.
    located : int
        Its points that were located.
    rms : float
        Of their distances from the true places, in the unit of the whole; NaN where the fit failed.
    """

    view: str
    kind: str
    located: int
    rms: float


@dataclass(frozen=True)
class Validation:
    """Leave-one-view-out cross-validation: the error on views that the fit did not have.

    Attributes
    ----------
    all : Evaluation
        Of the points of all views together.
    folds : tuple of Fold
        Of each view, or group of views, alone.
    """

    all: Evaluation
    folds: tuple[Fold, ...] = field(repr=False)

    @classmethod
    def of_figures(cls, told: Mapping[str, Any]) -> Validation:
        """Of figures as the library writes them."""
        return cls(Evaluation.of_figures(told["all"]), tuple(_fold(fold) for fold in told["folds"]))


def _fold(told: Mapping[str, Any]) -> Fold:
    return Fold(
        str(told["view"]),
        str(told["kind"]),
        int(told.get("located", 0)),
        number(told.get("rms")),
    )


@dataclass(frozen=True)
class MethodScore:
    """One method in a `Comparison`: held-out errors, in its unit; NaN where it could not be fitted.

    Attributes
    ----------
    method : str
        Its name.
    rms, median, p95, mean_percent : float
        As in `Evaluation`.
    n, located : int
        Points that were left out once, and those of them that were located.
    fit_seconds : float
        How long a fit took.
    problem : str or None
        Why it could not be fitted, if so.
    folds : tuple of Fold
        Of each view, or group of views, alone.
    """

    method: str
    rms: float
    median: float
    p95: float
    mean_percent: float
    n: int
    located: int
    fit_seconds: float
    problem: str | None
    folds: tuple[Fold, ...] = field(repr=False)


@dataclass(frozen=True)
class Comparison:
    """Methods compared by leave-one-view-out cross-validation.

    Attributes
    ----------
    unit : str
        The unit of lengths.
    methods : tuple of MethodScore
        In the order in which they were asked for.
    chosen : str or None
        The one to use; None where none could be fitted.
    budget : dict or None
        What the squared error of the chosen one is made of, as in `Evaluation`.
    """

    unit: str
    methods: tuple[MethodScore, ...]
    chosen: str | None
    budget: dict[str, Any] | None = field(repr=False)

    @classmethod
    def of_figures(cls, told: Mapping[str, Any]) -> Comparison:
        """Of figures as the library writes them."""
        methods = tuple(
            MethodScore(
                row["method"],
                number(row["rms"]),
                number(row["median"]),
                number(row["p95"]),
                number(row["mean_percent"]),
                row["n"],
                row["located"],
                number(row["fit_seconds"]),
                row.get("problem"),
                tuple(_fold(fold) for fold in row["folds"]),
            )
            for row in told["methods"]
        )
        return cls(told["unit"], methods, told["chosen"], told.get("budget"))

    def __str__(self) -> str:
        lines = [f"{'method':<15} {'rms ' + self.unit:>10} {'median':>10} {'95 %':>10}"]
        for m in self.methods:
            figures = f"{m.rms:>10.4g} {m.median:>10.4g} {m.p95:>10.4g}"
            lines.append(f"{m.method:<15} {m.problem if m.problem and math.isnan(m.rms) else figures}")
        return "\n".join([*lines, f"chosen: {self.chosen}"])
