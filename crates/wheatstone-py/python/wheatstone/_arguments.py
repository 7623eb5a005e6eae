"""Single values that users hand over, as numbers and names."""

from __future__ import annotations

import math
import operator
import re
from numbers import Real
from typing import Any

from .errors import ArgumentError


def refused(name: str, value: object, hint: str) -> ArgumentError:
    """The error for an argument that cannot be what it is."""
    return ArgumentError(f"{name} cannot be {value!r}", hint=hint)


def items(value: Any) -> list[Any]:
    """The items of a sequence; none of what is no sequence, or text."""
    try:
        return [] if isinstance(value, str) else list(value)
    except TypeError:
        return []


def is_whole(value: Any, least: int = 0) -> bool:
    """Whether it is a whole number of Python or NumPy, from `least` on."""
    try:
        return operator.index(value) >= least
    except TypeError:
        return False


def whole(value: Any, name: str, hint: str, least: int = 0) -> int:
    """A whole number from `least` on."""
    if not is_whole(value, least):
        raise refused(name, value, hint)
    return operator.index(value)


def number(value: Any) -> float:
    """A number as a float; NaN for what is none."""
    if getattr(value, "shape", None) == ():
        value = value[()]
    if isinstance(value, bool) or not isinstance(value, Real):
        return math.nan
    try:
        return float(value)
    except OverflowError:
        return math.inf


def positive(value: Any, name: str, hint: str) -> float:
    """A finite number above 0."""
    found = number(value)
    if not 0.0 < found < math.inf:
        raise refused(name, value, hint)
    return found


def finite(value: Any, name: str, hint: str) -> float:
    """A finite number."""
    found = number(value)
    if not math.isfinite(found):
        raise refused(name, value, hint)
    return found


def several(value: Any, count: int, name: str, hint: str) -> list[float]:
    """So many finite numbers."""
    found = [number(item) for item in items(value)]
    if len(found) != count or not all(map(math.isfinite, found)):
        raise refused(name, value, hint)
    return found


def several_whole(value: Any, count: int, name: str, hint: str) -> list[int]:
    """So many whole numbers; 3.0 is one, too."""
    found = several(value, count, name, hint)
    if not all(item.is_integer() and abs(item) < 2**31 for item in found):
        raise refused(name, value, hint)
    return [int(item) for item in found]


def share(value: Any, name: str) -> float:
    """A number between 0 and 1."""
    found = number(value)
    if not 0.0 < found < 1.0:
        raise refused(name, value, "give a value between 0 and 1")
    return found


def camera_number(value: Any, cameras: int) -> int:
    """The number of one of so many cameras, from 0."""
    if not (is_whole(value) and value < cameras):
        raise ArgumentError(
            f"there is no camera {value!r}", hint=f"cameras count from 0 to {cameras - 1}"
        )
    return int(value)


def unit_name(value: Any) -> str | None:
    """A unit's name, or None for none."""
    if value is None or isinstance(value, str):
        return value
    raise refused("unit", value, 'give its name, such as "mm"')


_SHORT = ("um", "mm", "cm", "dm", "m", "km", "in", "ft")
"""The units that the library converts into each other."""

_LONG = re.compile(r'[µμ]m|microns?|((micro|milli|centi|deci|kilo)?met(er|re)|inch(e)?)s?|"|foot|feet', re.IGNORECASE)
"""Other names of these."""


def known_unit(value: Any) -> str:
    """The name of a unit of length that converts into others."""
    if isinstance(value, str) and (value in _SHORT or _LONG.fullmatch(value)):
        return value
    raise refused("unit", value, f"give one of {', '.join(_SHORT)}")
