"""What every function of the package is given at random: arrays of any kind where arrays belong, and values of any kind
where numbers, sizes and pairs belong. All of it is taken, or refused with an error of the package's own."""

from __future__ import annotations

import copy
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

import wheatstone as ws

DTYPES = st.one_of(
    hnp.floating_dtypes(), hnp.integer_dtypes(), hnp.unsigned_integer_dtypes(), hnp.boolean_dtypes()
)
SHAPES = st.one_of(
    st.tuples(st.integers(0, 70), st.sampled_from([4, 4, 4, 3, 2])),
    st.tuples(st.integers(0, 9), st.just(2), st.just(2)),
    st.tuples(st.just(2), st.integers(0, 9), st.just(2)),
    hnp.array_shapes(min_dims=0, max_dims=4, min_side=0, max_side=6),
)


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


VALUES = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-3, 9),
    st.sampled_from([2**31, -(2**40), 2**63, 2**64, 10**30]),
    st.floats(-10.0, 100.0),
    st.sampled_from([np.nan, np.inf, -np.inf, 0.0, -0.0, 1e-320, 1e308]),
    st.sampled_from([np.float32(0.5), np.int8(1), np.uint64(2**64 - 1), np.bool_(True), np.array(2), np.array([1.0])]),
    st.sampled_from(["", "1", "mm", 1j, (), [], (0, 1), [1, 0], (640, 480), (0.5, 2.0), {}, {"x": 1}, b"1", object]),
    st.lists(st.integers(-1, 5) | st.floats(), max_size=5),
    st.tuples(st.integers(-2, 900), st.integers(-2, 900)),
)
"""Where a number, a pair or a size belongs."""

SMALL = st.integers(-1, 12) | st.sampled_from([np.nan, np.inf, "3", None, 2.5, np.int64(4), np.array(3), [3]])
"""Where a count belongs that much would be made of."""


@dataclass
class World:
    """What functions need beside what they are given."""

    cal: ws.Calibration
    folder: Path

    def rows(self, given: Given) -> tuple[Any, Any, Any]:
        """Pixels, points and views that the model was fitted to, or some of them, a little damaged and laid out anyhow."""
        own = self.cal.data
        step, dtype = given(st.integers(1, 90)), given(st.sampled_from(["f8", "f4", ">f8", "f2"]))
        pixels, points = own.pixels[::step].astype(dtype), own.points[::step].astype(dtype)
        for array in (pixels, points):
            for row in given(st.lists(st.integers(0, len(array) - 1), max_size=2)):
                array[row, given(st.integers(0, 2)) :] = given(st.sampled_from([np.nan, np.inf, 0.0, -1.0, 6e4]))
        if given(st.booleans()):
            pixels, points = np.asfortranarray(pixels), points[::-1][::-1]
        return pixels, points, own.views[::step]


class Given:
    """Draws what a function is given, and knows whether it wrote to that."""

    def __init__(self, data: Any) -> None:
        self.data = data
        self.drawn: list[tuple[Any, Any]] = []

    def __call__(self, strategy: Any) -> Any:
        value = self.data.draw(strategy)
        if isinstance(value, np.ndarray):
            self.drawn.append((value, copy.deepcopy(value)))
        return value

    def array(self) -> Any:
        return self(arrays())

    def maybe(self) -> Any:
        return self(st.none() | arrays())

    def value(self) -> Any:
        return self(VALUES)

    def named(self, *names: str) -> dict[str, Any]:
        """Some of these arguments."""
        return {name: self(VALUES) for name in names if self(st.booleans())}

    def untouched(self) -> bool:
        return all(np.array_equal(now, then, equal_nan=now.dtype.kind in "fc") for now, then in self.drawn)

    def pixels(self, rows: int, cameras: int = 2) -> Any:
        seed = self(st.integers(0, 99))
        return np.random.default_rng(seed).uniform(0, 600, (rows, 2 * cameras))

    def labels(self, rows: int) -> Any:
        return self(st.none() | st.lists(st.integers(0, 3) | st.text(max_size=2), min_size=rows, max_size=rows) | VALUES)

    def image(self, side: int = 40) -> Any:
        dtype = self(st.sampled_from(["u1", "u2", "f4", "f8", "i8", "?", ">f4", "c8", "U1"]))
        shape = self(st.sampled_from([(side, side), (side, side, 3), (0, 0), (1, 1), (3,), (side, side, 4), (2, side, 1)]))
        if dtype == "U1":
            return np.full(shape, "a")
        return np.random.default_rng(self(st.integers(0, 9))).uniform(0, 250, shape).astype(dtype)


