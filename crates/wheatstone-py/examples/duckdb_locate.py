"""Parquet to Parquet on DuckDB: ``python duckdb_locate.py matched/ located.parquet model.json``."""

# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false, reportUnknownVariableType=false, reportUnknownArgumentType=false
# PyArrow has no types.

from __future__ import annotations

import sys

import duckdb
import pyarrow as pa

import wheatstone as ws


def main(input: str, output: str, model: str) -> None:
    """Appends places to the rows of Parquet files."""
    connection = duckdb.connect()
    rows = connection.cursor().read_parquet(f"{input}/*.parquet")
    # Batches are located while DuckDB writes them.
    located = pa.RecordBatchReader.from_stream(ws.load(model).locate_arrow(rows))
    connection.from_arrow(located).write_parquet(output)


if __name__ == "__main__":
    main(*sys.argv[1:4])
