"""The scikit-learn estimator: scikit-learn's own checks, cross-validation, pipelines, copies."""

from __future__ import annotations

import pickle
import warnings

import numpy as np
import pytest

pytest.importorskip("sklearn", minversion="1.6")

import sklearn
from sklearn.base import clone
from sklearn.model_selection import GridSearchCV, LeaveOneGroupOut, cross_val_score
from sklearn.multioutput import MultiOutputRegressor
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import FunctionTransformer
from sklearn.utils.estimator_checks import check_estimator

import wheatstone as ws
from wheatstone.sklearn import EXPECTED_FAILED_CHECKS, StereoRegressor


@pytest.fixture(scope="module")
def data() -> ws.Dataset:
    return ws.synth(rig="paper", noise=0.1, count=300)


@pytest.fixture
def regressor() -> StereoRegressor:
    return StereoRegressor(method="brown", unit="cm")


def test_passes_the_checks_of_scikit_learn() -> None:
    assert len(EXPECTED_FAILED_CHECKS) <= 3
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        results = check_estimator(
            StereoRegressor(), expected_failed_checks=EXPECTED_FAILED_CHECKS, on_fail=None
        )
    failed = {row["check_name"]: row["exception"] for row in results if row["status"] == "failed"}
    assert not failed
    assert sum(row["status"] == "passed" for row in results) > 40


def test_predicts_what_the_calibration_does(data: ws.Dataset, regressor: StereoRegressor) -> None:
    regressor.fit(data.pixels, data.points, groups=data.views)
    calibration = ws.fit(
        data.pixels, data.points, views=data.views, unit="cm", method="brown", validate=False
    )
    assert regressor.calibration_ == calibration
    assert regressor.n_features_in_ == 4
    assert regressor.affine_ is None
    points, sigmas = regressor.predict(data.pixels, return_std=True)
    assert points.tobytes() == calibration.predict(data.pixels).tobytes()
    assert sigmas.tobytes() == calibration.locate(data.pixels).sigmas.tobytes()
    assert regressor.score(data.pixels, data.points) > 0.99


def test_a_point_that_was_not_located_lowers_the_score(
    data: ws.Dataset, regressor: StereoRegressor
) -> None:
    regressor.fit(data.pixels, data.points)
    whole = regressor.score(data.pixels, data.points)
    some = data.pixels.copy()
    some[::3, 2:] = np.nan
    points = regressor.predict(some)
    assert np.isnan(points[::3]).all() and not np.isnan(points[1::3]).any()
    score = regressor.score(some, data.points)
    assert 0.4 < score < whole - 0.2
    weights = np.ones(len(some))
    weights[::3] = 0.0
    assert regressor.score(some, data.points, sample_weight=weights) > 0.99
    nothing = np.full_like(some, np.nan)
    assert regressor.score(nothing, data.points) == pytest.approx(0.0)


def test_fits_rows_that_a_camera_did_not_see(data: ws.Dataset, regressor: StereoRegressor) -> None:
    some = data.pixels.copy()
    some[:20, 2:] = np.nan
    regressor.fit(some, data.points)
    assert regressor.score(some[20:], data.points[20:]) > 0.99


def test_cross_validation_leaves_out_views(data: ws.Dataset, regressor: StereoRegressor) -> None:
    scores = cross_val_score(
        regressor, data.pixels, data.points, groups=data.views, cv=LeaveOneGroupOut(), error_score="raise"
    )
    assert len(scores) == len(data.view_names)
    assert scores.min() > 0.9


def test_groups_are_routed_to_the_fit(data: ws.Dataset, regressor: StereoRegressor) -> None:
    with sklearn.config_context(enable_metadata_routing=True):
        regressor.set_fit_request(groups=True)
        scores = cross_val_score(
            regressor,
            data.pixels,
            data.points,
            params={"groups": data.views},
            cv=LeaveOneGroupOut(),
            error_score="raise",
        )
    assert len(scores) == len(data.view_names)


def test_methods_are_searched(data: ws.Dataset, regressor: StereoRegressor) -> None:
    search = GridSearchCV(regressor, {"method": ["dlt", "brown"]}, cv=LeaveOneGroupOut())
    search.fit(data.pixels, data.points, groups=data.views)
    assert search.best_params_["method"] in ("dlt", "brown")
    assert np.isfinite(search.cv_results_["mean_test_score"]).all()


def test_works_in_a_pipeline(data: ws.Dataset, regressor: StereoRegressor) -> None:
    shift = FunctionTransformer(lambda pixels: pixels + 0.5)
    pipeline = make_pipeline(shift, regressor)
    scores = cross_val_score(
        pipeline, data.pixels, data.points, groups=data.views, cv=LeaveOneGroupOut(), error_score="raise"
    )
    assert scores.min() > 0.9
    pipeline.fit(data.pixels, data.points, stereoregressor__groups=data.views)
    points, sigmas = pipeline.predict(data.pixels, return_std=True)
    assert points.shape == sigmas.shape == (len(data), 3)


