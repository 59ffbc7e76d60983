"""Compare MuJoCo's integrators on the twin: error of T after 10 s clamped at 14 rad/s, and time.

    python benchmarks/integrators.py [--quick]

The reference is Runge-Kutta at an eighth of the step in use. The choice is told in
docs/decisions/0006-step.md.
"""

from __future__ import annotations

import sys
import time
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np

from workbench.protocol import load_model, load_shape
from workbench.sim import Robot, make_robot, settle

OMEGA = 14.0
INTEGRATORS = ("EULER", "IMPLICIT", "IMPLICITFAST", "DISCRETE", "RK4")
STEPS = (17, 34, 68)


def main() -> None:
    """Print one row for each integrator and step."""
    seconds = 1.0 if "--quick" in sys.argv else 10.0
    quiet = mujoco.MjLogConfig.get()
    quiet.logto_file = quiet.logto_console = False
    quiet.set()
    here = Path()
    shape = load_shape("thesis-initial", here).content
    robot = make_robot(load_model("thesis", here).content.values(), shape)
    truth, _ = drive(robot, "RK4", 272, seconds)
    print(f"T after {seconds:g} s clamped at {OMEGA:g} rad/s, against RK4 at 0.031 ms")
    print(f"{'integrator':14}{'step [ms]':>10}{'error [mm]':>12}{'wall / simulated':>18}")
    for name in INTEGRATORS:
        for steps in STEPS:
            top, wall = drive(robot, name, steps, seconds)
            apart = 1000 * float(np.linalg.norm(top - truth))
            shown = f"{apart:12.4f}" if np.isfinite(apart) else f"{'blew up':>12}"
            print(f"{name.lower():14}{1000 / 120 / steps:10.3f}{shown}{wall / seconds:18.4f}")


def drive(robot: Robot, integrator: str, steps: int, seconds: float) -> tuple[np.ndarray, float]:
    """Return where T is at the end, (3,) [m], NaN after a blow-up, and the time that took [s]."""
    model, data = settle(replace(robot, steps_per_sample=steps), "fixed", np.pi / 2)
    model.opt.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{integrator}")
    data.ctrl[:] = OMEGA
    begin = time.perf_counter()
    mujoco.mj_step(model, data, nstep=round(seconds * 120 * steps))
    wall = time.perf_counter() - begin
    mujoco.mj_forward(model, data)
    # after a blow-up the engine starts again from zero and only counts that
    sane = not any(warning.number for warning in data.warning)
    return np.where(sane, data.body("top").xpos, np.nan), wall


if __name__ == "__main__":
    main()
