"""Learns the coefficients of `crates/wheatstone-stereo/src/coefficients.rs`, and prints that file's numbers.

    cargo build --release -p wheatstone-stereo --example match_pair
    python3 bench/peers/stereo_confidence.py target/release/examples/match_pair

The confidence is a network with one hidden layer, learnt from Middlebury's pairs and from renders (stereo_renders.py), every
pair with the same weight. It is judged on pairs that were left out. Standard deviations are learnt from renders, whose truth
is exact. Needs numpy, scipy, pillow and scikit-learn.
"""
import pathlib, re, sys, warnings
import numpy as np
from scipy.optimize import minimize
from sklearn.exceptions import ConvergenceWarning
from sklearn.neural_network import MLPClassifier

import stereo_data

RENDERS = range(30)
PIXELS = 4000  # of a pair
FOLDS = 5
HIDDEN = 16
ROUNDS = 15
MOST_DOUBT = 0.05  # as in `error_bars.rs`
COEFFICIENTS = pathlib.Path(__file__).resolve().parents[2] / "crates/wheatstone-stereo/src/coefficients.rs"


def quantities(maps):
    """As `confidence.rs`."""
    saturating = lambda value, half: value / (value + half)
    return np.stack([saturating(maps["gap"], 16.0), np.clip(maps["lead"] / 16.0, -1.0, 1.0), maps["left_right"] / 1.5, maps["scatter"] / 2.0,
                     1.0 - maps["known"], np.maximum(maps["correlation"], 0.0), saturating(maps["texture"], 4.0),
                     np.minimum(maps["surface"] / 10.0, 1.0), np.clip(maps["border"] / 20.0, -1.0, 1.0), 1.0 - maps["wide_known"],
                     maps["wide_correlation"]], -1)


class Network:
    """Learns from quantities of mean 0 and deviation 1."""

    def __init__(self, x, right, weight):
        self.mean, self.deviation = x.mean(0), x.std(0)
        self.net = MLPClassifier((HIDDEN,), max_iter=ROUNDS, n_iter_no_change=ROUNDS, learning_rate_init=3e-3, batch_size=400, alpha=1e-2, random_state=0)
        # Samples as often as their weight says.
        chosen = np.random.default_rng(1).choice(len(right), len(right), p=weight / weight.sum())
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ConvergenceWarning)  # it always takes all its rounds
            self.net.fit(((x - self.mean) / self.deviation)[chosen], right[chosen])

    def chance(self, x):
        return self.net.predict_proba((x - self.mean) / self.deviation)[:, 1]

    def source(self):
        """The numbers of `coefficients.rs`, for quantities as they are."""
        (first, last), (constants, constant) = self.net.coefs_, self.net.intercepts_
        weights = first / self.deviation[:, None]
        constants = constants - self.mean @ weights
        number = lambda value: f"{value:.4g}" if "." in f"{value:.4g}" or "e" in f"{value:.4g}" else f"{value:.4g}.0"
        lines = [f"    constant: {number(constant[0])},", "    hidden: ["]
        for k in range(HIDDEN):
            lines += ["        Unit {", f"            constant: {number(constants[k])},", "            weights: [" + ", ".join(map(number, weights[:, k])) + "],",
                      f"            out: {number(last[k, 0])},", "        },"]
        return "\n".join([*lines, "    ],"])


def samples(program, pair, exact):
    maps, _ = stereo_data.ours(program, pair, "--evidence")
    use = np.flatnonzero(~np.isnan(maps["disparity"]) & ~np.isnan(pair.truth))
    use = np.random.default_rng(0).permutation(use)[:PIXELS]
    maps, truth = {name: values.ravel()[use] for name, values in maps.items()}, pair.truth.ravel()[use]
    return {"name": pair.name, "exact": exact, "quantities": quantities(maps), "error": maps["disparity"] - truth,
            "sigma": maps["sigma"], "confidence": maps["confidence"]}


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
    x = np.concatenate([s["quantities"] for s in sets])
    y = np.concatenate([np.abs(s["error"]) < 1.0 for s in sets])
    weight = np.concatenate([np.full(len(s["error"]), PIXELS / max(len(s["error"]), PIXELS / 4)) for s in sets])
    return Network(x, y, weight)


