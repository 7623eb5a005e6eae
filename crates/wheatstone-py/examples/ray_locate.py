"""Parquet to Parquet on Ray: ``python ray_locate.py matched/ located/ model.json``."""

# pyright: reportUnknownMemberType=false
# Ray's types are partial.

from __future__ import annotations

import sys

import ray

import wheatstone.ray


def main(input: str, output: str, model: str) -> None:
    """Appends places to the rows of Parquet files."""
    rows = ray.data.read_parquet(input)
    wheatstone.ray.locate(rows, model).write_parquet(output)


if __name__ == "__main__":
    main(*sys.argv[1:4])
