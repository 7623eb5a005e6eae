"""Pictures and figures of the gallery's reconstructions. Needs numpy, matplotlib and pillow; docs/pictures/make calls it.

    reconstructions.py depths OUT PICTURE
    reconstructions.py plane OUT LEFT,TOP,WIDTH,HEIGHT
    reconstructions.py motorcycle OUT TRUTH.npz PICTURE

OUT is a folder that `wheatstone reconstruct` has written. `plane` says how far the points of a rectangle of the left
rectified picture are from the plane through them, `motorcycle` how far disparities are from the published ones.
"""
import json, pathlib, sys
import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from PIL import Image

# Of the pictures of 741 x 500 pixels, as scikit-image publishes it: px, px, px, px, mm.
FOCAL, CENTRE, DIFFERENCE, BASELINE = 994.978, (311.193, 254.877), 31.086, 193.001
EDGE = 0.5  # Neighbours whose true disparities differ by more, in pixels, stand on both sides of an edge.


def cloud(folder):
    """The points, a row each, with a field for every property of the file."""
    header, _, rows = (folder / "cloud.ply").read_bytes().partition(b"end_header\n")
    fields = [line.split()[1:] for line in header.decode().splitlines() if line.startswith("property")]
    return np.frombuffer(rows, [(name, {"float": "<f4", "uchar": "u1"}[kind]) for kind, name in fields])


def columns(points, *names):
    return np.stack([points[name] for name in names], 1).astype(float)


def depths(folder):
    """Depths of the left rectified picture in metres of a model in mm, NaN where there is no point."""
    told = json.loads((folder / "summary.json").read_text())
    step = told.get("frames", [told])[0]["depth_png_step"]  # Of several pairs the folders have a summary of their own.
    levels = np.round(plt.imread(folder / "depth.png") * 65535)
    return np.where(levels > 0, levels * step / 1000, np.nan)


def panel(axes, values, label, ticks, **colours):
    axes.set_axis_off()
    shown = axes.imshow(values, interpolation="nearest", **colours)
    bar = plt.colorbar(shown, ax=axes, shrink=0.8, pad=0.02, ticks=ticks)
    bar.set_label(label)
    return bar


def depth_panel(axes, values):
    """The nearer, the redder: colours are even in inverse depth, as disparities are."""
    far, near = np.nanpercentile(1 / values, [1, 99])
    ticks = [depth for depth in (0.6, 0.8, 1, 1.2, 1.5, 2, 2.5, 3, 4, 5) if far <= 1 / depth <= near]
    bar = panel(axes, 1 / values, "depth, m", [1 / depth for depth in ticks], cmap="turbo", vmin=far, vmax=near)
    bar.ax.set_yticklabels([f"{depth:g}" for depth in ticks])


def save(path):
    plt.savefig(path, dpi=100, bbox_inches="tight", pad_inches=0.05)
    Image.open(path).convert("RGB").quantize(256).save(path, optimize=True)


def plane(folder, rectangle):
    left, top, width, height = map(int, rectangle.split(","))
    inside = np.zeros(depths(folder).shape, bool)
    inside[top : top + height, left : left + width] = True
    points = cloud(folder)[inside[~np.isnan(depths(folder))]]
    places, sigmas = columns(points, "x", "y", "z"), columns(points, "sigma_x", "sigma_y", "sigma_z")
    kept = np.ones(len(places), bool)
    for _ in range(5):
        middle = places[kept].mean(0)
        normal = np.linalg.svd(places[kept] - middle, full_matrices=False)[2][2]
        off = (places - middle) @ normal
        kept = np.abs(off) < 4 * 1.4826 * np.median(np.abs(off[kept]))
    # Errors of a match are along the line of sight, X, Y and Z together.
    sight = places / np.linalg.norm(places, axis=1, keepdims=True)
    expected = np.linalg.norm(sigmas, axis=1) * np.abs(sight @ normal)
    print(f"{len(points)} points {np.linalg.norm(middle):.0f} mm away, {100 * np.mean(~kept):.1f} % are none of the plane's;"
          f" {off[kept].std():.2f} mm rms from it, by their standard deviations {np.sqrt((expected[kept] ** 2).mean()):.2f} mm")


def motorcycle(folder, truth, picture):
    published = np.load(truth)["arr_0"].astype(float)
    published[~np.isfinite(published)] = np.nan
    points = cloud(folder)
    x, y, z = columns(points, "x", "y", "z").T
    # The model is a pair of pinholes: places, pixels and disparities are the same thing.
    column, row, disparity = FOCAL * x / z + CENTRE[0], FOCAL * y / z + CENTRE[1], FOCAL * BASELINE / z - DIFFERENCE
    sigma = points["sigma_z"] * FOCAL * BASELINE / z**2
    whole = np.floor(np.stack([row, column])).astype(int)
    limits = np.array(published.shape)[:, None] - 2
    fits = ((whole >= 0) & (whole <= limits)).all(0)
    whole = np.clip(whole, 0, limits)
    near = np.stack([published[whole[0] + down, whole[1] + along] for down in (0, 1) for along in (0, 1)])
    down, along = row - whole[0], column - whole[1]
    true = np.sum(near * [(1 - down) * (1 - along), (1 - down) * along, down * (1 - along), down * along], 0)
    known = fits & np.isfinite(true)
    even = known & (np.ptp(near, axis=0) < EDGE)
    off = disparity - true
    gross = np.abs(off[known])
    metric = np.abs(z - FOCAL * BASELINE / (true + DIFFERENCE))[even]
    shares = [100 * np.mean(np.abs(off[even]) < times * sigma[even]) for times in (1, 2)]
    print(f"{len(points)} points, {known.sum()} of known disparity, of which {even.sum()} are at no edge")
    print(f"off by more than 1 px: {100 * np.mean(gross > 1):.2f} %, 2 px: {100 * np.mean(gross > 2):.2f} %")
    print(f"median error {np.median(np.abs(off[even])):.3f} px, bias {np.median(off[even]):.3f} px; depth {np.median(metric):.2f} mm")
    print(f"median standard deviation {np.median(sigma[even]):.3f} px; within one {shares[0]:.1f} %, within two {shares[1]:.1f} %")
    errors = np.full(published.shape, np.nan)
    errors[np.round(row[known]).astype(int), np.round(column[known]).astype(int)] = off[known]
    _, (first, second) = plt.subplots(2, 1, figsize=(6.4, 7.4), layout="constrained")
    depth_panel(first, depths(folder))
    panel(second, errors, "error of the disparity, px", [-1, -0.5, 0, 0.5, 1], cmap="RdBu", vmin=-1, vmax=1)
    save(picture)


def main():
    what, folder, *rest = sys.argv[1:]
    folder = pathlib.Path(folder)
    if what == "depths":
        depth_panel(plt.subplots(figsize=(6.4, 4))[1], depths(folder))
        save(rest[0])
    else:
        {"plane": plane, "motorcycle": motorcycle}[what](folder, *rest)


if __name__ == "__main__":
    main()
