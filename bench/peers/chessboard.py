"""Chessboards beside OpenCV's findChessboardCornersSB, in one run: times, and errors against known corners.

    cargo bench --bench chessboard --no-run
    python3 bench/peers/chessboard.py target/release/deps/chessboard-* [boards of each size] [times] [first seed]

Needs cv2 and numpy. Boards are rendered with tilt, distortion, uneven light, blur and noise, over 15 to 90 % of
pictures of 0.3, 1.2 and 12 megapixels. All run on one thread; times are medians of processor time a picture.
"""
import json, os, pathlib, statistics, subprocess, sys, tempfile, time
os.environ["RAYON_NUM_THREADS"] = "1"
import cv2, numpy as np

cv2.setNumThreads(1)
SIZES = ((640, 480), (1280, 960), (4000, 3000))
COUNTS = ((11, 8), (9, 6), (8, 6), (13, 9), (7, 5))


def distorted(x, y, k):
    r = x * x + y * y
    s = 1 + r * (k[0] + r * k[1])
    return x * s, y * s


def straight(x, y, k):
    """The inverse, by Newton's method on the radius."""
    far = np.sqrt(x * x + y * y)
    r = far.copy()
    for _ in range(6):
        r -= (r * (1 + r * r * (k[0] + r * r * k[1])) - far) / (1 + r * r * (3 * k[0] + 5 * r * r * k[1]))
    s = r / np.maximum(far, 1e-12)
    return x * s, y * s


def scene(rng, width, height):
    """A board's pose and lens with all squares in the picture: counts, corners in pixels, and the way back."""
    while True:
        columns, rows = COUNTS[rng.integers(len(COUNTS))]
        focal = width * rng.uniform(0.7, 1.4)
        k = (rng.uniform(-0.2, 0.05), rng.uniform(-0.02, 0.02))
        turn, _ = cv2.Rodrigues(np.array([*rng.uniform(-0.65, 0.65, 2), rng.uniform(-0.5, 0.5)]))
        fill = rng.uniform(0.15, 0.9)
        away = focal * np.sqrt((columns + 1) * (rows + 1) / (fill * width * height))
        where = np.array([*rng.uniform(-0.2, 0.2, 2) * [width / focal, height / focal], 1]) * away
        middle = np.array([(columns - 1) / 2, (rows - 1) / 2])
        plane = np.column_stack([turn[:, :2], where - turn[:, :2] @ middle])

        def see(u, v):
            at = plane @ np.stack([u, v, np.ones_like(u)])
            x, y = distorted(at[0] / at[2], at[1] / at[2], k)
            return np.stack([x * focal + (width - 1) / 2, y * focal + (height - 1) / 2])

        edge_u, edge_v = np.meshgrid(np.linspace(-1.4, columns + 0.4, 9), np.linspace(-1.4, rows + 0.4, 9))
        edge = see(edge_u.ravel(), edge_v.ravel())
        inside = (edge.min() > 4) and (edge[0].max() < width - 5) and (edge[1].max() < height - 5)
        u, v = np.meshgrid(np.arange(columns, dtype=float), np.arange(rows, dtype=float))
        corners = see(u.ravel(), v.ravel())
        grid = corners.reshape(2, rows, columns)
        least = min(np.hypot(*np.diff(grid, axis=axis)).min() for axis in (1, 2))
        if inside and least > 9:
            return columns, rows, corners.T, (np.linalg.inv(plane), focal, k), edge


