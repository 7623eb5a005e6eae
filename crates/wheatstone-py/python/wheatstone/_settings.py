"""What a fit is told beside its data."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from typing import Literal, Union

from ._arguments import is_whole, number, positive, refused, whole

Gauge = Literal["first-view", "first-camera"]
Baseline = Union[float, tuple[float, float]]


def baseline_of(value: Baseline | None) -> list[float] | None:
    """A length and a relative tolerance."""
    if value is None:
        return None
    given = [number(item) for item in (value if isinstance(value, (tuple, list)) else (value, 0.01))]
    if len(given) != 2 or not all(0.0 < item < math.inf for item in given):
        hint = "give a length, or a length and a relative tolerance: (120.0, 0.05) for 120 +- 5 %"
        raise refused("expect_baseline", value, hint)
    return given


def settings_of(
    *,
    method: str = "auto",
    preset: str | None = None,
    epochs: int | None = None,
    seed: int = 0,
    validate: bool = True,
    fix: bool = False,
    force: bool = False,
    keep_outliers: bool = False,
    stage_sigma: float | None = None,
    expect_baseline: Baseline | None = None,
    gauge: str = "first-view",
    sizes: Sequence[Sequence[int] | None] = (),
    source: dict[str, str] | None = None,
) -> str:
    """All of it, as JSON."""
    if not (is_whole(seed) and seed < 2**64):
        raise refused("seed", seed, "give a whole number from 0 to 2**64 - 1")
    return json.dumps(
        {
            "method": method,
            "preset": preset,
            "epochs": None if epochs is None else whole(epochs, "epochs", "give a whole number above 0", least=1),
            "seed": int(seed),
            "validate": bool(validate),
            "fix": bool(fix),
            "force": bool(force),
            "keep_outliers": bool(keep_outliers),
            "stage_sigma": None if stage_sigma is None else positive(stage_sigma, "stage_sigma", "give a length above 0"),
            "expect_baseline": baseline_of(expect_baseline),
            "gauge": gauge,
            "sizes": [None if size is None else list(size) for size in sizes],
            "source": source,
        }
    )
