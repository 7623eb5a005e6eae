"""Data and models that many tests share."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import pytest

import wheatstone as ws


@cache
def _data(rig: str, cameras: int) -> ws.Dataset:
    return ws.synth(rig=rig, cameras=cameras, noise=0.1, seed=1)


@cache
def _model(method: str, rig: str, cameras: int) -> ws.Calibration:
    return ws.fit(_data(rig, cameras), method=method, validate=False)


@pytest.fixture
def data() -> ws.Dataset:
    """A chart at seven distances before two cameras, pixels off by 0.1."""
    return _data("paper", 2)


@pytest.fixture
def cal() -> ws.Calibration:
    """A model of these data."""
    return _model("brown", "paper", 2)


@pytest.fixture
def data_of() -> Callable[[str, int], ws.Dataset]:
    """Data of a rig with so many cameras."""
    return _data


@pytest.fixture
def model_of() -> Callable[[str, str, int], ws.Calibration]:
    """A model by its method, of a rig with so many cameras."""
    return _model


@pytest.fixture(scope="session")
def model(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The file of the model that engines locate with."""
    from cluster_data import write_model

    return write_model(tmp_path_factory.mktemp("model"))


@pytest.fixture(scope="session")
def table() -> Any:
    """Matched pixels with a key."""
    from cluster_data import matched_pixels

    return matched_pixels()


@pytest.fixture(scope="session")
def parts(table: Any, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the Parquet files that hold them."""
    from cluster_data import write_parts

    return write_parts(table, tmp_path_factory.mktemp("matched") / "parts")
