"""Charts in arrays, and cameras of OpenCV."""

from __future__ import annotations

import re
import warnings

import numpy as np
import pytest

import wheatstone as ws


@pytest.fixture(scope="module")
def capture(tmp_path_factory):
    folder = tmp_path_factory.mktemp("capture")
    ws.synth_capture(folder, rig="pinhole", hand_held=7, chart=ws.Chart.chessboard(9, 6, 5.5), seed=2)
    return folder


def board(columns=9, rows=6, square=24):
    cells = np.indices((rows + 1, columns + 1)).sum(axis=0) % 2
    return np.pad(np.kron(cells, np.ones((square, square))) * 200, 40, constant_values=200) + 20


def test_pictures_of_any_form_give_the_same():
    chart, gray = ws.Chart.chessboard(9, 6, 30.0), board().astype(np.uint8)
    wanted = ws.detect(gray, chart)
    assert len(wanted) == 54 and np.isfinite(wanted.pixels).all() and wanted.board.shape == (54, 3)
    assert np.allclose(wanted.pixels.min(axis=0), 40 + 24 - 0.5, atol=0.02)
    colour = np.repeat(gray[:, :, None], 3, axis=2)
    wide = np.zeros((gray.shape[0], 2 * gray.shape[1]), np.uint8)
    wide[:, ::2] = gray
    forms = [colour, colour[:, :, ::-1], gray[:, :, None], np.asfortranarray(gray), wide[:, ::2]]
    forms += [gray.astype(np.uint16) * 257, gray.astype(np.float32), gray.astype(np.float64), gray.astype(np.int64)]
    for form in forms:
        found = ws.detect(form, chart)
        assert np.array_equal(found.ids, wanted.ids)
        assert np.abs(found.pixels - wanted.pixels).max() < 1e-3
    assert np.abs(ws.detect(colour, chart, bgr=True).pixels - wanted.pixels).max() < 1e-3
    with pytest.raises(ws.errors.ChartNotFoundError):
        ws.detect(np.zeros((200, 200), np.uint8), chart)
    for bad in (np.zeros((3,)), np.zeros((0, 0), np.uint8), np.zeros((9, 9, 7), np.uint8), np.zeros((9, 9), complex)):
        with pytest.raises(ws.errors.ArgumentError):
            ws.detect(bad, chart)


def test_pictures_of_other_types_are_not_clipped():
    chart, gray = ws.Chart.chessboard(9, 6, 30.0), board().astype(np.uint8)
    wanted = ws.detect(gray, chart).pixels
    wide = gray.astype(np.uint16) * 257
    types = [">u2", "<u2", "i4", ">i4", "u4", "i8", "u8"]
    forms = [wide.astype(kind) for kind in types] + [np.dstack([wide] * 3).astype(">u2"), (gray.astype("i2") * 16)]
    forms += [gray.astype(kind) for kind in ("i2", "i4", ">i2", ">f4", ">f8", "f2")]
    for form in forms:
        found = ws.detect(form, chart).pixels
        assert found.shape == wanted.shape and np.abs(found - wanted).max() < 0.02, form.dtype
        data = ws.detect_all([[form], [gray]], chart)
        assert len(data) == 54 and not np.isnan(data.pixels).any()


def test_pictures_that_have_no_scale_are_refused():
    chart, gray = ws.Chart.chessboard(9, 6, 30.0), board()
    bad = {
        "uint16": [gray * 257.0, (gray * 16.0).astype(np.float32), (gray * 257.0).astype(">f4")],
        "0..65535": [gray.astype(np.int32) * 300, gray.astype(np.int16) - 100, gray.astype(np.uint32) << 20],
    }
    for way_out, forms in bad.items():
        for form in forms:
            calls = [
                lambda: ws.detect(form, chart),
                lambda: ws.detect_all([[form], [form]], chart),
                lambda: ws.match_pair(form, form, (0, 16)),
            ]
            for call in calls:
                with pytest.raises(ws.errors.ArgumentError, match="with values") as raised:
                    call()
                assert way_out in str(raised.value.hint)
    holes = gray.copy()
    holes[:9, :9], holes[-9:, -9:] = np.nan, np.inf
    assert len(ws.detect(holes, chart)) == 54


