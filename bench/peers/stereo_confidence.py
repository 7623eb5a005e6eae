"""Learns the coefficients of `crates/wheatstone-stereo/src/coefficients.rs`, and prints that file's numbers.

    cargo build --release -p wheatstone-stereo --example match_pair
    python3 bench/peers/stereo_confidence.py target/release/examples/match_pair

The confidence is a logistic regression, learnt from Middlebury's pairs and from renders (stereo_renders.py), every
pair with the same weight. It is judged on pairs that were left out. Standard deviations are learnt from renders, whose truth
is exact. Needs numpy, scipy, pillow and scikit-learn.
"""
import pathlib, re, sys
import numpy as np
from scipy.optimize import minimize
from sklearn.linear_model import LogisticRegression

import stereo_data

RENDERS = range(30)
PIXELS = 4000  # of a pair
FOLDS = 4
COEFFICIENTS = pathlib.Path(__file__).resolve().parents[2] / "crates/wheatstone-stereo/src/coefficients.rs"


def terms(maps):
    """As `confidence.rs`: quantities, then products of each with itself and with those behind it."""
    saturating = lambda value, half: value / (value + half)
    one = np.stack([saturating(maps["gap"], 16.0), saturating(maps["gap"], 64.0), np.clip(maps["lead"] / 16.0, -1.0, 1.0),
                    maps["left_right"] / 1.5, maps["scatter"] / 2.0, 1.0 - maps["known"], np.maximum(maps["correlation"], 0.0),
                    saturating(maps["texture"], 4.0)], -1)
    n = one.shape[-1]
    return np.concatenate([one, *(one[..., k, None] * one[..., k:] for k in range(n))], -1)


def samples(program, pair, exact):
    maps, _ = stereo_data.ours(program, pair, "--evidence")
    use = np.flatnonzero(~np.isnan(maps["disparity"]) & ~np.isnan(pair.truth))
    use = np.random.default_rng(0).permutation(use)[:PIXELS]
    maps, truth = {name: values.ravel()[use] for name, values in maps.items()}, pair.truth.ravel()[use]
    return {"name": pair.name, "exact": exact, "terms": terms(maps), "error": maps["disparity"] - truth,
            "sigma": maps["sigma"], "scatter": maps["scatter"], "confidence": maps["confidence"]}


def blank(seed):
    """A wall without texture, with noise: any disparity is wrong."""
    rng = np.random.default_rng(seed)
    wall = lambda: np.clip(np.rint(120.0 + rng.normal(0.0, 1.0 + seed % 3, (240, 320))), 0, 255).astype(np.uint8)
    return stereo_data.Pair(f"blank{seed}", wall(), wall(), np.full((240, 320), 1000.0, np.float32), np.ones((240, 320), bool), 64)


