"""What cameras that are not as they are said to be make of a pose."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.bank.courses import Course
from tests.fit.filmed import NOISE_M, ROBOT, measured, ramp, twin_motion
from workbench.fit import Estimator, Hopper, Parameter, ParameterVector, Scope
from workbench.fit.systems.hopper_view import View

SENSORS = {
    "camera_tilt": ("tilt", "rad", 0.06),
    "length_scale": ("share", "1", 0.05),
    "marker_offset": ("forward", "m", 0.008),
}
COURSES = {"clamped": Course("clamped", 1.5, ramp(9.0)), "decay": Course("decay", 1.5, pull=0.6)}


@pytest.mark.parametrize("angle", [0.3, 2.0, 5.5])
def test_a_rotor_s_angle_about_t_is_found_from_that_about_another_point(angle: float) -> None:
    view, radius = View(tilt=0.02, forward=0.004, up=-0.003), 0.035
    arm = radius * np.array([np.cos(angle), -np.sin(angle)]) - [view.forward, view.up]
    x, z = view.matrix @ arm
    seen = np.array([np.arctan2(-z, x)])
    apart = view.true_angle(seen, radius)[0] - angle
    assert np.angle(np.exp(1j * apart)) == pytest.approx(0.0, abs=1e-9)


PAIRS = [(name, mode) for name in SENSORS for mode in COURSES]
PAIRS.remove(("marker_offset", "decay"))  # the effect counts T's turn from its first sample, pulled


@pytest.mark.parametrize(("name", "mode"), PAIRS)
def test_what_such_cameras_saw_is_at_the_noise_once_it_is_known(name: str, mode: str) -> None:
    quantity, unit, value = SENSORS[name]
    course = COURSES[mode]
    run = measured(twin_motion(course, {name: {quantity: value}}), course)
    one = Parameter(f"{name} {quantity}", unit, 0.0, 0.01, scope=Scope.CANDIDATE)
    system = Hopper(ROBOT, [run], candidates={one: (name, quantity)})
    estimator = Estimator.of(system, ParameterVector(system.parameters), system.strong)
    system = system.refined([estimator.innovations(_at(estimator, 0.0), keep=True)[0].qpos])
    estimator = Estimator.of(system, estimator.vector, {"beam": 2e-5, "foot": 1e-3})
    missed, known = (
        float(np.sqrt(np.nanmean(estimator.innovations(_at(estimator, v))[0].error ** 2)))
        for v in (0.0, value)
    )
    assert known < 1.12 * NOISE_M
    assert missed > 1.25 * known


def _at(estimator: Estimator, value: float) -> np.ndarray:
    x = np.zeros(len(estimator.vector))
    x[0] = estimator.vector.parameters[0].number(value)
    return x
