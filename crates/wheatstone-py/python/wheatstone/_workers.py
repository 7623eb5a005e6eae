"""What workers of an engine share: the model as bytes, loaded once a process, and the number of threads."""

from __future__ import annotations

import functools
import os
from typing import Union

from ._arrays import PathLike
from .calibration import Calibration

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
