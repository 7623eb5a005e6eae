"""Pairs with known disparities, and our matcher on them."""
import json, os, pathlib, subprocess, tempfile
import numpy as np
from PIL import Image

import stereo_renders

HERE = pathlib.Path(__file__).resolve().parent
DATA = pathlib.Path(os.environ.get("WHEATSTONE_DATA", HERE.parents[2] / "shared" / "data")) / "stereo"


class Pair:
    """`truth` is NaN where it is not known, `visible` says which pixels both cameras see."""

    def __init__(self, name, left, right, truth, visible, count):
        self.name, self.left, self.right, self.truth, self.visible, self.count = name, left, right, truth, visible, count
        self.exact = name.startswith(("syn", "render"))


def real():
    """Middlebury's pairs, and three renders of which truth is exact."""
    for folder in sorted(DATA.iterdir()):
        meta = json.loads((folder / "meta.json").read_text())
        left, right, visible = (np.array(Image.open(folder / f"{n}.png").convert("L")) for n in ("left", "right", "nocc"))
        yield Pair(folder.name, left, right, np.load(folder / "disp.npy"), visible > 0, meta["ndisp"])


def rendered(seeds):
    for seed in seeds:
        yield Pair(f"render{seed}", *stereo_renders.pair(seed), 64)


def ours(program, pair, *options, threads="1", first=0, repeat=1):
    """What our example program writes of a pair, and its CPU seconds."""
    with tempfile.TemporaryDirectory() as folder:
        for name, pixels in (("left", pair.left), ("right", pair.right)):
            Image.fromarray(pixels).save(f"{folder}/{name}.png")
        command = [program, f"{folder}/left.png", f"{folder}/right.png", str(first), str(first + pair.count), folder]
        command += ["--repeat", str(repeat), *options]
        done = subprocess.run(command, capture_output=True, text=True, check=True, env={**os.environ, "RAYON_NUM_THREADS": threads})
        arrays = {path.stem: np.load(path) for path in pathlib.Path(folder).glob("*.npy")}
    return arrays, float(done.stdout.split()[-1])