def test_clones_and_pickles(data: ws.Dataset, regressor: StereoRegressor) -> None:
    regressor.fit(data.pixels, data.points)
    again = clone(regressor)
    assert again.get_params() == regressor.get_params()
    assert not hasattr(again, "calibration_")
    kept = pickle.loads(pickle.dumps(regressor))
    assert kept.predict(data.pixels).tobytes() == regressor.predict(data.pixels).tobytes()


@pytest.mark.parametrize("state", [None, np.random.RandomState(3), np.int64(3)])
def test_takes_any_random_state(data: ws.Dataset, state: object) -> None:
    regressor = StereoRegressor("dlt", unit="cm", random_state=state)  # type: ignore[arg-type]
    assert regressor.fit(data.pixels, data.points).score(data.pixels, data.points) > 0.99


def test_columns_with_names_may_stand_in_any_order(data: ws.Dataset, regressor: StereoRegressor) -> None:
    pd, pl, pa = (pytest.importorskip(name) for name in ("pandas", "polars", "pyarrow"))
    names = ["x1", "y1", "x2", "y2"]
    ours = pd.DataFrame(data.pixels, columns=names)
    mixed = ours.assign(key=1.0)[["y2", "x1", "key", "x2", "y1"]]
    wanted = regressor.fit(data.pixels, data.points).predict(data.pixels)
    for kind in (lambda frame: frame, pl.from_pandas, pa.Table.from_pandas):
        assert np.array_equal(regressor.fit(kind(mixed), data.points).predict(kind(ours)), wanted)
        assert np.array_equal(regressor.predict(kind(mixed)), wanted)
        assert np.array_equal(regressor.fit(kind(ours), data.points).predict(kind(mixed)), wanted)
        assert regressor.score(kind(mixed), data.points) > 0.99
    assert regressor.fit(mixed, data.points).feature_names_in_.tolist() == names
    sides = ours.set_axis(["left_x", "left_y", "right_x", "right_y"], axis=1)
    assert np.array_equal(regressor.fit(sides, data.points).predict(sides[sides.columns[::-1]]), wanted)
    # Names of anything else are scikit-learn's business.
    other = ours.set_axis(["a", "b", "c", "d"], axis=1)
    assert np.array_equal(regressor.fit(other, data.points).predict(other), wanted)
    with pytest.raises(ValueError, match="feature names"):
        regressor.predict(other[["b", "a", "d", "c"]])


def test_refuses_data_that_are_no_matched_pixels(
    data: ws.Dataset,
) -> None:
    regressor = StereoRegressor("brown", unit="cm", fallback=None)
    with pytest.raises(ValueError, match="3 columns"):
        regressor.fit(data.pixels[:, :3], data.points)
    with pytest.raises(ValueError, match=r"shape \(300, 2\)"):
        regressor.fit(data.pixels, data.points[:, :2])
    with pytest.raises(ws.errors.FaultyError, match="one plane"):
        regressor.fit(data.pixels[:4], data.points[:4])
    with pytest.raises(ws.errors.UnknownNameError):
        StereoRegressor("no-such-method").fit(data.pixels, data.points)


def test_an_affine_map_where_there_is_no_camera(data: ws.Dataset) -> None:
    regressor = StereoRegressor("brown")
    with pytest.warns(ws.DataWarning, match="affine map"):
        regressor.fit(data.pixels[:, :3], data.points)
    assert regressor.calibration_ is None
    assert regressor.affine_ is not None and regressor.affine_.shape == (4, 3)
    pixels = data.pixels[:, :3].copy()
    pixels[0, 2] = np.nan
    points, sigmas = regressor.predict(pixels, return_std=True)
    assert np.isnan(points[0]).all() and np.isnan(sigmas[0]).all()
    errors = np.abs(points[1:] - data.points[1:])
    assert 0.5 < np.mean(errors < sigmas[1:]) < 0.9
    with pytest.raises(ValueError, match="no row"):
        regressor.fit(np.full((5, 3), np.nan), data.points[:5])


def test_what_is_predicted_has_the_shape_of_y(data: ws.Dataset) -> None:
    regressor = StereoRegressor("brown")
    for y in (data.points[:, 2], data.points[:, 2:], data.points[:, 1:]):
        with pytest.warns(ws.DataWarning, match="affine map"):
            regressor.fit(data.pixels, y)
        points, sigmas = regressor.predict(data.pixels, return_std=True)
        assert points.shape == sigmas.shape == regressor.predict(data.pixels).shape == y.shape
        assert regressor.score(data.pixels, y) > 0.8
    regressor.fit(data.pixels, data.points)
    assert regressor.predict(data.pixels).shape == data.points.shape


def test_one_regressor_an_output(data: ws.Dataset) -> None:
    with pytest.warns(ws.DataWarning, match="affine map"):
        several = MultiOutputRegressor(StereoRegressor("brown")).fit(data.pixels, data.points)
    assert several.predict(data.pixels).shape == data.points.shape
