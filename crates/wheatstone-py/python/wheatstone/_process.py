"""What is set for the whole process: threads, and limits of inputs."""

from __future__ import annotations

import wheatstone._wheatstone as _w
from ._arguments import whole

_MOST = 2**31 - 1


def set_threads(count: int) -> None:
    """Sets the number of threads that work is done on.

    Parameters
    ----------
    count : int
        From 0 on; 0 for the default: that of ``WHEATSTONE_THREADS``, or one a processor.

    Raises
    ------
    ArgumentError
        For what is no whole number from 0 on.
    """
    found = whole(count, "count", "give a whole number from 0 on; 0 is the default")
    _w.set_threads(min(found, _MOST))


def raise_limits(times: int) -> None:
    """Multiplies the limits of the sizes of inputs, for files of your own that are larger than usual.

    Parameters
    ----------
    times : int
        From 1 on; 1 for the usual ones.

    Raises
    ------
    ArgumentError
        For what is no whole number from 1 on.
    """
    found = whole(times, "times", "give a whole number from 1 on; 1 is the usual", least=1)
    _w.raise_limits(min(found, _MOST))
