"""Fits, their evidence, and that they are those of the program."""

from __future__ import annotations

import copy
import json
import os
import pickle
import shutil
import subprocess
import sys
import threading
import time
import warnings
from pathlib import Path

import numpy as np
import pytest

import wheatstone as ws


def map_of(cal: ws.Calibration) -> dict:
    told = json.loads(cal.to_bytes())
    return {key: told[key] for key in ("reconstructor", "validation", "training", "volume", "ellipsoids", "data")}


def test_five_lines_from_two_arrays_to_points_with_error_bars(data):
    cal = ws.fit(data.pixels, data.points, views=data.views, unit="cm")
    assert cal.unit == "cm" and cal.cameras == 2
    located = cal.locate(data.pixels)
    assert np.isfinite(located.sigmas).all()
    validation = cal.validation
    assert validation is not None and len(validation.folds) == 7
    assert 0.2 < validation.all.rms < 0.45 and validation.all.rms > cal.training.rms
    exam = cal.evaluate(ws.synth(random=500, seed=3))
    assert exam.ratio_to_floor < 1.1 and 0.6 < exam.coverage[0] < 0.76 and exam.fitted_share == 0
    assert cal.evaluate(data).fitted_share == 1


@pytest.mark.parametrize("method", ["brown", "dlt", "network"])
def test_fits_are_those_of_the_program_bit_for_bit(method, data, tmp_path):
    program = os.environ.get("WHEATSTONE_PROGRAM") or shutil.which("wheatstone")
    if not program:
        pytest.skip("the program is not built: WHEATSTONE_PROGRAM names it")
    table, model = tmp_path / "points.csv", tmp_path / "model.json"
    data.save(table)
    command = [program, "fit", str(table), "--method", method, "--seed", "3", "-o", str(model)]
    subprocess.run(command, check=True, capture_output=True)
    theirs = ws.load(model)
    ours = ws.fit(table, method=method, seed=3)
    assert ours.to_bytes() == theirs.to_bytes() or map_of(ours) == map_of(theirs)
    points, wanted = ours.predict(data.pixels), theirs.predict(data.pixels)
    assert np.array_equal(points, wanted)


def test_all_ways_in_are_one(data, tmp_path):
    pa, pd, pl = (pytest.importorskip(name) for name in ("pyarrow", "pandas", "polars"))
    names = ["x1", "y1", "x2", "y2"]
    columns = {name: data.pixels[:, index] for index, name in enumerate(names)}
    columns |= {name: data.points[:, index] for index, name in enumerate("XYZ")}
    columns["view"] = [data.view_names[view] for view in data.views]
    columns["id"] = data.ids
    table = pa.table(columns)
    paths = [tmp_path / f"points.{kind}" for kind in ("csv", "parquet", "arrow")]
    for path in paths:
        data.save(path)
    wanted = map_of(ws.fit(data, method="dlt"))
    views = [data.view_names[view] for view in data.views]
    assert map_of(ws.fit(data.pixels, data.points, views=views, method="dlt", unit="cm"))["reconstructor"] == wanted["reconstructor"]
    for given in (table, pd.DataFrame(columns), pl.DataFrame(columns), columns, *paths):
        assert map_of(ws.fit(given, method="dlt", unit="cm")) == wanted, type(given)
    renamed = table.rename_columns(["u_left", "v_left", "u_right", "v_right", "X", "Y", "Z", "view", "id"])
    found = ws.fit(renamed, method="dlt", unit="cm", columns={"x1": "u_left", "y1": "v_left", "x2": "u_right", "y2": "v_right"})
    assert map_of(found) == wanted


def test_models_go_through_files_bytes_and_pickles(cal, tmp_path):
    cal.save(tmp_path / "model.json")
    assert ws.load(tmp_path / "model.json") == cal
    assert ws.Calibration.from_bytes(cal.to_bytes()).to_bytes() == cal.to_bytes()
    packed = pickle.dumps(cal)
    first, second = pickle.loads(packed), pickle.loads(packed)
    assert first is second and first == cal and hash(first) == hash(cal)
    with pytest.raises(ws.errors.MalformedError):
        ws.Calibration.from_bytes(cal.to_bytes()[:-200])
    with pytest.raises(FileNotFoundError) as raised:
        ws.load(tmp_path / "none.json")
    assert pickle.loads(pickle.dumps(raised.value)).hint == raised.value.hint


