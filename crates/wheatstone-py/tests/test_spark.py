"""Spark: the same bits as one process, names that differ in case only, tasks that fail."""

from __future__ import annotations

import os
import runpy
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import pytest

pa = pytest.importorskip("pyarrow")
pytest.importorskip("pandas")
pytest.importorskip("pyspark", minversion="3.5")

from cluster_data import (
    read_parts,
    require_same,
    spoiled,
)
from pyspark.sql import SparkSession

import wheatstone as ws
import wheatstone.spark

EXAMPLES = Path(__file__).parents[1] / "examples"

# Sockets of Spark's gateway stay open.
pytestmark = pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::DeprecationWarning")


@pytest.fixture(scope="module")
def spark() -> Iterator[SparkSession]:
    os.environ["PYSPARK_PYTHON"] = sys.executable
    try:
        session = (
            # Two workers; a task may fail once.
            SparkSession.builder.master("local[2,2]")
            .config("spark.ui.enabled", "false")
            .config("spark.driver.memory", "1g")
            .config("spark.driver.host", "127.0.0.1")
            .config("spark.driver.bindAddress", "127.0.0.1")
            .config("spark.sql.shuffle.partitions", "2")
            .config("spark.log.level", "OFF")
            .getOrCreate()
        )
    except Exception as problem:
        pytest.skip(f"Spark does not start: {problem}")
    yield session
    session.stop()


def collected(df: Any) -> Any:
    return pa.Table.from_pylist([row.asDict() for row in df.collect()])


def test_the_example_has_the_bits_of_one_process(
    spark: SparkSession, table: Any, parts: Path, model: Path, tmp_path: Path
) -> None:
    # One file a partition: partitions are numbered as the files are named.
    spark.conf.set("spark.sql.files.openCostInBytes", str(128 << 20))
    example = runpy.run_path(str(EXAMPLES / "spark_locate.py"))
    example["main"](str(parts), str(tmp_path / "located"), str(model))
    found = read_parts(tmp_path / "located")
    require_same(table, model, found.sort_by("key"))
    for file in sorted((tmp_path / "located").glob("*.parquet")):
        keys = read_parts(file).column("key").to_pylist()
        assert keys == list(range(keys[0], keys[0] + len(keys)))


def test_other_columns_and_types_stay(spark: SparkSession, table: Any, model: Path) -> None:
    table = table.slice(0, 50).rename_columns(["key", "name", "a", "b", "c", "d"])
    df = spark.createDataFrame(table.to_pandas())
    df = df.selectExpr("*", "array(key, 1) AS both", "key AS sX", "current_date() AS day")
    names = {"x1": "a", "y1": "b", "x2": "c", "y2": "d"}
    located = wheatstone.spark.locate(df, ws.load(model), columns=names, covariance=True)
    own = ["key", "name", "a", "b", "c", "d", "both", "input_sX", "day"]
    assert located.columns[: len(own)] == own
    assert located.columns[len(own) :][:3] == ["X", "Y", "Z"]
    assert located.columns[-1] == "cZZ"
    found = collected(located)
    assert found.column("key").to_pylist() == found.column("input_sX").to_pylist()
    assert found.column("both").to_pylist()[3] == [3, 1]
    alone = ws.load(model).locate_arrow(table, columns=names)
    assert found.column("Z").to_pylist() == alone.column("Z").to_pylist()


def test_pixel_sigma_is_that_of_the_columns(spark: SparkSession, table: Any, model: Path) -> None:
    rows = table.slice(0, 50).append_column("s", pa.array([0.1, 1.0] * 25))
    df = spark.createDataFrame(rows.to_pandas()).coalesce(1)
    for given in (0.5, "s", ["s", "s"]):
        found = collected(wheatstone.spark.locate(df, model, pixel_sigma=given))
        expected = ws.load(model).locate_arrow(rows, pixel_sigma=given)
        assert found.column("sZ").to_pylist() == expected.column("sZ").to_pylist()
    with pytest.raises(ws.errors.MalformedError, match="no column `sharp`"):
        wheatstone.spark.locate(df, model, pixel_sigma="sharp")


