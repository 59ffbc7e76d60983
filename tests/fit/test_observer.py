"""The observer: what it keeps, what it forgets, and that threads do not matter."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from benchmarks.bank.courses import Course
from tests.fit.filmed import ROBOT, hopper, measured, ramp, twin_motion
from workbench.fit import Estimator, Hopper, ParameterVector, observe
from workbench.motion import TOP
from workbench.sim import Condition, Stepper, simulate

COURSES = {
    "clamped": Course("clamped", 2.0, ramp(11.0)),
    "hop": Course("hop", 2.0, ramp(17.0)),
    "decay": Course("decay", 2.0, pull=0.4),
}
SIZE = {"beam": 2e-4, "hopping beam": 2e-4, "foot": 5e-3}
NONE = dict.fromkeys(SIZE, 0.0)


@cache
def system() -> Hopper:
    runs = [measured(twin_motion(c), c, k) for k, c in enumerate(COURSES.values())]
    found = Hopper(ROBOT, runs)
    for _ in range(2):
        seen = estimator(found, SIZE).innovations(np.zeros(len(found.parameters)), keep=True)
        found = found.refined([one.qpos for one in seen])
    return found


def estimator(hopper: Hopper, noise: dict[str, float], threads: int = 1) -> Estimator:
    return Estimator.of(hopper, ParameterVector(hopper.parameters), noise, threads=threads)


@pytest.mark.budget(60)  # compiles what all observers call, where no cache is kept
@pytest.mark.parametrize("noise", [SIZE, NONE])
def test_at_the_true_robot_innovations_are_the_cameras_noise(noise: dict[str, float]) -> None:
    found = estimator(system(), noise).innovations(np.zeros(len(system().parameters)))
    for name, one in zip(system().names, found, strict=True):
        assert np.sqrt(np.mean(one.white**2)) == pytest.approx(1.0, abs=0.08), name


def test_results_are_the_same_bits_for_any_number_of_threads() -> None:
    x = np.full(len(system().parameters), 0.1)
    one, three = (estimator(system(), SIZE, threads).innovations(x) for threads in (1, 3))
    for a, b in zip(one, three, strict=True):
        assert np.array_equal(a.error, b.error)
        assert np.array_equal(a.information, b.information)


def test_the_compiled_track_is_that_of_one_sample_after_another(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    x = np.full(len(system().parameters), 0.1)
    whole = estimator(system(), SIZE).innovations(x, keep=True)
    monkeypatch.setattr(Stepper, "chains", lambda self, steps: None)
    for a, b in zip(estimator(system(), SIZE).innovations(x, keep=True), whole, strict=True):
        for name in ("error", "white", "information", "slopes", "qpos", "qvel"):
            assert np.array_equal(getattr(a, name), getattr(b, name), equal_nan=True), name


def test_jobs_that_are_made_one_by_one_come_back_in_their_order() -> None:
    one = estimator(system(), SIZE)
    x = np.full(len(one.vector), 0.1)
    runs = [k % len(COURSES) for k in range(60)]  # of three layouts, more than wait for the last
    alone = one.innovations(x)
    for k, found in zip(runs, observe((one.job(k, x) for k in runs), threads=2), strict=True):
        assert np.array_equal(found.error, alone[k].error)


def test_without_process_noise_it_is_the_simulation() -> None:
    course = Course("clamped", 1.0)
    motion = simulate(ROBOT, Condition("clamped", np.zeros(121))).motion
    still = hopper(twin_motion(course), course)
    found = estimator(still, NONE).innovations(np.zeros(len(still.parameters)), keep=True)[0]
    assert np.ptp(found.qpos, axis=0).max() < 1e-6
    assert np.ptp(motion[TOP[0]]) < 1e-6


def test_a_gap_is_predicted_through_and_left_unweighed() -> None:
    whole = estimator(system(), SIZE)
    gap = slice(100, 160)
    masks = [np.zeros(system().seen(k).shape, dtype=np.bool_) for k in range(3)]
    masks[0][gap] = True
    found = Estimator.of(system(), whole.vector, SIZE, 1, masks).innovations(
        np.zeros(len(whole.vector))
    )[0]
    assert np.isnan(found.error[gap]).all()
    assert np.all(found.white[gap] == 0)
    assert np.sqrt(np.mean(found.white[170:] ** 2)) == pytest.approx(1.0, abs=0.1)


def test_a_run_whose_numbers_blow_up_costs_more_than_any_other() -> None:
    whole = estimator(system(), SIZE)
    found = whole.innovations(np.zeros(len(whole.vector)))
    broken = type(found[0])(**{**vars(found[0]), "sane": 50})
    assert np.sum(whole.residuals_of([broken], np.zeros(len(whole.vector))) ** 2) > 1e6
