"""Pixels in, points out: the same bits whatever the array looks like, however it is cut, on any thread."""

from __future__ import annotations

import pickle
import resource
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

import wheatstone as ws

METHODS = [("brown", "paper", 2), ("dlt", "pinhole", 3), ("kannala-brandt", "fisheye", 2)]
METHODS += [("network", "paper", 2), ("neural-camera", "water", 2)]


def same(a, b):
    return np.array_equal(np.asarray(a), np.asarray(b), equal_nan=True)


@pytest.mark.parametrize(("method", "rig", "cameras"), METHODS)
def test_points_are_near_the_truth_and_error_bars_hold(method, rig, cameras, data_of, model_of):
    cal = model_of(method, rig, cameras)
    exam = ws.synth(rig=rig, cameras=cameras, noise=0.1, random=400, seed=7)
    located = cal.locate(exam.pixels, covariance=True)
    off = located.points - exam.points
    distance2 = np.einsum("ni,nij,nj->n", off, np.linalg.inv(located.covariance), off)
    within = np.mean(distance2 < 7.815)
    assert 0.88 <= within <= 0.99, within
    assert np.median(np.linalg.norm(off, axis=1)) < 0.6
    assert same(located.points, cal.predict(exam.pixels))
    variances = np.diagonal(located.covariance, axis1=1, axis2=2)
    assert np.allclose(np.sqrt(variances), located.sigmas, rtol=1e-14)


@pytest.mark.parametrize(("method", "rig", "cameras"), METHODS)
def test_a_row_depends_on_nothing_but_itself(method, rig, cameras, data_of, model_of):
    cal, pixels = model_of(method, rig, cameras), data_of(rig, cameras).pixels
    pixels = np.repeat(pixels, 40, axis=0) + np.random.default_rng(3).normal(0, 20, (40 * len(pixels), 2 * cameras))
    whole, order = cal.locate(pixels, covariance=True), np.random.default_rng(5).permutation(len(pixels))
    permuted = cal.locate(pixels[order], covariance=True)
    for name in ("points", "sigmas", "covariance", "residual", "trust", "mismatch"):
        assert same(getattr(whole, name)[order], getattr(permuted, name)), name
    before = ws.get_threads()
    try:
        for threads in (1, 3):
            ws.set_threads(threads)
            assert same(cal.locate(pixels).points, whole.points)
            assert same(cal.predict(pixels)[order], cal.predict(pixels[order]))
    finally:
        ws.set_threads(0)
    assert ws.get_threads() == before
    again = ws.Calibration.from_bytes(cal.to_bytes())
    parts = [again.predict(part) for part in np.array_split(pixels, 37)]
    assert same(np.concatenate(parts), cal.predict(pixels))


def test_arrays_of_any_form_give_the_same(cal, data):
    pixels = data.pixels
    wanted = cal.predict(pixels)
    n = len(pixels)
    padded = np.zeros((n, 9))
    padded[:, 1:9:2] = pixels
    unaligned = np.frombuffer(b"x" + pixels.tobytes(), dtype=np.uint8)[1:].view(np.float64).reshape(n, 4)
    forms = {
        "fortran": np.asfortranarray(pixels),
        "strided": padded[:, 1:9:2],
        "reversed": np.ascontiguousarray(pixels[::-1])[::-1],
        "by camera": pixels.reshape(n, 2, 2),
        "aniposelib": pixels.reshape(n, 2, 2).transpose(1, 0, 2),
        "list": pixels.tolist(),
        "big-endian": pixels.astype(">f8"),
        "unaligned": unaligned,
        "masked": np.ma.masked_array(pixels, mask=False),
        "object": pixels.astype(object),
    }
    for name, form in forms.items():
        assert same(cal.predict(form), wanted), name
        assert same(cal.locate(form).points, wanted), name
    frozen = pixels.copy()
    frozen.flags.writeable = False
    assert same(cal.predict(frozen), wanted)
    single = pixels.astype(np.float32)
    assert same(cal.predict(single), cal.predict(single.astype(np.float64)))
    whole = np.rint(pixels).astype(np.int16)
    assert same(cal.predict(whole), cal.predict(whole.astype(np.float64)))


