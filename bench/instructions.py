"""A guard against slowness that does not depend on the clock: instructions counted by callgrind.

    cargo bench --no-run
    python3 bench/instructions.py            compares with bench/instructions.json, fails beyond 5 %
    python3 bench/instructions.py --note     notes what is counted now

Needs valgrind, which has no 512-bit registers: the kernels run in the widest that it has. It emulates products that
are added without being rounded, one number at a time, so that a minute passes for a million points. Counts differ a
little between compilers, so that they are to be noted again with a new one.
"""
import json, pathlib, re, subprocess, sys

here = pathlib.Path(__file__).parent
NOTED = here / "instructions.json"
MOST = 1.05
# Each with more work and with less: what both have in common, such as fits and pictures, is not counted.
WORK = {
    "an epoch in single precision": ("kernels", ["training", "single"], 150, 50),
    "an epoch in double precision": ("kernels", ["training", "double"], 150, 50),
    "a second-order step": ("kernels", ["steps"], 48, 16),
    "a million points by brown": ("locate", ["brown", "points"], 3, 2),
    "a million points by brown with error bars": ("locate", ["brown", "bars"], 3, 2),
    "a million points by the paper's network": ("locate", ["network:paper", "points"], 3, 2),
}


def program(bench):
    """The newest of a bench's programs."""
    found = (here.parent / "target/release/deps").glob(f"{bench}-*")
    return max((path for path in found if not path.suffix), key=lambda path: path.stat().st_mtime)


def instructions(bench, arguments):
    command = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", str(program(bench)), *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return int(re.search(r"Collected : (\d+)", done.stderr).group(1))


def main():
    counted = {}
    for name, (bench, arguments, more, less) in WORK.items():
        last = ["1"] if bench == "locate" else []
        of = lambda times: instructions(bench, [*arguments, str(times), *last])
        counted[name] = round((of(more) - of(less)) / (more - less))
        print(f"{name}: {counted[name]:,}", flush=True)
    if "--note" in sys.argv:
        NOTED.write_text(json.dumps(counted, indent=1) + "\n")
        return
    noted = json.loads(NOTED.read_text())
    slower = [name for name, count in counted.items() if count > MOST * noted.get(name, count)]
    if slower:
        sys.exit(f"more instructions than noted: {', '.join(slower)}")


main()
