"""Parquet to Parquet on Polars: ``python polars_locate.py matched/ located.parquet model.json``."""

from __future__ import annotations

import sys

import polars as pl

import wheatstone as ws


def main(input: str, output: str, model: str) -> None:
    """Appends places to the rows of Parquet files."""
    calibration = ws.load(model)
    rows = pl.scan_parquet(input)
    schema = calibration.locate_arrow(rows.collect_schema().to_frame()).schema
    # Each row depends on itself alone, so that Polars may pass rows in pieces.
    located = rows.map_batches(calibration.locate_arrow, schema=schema, streamable=True)
    located.sink_parquet(output)


if __name__ == "__main__":
    main(*sys.argv[1:4])
