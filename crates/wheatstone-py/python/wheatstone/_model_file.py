"""The file of a model, and what it says of its fit."""

from __future__ import annotations

import json
from typing import Any, TypeVar

import numpy as np

import wheatstone._wheatstone as _w
from ._arrays import FloatArray, PathLike
from .data import Dataset
from .evaluation import Evaluation, Validation
from .findings import Finding

__all__ = ["ModelFile"]

Self = TypeVar("Self", bound="ModelFile")


class ModelFile:
    """A model as its file has it: read, written, compared, and asked for what was fitted and how well."""

    __slots__ = ("__weakref__", "_evidence_cache", "handle")
    handle: _w.Model
    """The extension module's object, for this package's own use."""
    _evidence_cache: dict[str, Any] | None

    def __init__(self, model: _w.Model) -> None:
        self.handle = model
        self._evidence_cache = None

    @classmethod
    def load(cls: type[Self], path: PathLike) -> Self:
        """Reads a model file.

        Parameters
        ----------
        path : path
            Of the file that `save` or `wheatstone fit` wrote.

        Returns
        -------
        Calibration

        Raises
        ------
        MissingFileError, FileError
            Where there is no such file, or it cannot be read.
        MalformedError
            Where it is no model.
        """
        return cls(_w.Model.load(path))

    @classmethod
    def from_bytes(cls: type[Self], data: bytes) -> Self:
        """Reads what `to_bytes` gave."""
        return cls(_w.Model.from_bytes(data))

    def save(self, path: PathLike) -> None:
        """Writes the model file; what was there before stays until the new one is whole.

        Raises
        ------
        FileError
            Where it cannot be written.
        """
        self.handle.save(path)

    def to_bytes(self) -> bytes:
        """The content of the model file: JSON in UTF-8."""
        return self.handle.to_bytes()

    def __eq__(self, other: object) -> bool:
        return isinstance(other, ModelFile) and (
            self.handle is other.handle or self.to_bytes() == other.to_bytes()
        )

    def __hash__(self) -> int:
        return hash(self.to_bytes())

    def __repr__(self) -> str:
        return f"<wheatstone.{type(self).__name__}: {self.method}, {self.cameras} cameras, {self.unit}>"

    @property
    def cameras(self) -> int:
        """The number of cameras."""
        return self.handle.cameras

    @property
    def unit(self) -> str:
        """The unit of world lengths."""
        return self.handle.unit

    @property
    def method(self) -> str:
        """The method that was fitted; that which `auto` chose."""
        return self.handle.method

    @property
    def data(self) -> Dataset:
        """The points that it was fitted to."""
        return Dataset(self.handle.data())

    @property
    def _evidence(self) -> dict[str, Any]:
        cached = self._evidence_cache
        if cached is None:
            told: dict[str, Any] = json.loads(self.handle.evidence())
            self._evidence_cache = cached = told
        return cached

    @property
    def training(self) -> Evaluation:
        """The error on the points that it was fitted to: no measure of its error on new ones."""
        return Evaluation.of_figures(self._evidence["training"])

    @property
    def validation(self) -> Validation | None:
        """The held-out error: leave-one-view-out cross-validation.

        None where it was not asked for (``validate=False``), for cameras that other programs calibrated, and where no
        fit without a view succeeds: of two views one remains, which is too little for most methods where charts are
        flat. Then `wheatstone.compare` says why; take a third view, or hold the
        model against other points with `Calibration.evaluate`.
        """
        told = self._evidence["validation"]
        return None if told is None else Validation.of_figures(told)

    @property
    def findings(self) -> list[Finding]:
        """Faults that were found in the data before the fit."""
        return [Finding.of_figures(told, first_camera=1) for told in self._evidence["findings"]]

    @property
    def broken(self) -> str | None:
        """Why the model is unusable, if it is."""
        return self.handle.broken

    @property
    def viewpoint(self) -> FloatArray | None:
        """(3,), the middle of the cameras in the world, where it is known: by the direct linear transformation of the
        points, whatever the method."""
        told = self._evidence["viewpoint"]
        return None if told is None else np.asarray(told, dtype=np.float64)

    @property
    def image_sizes(self) -> list[tuple[int, int] | None]:
        """Width and height of each camera's pictures, where they are known."""
        return [None if size is None else (size[0], size[1]) for size in self._evidence["sizes"]]

    @property
    def intrinsics(self) -> list[dict[str, Any]] | None:
        """Intrinsic parameters of each camera with standard deviations and correlations; None for a map without
        cameras."""
        told: list[dict[str, Any]] | None = self._evidence["intrinsics"]
        return told

    @property
    def relative_poses(self) -> list[dict[str, Any]] | None:
        """Where each camera but the first stands: ``camera`` (from 0), ``baseline`` (the distance of its projection centre
        from the first's) and ``angle`` (between the optical axes, radians), with ``baseline_sigma`` and ``angle_sigma``,
        their standard deviations, or None where the method does not tell; None for a map without cameras."""
        told: list[dict[str, Any]] | None = self._evidence["relative_poses"]
        return told

    @property
    def outliers(self) -> list[dict[str, Any]]:
        """Points that were excluded as gross outliers: ``view``, ``id``, ``cameras`` (from 1), ``residual`` (px)."""
        told: list[dict[str, Any]] = self._evidence["outliers"]
        return told