def data(world: World, given: Given) -> tuple[Any, dict[str, Any]]:
    """Pixels, and points, a board or neither: of any kind, nearly right, or right."""
    if given(st.booleans()):
        pixels, points, views = world.rows(given)
        return pixels, {"points": points, "views": views}
    if given(st.booleans()):
        return given.array(), {"points": given.maybe(), "views": given(st.none() | arrays() | VALUES)}
    rows = given(st.sampled_from([0, 1, 2, 7, 30]))
    pixels = given.pixels(rows)
    where = np.random.default_rng(rows).normal(size=(rows, 3)) * given(st.sampled_from([1.0, 1e-200, 1e200, 0.0, 1e9]))
    if given(st.booleans()):
        return pixels, {"points": where, "views": given.labels(rows)}
    return pixels, {"board": where[:, :2], "views": given.labels(rows)}


def frames(given: Given) -> dict[str, Any]:
    return {name: given.array() for name in given(st.lists(st.sampled_from(COLUMNS), max_size=9))}


COLUMNS = ["x1", "y1", "x2", "y2", "X", "Y", "Z", "view", "id", "board_x", "board_y", "u_left", ""]
CALISCOPE = ["sync_index", "cam_id", "keypoint_id", "img_loc_x", "img_loc_y", "board_loc_x", "board_loc_y", "object_id"]


def fit(world: World, given: Given) -> None:
    pixels, others = data(world, given)
    settings = given.named("seed", "stage_sigma", "expect_baseline", "intrinsics", "image_size", "epochs")
    method = given(st.sampled_from(["dlt", "brown", "soloff"]))
    ws.fit(pixels, **others, **settings, method=method, validate=False, force=given(st.booleans()), drop_duplicates=True)


def predict(world: World, given: Given) -> None:
    world.cal.predict(given.array(), out=given(st.none() | VALUES))


def locate(world: World, given: Given) -> None:
    located = world.cal.locate(given.array(), **given.named("false_alarm", "pixel_sigma"))
    assert located.sigmas.shape == located.points.shape == (len(located), 3)


def project(world: World, given: Given) -> None:
    array = given.array()
    seen = world.cal.project(array, given(st.sampled_from([0, 1]) | VALUES))
    assert seen.shape == (len(array), 2)


def rays(world: World, given: Given) -> None:
    array = given.array()
    origins, directions = world.cal.rays(array, given(st.sampled_from([0, 1]) | VALUES))
    assert origins.shape == directions.shape == (len(array), 3)


def evaluate(world: World, given: Given) -> None:
    pixels, others = data(world, given)
    found = world.cal.evaluate(pixels, **others, align=given(st.booleans()))
    assert found.located <= found.n <= len(np.asarray(pixels).reshape(-1, 4))


def camera_motion(world: World, given: Given) -> None:
    pixels, others = data(world, given)
    world.cal.camera_motion(pixels, **others)


def check(world: World, given: Given) -> None:
    pixels, others = data(world, given)
    ws.check(pixels, **others, **given.named("expect_baseline"))


def compare(world: World, given: Given) -> None:
    pixels, others = data(world, given)
    methods = given(st.just("dlt") | VALUES)
    ws.compare(pixels, **others, methods=methods, **given.named("seed", "stage_sigma"))


def from_arrays(world: World, given: Given) -> None:
    pixels, others = data(world, given)
    made = ws.Dataset.from_arrays(pixels, **others, drop_duplicates=given(st.booleans()))
    assert made.pixels.shape == (len(made), 2 * made.cameras)
    if np.ndim(pixels) == 2 and len(made) == len(pixels):
        plain = np.asarray(pixels, dtype=np.float64)
        assert np.array_equal(made.pixels, plain, equal_nan=True)


def locate_arrow(world: World, given: Given) -> None:
    if given(st.booleans()):
        world.cal.locate_arrow(frames(given), **given.named("false_alarm"))
        return
    pixels, _, _ = world.rows(given)
    table = dict(zip(COLUMNS, pixels.T))
    located = world.cal.locate_arrow(table, **given.named("false_alarm"))
    X = located["X"].to_numpy(zero_copy_only=False)
    assert np.array_equal(X, world.cal.predict(pixels)[:, 0], equal_nan=True)


def tables(world: World, given: Given) -> None:
    for function in (world.cal.predict, ws.check, ws.Dataset.from_arrays, ws.read_caliscope):
        try:
            function(frames(given))
        except ws.WheatstoneError:
            pass


def read_caliscope(world: World, given: Given) -> None:
    rows = given(st.integers(0, 6))
    kinds = st.sampled_from([np.arange(rows), np.zeros(rows), np.full(rows, np.nan), np.arange(rows + 1), ["a"] * rows])
    ws.read_caliscope({name: given(kinds | arrays()) for name in CALISCOPE[: given(st.integers(0, 8))]})


def from_opencv(world: World, given: Given) -> None:
    camera = np.array([[800.0, 0, 320], [0, 800, 240], [0, 0, 1]])
    right = [camera, np.zeros(5), camera, np.zeros(5), np.eye(3), np.array([-60.0, 0, 0])]
    mixed = [given(st.just(one) | arrays() | VALUES) for one in right]
    ws.from_opencv(*mixed, **given.named("image_size", "pixel_sigma"))


