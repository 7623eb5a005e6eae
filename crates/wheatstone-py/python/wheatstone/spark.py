"""Spark: locating points of a Spark DataFrame.

Needs PySpark 3.5 or later: ``pip install wheatstone[spark]``. Wheatstone must be installed where the workers
run.
"""

# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false, reportUnknownVariableType=false, reportUnknownArgumentType=false
# PyArrow has no types, and Spark's are partial.

from __future__ import annotations

import functools
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import pyarrow as pa
from pyspark.sql import DataFrame
from pyspark.sql.types import DoubleType, StringType, StructField, StructType

from ._arguments import share
from ._named import Columns
from ._sigmas import sigma_or_columns
from ._workers import Model, loaded, model_bytes, use_threads
from .errors import ArgumentError

__all__ = ["locate"]


def locate(
    df: DataFrame,
    model: Model,
    *,
    covariance: bool = False,
    false_alarm: float = 0.001,
    pixel_sigma: float | str | Sequence[str] | None = None,
    columns: Columns | None = None,
) -> DataFrame:
    """Appends places to a Spark DataFrame of matched pixels: the same rows.

    The order within each partition stays. Lazy, as all transformations of Spark. The columns are those of
    `Calibration.locate_arrow`, and so are the bits. Rows that cannot be located keep their place, with nulls.
    Each worker has one thread, unless ``WHEATSTONE_THREADS`` says their number; Spark
    runs one worker a core.

    Parameters
    ----------
    df : pyspark.sql.DataFrame
        With columns ``x1, y1, x2, y2, ...`` in pixels, or those that `columns` names; others go along.
    model : Calibration, bytes, or path
        The model, the content of its file, or the path, which is read here and not on the workers.
    covariance : bool
        Whether to append the whole covariance of each point.
    false_alarm : float
        The share of correct matches that may be called a mismatch.
    pixel_sigma : float, str, or sequence of str, optional
        Standard deviation of a pixel coordinate, or the column or columns that have it, as in
        `Calibration.locate_arrow`.
    columns : mapping or sequence, optional
        What the DataFrame calls its columns; see `wheatstone.read`.

    Returns
    -------
    pyspark.sql.DataFrame

    Raises
    ------
    MalformedError
        Where columns are missing.
    ArgumentError
        Where two columns would differ in case only, such as `x` and the appended `X`, and Spark tells no
        cases apart.

    Examples
    --------
    >>> import wheatstone.spark
    >>> rows = spark.read.parquet("matched/")  # doctest: +SKIP
    >>> wheatstone.spark.locate(rows, "model.json").write.parquet("located/")  # doctest: +SKIP
    """
    settings = {
        "covariance": covariance,
        "false_alarm": share(false_alarm, "false_alarm"),
        "pixel_sigma": sigma_or_columns(pixel_sigma),
        "columns": columns,
    }
    data = model_bytes(model)
    schema = _schema(df, data, settings)
    task = functools.partial(_located, data, settings)
    return df.mapInArrow(task, schema)


def _schema(df: DataFrame, model: bytes, settings: dict[str, Any]) -> StructType:
    own = df.schema
    calibration = loaded(model)
    # Types do not matter to names, and some of Spark's have no equal in Arrow.
    as_doubles = pa.schema([(field.name, pa.float64()) for field in own.fields])
    names = calibration.located_schema(as_doubles, covariance=settings["covariance"]).names
    # Columns that are missing are found here, and not by a worker.
    calibration.locate_arrow(as_doubles.empty_table(), **settings)
    if str(df.sparkSession.conf.get("spark.sql.caseSensitive")).lower() != "true":
        _require_distinct(names)
    fields = [
        StructField(name, field.dataType, field.nullable, field.metadata)
        for name, field in zip(names, own.fields)
    ]
    for name in names[len(fields) :]:
        kind = StringType() if name in ("trust", "mismatch") else DoubleType()
        fields.append(StructField(name, kind))
    return StructType(fields)


def _require_distinct(names: list[str]) -> None:
    known: dict[str, str] = {}
    for name in names:
        other = known.setdefault(name.lower(), name)
        if other != name:
            raise ArgumentError(
                f"columns `{other}` and `{name}` are one to Spark, which tells no cases apart",
                hint=f'rename `{other}`, or set "spark.sql.caseSensitive" to "true"',
            )


def _located(model: bytes, settings: dict[str, Any], batches: Iterable[Any]) -> Iterator[Any]:
    use_threads(1)
    calibration = loaded(model)
    for batch in batches:
        yield calibration.locate_arrow(batch, **settings)