def test_into_an_array_that_is_given(cal, data):
    out = np.empty((len(data), 3))
    assert cal.predict(data.pixels, out) is out
    assert same(out, cal.predict(data.pixels))
    for bad in (np.empty((3, len(data))).T, np.empty((len(data), 2)), np.empty((1, 3))):
        with pytest.raises(ws.errors.ArgumentError):
            cal.predict(data.pixels, bad)
    for bad in (out.astype(np.float32), out.ravel(), out.tolist()):
        with pytest.raises(ws.errors.ArgumentError) as raised:
            cal.predict(data.pixels, bad)
        assert f"C-contiguous array of float64, shape ({len(data)}, 3)" in str(raised.value)


def test_what_is_not_seen_is_not_located(cal, data):
    pixels = data.pixels[:8].copy()
    pixels[1, 0] = np.nan
    pixels[2] = np.nan
    pixels[3, 2:] = np.nan
    pixels[4, 1] = np.inf
    pixels[5, 3] = -np.inf
    located = cal.locate(pixels, covariance=True)
    lost = [False, True, True, True, True, True, False, False]
    assert np.isnan(located.points).all(axis=1).tolist() == lost
    assert np.isnan(located.sigmas).all(axis=1).tolist() == lost
    assert np.isnan(located.covariance).all(axis=(1, 2)).tolist() == lost
    assert (located.trust == ws.Trust.NOT_LOCATED).tolist() == lost
    assert not located.mismatch[lost].any()
    assert np.isfinite(located.points[[0, 6, 7]]).all()


def test_nothing_comes_of_nothing(cal):
    assert cal.predict(np.empty((0, 4))).shape == (0, 3)
    located = cal.locate(np.empty((0, 4)), covariance=True)
    assert located.points.shape == (0, 3) and located.covariance.shape == (0, 3, 3)


def test_trust_and_mismatch(cal, data):
    located = cal.locate(data.pixels)
    assert (located.trust == ws.Trust.INSIDE).mean() > 0.95
    assert located.mismatch.mean() < 0.01
    far = cal.locate(data.pixels + np.array([0, 300, 0, 300]))
    assert (far.trust == ws.Trust.OUTSIDE).mean() > 0.5
    assert cal.locate(data.pixels + np.array([0, 30, 0, -30])).mismatch.mean() > 0.95


def test_projections_and_rays_belong_together(cal, data):
    for camera in range(2):
        pixels = cal.project(data.points, camera)
        off = pixels - data.pixels[:, 2 * camera : 2 * camera + 2]
        assert np.sqrt(np.mean(off**2)) < 0.15
        origins, directions = cal.rays(pixels, camera)
        assert np.allclose(np.linalg.norm(directions, axis=1), 1, rtol=1e-12)
        to = data.points - origins
        along = np.sum(to * directions, axis=1, keepdims=True)
        assert np.abs(to - along * directions).max() < 1e-6
    with pytest.raises(ws.errors.ArgumentError):
        cal.project(data.points, 2)


def test_settings_of_the_process_are_counts():
    before = ws.get_threads()
    for bad in (-1, 2.5, "two", None):
        with pytest.raises(ws.errors.ArgumentError, match="count cannot be") as raised:
            ws.set_threads(bad)
        assert "0 is the default" in str(raised.value.hint)
        with pytest.raises(ws.errors.ArgumentError, match="times cannot be"):
            ws.raise_limits(bad)
    assert ws.get_threads() == before
    try:
        ws.set_threads(2**70)
        assert ws.get_threads() > 1
    finally:
        ws.set_threads(0)


def test_eight_threads_on_one_model(data_of, model_of):
    cal, pixels = ws.Calibration.from_bytes(model_of("brown", "paper", 2).to_bytes()), data_of("paper", 2).pixels
    pixels = np.tile(pixels, (40, 1))
    wanted = model_of("brown", "paper", 2).locate(pixels, covariance=True)

    def work(index):
        match index % 3:
            case 0:
                return same(cal.predict(pixels), wanted.points)
            case 1:
                return same(cal.locate(pixels, covariance=True).covariance, wanted.covariance)
            case _:
                return cal.to_bytes() == cal.to_bytes() and same(cal.data.pixels[:9], pixels[:9])

    with ThreadPoolExecutor(8) as pool:
        assert all(pool.map(work, range(48)))