def rectify(world: World, given: Given) -> None:
    sizes = st.none() | st.tuples(st.integers(-1, 90), st.integers(-1, 90)) | st.sampled_from([5, "a", (1, 2, 3), (2.5, 3)])
    cameras = given(st.just((0, 1)) | VALUES)
    world.cal.rectify(cameras, image_size=given(sizes), size=given(sizes), **given.named("focal"))


def reconstructor(world: World, given: Given) -> ws.Reconstructor:
    named = given.named("cameras", "range", "confidence", "max_sigma", "region")
    return ws.Reconstructor(world.cal, given(st.just((40, 40)) | VALUES), **named, sparse=given(st.booleans()))


def reconstruct(world: World, given: Given) -> None:
    named = given.named("cameras", "range", "confidence", "max_sigma", "region")
    ws.reconstruct(world.cal, [given.image(), given.image()], **named, force=True)


def chart(world: World, given: Given) -> None:
    kind = given(st.sampled_from(["chessboard", "charuco", "dots", "lines", "april_grid"]))
    numbers = [given(SMALL), given(SMALL), given(VALUES)]
    if kind in ("charuco", "april_grid"):
        numbers.append(given(VALUES))
    made = getattr(ws.Chart, kind)(*numbers)
    assert made.points.shape[1] == 3
    ws.detect(given.image(), made)


def detect_all(world: World, given: Given) -> None:
    pictures = given(st.sampled_from([[[], []], [[None], [None]], [None], 5, "a", [5], [[given.image()], [given.image()]]]))
    board = ws.Chart.chessboard(4, 3, 10.0)
    ws.detect_all(pictures, board, **given.named("views", "translations", "rotations"))


def set_threads(world: World, given: Given) -> None:
    try:
        ws.set_threads(given(SMALL))
    finally:
        ws.set_threads(0)


def raise_limits(world: World, given: Given) -> None:
    try:
        ws.raise_limits(given(VALUES))
    finally:
        ws.raise_limits(1)


CALLS: dict[str, Callable[[World, Given], object]] = {
    "Calibration.camera_motion": camera_motion,
    "Calibration.evaluate": evaluate,
    "Calibration.export": lambda w, g: w.cal.export("opencv", w.folder / "out.yml", **g.named("image_size")),
    "Calibration.from_bytes": lambda w, g: ws.Calibration.from_bytes(np.asarray(g.array()).tobytes()),
    "Calibration.locate": locate,
    "Calibration.locate_arrow": locate_arrow,
    "Calibration.predict": predict,
    "Calibration.project": project,
    "Calibration.rays": rays,
    "Calibration.rectify": rectify,
    "Calibration.to_opencv": lambda w, g: w.cal.to_opencv(fisheye=g(st.booleans()), **g.named("image_size")),
    "Chart.april_grid": chart,
    "Chart.charuco": chart,
    "Chart.chessboard": chart,
    "Chart.dots": chart,
    "Chart.lines": chart,
    "Chart.of_points": lambda w, g: ws.Chart.of_points(g.array(), **g.named("diameter")),
    "Dataset.from_arrays": from_arrays,
    "Reconstructor.fuse": lambda w, g: reconstructor(w, g).fuse([[g.image(), g.image()]]),
    "Reconstructor.locate": lambda w, g: reconstructor(w, g).locate(g.array(), [g.image(), g.image()], sigma=g.value()),
    "Reconstructor.reconstruct": lambda w, g: reconstructor(w, g).reconstruct([g.image(), g.image()], force=True),
    "calibrate": detect_all,
    "check": check,
    "compare": compare,
    "detect": lambda w, g: ws.detect(g.array(), ws.Chart.chessboard(4, 3, 10.0)),
    "detect_all": detect_all,
    "fit": fit,
    "from_opencv": from_opencv,
    "match_pair": lambda w, g: ws.match_pair(g.image(), g.image(), g(st.just((0, 8)) | VALUES)),
    "raise_limits": raise_limits,
    "read_caliscope": read_caliscope,
    "read_cameras": lambda w, g: ws.read_cameras(w.folder / "none.yml", **g.named("image_size", "pixel_sigma")),
    "reconstruct": reconstruct,
    "rectify": rectify,
    "set_threads": set_threads,
    "synth": lambda w, g: ws.synth(
        count=g(SMALL), random=g(SMALL), hand_held=g(SMALL), cameras=g(SMALL), distances=g(st.just((50, 140, 45)) | VALUES)
    ),
    "tables": tables,
}
"""How each is called, by its name."""

WITHOUT_ARRAYS = {
    "Calibration.load",
    "Calibration.located_schema",
    "Calibration.relative",
    "Calibration.report",
    "Calibration.save",
    "Calibration.to_bytes",
    "Dataset.save",
    "load",
    "read",
    "report",
    "synth_capture",
}
"""What takes no array and no number: paths, switches and objects of the package."""