def stripes(seed):
    """A pattern that repeats along rows: one of several disparities is right, and nothing says which."""
    rng = np.random.default_rng(seed)
    period, shift = int(rng.integers(5, 24)), int(rng.integers(8, 40))
    wave = lambda move: np.where((np.arange(320) + move) % period < period // 2, 90.0, 170.0)
    draw = lambda move: np.clip(np.rint(wave(move) + rng.normal(0.0, 2.0, (240, 320))), 0, 255).astype(np.uint8)
    return stereo_data.Pair(f"stripes{seed}", draw(0), draw(shift), np.full((240, 320), shift, np.float32), np.ones((240, 320), bool), 64)


def exchanged(pair):
    return stereo_data.Pair(pair.name + "-exchanged", pair.right, pair.left, np.full(pair.truth.shape, 1000.0, np.float32), pair.visible, pair.count)


def fit(sets):
    x = np.concatenate([s["terms"] for s in sets])
    y = np.concatenate([np.abs(s["error"]) < 1.0 for s in sets])
    weight = np.concatenate([np.full(len(s["error"]), PIXELS / max(len(s["error"]), PIXELS / 4)) for s in sets])
    return LogisticRegression(C=1e2 / PIXELS, max_iter=300).fit(x, y, sample_weight=weight)


def judge(sets):
    """Calibration on pairs that were left out."""
    chance = [None] * len(sets)
    for fold in range(FOLDS):
        model = fit([s for k, s in enumerate(sets) if k % FOLDS != fold])
        for k in range(fold, len(sets), FOLDS):
            chance[k] = model.predict_proba(sets[k]["terms"])[:, 1] if len(sets[k]["terms"]) else np.zeros(0)
    every, right = np.concatenate(chance), np.concatenate([np.abs(s["error"]) < 1.0 for s in sets])
    for low, high in ((0.0, 0.2), (0.2, 0.4), (0.4, 0.6), (0.6, 0.8), (0.8, 0.9), (0.9, 0.95), (0.95, 0.99), (0.99, 1.01)):
        here = (every >= low) & (every < high)
        print(f"  said {every[here].mean():.3f} true {right[here].mean():.3f} of {here.sum()}" if here.any() else "  none")
    for s, p in zip(sets, chance):
        sure = p > 0.9
        bad = [np.mean(np.abs(s["error"][sure]) > most) if sure.any() else 0.0 for most in (1, 2)]
        print(f"  {s['name']:20} sure {sure.mean() if len(sure) else 0.0:.3f} bad1 {bad[0]:.4f} bad2 {bad[1]:.4f}")


def old_refined():
    text = re.search(r"REFINED[^=]*= \[([^\]]*)\]", COEFFICIENTS.read_text()).group(1)
    return [float(v) for v in text.split(",")]


def fit_sigma(sets, model):
    """Makes 68 % and 95 % of errors of confident pixels lie within one and two standard deviations, as nearly as can be
    both on our renders and on those of the data set, which have other textures."""
    factor, per_scatter = old_refined()
    groups = {"renders": [], "data set": []}
    for s in (s for s in sets if s["exact"] and len(s["terms"])):
        sure = model.predict_proba(s["terms"])[:, 1] > 0.9
        told = s["sigma"] / (factor * (1.0 + per_scatter * s["scatter"]))
        groups["renders" if s["name"].startswith("render") else "data set"].append(np.stack([told, s["scatter"], np.abs(s["error"])])[:, sure])
    groups = {name: np.concatenate(parts, 1) for name, parts in groups.items()}

    def ratios(p, group):
        told, scatter, error = group
        return error / (p[0] * told * (1.0 + p[1] * scatter))

    def loss(p):
        if min(p) < 0.0:
            return 1e3
        total = 0.0
        for group in groups.values():
            r = ratios(p, group)
            # A likelihood of long tails keeps standard deviations proportional to errors; coverage is what must come out.
            total += 1e-4 * np.mean(np.sqrt(1.0 + r**2) - np.log(r + 1e-6)) + (np.mean(r < 1) - 0.68) ** 2 + 2.0 * (np.mean(r < 2) - 0.95) ** 2
        return total

    best = min((minimize(loss, start, method="Nelder-Mead") for start in ([1.2, 0.5], [1.0, 1.5])), key=lambda r: r.fun).x
    for name, group in groups.items():
        r = ratios(best, group)
        print(f"  {name}: within 1, 2, 3 sigma", *(f"{np.mean(r < k):.4f}" for k in (1, 2, 3)))
    return best


def fit_unrefined(model, program):
    """As `fit_sigma`, for disparities as aggregation finds them."""
    groups = [list(stereo_data.rendered(RENDERS[::3])), [pair for pair in stereo_data.real() if pair.exact]]
    for k, pairs in enumerate(groups):
        scatter, error = [], []
        for pair in pairs:
            maps, _ = stereo_data.ours(program, pair, "--coarse", "--evidence")
            known = ~np.isnan(maps["disparity"])
            sure = np.zeros(known.shape, bool)
            sure[known] = model.predict_proba(terms({name: values[known] for name, values in maps.items()}))[:, 1] > 0.9
            scatter.append(maps["scatter"][sure])
            error.append(np.abs(maps["disparity"] - pair.truth)[sure])
        groups[k] = np.concatenate(scatter), np.concatenate(error)

    def loss(p):
        if min(p) < 0.0:
            return 1e3
        ratios = [error / np.maximum(p[0] + p[1] * scatter, 1e-3) for scatter, error in groups]
        return sum((np.mean(r < 1) - 0.68) ** 2 + 2.0 * (np.mean(r < 2) - 0.95) ** 2 for r in ratios)

    return minimize(loss, [0.12, 0.15], method="Nelder-Mead").x


def main():
    program = sys.argv[1]
    pairs = [(pair, pair.name.startswith("syn")) for pair in stereo_data.real()]
    others = [(exchanged(pair), False) for pair, _ in pairs[::3]] + [(made(seed), False) for made in (blank, stripes) for seed in range(4)]
    renders = [(pair, True) for pair in stereo_data.rendered(RENDERS)]
    sets = [samples(program, pair, exact) for pair, exact in pairs + others + renders]
    judge(sets)
    model = fit(sets)
    weights = [round(float(w), 3) for w in model.coef_[0]]
    print("CONFIDENCE constant", round(float(model.intercept_[0]), 3), "quantities", weights[:8], "products", weights[8:])
    print("REFINED", [round(float(v), 4) for v in fit_sigma(sets, model)])
    print("UNREFINED", [round(float(v), 4) for v in fit_unrefined(model, program)])


if __name__ == "__main__":
    main()