@pytest.mark.parametrize("method", ["brown", "neural-camera"])
def test_threads_that_come_first_at_once_do_not_wait_for_each_other_for_ever(method, data_of, model_of):
    known, pixels = model_of(method, "paper", 2), np.tile(data_of("paper", 2).pixels, (20, 1))
    wanted = known.locate(pixels).points
    for _ in range(10):
        cal = ws.Calibration.from_bytes(known.to_bytes())
        with ThreadPoolExecutor(8) as pool:
            found = list(pool.map(lambda _, cal=cal: cal.locate(pixels).points, range(8)))
        assert all(same(points, wanted) for points in found)


def test_the_input_is_not_copied(cal, data):
    pixels = np.tile(data.pixels, (4000, 1))
    out = np.empty((len(pixels), 3))
    cal.predict(pixels[:1000], out[:1000])
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    cal.predict(np.asfortranarray(pixels[:10]), out[:10])
    cal.predict(pixels, out)
    more = 1024 * (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)
    # `out` is touched for the first time.
    assert more < out.nbytes + pixels.nbytes / 4


def test_errors_say_what_to_do(cal):
    with pytest.raises(ValueError, match="6 columns.*2 cameras") as raised:
        cal.predict(np.zeros((3, 6)))
    assert isinstance(raised.value, ws.WheatstoneError) and "(n, 4)" in str(raised.value.hint)
    for bad in ([[1, 2], [3]], np.zeros(4), np.zeros((2, 2, 2, 2)), np.zeros((3, 4), complex), None):
        with pytest.raises((ws.errors.ArgumentError, TypeError)):
            cal.predict(bad)
    with pytest.raises(ws.errors.MissingFileError):
        cal.predict("none.csv")
    for rate in (0, 1, -1, float("nan")):
        with pytest.raises(ws.errors.ArgumentError):
            cal.locate(np.zeros((1, 4)), false_alarm=rate)


def test_pixel_sigma_is_the_noise_of_the_pixels(cal, data):
    known = cal.locate(data.pixels, covariance=True)
    noisy = cal.locate(data.pixels, covariance=True, pixel_sigma=1.0)
    assert np.array_equal(noisy.points, known.points)
    assert (noisy.sigmas > known.sigmas).all()
    assert (np.linalg.eigvalsh(noisy.covariance) > 0).all()
    assert noisy.mismatch.sum() <= known.mismatch.sum()
    for sigma in (0.0, -0.1, float("nan"), float("inf")):
        with pytest.raises(ws.errors.ArgumentError):
            cal.locate(data.pixels, pixel_sigma=sigma)


