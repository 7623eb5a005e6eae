"""The interface under arrays of every shape, type and layout: no crash, and never a wrong answer.

``WHEATSTONE_FUZZ_SECONDS=3600 pytest tests/test_fuzz.py`` goes on for an hour, half of it for each of the two tests.
"""

from __future__ import annotations

import os
import time

import numpy as np
import pytest

import wheatstone as ws

hypothesis = pytest.importorskip("hypothesis")
from hypothesis import strategies as st  # noqa: E402
from hypothesis.extra import numpy as hnp  # noqa: E402

SECONDS = float(os.environ.get("WHEATSTONE_FUZZ_SECONDS", "0"))
SETTINGS = hypothesis.settings(
    max_examples=150,
    deadline=None,
    derandomize=not SECONDS,
    suppress_health_check=list(hypothesis.HealthCheck),
    database=None,
)

DTYPES = st.one_of(
    hnp.floating_dtypes(), hnp.integer_dtypes(), hnp.unsigned_integer_dtypes(), hnp.boolean_dtypes()
)
SHAPES = st.one_of(
    st.tuples(st.integers(0, 70), st.just(4)),
    st.tuples(st.integers(0, 9), st.just(2), st.just(2)),
    st.tuples(st.just(2), st.integers(0, 9), st.just(2)),
    hnp.array_shapes(min_dims=0, max_dims=4, min_side=0, max_side=6),
)


def go_on(check):
    """Runs a check, again and again for half of the time that was asked for: there are two."""
    end = time.monotonic() + SECONDS / 2
    check()
    while time.monotonic() < end:
        check()


@st.composite
def arrays(draw):
    """An array of any type, with any strides."""
    dtype = draw(DTYPES)
    array = draw(hnp.arrays(dtype, draw(SHAPES)))
    if array.dtype.kind == "f" and array.size and draw(st.booleans()):
        # Near the pixels of the model, with what no camera saw.
        near = np.random.default_rng(draw(st.integers(0, 99))).uniform(-200, 900, array.shape)
        near[near > 850] = np.nan
        array = near.astype(dtype)
    layout = draw(st.sampled_from(["C", "F", "strided", "reversed", "frozen", "swapped", "list"]))
    if layout == "F":
        array = np.asfortranarray(array)
    elif layout == "strided" and array.ndim:
        array = np.repeat(array, 2, axis=-1)[..., ::2]
    elif layout == "reversed" and array.ndim:
        array = np.ascontiguousarray(array[::-1])[::-1]
    elif layout == "frozen":
        array = array.copy()
        array.flags.writeable = False
    elif layout == "swapped":
        array = array.astype(array.dtype.newbyteorder())
    elif layout == "list":
        return array.tolist()
    return array


def columns(array) -> np.ndarray | None:
    """What the array means, worked out in the plainest way; None where it means nothing."""
    plain = np.asarray(array)
    if plain.dtype.kind not in "fiub":
        return None
    plain = plain.astype(np.float64)
    if plain.ndim == 3 and plain.shape[2] == 2:
        if plain.shape[1] != 2 and plain.shape[0] == 2:
            plain = np.stack([plain[0], plain[1]], axis=1)
        plain = plain.reshape(plain.shape[0], plain.shape[1] * 2)
    if plain.ndim != 2 or plain.shape[1] != 4:
        return None
    for pair in (plain[:, 0:2], plain[:, 2:4]):
        pair[~np.isfinite(pair).all(axis=1)] = np.nan
    return plain


def test_predict_and_locate(cal):
    @SETTINGS
    @hypothesis.given(arrays())
    def check(array):
        meant = columns(array)
        if meant is None:
            with pytest.raises((ws.errors.ArgumentError, TypeError)):
                cal.predict(array)
            return
        with np.errstate(all="ignore"):
            points, located = cal.predict(array), cal.locate(array, covariance=True)
        assert points.shape == (len(meant), 3) == located.points.shape
        for row, pixels in enumerate(meant):
            alone = cal.predict(pixels[None])[0]
            assert np.array_equal(alone, points[row], equal_nan=True)
            lost = np.isnan(pixels).any()
            assert not lost or np.isnan(points[row]).all()
            if np.isfinite(located.points[row]).all() and located.trust[row] != ws.Trust.OUTSIDE:
                assert np.linalg.norm(located.points[row] - points[row]) <= 0.02 * np.linalg.norm(located.sigmas[row])

    go_on(check)


def test_data_and_pictures():
    @SETTINGS
    @hypothesis.given(arrays(), arrays(), st.sampled_from(["dlt", "brown"]))
    def check(pixels, points, method):
        for attempt in (
            lambda: ws.fit(pixels, points, method=method, validate=False, force=True),
            lambda: ws.detect(pixels, ws.Chart.chessboard(4, 3, 10.0)),
            lambda: ws.Dataset.from_arrays(pixels, board=points),
            lambda: ws.Calibration.from_bytes(np.asarray(pixels).tobytes()),
        ):
            try:
                attempt()
            except (ws.WheatstoneError, TypeError):
                pass

    go_on(check)