def render(rng, width, height):
    columns, rows, corners, (back, focal, k), edge = scene(rng, width, height)
    x, y = np.meshgrid(np.arange(width, dtype=np.float32), np.arange(height, dtype=np.float32))
    waves = rng.uniform(0.5, 3, 4)
    ground = 0.45 + 0.15 * np.sin(waves[0] * x * 6.3 / width + waves[1]) * np.cos(waves[2] * y * 6.3 / height)
    for _ in range(12):
        a, b = int(rng.integers(width)), int(rng.integers(height))
        ground[b:b + height // 5, a:a + width // 6] += rng.uniform(-0.2, 0.2)
    left, top = np.floor(edge.min(axis=1)).astype(int) - 2
    right, low = np.ceil(edge.max(axis=1)).astype(int) + 3
    dark = rng.uniform(0.05, 0.3)
    block = np.s_[max(top, 0):min(low, height), max(left, 0):right]
    sx, sy = straight((x[block] - (width - 1) / 2) / focal, (y[block] - (height - 1) / 2) / focal, k)
    w = back[2, 0] * sx + back[2, 1] * sy + back[2, 2]
    # Signed distances in pixels from the lines of the lattice, and shares of pixels on their sides.
    places = [(back[row, 0] * sx + back[row, 1] * sy + back[row, 2]) / w for row in (0, 1)]
    steps = [np.hypot(*np.gradient(at)) for at in places]

    def side_of(at, step):
        whole = np.floor(at)
        return np.clip(2 * np.minimum(at - whole, whole + 1 - at) / step, 0, 1) * (1 - 2 * (whole % 2))

    def within(at, step, count, rim):
        return np.clip((count / 2 + rim - np.abs(at - (count - 1) / 2)) / step + 0.5, 0, 1)

    squares, board = (np.prod([within(at, step, count, rim) for at, step, count in zip(places, steps, (columns, rows))], axis=0)
                      for rim in (0.5, 0.9))
    ink = squares * (1 + side_of(places[0], steps[0]) * side_of(places[1], steps[1])) / 2
    ground[block] += board * (0.9 - ink * (0.9 - dark) - ground[block])
    side = rng.uniform(-0.35, 0.35, 2)
    light = (1 + side[0] * (x / width - 0.5) + side[1] * (y / height - 0.5)) * rng.uniform(0.5, 1)
    grey = cv2.GaussianBlur(np.float32(ground * light * 235), (0, 0), rng.uniform(0.5, 1.6 if width > 1000 else 1.1))
    grey += rng.normal(0, rng.uniform(1, 4), grey.shape).astype(np.float32)
    return columns, rows, corners, np.clip(np.round(grey), 0, 255).astype(np.uint8)


def errors(found, truth, shape):
    """Distances to the known corners, the board laid down whichever way fits."""
    rows, columns = shape[1], shape[0]
    found, truth = np.array(found).reshape(-1, 2), truth.reshape(rows, columns, 2)
    if len(found) != rows * columns:
        return None
    ways = [truth, truth[::-1, ::-1], truth[::-1], truth[:, ::-1]]
    all_ = [np.hypot(*(found - way.reshape(-1, 2)).T) for way in ways]
    best = min(all_, key=np.sum)
    return best if best.max() < 3 else None


def cpu(call, times):
    runs = []
    for _ in range(times):
        start = time.process_time()
        answer = call()
        runs.append(time.process_time() - start)
    return 1e3 * statistics.median(runs), answer


def main():
    program = sys.argv[1]
    boards, times, seed = (int(sys.argv[at]) if len(sys.argv) > at else usual for at, usual in ((2, 5), (3, 5), (4, 1)))
    work = pathlib.Path(tempfile.mkdtemp())
    for width, height in SIZES:
        found = {name: ([], [], 0) for name in ("ours", "SB", "SB accurate")}
        for number in range(boards):
            rng = np.random.default_rng([seed, width, number])
            columns, rows, truth, picture = render(rng, width, height)
            path = work / "board.png"
            cv2.imwrite(str(path), picture)
            answers = {}
            line = subprocess.run([program, f"{columns}x{rows}", str(times), path], capture_output=True, check=True)
            told = json.loads(line.stdout)
            answers["ours"] = told["milliseconds"], [point[1:] for point in told["points"]]
            for name, flags in (("SB", 0), ("SB accurate", cv2.CALIB_CB_ACCURACY)):
                ms, (ok, at) = cpu(lambda: cv2.findChessboardCornersSB(picture, (columns, rows), flags=flags), times)
                answers[name] = ms, at if ok else []
            for name, (ms, at) in answers.items():
                apart = errors(at, truth, (columns, rows))
                used, all_, whole = found[name]
                used.append(ms)
                if apart is not None:
                    all_.extend(apart)
                found[name] = used, all_, whole + (apart is not None)
            if os.environ.get("EACH"):
                own = errors(answers["ours"][1], truth, (columns, rows))
                print(number, f"{columns}x{rows}", *(f"{name} {ms:.1f} ms {len(at)}" for name, (ms, at) in answers.items()),
                      "missed" if own is None else f"rms {np.sqrt(np.mean(own ** 2)):.4f}")
        own = statistics.median(found["ours"][0])
        for name, (used, all_, whole) in found.items():
            middle, worst, all_ = statistics.median(used), max(used), np.array(all_ or [np.nan])
            print(f"{width}x{height} {name}: {whole} of {boards} whole, {middle:.1f} ms (at most {worst:.1f}), {middle / own:.1f} times "
                  f"ours; rms {np.sqrt(np.mean(all_ ** 2)):.4f}, median {np.median(all_):.4f} px", flush=True)


if __name__ == "__main__":
    main()
