"""Dense stereo matching beside OpenCV's, in one run: errors at equal density, CPU time on one thread, as ratios.

    cargo build --release -p wheatstone-stereo --example match_pair
    python3 bench/peers/stereo.py target/release/examples/match_pair [times] [--renders]

Needs numpy, scipy, pillow and opencv-python-headless; with opencv-contrib-python-headless instead, filled maps are also compared
with those of OpenCV's weighted least-squares filter (WLS). With --renders, pairs that the confidence was not learnt from and
whose truth is exact come on top. Errors are over pixels that both cameras see; of ours, the most confident
ones are taken until there are as many as the other gives.
"""
import sys, time
import cv2
import numpy as np

import stereo_data

MODES = {"SGBM": cv2.STEREO_SGBM_MODE_SGBM, "3WAY": cv2.STEREO_SGBM_MODE_SGBM_3WAY, "HH4": cv2.STEREO_SGBM_MODE_HH4, "HH": cv2.STEREO_SGBM_MODE_HH}
FLOOR = 2e-4  # added to shares before they are divided
# Bars: name of the measure, beside whom, the most that the ratio may be.
BARS = [("bad1", "HH", 0.80), ("bad2", "HH", 0.75), ("bad4", "HH", 0.80), ("median", "HH", 0.75), ("bad2", "SGBM", 0.60),
        ("coarse", "HH", 0.5), ("coarse", "SGBM", 1.0), ("whole", "HH", 1.5)]


def opencv(name, count):
    count = (count + 15) // 16 * 16
    if name == "BM":
        return cv2.StereoBM_create(count, 15)
    return cv2.StereoSGBM_create(minDisparity=0, numDisparities=count, blockSize=3, P1=8 * 9, P2=32 * 9, disp12MaxDiff=1,
                                 uniquenessRatio=10, speckleWindowSize=100, speckleRange=2, mode=MODES[name])


def theirs(matcher, pair, times):
    seconds = []
    for _ in range(times):
        start = time.process_time()
        found = matcher.compute(pair.left, pair.right)
        seconds.append(time.process_time() - start)
    found = found.astype(np.float32) / 16.0
    found[found < 0.0] = np.nan
    return found, min(seconds)


def errors(found, pair, mask):
    return np.abs(found - pair.truth)[mask]


def measures(values):
    bad = {f"bad{most}": float(np.mean(values > most)) for most in (1, 2, 4)}
    return {**bad, "median": float(np.median(values))}


def filled(found):
    """Gaps get the smaller disparity of their ends, as ours."""
    out = found.copy()
    for row in out:
        known = np.flatnonzero(~np.isnan(row))
        if len(known):
            after = np.searchsorted(known, np.arange(len(row)))
            right = row[known[np.minimum(after, len(known) - 1)]]
            left = row[known[np.maximum(after - 1, 0)]]
            gap = np.isnan(row)
            row[gap] = np.minimum(left, right)[gap]
    return out


def weighted(pair):
    """OpenCV's HH after its weighted least-squares filter, over all pixels; `None` without its extra modules."""
    if not hasattr(cv2, "ximgproc"):
        return None
    left = opencv("HH", pair.count)
    right = cv2.ximgproc.createRightMatcher(left)
    smooth = cv2.ximgproc.createDisparityWLSFilter(left)
    # The best of four for it on these pairs: with OpenCV's usual 8000 and 1.5 it has 19 % where this has 12.
    smooth.setLambda(100.0)
    smooth.setSigmaColor(0.8)
    found = smooth.filter(left.compute(pair.left, pair.right), pair.left, None, right.compute(pair.right, pair.left)) / 16.0
    return filled(np.where(found < 0.0, np.nan, found).astype(np.float32))


def locking(error, truth):
    """The amplitude of errors that follow the fraction of the disparity."""
    phase = 2.0 * np.pi * truth
    wave = np.stack([np.sin(phase), np.cos(phase), np.ones_like(phase)], 1)
    return float(np.hypot(*np.linalg.lstsq(wave, error, rcond=None)[0][:2]))


def confident(pair, maps):
    known = ~np.isnan(pair.truth)
    sure = maps["confidence"] > 0.9
    values = np.abs(maps["disparity"] - pair.truth)
    seen = sure & pair.visible & known
    out = {"bad2": np.mean(values[sure & known] > 2), "visible bad2": np.mean(values[seen] > 2), "density": np.mean(sure[known]),
           "of visible": np.mean(sure[pair.visible & known])}
    signed = (maps["disparity"] - pair.truth)[sure & known]
    near = np.abs(signed) < 1.0
    ratio = np.abs(signed) / maps["sigma"][sure & known]
    out |= {"within 1": np.mean(ratio < 1), "within 2": np.mean(ratio < 2), "rms": np.sqrt(np.mean(signed[near] ** 2)),
            # Truths in steps of a fraction of a pixel say nothing of it.
            "locking": locking(signed[near], pair.truth[sure & known][near]) if pair.exact else np.nan}
    return {name: float(value) for name, value in out.items()}


