"""Ray: the same bits as one process, workers that die, and many fits."""

from __future__ import annotations

import os
import runpy
import signal
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pa = pytest.importorskip("pyarrow")
ray = pytest.importorskip("ray")
pytest.importorskip("ray.data")

from cluster_data import (
    read_parts,
    require_same,
    spoiled,
)

import wheatstone as ws
import wheatstone.ray

EXAMPLES = Path(__file__).parents[1] / "examples"

# Ray keeps files of its workers open.
pytestmark = pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::DeprecationWarning")


@pytest.fixture(scope="module", autouse=True)
def cluster() -> Iterator[None]:
    ray.init(
        num_cpus=2,
        include_dashboard=False,
        log_to_driver=False,
        logging_level="ERROR",
        object_store_memory=256 << 20,
    )
    ray.data.DataContext.get_current().enable_progress_bars = False
    yield
    ray.shutdown()


def test_parquet_to_parquet_has_the_bits_of_one_process(
    table: Any, parts: Path, model: Path, tmp_path: Path
) -> None:
    rows = ray.data.read_parquet(str(parts))
    # As many workers as there are CPUs, and still one to read.
    located = wheatstone.ray.locate(rows, ws.load(model), concurrency=2)
    located.write_parquet(str(tmp_path / "located"))
    # Ray lists and writes files in an order of its own: the key tells which row is which.
    require_same(table, model, read_parts(tmp_path / "located").sort_by("key"))


def test_pixel_sigma_is_that_of_the_columns(table: Any, model: Path) -> None:
    rows = table.slice(0, 400).append_column("s", pa.array([0.1, 1.0] * 200))
    for given in (0.5, "s", ["s", "s"]):
        located = wheatstone.ray.locate(ray.data.from_arrow(rows), model, pixel_sigma=given, concurrency=1)
        found = pa.concat_tables(ray.get(located.to_arrow_refs())).sort_by("key")
        expected = ws.load(model).locate_arrow(rows, pixel_sigma=given)
        assert found.column("sZ").to_pylist() == expected.column("sZ").to_pylist()
    with pytest.raises(ws.errors.ArgumentError, match="pixel_sigma"):
        wheatstone.ray.locate(ray.data.from_arrow(rows), model, pixel_sigma=0.0)


def test_the_example_runs(table: Any, parts: Path, model: Path, tmp_path: Path) -> None:
    example = runpy.run_path(str(EXAMPLES / "ray_locate.py"))
    example["main"](str(parts), str(tmp_path / "located"), str(model))
    # Ray lists and writes files in an order of its own: the key tells which row is which.
    require_same(table, model, read_parts(tmp_path / "located").sort_by("key"))


