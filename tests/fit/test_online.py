"""The observer on a stream: the same numbers as of a whole track, and what it predicts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.bank.courses import Course
from tests.fit.filmed import ROBOT, measured, ramp, twin_motion
from workbench.errors import InputError
from workbench.fit import Estimate, Job, MeasuredRun, OnlineObserver, observe
from workbench.motion import FOOT, TOP
from workbench.timeseries import TimeSeries

COURSES = [Course("hop", 3.0, ramp(17.0)), Course("clamped", 3.0, ramp(8.5))]
REST_UNTIL_S = -0.1


def begun(run: MeasuredRun) -> tuple[OnlineObserver, list[dict[str, float]]]:
    """An observer that has seen the rest of a run, and the samples that follow."""
    motion = run.motion
    at = int(np.searchsorted(motion.times, REST_UNTIL_S))
    rest = TimeSeries(motion.times[:at], motion.values[:at], motion.names, motion.valid[:at])
    rows = np.where(motion.valid, motion.values, np.nan)[at:]
    later = [dict(zip(motion.names, row.tolist(), strict=True)) for row in rows]
    return OnlineObserver(ROBOT, run.mode, rest), later


def film(course: Course) -> MeasuredRun:
    return measured(twin_motion(course), course)


@pytest.mark.parametrize("course", COURSES, ids=lambda course: course.mode)
def test_sample_by_sample_it_finds_what_it_finds_of_the_whole_track(course: Course) -> None:
    observer, samples = begun(film(course))
    driven, found = [], []
    for sample in samples:
        before = observer._act
        observer.advance(sample)
        driven.append((observer._act - before) * 120)
        found.append(observer._found.error[0].copy())
    start = observer._system.start(0, {}, coarse=True)
    seen = np.array([[sample[name] for name in observer.channels] for sample in samples])
    seen = np.vstack([np.full_like(seen[:1], np.nan), seen])  # the start itself is not corrected
    control = np.repeat(np.array([*driven, 0.0])[:, None], start.model.nu, axis=1)
    gain, gate = observer._smoothing[0], observer._together._gate[0]
    (whole,) = observe([Job.of(replace(start, control=control), seen, gain, gate)], threads=1)
    np.testing.assert_allclose(found, whole.error[1:], rtol=0, atol=1e-12)


def errors_of(found: list[Estimate]) -> np.ndarray:
    return 1e3 * np.array([one.error_m for one in found])


def test_where_nothing_is_wrong_the_prediction_is_good_and_nothing_is_missing() -> None:
    observer, samples = begun(film(COURSES[0]))
    found = [observer.advance(sample) for sample in samples]
    errors = errors_of(found)
    assert np.isnan(errors[:10]).all()  # nothing was predicted 0.1 s before
    assert np.isfinite(errors[20:]).all()
    assert np.sqrt(np.nanmean(errors**2)) < 1.5
    missing = observer.missing_force()
    assert missing is not None
    assert set(missing.force) == {"foot", "top"}
    assert np.hypot(*missing.force["top"]) < 4 * np.hypot(*missing.sigma["top"])


def test_lost_samples_are_stepped_over_and_the_prediction_is_good_again() -> None:
    observer, samples = begun(film(COURSES[0]))
    found = [observer.advance(sample) for sample in samples[:150]]
    found.append(observer.advance(samples[155], samples=6))  # fewer than are predicted over
    found += [observer.advance(sample) for sample in samples[156:180]]
    found.append(observer.advance(samples[220], samples=41))  # and more
    late = [observer.advance(sample) for sample in samples[221:]]
    assert np.nanmax(errors_of(found[:175])) < 5
    assert np.isnan(errors_of(late[:10])).all()
    assert np.nanmax(errors_of(late[30:])) < 5


def test_a_clamped_foot_that_moves_is_an_error_of_the_prediction() -> None:
    observer, samples = begun(film(COURSES[1]))
    moved = [sample | {FOOT[0]: sample[FOOT[0]] + 0.008} for sample in samples[100:130]]
    errors = errors_of([observer.advance(sample) for sample in (*samples[:100], *moved)])
    assert np.nanmax(errors[:100]) < 2
    assert (errors[100:] > 7).all()


def test_what_cannot_be_observed_is_refused() -> None:
    rest = film(COURSES[0]).motion.between(-0.6, -0.2)
    with pytest.raises(InputError, match="samples at rest; an observer needs 60"):
        OnlineObserver(ROBOT, "hop", rest)
    with pytest.raises(InputError, match="only driven runs are observed live"):
        OnlineObserver(ROBOT, "decay", rest)
    valid = film(COURSES[0]).motion
    blind = valid.valid.copy()
    blind[:, valid.names.index(TOP[0])] = False
    with pytest.raises(InputError, match="was not seen before time zero"):
        OnlineObserver(ROBOT, "hop", replace(valid, valid=blind).between(-1.0, -0.1))
