"""Points a second by the Python package beside OpenCV's, on the same pixels, one thread, CPU time, in one run.

    python bench/peers/python.py [POINTS] [RUNS] [target/release/deps/locate-*]

Needs the package, NumPy and opencv-python-headless. Prints each figure and its ratio to OpenCV's `undistortPoints` (twice) with
`triangulatePoints`, which give points without error bars; to the library's own figure too, where its benchmark is given
(`cargo bench --bench locate --no-run`).
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable

os.environ["WHEATSTONE_THREADS"] = os.environ["OPENBLAS_NUM_THREADS"] = "1"

import cv2  # noqa: E402
import numpy as np  # noqa: E402

import wheatstone as ws  # noqa: E402

METHODS = ("brown", "dlt", "network", "neural-camera")


def library(program: str, method: str, millions: int) -> float:
    """CPU seconds a point of the library alone, without those of the fit."""

    def seconds(count: int) -> float:
        before = os.times()
        subprocess.run([program, method, "points", str(count), "1"], check=True)
        after = os.times()
        return sum(after[2:4]) - sum(before[2:4])

    return (seconds(1 + millions) - seconds(1)) / millions / 1e6


def main(points: int, runs: int, program: str | None) -> None:
    cv2.setNumThreads(1)
    data = ws.synth(rig="paper", noise=0.1)
    models = {name: ws.fit(data, method=name, validate=False) for name in METHODS}
    some = ws.synth(rig="paper", noise=0.1, random=100_000, seed=5).pixels
    noise = np.random.default_rng(1).normal(0, 0.05, (points, 4))
    pixels = np.resize(some, (points, 4)) + noise
    told = models["brown"].to_opencv(image_size=(640, 480))
    first = np.hstack([np.eye(3), np.zeros((3, 1))])
    second = np.hstack([told["R"], told["T"]])

    def opencv() -> object:
        left = cv2.undistortPoints(pixels[:, None, 0:2], told["K1"], told["D1"]).reshape(-1, 2)
        right = cv2.undistortPoints(pixels[:, None, 2:4], told["K2"], told["D2"]).reshape(-1, 2)
        found = cv2.triangulatePoints(first, second, left.T, right.T)
        return (found[:3] / found[3]).T

    work: dict[str, Callable[[], object]] = {"OpenCV": opencv}
    for name, model in models.items():
        work[f"{name}: predict"] = lambda model=model: model.predict(pixels)
        work[f"{name}: locate"] = lambda model=model: model.locate(pixels)
    columns, out = np.asfortranarray(pixels), np.empty((points, 3))
    work["brown: predict, Fortran order"] = lambda: models["brown"].predict(columns)
    work["brown: predict, out="] = lambda: models["brown"].predict(pixels, out)
    seconds: dict[str, list[float]] = {name: [] for name in work}
    alone: dict[str, list[float]] = {name: [] for name in METHODS if program}
    for _ in range(runs + 1):
        for name, times in alone.items():
            times.append(library(program, name, 30))
        for name, run in work.items():
            began = time.process_time()
            run()
            seconds[name].append(time.process_time() - began)
    # The first run of each makes what later ones use.
    medians = {name: float(np.median(times[1:])) for name, times in seconds.items()}
    for name, median in medians.items():
        beside = f"{medians['OpenCV'] / median:7.1f} times OpenCV"
        method, _, what = name.partition(": ")
        if what == "predict" and method in alone:
            beside += f", {points * float(np.median(alone[method])) / median:.2f} of the library"
        print(f"{name:30} {points / median / 1e6:7.2f} million/s {beside}", flush=True)


if __name__ == "__main__":
    count = int(float(sys.argv[1])) if len(sys.argv) > 1 else 1_000_000
    times = int(sys.argv[2]) if len(sys.argv) > 2 else 7
    main(count, times, sys.argv[3] if len(sys.argv) > 3 else None)
