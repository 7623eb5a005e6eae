"""Scenes reconstructed through several optics beside OpenCV, in one run: errors, error bars and CPU time.

    cargo build --release
    python3 bench/peers/reconstruction.py target/release/wheatstone [rig ...] [--seeds 1,2] [--folder kept] [--charts "options of synth"]

Needs numpy, scipy, pillow and opencv-python-headless. Per rig and scene it compares

    ours        wheatstone reconstruct, with a neural camera (`network`: the same with a network)
    HH located  the same model: wheatstone rectify, OpenCV's StereoSGBM in mode HH over the same disparities, wheatstone locate
    Brown Q     OpenCV alone: calibrateCamera, stereoCalibrate, stereoRectify, the same matcher, reprojectImageTo3D

A point's error is its distance from the place that its pixel of camera 1 shows, in percent of that place's distance.
Pixels at edges of depth are left out. Beside HH located the most confident of ours are taken until there are as many as
it gives; beside Brown Q, which has another rectified picture, the pixels of camera 1 are taken that both give.
"""
import argparse, csv, json, pathlib, resource, subprocess, tempfile
import cv2
import numpy as np

import stereo

RIGS = ["water", "glass", "fisheye", "bump", "scheimpflug", "tube", "mirror", "paper"]
WITH_NETWORK = ["paper", "scheimpflug"]
EDGE = 0.02  # Of the distance: neighbours that differ by more stand on both sides of an edge.
GROSS = 5.0  # Percent of the distance.
CONFIDENT = np.float32(0.95)  # What `reconstruct` keeps by default.
DIVERGED = 5.0  # Pixels rms.
CHARTS = "--columns 13 --rows 10 --count 900"  # They fill the pictures.
MARGIN = 0.15  # Of the disparities of the charts, at either end: as `reconstruct` has it.
# Bars: which ratio, on which rigs, the most that it may be.
BARS = [("HH located", RIGS, 0.65), ("Brown Q", ["water"], 0.3), ("Brown Q", ["fisheye", "bump", "tube"], 0.1), ("network", WITH_NETWORK, 1.5)]
COVERED = [(1, 68.0, 5.0), (2, 95.0, 3.0)]  # Within so many standard deviations: percent, and by how much it may be off.


def sampled(image, x, y):
    """Between pixels, bilinear, and the four neighbours; NaN where one of them is outside."""
    height, width = image.shape[:2]
    column, row = np.floor(x), np.floor(y)
    fine = (column >= 0) & (row >= 0) & (column < width - 1) & (row < height - 1)
    column, row = np.where(fine, column, 0).astype(int), np.where(fine, row, 0).astype(int)
    near = np.stack([image[row + dy, column + dx] for dy in (0, 1) for dx in (0, 1)]).astype(float)
    near[:, ~fine] = np.nan
    along, down = x - column, y - row
    shares = np.stack([(1 - along) * (1 - down), along * (1 - down), (1 - along) * down, along * down])
    return np.einsum("in,in...->n...", shares, near), near


class Points:
    """Points in the world and the pixels of camera 1 that they belong to, held against the truth."""

    def __init__(self, place, pixel, truth, confidence=None, sigma=None):
        true, near = sampled(truth, *pixel.T)
        far = np.linalg.norm(near, axis=2)
        known = (far.max(0) < (1 + EDGE) * far.min(0)) & np.isfinite(place).all(1)  # NaN is not known.
        self.off = (place - true)[known]
        self.error = 100 * np.linalg.norm(self.off, axis=1) / np.linalg.norm(true[known], axis=1)
        self.cell = np.round(pixel[known]).astype(int) @ [1, truth.shape[1]]
        self.confidence, self.sigma = [None if of is None else of[known] for of in (confidence, sigma)]

    def most_confident(self, count):
        return self.error[np.argsort(-self.confidence, kind="stable")[:count]]

    def shared(self, other):
        return [a.error[np.isin(a.cell, b.cell)] for a, b in ((self, other), (other, self))]


