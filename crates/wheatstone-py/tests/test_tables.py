"""Tables of other libraries in, the same kind out."""

from __future__ import annotations

import numpy as np
import pytest

import wheatstone as ws

pa = pytest.importorskip("pyarrow")
pd = pytest.importorskip("pandas")
pl = pytest.importorskip("polars")

NAMES = ["x1", "y1", "x2", "y2"]


@pytest.fixture
def table(data):
    columns = {"key": [f"k{row}" for row in range(len(data))]}
    columns |= {name: data.pixels[:, index] for index, name in enumerate(NAMES)}
    return pa.table(columns)


def test_every_kind_comes_back_as_itself(cal, data, table):
    wanted = cal.locate(data.pixels).points
    kinds = {
        pa.Table: table,
        pa.RecordBatch: table.combine_chunks().to_batches()[0],
        pd.DataFrame: table.to_pandas(),
        pl.DataFrame: pl.from_arrow(table),
        pa.RecordBatchReader: table.to_reader(max_chunksize=100),
    }
    for kind, given in kinds.items():
        found = cal.locate_arrow(given)
        assert isinstance(found, kind)
        found = found.read_all() if kind is pa.RecordBatchReader else found
        for axis, name in enumerate("XYZ"):
            assert np.array_equal(np.asarray(found[name]), wanted[:, axis]), kind
        assert list(found["key"])[-1] == f"k{len(data) - 1}" or str(found["key"][-1]) == f"k{len(data) - 1}"


def test_schema_is_known_beforehand(cal, table):
    for covariance in (False, True):
        found = cal.locate_arrow(table, covariance=covariance)
        assert found.schema == cal.located_schema(table.schema, covariance=covariance)
        assert ("cZZ" in found.column_names) == covariance


def test_bad_rows_are_nulls_in_their_place(cal, data, table):
    x1 = table["x1"].to_pylist()
    x1[3], x1[5], x1[7] = None, float("nan"), float("inf")
    spoilt = table.set_column(1, "x1", pa.array(x1))
    try:
        found = cal.locate_arrow(spoilt)
    except ws.WheatstoneError:
        x1[7] = None
        found = cal.locate_arrow(table.set_column(1, "x1", pa.array(x1)))
    nulls = [row for row, value in enumerate(found["X"].to_pylist()) if value is None]
    assert nulls == [3, 5, 7] and found["key"] == table["key"]
    assert found["trust"].to_pylist()[3] is None


def test_columns_of_other_types(cal, data, table):
    single = table.cast(pa.schema([("key", pa.large_string()), *[(name, pa.float32()) for name in NAMES]]))
    found = cal.locate_arrow(single)
    assert np.allclose(found["Z"], cal.predict(data.pixels.astype(np.float32))[:, 2], rtol=1e-6)
    whole = pa.table({name: np.rint(data.pixels[:, i]).astype(np.int64) for i, name in enumerate(NAMES)})
    assert np.array_equal(cal.locate_arrow(whole)["X"], cal.predict(np.rint(data.pixels))[:, 0])


def test_pixel_sigma_of_tables(cal, data, table):
    sigmas = np.where(np.arange(len(data)) % 2, 0.1, 1.0)
    told = table.append_column("s", pa.array(sigmas)).append_column("t", pa.array([0.5] * len(data)))
    wanted = {
        0.3: np.full((len(data), 2), 0.3),
        "s": np.stack([sigmas, sigmas], axis=1),
        ("s", "t"): np.stack([sigmas, np.full(len(data), 0.5)], axis=1),
    }
    for given, each in wanted.items():
        expected = cal.locate(data.pixels, pixel_sigma=each)
        for kind in (told, told.to_pandas(), pl.from_arrow(told)):
            found = cal.locate_arrow(kind, pixel_sigma=given)
            for axis, name in enumerate(("sX", "sY", "sZ")):
                assert np.array_equal(np.asarray(found[name]), expected.sigmas[:, axis]), given
            assert [value == "yes" for value in found["mismatch"]] == expected.mismatch.tolist() or kind is told
    # What is missing or no standard deviation leaves a row without error bars.
    spoilt = sigmas.tolist()
    spoilt[3], spoilt[5], spoilt[7] = None, -1.0, 0.0
    found = cal.locate_arrow(table.append_column("s", pa.array(spoilt)), pixel_sigma="s")
    assert [row for row, value in enumerate(found["sZ"].to_pylist()) if value is None] == [3, 5, 7]
    assert found["X"].null_count == 0 and found["mismatch"].to_pylist()[3] is None
    with pytest.raises(ws.errors.MalformedError, match="no column `sharp`"):
        cal.locate_arrow(told, pixel_sigma="sharp")
    with pytest.raises(ws.errors.MalformedError, match="3 columns are named"):
        cal.locate_arrow(told, pixel_sigma=["s", "t", "t"])
    for bad in (0.0, -1.0, [], [0.1, 0.2], ["s", 1.0], True):
        with pytest.raises(ws.errors.ArgumentError, match="pixel_sigma"):
            cal.locate_arrow(told, pixel_sigma=bad)


def test_empty_tables(cal, table):
    assert cal.locate_arrow(table.slice(0, 0)).num_rows == 0
    assert cal.locate_arrow(table.slice(0, 0).to_pandas()).shape == (0, 14)
    batch = pa.RecordBatch.from_pylist([], schema=table.schema)
    assert isinstance(cal.locate_arrow(batch), pa.RecordBatch)


