"""Times the adjustment of cameras and hand-held charts beside OpenCV's `stereoCalibrate`, on the same
corners in the same run, and prints the ratio of the medians.

    python tests/peers/stereo.py [--views 40] [--times 9]

Needs cv2 and numpy, and builds what it times with cargo. Both have two cores, five terms a camera, all points,
and go to the same minimum (the root mean square errors are compared). Two pairs are compared: the joint adjustment alone, for
which each gets the lenses that its own fits of single cameras found, and everything from nothing but the corners
(OpenCV: and the pictures' size). Wheatstone's times hold its check of focal lengths and the charts' covariances too.
"""

import argparse
import csv
import json
import os
import statistics
import subprocess
import tempfile
import time
from collections import defaultdict

import cv2
import numpy as np

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")


def corners(path):
    views = defaultdict(list)
    with open(path, newline="") as file:
        for row in csv.DictReader(file):
            cells = [row[k] for k in ("board_x", "board_y", "x1", "y1", "x2", "y2")]
            if all(cells):
                views[row["view"]].append([float(cell) for cell in cells])
    boards, first, second = [], [], []
    for rows in views.values():
        rows = np.array(rows, dtype=np.float32)
        boards.append(np.c_[rows[:, :2], np.zeros(len(rows), dtype=np.float32)])
        first.append(np.ascontiguousarray(rows[:, 2:4]).reshape(-1, 1, 2))
        second.append(np.ascontiguousarray(rows[:, 4:6]).reshape(-1, 1, 2))
    return boards, first, second


def opencv(path, times, size=(640, 480)):
    boards, first, second = corners(path)
    until = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 100, 1e-9)
    joint, whole = [], []
    for _ in range(times):
        start = time.perf_counter()
        _, k1, d1, _, _ = cv2.calibrateCamera(boards, first, size, None, None)
        _, k2, d2, _, _ = cv2.calibrateCamera(boards, second, size, None, None)
        between = time.perf_counter()
        found = cv2.stereoCalibrate(
            boards, first, second, k1, d1, k2, d2, size,
            flags=cv2.CALIB_USE_INTRINSIC_GUESS, criteria=until,
        )
        end = time.perf_counter()
        joint.append(end - between)
        whole.append(end - start)
    return statistics.median(joint), statistics.median(whole), found[0], float(np.linalg.norm(found[6]))


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--views", type=int, default=40)
    parser.add_argument("--times", type=int, default=9)
    given = parser.parse_args()
    cv2.setNumThreads(2)
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "points.csv")
        program = ["cargo", "run", "--release", "--quiet", "-p", "wheatstone-cli", "--"]
        subprocess.run(
            program
            + ["synth", "--points", "--hand-held", str(given.views), "--columns", "11", "--rows", "8"]
            + ["--noise", "0.1", "--seed", "3", "-o", path, "--quiet"],
            cwd=ROOT,
            check=True,
        )
        bench = ["cargo", "bench", "--quiet", "-p", "wheatstone", "--bench", "hand_held", "--"]
        text = subprocess.run(
            bench + [path, str(given.times)],
            cwd=ROOT,
            check=True,
            capture_output=True,
            text=True,
            env={**os.environ, "RAYON_NUM_THREADS": "2"},
        ).stdout
        own = json.loads(text)
        joint, whole, rms, baseline = opencv(path, given.times)
    print(f"OpenCV {cv2.__version__}, {given.views} views of 88 corners, two cameras, medians of {given.times}:")
    rows = [
        ("the joint adjustment alone, both from lenses", joint, own["joint"]),
        ("everything, both from nothing", whole, own["median"]),
        ("OpenCV's joint adjustment, Wheatstone from nothing", joint, own["median"]),
    ]
    for name, other, ours in rows:
        print(f"  {name:<51} {other:.4f} s and {ours:.4f} s: {other / ours:.1f} times")
    print(f"  rms of both cameras {rms:.6f} px, and {own['rms']:.6f} px (from lenses {own['joint_rms']:.6f})")
    print(f"  baseline {baseline:.6f} and {own['baseline']:.6f}")


if __name__ == "__main__":
    main()
