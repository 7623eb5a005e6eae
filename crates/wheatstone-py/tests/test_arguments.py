"""What a value or a table of the wrong kind is told: an error of the package's own, which says what to give."""

from __future__ import annotations

import numpy as np
import pytest

import wheatstone as ws
from wheatstone.errors import ArgumentError, MalformedError, MissingFileError

PICTURE = np.zeros((40, 40), dtype=np.uint8)
BOARD = ws.Chart.chessboard(4, 3, 10.0)


def test_charts_take_numbers_of_numpy_and_no_others():
    assert ws.Chart.chessboard(np.int8(4), np.array(3), np.float32(10.0)) == BOARD
    for columns, pitch in ((2.5, 1.0), (np.nan, 1.0), ("a", 1.0), ([4], 1.0), (4, np.inf), (4, "1"), (4, 1j)):
        with pytest.raises(ArgumentError, match="(columns|pitch) cannot be"):
            ws.Chart.chessboard(columns, 3, pitch)


@pytest.mark.parametrize("pictures", [5, None, [5], [None, None], [[], []], [[None], []]])
def test_pictures_are_lists_of_cameras(pictures):
    with pytest.raises(ArgumentError, match="cameras with"):
        ws.detect_all(pictures, BOARD)


def test_places_of_charts_are_a_row_a_view():
    pictures = [[PICTURE], [PICTURE]]
    with pytest.raises(ArgumentError, match=r"translations has shape \(2, 3\)"):
        ws.detect_all(pictures, BOARD, translations=np.zeros((2, 3)))
    with pytest.raises(ArgumentError, match="rotations is not an array of numbers"):
        ws.detect_all(pictures, BOARD, translations=np.zeros((1, 3)), rotations="mm")
    with pytest.raises(ArgumentError, match="0 views and 1 pictures"):
        ws.detect_all(pictures, BOARD, views=5)


def test_pixels_of_parts_are_whole(cal):
    for part in ((0, 0, 2**70, 9), (0.5, 0, 9, 9), (-1, 0, 9, 9), (0, 0, 9)):
        with pytest.raises(ArgumentError, match="region cannot be"):
            ws.Reconstructor(cal, (40, 40), region=part)
    for disparities in ((0.5, 8), (0, 2**40), (0, np.nan)):
        with pytest.raises(ArgumentError, match="range cannot be"):
            ws.match_pair(PICTURE, PICTURE, disparities)


def test_columns_of_tables_are_of_one_length(cal, data):
    pytest.importorskip("pyarrow")
    swapped = {f"{axis}{camera}": data.pixels[:, 2 * camera - 2 + rank].astype(">f8") for camera in (1, 2) for rank, axis in enumerate("xy")}
    assert len(cal.locate_arrow(swapped)["X"]) == len(data)
    for column in (data.pixels, data.pixels[:3, 0]):
        with pytest.raises(ArgumentError, match="the columns make no table"):
            cal.locate_arrow({**swapped, "x2": column})


def test_rows_of_caliscope_have_a_camera_each(tmp_path):
    rows = {"sync_index": [0, 0], "cam_id": [0, 1], "keypoint_id": [7, 7], "img_loc_x": [1.0, 2], "img_loc_y": [3.0, 4]}
    assert len(ws.read_caliscope(rows)) == 1
    for name, column, told in (
        ("cam_id", [0, 1, 2], "shapes"),
        ("img_loc_x", 5.0, "shapes"),
        ("cam_id", [0, np.nan], "row 1 has no cam_id"),
        ("keypoint_id", np.array([7, "a"], dtype=object), "keypoint_id mixes"),
    ):
        with pytest.raises(ArgumentError, match=told):
            ws.read_caliscope({**rows, name: column})
    with pytest.raises(MissingFileError, match="No such file"):
        ws.read_caliscope(tmp_path / "none.csv")
    (tmp_path / "odd.csv").write_text("a,b\n1,2\n1,2,3\n")
    with pytest.raises(MalformedError, match="is no table"):
        ws.read_caliscope(tmp_path / "odd.csv")
