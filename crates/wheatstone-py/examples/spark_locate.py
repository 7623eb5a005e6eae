"""Parquet to Parquet on Spark: ``spark-submit spark_locate.py matched/ located/ model.json``."""

from __future__ import annotations

import sys

from pyspark.sql import SparkSession

import wheatstone.spark


def main(input: str, output: str, model: str) -> None:
    """Appends places to the rows of Parquet files."""
    spark = SparkSession.builder.getOrCreate()
    rows = spark.read.parquet(input)
    wheatstone.spark.locate(rows, model).write.parquet(output)


if __name__ == "__main__":
    main(*sys.argv[1:4])
