"""Compare MuJoCo's integrators and our own on the twin: error of T, what a flight loses, and time.

    python benchmarks/integrators.py [--quick]

Clamped, 8 s at 14 rad/s and at 10, nearer to the beam's resonance; the reference is Runge-Kutta at
an eighth of the step in use. `chain` is that of `workbench.sim.chain_step`. In flight,
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

from workbench.motion import TOP, position
from workbench.schemas import load_model, load_shape
from workbench.sim import (
    SAMPLE_RATE_HZ,
    Condition,
    Robot,
    at_rest,
    compile_model,
    make_robot,
    settle,
    simulate,
)

SPEEDS = (10.0, 14.0)
CHAIN = "CHAIN"
INTEGRATORS = ("EULER", "IMPLICIT", "IMPLICITFAST", "DISCRETE", "RK4")
STEPS = (17, 34, 68)
FLIGHT_S = 0.2
KEPT = 1e-6


def main() -> None:
    """Print one row for each integrator and step."""
    seconds = 1.0 if "--quick" in sys.argv else 8.0
    quiet = mujoco.MjLogConfig.get()
    quiet.logto_file = quiet.logto_console = False
    quiet.set()
    here = Path()
    shape = load_shape("thesis-initial", here).content
    robot = make_robot(load_model("thesis", here).content.values(), shape)
    drive(robot, CHAIN, 34, SPEEDS[0], 0.1)  # compiles
    truths = {speed: drive(robot, "RK4", 272, speed, seconds)[0] for speed in SPEEDS}
    print(f"T in {seconds:g} s clamped [mm rms], against RK4 at 0.031 ms")
    speeds = "".join(f"{f'{speed:g} rad/s':>12}" for speed in SPEEDS)
    print(f"{'integrator':14}{'step [ms]':>10}{speeds}{'wall / simulated':>18}")
    for name, steps in product((*INTEGRATORS, CHAIN), STEPS):
        shown, spent = "", 0.0
        for speed, truth in truths.items():
            top, wall = drive(robot, name, steps, speed, seconds)
            apart = 1000 * float(np.sqrt(np.mean(np.sum((top - truth) ** 2, axis=1))))
            shown += f"{apart:12.4f}" if np.isfinite(apart) else f"{'blew up':>12}"
            spent += wall / seconds / len(SPEEDS)
        print(f"{name.lower():14}{1000 / 120 / steps:10.3f}{shown}{spent:18.4f}")
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


def drive(
    robot: Robot, integrator: str, steps: int, speed: float, seconds: float
) -> tuple[np.ndarray, float]:
    """Return T at each sample, (n, 3) [m], NaN after a blow-up, and the time that took [s]."""
    count, stepped = round(seconds * SAMPLE_RATE_HZ), replace(robot, steps_per_sample=steps)
    condition = Condition("clamped", np.full(count + 1, speed))  # the first sample is the start
    begin = time.perf_counter()
    if integrator == CHAIN:
        motion = simulate(stepped, condition).motion
        return position(motion, TOP)[1:], time.perf_counter() - begin
    model, data = at_rest(stepped, condition)
    model.opt.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{integrator}")
    data.ctrl[:] = speed
    top, paths = data.body("top"), np.full((count, 3), np.nan)
    for path in paths:
        mujoco.mj_step(model, data, nstep=steps)
        mujoco.mj_kinematics(model, data)
        if any(warning.number for warning in data.warning):
            break  # it starts again from zero and only counts that
        path[:] = top.xpos
    return paths, time.perf_counter() - begin


if __name__ == "__main__":
    main()
