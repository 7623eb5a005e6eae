"""The Python of the documentation runs as it stands there, from top to bottom."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import wheatstone as ws

PACKAGE = Path(__file__).parent.parent
ROOT = PACKAGE.parent.parent
BLOCK = re.compile(r"^```python\n(.*?)^```$", re.DOTALL | re.MULTILINE)


def run(page: Path, namespace: dict[str, Any]) -> dict[str, Any]:
    """Runs the Python blocks of a page in one namespace, each at the line where it stands."""
    text = page.read_text(encoding="utf-8")
    blocks = list(BLOCK.finditer(text))
    assert blocks, f"{page.name} has no Python"
    for block in blocks:
        line = text.count("\n", 0, block.start(1))
        exec(compile("\n" * line + block[1], str(page), "exec"), namespace)  # noqa: S102
    return namespace


@pytest.fixture
def given(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """Arrays that a page takes for granted, and a folder of its own."""
    monkeypatch.chdir(tmp_path)
    data = ws.synth(rig="paper", noise=0.1, count=400)
    mm = 10.0
    return {
        "pixels": data.pixels,
        "points": data.points * mm,
        "views": data.views,
        "new_pixels": data.pixels[:10],
    }


@pytest.mark.parametrize(
    "page", [PACKAGE / "README.md", ROOT / "README.md"], ids=["package", "project"]
)
def test_a_readme_runs(page: Path, given: dict[str, Any]) -> None:
    if not page.exists():
        pytest.skip("not in a checkout of the project")
    after = run(page, given)
    located = after["located"]
    assert after["cal"].unit == "mm"
    assert after["cal"].validation.all.rms < 10
    assert len(located) == 10 and bool(np.isfinite(located.sigmas).all())


def test_the_guide_runs(given: dict[str, Any], capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("pyarrow")
    pytest.importorskip("pandas")
    page = ROOT / "docs" / "how-to" / "python.md"
    if not page.exists():
        pytest.skip("not in a checkout of the project")
    threads = ws.get_threads()
    try:
        after = run(page, {})
    finally:
        ws.set_threads(threads)
    printed = capsys.readouterr().out
    assert "cameras-swapped" in printed
    assert int(np.count_nonzero(after["good"])) > 80
    assert after["covariance"].shape == (100, 3, 3)
    assert np.array_equal(after["xyz"], after["cal"].predict(after["pixels"]))
    assert after["places"].column_names[-9:-2] == ["X", "Y", "Z", "sX", "sY", "sZ", "residual"]
    assert len(after["frame"]) == len(after["pixels"])
    assert len(after["found"]) == 42
    assert np.allclose(after["back"].to_opencv()["K1"], after["stereo"]["K1"])
    assert after["same"].cameras == 2
    assert after["score"].rms < 1.0