def test_workers_have_one_thread_and_the_order_stays(
    table: Any, model: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Slow(wheatstone.ray._Locator):
        def __call__(self, batch: Any) -> Any:
            time.sleep(0.3 if batch.column("key")[0].as_py() < 100 else 0.0)
            threads = pa.array([ws.get_threads()] * len(batch))
            return super().__call__(batch).append_column("threads", threads)

    monkeypatch.setattr(wheatstone.ray, "_Locator", Slow)
    rows = ray.data.from_arrow([table.slice(start, 50) for start in range(0, 1000, 50)])
    # The first batch is the last to be done.
    located = wheatstone.ray.locate(rows, model.read_bytes(), concurrency=(1, 2), num_cpus=0.5)
    found = pa.concat_tables(ray.get(located.to_arrow_refs()))
    assert found.column("key").to_pylist() == list(range(1000))
    assert set(found.column("threads").to_pylist()) == {1}


def test_rows_that_are_no_pixels_have_nulls(table: Any, model: Path) -> None:
    bad, rows = spoiled(table.slice(0, 1000))
    located = wheatstone.ray.locate(ray.data.from_arrow(bad), model, covariance=True, num_cpus=0.5)
    found = pa.concat_tables(ray.get(located.to_arrow_refs()))
    assert found.column("x1").to_pylist() == bad.column("x1").to_pylist()
    assert found.column("y2").to_pylist() == bad.column("y2").to_pylist()
    good = ws.load(model).locate_arrow(table.slice(0, 1000), covariance=True)
    for name in ("X", "sZ", "trust", "cYZ"):
        column, other = found.column(name).to_pylist(), good.column(name).to_pylist()
        assert all(column[row] is None and other[row] is not None for row in rows)
        assert [v for row, v in enumerate(column) if row not in rows] == [
            v for row, v in enumerate(other) if row not in rows
        ]


def test_a_killed_worker_loses_nothing(
    table: Any, parts: Path, model: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pids = tmp_path / "pids"
    pids.mkdir()

    class Revealed(wheatstone.ray._Locator):
        def __call__(self, batch: Any) -> Any:
            (pids / str(os.getpid())).touch()
            time.sleep(0.5)
            return super().__call__(batch)

    def kill_one() -> None:
        for _ in range(600):
            found = list(pids.iterdir())
            if found:
                killed.append(int(found[0].name))
                os.kill(killed[0], signal.SIGKILL)
                return
            time.sleep(0.1)

    killed: list[int] = []
    monkeypatch.setattr(wheatstone.ray, "_Locator", Revealed)
    killer = threading.Thread(target=kill_one)
    killer.start()
    rows = ray.data.read_parquet(str(parts), override_num_blocks=8)
    located = wheatstone.ray.locate(rows, model, concurrency=2, num_cpus=0.5)
    located.write_parquet(str(tmp_path / "located"))
    killer.join()
    assert len(killed) == 1
    assert len(list(pids.iterdir())) > 1
    # Ray lists and writes files in an order of its own: the key tells which row is which.
    require_same(table, model, read_parts(tmp_path / "located").sort_by("key"))


def test_errors_of_the_data_reach_the_user(table: Any, model: Path) -> None:
    with pytest.raises(ws.errors.MissingFileError):
        wheatstone.ray.locate(ray.data.from_arrow(table), "no-such-model.json")
    with pytest.raises(ws.errors.ArgumentError):
        wheatstone.ray.locate(ray.data.from_arrow(table), model, false_alarm=2.0)
    rows = ray.data.from_arrow(table.select(["key", "x1", "y1"]))
    with pytest.raises(Exception, match="MalformedError|MismatchError|ArgumentError"):
        wheatstone.ray.locate(rows, model, num_cpus=0.5).materialize()


def test_many_fits_where_one_fails(tmp_path: Path) -> None:
    data = {seed: ws.synth(rig="paper", noise=0.1, count=300, seed=seed) for seed in range(4)}
    data[1].save(tmp_path / "points.csv")
    flat = np.zeros((10, 3))
    tables: dict[Any, Any] = {
        "dataset": data[0],
        "path": str(tmp_path / "points.csv"),
        "flat": ws.Dataset.from_arrays(np.ones((10, 4)), flat),
        "table": pa.table(
            {
                name: column
                for name, column in zip(
                    ("x1", "y1", "x2", "y2", "X", "Y", "Z"),
                    np.hstack([data[2].pixels, data[2].points]).T,
                )
            }
        ),
        "missing": str(tmp_path / "missing.csv"),
    }
    tables |= {seed: data[seed] for seed in range(4)}
    fitted = wheatstone.ray.fit_many(iter(tables.items()), method="dlt", validate=False)
    assert list(fitted) == list(tables)
    assert isinstance(fitted["flat"], ValueError)
    assert isinstance(fitted["missing"], ws.errors.MissingFileError)
    for key in (0, 1, 2, 3, "dataset", "path", "table"):
        assert isinstance(fitted[key], ws.Calibration), key
    for seed in range(4):
        alone = ws.fit(data[seed], method="dlt", validate=False)
        pixels, found = data[seed].pixels, fitted[seed]
        assert isinstance(found, ws.Calibration)
        assert found.predict(pixels).tobytes() == alone.predict(pixels).tobytes()
    with pytest.raises(ws.errors.ArgumentError, match="twice"):
        wheatstone.ray.fit_many([("a", data[0]), ("a", data[1])], method="dlt", validate=False)
