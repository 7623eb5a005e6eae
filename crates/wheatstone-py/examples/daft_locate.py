"""Parquet to Parquet on Daft: ``python daft_locate.py matched/ located/ model.json``."""

# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false, reportUnknownVariableType=false, reportUnknownArgumentType=false
# PyArrow has no types.

from __future__ import annotations

import sys
from typing import Any

import daft
import pyarrow as pa
from daft import DataType

import wheatstone as ws

PIXELS = ["x1", "y1", "x2", "y2"]
NUMBERS = ("X", "Y", "Z", "sX", "sY", "sZ", "residual")
APPENDED = {name: DataType.float64() for name in NUMBERS} | {
    name: DataType.string() for name in ("trust", "mismatch")
}


@daft.cls
class Locator:
    """Loads the model once a worker."""

    def __init__(self, model: str) -> None:
        self.calibration = ws.load(model)

    @daft.method.batch(return_dtype=DataType.struct(APPENDED), unnest=True)
    def locate(self, *pixels: Any) -> Any:
        table = pa.table([column.to_arrow() for column in pixels], names=PIXELS)
        located = self.calibration.locate_arrow(table).select(list(APPENDED))
        return located.to_struct_array().combine_chunks()


def main(input: str, output: str, model: str) -> None:
    """Appends places to the rows of Parquet files."""
    rows = daft.read_parquet(input)
    located = rows.select(daft.col("*"), Locator(model).locate(*(rows[name] for name in PIXELS)))
    located.write_parquet(output)


if __name__ == "__main__":
    main(*sys.argv[1:4])
