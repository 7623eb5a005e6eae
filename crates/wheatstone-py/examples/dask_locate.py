"""Parquet to Parquet on Dask: ``python dask_locate.py matched/ located/ model.json``."""

# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false, reportUnknownVariableType=false, reportUnknownArgumentType=false
# pandas and Dask have no types.

from __future__ import annotations

import sys

import dask.dataframe as dd
import pandas as pd

import wheatstone as ws


def main(input: str, output: str, model: str) -> None:
    """Appends places to the rows of Parquet files."""
    # Pickled with each task, and unpickled once a worker.
    calibration = ws.load(model)

    def locate(rows: pd.DataFrame) -> pd.DataFrame:
        return calibration.locate_arrow(rows)

    rows = dd.read_parquet(input)
    located = rows.map_partitions(locate, meta=locate(rows._meta))
    located.to_parquet(output, write_index=False)


if __name__ == "__main__":
    main(*sys.argv[1:4])
