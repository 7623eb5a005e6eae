"""What users hand over, as arrays and tables that the extension module takes."""

from __future__ import annotations

import importlib
import importlib.util
import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias, TypeGuard, Union, cast, runtime_checkable

import numpy as np
import numpy.typing as npt

# NumPy imports it on first use otherwise, and a thread that forks meanwhile would wait for ever.
from numpy import ma

from .errors import ArgumentError

if TYPE_CHECKING:
    from typing_extensions import TypeIs

FloatArray: TypeAlias = npt.NDArray[np.float64]
Numbers: TypeAlias = Union[npt.NDArray[np.float64], npt.NDArray[np.float32]]


@runtime_checkable
class ArrowStream(Protocol):
    """A table of any library with Arrow's PyCapsule interface: pandas, polars, pyarrow, DuckDB, ..."""

    def __arrow_c_stream__(self, requested_schema: object | None = None) -> object: ...


Table: TypeAlias = Union[ArrowStream, Mapping[str, npt.ArrayLike]]
PathLike: TypeAlias = Union[str, "os.PathLike[str]"]


def pyarrow() -> Any:
    """The module, which few functions need."""
    return importlib.import_module("pyarrow")


def is_path(value: object) -> TypeIs[PathLike]:
    return isinstance(value, (str, os.PathLike))


def is_table(value: object) -> TypeGuard[Table]:
    """Whether it has columns with names."""
    if isinstance(value, np.ndarray):
        return False
    return (
        isinstance(value, Mapping)
        or hasattr(value, "__arrow_c_stream__")
        or hasattr(value, "__arrow_c_array__")
    )


def floats(value: Any, name: str) -> Numbers:
    """An array of float64 or float32, the given one wherever it is one already: nothing is copied then."""
    given: object = value
    if isinstance(given, ma.MaskedArray):
        value = value.astype(np.float64).filled(np.nan)
    try:
        array = np.asarray(value)
        if array.dtype.kind == "c":
            raise TypeError("complex numbers")
        if array.dtype not in (np.dtype(np.float64), np.dtype(np.float32)):
            array = array.astype(np.float64)
    except (TypeError, ValueError) as problem:
        raise ArgumentError(
            f"{name} is not an array of numbers: {problem}", hint="give an array of float64"
        ) from None
    # Unaligned memory is copied; strides of any kind are not.
    return np.require(array, requirements="A")


def doubles(value: Any, name: str) -> FloatArray:
    return floats(value, name).astype(np.float64, copy=False)


def pixels_array(value: Any, cameras: int | None, rows: int | None = None) -> Numbers:
    """Matched pixels as (n, 2 * cameras).

    Taken as they are: (n, 2 * cameras), (n, cameras, 2), and (cameras, n, 2) as aniposelib has them, where the
    number of cameras or of rows says which of the last two it is.
    """
    array: Any = floats(value, "pixels")
    if array.ndim == 3 and array.shape[2] == 2:
        by_row = array.shape[1] == cameras if cameras is not None else array.shape[0] == rows
        by_camera = array.shape[0] == cameras if cameras is not None else array.shape[1] == rows
        if by_camera and not by_row:
            array = array.transpose(1, 0, 2)
        flat: npt.NDArray[np.float64] = array.reshape(array.shape[0], 2 * array.shape[1])
        return flat
    if array.ndim == 1 and cameras is not None and array.shape[0] == 2 * cameras:
        raise ArgumentError(
            f"pixels has shape {array.shape}", hint="give one row for one point: pixels[None]"
        )
    if array.ndim != 2:
        raise ArgumentError(
            f"pixels has shape {array.shape}",
            hint="give (n, 2 * cameras): x and y of each camera, NaN where a camera did not see the point",
        )
    matched: npt.NDArray[np.float64] = array
    return matched


def places_array(value: Any, name: str, columns: int, rows: int | None) -> FloatArray:
    array = doubles(value, name)
    if array.ndim != 2 or array.shape[1] != columns or (rows is not None and len(array) != rows):
        wanted = f"({'n' if rows is None else rows}, {columns})"
        raise ArgumentError(f"{name} has shape {array.shape}", hint=f"give an array of shape {wanted}")
    return array


def labels(value: Sequence[object] | npt.NDArray[Any] | None, name: str, rows: int) -> list[str] | None:
    if value is None:
        return None
    array = np.asarray(value)
    if array.shape != (rows,):
        raise ArgumentError(f"{name} has shape {array.shape}", hint=f"give one a row: shape ({rows},)")
    return [_label(item) for item in array.tolist()]


def _label(item: object) -> str:
    if isinstance(item, float) and item.is_integer():
        return str(int(item))
    return str(item)


def table_columns(table: Table) -> dict[str, npt.NDArray[Any]]:
    """The columns of a table by their names."""
    if isinstance(table, Mapping):
        return {str(name): np.asarray(column) for name, column in table.items()}
    named = cast(Any, table)
    names = named.column_names if hasattr(named, "column_names") else list(named.columns)
    return {str(name): _to_numpy(named[name]) for name in names}


def _to_numpy(column: Any) -> npt.NDArray[Any]:
    return np.asarray(column.to_numpy() if hasattr(column, "to_numpy") else column)


def arrow_table(table: Table) -> Any:
    """A table that gives Arrow's capsules, whatever is installed."""
    if not isinstance(table, Mapping) and _gives_capsules(table):
        return table
    pa = pyarrow_for(library_of(table))
    try:
        return pa.table({name: _arrow_column(column) for name, column in table_columns(table).items()})
    except (ValueError, TypeError, NotImplementedError) as problem:
        raise ArgumentError(
            f"the columns make no table: {problem}", hint="give columns of one length, a number or a name a row"
        ) from None


def library_of(table: object) -> str:
    """The name of the library that a table is of."""
    return type(table).__module__.partition(".")[0]


def pyarrow_for(library: str) -> Any:
    """The module, which tables of this library need."""
    try:
        return pyarrow()
    except ImportError:
        raise ArgumentError(
            f"a table of {library} needs pyarrow", hint="pip install pyarrow, or give arrays"
        ) from None


def _gives_capsules(table: object) -> bool:
    if not type(table).__module__.startswith("pandas"):
        return True
    # pandas makes them by pyarrow.
    return importlib.util.find_spec("pyarrow") is not None


def _arrow_column(column: npt.NDArray[Any]) -> Any:
    if column.dtype.kind == "O":
        return [None if item is None or item != item else str(item) for item in column.tolist()]
    kind: Any = column.dtype
    return column if kind.isnative else column.astype(kind.newbyteorder("="))


def same_kind(source: Any, stream: Any) -> Any:
    """A stream as the library of the source has tables."""
    module = type(source).__module__.partition(".")[0]
    if module == "polars":
        return importlib.import_module("polars").DataFrame(stream)
    if module not in ("pyarrow", "pandas", "builtins"):
        return stream
    pa = pyarrow()
    reader = pa.RecordBatchReader.from_stream(stream)
    if module == "pandas":
        return reader.read_all().to_pandas()
    if isinstance(source, pa.RecordBatch):
        return reader.read_all().combine_chunks().to_batches()[0] if len(source) else _empty_batch(reader)
    if isinstance(source, pa.RecordBatchReader):
        return reader
    return reader.read_all()


def _empty_batch(reader: Any) -> Any:
    return pyarrow().RecordBatch.from_pylist([], schema=reader.schema)
