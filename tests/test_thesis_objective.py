"""Appendix D as printed: its index, its value, and what it prefers."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.thesis_objective import (
    FMINCON_HIGH,
    FMINCON_LOW,
    FMINCON_ORDER,
    FMINCON_START,
    OMEGA_RAD_S,
    SAMPLES,
    SAMPLING_S,
    criterion_value,
    fmincon_criterion,
    fmincon_fit,
    fmincon_index,
    free_swing,
)
from workbench.errors import InputError
from workbench.schemas import load_model, load_shape
from workbench.sim import Robot, make_robot

TIMES = np.arange(SAMPLES) * SAMPLING_S
RECORD_S = SAMPLES * SAMPLING_S


@pytest.fixture(scope="module")
def robot() -> Robot:
    values = load_model("thesis", Path()).content.values()
    return make_robot(values, load_shape("thesis-initial", Path()).content)


def swing(x: np.ndarray | float, z: np.ndarray | float) -> np.ndarray:
    return np.column_stack([np.broadcast_to(x, SAMPLES), np.broadcast_to(z, SAMPLES)])


def turns(count: int, amplitude: float = 1.0) -> np.ndarray:
    return amplitude * np.cos(2 * np.pi * count * TIMES / RECORD_S)


def test_the_index_is_the_number_of_turns_of_the_drive_in_the_record() -> None:
    assert fmincon_index() == 65
    assert OMEGA_RAD_S * RECORD_S / (2 * np.pi) == pytest.approx(65.26, abs=0.01)


@pytest.mark.parametrize(
    ("count", "seen"), [(43, False), (44, True), (64, True), (65, True), (84, True), (85, False)]
)
def test_the_window_is_that_of_matlab_which_counts_from_one(count: int, seen: bool) -> None:
    # MATLAB's entries 45 to 85 hold 44 to 84 turns; whole turns of amplitude 1 sum to half of N
    value = criterion_value(swing(0.0, turns(count)))
    assert value == pytest.approx(10_000 - (SAMPLES / 2 if seen else 0), abs=1e-6)


def test_height_is_rewarded_and_half_of_the_way_forward_is_charged() -> None:
    value = criterion_value(swing(turns(70, 0.02), turns(50, 0.03)))
    assert value == pytest.approx(10_000 - 0.03 * SAMPLES / 2 + 0.5 * 0.02 * SAMPLES / 2)


def test_only_the_strongest_entry_of_each_axis_counts() -> None:
    value = criterion_value(swing(0.0, turns(50, 0.03) + turns(60, 0.02) + 0.28))
    assert value == pytest.approx(10_000 - 0.03 * SAMPLES / 2)


def test_a_sine_at_the_drive_falls_between_two_entries() -> None:
    # 65.26 turns: the nearest entry keeps sin(pi a) / (pi a) of it, a = 0.26
    value = criterion_value(swing(0.0, np.sin(OMEGA_RAD_S * TIMES)))
    left = np.sinc(OMEGA_RAD_S * RECORD_S / (2 * np.pi) - 65)
    assert value == pytest.approx(10_000 - left * SAMPLES / 2, rel=1e-3)


def test_another_number_of_samples_is_refused() -> None:
    with pytest.raises(
        InputError, match=r"20001 samples at 1 kHz, not an array of shape \(2401, 2"
    ):
        criterion_value(np.zeros((2401, 2)))


def test_a_stiffness_a_quarter_too_high_is_preferred_to_the_true_one(robot: Robot) -> None:
    wrong = dict(robot.values) | {"hinge_stiffness": 1.25 * robot.values["hinge_stiffness"]}
    assert fmincon_criterion(replace(robot, values=wrong)) < fmincon_criterion(robot)


def test_the_swing_begins_where_the_springs_rest_and_stays_finite(robot: Robot) -> None:
    soft = dict(robot.values) | dict(zip(FMINCON_ORDER, FMINCON_START, strict=True))
    top = free_swing(replace(robot, values=soft))  # this beam cannot stand
    heading = np.cumsum(robot.angles)
    step = robot.length / len(robot.angles)
    x = robot.values["beam_root"] + step * np.sum(np.cos(heading))
    np.testing.assert_allclose(top[0], [x, -step * np.sum(np.sin(heading))], atol=1e-9)
    assert np.isfinite(top).all()
    assert top[:, 1].min() < 0.5 * top[0, 1]


def test_a_beam_too_stiff_for_the_step_is_refused(robot: Robot) -> None:
    stiff = dict(robot.values) | {"hinge_stiffness": 400.0, "hinge_damping": 0.001}
    with pytest.raises(InputError, match=r"cannot be simulated in steps of 0\.125 ms"):
        free_swing(replace(robot, values=stiff))


def test_the_fit_starts_as_printed_and_keeps_the_order_and_the_bounds(robot: Robot) -> None:
    asked: list[tuple[float, ...]] = []

    def bowl(candidate: Robot) -> float:
        x = tuple(candidate.values[name] for name in FMINCON_ORDER)
        asked.append(x)
        middle = (7.0, 0.5, 50.0, 0.2)  # the third lies beyond its bound
        return sum((a - b) ** 2 for a, b in zip(x, middle, strict=True))

    found = fmincon_fit(robot, bowl)
    assert asked[0] == FMINCON_START
    assert list(found.values) == list(FMINCON_ORDER)
    assert list(found.values.values()) == pytest.approx([7.0, 0.5, 40.0, 0.2], abs=0.02)
    assert found.criterion == pytest.approx(100.0, abs=0.01)
    assert found.criterion_at_start == pytest.approx(bowl_at_start())
    tried = np.array(asked)
    assert (tried >= np.array(FMINCON_LOW) - 1e-9).all()
    assert (tried <= np.array(FMINCON_HIGH) + 1e-9).all()


def bowl_at_start() -> float:
    return 4.95**2 + 0.44**2 + 35.9**2 + 0.1**2


def test_everything_but_the_four_parameters_stays(robot: Robot) -> None:
    kept = {name: v for name, v in robot.values.items() if name not in FMINCON_ORDER}

    def unchanged(candidate: Robot) -> float:
        assert {name: candidate.values[name] for name in kept} == kept
        assert candidate.angles == robot.angles
        return 0.0

    assert fmincon_fit(robot, unchanged).evaluations >= 1
