"""Other engines by the examples, and processes of Python's own: the bits of one process."""

from __future__ import annotations

import multiprocessing
import runpy
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pa = pytest.importorskip("pyarrow")

from cluster_data import (
    PIXELS,
    located_in_process,
    read_parts,
    require_same,
)

import wheatstone as ws

EXAMPLES = Path(__file__).parents[1] / "examples"


def run(name: str, parts: Path, output: Path, model: Path) -> Any:
    example = runpy.run_path(str(EXAMPLES / f"{name}_locate.py"))
    example["main"](str(parts), str(output), str(model))
    return read_parts(output)


def test_polars(table: Any, parts: Path, model: Path, tmp_path: Path) -> None:
    pytest.importorskip("polars")
    require_same(table, model, run("polars", parts, tmp_path / "located.parquet", model))


def test_duckdb(table: Any, parts: Path, model: Path, tmp_path: Path) -> None:
    pytest.importorskip("duckdb")
    require_same(table, model, run("duckdb", parts, tmp_path / "located.parquet", model))


def test_daft(table: Any, parts: Path, model: Path, tmp_path: Path) -> None:
    pytest.importorskip("daft")
    found = run("daft", parts, tmp_path / "located", model)
    # Daft does not keep the order of rows that it writes.
    require_same(table, model, found.sort_by("key"))


@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::FutureWarning")
def test_dask(table: Any, parts: Path, model: Path, tmp_path: Path) -> None:
    pytest.importorskip("dask.dataframe")
    require_same(table, model, run("dask", parts, tmp_path / "located", model))


@pytest.mark.filterwarnings("ignore")
def test_dask_on_two_processes(table: Any, parts: Path, model: Path, tmp_path: Path) -> None:
    pytest.importorskip("dask.dataframe")
    distributed = pytest.importorskip("distributed")
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address=None, host="127.0.0.1"
        ) as cluster,
        distributed.Client(cluster),
    ):
        found = run("dask", parts, tmp_path / "located", model)
    require_same(table, model, found)


@pytest.mark.parametrize("name", ["daft", "dask", "duckdb", "polars", "ray", "spark"])
def test_the_documentation_has_the_examples(name: str) -> None:
    page = Path(__file__).parents[3] / "docs" / "how-to" / "cluster.md"
    if not page.exists():
        pytest.skip("the documentation is not here")
    program = (EXAMPLES / f"{name}_locate.py").read_text(encoding="utf-8")
    _, _, code = program.partition("import sys\n")
    code, _, _ = code.partition("if __name__")
    lines = [line for line in code.splitlines() if line]
    assert len(lines) > 5
    shown = [line for line in page.read_text(encoding="utf-8").splitlines() if line]
    assert "\n".join(lines) in "\n".join(shown)


@pytest.mark.parametrize("start", ["fork", "spawn"])
@pytest.mark.parametrize("method", ["dlt", "brown"])
def test_processes_have_the_same_bits(start: str, method: str, table: Any) -> None:
    if start not in multiprocessing.get_all_start_methods():
        pytest.skip(f"there is no {start} here")
    calibration = ws.fit(ws.synth(rig="paper", noise=0.1, count=300), method=method, validate=False)
    pixels = np.stack([table.column(name).to_numpy() for name in PIXELS], axis=1)
    # Threads run in this process before it forks.
    alone = located_in_process(calibration, pixels)
    if method == "dlt":
        assert alone[0] == alone[1]
    cuts = [(calibration, part) for part in np.array_split(pixels, 4)]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        pool = multiprocessing.get_context(start).Pool(2)
    try:
        found = pool.starmap_async(located_in_process, cuts).get(timeout=120)
    finally:
        pool.terminate()
        pool.join()
    assert b"".join(points for points, _ in found) == alone[0]
    assert b"".join(points for _, points in found) == alone[1]