def judge(sets):
    """Calibration on pairs that were left out, each with what was made of it."""
    scenes = list(dict.fromkeys(s["name"].split("-")[0] for s in sets))
    folds = [scenes.index(s["name"].split("-")[0]) % FOLDS for s in sets]
    chance = [None] * len(sets)
    for fold in range(FOLDS):
        model = fit([s for s, own in zip(sets, folds) if own != fold])
        for k in (k for k, own in enumerate(folds) if own == fold):
            chance[k] = model.chance(sets[k]["quantities"]) if len(sets[k]["quantities"]) else np.zeros(0)
    every, right = np.concatenate(chance), np.concatenate([np.abs(s["error"]) < 1.0 for s in sets])
    for low, high in ((0.0, 0.2), (0.2, 0.4), (0.4, 0.6), (0.6, 0.8), (0.8, 0.9), (0.9, 0.95), (0.95, 0.99), (0.99, 1.01)):
        here = (every >= low) & (every < high)
        print(f"  said {every[here].mean():.3f} true {right[here].mean():.3f} of {here.sum()}" if here.any() else "  none")
    for s, p in zip(sets, chance):
        sure = p > 0.9
        bad = [np.mean(np.abs(s["error"][sure]) > most) if sure.any() else 0.0 for most in (1, 2)]
        print(f"  {s['name']:20} sure {sure.mean() if len(sure) else 0.0:.3f} bad1 {bad[0]:.4f} bad2 {bad[1]:.4f}")


def fit_doubt(sets, model):
    """How standard deviations grow with doubt, so that errors of confident pixels are in proportion to them: by the likelihood
    of Student's t with four degrees of freedom, on our renders and on those of the data set, which have other textures."""
    old = float(re.search(r"PER_DOUBT[^=]*= ([^;]*);", COEFFICIENTS.read_text()).group(1))
    told = lambda of, per_doubt: of[0] * (1.0 + per_doubt * np.minimum(of[1], MOST_DOUBT))
    groups = {"renders": [], "data set": []}
    for s in (s for s in sets if s["exact"] and len(s["quantities"])):
        doubt = 1.0 - model.chance(s["quantities"])
        alone = s["sigma"] / told([1.0, 1.0 - s["confidence"]], old)
        groups["renders" if s["name"].startswith("render") else "data set"].append(np.stack([alone, doubt, np.abs(s["error"])])[:, doubt < 0.1])
    groups = {name: np.concatenate(parts, 1) for name, parts in groups.items()}

    def unlikely(p):
        sigmas = ((p[0] * told(of, p[1]), of[2]) for of in groups.values())
        return sum(np.mean(np.log(s) + 2.5 * np.log1p((error / s) ** 2 / 4.0)) for s, error in sigmas) if min(p) > 0.0 else 1e3

    _, per_doubt = minimize(unlikely, [1.0, 20.0], method="Nelder-Mead").x
    for name, of in groups.items():
        ratio = of[2] / told(of, per_doubt)
        for low, high in ((0.0, 0.002), (0.002, 0.01), (0.01, 0.1), (0.0, 0.1)):
            here = ratio[(of[1] >= low) & (of[1] < high)]
            print(f"  {name}, doubt {low} to {high}: within 1, 2, 3 sigma", *(f"{np.mean(here < k):.4f}" for k in (1, 2, 3)))
    return per_doubt


def fit_unrefined(model, program):
    """The same of disparities as aggregation finds them, from their scatter."""
    groups = [list(stereo_data.rendered(RENDERS[::3])), [pair for pair in stereo_data.real() if pair.exact]]
    for k, pairs in enumerate(groups):
        scatter, error = [], []
        for pair in pairs:
            maps, _ = stereo_data.ours(program, pair, "--coarse", "--evidence")
            known = ~np.isnan(maps["disparity"])
            sure = np.zeros(known.shape, bool)
            sure[known] = model.chance(quantities({name: values[known] for name, values in maps.items()})) > 0.9
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
    others = [(exchanged(pair), False) for pair, _ in pairs[::2]] + [(made(seed), False) for made in (blank, stripes) for seed in range(8)]
    renders = [(pair, True) for pair in stereo_data.rendered(RENDERS)]
    sets = [samples(program, pair, exact) for pair, exact in pairs + others + renders]
    judge(sets)
    model = fit(sets)
    print("CONFIDENCE", model.source(), sep="\n")
    print("PER_DOUBT", round(float(fit_doubt(sets, model)), 1))
    print("UNREFINED", [round(float(v), 4) for v in fit_unrefined(model, program)])


if __name__ == "__main__":
    main()
