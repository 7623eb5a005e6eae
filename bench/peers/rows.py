"""`wheatstone locate` as a stream: rows a second, of CPU and by the clock, and memory at its peak.

    cargo build --release
    python3 -m venv venv && venv/bin/pip install pyarrow numpy
    venv/bin/python bench/peers/rows.py target/release/wheatstone [folder] [--large] [--model model.json]

Tables of 1, 10 and, with --large, 100 million rows are made once in the folder (100 million take 15 GB there
with what comes out): the pixels of 20,000 random points, repeated and moved by up to a hundredth of a pixel.
Beside it pyarrow reads the same columns and writes as many, and locates nothing: what reading and writing cost.
"""
import os, pathlib, subprocess, sys, tempfile, time

MILLION = 1_000_000
CSV_ROWS = 10 * MILLION  # What is larger is made as Parquet only.


def make(program, folder, given):
    """A model, and the pixels of random points."""
    import pyarrow.csv
    run = lambda *arguments: subprocess.run([program, "-q", *map(str, arguments)], check=True,
                                            stdout=subprocess.DEVNULL)
    train, seed, model = folder / "train.csv", folder / "seed.csv", folder / "model.json"
    if not seed.exists():
        run("synth", "--points", "--noise", "0.1", "-o", train)
        run("synth", "--random", "20000", "--noise", "0.1", "--seed", "1", "-o", seed)
    if not given and not model.exists():
        run("fit", train, "--method", "dlt", "--no-validation", "-o", model)
    pixels = pyarrow.csv.read_csv(seed).select(["x1", "y1", "x2", "y2"])
    return [column.to_numpy() for column in pixels.columns], pixels.column_names


def paths(folder, millions):
    """Of the tables; what is very large is made as Parquet only."""
    parquet, csv = folder / f"in{millions}.parquet", folder / f"in{millions}.csv"
    return [parquet, csv] if millions * MILLION <= CSV_ROWS else [parquet]


def tables(program, folder, given, counts):
    """Makes what is missing of the model and the tables."""
    import numpy as np, pyarrow as pa, pyarrow.parquet, pyarrow.csv
    columns, names = make(program, folder, given)
    schema = pa.schema([(name, pa.float64()) for name in names])
    for millions in counts:
        parquet, *csv = paths(folder, millions)
        if parquet.exists():
            continue
        rng = np.random.default_rng(millions)
        with pa.parquet.ParquetWriter(parquet, schema) as binary:
            text = pa.csv.CSVWriter(csv[0], schema) if csv else None
            for _ in range(millions):
                moved = [np.resize(c, MILLION) + rng.uniform(-0.01, 0.01, MILLION) for c in columns]
                batch = pa.table(moved, schema=schema)
                binary.write_table(batch)
                if text:
                    text.write_table(batch)
            if text:
                text.close()


def measured(command):
    """CPU and clock in seconds, and the most memory in megabytes."""
    began = time.perf_counter()
    child = subprocess.Popen(command)
    _, status, usage = os.wait4(child.pid, 0)
    assert status == 0, command
    return usage.ru_utime + usage.ru_stime, time.perf_counter() - began, usage.ru_maxrss / 1024


def peer(source, target):
    """What pyarrow takes to read a table and write it with seven more numbers and two words."""
    import pyarrow as pa, pyarrow.parquet, pyarrow.csv

    def widened(batch):
        table = pa.Table.from_batches([batch])
        for index, name in enumerate(["X", "Y", "Z", "sX", "sY", "sZ", "residual"]):
            table = table.append_column(name, table.column(index % 4))
        for name, word in [("trust", "inside"), ("mismatch", None)]:
            word = pa.array([word], pa.string()).dictionary_encode()
            table = table.append_column(name, pa.chunked_array([word.take(pa.array([0] * len(batch)))]))
        return table

    if source.endswith(".parquet"):
        batches, writer = pa.parquet.ParquetFile(source).iter_batches(1 << 16), None
        for table in map(widened, batches):
            writer = writer or pa.parquet.ParquetWriter(target, table.schema)
            writer.write_table(table)
    else:
        batches, writer = pa.csv.open_csv(source), None
        for table in map(widened, batches):
            plain = table.set_column(11, "trust", table["trust"].cast(pa.string()))
            plain = plain.set_column(12, "mismatch", table["mismatch"].cast(pa.string()))
            writer = writer or pa.csv.CSVWriter(target, plain.schema)
            writer.write_table(plain)
    writer.close()


def main():
    if sys.argv[1] == "--peer":
        return peer(*sys.argv[2:])
    if sys.argv[1] == "--tables":
        program, folder, given, *counts = sys.argv[2:]
        return tables(program, pathlib.Path(folder), given, map(int, counts))
    arguments = sys.argv[1:]
    large = "--large" in arguments and (arguments.remove("--large") or True)
    given = None
    if "--model" in arguments:
        at = arguments.index("--model")
        given, arguments[at:at + 2] = arguments[at + 1], []
    program = pathlib.Path(arguments[0]).resolve()
    folder = pathlib.Path(arguments[1] if len(arguments) > 1 else tempfile.mkdtemp())
    folder.mkdir(parents=True, exist_ok=True)
    counts = [1, 10, 100] if large else [1, 10]
    # In a process of its own: a child's peak of memory begins with what its parent holds.
    own = [sys.executable, __file__, "--tables", program, folder, given or "", *map(str, counts)]
    subprocess.run(own, check=True)
    model = given or folder / "model.json"
    print(f"{'':34} {'CPU ns/row':>10} {'M rows/s':>9} {'clock':>7} {'MB':>6}   (M rows/s on two cores if both are busy; by the clock)")
    for millions in counts:
        for source in paths(folder, millions):
            target = folder / f"out{source.suffix}"
            commands = {"wheatstone": [program, "-q", "locate", model, source, "-o", target]}
            if millions < 100:
                own = [sys.executable, __file__, "--peer"]
                commands["pyarrow, read and write only"] = own + [str(source), str(target)]
            for name, command in commands.items():
                cpu, clock, memory = measured(command)
                rows = millions * MILLION
                print(f"{name:30} {source.suffix[1:4]:3} {cpu / rows * 1e9:7.0f} {2e-6 * rows / cpu:9.2f}"
                      f" {1e-6 * rows / clock:7.2f} {memory:6.0f}   {millions} M rows", flush=True)
                target.unlink()


main()