def compare(program, pair, times):
    fine, whole = stereo_data.ours(program, pair, repeat=times)
    _, coarse = stereo_data.ours(program, pair, "--coarse", repeat=times)
    full, _ = stereo_data.ours(program, pair, "--fill")
    known = ~np.isnan(pair.truth)
    seen = pair.visible & known
    row = {"confident": confident(pair, fine), "filled": float(np.mean(errors(full["disparity"], pair, known) > 2)), "peers": {}}
    smooth = weighted(pair)
    row["weighted"] = np.nan if smooth is None else float(np.mean(errors(smooth, pair, known) > 2))
    order = np.where(np.isnan(fine["disparity"]), -1.0, fine["confidence"])[seen]
    own = errors(fine["disparity"], pair, seen)[np.argsort(-order, kind="stable")]
    for name in [*MODES, "BM"]:
        found, seconds = theirs(opencv(name, pair.count), pair, times)
        given = seen & ~np.isnan(found)
        most = min(int(given.sum()), int((order >= 0.0).sum()))
        other, mine = measures(errors(found, pair, given)), measures(own[:most])
        ratios = {k: (mine[k] + FLOOR) / (other[k] + FLOOR) for k in mine}
        ratios |= {"coarse": coarse / seconds, "whole": whole / seconds}
        row["peers"][name] = {"ratios": ratios, "own": mine, "other": other, "density": float(given.sum() / seen.sum()),
                              "lacking": 1.0 - most / max(1, int(given.sum())), "filled": float(np.mean(errors(filled(found), pair, known) > 2))}
    return row


def geometric(values):
    return float(np.exp(np.mean(np.log(values))))


def mean(rows, name):
    return f"{100 * np.mean([row[name] for row in rows.values()]):.2f} %"


def report(rows):
    for peer in [*MODES, "BM"]:
        print(f"\nours / {peer}, per pair")
        for name, row in rows.items():
            r = row["peers"][peer]
            print(f"  {name:12}", *(f"{k} {v:.2f}" for k, v in r["ratios"].items()), f"density {r['density']:.3f} lacking {r['lacking']:.3f}",
                  f"bad2 {100 * r['own']['bad2']:.2f} % / {100 * r['other']['bad2']:.2f} %")
        keys = next(iter(rows.values()))["peers"][peer]["ratios"]
        print("  geometric   ", *(f"{k} {geometric([row['peers'][peer]['ratios'][k] for row in rows.values()]):.3f}" for k in keys))
    print("\nabove a confidence of 0.9")
    for name, row in rows.items():
        print(f"  {name:12}", *(f"{k} {v:.3f}" for k, v in row["confident"].items()), f"filled bad2 {100 * row['filled']:.2f} % / {100 * row['peers']['HH']['filled']:.2f} %")
    keys = next(iter(rows.values()))["confident"]
    print("  mean        ", *(f"{k} {np.nanmean([row['confident'][k] for row in rows.values()]):.4f}" for k in keys),
          f"filled bad2 {100 * np.mean([row['filled'] for row in rows.values()]):.2f} % / {100 * np.mean([row['peers']['HH']['filled'] for row in rows.values()]):.2f} %")
    print(f"  filled bad2 over all pixels: ours {mean(rows, 'filled')}, HH after weighted least squares {mean(rows, 'weighted')}")
    print()
    for measure, peer, most in BARS:
        value = geometric([row["peers"][peer]["ratios"][measure] for row in rows.values()])
        print(f"{'holds' if value <= most else 'FAILS'}: {measure} / {peer} {value:.3f} <= {most}")
    worst = max((row["peers"]["HH"]["ratios"][k], name, k) for name, row in rows.items() for k in ("bad1", "bad2", "bad4"))
    print(f"{'holds' if worst[0] <= 1.3 else 'FAILS'}: worst pair {worst[1]} {worst[2]} / HH {worst[0]:.2f} <= 1.3")


def main():
    cv2.setNumThreads(1)
    numbers = [int(a) for a in sys.argv[2:] if a.isdigit()]
    times = numbers[0] if numbers else 5
    pairs = list(stereo_data.real())
    report({pair.name: compare(sys.argv[1], pair, times) for pair in pairs})
    if "--renders" in sys.argv:
        print("\n\nrenders")
        report({pair.name: compare(sys.argv[1], pair, 1) for pair in stereo_data.rendered(range(1000, 1012))})


if __name__ == "__main__":
    main()