def test_data_go_through_pickles():
    shown = ws.Dataset.from_arrays(
        [[0.1, 2.0, np.nan, np.nan], [-0.0, 1e-300, 5.0, 1 / 3]],
        [[1.0, 2.0, 0.1], [np.nan] * 3],
        board=[[np.nan] * 2, [0.7, -3.0]],
        views=["b", "a"],
        ids=["1", "x"],
        unit="cm",
    )
    nothing = ws.Dataset.from_arrays(np.zeros((0, 6)))
    for data in (shown, ws.synth(hand_held=4, noise=0.1), nothing):
        for other in (pickle.loads(pickle.dumps(data)), copy.deepcopy(data)):
            assert (repr(other), other.ids, other.view_names) == (repr(data), data.ids, data.view_names)
            for name in ("pixels", "points", "board", "views"):
                assert getattr(other, name).tobytes() == getattr(data, name).tobytes(), name


def test_points_are_not_given_twice(data):
    board = data.points[:, :2]
    with pytest.raises(ws.errors.ArgumentError, match="points and board are both given"):
        ws.fit(data.pixels, data.points, board=board, views=data.views)


def test_sizes_of_pictures_hold_the_pixels_and_each_other(data):
    largest = np.nanmax(data.pixels, axis=0)
    for size in ((320, 240), [(640, 480), (320, 480)], (480, 640)):
        with pytest.raises(ws.errors.ArgumentError, match=r"camera [01]: \d+ of 441 pixels lie outside of \d+ x \d+ pictures") as raised:
            ws.fit(data, method="dlt", validate=False, image_size=size)
        camera = int(str(raised.value)[7])
        x, y = largest[2 * camera : 2 * camera + 2]
        assert raised.value.hint.endswith(f"the largest x is {x:.0f}, and the largest y {y:.0f}")
    # A gross error, or another origin, is no other size.
    pixels = data.pixels.copy()
    pixels[0, :2] = 700.0
    tight = [tuple(map(int, np.floor(largest[camera : camera + 2]))) for camera in (0, 2)]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ws.DataWarning)
        cal = ws.fit(pixels, data.points, views=data.views, unit="cm", method="brown", validate=False, image_size=tight)
    assert cal.image_sizes == tight
    cal = ws.fit(data, method="brown", validate=False, image_size=[(640, 480), None])
    for contradicting in ((1280, 960), [(320, 240), None]):
        with pytest.raises(ws.errors.MismatchError, match="camera 0: the model has 640 x 480, image_size is") as raised:
            cal.rectify(image_size=contradicting)
        assert "leave image_size out" in raised.value.hint
    assert cal.rectify(image_size=(640, 480)).size == cal.rectify(image_size=[None, (640, 480)]).size


def test_pixels_alone_are_not_fitted(data):
    for call in (ws.fit, ws.compare):
        with pytest.raises(ws.errors.ArgumentError, match="pixels alone") as raised:
            call(data.pixels)
        assert "`points=`" in raised.value.hint and "`board=`" in raised.value.hint


def test_faults_are_named(data):
    assert not ws.check(data).fatal
    pixels = data.pixels
    mixed = data.views == 3
    pixels[mixed] = pixels[mixed][:, [2, 3, 0, 1]]
    found = ws.check(pixels, data.points, views=data.views, unit="cm")
    assert found.fatal and found[0].code == "cameras-swapped" and found[0].views == ("3",)
    assert "hint" in str(found)
    with pytest.raises(ws.errors.FaultyError) as raised:
        ws.fit(pixels, data.points, views=data.views, unit="cm", method="dlt")
    assert raised.value.code == "cameras-swapped" and "fix=True" in str(raised.value)
    fixed = ws.fit(pixels, data.points, views=data.views, unit="cm", method="dlt", fix=True)
    assert np.array_equal(found.repaired().pixels, data.pixels)
    assert fixed.findings[0].fixable