def test_pixel_sigma_of_rows_and_of_pixels(cal, data):
    exact = ws.synth(rig="paper", noise=0.0, random=2000, seed=1)
    random, n = np.random.default_rng(2), len(exact)
    each = random.choice([0.05, 0.3, 1.0], (n, 2))
    pixels = exact.pixels + random.normal(size=(n, 4)) * each.repeat(2, axis=1)
    found = cal.locate(pixels, pixel_sigma=each)
    held = np.abs(found.points - exact.points) < found.sigmas
    for level in (0.05, 0.3, 1.0):
        own = each.max(axis=1) == level
        assert own.sum() > 150 and 0.6 < held[own].mean() < 0.76, level
    assert found.mismatch.mean() < 0.01
    # One of all is the same as that of each row and each pixel; parts of an array have the bits of the whole.
    one = cal.locate(pixels, pixel_sigma=0.5, covariance=True)
    for alike in (np.full(n, 0.5), np.full((n, 2), 0.5), np.full(n, 0.5, dtype=np.float32), [0.5] * n):
        assert same(cal.locate(pixels, pixel_sigma=alike, covariance=True).covariance, one.covariance)
    part = cal.locate(pixels[7:31].astype(np.float32), pixel_sigma=each[7:31])
    assert same(part.sigmas, cal.locate(pixels.astype(np.float32), pixel_sigma=each).sigmas[7:31])
    by_row = cal.locate(pixels, pixel_sigma=each[:, 0])
    assert same(by_row.sigmas[3], cal.locate(pixels[3:4], pixel_sigma=each[3, 0]).sigmas[0])
    assert len(cal.locate(pixels[:0], pixel_sigma=each[:0])) == 0
    # A pixel that was not seen needs none.
    pixels[4, 2:] = each[4, 1] = np.nan
    assert np.isnan(cal.locate(pixels, pixel_sigma=each).sigmas[4]).all()
    for bad in (0.0, -1.0, np.nan, np.inf):
        wrong = each.copy()
        wrong[5, 1] = bad
        with pytest.raises(ws.errors.ArgumentError, match="pixel_sigma of row 5, camera 1 is"):
            cal.locate(pixels, pixel_sigma=wrong)
    for bad in (each[:-1], each[:, :1], each.repeat(2, axis=1), [1.0, 2.0], [], {"s": 1.0}, [[1.0], 2.0], ["a"] * n):
        with pytest.raises(ws.errors.ArgumentError, match="pixel_sigma"):
            cal.locate(pixels, pixel_sigma=bad)


def test_single_values_that_are_none_are_refused(cal, data):
    """Whatever is wrong with them, by our own exceptions."""
    pixels, points = data.pixels, data.points
    half, picture = np.array([1280.0, 960.0]), np.zeros((40, 40), dtype=np.uint8)
    cases = [
        ("image_size cannot be", "(1280, 960)", lambda bad: ws.fit(data, image_size=bad), (1280, (1280.5, 960), half, (-640, 480), (0, 0), "1280x960", (2**40, 2))),
        ("image_size cannot be", "(1280, 960)", lambda bad: cal.to_opencv(image_size=bad), (1280, half, [(1280.5, 960), None])),
        ("image_size cannot be", "(1280, 960)", lambda bad: ws.Reconstructor(cal, bad), (1280, half, [(640, 480), None])),
        ("size cannot be", "width and height", lambda bad: cal.rectify(image_size=(640, 480), size=bad), (320, (320, "240"), (320, 240, 1))),
        ("focal cannot be", "in pixels", lambda bad: cal.rectify(image_size=(640, 480), focal=bad), ("a", 0, float("nan"))),
        ("cameras cannot be", "counted from 0: (0, 1)", lambda bad: cal.rectify(bad), ((0, 0), 1, (0,), (0, 1, 1))),
        ("there is no camera", "from 0 to 1", lambda bad: cal.project(points, bad), ("left", 1.0, None, -1, 2)),
        ("there is no camera", "from 0 to 1", lambda bad: cal.rectify((0, bad)), (2, 1.0, "right")),
        ("pixel_sigma cannot be", "above 0", lambda bad: cal.locate(pixels, pixel_sigma=bad), ("a", "1", True)),
        ("false_alarm cannot be", "between 0 and 1", lambda bad: cal.locate(pixels, false_alarm=bad), ("a", None, 2)),
        ("unit cannot be", '"mm"', lambda bad: ws.fit(pixels, points, unit=bad), (5, b"mm", ["mm"])),
        ("unit cannot be", '"mm"', lambda bad: ws.fit({"x1": [1.0]}, unit=bad), (5,)),
        ("stage_sigma cannot be", "above 0", lambda bad: ws.fit(data, stage_sigma=bad), ("1", 0, -1.0, float("inf"))),
        ("seed cannot be", "from 0 to 2**64 - 1", lambda bad: ws.fit(data, seed=bad), (1.5, "1", None, -1, 2**64)),
        ("intrinsics cannot be", "Calibration", lambda bad: ws.fit(data, intrinsics=bad), (5, "a", [1], [cal, None])),
        ("methods cannot be", "wheatstone.METHODS", lambda bad: ws.compare(data, methods=bad), (5, None, [1], [])),
        ("range cannot be", "(300, 1500)", lambda bad: ws.Reconstructor(cal, (640, 480), range=bad), (5, (1, "b"), (1,), "near")),
        ("region cannot be", "width and height", lambda bad: ws.Reconstructor(cal, (640, 480), region=bad), (5, (1, 2, 3), "all")),
        ("confidence cannot be", "0 to 1", lambda bad: ws.Reconstructor(cal, (640, 480), confidence=bad), ("high", [0.9])),
        ("max_sigma cannot be", "above 0", lambda bad: ws.Reconstructor(cal, (640, 480), max_sigma=bad), ("1", float("nan"))),
        ("cameras cannot be", "counted from 0", lambda bad: ws.Reconstructor(cal, (640, 480), cameras=bad), (5, "01", ())),
        ("range cannot be", "(0, 64)", lambda bad: ws.match_pair(picture, picture, bad), (5, None, (0, "b"), (1, 2, 3))),
        ("count cannot be", "above 0", lambda bad: ws.synth(count=bad), (0, "a", 1.5)),
        ("seed cannot be", "from 0 to 2**64 - 1", lambda bad: ws.synth(seed=bad), ("a", -1, None)),
        ("distances cannot be", "the step", lambda bad: ws.synth(distances=bad), (5, None, (50, 140))),
        ("epochs cannot be", "above 0", lambda bad: ws.fit(data, epochs=bad), (1.5, "1", 0, -1)),
    ]
    for problem, hint, call, values in cases:
        for bad in values:
            with pytest.raises(ws.errors.ArgumentError, match=problem) as raised:
                call(bad)
            assert hint in str(raised.value.hint), bad
    for good in (np.int64(3), np.uint8(3), np.array(3)):
        assert ws.fit(data, seed=good, method="dlt", validate=False) == ws.fit(data, seed=3, method="dlt", validate=False)
        assert len(ws.synth(count=good, seed=good)) == 3
    assert np.array_equal(cal.project(points, np.int32(1)), cal.project(points, 1))
    assert cal.to_opencv(image_size=np.array([640, 480]))["image_size"] == [(640, 480)] * 2
    assert np.array_equal(cal.locate(pixels, pixel_sigma=np.float32(0.5)).sigmas, cal.locate(pixels, pixel_sigma=0.5).sigmas)