def test_a_pair_is_matched_whatever_its_type():
    texture = np.random.default_rng(3).integers(0, 256, (60, 120)).astype(np.uint16) * 257
    left, right = texture[:, :100], texture[:, 5:105]
    wanted = ws.match_pair(left, right, (0, 16)).disparity
    for kind in (">u2", "i4", "u4", "i8"):
        found = ws.match_pair(left.astype(kind), right.astype(kind), (0, 16)).disparity
        assert np.array_equal(found, wanted, equal_nan=True), kind


def test_charts_have_their_points():
    charts = [
        (ws.Chart.chessboard(9, 6, 30), 54),
        (ws.Chart.charuco(8, 6, 30, 22), 35),
        (ws.Chart.dots(10, 7, 20, asymmetric=False), 70),
        (ws.Chart.lines(9, 7, 5), 63),
        (ws.Chart.april_grid(6, 4, 30, 0.3), 96),
        (ws.Chart.of_points([[0, 0, 0], [30, 0, 0], [0, 40, 5], [20, 50, 0]]), 4),
    ]
    for chart, count in charts:
        assert chart.points.shape == (count, 3)
        assert eval(repr(chart).removeprefix("<wheatstone.Chart: ").removesuffix(">")) == chart.settings
    with pytest.raises(ws.errors.SettingError):
        ws.Chart.chessboard(9, 6, -1)


def test_pictures_become_a_model(capture):
    chart = ws.Chart.chessboard(9, 6, 5.5)
    paths = [sorted((capture / side).glob("*.png")) for side in ("left", "right")]
    cal = ws.calibrate(paths, chart, unit="cm", method="brown", validate=False)
    assert cal.image_sizes[0] is not None and cal.training.rms < 0.1
    from_folder = ws.fit(capture, method="brown", validate=False)
    assert np.array_equal(from_folder.data.pixels, cal.data.pixels, equal_nan=True)
    cv2 = pytest.importorskip("cv2")
    arrays = [[cv2.imread(str(path)) for path in of_camera] for of_camera in paths]
    arrays[1][2] = None
    data = ws.detect_all(arrays, chart, unit="cm", bgr=True)
    assert np.isnan(data.pixels[data.views == 2][:, 2:]).all()
    with pytest.raises(ws.errors.ArgumentError):
        ws.detect_all([paths[0], paths[1][:3]], chart)
    for bad in (["left/*.png", "right/*.png"], paths[0], "left/*.png"):
        with pytest.raises(ws.errors.ArgumentError, match="one list of pictures a camera"):
            ws.detect_all(bad, chart)


def test_opencv_projects_as_the_model_does(cal, data):
    cv2 = pytest.importorskip("cv2")
    told = cal.to_opencv(image_size=(640, 480))
    assert told["loss"] is None
    for camera in (1, 2):
        pose = told["camera_from_world"][camera - 1]
        vector, _ = cv2.Rodrigues(np.ascontiguousarray(pose[:, :3]))
        pixels, _ = cv2.projectPoints(data.points, vector, pose[:, 3], told[f"K{camera}"], told[f"D{camera}"])
        assert np.abs(pixels.reshape(-1, 2) - cal.project(data.points, camera - 1)).max() < 1e-9
    keys = ("K1", "D1", "K2", "D2", "R", "T")
    back = ws.from_opencv(*(told[key] for key in keys), (640, 480), unit="cm")
    # Its world is the frame of camera 1.
    pose = told["camera_from_world"][0]
    expected = cal.predict(data.pixels) @ pose[:, :3].T + pose[:, 3]
    assert np.abs(back.predict(data.pixels) - expected).max() < 1e-3
    with pytest.raises(ws.errors.ArgumentError):
        ws.from_opencv(np.eye(2), told["D1"], told["K2"], told["D2"], told["R"], told["T"])
    with pytest.raises(ws.errors.ArgumentError):
        ws.from_opencv(told["K1"], np.zeros(3), told["K2"], told["D2"], told["R"], told["T"])


