"""Effects that take energy out of the beam: how much, and how it goes with the amplitude."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.sim.rigs import (
    PENDULUM_ARM,
    PENDULUM_MASS,
    PENDULUM_RATE,
    pendulum,
    resting,
    ringing,
    with_effect,
)
from workbench.motion import TOP
from workbench.sim import Condition, Robot, linear_modes, simulate

HINGES = [f"hinge_{k}_rad" for k in range(1, 16)]


@pytest.mark.parametrize(
    ("name", "quantity", "value", "power"),
    [
        ("hinge_damping", "share", 0.1, 0.0),
        ("hinge_quadratic_damping", "c", 0.002, 1.0),
        ("air_drag", "c", 0.002, 1.0),
        ("hinge_coulomb_friction", "torque", 3e-5, -1.0),
    ],
)
def test_the_decay_rate_goes_with_the_amplitude_as_the_law_says(
    robot: Robot, name: str, quantity: str, value: float, power: float
) -> None:
    lossy = with_effect(robot, name, **{quantity: value})
    more = [ringing(lossy, pull) - ringing(robot, pull) for pull in (0.2, 0.4)]
    print(f"{name}: loss added at pulls of 0.2 and 0.4 N: {more}")
    assert min(more) > 1e-3
    assert np.log2(more[1] / more[0]) == pytest.approx(power, abs=0.15)


def test_hinge_damping_raises_the_damping_ratio_by_the_strip_s_share(robot: Robot) -> None:
    ratios = [
        linear_modes(r, count=1)[0].damping_ratio
        for r in (
            robot,
            with_effect(robot, "hinge_damping", share=0.5),
            replace(robot, values=dict(robot.values) | {"root_damping": 0.0}),
        )
    ]
    assert ratios[1] - ratios[0] == pytest.approx(0.5 * ratios[2])


def test_none_of_them_moves_the_frequency(robot: Robot) -> None:
    rate = linear_modes(robot, count=2)
    for name, quantity in (("hinge_quadratic_damping", "c"), ("air_drag", "c")):
        lossy = linear_modes(with_effect(robot, name, **{quantity: 0.01}), count=2)
        assert [m.hz for m in lossy] == pytest.approx([m.hz for m in rate], rel=1e-9)


def undamped(robot: Robot) -> Robot:
    values = dict(robot.values) | {"hinge_damping": 0.0, "root_damping": 0.0}
    return replace(robot, values=values, steps_per_sample=136)


def lost(robot: Robot) -> tuple[float, np.ndarray]:
    """Return the energy that half a second takes [J], and the hinges' angles, (n, 15) [rad]."""
    condition = Condition("decay", np.zeros(61), pull=0.4, energy=True)
    motion = simulate(robot, condition).motion
    energy = motion["potential_energy_J"] + motion["kinetic_energy_J"]
    return float(energy[0] - energy[-1]), np.column_stack([motion[name] for name in HINGES])


def test_coulomb_friction_takes_its_torque_times_the_way(robot: Robot) -> None:
    free, rough = (
        undamped(robot),
        with_effect(undamped(robot), "hinge_coulomb_friction", torque=2e-4),
    )
    taken, angles = lost(rough)
    numerical = lost(free)[0]
    way = np.abs(np.diff(angles, axis=0)).sum()
    print(f"taken {taken} J, of it by the step {numerical} J; torque times way {2e-4 * way} J")
    assert abs(numerical) < 0.1 * taken
    assert taken - numerical == pytest.approx(2e-4 * way, rel=0.03)


def test_quadratic_damping_takes_the_cube_of_the_speed(robot: Robot) -> None:
    free, lossy = undamped(robot), with_effect(undamped(robot), "hinge_quadratic_damping", c=0.01)
    taken, angles = lost(lossy)
    power = 0.01 * (np.abs(np.diff(angles, axis=0) * 120) ** 3).sum(axis=1)
    assert taken - lost(free)[0] == pytest.approx(power.sum() / 120, rel=0.05)


def test_with_coulomb_friction_t_sticks_away_from_its_rest(robot: Robot) -> None:
    rough = with_effect(robot, "hinge_coulomb_friction", torque=0.01)
    x = simulate(rough, Condition("decay", np.zeros(1200), pull=0.5)).motion[TOP[0]]
    rest = simulate(rough, Condition("decay", np.zeros(2))).motion[TOP[0]][0]
    assert np.ptp(x[-120:]) < 2e-5  # [m] in a second
    assert abs(x[-1] - rest) > 1e-4


def test_at_rest_coulomb_friction_moves_nothing(robot: Robot) -> None:
    rough = with_effect(robot, "hinge_coulomb_friction", torque=1e-3)
    assert resting(rough)[1].qpos == pytest.approx(resting(robot)[1].qpos, abs=1e-12)
    motion = simulate(rough, Condition("clamped", np.zeros(240))).motion
    assert np.ptp(motion[TOP[0]]) < 1e-8


def test_friction_and_quadratic_damping_are_the_same_strip_in_a_finer_chain(robot: Robot) -> None:
    for name, quantity, value in (
        ("hinge_quadratic_damping", "c", 0.003),
        ("hinge_coulomb_friction", "torque", 5e-5),
    ):
        more = [
            ringing(with_effect(chain, name, **{quantity: value}), 0.4, 1.0)
            - ringing(chain, 0.4, 1.0)
            for chain in (robot, replace(robot, increments=32))
        ]
        print(f"{name}: loss added in 16 and 32 increments: {more}")
        assert more[1] == pytest.approx(more[0], rel=0.05)


def test_drag_fades_a_pendulum_as_the_inverse_of_time() -> None:
    """1 / A grows by 4 / (3 pi) c arm^3 / inertia times the phase (averaged over a swing)."""
    c = 0.02
    swing = pendulum({"top_drag": c}, 0.1, 6.0)
    peaks = np.flatnonzero((swing[1:-1] > swing[:-2]) & (swing[1:-1] >= swing[2:])) + 1
    inertia = PENDULUM_MASS * PENDULUM_ARM**2
    growth = np.polyfit(1e-4 * peaks, 1 / swing[peaks], 1)[0]
    expected = 4 / (3 * np.pi) * c * PENDULUM_ARM**3 / inertia * PENDULUM_RATE
    assert len(peaks) > 10
    assert growth == pytest.approx(expected, rel=0.01)
