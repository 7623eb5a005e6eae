"""What comes out: located points, evaluations, findings, comparisons, reports."""

from __future__ import annotations

import enum
import html
import json
import math
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, overload

import numpy as np
import numpy.typing as npt

import wheatstone._wheatstone as _w
from ._arrays import FloatArray, PathLike, pyarrow
from .data import Dataset

__all__ = [
    "BoardEvaluation",
    "CameraChange",
    "CameraMotion",
    "Comparison",
    "Evaluation",
    "Examination",
    "Finding",
    "Fold",
    "Located",
    "MethodScore",
    "Rectification",
    "Report",
    "Trust",
    "Validation",
]


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
            raise AttributeError("no covariance was asked for: locate(..., covariance=True)")
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


def _number(value: object) -> float:
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
            rms=_number(told["rms"]),
            mean=_number(told["mean"]),
            median=_number(told["median"]),
            p95=_number(told["p95"]),
            mean_percent=_number(told["mean_percent"]),
            rms_xyz=(_number(x), _number(y), _number(z)),
            coverage=None if covered is None else (covered["p68"], covered["p95"]),
            ratio_to_floor=None if budget is None else budget["ratio_to_floor"],
            budget=budget,
            fitted_share=_number(told.get("fitted_share", 0.0)),
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
        return _number(self.details["neighbours"]["bias"])

    @property
    def length_rms(self) -> float:
        """Rms error of the distances between neighbouring points."""
        return _number(self.details["neighbours"]["error"]["rms"])

    @property
    def flatness_rms(self) -> float:
        """Rms distance of the points from the plane of their board."""
        return _number(self.details["flatness"]["rms"])


@dataclass(frozen=True)
class Fold:
    """One view left out of the fit: `kind` is ``"interpolation"``, or ``"extrapolation"`` for outermost views."""

    view: str
    kind: str
    located: int
    rms: float


@dataclass(frozen=True)
class Validation:
    """Leave-one-view-out cross-validation: the error on views that the fit did not have."""

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
        _number(told.get("rms")),
    )


@dataclass(frozen=True)
class Finding:
    """A fault of the data.

    Attributes
    ----------
    code : str
        Its name, in kebab case.
    severity : str
        ``"information"``, ``"warning"`` or ``"fatal"``.
    explanation, hint : str
        What is wrong and where (cameras counted from 1 there), and what to do about it.
    views, cameras : tuple
        The views and cameras (counted from 0) that have it; none for all of them.
    fixable : bool
        Whether it can be corrected: `Examination.repaired`, ``fit(..., fix=True)``.
    figures : dict
        Figures that say so.
    """

    code: str
    severity: str
    explanation: str
    hint: str
    views: tuple[str, ...] = ()
    cameras: tuple[int, ...] = ()
    fixable: bool = False
    figures: Mapping[str, float] = field(default_factory=lambda: dict[str, float](), repr=False)

    def __str__(self) -> str:
        return f"{self.severity}[{self.code}]: {self.explanation}\n  hint: {self.hint}"


class Examination(Sequence[Finding]):
    """What `wheatstone.check` found: a sequence of `Finding`, the worst first."""

    __slots__ = ("_told", "findings", "_examination")

    def __init__(self, examination: _w.Examination) -> None:
        self._examination = examination
        self._told: dict[str, Any] = json.loads(examination.told())
        self.findings: tuple[Finding, ...] = tuple(
            Finding(
                told["code"],
                told["severity"],
                told["explanation"],
                told["hint"],
                tuple(told["views"]),
                tuple(told["cameras"]),
                told["fixable"],
                {name: _number(value) for name, value in told["figures"].items()},
            )
            for told in self._told["findings"]
        )

    def __len__(self) -> int:
        return len(self.findings)

    @overload
    def __getitem__(self, index: int) -> Finding: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[Finding, ...]: ...
    def __getitem__(self, index: int | slice) -> Finding | tuple[Finding, ...]:
        return self.findings[index]

    def __iter__(self) -> Iterator[Finding]:
        return iter(self.findings)

    def __repr__(self) -> str:
        return f"<wheatstone.Examination: {[finding.code for finding in self.findings]}>"

    def __str__(self) -> str:
        lines = [str(finding) for finding in self.findings] or ["No fault found"]
        lines.append("What these data cannot show:")
        lines += [f"  {what}: {check}" for what, check in self.cannot_be_seen]
        return "\n".join(lines)

    @property
    def fatal(self) -> bool:
        """Whether a fit to these data would be wrong."""
        return any(finding.severity == "fatal" for finding in self.findings)

    @property
    def cannot_be_seen(self) -> list[tuple[str, str]]:
        """What nobody could see in these data, and what would tell."""
        return [(told["what"], told["check"]) for told in self._told["cannot_be_seen"]]

    @property
    def layout(self) -> list[dict[str, Any]]:
        """Where the cameras stand by these data: ``camera`` (from 0), ``baseline``, ``words``."""
        layout: list[dict[str, Any]] = self._told["layout"]
        return layout

    def repaired(self) -> Dataset:
        """The data with the faults corrected that can be."""
        return Dataset(self._examination.repaired())


