"""Synthetic data with known truth."""

from __future__ import annotations

import json

import wheatstone._wheatstone as _w
from ._arguments import several, whole
from ._arrays import PathLike
from .charts import Chart
from .data import Dataset, Progress

__all__ = ["synth", "synth_capture"]


DISTANCES = (50.0, 140.0, 15.0)
"""Nearest and farthest distance of the chart, and the step between them, in centimetres."""


def _scene(
    rig: str,
    cameras: int,
    noise: float | str,
    count: int | None,
    random: int | None,
    hand_held: int | None,
    distances: tuple[float, float, float],
    seed: int,
    chart: Chart | None,
) -> str:
    counts = {
        name: None if value is None else whole(value, name, "give a whole number above 0", least=1)
        for name, value in (("count", count), ("random", random), ("hand_held", hand_held))
    }
    near, far, step = several(distances, 3, "distances", "give the nearest, the farthest and the step: (50, 140, 15)")
    return json.dumps(
        {
            "rig": rig,
            "cameras": whole(cameras, "cameras", "give a whole number above 0"),
            "noise": str(noise),
            **counts,
            "near": near,
            "far": far,
            "step": step,
            "seed": whole(seed, "seed", "give a whole number from 0 to 2**64 - 1"),
            "chart": None if chart is None else chart.settings,
        }
    )


def synth(
    rig: str = "paper",
    *,
    cameras: int = 2,
    noise: float | str = 0.1,
    count: int | None = None,
    random: int | None = None,
    hand_held: int | None = None,
    distances: tuple[float, float, float] = DISTANCES,
    seed: int = 0,
    chart: Chart | None = None,
) -> Dataset:
    """Synthetic data with known truth, in centimetres.

    Parameters
    ----------
    rig : str
        One of `wheatstone.RIGS`: the cameras and the optics before them.
    cameras : int
        How many there are.
    noise : float, "quantised" or "none"
        Standard deviation of a pixel coordinate; or whole pixels.
    count : int, optional
        Keep at most so many chart points, chosen at random.
    random : int, optional
        So many points at random places, instead of a chart on a stage.
    hand_held : int, optional
        A board in the hand in so many views, its poses not given.
    distances : (nearest, farthest, step)
        Of the chart, in centimetres.
    seed : int
        Of the noise, and of what is chosen at random. The same one gives the same data.
    chart : Chart, optional
        A line grid that fills the pictures otherwise.

    Returns
    -------
    Dataset

    Examples
    --------
    >>> import wheatstone as ws
    >>> ws.synth(rig="fisheye", cameras=3, random=100)
    <wheatstone.Dataset: 100 points, 3 cameras, 0 views, cm>
    """
    return Dataset(
        _w.synth(_scene(rig, cameras, noise, count, random, hand_held, distances, seed, chart))
    )


def synth_capture(
    folder: PathLike,
    rig: str = "paper",
    *,
    cameras: int = 2,
    hand_held: int | None = None,
    distances: tuple[float, float, float] = DISTANCES,
    seed: int = 0,
    chart: Chart | None = None,
    progress: Progress | None = None,
) -> None:
    """Renders pictures of a chart before synthetic cameras: a capture, with the true cameras beside it.

    Parameters
    ----------
    folder : path
        Is made where there is none; files in it that are called alike are written anew.
    rig, cameras, hand_held, distances, seed, chart
        As in `synth`.
    progress : callable, optional
        Called as ``progress(task, done, total)``.

    Raises
    ------
    FileError
        Where the folder cannot be written.
    """
    scene = _scene(rig, cameras, "none", None, None, hand_held, distances, seed, chart)
    _w.synth_capture(folder, scene, progress)
