"""The network's training beside other programs, in one run: ratios of CPU seconds, medians.

    cargo bench --bench kernels --no-run
    python3 bench/peers/network.py target/release/deps/kernels-* [times]

Plain C is compiled here (gcc -O3, as a user would); numpy's Levenberg-Marquardt is written out below; what
`frameworks.py` has of JAX, PyTorch, scikit-learn and scipy runs where that is installed. All run on one thread, one after the other and again, so that what else the machine does falls on all of them.
"""
import os, pathlib, statistics, subprocess, sys, tempfile
for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[name] = "1"

here = pathlib.Path(__file__).parent
EPOCHS, STEPS = 20_000, 208
# The other programs' work, ours that is the same, and how much of it they are given.
FRAMEWORKS = [("numpy_training", "single", 10_000), ("jax_training", "single", 10_000), ("torch_training", "single", 4_000),
              ("sklearn_training", "single", 4_000), ("scipy_steps", "steps", 60)]


def numpy_steps(count):
    """Second-order steps of 4-8-8-3 on 400 samples: Jacobian, J'J, and a solve each."""
    import numpy as np
    rng = np.random.default_rng(1)
    x, sizes = rng.uniform(size=(400, 4)), [4, 8, 8, 3]
    t = np.column_stack([0.5 * (x[:, 0] + x[:, 1] * x[:, 2]), 0.5 * (x[:, 1] + x[:, 3] * x[:, 0]),
                         0.3 / (0.5 + x[:, 0] * x[:, 2])])
    w = [rng.normal(size=(o, i)) for i, o in zip(sizes, sizes[1:])]
    b = [rng.normal(size=o) for o in sizes[1:]]

    def forward(w, b):
        a = [x]
        for layer in range(3):
            z = a[-1] @ w[layer].T + b[layer]
            a.append(z if layer == 2 else 1 / (1 + np.exp(-z)))
        return a

    damping, a = 1e-2, forward(w, b)
    for _ in range(count):
        parts, d = [], np.broadcast_to(np.eye(3), (400, 3, 3))
        for layer in (2, 1, 0):
            parts.insert(0, np.concatenate([(d[..., None] * a[layer][:, None, None, :]).reshape(1200, -1),
                                            d.reshape(1200, -1)], axis=1))
            if layer:
                d = (d @ w[layer]) * (a[layer] * (1 - a[layer]))[:, None, :]
        j, e = np.concatenate(parts, axis=1), (a[3] - t).ravel()
        h, g = j.T @ j, j.T @ e
        for _ in range(30):
            s = np.linalg.solve(h + damping * np.diag(1 + np.diag(h)), g)
            new_w, new_b, k = [], [], 0
            for layer in range(3):
                n = w[layer].size
                new_w.append(w[layer] - s[k:k + n].reshape(w[layer].shape)); k += n
                new_b.append(b[layer] - s[k:k + b[layer].size]); k += b[layer].size
            moved = forward(new_w, new_b)
            if ((moved[3] - t) ** 2).sum() < (e ** 2).sum():
                w, b, a, damping = new_w, new_b, moved, max(damping / 5, 1e-12)
                break
            damping *= 4


def cpu(command):
    """CPU seconds of a program, its start among them."""
    child = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    _, status, used = os.wait4(child.pid, 0)
    child.returncode = status
    if status:
        sys.exit(f"{command} failed")
    return used.ru_utime + used.ru_stime


def main():
    program = sys.argv[1]
    times = int(sys.argv[2]) if len(sys.argv) > 2 else 5
    work = pathlib.Path(tempfile.mkdtemp())
    for name, real, exp in (("single", "float", "expf"), ("double", "double", "exp")):
        subprocess.run(["gcc", "-O3", f"-DREAL={real}", f"-DEXP={exp}", "-o", work / name, here / "training.c", "-lm"],
                       check=True)
    ours = {
        "single": [program, "training", "single", str(5 * EPOCHS)],
        "double": [program, "training", "double", str(5 * EPOCHS)],
        "steps": [program, "steps", str(STEPS)],
    }
    theirs = {
        "single": [work / "single", str(5 * EPOCHS)],
        "double": [work / "double", str(5 * EPOCHS)],
        "steps": [sys.executable, __file__, "numpy", str(STEPS)],
    }
    nothing = statistics.median(cpu([sys.executable, __file__, "numpy", "0"]) for _ in range(times))
    found = {name: ([], []) for name in ours}
    for _ in range(times):
        for name, (own, other) in found.items():
            own.append(cpu(ours[name]))
            other.append(cpu(theirs[name]) - (nothing if name == "steps" else 0))
    for name, (own, other) in found.items():
        a, b = statistics.median(own), statistics.median(other)
        what = f"{STEPS} steps, numpy" if name == "steps" else f"{5 * EPOCHS} epochs, plain C, {name}"
        print(f"{what}: {b:.2f} s, ours {a:.3f} s: {b / a:.1f} times faster", flush=True)
    for name, mine, count in FRAMEWORKS:
        own, other = [], []
        for _ in range(times):
            own.append(cpu(ours[mine]))
            run = subprocess.run([sys.executable, here / "frameworks.py", name, str(count)], capture_output=True, text=True)
            if run.returncode == 0:
                whole = STEPS if mine == "steps" else 5 * EPOCHS
                other.append(float(run.stdout.split()[-1]) * whole / count)
        if other:
            a, b = statistics.median(own), statistics.median(other)
            print(f"{name}, {mine}: {b:.2f} s, ours {a:.3f} s: {b / a:.1f} times faster", flush=True)


if __name__ == "__main__":
    if sys.argv[1] == "numpy":
        numpy_steps(int(sys.argv[2]))
    else:
        main()