def test_opencv_rectifies_by_the_arrays_as_they_are(cal):
    cv2 = pytest.importorskip("cv2")
    told = cal.to_opencv(image_size=(640, 480))
    lenses = [told[key] for key in ("K1", "D1", "K2", "D2")]
    projection = cv2.stereoRectify(*lenses, (640, 480), told["R"], told["T"])[3]
    assert projection[0, 3] / projection[0, 0] == pytest.approx(-np.linalg.norm(told["T"]), rel=1e-6)
    for shape in ((3,), (3, 1), (1, 3)):
        back = ws.from_opencv(*lenses, told["R"], told["T"].reshape(shape))
        assert np.array_equal(back.to_opencv()["T"], told["T"])


def test_what_no_pair_of_cameras_is_is_refused():
    K, none = np.array([[800.0, 0, 320], [0, 800, 240], [0, 0, 1]]), np.zeros(5)
    good = dict(K1=K, D1=none, K2=K, D2=none, R=np.eye(3), T=[-60.0, 0, 0])
    wanted = ws.from_opencv(**good).predict([[320.0, 240.0, 272.0, 240.0]])
    for same in (dict(D1=None, D2=None), dict(T=[[-60.0], [0], [0]]), dict(unit="inches"), dict(unit="dm")):
        assert np.array_equal(ws.from_opencv(**good | same).predict([[320.0, 240.0, 272.0, 240.0]]), wanted)
    fisheyes = [ws.from_opencv(**good | dict(D1=d, D2=d, fisheye=True)) for d in (None, np.zeros(4))]
    assert fisheyes[0] == fisheyes[1]
    bad = [
        (dict(K1=K.T), "last row of K1 is 320, 240, 1", "it is transposed: give `K1.T`"),
        (dict(K2=2 * K), "last row of K2 is 0, 0, 2", "fx, 0, cx"),
        (dict(K2=K * [[-1], [1], [1]]), "K2 has focal lengths of -800, 800", "above 0"),
        (dict(K1=K * [[0], [1], [1]]), "K1 has focal lengths of 0, 800", "above 0"),
        (dict(K1=K + [[0, 0, 0], [3, 0, 0], [0, 0, 0]]), "3 before the second", "fx, 0, cx"),
        (dict(K1=np.where(K == 320, np.nan, K)), "K1 has numbers that are not finite", "OpenCV"),
        (dict(D2=[0.1, 0, 0, np.inf]), "D2 has numbers that are not finite", "OpenCV"),
        (dict(D2="none"), "D2 is not an array of numbers", "float64"),
        (dict(R=[0.0, 0, 0]), r"R has shape \(3,\)", "cv2.Rodrigues"),
        (dict(T=[0.0, 0, 0]), "T is 0", "baseline"),
        (dict(T=[0.0, np.nan, 0]), "T has numbers that are not finite", "OpenCV"),
        (dict(T=[0.0, 1.0]), r"T has shape \(2,\)", r"(3,) or (3, 1)"),
        (dict(pixel_sigma=0), "pixel_sigma cannot be 0", "above 0"),
        (dict(pixel_sigma=-1), "pixel_sigma cannot be -1", "above 0"),
        (dict(pixel_sigma=np.nan), "pixel_sigma cannot be nan", "above 0"),
        (dict(pixel_sigma="a"), "pixel_sigma cannot be 'a'", "above 0"),
        (dict(unit="parsec"), "unit cannot be 'parsec'", "um, mm, cm"),
        (dict(unit=5), "unit cannot be 5", "um, mm, cm"),
    ]
    for other, problem, hint in bad:
        with pytest.raises(ws.errors.ArgumentError, match=problem) as raised:
            ws.from_opencv(**good | other)
        assert hint in raised.value.hint, other


def test_files_of_other_programs_go_there_and_back(cal, data, tmp_path):
    for name, path in {"opencv": "stereo.yml", "dlt": "dlt.csv", "kalibr": "camchain.yaml"}.items():
        with warnings.catch_warnings(record=True) as warned:
            warnings.simplefilter("always")
            files = cal.export(name, tmp_path / path, image_size=(640, 480))
        # Projection matrices have no distortion, which this lens has.
        told = [str(w.message) for w in warned if w.category is ws.DataWarning]
        assert len(told) == (name == "dlt")
        if name == "dlt":
            assert re.search(r"a projection matrix was fitted to it, which differs by [\d.]+ px rms, [\d.]+ px at most", told[0])
            continue
        back = ws.read_cameras(*files, unit="cm")
        residual = back.locate(data.pixels).residual
        assert np.median(residual) < 0.3, name
    assert cal.export("opencv")["K1"].shape == (3, 3)
    with pytest.raises(ws.errors.UnknownNameError):
        cal.export("opencvv", tmp_path / "x")


