"""The columns of a table are found by their names wherever a table is taken."""

from __future__ import annotations

import sys

import numpy as np
import pytest

import wheatstone as ws

pa = pytest.importorskip("pyarrow")
pd = pytest.importorskip("pandas")
pl = pytest.importorskip("polars")

NAMES = ["x1", "y1", "x2", "y2"]


@pytest.fixture
def frame(data):
    """Pixels in an order that is not ours, and what else a table has."""
    columns = pd.DataFrame(data.pixels, columns=NAMES)[["x1", "x2", "y1", "y2"]]
    return columns.assign(key="k", Z=data.points[:, 2], view=data.views, Y=data.points[:, 1], X=data.points[:, 0])


def kinds(frame):
    yield frame
    yield pl.from_pandas(frame)
    yield pa.Table.from_pandas(frame)
    yield pa.Table.from_pandas(frame).combine_chunks().to_batches()[0]
    yield {name: frame[name].tolist() for name in frame}


def test_points_are_located_by_names(cal, data, frame):
    wanted = cal.predict(data.pixels)
    for given in kinds(frame):
        assert np.array_equal(cal.predict(given), wanted), type(given)
        located = cal.locate(given, covariance=True)
        assert np.array_equal(located.points, wanted), type(given)
    swapped = frame[["x2", "y2", "x1", "y1"]]
    assert np.array_equal(cal.predict(swapped), wanted)
    assert np.array_equal(cal.locate_arrow(swapped)["X"], wanted[:, 0])
    out = np.empty((len(data), 3))
    assert cal.predict(swapped, out) is out and np.array_equal(out, wanted)


def test_data_of_every_kind_are_located(cal, data, tmp_path):
    data.save(tmp_path / "points.csv")
    wanted = cal.predict(data.pixels)
    for given in (data, tmp_path / "points.csv", str(tmp_path / "points.csv")):
        assert np.array_equal(cal.predict(given), wanted)
        assert np.array_equal(cal.locate(given).points, wanted)


def test_frames_without_names_are_read_by_position(cal, data):
    wanted = cal.predict(data.pixels)
    for given in (pd.DataFrame(data.pixels), pl.DataFrame(data.pixels), pd.DataFrame(data.pixels, columns=list("0123"))):
        assert np.array_equal(cal.predict(given), wanted)
    assert np.array_equal(cal.project(pd.DataFrame(data.points), 1), cal.project(data.points, 1))
    with pytest.raises(ws.errors.ArgumentError, match="6 columns"):
        cal.predict(pd.DataFrame(np.zeros((3, 6))))


@pytest.mark.parametrize("names", [list("abcd"), ["px1", "py1", "px2", "py2"], ["col1", "row1", "col2", "row2"]])
def test_names_that_say_nothing_are_refused(names, cal, data):
    """Their order may be any."""
    told = pd.DataFrame(data.pixels, columns=names)[[names[2], names[3], names[0], names[1]]]
    calls = [cal.predict, cal.locate, lambda given: ws.fit(given, data.points), lambda given: cal.evaluate(given, data.points)]
    for call in calls:
        for given in (told, pl.from_pandas(told), pa.Table.from_pandas(told), dict(told)):
            with pytest.raises(ws.errors.ArgumentError, match=f"do not say what they hold: {names[2]}") as raised:
                call(given)
            assert "x1, y1, x2, y2" in raised.value.hint and "to_numpy()" in raised.value.hint
    with pytest.raises(ws.errors.ArgumentError, match="hold: a, b, c"):
        cal.project(pd.DataFrame(data.points, columns=list("abc")), 0)
    with pytest.raises(ws.errors.ArgumentError, match="found: a, b"):
        cal.rays(pd.DataFrame(data.pixels[:, :2], columns=list("ab")), 0)


