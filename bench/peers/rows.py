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
    if not model.exists():
        run("fit", train, "--method", "dlt", "--no-validation", "-o", model)
    pixels = pyarrow.csv.read_csv(seed).select(["x1", "y1", "x2", "y2"])
    return given or model, [column.to_numpy() for column in pixels.columns], pixels.column_names


def tables(folder, millions, columns, names):
    """The tables' paths; made where they are missing."""
    import numpy as np, pyarrow as pa, pyarrow.parquet, pyarrow.csv
    parquet, csv = folder / f"in{millions}.parquet", folder / f"in{millions}.csv"
    rng, missing = np.random.default_rng(millions), not parquet.exists()
    schema = pa.schema([(name, pa.float64()) for name in names])
    wants_csv = millions * MILLION <= CSV_ROWS
    if missing:
        with pa.parquet.ParquetWriter(parquet, schema) as binary:
            text = pa.csv.CSVWriter(csv, schema) if wants_csv else None
            for _ in range(millions):
                moved = [np.resize(c, MILLION) + rng.uniform(-0.01, 0.01, MILLION) for c in columns]
                batch = pa.table(moved, schema=schema)
                binary.write_table(batch)
                if text:
                    text.write_table(batch)
            if text:
                text.close()
    return [parquet, csv] if wants_csv else [parquet]


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
    arguments = sys.argv[1:]
    large = "--large" in arguments and (arguments.remove("--large") or True)
    given = None
    if "--model" in arguments:
        at = arguments.index("--model")
        given, arguments[at:at + 2] = arguments[at + 1], []
    program = pathlib.Path(arguments[0]).resolve()
    folder = pathlib.Path(arguments[1] if len(arguments) > 1 else tempfile.mkdtemp())
    folder.mkdir(parents=True, exist_ok=True)
    model, columns, names = make(program, folder, given)
    print(f"{'':34} {'CPU ns/row':>10} {'M rows/s':>9} {'clock':>7} {'MB':>6}   (M rows/s on two cores if both are busy; by the clock)")
    for millions in [1, 10, 100] if large else [1, 10]:
        for source in tables(folder, millions, columns, names):
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
