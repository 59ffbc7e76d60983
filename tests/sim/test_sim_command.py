from __future__ import annotations

import numpy as np
import pytest

from workbench.errors import InputError
from workbench.motion import PITCH, ROTOR_ANGLE
from workbench.sim import Condition, Robot, replayed, sample_times, simulate, staircase


def wavering(times: np.ndarray) -> np.ndarray:
    """A motor that runs up to 17 rad/s and ripples by 1 rad/s."""
    return 17 * (times - 0.3 * (1 - np.exp(-times / 0.3))) + np.sin(17 * times) / 17


def test_staircase_holds_each_value_from_its_time_on() -> None:
    speeds = staircase(np.array([0.0, 0.9, 1.0, 1.5, 2.0]), [(1.0, 5.0), (2.0, 7.0)])
    assert speeds.tolist() == [0, 0, 5, 5, 7]


@pytest.mark.parametrize("mode", ["clamped", "hop"])
def test_a_replayed_angle_comes_out_within_5_mrad(robot: Robot, mode: str) -> None:
    seen_at = np.arange(-60, 600) / 100  # another rate than 120 Hz, and earlier than the start
    angle = np.where(seen_at > 0, wavering(seen_at), 0.0) + 40.0
    command = replayed(seen_at, angle)
    motion = simulate(robot, Condition(mode, command)).motion  # pyright: ignore[reportArgumentType]
    turn = motion[PITCH] + sum(motion[n] for n in motion.names if n.startswith("hinge_"))
    against_top = motion[ROTOR_ANGLE] - turn
    wanted = np.interp(motion.times, seen_at, angle) - 40.0
    assert against_top - against_top[0] == pytest.approx(wanted, abs=5e-3)


def test_a_replay_bridges_gaps_and_ends_with_the_last_angle() -> None:
    times = sample_times(1.0)
    angle = 10 * times
    angle[30:50] = np.nan
    angle[-12:] = np.nan
    command = replayed(times, angle)
    assert len(command) == len(times) - 12
    assert command[:-1] == pytest.approx(10.0)
    assert command[-1] == 0


def test_a_replay_starts_where_it_is_told() -> None:
    times = sample_times(2.0)
    assert replayed(times, times**2, start=1.0)[0] == pytest.approx(2.0, abs=0.01)


def test_nothing_to_replay_is_refused_with_the_start() -> None:
    times = sample_times(1.0)
    with pytest.raises(InputError, match=r"angle is not seen later than 1\.5 s; check the start"):
        replayed(times, times, start=1.5)
    with pytest.raises(InputError, match="nothing to replay"):
        replayed(times, np.full(len(times), np.nan))