def test_a_pair_is_matched():
    texture = np.random.default_rng(3).uniform(0, 255, (90, 160))
    texture = sum(np.roll(texture, (a, b), (0, 1)) for a in range(3) for b in range(3)) / 9
    left, right = texture[:, :120].astype(np.uint8), texture[:, 8:128].astype(np.uint8)
    found = ws.match_pair(left, right, (0, 24))
    assert found.disparity.shape == found.confidence.shape == found.sigma.shape == (90, 120)
    sure = found.confidence > 0.9
    assert found.density() == sure.mean() > 0.6
    assert np.abs(found.disparity[sure] - 8).max() < 0.5
    assert abs(found.vertical_offset) < 0.1
    pixels = found.pixels()
    assert pixels.shape == (sure.sum(), 4) and np.allclose(pixels[:, 0] - pixels[:, 2], found.disparity[sure])
    coloured = np.repeat(left[..., None], 3, axis=2), np.repeat(right[..., None], 3, axis=2)
    assert np.array_equal(ws.match_pair(*coloured, (0, 24)).disparity, found.disparity, equal_nan=True)
    assert np.isfinite(ws.match_pair(left, right, (0, 24), fill=True).disparity).all()
    for pair, search in [((left, right[:, 1:]), (0, 24)), ((left, right), (5, 5)), ((left, right), (900, 950))]:
        with pytest.raises(ws.errors.ArgumentError):
            ws.match_pair(*pair, search)


