"""When a prediction error stops a run."""

from __future__ import annotations

import math

import pytest

from workbench.live.verdict import LimitMonitor, Stop
from workbench.schemas import StopWhen

LIMIT = StopWhen(0.005, 0.2)


def stop(errors_mm: list[float], limit: StopWhen = LIMIT) -> Stop | None:
    """The verdict over samples at 120 Hz."""
    verdict = LimitMonitor(limit)
    found = (verdict.after(k / 120, error / 1e3) for k, error in enumerate(errors_mm))
    return next((one for one in found if one is not None), None)


def test_an_error_above_the_limit_for_long_enough_stops() -> None:
    found = stop([1.0] * 10 + [7.0] * 30)
    assert found is not None
    assert found.since_s == pytest.approx(0.2)
    assert found.time_s == pytest.approx(34 / 120)
    assert found.error_m == pytest.approx(7e-3)


@pytest.mark.parametrize(
    "errors",
    [
        [7.0] * 24,  # 0.19 s
        ([7.0] * 20 + [4.9]) * 5,  # below in between
        ([7.0] * 3 + [math.nan] * 40 + [1.0]) * 3,  # a glitch, then nothing seen
        [5.0] * 60,  # at the limit
    ],
)
def test_what_is_shorter_or_a_glitch_does_not(errors: list[float]) -> None:
    assert stop(errors) is None


def test_samples_that_were_not_seen_say_neither() -> None:
    assert stop(([7.0] * 4 + [math.nan] * 4) * 4) is not None
    assert stop([7.0] * 4, StopWhen(0.005, 0.0)) is not None
    assert stop([7.0] * 3, StopWhen(0.005, 0.0)) is None
