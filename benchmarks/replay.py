"""How far T is off where the measured angle of the rotor is replayed, and where it is followed.

    python benchmarks/replay.py [--quick]

A clamped robot is driven with the ripple of two per turn that the smoothing must not take away. The
rotor's marker is seen with noise. `replayed` smooths the angle by local cubics over some seconds
(Savitzky and Golay) and turns the simulated rotor through it; `followed` fits lag, gain and start
angle of a motor that lags behind its command, and the ripple, as a diagnosis does. Why the
diagnosis follows: docs/decisions/0011-diagnosis.md.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.signal import savgol_filter

from workbench.fit import commanded_angle
from workbench.schemas import load_model, load_shape
from workbench.sim import Condition, Robot, make_robot, sample_times, simulate

SPEEDS = (8.2, 11.0, 13.2)
RIPPLE = 0.02  # of the angle, twice per turn [rad]
NOISE_M = 6e-4  # of the rotor's marker
WINDOWS_S = (0.06, 0.11, 0.21, 0.41)
TOP = ("top_x_m", "top_z_m")

Array = NDArray[np.float64]


def main() -> None:
    """Print one row for each speed."""
    seconds = 2.0 if "--quick" in sys.argv else 10.0
    here = Path()
    shape = load_shape("thesis-initial", here).content
    robot = replace(make_robot(load_model("thesis", here).content.values(), shape), planar=True)
    print(f"T of {seconds:g} s clamped, root mean square error [mm]; camera noise is 0.3")
    print(f"{'rad/s':>6}{'followed':>10}", *(f"{f'replayed {w:g} s':>16}" for w in WINDOWS_S))
    for speed in SPEEDS:
        followed, replays = errors(robot, speed, seconds)
        print(f"{speed:6.1f}{followed:10.3f}", *(f"{one:16.3f}" for one in replays))


def errors(robot: Robot, speed: float, seconds: float) -> tuple[float, list[float]]:
    """Return the error of T [mm] where the rotor is followed, and replayed in each window."""
    times = sample_times(seconds)
    truth = turned(times, speed, (0.05, 0.0, 0.0, RIPPLE))
    top = moved(robot, times, truth)
    noise = NOISE_M / robot.values["rotor_radius"]
    seen = truth + noise * np.random.default_rng(round(10 * speed)).standard_normal(len(times))
    fit = least_squares(lambda p: turned(times, speed, p) - seen, [0.04, 0.0, 0.0, 0.0])
    kept = [np.asarray(savgol_filter(seen, 2 * round(w * 60) + 1, 3)) for w in WINDOWS_S]

    def off(angle: Array) -> float:
        return 1000 * float(np.sqrt(np.mean((moved(robot, times, angle) - top) ** 2)))

    return off(turned(times, speed, fit.x)), [off(angle) for angle in kept]


def turned(times: Array, speed: float, numbers: Array | tuple[float, ...]) -> Array:
    """Return the angle of a rotor that lags behind its command and ripples, (n,) [rad]."""
    lag, gain, start, ripple = numbers
    angle = commanded_angle(times, [(0.5, speed)], 1 + gain, max(lag, 1e-3), 0.0) + start
    return angle + ripple * np.sin(2 * angle)


def moved(robot: Robot, times: Array, angle: Array) -> Array:
    """Return where T goes when the rotor is turned through an angle, (n, 2) [m]."""
    speeds = np.diff(angle, append=angle[-1]) / (times[1] - times[0])
    motion = simulate(robot, Condition("clamped", speeds, float(np.pi / 2 + angle[0]))).motion
    return motion.select(TOP).values


if __name__ == "__main__":
    main()
