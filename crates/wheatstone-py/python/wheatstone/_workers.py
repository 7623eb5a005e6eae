"""What workers of an engine share: the model as bytes, loaded once a process, and the number of threads."""

# pyright: basic
# What it builds on has no types.

from __future__ import annotations

import functools
import os
from typing import Union

from ._arrays import PathLike
from .calibration import Calibration
from .errors import ArgumentError

Model = Union[Calibration, bytes, PathLike]
"""A fitted model, the content of its file, or the path of the file."""


def model_bytes(model: Model) -> bytes:
    """The content of the model file. A path is read here, so that workers need not see it."""
    if isinstance(model, Calibration):
        return model.to_bytes()
    if isinstance(model, (str, os.PathLike)):
        return Calibration.load(model).to_bytes()
    Calibration.from_bytes(model)
    return model


@functools.lru_cache(maxsize=16)
def loaded(model: bytes) -> Calibration:
    """The model, read once a process."""
    return Calibration.from_bytes(model)


def use_threads(count: int) -> None:
    """Threads of this process, unless ``WHEATSTONE_THREADS`` says their number."""
    from . import set_threads

    if not os.environ.get("WHEATSTONE_THREADS"):
        set_threads(count)


def check_false_alarm(value: float) -> None:
    if not 0.0 < value < 1.0:
        raise ArgumentError(f"false_alarm cannot be {value}", hint="give a value between 0 and 1")