def test_a_covariance_that_was_not_asked_for_is_an_error(cal, data):
    located = cal.locate(data.pixels[:3])
    with pytest.raises(ws.errors.ArgumentError, match="no covariance") as raised:
        located.covariance
    assert "locate(..., covariance=True)" in raised.value.hint
    # Python's own tools ask for attributes, and know this one.
    assert not hasattr(located, "covariance")
    assert pickle.loads(pickle.dumps(raised.value)).hint == raised.value.hint


def test_pixels_that_do_not_fit_the_model_are_warned_of(cal, data, recwarn):
    cal.locate(data.pixels)
    assert not recwarn.list
    noisy = data.pixels + np.random.default_rng(5).normal(0, 0.5, data.pixels.shape)
    with pytest.warns(ws.DataWarning, match="the pixels scatter by about 0.[45]"):
        cal.locate(noisy)
    with pytest.warns(ws.DataWarning, match="with cameras 1 and 2 exchanged"):
        cal.locate(data.pixels[:, [2, 3, 0, 1]])
    with pytest.warns(ws.DataWarning, match="of the first .* points have rays that do not intersect"):
        cal.locate(data.pixels + [0, 0, 0, 400])
    recwarn.clear()
    cal.locate(noisy, pixel_sigma=0.5)
    assert not recwarn.list


def test_errors_of_a_sheared_world_are_linear(cal, data):
    sheared = data.points + np.outer(data.points[:, 2] - data.points[0, 2], [0.05, 0, 0])
    found = cal.evaluate(data.pixels, sheared)
    assert found.linear["share"] > 0.9
    assert np.allclose(np.array(found.linear["slopes"])[0, 2], -0.05, atol=0.01)
    assert cal.evaluate(data).linear is None