def test_points_may_stand_beside_a_table_of_pixels(cal, data, frame):
    wanted = ws.fit(data.pixels, data.points, views=data.views, unit="cm", method="dlt", validate=False).to_bytes()
    judged = cal.evaluate(data.pixels, data.points)
    pixels, places = frame[["x2", "y2", "y1", "x1", "key"]], frame[["Z", "Y", "X"]]
    viewed = frame[["view", "x2", "y2", "x1", "y1"]]
    for given in kinds(pixels):
        for points in (data.points, places):
            cal_of_table = ws.fit(given, points, views=data.views, unit="cm", method="dlt", validate=False)
            assert cal_of_table.to_bytes() == wanted, type(given)
        assert cal.evaluate(given, data.points) == judged
    # Its own views count, where no others are given.
    assert ws.fit(viewed, places, unit="cm", method="dlt", validate=False).to_bytes() == wanted
    unnamed = pd.DataFrame(data.pixels)
    assert ws.fit(unnamed, places, views=data.views, unit="cm", method="dlt", validate=False).to_bytes() == wanted
    told = pixels.rename(columns={"x1": "a", "y1": "b", "x2": "c", "y2": "d"})
    columns = {"x1": "a", "y1": "b", "x2": "c", "y2": "d"}
    assert cal.evaluate(told, data.points, columns=columns) == judged
    assert cal.evaluate(pixels, data.points * 10, unit="mm").rms == pytest.approx(judged.rms)
    with pytest.raises(ws.errors.ArgumentError, match="given twice, for the table has Z, Y, X"):
        cal.evaluate(frame, data.points)
    with pytest.raises(ws.errors.ArgumentError, match="go with pixels alone"):
        ws.fit(data, data.points)


def test_the_places_on_a_board_are_found_by_names():
    waved = ws.synth(rig="pinhole", hand_held=4, noise=0.1)
    board = pd.DataFrame(waved.board, columns=["board_x", "board_y"])
    for given in (board[["board_y", "board_x"]], pd.DataFrame(waved.board)):
        made = ws.Dataset.from_arrays(waved.pixels, board=given, views=waved.views)
        assert np.array_equal(made.board, waved.board, equal_nan=True)
    with pytest.raises(ws.errors.ArgumentError, match="no columns `board_x`, `board_y`; found: p, q"):
        ws.Dataset.from_arrays(waved.pixels, board=board.set_axis(["p", "q"], axis=1))


def test_other_names_are_known_and_told(cal, data):
    wanted = cal.predict(data.pixels)
    sides = pd.DataFrame(data.pixels, columns=["left_x", "left_y", "right_x", "right_y"])
    assert np.array_equal(cal.predict(sides[["right_y", "left_x", "right_x", "left_y"]]), wanted)
    made = ws.Dataset.from_arrays(sides[["right_y", "left_x", "right_x", "left_y"]], data.points)
    assert np.array_equal(made.pixels, data.pixels)
    told = pd.DataFrame(data.pixels, columns=list("abcd"))[list("dcba")]
    columns = {"x1": "a", "y1": "b", "x2": "c", "y2": "d"}
    assert np.array_equal(cal.predict(told, columns=columns), wanted)
    assert np.array_equal(cal.locate(told, columns=["y2", "x2", "y1", "x1"]).points, wanted)


def test_every_row_keeps_its_place(cal, data, frame):
    frame.loc[3, ["x1", "y1", "x2", "y2"]] = np.nan
    frame.loc[5, "x1"] = np.nan
    frame.loc[7, ["x2", "y2"]] = np.nan
    frame = pd.concat([frame, frame[:2]]).set_index(np.arange(len(frame) + 2)[::-1])
    wanted = cal.predict(frame[NAMES].to_numpy())
    for given in (*kinds(frame), frame.convert_dtypes(), frame.astype(object)):
        found = cal.predict(given)
        assert np.flatnonzero(np.isnan(found[:, 0])).tolist() == [3, 5, 7]
        assert np.array_equal(found, wanted, equal_nan=True)
    assert cal.predict(frame[:0]).shape == (0, 3)