def test_columns_are_named(cal, data, table):
    renamed = table.rename_columns(["key", "a", "b", "c", "d"])
    columns = {"x1": "a", "y1": "b", "x2": "c", "y2": "d"}
    found = cal.locate_arrow(renamed, columns=columns)
    assert np.array_equal(found["X"], cal.predict(data.pixels)[:, 0])
    with pytest.raises(ws.errors.MalformedError):
        cal.locate_arrow(renamed)


def test_located_points_become_a_table(cal, data):
    located = cal.locate(data.pixels, covariance=True)
    found = located.to_arrow()
    assert np.array_equal(found["sZ"], located.sigmas[:, 2])
    assert np.array_equal(found["cXZ"], located.covariance[:, 0, 2])
    assert set(found["trust"].to_pylist()) <= {"inside", "edge", "outside"}


def test_caliscope(tmp_path):
    data = ws.synth(rig="pinhole", cameras=3, hand_held=8, noise=0.1)
    pixels, rows = data.pixels.reshape(len(data), 3, 2), []
    for row in range(len(data)):
        for camera in range(3):
            x, y = pixels[row, camera]
            if not np.isnan(x):
                point, (across, down) = data.ids[row], data.board[row]
                rows.append((int(data.views[row]), camera + 4, 0, int(point), x, y, across, down))
    np.random.default_rng(0).shuffle(rows)
    names = ["sync_index", "cam_id", "object_id", "keypoint_id", "img_loc_x", "img_loc_y", "board_loc_x", "board_loc_y"]
    frame = pd.DataFrame(rows, columns=names)
    for given in (frame, pl.from_pandas(frame), pa.Table.from_pandas(frame)):
        read = ws.read_caliscope(given, unit="cm")
        assert (len(read), read.cameras, len(read.view_names)) == (len(data), 3, 8)
    cal = ws.fit(frame, unit="cm", method="brown", validate=False)
    other = ws.fit(data, method="brown", validate=False)
    assert np.isclose(cal.training.rms, other.training.rms, rtol=0.05)
    frame.to_csv(tmp_path / "xy.csv", index=False)
    assert np.array_equal(ws.read_caliscope(tmp_path / "xy.csv").pixels, ws.read_caliscope(frame).pixels, equal_nan=True)
    with pytest.raises(ws.errors.ArgumentError, match="img_loc_y"):
        ws.read_caliscope(frame.drop(columns=["img_loc_y"]))


def test_rows_of_caliscope_that_contradict_each_other_are_refused():
    names = ["sync_index", "cam_id", "object_id", "keypoint_id", "img_loc_x", "img_loc_y", "board_loc_x", "board_loc_y"]
    nan = np.nan
    rows = [[3, cam, 0, point, 10.0 * point, 5.0, 0.1 * point, nan if point == 2 else 0.2] for point in range(4) for cam in (1, 2)]
    frame = pd.DataFrame(rows, columns=names)
    wanted = ws.read_caliscope(frame)
    for exact in (pd.concat([frame, frame]), pd.concat([frame, frame[:3]])):
        read = ws.read_caliscope(exact)
        assert np.array_equal(read.pixels, wanted.pixels) and np.array_equal(read.board, wanted.board, equal_nan=True)
    moved = frame.assign(img_loc_x=frame.img_loc_x + (frame.keypoint_id == 1) * (frame.cam_id == 2))
    unseen = frame.assign(img_loc_x=frame.img_loc_x.where(frame.keypoint_id != 1), img_loc_y=frame.img_loc_y.where(frame.keypoint_id != 1))
    for other, cam in ((moved, 2), (unseen, 1)):
        with pytest.raises(ws.errors.ArgumentError, match=rf"that of sync_index 3, cam_id {cam}, object_id 0, keypoint_id 1\n") as raised:
            ws.read_caliscope(pd.concat([frame, other]))
        assert "one row of each point and camera" in raised.value.hint
    bent = frame.assign(board_loc_x=frame.board_loc_x + 0.1 * ((frame.keypoint_id == 3) & (frame.cam_id == 2)))
    with pytest.raises(ws.errors.ArgumentError, match="cam_id 1, object_id 0, keypoint_id 3"):
        ws.read_caliscope(bent)
    # Only one camera's rows have places on the board.
    some = frame.assign(board_loc_x=frame.board_loc_x.where(frame.cam_id == 1))
    assert np.array_equal(ws.read_caliscope(some).board, wanted.board, equal_nan=True)


def test_bad_data_are_refused():
    good = np.zeros((6, 4))
    for arguments in (
        {"pixels": np.zeros((6, 3))},
        {"pixels": good, "points": np.zeros((5, 3))},
        {"pixels": good, "points": np.zeros((6, 2))},
        {"pixels": good, "views": ["a"] * 5},
        {"pixels": good, "board": np.zeros((6, 3))},
        {"pixels": np.full((6, 4), 1e300)},
        {"pixels": good, "points": np.full((6, 3), np.inf)},
        {"pixels": np.where(np.arange(4) == 0, np.nan, good)},
    ):
        with pytest.raises(ws.errors.ArgumentError) as raised:
            ws.Dataset.from_arrays(**arguments)
        assert raised.value.hint
    frame = pd.DataFrame({"a": [1.0], "b": [2.0]})
    with pytest.raises(ws.errors.MalformedError):
        ws.fit(frame)
    with pytest.raises(ws.errors.ArgumentError):
        ws.fit(frame, np.zeros((1, 3)))
