"""What is set for the whole process: threads, and limits of inputs."""

from __future__ import annotations

import operator

import wheatstone._wheatstone as _w
from .errors import ArgumentError

_MOST = 2**31 - 1


def _count(value: int, name: str, least: int, hint: str) -> int:
    try:
        count = operator.index(value)
    except TypeError:
        count = least - 1
    if count < least:
        raise ArgumentError(f"{name} cannot be {value!r}", hint=hint)
    return min(count, _MOST)


def set_threads(count: int) -> None:
    """Sets the number of threads that work is done on; 0 for the default.

    Raises
    ------
    ArgumentError
        For what is no whole number from 0 on.
    """
    _w.set_threads(_count(count, "count", 0, "give a whole number from 0 on; 0 is the default"))


def raise_limits(times: int) -> None:
    """Multiplies the limits of the sizes of inputs, for files of your own that are larger than usual.

    Raises
    ------
    ArgumentError
        For what is no whole number from 1 on.
    """
    _w.raise_limits(_count(times, "times", 1, "give a whole number from 1 on; 1 is the usual"))
