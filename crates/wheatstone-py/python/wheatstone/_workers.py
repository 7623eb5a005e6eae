"""What workers of an engine share: the model as bytes, loaded once a process, and rows that are no pixels."""

# pyright: basic
# What it builds on has no types.

from __future__ import annotations

import functools
import os
import re
from collections.abc import Mapping
from typing import Any, Union

import numpy as np
import numpy.typing as npt

from ._arrays import PathLike
from .calibration import Calibration
from .data import Columns
from .errors import ArgumentError, MalformedError

Model = Union[Calibration, bytes, PathLike]
"""A fitted model, the content of its file, or the path of the file."""

_LARGEST_PIXEL = 1e9


def model_bytes(model: Model) -> bytes:
    """The content of the model file. A path is read here, so that workers need not see it."""
    if isinstance(model, Calibration):
        return model.to_bytes()
    if isinstance(model, (str, os.PathLike)):
        return Calibration.load(model).to_bytes()
    Calibration.from_bytes(model)
    return model


@functools.lru_cache(maxsize=16)
def loaded(model: bytes) -> Calibration:
    """The model, read once a process."""
    return Calibration.from_bytes(model)


def use_threads(count: int) -> None:
    """Threads of this process, unless ``WHEATSTONE_THREADS`` says their number."""
    from . import set_threads

    if not os.environ.get("WHEATSTONE_THREADS"):
        set_threads(count)


def check_false_alarm(value: float) -> None:
    if not 0.0 < value < 1.0:
        raise ArgumentError(f"false_alarm cannot be {value}", hint="give a value between 0 and 1")


def located(
    calibration: Calibration,
    table: Any,
    covariance: bool,
    false_alarm: float,
    columns: Columns | None,
) -> Any:
    """`Calibration.locate_arrow` of a pyarrow table, but rows that are no pixels are not located.

    One such row among a billion would otherwise end the job.
    """
    import pyarrow as pa

    settings: dict[str, Any] = {
        "covariance": covariance,
        "false_alarm": false_alarm,
        "columns": columns,
    }
    try:
        return calibration.locate_arrow(table, **settings)
    except (pa.ArrowInvalid, MalformedError):
        usable = _without_bad_pixels(table, columns)
        if usable is None:
            raise
    found = calibration.locate_arrow(usable, **settings)
    for index, (field, column) in enumerate(zip(table.schema, table.columns)):
        found = found.set_column(index, field.with_name(found.field(index).name), column)
    return found


def _without_bad_pixels(table: Any, columns: Columns | None) -> Any:
    """The table without pixels that lack a coordinate or are out of range; None where it has none of them."""
    import pyarrow as pa

    changed = False
    for x, y in _pixel_columns(table.column_names, columns):
        pair = [_numbers(table.column(index)) for index in (x, y)]
        if pair[0] is None or pair[1] is None:
            continue
        values = np.stack([pair[0], pair[1]])
        empty = np.isnan(values)
        bad = empty.any(axis=0) | (np.abs(values) > _LARGEST_PIXEL).any(axis=0)
        if (bad & ~empty.all(axis=0)).any():
            changed = True
            for index, column in zip((x, y), values):
                name = table.field(index).name
                table = table.set_column(index, name, pa.array(column, mask=bad))
    return table if changed else None


def _numbers(column: Any) -> npt.NDArray[np.float64] | None:
    import pyarrow as pa

    if not (pa.types.is_floating(column.type) or pa.types.is_integer(column.type)):
        return None
    return np.asarray(column.cast(pa.float64(), safe=False).to_numpy(), dtype=np.float64)


def _pixel_columns(names: list[str], columns: Columns | None) -> list[tuple[int, int]]:
    """Where x and y of each camera stand among the columns of a table."""
    ours = list(names)
    if isinstance(columns, str):
        parts = [part.strip() for part in columns.split(",")]
        if "=" in columns:
            pairs = (part.partition("=") for part in parts)
            columns = {name.strip(): theirs.strip() for name, _, theirs in pairs}
        else:
            columns = parts
    if isinstance(columns, Mapping):
        called = {theirs: name for name, theirs in columns.items()}
        ours = [called.get(name, name) for name in names]
    elif columns is not None:
        ours = list(columns)[: len(names)]
    place = {name: index for index, name in enumerate(ours)}
    return [
        (index, place["y" + name[1:]])
        for name, index in place.items()
        if re.fullmatch(r"x\d+", name) and "y" + name[1:] in place
    ]
