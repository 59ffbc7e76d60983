"""Compare MuJoCo's integrators on the twin: error of T clamped, what a free flight loses, and time.

    python benchmarks/integrators.py [--quick]

Clamped, 10 s at 14 rad/s; the reference is Runge-Kutta at an eighth of the step in use. In flight,
0.2 s without damping and motor: momentum, spin about the centre of mass and energy should stay.
docs/decisions/0006-step.md has the choice.
"""

from __future__ import annotations

import sys
import time
from dataclasses import replace
from itertools import product
from pathlib import Path

import mujoco
import numpy as np

from workbench.schemas import load_model, load_shape
from workbench.sim import Robot, compile_model, make_robot, settle

OMEGA = 14.0
INTEGRATORS = ("EULER", "IMPLICIT", "IMPLICITFAST", "DISCRETE", "RK4")
STEPS = (17, 34, 68)
FLIGHT_S = 0.2
KEPT = 1e-6


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
    print_flights(robot)


def print_flights(robot: Robot) -> None:
    """Print what a flight of 0.2 s loses by each integrator and step, beside the bar of 1e-6."""
    print(f"\nshare lost in a flight of {FLIGHT_S:g} s without damping; bar {KEPT:g}")
    print(f"{'integrator':14}{'step [ms]':>10}{'momentum':>12}{'spin':>12}{'energy':>12}")
    undamped = replace(robot, values={**robot.values, "hinge_damping": 0.0, "root_damping": 0.0})
    for name, steps in product(("IMPLICITFAST", "RK4"), (68, 136, 272, 1088)):
        lost = flown(replace(undamped, steps_per_sample=steps), name)
        shown = "".join(f"{share:12.1e}" for share in lost)
        print(f"{name.lower():14}{1000 / 120 / steps:10.3f}{shown}  {'met' * (max(lost) < KEPT)}")


def flown(robot: Robot, integrator: str) -> tuple[float, ...]:
    """Return the shares of momentum, spin and energy that a thrown robot loses.

    Energy is set beside the kinetic one, as the zero of the potential energy is anywhere.
    """
    model = compile_model(robot, "free")
    model.opt.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{integrator}")
    model.opt.enableflags |= int(mujoco.mjtEnableBit.mjENBL_ENERGY)
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)
    data = mujoco.MjData(model)
    data.qpos[:] = settle(robot, "free", np.pi / 2)[1].qpos
    data.qpos[2] = 1.0
    data.qvel[:6] = [0.3, 0.1, 0.5, 0.2, 1.0, 0.4]
    data.joint("rotor").qvel[:] = 17.0
    states = []
    for steps in (0, round(FLIGHT_S / model.opt.timestep)):
        if steps:
            mujoco.mj_step(model, data, nstep=steps)
        mujoco.mj_forward(model, data)
        mujoco.mj_subtreeVel(model, data)
        momentum = model.body_subtreemass[0] * (
            data.subtree_linvel[0] - model.opt.gravity * data.time
        )
        states.append((momentum, data.subtree_angmom[0].copy(), data.energy.sum()))
    scales = [np.linalg.norm(states[0][0]), np.linalg.norm(states[0][1]), data.energy[1]]
    return tuple(
        float(np.linalg.norm(np.subtract(after, before)) / scale)
        for before, after, scale in zip(*states, scales, strict=True)
    )


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
