"""The rotor's rigid arm shows where the point taken for T sits, however far off T."""

from __future__ import annotations

import numpy as np
import pytest

from tests.diagnose.hidden import DOCUMENT, SHAPE
from workbench.diagnose import HopperRig
from workbench.diagnose.drive import drive_fits
from workbench.fit import Hopper, MeasuredRun, commanded_angle
from workbench.fit.arm import arm_of
from workbench.motion import ROTOR, ROTOR_ANGLE, TOP, rotor_angle
from workbench.timeseries import TimeSeries

RADIUS_M, NOISE_M, RATE_HZ = 0.035, 3e-4, 120
STEPS = ((0.0, 15.0),)


def turned(times: np.ndarray, droop: float = 0.0, ripple: float = 0.0) -> np.ndarray:
    """Return the rotor's true angle against T, (n,) [rad]."""
    angle = np.pi / 2 + (1 - droop) * commanded_angle(times, STEPS, 1.0, 0.05, 0.0)
    return angle + ripple / 2 * (1 - np.cos(2 * (angle - angle[0])))


def filmed(
    forward: float,
    up: float,
    droop: float = 0.0,
    seed: int = 1,
    ripple: float = 0.0,
    unseen_s: float = 0.0,
) -> tuple[Hopper, np.ndarray]:
    """Return a run whose T swings and turns, seen from a point off it, and its turn [rad].

    Its speed varies twice a turn by the share `ripple`, and the rotor is first seen after a while.
    """
    rng = np.random.default_rng(seed)
    times = np.arange(-RATE_HZ, 4 * RATE_HZ) / RATE_HZ
    angle = turned(times, droop, ripple)
    moving = times > 0
    turn = np.where(moving, 0.08 * np.sin(angle + 0.4), 0.0)
    world = angle + turn
    top = np.column_stack([0.05 * np.sin(turn), 0.2 + 0.02 * turn])
    c, s = np.cos(turn), np.sin(turn)
    seen = top + np.column_stack([forward * c + up * s, up * c - forward * s])
    rotor = top + RADIUS_M * np.column_stack([np.cos(world), -np.sin(world)])
    seen, rotor = (one + NOISE_M * rng.standard_normal(one.shape) for one in (seen, rotor))
    places = {TOP: seen, ROTOR: rotor}
    columns = {
        name: path
        for names, one in places.items()
        for name, path in zip(names, (one[:, 0], np.zeros(len(times)), one[:, 1]), strict=True)
    }
    columns[ROTOR_ANGLE] = rotor_angle(
        np.column_stack([columns[name] for name in TOP]),
        np.column_stack([columns[name] for name in ROTOR]),
    )
    columns[ROTOR_ANGLE][times < (unseen_s or times[0])] = np.nan
    run = MeasuredRun("turning", "clamped", TimeSeries.of(times, columns), STEPS)
    rig = HopperRig([run], DOCUMENT, SHAPE)
    system = rig.system([0], rig.base)
    return system, turn[-len(system.seen(0)) :]


@pytest.mark.parametrize(("forward", "up"), [(0.0, 0.0), (0.008, 0.0), (0.02, -0.01), (0.0, 0.022)])
@pytest.mark.parametrize("known", [False, True])
def test_the_arm_shows_the_point_within_its_errors(forward: float, up: float, known: bool) -> None:
    system, turn = filmed(forward, up)
    found = arm_of(system, [turn] if known else None)
    off = np.abs(found.offset - (forward, up))
    unknown = 0.0 if known else 1e-3  # T turns with the rotor, and a first harmonic is made of it
    assert (off < 4 * found.deviation + unknown).all()
    assert (found.deviation < 2e-4).all()
    assert found.radius == pytest.approx(RADIUS_M, abs=2e-4 + unknown)


def test_angles_about_t_are_those_of_the_rotor() -> None:
    system, turn = filmed(0.02, -0.01)
    arm = arm_of(system, [turn])
    seen = system.world_angle(0) - turn
    times = system.times(0)
    true = np.pi / 2 + commanded_angle(times, STEPS, 1.0, 0.05, 0.0)
    off = arm.true_angle(seen) - true
    off -= 2 * np.pi * np.round(np.median(off) / (2 * np.pi))
    assert np.sqrt(np.mean(off**2)) < 2 * NOISE_M / RADIUS_M
    assert np.sqrt(np.mean((seen - true - np.median(seen - true)) ** 2)) > 0.3


@pytest.mark.parametrize("seed", range(5))
def test_a_point_on_t_is_not_taken_to_be_off_it(seed: int) -> None:
    for up, off in ((0.0, False), (0.001, True)):
        system, turn = filmed(0.0, up, seed=seed)
        assert arm_of(system, [turn]).off is off


@pytest.mark.parametrize("ripple", [0.0, 0.04])
@pytest.mark.parametrize("up", [0.0, 0.001, 0.02])
def test_the_input_is_the_angle_about_t_wherever_the_point_taken_for_it_sits(
    up: float, ripple: float
) -> None:
    system, turn = filmed(0.0, up, ripple=ripple)
    found = system.angle_against_top(0, np.column_stack([turn, np.zeros(len(turn))]))
    assert found is not None
    times = system.times(0)
    off = (found - turned(times, ripple=ripple))[times > 0.5]
    assert np.sqrt(np.mean(off**2)) < 0.25 * NOISE_M / RADIUS_M


@pytest.mark.parametrize(("droop", "unseen_s"), [(0.0, 0.0), (0.02, 0.0), (0.02, 0.3)])
def test_the_drive_is_judged_from_a_point_far_off_t(droop: float, unseen_s: float) -> None:
    system, turn = filmed(0.02, -0.01, droop, unseen_s=unseen_s)
    system = system.turning(
        [system.angle_against_top(0, np.column_stack([turn, np.zeros(len(turn))]))]
    )
    fits = drive_fits(system, [turn], arm_of(system, [turn]))
    without, scaled = fits.solved(()), fits.solved(["speed_scale"])
    share, error = fits.values(["speed_scale"], scaled)["speed_scale share"]
    _, wide = fits.values(["speed_scale"], scaled, ["speed_offset"])["speed_scale share"]
    assert wide > 3 * error  # by one speed an offset within its tolerance does the same
    missed = np.sqrt(scaled.blocks.sum() / len(fits.linear.residuals))
    assert missed < 1.1
    assert abs(share + droop) < 4 * error
    assert (without.cost - scaled.cost > 16) == bool(droop)