def test_rows_that_are_no_pixels_have_nulls(spark: SparkSession, table: Any, model: Path) -> None:
    bad, rows = spoiled(table.slice(0, 300))
    records = bad.to_pylist()
    kinds = "key long, name string, x1 double, y1 double, x2 double, y2 double"
    df = spark.createDataFrame([tuple(record.values()) for record in records], kinds)
    found = collected(wheatstone.spark.locate(df.coalesce(1), model.read_bytes()))
    good = ws.load(model).locate_arrow(table.slice(0, 300))
    assert found.column("y2").to_pylist() == bad.column("y2").to_pylist()
    for name in ("X", "sZ", "trust"):
        column, other = found.column(name).to_pylist(), good.column(name).to_pylist()
        assert all(column[row] is None and other[row] is not None for row in rows)
        assert [v for row, v in enumerate(column) if row not in rows] == [
            v for row, v in enumerate(other) if row not in rows
        ]


def test_missing_columns_are_told_at_once(spark: SparkSession, model: Path) -> None:
    df = spark.createDataFrame([(1, 300.0, 200.0)], "key int, x1 double, y1 double")
    with pytest.raises(ws.errors.MalformedError, match="`x2`, `y2`"):
        wheatstone.spark.locate(df, model)


def test_names_that_differ_in_case_only(spark: SparkSession, model: Path) -> None:
    df = spark.createDataFrame(
        [(1, 300.0, 200.0, 280.0, 200.0)], "x int, x1 double, y1 double, x2 double, y2 double"
    )
    with pytest.raises(ws.errors.ArgumentError, match="`x` and `X`.*\n.*caseSensitive"):
        wheatstone.spark.locate(df, model)
    spark.conf.set("spark.sql.caseSensitive", "true")
    try:
        found = collected(wheatstone.spark.locate(df, model).select("x", "X"))
    finally:
        spark.conf.unset("spark.sql.caseSensitive")
    assert found.column("x").to_pylist() == [1]
    assert found.column("X").type == pa.float64()


def test_a_killed_worker_loses_nothing(
    spark: SparkSession,
    table: Any,
    parts: Path,
    model: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    mark = str(tmp_path / "killed")
    whole = wheatstone.spark._located

    def fragile(*arguments: Any) -> Iterable[Any]:
        import os
        import signal

        for count, batch in enumerate(whole(*arguments)):
            try:
                os.close(os.open(mark, os.O_CREAT | os.O_EXCL))
            except FileExistsError:
                pass
            else:
                os.kill(os.getpid(), signal.SIGKILL)
            yield batch

    monkeypatch.setattr(wheatstone.spark, "_located", fragile)
    located = wheatstone.spark.locate(spark.read.parquet(str(parts)), model)
    located.write.parquet(str(tmp_path / "located"))
    assert Path(mark).exists()
    require_same(table, model, read_parts(tmp_path / "located").sort_by("key"))


def test_workers_have_one_thread(
    spark: SparkSession, parts: Path, model: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = wheatstone.spark._located

    def counted(*arguments: Any) -> Iterable[Any]:
        import pyarrow

        import wheatstone

        for batch in whole(*arguments):
            index = batch.schema.get_field_index("residual")
            threads = pyarrow.array([float(wheatstone.get_threads())] * len(batch))
            yield batch.set_column(index, "residual", threads)

    monkeypatch.setattr(wheatstone.spark, "_located", counted)
    monkeypatch.delenv("WHEATSTONE_THREADS", raising=False)
    located = wheatstone.spark.locate(spark.read.parquet(str(parts)), model)
    assert [row[0] for row in located.select("residual").distinct().collect()] == [1.0]