def test_a_baseline_is_a_length_or_a_length_and_a_tolerance(data):
    for good in (20, np.float64(20), (20.0, 0.5), [20.0, 0.5]):
        ws.check(data, expect_baseline=good)
    bad = ("20:5%", "20", (20,), (20, "5%"), (20, 0.1, 0.1), -20, (20, 0), float("nan"), True, {}, np.ones(2))
    for value in bad:
        for call in (ws.check, ws.fit):
            with pytest.raises(ws.errors.ArgumentError, match="expect_baseline cannot be") as raised:
                call(data, expect_baseline=value)
            assert "a length and a relative tolerance" in str(raised.value.hint)


def test_worthless_models_are_refused_unless_they_are_wanted(data):
    pixels = data.pixels
    pixels[:, 2:] = pixels[np.random.default_rng(1).permutation(len(pixels))][:, 2:]
    with pytest.raises(ws.WheatstoneError):
        ws.fit(pixels, data.points, views=data.views, unit="cm", method="network")
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        cal = ws.fit(pixels, data.points, views=data.views, unit="cm", method="network", force=True, keep_outliers=True)
    assert cal.broken and any(issubclass(w.category, ws.DataWarning) for w in warned)


def test_a_moved_camera_is_found(data):
    cal = ws.fit(data, method="brown")
    assert not cal.camera_motion(ws.synth(noise=0.1, seed=11)).moved
    pixels = ws.synth(noise=0.1, seed=11).pixels
    pixels[:, 3] += 1.0
    motion = cal.camera_motion(pixels, data.points, views=data.views)
    assert motion.moved and motion.changes[0].cameras[0] == 1 and motion.chance < 1e-6


def test_boards_in_the_hand():
    data = ws.synth(rig="pinhole", hand_held=12, noise=0.1)
    assert np.isnan(data.points).all() and np.isfinite(data.board).all()
    cal = ws.fit(data.pixels, board=data.board, views=data.views, unit="cm", method="brown", validate=False)
    exam = cal.evaluate(ws.synth(rig="pinhole", hand_held=6, noise=0.1, seed=4))
    assert isinstance(exam, ws.BoardEvaluation)
    assert abs(exam.length_error) < 0.05 and exam.flatness_rms < 0.5


def test_intrinsics_are_kept(data):
    cal = ws.fit(data, method="brown", validate=False)
    one = data.views == 2
    moved = ws.fit(data.pixels[one], data.points[one], unit="cm", intrinsics=cal, validate=False)
    kept, free = moved.to_opencv(), cal.to_opencv()
    assert np.array_equal(kept["K1"], free["K1"]) and np.array_equal(kept["D2"], free["D2"])


def test_a_comparison_names_the_simplest_that_is_good(data):
    found = ws.compare(data, methods=["dlt", "brown"])
    assert found.chosen == "brown" and found.methods[0].rms > found.methods[1].rms
    with pytest.raises(ws.errors.UnknownNameError, match="brwn"):
        ws.compare(data, methods=["brwn"])
    with pytest.raises(ws.errors.UnknownNameError, match="`brwn`"):
        ws.compare(data, methods="brwn")
    assert [score.method for score in ws.compare(data, methods="dlt").methods] == ["dlt"]


def test_a_report_is_one_page(cal, tmp_path):
    report = cal.report("test", held_out=False)
    report.save(tmp_path / "report.html")
    assert (tmp_path / "report.html").read_text("utf-8").lower().startswith("<!doctype html>")
    assert report.verdict and report.summary and report._repr_html_().startswith("<iframe")
    assert len(list(tmp_path.iterdir())) == 1


def test_progress_is_told_and_cancels(data):
    told = []
    ws.fit(data, method="neural-camera", progress=lambda *step: told.append(step))
    assert told and all(len(step) == 3 for step in told)

    class Enough(Exception):
        pass

    def stop(task, done, total):
        raise Enough

    with pytest.raises(Enough):
        ws.fit(data, method="neural-camera", progress=stop)


@pytest.mark.skipif(sys.platform == "win32", reason="signals are POSIX's")
def test_ctrl_c_ends_a_fit():
    code = (
        "import os, signal, threading, wheatstone as ws\n"
        "data = ws.synth(rig='bump', cameras=4)\n"
        "threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT)).start()\n"
        "try:\n"
        "    for seed in range(1000): ws.fit(data, method='network', preset='paper', seed=seed)\n"
        "except KeyboardInterrupt: print('ended')\n"
    )
    began = time.monotonic()
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    assert ended.stdout.strip() == "ended" and time.monotonic() - began < 60


