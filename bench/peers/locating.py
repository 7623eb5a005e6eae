"""What it costs to locate a disparity map, beside matching it: CPU seconds on one thread, in one run.

    cargo build --release
    python3 bench/peers/locating.py target/release/wheatstone [rig:method ...]

Needs the package `wheatstone`, numpy and pillow. Pictures are VGA, of a textured scene; cameras are calibrated from 441
chart points. Every point is located with its error bar. "Once" is what is made ready before the first picture: the
rectification, and the lattice of what the map says.
"""
import os, pathlib, subprocess, sys, tempfile, time

os.environ["WHEATSTONE_THREADS"] = "1"
import numpy as np
from PIL import Image

import wheatstone

CASES = ["paper:brown", "paper:network", "fisheye:kannala-brandt", "water:neural-camera", "glass:neural-camera",
         "bump:neural-camera", "tube:neural-camera", "mirror:neural-camera"]
TIMES = 5


def seconds(work):
    start = time.process_time()
    result = work()
    return result, time.process_time() - start


def main():
    program, cases = sys.argv[1], sys.argv[2:] or CASES
    print(f"{'':24} {'match':>7} {'locate':>7} {'ratio':>6} {'once':>6}   points")
    for case in cases:
        rig, method = case.split(":")
        with tempfile.TemporaryDirectory() as folder:
            made = pathlib.Path(folder) / "rig"
            subprocess.run([program, "synth", "--rig", rig, "--scene", "-o", made], check=True, capture_output=True)
            pictures = [np.array(Image.open(made / "scene" / f"{side}.png")) for side in ("left", "right")]
        model = wheatstone.fit(wheatstone.synth(rig, noise=0.1), method=method, validate=False)
        ready, once = seconds(lambda: wheatstone.Reconstructor(model, pictures[0].shape[1::-1]))
        whole, alone = [], []
        for _ in range(TIMES):
            found, time_of_whole = seconds(lambda: ready.reconstruct(pictures))
            _, time_of_locate = seconds(lambda: ready.locate(found.disparity, pictures, sigma=0.1))
            whole.append(time_of_whole)
            alone.append(time_of_locate)
        locate, match = min(alone), min(whole) - min(alone)
        print(f"{case:24} {match:7.3f} {locate:7.3f} {locate / match:6.2f} {once:6.2f}   {len(found)}", flush=True)


if __name__ == "__main__":
    main()
