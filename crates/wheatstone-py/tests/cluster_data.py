"""What the tests of engines share: matched pixels in Parquet files, and what one process makes of them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

import wheatstone as ws

ROWS = 100_000
FILES = 8
PIXELS = ("x1", "y1", "x2", "y2")
PLACES = ("X", "Y", "Z")


def write_model(folder: Path) -> Path:
    path = folder / "model.json"
    data = ws.synth(rig="paper", noise=0.1, count=300)
    ws.fit(data, method="brown", validate=False).save(path)
    return path


def matched_pixels(rows: int = ROWS) -> Any:
    """A table with a key; every hundredth point was seen by one camera only, every thousandth by none."""
    pixels = ws.synth(rig="paper", noise=0.3, count=300, seed=1).pixels
    random = np.random.default_rng(0)
    pixels = pixels[random.integers(len(pixels), size=rows)] + random.normal(size=(rows, 4))
    pixels[::100, 2:] = np.nan
    pixels[::1000] = np.nan
    columns: dict[str, Any] = {"key": np.arange(rows), "name": [f"p{row}" for row in range(rows)]}
    columns |= {
        name: pa.array(column, from_pandas=True) for name, column in zip(PIXELS, pixels.T)
    }
    return pa.table(columns)


def write_parts(table: Any, folder: Path, files: int = FILES) -> Path:
    folder.mkdir()
    size = -(-len(table) // files)
    for part in range(files):
        pq.write_table(table.slice(part * size, size), folder / f"part-{part:02}.parquet")
    return folder


def read_parts(path: Path) -> Any:
    """The rows of a file, or of the files of a folder in the order of their names."""
    files = sorted(path.glob("*.parquet")) if path.is_dir() else [path]
    return pa.concat_tables([pq.read_table(file) for file in files], promote_options="permissive")


def require_same(table: Any, model: Path, found: Any) -> None:
    """`found` has the rows of `table` in order, with the places of one process, to the bit."""
    calibration = ws.load(model)
    assert found.column("key").to_pylist() == table.column("key").to_pylist()
    expected = calibration.locate_arrow(table)
    assert found.column_names == expected.column_names
    pixels = np.stack([table.column(name).to_numpy() for name in PIXELS], axis=1)
    places = calibration.locate(pixels)
    for index, name in enumerate(PLACES):
        column = found.column(name)
        assert 0 < column.null_count < len(table) / 50
        is_null = column.is_null().to_numpy()
        assert (is_null == np.isnan(places.points[:, index])).all()
        assert column.drop_null().to_numpy().tobytes() == places.points[~is_null, index].tobytes()
    # Points alone may take another way to the last digits.
    away = np.abs(calibration.predict(pixels) - places.points) / places.sigmas
    assert np.nanmax(away) < 0.2
    for name in expected.column_names:
        text = str(expected.schema.field(name).type) == "string"
        kind = pa.string() if text else expected.schema.field(name).type
        assert found.column(name).cast(kind).combine_chunks().equals(
            expected.column(name).combine_chunks()
        ), name


def spoiled(table: Any) -> tuple[Any, list[int]]:
    """The table with three rows that are no pixels, and which."""
    x1, y2 = table.column("x1").to_pylist(), table.column("y2").to_pylist()
    x1[5], y2[7], y2[11] = None, float("inf"), 1e300
    table = table.set_column(table.column_names.index("x1"), "x1", pa.array(x1, pa.float64()))
    return table.set_column(table.column_names.index("y2"), "y2", pa.array(y2, pa.float64())), [5, 7, 11]


def located_in_process(calibration: ws.Calibration, pixels: Any) -> tuple[bytes, bytes]:
    """What a process of a pool is asked for."""
    return calibration.predict(pixels).tobytes(), calibration.locate(pixels).points.tobytes()