def test_missing_columns_are_named(cal, frame):
    for given in kinds(frame.drop(columns="y2")):
        with pytest.raises(ws.errors.MalformedError, match="no column `y2`; found: x1, x2, y1, key"):
            cal.predict(given)
    with pytest.raises(ws.errors.MalformedError, match="no column `Z`; found: x1, y1, X, Y") as raised:
        cal.project(frame[["x1", "y1", "X", "Y"]], 0)
    assert raised.value.args[0].endswith("found: x1, y1, X, Y")
    with pytest.raises(ws.errors.ArgumentError, match="no column `X`, `Y`, `Z`; found: x1, y1"):
        cal.project(frame[["x1", "y1"]], 0)
    with pytest.raises(ws.errors.ArgumentError, match="3 cameras|6 columns"):
        cal.predict(frame.assign(x3=1.0, y3=2.0))
    with pytest.raises(ws.errors.ArgumentError, match="column `x1`"):
        cal.predict(frame.assign(x1="text"))
    with pytest.raises(ws.errors.ArgumentError, match="one length"):
        cal.predict({**{name: frame[name].tolist() for name in NAMES}, "x1": [1.0]})


def test_places_are_projected_by_names_and_units(cal, data, frame, tmp_path):
    wanted = cal.project(data.points, 1)
    for given in kinds(frame):
        assert np.array_equal(cal.project(given, 1), wanted)
    assert np.array_equal(cal.project(frame[["Z", "X", "Y"]], 1), wanted)
    data.save(tmp_path / "points.csv")
    assert np.array_equal(cal.project(data, 1), wanted)
    assert np.array_equal(cal.project(tmp_path / "points.csv", 1), wanted)
    millimetres = pd.DataFrame(10 * data.points, columns=["X [mm]", "Y [mm]", "Z [mm]"])
    assert np.allclose(cal.project(millimetres, 1), wanted, atol=1e-9)
    other = ws.Dataset.from_arrays(data.pixels, 10 * data.points, unit="mm")
    assert np.allclose(cal.project(other, 1), wanted, atol=1e-9)


def test_what_is_no_table_is_not_appended_to(cal, data, frame):
    for given in (data.pixels, data.pixels.tolist(), "points.csv", data, frame["x1"], None):
        with pytest.raises(ws.errors.ArgumentError, match="no table") as raised:
            cal.locate_arrow(given)
        assert "locate" in str(raised.value.hint)


def test_one_column_is_no_table(frame):
    for given in (frame["x1"], pl.from_pandas(frame)["x1"]):
        with pytest.raises(ws.errors.ArgumentError, match="shape"):
            ws.fit(given)


def test_our_own_names_need_no_pyarrow(cal, data, frame, monkeypatch):
    wanted, seen = cal.predict(data.pixels), cal.project(data.points, 0)
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    assert np.array_equal(cal.predict(frame), wanted)
    assert np.array_equal(cal.project(frame, 0), seen)
    assert np.array_equal(cal.predict({name: frame[name].tolist() for name in frame}), wanted)
    with pytest.raises(ws.errors.ArgumentError, match="needs pyarrow"):
        cal.predict(frame.rename(columns={"x1": "u1", "y1": "v1", "x2": "u2", "y2": "v2"}))


def test_rays_and_arrays_of_data_are_found_by_names(cal, data, frame):
    for camera in (0, 1):
        expected = cal.rays(data.pixels[:, 2 * camera : 2 * camera + 2], camera)
        own = frame[[f"y{camera + 1}", f"x{camera + 1}"]]
        for given in (frame, own):
            for found, truth in zip(cal.rays(given, camera), expected):
                assert np.array_equal(found, truth)
    with pytest.raises(ws.errors.ArgumentError, match="no columns `x2`, `y2`; found: X, Y, Z"):
        cal.rays(pd.DataFrame(data.points, columns=["X", "Y", "Z"]), 1)
    places = pd.DataFrame(data.points, columns=["X", "Y", "Z"])[["Z", "X", "Y"]]
    made = ws.Dataset.from_arrays(frame, places, views=data.views, unit=data.unit)
    assert np.array_equal(made.pixels, data.pixels) and np.array_equal(made.points, data.points)
    assert np.array_equal(ws.Dataset.from_arrays(pd.DataFrame(data.pixels)).pixels, data.pixels)