def test_pictures_of_calibrated_cameras_become_points(tmp_path):
    texture = np.random.default_rng(3).uniform(0, 255, (120, 240))
    texture = sum(np.roll(texture, (a, b), (0, 1)) for a in range(3) for b in range(3)) / 9
    # A wall at 2.5 m: 0.1 m times 240 px by 9.6 px.
    K = np.array([[240.0, 0, 79.5], [0, 240, 59.5], [0, 0, 1]])
    none = np.zeros(5)
    cal = ws.from_opencv(K, none, K, none, np.eye(3), [-0.1, 0, 0], (160, 120), unit="m", pixel_sigma=0.1)
    columns = np.arange(160)
    left = texture[:, columns + 10]
    right = 0.4 * texture[:, columns + 19] + 0.6 * texture[:, columns + 20]
    pair = [np.stack([np.rint(side), 0 * side, 0 * side], axis=2).astype(np.uint8) for side in (left, right)]
    found = ws.reconstruct(cal, pair, range=(1.5, 10.0))
    assert len(found) > 0.5 * 160 * 120 and found.fault is None and found.unit == "m"
    assert np.median(np.abs(found.points[:, 2] - 2.5)) < 0.03
    assert 0.001 < np.median(found.sigmas[:, 2]) < 0.05
    row, column = np.argwhere(np.isfinite(found.depth))[500]
    assert found.depth.shape == found.disparity.shape and found.depth[row, column] == pytest.approx(2.5, abs=0.1)
    assert [pixels.shape for pixels in found.pixels] == [(len(found), 2)] * 2
    assert np.median(found.pixels[0][:, 0] - found.pixels[1][:, 0]) == pytest.approx(9.6, abs=0.1)
    assert (found.colours[:, 1:] == 0).all() and found.colours[:, 0].max() > 100
    assert not found.inside.any()
    found.save(tmp_path / "cloud.ply")
    header, body = (tmp_path / "cloud.ply").read_bytes().split(b"end_header\n", 1)
    assert f"element vertex {len(found)}".encode() in header and len(body) == 31 * len(found)
    for name, begins in [("pcd", b"# .PCD v0.7"), ("e57", b"ASTM-E57"), ("laz", b"LASF")]:
        found.save(tmp_path / f"cloud.{name}")
        assert (tmp_path / f"cloud.{name}").read_bytes().startswith(begins)
    with pytest.raises(ws.WheatstoneError, match="ply, pcd, e57, laz"):
        found.save(tmp_path / "cloud.txt")

    made = ws.Reconstructor(cal, (160, 120), range=(1.5, 10.0), region=(40, 30, 80, 60))
    part = made.reconstruct([side[..., 0] for side in pair])
    pixels = part.pixels[0]
    assert 0 < len(part) < len(found) and (pixels >= [39.5, 29.5]).all() and (pixels < [119.5, 89.5]).all()
    at = made.Q @ [79.5, 59.5, 10.0, 1.0]
    assert at[2] / at[3] == pytest.approx(0.1 * made.Q[2, 3] / 10.0)
    assert made.world.shape == (3, 4) and made.disparities[0] < 9 < made.disparities[1]

    sparse = ws.reconstruct(cal, pair, range=(1.5, 10.0), sparse=True)
    assert 20 < len(sparse) < 0.2 * len(found)
    assert np.median(np.abs(sparse.points[:, 2] - 2.5)) < 0.03

    whole = ws.Reconstructor(cal, (160, 120), range=(1.5, 10.0))
    pixels = np.column_stack([own[:400].astype(float) for own in found.pixels])
    again = whole.locate(pixels, pair, sigma=0.1)
    assert len(again) == 400 and np.allclose(again.points, found.points[:400], atol=1e-3)
    given = whole.locate(found.disparity, pair, sigma=0.1)
    assert len(given) >= len(found) and np.nanmedian(np.abs(given.depth - found.depth)) < 1e-4
    noise = np.random.default_rng(1)
    noisy = (
        [np.clip(side + noise.normal(0, 3, side.shape), 0, 255).astype(np.uint8) for side in pair]
        for _ in range(3)
    )
    fused = whole.fuse(noisy)
    assert len(fused) > 0.8 * len(found) and np.median(np.abs(fused.points[:, 2] - 2.5)) < 0.03
    with pytest.warns(ws.DataWarning, match="left out: cameras"):
        assert len(whole.fuse([pair, pair[::-1]])) == len(found)
    with pytest.raises(ws.errors.DegenerateError, match="no frame"):
        whole.fuse([])
    with pytest.raises(ws.errors.ArgumentError, match="shape"):
        whole.locate(np.zeros(4), pair)
    with pytest.raises(ws.errors.ArgumentError, match="is a path"):
        ws.reconstruct(cal, ["left.png", "right.png"])
    with pytest.raises(ws.errors.ArgumentError, match="shape"):
        ws.reconstruct(cal, [pair[0][0, 0], pair[1][0, 0]])

    with pytest.raises(ws.errors.DegenerateError, match="exchanged"):
        ws.reconstruct(cal, pair[::-1], range=(1.5, 10.0))
    assert "exchanged" in ws.reconstruct(cal, pair[::-1], range=(1.5, 10.0), force=True).fault
    with pytest.raises(ws.errors.MismatchError):
        ws.reconstruct(cal, [side[1:] for side in pair], range=(1.5, 10.0))
    with pytest.raises(ws.errors.SettingError):
        ws.reconstruct(cal, pair, range=(10.0, 1.5))
    with pytest.raises(ws.errors.ArgumentError):
        ws.Reconstructor(cal, (160, 120), cameras=[0, 2])


def test_a_rectified_pair_triangulates(cal, data):
    cv2 = pytest.importorskip("cv2")
    pair = ws.rectify(cal, image_size=(640, 480))
    left = cal.project(data.points, pair.cameras[0])
    assert pair.left_map[0].shape == (pair.size[1], pair.size[0]) and pair.left_map[0].dtype == np.float32
    inverse = pair.world[:, :3].T @ (data.points - pair.world[:, 3]).T
    homogeneous = np.vstack([inverse, np.ones(len(data))])
    seen = [(p @ homogeneous) for p in (pair.P1, pair.P2)]
    seen = [(p[:2] / p[2]).T for p in seen]
    assert np.abs(seen[0][:, 1] - seen[1][:, 1]).max() < 1e-6
    disparity = seen[0][:, 0] - seen[1][:, 0]
    back = pair.Q @ np.vstack([seen[0].T, disparity, np.ones(len(data))])
    assert np.allclose((back[:3] / back[3]).T, inverse.T, atol=1e-6)
    x = cv2.remap(np.tile(np.arange(640, dtype=np.float32), (480, 1)), *pair.left_map, cv2.INTER_LINEAR)
    column, row = np.rint(seen[0][200]).astype(int)
    assert abs(x[row, column] - left[200, 0]) < 2
