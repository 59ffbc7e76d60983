"""A beginning is late only where no gap and no glitch can be blamed."""

from __future__ import annotations

import numpy as np
import pytest

from workbench.data_quality.onset import late_by

TIMES = np.arange(-60, 120) / 120


def test_a_beginning_is_late_by_what_was_seen_at_rest() -> None:
    assert late_by(TIMES, TIMES > 0.2, 0.0) == pytest.approx(0.2, abs=0.01)
    assert late_by(TIMES, TIMES > -0.2, 0.0) == pytest.approx(-0.2, abs=0.01)
    assert late_by(TIMES, TIMES > 0.03, 0.03) == pytest.approx(0.0, abs=0.01)


def test_a_gap_at_the_beginning_counts_for_neither() -> None:
    seen = (TIMES < 0.0) | (TIMES > 0.3)
    assert late_by(TIMES[seen], TIMES[seen] > 0.1, 0.03) == 0.0
    assert late_by(TIMES[seen], TIMES[seen] > 0.1, 0.5) == pytest.approx(-0.2, abs=0.01)


def test_glitches_are_no_beginning() -> None:
    away = TIMES > 0.2
    away[[10, 30, 31]] = True
    away[86] = False  # a glitch back to rest just after 0.2 s
    assert late_by(TIMES, away, 0.0) == pytest.approx(0.2, abs=0.01)


def test_what_never_begins_is_neither_late_nor_early() -> None:
    assert late_by(TIMES, np.zeros(len(TIMES), dtype=bool), 0.0) is None
    assert late_by(TIMES[:3], TIMES[:3] < 0, 0.0) is None
