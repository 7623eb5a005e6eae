"""Cost against size: CPU seconds while one size doubles and all else stays, with the slope on log-log axes.

    cargo bench --no-run && cargo build --release
    python3 bench/scaling.py docs/pictures/scaling.svg

Needs numpy for the chessboards' pictures. Each cost is the least of three runs, less that of the smallest work
there is, so that a program's start is not counted.
"""
import json, math, os, pathlib, subprocess, sys, tempfile

import numpy as np

root = pathlib.Path(__file__).parent.parent / "target/release"
os.environ["RAYON_NUM_THREADS"] = "1"


def bench(name):
    found = (path for path in (root / "deps").glob(f"{name}-*") if not path.suffix)
    return max(found, key=lambda path: path.stat().st_mtime)


def cpu(*command, times=3):
    seconds = []
    for _ in range(times):
        child = subprocess.Popen([str(word) for word in command], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        _, status, used = os.wait4(child.pid, 0)
        assert status == 0, command
        seconds.append(used.ru_utime + used.ru_stime)
    return min(seconds)


def wheatstone(*words, times=1):
    return cpu(root / "wheatstone", *words, times=times)


def points(work):
    wheatstone("synth", "--points", "--noise", "0.1", "--count", "400", "-o", work / "t.csv")
    wheatstone("fit", work / "t.csv", "--method", "brown", "--no-validation", "-o", work / "m.json")
    for count in (500_000, 1_000_000, 2_000_000, 4_000_000):
        wheatstone("synth", "--random", count, "--noise", "0.1", "-o", work / "p.csv")
        yield count, wheatstone("locate", work / "m.json", work / "p.csv", "-o", work / "o.csv", times=3)


def views(work):
    for count in (10, 20, 40, 80):
        wheatstone("synth", "--points", "--hand-held", count, "--noise", "0.1", "-o", work / "h.csv")
        yield count, wheatstone("fit", work / "h.csv", "--method", "brown", "--no-validation", "-o", work / "m.json", times=3)


def cameras(work):
    for count in (2, 3, 4, 6, 8):
        wheatstone("synth", "--points", "--cameras", count, "--noise", "0.1", "--count", "400", "-o", work / "c.csv")
        yield count, wheatstone("fit", work / "c.csv", "--method", "brown", "--no-validation", "-o", work / "m.json", times=3)


def placed_views(path, views, rows):
    """A table of a plate at so many places before two cameras, with so many points of it each."""
    random = np.random.default_rng(1)
    table = [np.array(["x1", "y1", "x2", "y2", "X", "Y", "Z", "view"])]
    side = math.isqrt(rows)
    for view in range(views):
        a, b = random.uniform(-0.4, 0.4, 2)
        u, v = (20.0 * (np.array(divmod(np.arange(rows), side)) - side / 2))
        at = np.stack([u * math.cos(a), v * math.cos(b) + u * math.sin(a) * math.sin(b),
                       v * math.sin(b) - u * math.sin(a) * math.cos(b)], 1)
        at += [*random.uniform(-60, 60, 2), 600 + view % 40 * 15]
        seen = [(at - [x, 0, 0])[:, :2] / at[:, 2:] * 1200 + [640, 480] + random.normal(0, 0.1, (rows, 2)) for x in (-100, 100)]
        table.extend([*map("{:.4f}".format, row), f"v{view}"] for row in np.hstack([*seen, at]))
    path.write_text("\n".join(",".join(row) for row in table) + "\n")


def check(work, sizes):
    for count, views, rows in sizes:
        placed_views(work / "v.csv", views, rows)
        yield count, wheatstone("check", work / "v.csv")


def check_rows(work):
    return check(work, [(60 * rows, 60, rows) for rows in (50, 100, 200, 400)])


def check_views(work):
    return check(work, [(views, views, 50) for views in (250, 500, 1000, 2000)])


def epochs(_):
    least = cpu(bench("kernels"), "training", "single", 1)
    for count in (10_000, 20_000, 40_000, 80_000):
        yield count, cpu(bench("kernels"), "training", "single", count) - least


def pixels(work):
    for width in (640, 1280, 2560, 5120):
        y, x = np.mgrid[:width * 3 // 4, :width] / width
        u, v = (x - 0.15 + 0.05 * y) / 0.07, (y - 0.1 - 0.04 * x) / 0.07
        board = (np.floor(u) + np.floor(v)) % 2
        grey = np.where((u > 0) & (u < 10) & (v > 0) & (v < 7), 40 + 170 * board, 210).astype(np.uint8)
        path = work / f"{width}.pgm"
        path.write_bytes(b"P5 %d %d 255\n" % (grey.shape[1], grey.shape[0]) + grey.tobytes())
        told = subprocess.run([bench("chessboard"), "9x6", "5", path], capture_output=True, text=True, check=True).stdout
        yield grey.size, json.loads(told)["milliseconds"] / 1000


def slope(rows):
    x, y = (np.log([row[k] for row in rows]) for k in (0, 1))
    return np.polyfit(x, y, 1)[0]


def panel(left, above, name, rows):
    """One log-log plot of 190 by 170, its line and its slope."""
    lx, ly = [math.log2(n) for n, _ in rows], [math.log2(max(s, 1e-9)) for _, s in rows]
    px = lambda v: left + 45 + 125 * (v - lx[0]) / (lx[-1] - lx[0])
    top = max(ly) + 0.3
    py = lambda v: 30 + 105 * (top - v) / max(top - min(ly) + 0.3, 1)
    dots = " ".join(f"{px(a):.1f},{py(b):.1f}" for a, b in zip(lx, ly))
    text = lambda x, y, words, anchor="middle": f'<text x="{x:.0f}" y="{y:.0f}" text-anchor="{anchor}">{words}</text>'
    short = lambda n: f"{n / 1e6:g}M" if n >= 1e6 else f"{n / 1e3:g}k" if n >= 1000 else f"{n:g}"
    marks = "".join(f'<circle cx="{px(a):.1f}" cy="{py(b):.1f}" r="3"/>' for a, b in zip(lx, ly))
    ends = "".join(text(left + 40, py(b) + 4, f"{s:.2g} s", "end") for b, s in ((ly[0], rows[0][1]), (ly[-1], rows[-1][1])))
    below = "".join(text(px(a), 158, short(round(n, -4) if n > 1e5 else n)) for a, (n, _) in ((lx[0], rows[0]), (lx[-1], rows[-1])))
    return (f'<g transform="translate(0 {above})"><rect x="{left + 42}" y="25" width="136" height="115" class="frame"/><polyline points="{dots}"/>{marks}'
            + text(left + 110, 16, f"{name}: slope {slope(rows):.2f}") + ends + below + "</g>")


def main():
    kinds = {"points": points, "views": views, "cameras": cameras, "pixels": pixels, "epochs": epochs,
             "check, rows": check_rows, "check, views": check_views}
    parts = []
    with tempfile.TemporaryDirectory() as work:
        for place, (name, measure) in enumerate(kinds.items()):
            rows = list(measure(pathlib.Path(work)))
            print(name, *(f"{size}: {seconds:.3f} s" for size, seconds in rows), f"slope {slope(rows):.2f}", flush=True)
            parts.append(panel(190 * (place % 4), 170 * (place // 4), name, rows))
    style = ("text{font:11px sans-serif;fill:#333}polyline{fill:none;stroke:#1f6fb2;stroke-width:1.5}circle{fill:#1f6fb2}"
             ".frame{fill:none;stroke:#bbb}.back{fill:#fff}")
    pathlib.Path(sys.argv[1]).write_text(
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 770 340" role="img" aria-label="Cost against size">'
        f'<style>{style}</style><rect class="back" width="770" height="340"/>{"".join(parts)}</svg>\n')


main()