def run(program, *arguments):
    """CPU seconds of the program on one thread."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([program, "-q", *map(str, arguments)], check=True, env={"RAYON_NUM_THREADS": "1"})
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def ply(path):
    content = path.read_bytes()
    header, _, rows = content.partition(b"end_header\n")
    kinds = {"float": "<f4", "uchar": "u1"}
    fields = [line.split()[1:] for line in header.decode().splitlines() if line.startswith("property")]
    return np.frombuffer(rows, [(name, kinds[kind]) for kind, name in fields])


def tables(folder):
    return [[np.load(folder / f"{side}_map_{axis}.npy") for axis in "xy"] for side in ("left", "right")]


def matched(left, right, least, count):
    count = (count + 15) // 16 * 16
    matcher = stereo.opencv("HH", count)
    matcher.setMinDisparity(least)
    found = matcher.compute(left, right).astype(np.float32) / 16.0
    found[found < least] = np.nan
    return found


def pictures(folder):
    return [cv2.imread(str(folder / name), cv2.IMREAD_GRAYSCALE) for name in ("left.png", "right.png")]


def ours(program, model, scene, folder, truth):
    """The cloud with all confidences, and what its summary says."""
    seconds = run(program, "reconstruct", model, "--images", scene / "left.png", scene / "right.png", "--confidence", 0, "-o", folder)
    run(program, "rectify", model, "--images", scene / "left.png", scene / "right.png", "-o", folder)
    summary = json.loads((folder / "summary.json").read_text())
    assert summary["rectified"]["cameras"] == [0, 1]
    cloud, depth = ply(folder / "cloud.ply"), cv2.imread(str(folder / "depth.tiff"), cv2.IMREAD_UNCHANGED)
    given = ~np.isnan(depth)  # The cloud's points are those of these pixels, row by row.
    column = lambda *names: np.stack([cloud[name] for name in names], 1).astype(float)
    pixel = np.stack([table[given] for table in tables(folder)[0]], 1)
    points = Points(column("x", "y", "z"), pixel, truth, cloud["confidence"], column("sigma_x", "sigma_y", "sigma_z"))
    return points, summary["disparities"], seconds


def located(program, model, folder, disparities, truth):
    """OpenCV's disparities of our rectified pictures, located by our model."""
    found = matched(*[cv2.imread(str(folder / side / f"{side}.png"), cv2.IMREAD_GRAYSCALE) for side in ("left", "right")],
                    disparities[0], disparities[1] - disparities[0])
    left, right = tables(folder)
    y, x = np.nonzero(~np.isnan(found) & (left[0] >= 0))
    pairs, near = sampled(np.dstack(right), x - found[y, x], y.astype(float))
    shown = (near >= 0).all((0, 2))
    first = np.stack([table[y, x] for table in left], 1)[shown].astype(float)
    np.savetxt(folder / "pairs.csv", np.hstack([first, pairs[shown]]), "%.6f", ",", header="x1,y1,x2,y2", comments="")
    run(program, "locate", model, folder / "pairs.csv", "-o", folder / "points.csv")
    with open(folder / "points.csv", newline="") as file:
        place = np.array([[float(row[axis] or "nan") for axis in "XYZ"] for row in csv.DictReader(file)])
    return Points(place, first, truth)


def brown(charts, scene, truth):
    """OpenCV alone, brought into the world by the pose of camera 1; None where its calibration does not converge, or means nothing."""
    with open(charts, newline="") as file:
        rows = list(csv.DictReader(file))
    table = lambda *names: np.array([[float(row[name]) for name in names] for row in rows], np.float32)
    world, pixels = table("X", "Y", "Z"), [table("x1", "y1"), table("x2", "y2")]
    images = pictures(scene)
    size = images[0].shape[::-1]
    # Charts on a stage are parallel, which leaves the focal length open if each has a pose of its own: they are one body.
    guess = np.array([[size[0] / 2, 0, size[0] / 2], [0, size[0] / 2, size[1] / 2], [0, 0, 1]])
    one = lambda own: cv2.calibrateCamera([world], [own], size, guess.copy(), None, flags=cv2.CALIB_USE_INTRINSIC_GUESS)
    (first, k1, d1, poses, origins), (second, k2, d2, *_) = [one(own) for own in pixels]
    if max(first, second) > DIVERGED:
        return None
    fixed = cv2.stereoCalibrate([world], *[[own] for own in pixels], k1, d1, k2, d2, size, flags=cv2.CALIB_FIX_INTRINSIC)
    turn, shift = fixed[5:7]
    r1, r2, p1, p2, q, *_ = cv2.stereoRectify(k1, d1, k2, d2, size, turn, shift)
    rectified = r1 @ cv2.Rodrigues(poses[0])[0], r1 @ origins[0][:, 0]
    depth = (world @ rectified[0].T + rectified[1])[:, 2]
    disparity = np.array([-p2[0, 3] / depth.max(), -p2[0, 3] / depth.min()])
    least, most = disparity + MARGIN * np.ptp(disparity) * np.array([-1, 1])
    if not 1 < most - least < size[0]:
        return None  # Mirrored pictures have no pinhole that explains them.
    maps = [cv2.initUndistortRectifyMap(*each, size, cv2.CV_32FC1) for each in ((k1, d1, r1, p1), (k2, d2, r2, p2))]
    found = matched(*[cv2.remap(image, *own, cv2.INTER_LINEAR) for image, own in zip(images, maps)], int(least), int(np.ceil(most - least)))
    given = ~np.isnan(found)
    place = (cv2.reprojectImageTo3D(found, q)[given] - rectified[1]) @ rectified[0]
    return Points(place, np.stack([table[given] for table in maps[0]], 1).astype(float), truth)


