"""Many points located beside other programs, in one run: ratios of CPU seconds, medians.

    cargo bench --bench locate --no-run
    python3 bench/peers/locate.py target/release/deps/locate-* [times]

The other programs are those that are installed among numpy, onnxruntime, torch and opencv-python-headless.
All run on one thread, one after the other and again, so that what else the machine does falls on all.
"""
import pathlib, statistics, subprocess, sys

from network import cpu

here = pathlib.Path(__file__).parent
MILLIONS = 100
# Ours, and what does the same work elsewhere, with the points (in millions) of one round there.
PAIRS = [
    ("network:paper", "points", [("onnx_points", 1.0), ("torch_points", 1.0), ("numpy_points", 1.0)]),
    ("brown", "points", [("opencv_points", 0.1)]),
    ("brown", "bars", [("opencv_points", 0.1)]),
    ("dlt", "points", []),
    ("soloff", "points", []),
    ("soloff", "bars", []),
    ("neural-camera", "points", []),
    ("neural-camera", "bars", []),
    ("network", "points", []),
    ("network", "bars", []),
]


def theirs(name, rounds):
    """CPU seconds of so many rounds; none where the program is not installed."""
    done = subprocess.run([sys.executable, here / "frameworks.py", name, str(rounds)], capture_output=True, text=True)
    return float(done.stdout.split()[-1]) if done.returncode == 0 else None


def main():
    program, times = sys.argv[1], int(sys.argv[2]) if len(sys.argv) > 2 else 5
    for method, what, peers in PAIRS:
        own, others = [], {name: [] for name, _ in peers}
        for _ in range(times):
            start = cpu([program, method, what, "1", "1"])
            # Both fit the method first, which takes longer at one time than at another.
            seconds = cpu([program, method, what, str(1 + MILLIONS), "1"]) - start
            if seconds > 0.0:
                own.append(MILLIONS / seconds)
            for name, millions in peers:
                rounds = max(2, round(2 / millions))
                seconds = theirs(name, rounds)
                if seconds is not None:
                    others[name].append(rounds * millions / seconds)
        if not own:
            print(f"{method} {what}: too little work to tell")
            continue
        ours = statistics.median(own)
        beside = [f"{name} {statistics.median(v):.2f} ({ours / statistics.median(v):.1f} times)" for name, v in others.items() if v]
        print(f"{method} {what}: {ours:.1f} M points/s", *beside, sep=", ", flush=True)


main()
