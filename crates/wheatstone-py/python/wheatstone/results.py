"""What is handed on: reports, and rectified pairs."""

from __future__ import annotations

import html
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from ._arrays import FloatArray, PathLike, doubles

__all__ = ["Rectification", "Report"]


@dataclass(frozen=True)
class Report:
    """The report on a model: one HTML page that needs no network, shown by itself in notebooks.

    Attributes
    ----------
    html : str
        The page.
    verdict : str
        Its first sentence: how good the model is.
    summary : dict
        All figures.
    """

    html: str = field(repr=False)
    verdict: str
    summary: dict[str, Any] = field(repr=False)

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

    @classmethod
    def of_figures(cls, maps: Sequence[npt.NDArray[np.float32]], told: Mapping[str, Any]) -> Rectification:
        """Of the maps, x and y on the left and on the right, and figures as the library writes them."""
        back: FloatArray = np.transpose(doubles(told["rotation"], "rotation"))
        pair = told["pair"]
        return cls(
            (maps[0], maps[1]),
            (maps[2], maps[3]),
            doubles(told["P1"], "P1"),
            doubles(told["P2"], "P2"),
            doubles(told["Q"], "Q"),
            np.column_stack([back, -back @ doubles(told["translation"], "translation")]),
            (pair["cameras"][0], pair["cameras"][1]),
            (pair["size"][0], pair["size"][1]),
            pair["focal"],
            pair["baseline"],
            pair["unit"],
            told["leftover"],
        )