@pytest.mark.parametrize("method", ["fork", "spawn", "forkserver"])
def test_models_are_safe_in_other_processes(method, cal, data):
    import multiprocessing

    cal.predict(data.pixels)
    context = multiprocessing.get_context(method)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        with context.Pool(2) as pool:
            parts = pool.map_async(cal.predict, np.array_split(data.pixels, 6)).get(timeout=120)
    assert np.array_equal(np.concatenate(parts), cal.predict(data.pixels))


@pytest.mark.skipif(not hasattr(os, "fork"), reason="forks are POSIX's")
def test_a_thread_may_fork_while_others_work(data, tmp_path):
    """A child makes its pool anew, and no lock that it needs stays with a thread of its parent."""
    path = tmp_path / "model.json"
    ws.fit(data, method="brown", validate=False).save(path)
    code = (
        "import os, sys, threading, warnings, numpy as np, wheatstone as ws\n"
        "warnings.simplefilter('ignore', DeprecationWarning)\n"
        "pixels = np.tile([[310.0, 250.0, 330.0, 250.0]], (8, 1))\n"
        "end, shared = threading.Event(), [ws.load(sys.argv[1])]\n"
        "def work():\n"
        "    while not end.is_set(): shared[0].predict(pixels)\n"
        "threads = [threading.Thread(target=work) for _ in range(4)]\n"
        "for thread in threads: thread.start()\n"
        "for _ in range(200):\n"
        "    child = os.fork()\n"
        "    if child == 0: os._exit(0 if len(shared[0].predict(pixels)) == 8 else 1)\n"
        "    assert os.waitpid(child, 0)[1] == 0\n"
        "    shared[0] = ws.load(sys.argv[1])\n"
        "end.set()\n"
        "for thread in threads: thread.join()\n"
        "print('ended')\n"
    )
    told = subprocess.run(
        [sys.executable, "-c", code, str(path)], capture_output=True, text=True, timeout=200
    )
    assert told.stdout.strip() == "ended", told.stderr


def test_the_package_needs_numpy_alone():
    code = (
        "import sys\n"
        "before = set(sys.modules)\n"
        "import numpy, wheatstone\n"
        "heavy = {'pandas', 'polars', 'pyarrow', 'sklearn', 'cv2', 'ray', 'pyspark', 'scipy'}\n"
        "print(sorted(heavy & set(sys.modules)))\n"
    )
    told = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert told.stdout.strip() == "[]"
    assert Path(ws.__file__).with_name("py.typed").exists()


def test_rows_that_stand_in_arrays_twice_are_told(data):
    rows = np.r_[np.arange(len(data)), 5, 9]
    given = {"points": data.points[rows], "views": data.views[rows], "unit": "cm"}
    with pytest.warns(ws.DataWarning, match=f"row {len(data)} is the same as row 5, and 1 more") as told:
        cal = ws.fit(data.pixels[rows], method="brown", validate=False, **given)
    assert [warning.filename for warning in told] == [__file__]
    assert len(cal.data) == len(rows)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        cal = ws.fit(data.pixels[rows], method="brown", validate=False, drop_duplicates=True, **given)
        assert np.array_equal(cal.data.pixels, data.pixels) and np.array_equal(cal.data.views, data.views)
        # Another view, another place and rows that nobody saw are no copies.
        pixels, points = np.tile(data.pixels[:1], (3, 1)), np.array([[0.0, 0, 1], [0, 0, 1], [0, 0, 2]])
        ws.Dataset.from_arrays(pixels, points, views=["a", "b", "a"])
        ws.Dataset.from_arrays(np.full((2, 4), np.nan), points[:2])


def test_two_views_leave_nothing_to_hold_out(data):
    some = data.views < 2
    given = {"points": data.points[some], "views": data.views[some], "unit": "cm"}
    assert ws.fit(data.pixels[some], method="brown", **given).validation is None
    told = str(ws.compare(data.pixels[some], methods="brown", **given))
    assert "lie on one plane" in told and "nan" not in told
