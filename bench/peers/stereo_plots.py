"""The plots of docs/performance.md on matching: error against density, and CPU time against disparities and pixels.

    cargo build --release -p wheatstone-stereo --example match_pair
    python3 bench/peers/stereo_plots.py target/release/examples/match_pair docs/pictures/matching.svg [times]

Needs what `stereo.py` needs. One thread; ours and OpenCV's by turns, the least of so many times each.
"""
import math, pathlib, sys
import cv2
import numpy as np

import stereo
import stereo_data

DENSITIES = np.arange(0.30, 0.951, 0.05)
MODES = ["HH", "SGBM", "3WAY"]
COLOURS = {"ours": "#1f6fb2", "ours, refined": "#1f6fb2", "HH": "#c0504d", "SGBM": "#7a8b2f", "3WAY": "#8e6bb0"}


def sparsification(program):
    """Of the pixels that both cameras see: the mean share that is two pixels off, by how many are taken; and OpenCV's modes."""
    curves, peers = [], {name: [] for name in MODES}
    for pair in stereo_data.real():
        seen = pair.visible & ~np.isnan(pair.truth)
        fine, _ = stereo_data.ours(program, pair)
        order = np.where(np.isnan(fine["disparity"]), -1.0, fine["confidence"])[seen]
        off = (stereo.errors(fine["disparity"], pair, seen)[np.argsort(-order, kind="stable")] > 2).astype(float)
        counts = (DENSITIES * len(off)).astype(int)
        # Where there are not as many, nothing is known.
        curves.append([np.mean(off[:count]) if count <= np.sum(order >= 0) else np.nan for count in counts])
        for name in MODES:
            found, _ = stereo.theirs(stereo.opencv(name, pair.count), pair, 1)
            given = seen & ~np.isnan(found)
            peers[name].append((given.sum() / seen.sum(), np.mean(stereo.errors(found, pair, given) > 2)))
    share = np.mean(curves, axis=0)
    lines = {"ours": [(100 * d, 100 * s) for d, s in zip(DENSITIES, share) if np.isfinite(s)]}
    return lines | {name: [tuple(100 * np.mean(rows, axis=0))] for name, rows in peers.items()}


def timed(program, sizes, times):
    """CPU milliseconds of pictures of so many columns and rows, and disparities."""
    scene = next(pair for pair in stereo_data.real() if pair.name == "motorcycle")
    lines = {name: [] for name in ["ours", "ours, refined", *MODES[:2]]}
    for x, (width, height, count) in sizes:
        left, right = (cv2.resize(side, (width, height), interpolation=cv2.INTER_AREA) for side in (scene.left, scene.right))
        pair = stereo_data.Pair("timed", left, right, None, None, count)
        for name, options in (("ours", ["--coarse"]), ("ours, refined", [])):
            lines[name].append((x, 1e3 * stereo_data.ours(program, pair, *options, repeat=times)[1]))
        for name in MODES[:2]:
            lines[name].append((x, 1e3 * stereo.theirs(stereo.opencv(name, count), pair, times)[1]))
        print(x, {name: round(line[-1][1], 1) for name, line in lines.items()}, flush=True)
    return lines


class Panel:
    """One plot of 215 by 140, linear or with logarithms of base 2 along both axes."""

    def __init__(self, left, title, lines, logarithmic):
        self.left, self.title, self.lines = left, title, lines
        self.of = math.log2 if logarithmic else float
        xs, ys = ([self.of(point[k]) for line in lines.values() for point in line] for k in (0, 1))
        self.x = (min(xs), max(xs))
        self.y = (min(ys) if logarithmic else 0.0, max(ys))

    def place(self, point):
        x, y = ((self.of(point[k]) - low) / (high - low) for k, (low, high) in enumerate((self.x, self.y)))
        return self.left + 45 + 8 + 199 * x, 30 + 140 - 8 - 124 * y

    def drawn(self, xs, ys, across):
        parts = [f'<rect x="{self.left + 45}" y="30" width="215" height="140" class="frame"/>', words(self.left + 152, 20, self.title)]
        parts += [words(self.place((x, self.lines["ours"][0][1]))[0], 184, label) for x, label in xs]
        parts += [words(self.left + 41, self.place((self.lines["ours"][0][0], y))[1] + 4, label, "end") for y, label in ys]
        parts.append(words(self.left + 152, 200, across))
        for name, line in self.lines.items():
            places = [self.place(point) for point in line]
            dots = " ".join(f"{x:.1f},{y:.1f}" for x, y in places)
            dashed = ' stroke-dasharray="5 3"' if name == "ours, refined" else ""
            parts.append(f'<polyline points="{dots}" stroke="{COLOURS[name]}"{dashed}/>')
            parts += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="2.5" fill="{COLOURS[name]}"/>' for x, y in places]
        return "".join(parts)


def milliseconds(lines):
    """Powers of two between the least and the largest, and what they are called: every one, or every other."""
    values = [point[1] for line in lines.values() for point in line]
    powers = range(math.ceil(math.log2(min(values))), math.floor(math.log2(max(values))) + 1)
    return [(2.0**k, f"{2**k} ms" if k < 10 else f"{2**k / 1024:.0f} s") for k in powers[:: 1 if len(powers) < 5 else 2]]


def words(x, y, text, anchor="middle", colour="#333"):
    return f'<text x="{x:.0f}" y="{y:.0f}" text-anchor="{anchor}" fill="{colour}">{text}</text>'


def main():
    cv2.setNumThreads(1)
    program, out = sys.argv[1:3]
    times = int(sys.argv[3]) if len(sys.argv) > 3 else 5
    share = sparsification(program)
    print({name: [tuple(round(float(v), 2) for v in point) for point in line] for name, line in share.items()}, flush=True)
    counts = [32, 64, 128, 256]
    by_count = timed(program, [(count, (640, 480, count)) for count in counts], times)
    widths = [320, 640, 1280, 2560]
    by_pixels = timed(program, [(w * w * 3 // 4 / 1e6, (w, w * 3 // 4, 64)) for w in widths], times)
    panels = [Panel(0, "two pixels off, % of those taken", share, False), Panel(270, "CPU time, 640 x 480", by_count, True),
              Panel(540, "CPU time, 64 disparities", by_pixels, True)]
    top = max(point[1] for line in share.values() for point in line)
    parts = [panels[0].drawn([(d, f"{d}") for d in (40, 60, 80)], [(y, f"{y}") for y in range(0, int(top) + 1)], "pixels taken, % of those that both cameras see"),
             panels[1].drawn([(count, str(count)) for count in counts], milliseconds(by_count), "disparities"),
             panels[2].drawn([(w * w * 3 // 4 / 1e6, f"{w * w * 3 / 4 / 1e6:.2g}") for w in widths], milliseconds(by_pixels), "megapixels")]
    for place, (name, colour) in enumerate(COLOURS.items()):
        x = 150 + 110 * place
        dashed = ' stroke-dasharray="5 3"' if name == "ours, refined" else ""
        parts.append(f'<polyline points="{x},217 {x + 22},217" stroke="{colour}"{dashed}/>' + words(x + 28, 221, name, "start"))
    style = "text{font:11px sans-serif}polyline{fill:none;stroke-width:1.5}.frame{fill:none;stroke:#bbb}.back{fill:#fff}"
    pathlib.Path(out).write_text(
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 810 230" role="img" aria-label="Matching: error against density, and time against disparities and pixels">'
        f'<style>{style}</style><rect class="back" width="810" height="230"/>{"".join(parts)}</svg>\n')


if __name__ == "__main__":
    main()