@dataclass(frozen=True)
class CameraChange:
    """One change since the fit.

    Attributes
    ----------
    cameras : tuple of int
        The camera, counted from 0; others follow that the pixels do not tell from it, the likeliest first.
    confidence : tuple of float
        The probability of each.
    change : str
        ``"turn"``, ``"shift"``, ``"turn-and-shift"`` or ``"focal-length"``.
    together : bool
        Whether all cameras moved alike, or the chart's frame is another one.
    turn, turn_sigma : (pitch, yaw, roll)
        A rotation vector about the camera's own axes, in degrees, and its standard deviations.
    shift, shift_sigma : (x, y, z)
        Along the camera's own axes, in the unit of the model.
    focal_length, focal_length_sigma : float
        The relative change of the focal length.
    """

    cameras: tuple[int, ...]
    confidence: tuple[float, ...]
    change: str
    together: bool
    turn: tuple[float, ...]
    turn_sigma: tuple[float, ...]
    shift: tuple[float, ...]
    shift_sigma: tuple[float, ...]
    focal_length: float
    focal_length_sigma: float


@dataclass(frozen=True)
class CameraMotion:
    """Whether cameras still stand as they did when the model was fitted.

    Attributes
    ----------
    changes : tuple of CameraChange
        None where nothing moved.
    chance : float
        The probability that cameras which did not move look so, or more so.
    explained : bool
        Whether the changes, if there are any, leave no more than noise.
    noticeable : list of dict
        The least turn (degrees), shift and change of focal length of each camera that would be noticed 19 times
        in 20.
    details : dict
        All figures.
    """

    changes: tuple[CameraChange, ...]
    chance: float
    explained: bool
    noticeable: list[dict[str, Any]] = field(repr=False)
    details: dict[str, Any] = field(repr=False)

    @classmethod
    def of_figures(cls, told: dict[str, Any]) -> CameraMotion:
        """Of figures as the library writes them."""
        changes = tuple(
            CameraChange(
                tuple(change["cameras"]),
                tuple(_number(value) for value in change["confidence"]),
                str(change["change"]),
                bool(change["together"]),
                tuple(_number(value) for value in change["turn"]),
                tuple(_number(value) for value in change["turn_sigma"]),
                tuple(_number(value) for value in change["shift"]),
                tuple(_number(value) for value in change["shift_sigma"]),
                _number(change["focal_length"]),
                _number(change["focal_length_sigma"]),
            )
            for change in told["changes"]
        )
        return cls(changes, _number(told["chance"]), told["explained"], told["noticeable"], told)

    @property
    def moved(self) -> bool:
        """Whether a camera moved."""
        return bool(self.changes)


@dataclass(frozen=True)
class MethodScore:
    """One method in a `Comparison`: held-out errors, in its unit; NaN where it could not be fitted."""

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
    """Methods compared by leave-one-view-out cross-validation; `chosen` is the one to use."""

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
                _number(row["rms"]),
                _number(row["median"]),
                _number(row["p95"]),
                _number(row["mean_percent"]),
                row["n"],
                row["located"],
                _number(row["fit_seconds"]),
                row.get("problem"),
                tuple(_fold(fold) for fold in row["folds"]),
            )
            for row in told["methods"]
        )
        return cls(told["unit"], methods, told["chosen"], told.get("budget"))

    def __str__(self) -> str:
        lines = [f"{'method':<15} {'rms ' + self.unit:>10} {'median':>10} {'95 %':>10}"]
        lines += [f"{m.method:<15} {m.rms:>10.4g} {m.median:>10.4g} {m.p95:>10.4g}" for m in self.methods]
        return "\n".join([*lines, f"chosen: {self.chosen}"])


@dataclass(frozen=True)
class Report:
    """The report on a model: one HTML page that needs no network, shown by itself in notebooks."""

    html: str = field(repr=False)
    verdict: str
    summary: dict[str, Any] = field(repr=False)
    """All figures."""

    def save(self, path: PathLike) -> None:
        """Writes the page; what was there before stays until the new one is whole."""
        beside = f"{os.fspath(path)}.{os.getpid()}.tmp"
        try:
            with open(beside, "w", encoding="utf-8") as file:
                file.write(self.html)
            os.replace(beside, path)
        except BaseException:
            if os.path.exists(beside):
                os.unlink(beside)
            raise

    def _repr_html_(self) -> str:
        page = html.escape(self.html, quote=True)
        style = "width:100%;height:640px;border:0"
        return f'<iframe srcdoc="{page}" sandbox="allow-scripts" style="{style}"></iframe>'


@dataclass(frozen=True)
class Rectification:
    """A virtual rectified pair of two cameras.

    Attributes
    ----------
    left_map, right_map : ((height, width), (height, width)) float32
        x and y of the place in the picture that each rectified pixel shows, for ``cv2.remap``; -1 for none.
    P1, P2 : (3, 4)
        Projection matrices of the virtual cameras, in the left one's frame.
    Q : (4, 4)
        From (x, y, disparity, 1) to homogeneous places in the left virtual camera's frame, as OpenCV has it.
    world : (3, 4)
        From that frame to the world: ``world @ [x, y, z, 1]``.
    cameras : (int, int)
        The model's cameras, counted from 0, that became left and right.
    size : (int, int)
        Width and height.
    focal, baseline : float
        Focal length in pixels; baseline in `unit`.
    vertical_error : dict
        What is left of vertical differences, in pixels, over the calibrated volume and of measured points.
    """

    left_map: tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]] = field(repr=False)
    right_map: tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]] = field(repr=False)
    P1: FloatArray = field(repr=False)
    P2: FloatArray = field(repr=False)
    Q: FloatArray = field(repr=False)
    world: FloatArray = field(repr=False)
    cameras: tuple[int, int]
    size: tuple[int, int]
    focal: float
    baseline: float
    unit: str
    vertical_error: dict[str, Any] = field(repr=False)
