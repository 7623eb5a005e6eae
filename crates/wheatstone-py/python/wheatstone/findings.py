"""What is wrong: faults of the data, and cameras that moved since the fit."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, overload

import wheatstone._wheatstone as _w
from .data import Dataset
from .evaluation import number

__all__ = ["CameraChange", "CameraMotion", "Examination", "Finding"]


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

    @classmethod
    def of_figures(cls, told: Mapping[str, Any], first_camera: int) -> Finding:
        """Of its JSON, whose first camera has this number."""
        return cls(
            told["code"],
            told["severity"],
            told["explanation"],
            told["hint"],
            tuple(told["views"]),
            tuple(camera - first_camera for camera in told["cameras"]),
            told.get("fixable", told.get("repaired", False)),
            {name: number(value) for name, value in told.get("figures", {}).items()},
        )

    def __str__(self) -> str:
        return f"{self.severity}[{self.code}]: {self.explanation}\n  hint: {self.hint}"


class Examination(Sequence[Finding]):
    """What `wheatstone.check` found: a sequence of `Finding`, the worst first."""

    __slots__ = ("_told", "findings", "_examination")

    def __init__(self, examination: _w.Examination) -> None:
        self._examination = examination
        self._told: dict[str, Any] = json.loads(examination.told())
        self.findings: tuple[Finding, ...] = tuple(
            Finding.of_figures(told, first_camera=0) for told in self._told["findings"]
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
        """The data with the faults corrected that can be.

        Raises
        ------
        DegenerateError
            Where the findings are not to be believed: most views are blamed one by one, or views that are not touched
            fit worse after it.
        """
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
                tuple(number(value) for value in change["confidence"]),
                str(change["change"]),
                bool(change["together"]),
                tuple(number(value) for value in change["turn"]),
                tuple(number(value) for value in change["turn_sigma"]),
                tuple(number(value) for value in change["shift"]),
                tuple(number(value) for value in change["shift_sigma"]),
                number(change["focal_length"]),
                number(change["focal_length_sigma"]),
            )
            for change in told["changes"]
        )
        return cls(changes, number(told["chance"]), told["explained"], told["noticeable"], told)

    @property
    def moved(self) -> bool:
        """Whether a camera moved."""
        return bool(self.changes)
