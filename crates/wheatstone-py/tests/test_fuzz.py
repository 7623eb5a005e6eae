"""The interface under arrays of every shape, type and layout: no crash, and never a wrong answer.

``WHEATSTONE_FUZZ_SECONDS=3600 pytest tests/test_fuzz.py`` goes on for an hour, half of it for each of the two tests.
What each function is given stands in `fuzzed.py`.
"""

from __future__ import annotations

import inspect
import os
import time
import warnings

import numpy as np
import pytest

import wheatstone as ws

hypothesis = pytest.importorskip("hypothesis")
from fuzzed import CALLS, WITHOUT_ARRAYS, Given, World, arrays  # noqa: E402
from hypothesis import strategies as st  # noqa: E402

SECONDS = float(os.environ.get("WHEATSTONE_FUZZ_SECONDS", "0"))
SETTINGS = hypothesis.settings(
    max_examples=150,
    deadline=None,
    derandomize=not SECONDS,
    suppress_health_check=list(hypothesis.HealthCheck),
    database=None,
)

# A call into the module cannot be interrupted, and one example is short.
pytestmark = pytest.mark.timeout(300 + 2 * SECONDS)


def go_on(check):
    """Runs a check, again and again for half of the time that was asked for: there are two."""
    end = time.monotonic() + SECONDS / 2
    check()
    while time.monotonic() < end:
        check()


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
            with pytest.raises(ws.errors.ArgumentError):
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


def test_every_function(cal, tmp_path):
    world = World(cal, tmp_path)

    @hypothesis.settings(SETTINGS, max_examples=400)
    @hypothesis.given(st.sampled_from(sorted(CALLS)), st.data())
    def check(name, data):
        given = Given(data)
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            try:
                CALLS[name](world, given)
            except ws.WheatstoneError as problem:
                assert problem.args[0], name
        assert given.untouched(), f"{name} wrote to its arguments"

    go_on(check)


def test_every_function_is_fuzzed():
    public = {name for name in ws.__all__ if inspect.isfunction(getattr(ws, name)) or inspect.ismethod(getattr(ws, name))}
    public |= {
        f"{kind.__name__}.{name}"
        for kind in (ws.Calibration, ws.Chart, ws.Dataset, ws.Reconstructor)
        for name in dir(kind)
        if name[0] != "_" and callable(getattr(kind, name))
    }
    assert public - set(CALLS) == WITHOUT_ARRAYS