def covered(points):
    """Percent of the errors along X, Y and Z within one and two standard deviations, of confident points."""
    sure = points.confidence >= CONFIDENT
    ratio = np.abs(points.off[sure]) / points.sigma[sure]
    return {most: 100 * (ratio < most).mean(0) for most, _, _ in COVERED}


def told(errors):
    return f"{len(errors):7} points, median {np.median(errors):6.3f} %, gross {100 * np.mean(errors > GROSS):6.2f} %"


def compare(program, charts, models, scene, folder):
    """Ratios of medians and coverage of one scene, told as they are found."""
    truth = np.load(scene / "left_points.npy")
    own, disparities, seconds = ours(program, models["neural-camera"], scene, folder / "own", truth)
    other, alone = located(program, models["neural-camera"], folder / "own", disparities, truth), brown(charts, scene, truth)
    equal, sure = own.most_confident(len(other.error)), own.error[own.confidence >= CONFIDENT]
    ratios = {"HH located": np.median(equal) / np.median(other.error)}
    same = np.divide(*[np.median(errors) for errors in own.shared(other)])
    print(f"    ours, confident    {told(sure)}; {seconds:.1f} s of CPU\n    ours as many as HH {told(equal)}")
    print(f"    HH located         {told(other.error)}; ratio {ratios['HH located']:.3f}, on the same pixels {same:.3f}")
    if alone is None:
        print("    Brown Q            OpenCV's calibration does not converge, or means nothing")
    else:
        mine, theirs = own.shared(alone)
        ratios["Brown Q"] = np.median(mine) / np.median(theirs)
        print(f"    ours where Brown Q {told(mine)}\n    Brown Q            {told(theirs)}; ratio {ratios['Brown Q']:.3f}")
    if "network" in models:
        network, _, seconds = ours(program, models["network"], scene, folder / "network", truth)
        theirs, mine = [of.error[of.confidence >= CONFIDENT] for of in (network, own)]
        ratios["network"] = np.median(theirs) / np.median(mine)
        print(f"    network            {told(theirs)}; ratio {ratios['network']:.3f}; {seconds:.1f} s of CPU")
    bars = covered(own)
    print("    error bars         ", *(f"within {most}: " + " ".join(f"{axis} {share:.1f}" for axis, share in zip("XYZ", shares)) + " %;"
                                       for most, shares in bars.items()), flush=True)
    return ratios, {most: shares.mean() for most, shares in bars.items()}


def verdicts(rows):
    print()
    for name, rigs, most in BARS:
        for rig in rigs:
            worst = max((ratios[name] for (own, _), (ratios, _) in rows.items() if own == rig and name in ratios), default=None)
            if worst is not None:
                print(f"{'holds' if worst <= most else 'FAILS'}: {rig}: median {name} at worst {worst:.3f} <= {most}")
    for most, share, slack in COVERED:
        for (rig, seed), (_, bars) in rows.items():
            good = abs(bars[most] - share) <= slack
            print(f"{'holds' if good else 'FAILS'}: {rig} {seed}: {bars[most]:.1f} % within {most} standard deviations, {share:.0f} +- {slack:.0f}")


def main():
    cv2.setNumThreads(1)
    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_ERROR)
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("rigs", nargs="*", default=RIGS)
    parser.add_argument("--seeds", default="1,2")
    parser.add_argument("--folder", help="keeps what is made, and takes scenes and models from there")
    parser.add_argument("--charts", default=CHARTS, help="options of synth for the charts")
    given = parser.parse_args()
    program = str(pathlib.Path(given.program).resolve())
    with tempfile.TemporaryDirectory() as passing:
        rows = {}
        for rig in given.rigs:
            folder = pathlib.Path(given.folder or passing) / rig
            folder.mkdir(parents=True, exist_ok=True)
            charts, models = folder / "charts.csv", {}
            if not charts.exists():
                run(program, "synth", "--rig", rig, "--points", "--noise", "0.1", *given.charts.split(), "-o", charts)
            for method in ["neural-camera"] + ["network"] * (rig in WITH_NETWORK):
                models[method] = folder / f"{method}.json"
                if not models[method].exists():
                    run(program, "fit", charts, "--method", method, "--no-validation", "--size", "640x480", "-o", models[method])
            for seed in given.seeds.split(","):
                made = folder / seed
                if not made.exists():
                    run(program, "synth", "--rig", rig, "--scene", "--seed", seed, "-o", made)
                print(f"{rig}, scene {seed}", flush=True)
                rows[rig, seed] = compare(program, charts, models, made / "scene", folder / f"made{seed}")
        verdicts(rows)


if __name__ == "__main__":
    main()
