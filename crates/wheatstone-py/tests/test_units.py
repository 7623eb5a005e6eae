"""A Dataset has a unit of its own: another one is refused where it would be passed over, and converted where it can be."""

from __future__ import annotations

import pytest

import wheatstone as ws
from wheatstone._arguments import known_unit


def test_a_unit_that_contradicts_the_data_is_refused() -> None:
    data = ws.synth(noise=0.1, count=200)
    with pytest.raises(ws.errors.ArgumentError, match="unit is mm, and the data are in cm"):
        ws.fit(data, unit="mm", method="dlt")
    with pytest.raises(ws.errors.ArgumentError, match="leave unit out"):
        ws.check(data, unit="mm")


def test_data_in_another_unit_are_judged_in_that_of_the_model() -> None:
    data = ws.synth(noise=0.1, count=200)
    model = ws.fit(data, unit="cm", method="dlt", validate=False)
    millimetres = ws.Dataset.from_arrays(data.pixels, data.points * 10, unit="mm")
    judged = model.evaluate(millimetres)
    assert judged.unit == "cm"
    assert judged.rms == pytest.approx(model.evaluate(data).rms, rel=1e-9)
    assert not model.camera_motion(millimetres).moved


UNITS = ["um", "µm", "microns", "mm", "Millimeters", "cm", "dm", "m", "metre", "km", "in", "inch", "inches", "ft", "feet"]


@pytest.mark.parametrize("unit", UNITS)
def test_units_that_are_known_convert(unit: str) -> None:
    data = ws.synth(noise=0.1, count=60)
    model = ws.fit(data, unit="cm", method="dlt", validate=False)
    assert known_unit(unit) == unit
    try:
        model.evaluate(data.pixels, data.points, unit=unit)
    except ws.errors.FaultyError as problem:
        # These lengths are in centimetres. A unit that does not convert is a MismatchError.
        assert problem.code == "unit"


def test_the_units_that_are_named_are_those_of_the_library() -> None:
    data = ws.synth(noise=0.1, count=60)
    model = ws.fit(data, unit="cm", method="dlt", validate=False)
    with pytest.raises(ws.errors.MismatchError) as theirs:
        model.evaluate(data.pixels, data.points, unit="parsec")
    with pytest.raises(ws.errors.ArgumentError, match="unit cannot be 'parsec'") as ours:
        known_unit("parsec")
    assert ours.value.hint.removeprefix("give one of ") in theirs.value.hint
