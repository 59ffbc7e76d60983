"""What `diagnose --rig` says of three machines that others measured and published.

    python benchmarks/measured.py --data FOLDER [--only emps servo dfki] [--keep FOLDER]

FOLDER holds a checkout of each repository below, under its own name; one that is absent is left
out, with the command that gets it. The models are those that somebody would write who has weighed
and measured the parts and knows nothing of what is wrong. What is right is known from papers or by
a fit of our own in scipy, beside the answer in one table. Each diagnosis is a process of its own,
so its time and memory are seen from outside.
"""

from __future__ import annotations

import argparse
import csv
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import scipy.io
from numpy.typing import NDArray

Array = NDArray[np.float64]
PYTHON = [sys.executable, "-c", "from workbench.cli import main; main()"]


class Known(NamedTuple):
    """A number that the machine is known to have.

    Args:
        cause: as the diagnosis calls it.
        low: least and
        high: greatest value that published figures or a fit of our own leave, SI.
        source: of it.
    """

    cause: str
    low: float
    high: float
    source: str


class Machine(NamedTuple):
    """A measured machine.

    Args:
        source: repository and commit.
        prepare: writes rig and tables: (checkout, folder).
        known: what is right.
        never: causes that must not be named: what was weighed.
        ours: held-out error of the right model by an independent fit, base and extended, and unit.
    """

    source: str
    prepare: Callable[[Path, Path], None]
    known: tuple[Known, ...]
    never: tuple[str, ...]
    ours: str


def emps(data: Path, out: Path) -> None:
    """Write the electro-mechanical positioning system: a carriage on a ball screw, force-driven.

    Encoder and force at 1 kHz for 25 s, in closed loop; the second record has pulses of force.
    """
    folder = data / "examples" / "EMPS" / "data"
    for name, file in (("sweep", "DATA_EMPS"), ("pulses", "DATA_EMPS_PULSES")):
        read = scipy.io.loadmat(folder / f"{file}.mat")
        times = read["t"][:, 0]
        place, volts = read["qm"][:, 0], read["vir"][:, 0]
        force = float(read["gtau"][0, 0]) * volts  # pulses of force are part of the voltage
        for k, (begin, end) in enumerate(((0.0, 12.0), (12.0, 24.0))):
            part = (times >= begin) & (times < end)
            own = times[part] - times[part][0]
            table(out / f"{name}-{k + 1}.csv", time_s=own[::5], place_m=place[part][::5])
            table(out / f"{name}-{k + 1}-force.csv", time_s=own, force_N=force[part])
    (out / "model.xml").write_text(
        '<mujoco model="positioning axis">\n'
        '  <option timestep="0.001" gravity="0 0 0" integrator="implicitfast"/>\n'
        '  <worldbody><body name="carriage">\n'
        '    <joint name="screw" type="slide" axis="1 0 0" damping="203.5"/>\n'
        '    <geom type="box" size="0.1 0.1 0.1" mass="95.1"/>\n'
        "  </body></worldbody>\n"
        '  <actuator><motor name="drive" joint="screw"/></actuator>\n'
        "</mujoco>\n"
    )
    runs = "\n".join(
        f"  - {{data: {name}-{k}.csv, inputs: {name}-{k}-force.csv, mode: {name}, "
        f"start: {{screw: free}}{', role: held_out' if name == 'pulses' else ''}}}"
        for name in ("sweep", "pulses")
        for k in (1, 2)
    )
    (out / "rig.yaml").write_text(f"""\
schema: workbench/rig-1
name: positioning axis
model: model.xml
parameters:
  - {{body: carriage, field: mass, tolerance: 5, unit: kg}}
  - {{joint: screw, field: damping, tolerance: 40, unit: N s/m}}
channels:
  place: {{joint: screw, column: place_m}}
inputs:
  force: {{actuator: drive, column: force_N, between: held}}
runs:
{runs}
effects:
  joints:
    screw: {{coulomb_friction: 20, quadratic_damping: 100, cubic_damping: 500, stiffness: 50,
            cubic_stiffness: 200}}
  bodies:
    carriage: {{mass: 10}}
  channels:
    place: {{gain: 0.01, delay: 0.005}}
  inputs:
    force: {{offset: 5, gain: 0.1, delay: 0.005, lag: 0.005}}
""")


def servo(data: Path, out: Path) -> None:
    """Write a hobby servo's arm, held level, switched off and dropped under gravity; 50 Hz.

    Mass and centre of mass are those of `src/sysid/desc/robot.xml` with its meshes.
    """
    folder = data / "src" / "sysid" / "dataset"
    runs = []
    for k in range(1, 5):
        (one,) = json.loads((folder / f"drop-response-{k}.json").read_text())["data"]
        angle = np.pi * np.array(one["sensor_data"])  # a reading of 1 is half a turn
        off = one["actions"].index(None)
        last = min(len(angle), off + 75)
        table(out / f"drop-{k}.csv", time_s=np.arange(last) / 50.0, angle_rad=angle[:last])
        role = ", role: held_out" if k == 4 else ""
        runs.append(
            f"  - {{data: drop-{k}.csv, mode: drop, begins: {off / 50:g} s, late: 0.04 s, "
            f"start: {{servo: held}}{role}}}"
        )
    (out / "model.xml").write_text(
        '<mujoco model="servo arm">\n'
        '  <option timestep="0.002" gravity="0 0 -9.81" integrator="implicitfast"/>\n'
        '  <worldbody><body name="arm">\n'
        '    <joint name="servo" type="hinge" axis="0 -1 0" frictionloss="0.1" armature="0.005"/>\n'
        '    <inertial pos="0.1683 0 0.0001" mass="0.354" diaginertia="0.0004 0.0005 0.0004"/>\n'
        "  </body></worldbody>\n"
        "</mujoco>\n"
    )
    (out / "rig.yaml").write_text(
        """\
schema: workbench/rig-1
name: servo arm
model: model.xml
parameters:
  - {body: arm, field: mass, tolerance: 0.02, unit: kg}
channels:
  angle: {joint: servo, column: angle_rad}
runs:
"""
        + "\n".join(runs)
        + """
effects:
  joints:
    servo: {coulomb_friction: 0.2, damping: 0.05, quadratic_damping: 0.02, cubic_damping: 0.01,
            armature: 0.02}
  bodies:
    arm: {mass: 0.05}
  channels:
    angle: {offset: 0.02, gain: 0.01, delay: 0.02}
"""
    )


def dfki(data: Path, out: Path) -> None:
    """Write the torque-limited pendulum: swings by four controllers, up to the upright position.

    Angle, speed and torque by the motor's own sensors, 200 to 500 Hz. Masses and lengths are those
    of `hardware/testbench_description.md`; the rotor's inertia through the gear of 6:1.
    """
    results = data / "results"
    cuts = {
        "ddp": ("control_method_ddp", 0.0, 3.0, "train"),
        "collocation": ("control_method_direct_collocation", 0.0, 2.4, "train"),
        "energy": ("control_method_energy_shaping", 0.0, 3.5, "train"),
        "sac": ("control_method_sac", 0.0, 3.5, "held_out"),
    }
    runs = []
    for name, (folder, begin, end, role) in cuts.items():
        read = np.genfromtxt(results / folder / "data_measured.csv", delimiter=",", names=True)
        part = (read["time"] >= begin) & (read["time"] < end)
        times = read["time"][part]
        every = max(0.005, round(float(np.median(np.diff(times))), 3))
        grid = np.arange(0.0, times[-1] - times[0], every)
        seen = {
            f"{key}_{unit}": np.interp(grid, times - times[0], read[key][part])
            for key, unit in (("position", "rad"), ("velocity", "rad_s"), ("torque", "Nm"))
        }
        table(out / f"{name}.csv", time_s=grid, **seen)
        runs.append(f"  - {{data: {name}.csv, mode: swing, start: {{pivot: free}}, role: {role}}}")
    (out / "model.xml").write_text(
        '<mujoco model="pendulum">\n'
        '  <option timestep="0.001" gravity="0 0 -9.81" integrator="RK4"/>\n'
        '  <worldbody><body name="rod" pos="0 0 1">\n'
        '    <joint name="pivot" type="hinge" axis="0 -1 0" armature="0.002186"/>\n'
        '    <inertial pos="0 0 -0.24" mass="0.13" diaginertia="0.003 0.003 0.00001"/>\n'
        '    <body name="bob" pos="0 0 -0.5">\n'
        '      <inertial pos="0 0 0" mass="0.546" diaginertia="0.0003 0.0003 0.0003"/>\n'
        "    </body>\n"
        "  </body></worldbody>\n"
        '  <actuator><motor name="motor" joint="pivot"/></actuator>\n'
        "</mujoco>\n"
    )
    (out / "rig.yaml").write_text(
        """\
schema: workbench/rig-1
name: pendulum
model: model.xml
parameters:
  - {body: bob, field: mass, tolerance: 0.01, unit: kg}
channels:
  angle: {joint: pivot, column: position_rad, noise: 0.001}   # scatter about a smooth curve
  speed: {joint: pivot, quantity: velocity, column: velocity_rad_s, noise: 0.15}
inputs:
  torque: {actuator: motor, column: torque_Nm}
runs:
"""
        + "\n".join(runs)
        + """
effects:
  joints:
    pivot: {coulomb_friction: 0.1, damping: 0.05, quadratic_damping: 0.02, armature: 0.005}
  bodies:
    bob: {mass: 0.05}
  channels:
    angle: {offset: 0.02, gain: 0.02, delay: 0.005}
  inputs:
    torque: {offset: 0.05, gain: 0.1, delay: 0.01, lag: 0.01}
"""
    )


MACHINES = {
    "emps": Machine(
        "forgi86/sysid-neural-continuous 956aa7e",
        emps,
        (
            Known("screw_coulomb_friction", 18.0, 22.5, "20.4 N, the data's own scripts"),
            Known("force_offset", 2.5, 4.0, "3.16 N, the same"),
        ),
        ("carriage_mass",),
        "6.3 -> 1.97 mm",
    ),
    "servo": Machine(
        "mauicv/servo-sysid e4a4840",
        servo,
        (
            Known("servo_coulomb_friction", 0.28, 0.38, "0.33 N m, least squares in scipy"),
            Known("servo_armature", 0.015, 0.025, "0.018 to 0.022 kg m2, the same"),
        ),
        ("arm_mass",),
        "4.9 mrad with the right model",
    ),
    "dfki": Machine(
        "dfki-ric-underactuated-lab/torque_limited_simple_pendulum ed17ea2",
        dfki,
        (
            Known("pivot_coulomb_friction", 0.14, 0.2, "0.18 N m, its report; 0.16 to 0.18"),
            Known("torque_gain", -0.11, -0.05, "-7 to -9 %, least squares in scipy"),
        ),
        ("bob_mass",),
        "44 -> 30 mrad",
    ),
}


def table(path: Path, **columns: Array) -> None:
    """Write columns of one length as a CSV file."""
    with path.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        writer.writerows(
            [f"{value:.9g}" for value in row] for row in zip(*columns.values(), strict=True)
        )


def diagnosed(folder: Path) -> tuple[dict[str, Any], float, float, float]:
    """Return the answer to a rig, wall and processor seconds, and the memory at its most [GB]."""
    command = [*PYTHON, "diagnose", "--rig", str(folder / "rig.yaml"), "--json"]
    out = tempfile.mkdtemp(prefix="out-", dir=folder)  # a model is never written over
    begin = time.perf_counter()
    with (folder / "answer.json").open("w") as answer, (folder / "log.txt").open("w") as log:
        process = subprocess.Popen([*command, "--out", out], stdout=answer, stderr=log)
        _, status, used = os.wait4(process.pid, 0)
    wall = time.perf_counter() - begin
    text = (folder / "answer.json").read_text()
    if not text:
        code = os.waitstatus_to_exitcode(status)
        raise SystemExit(f"{folder}: exit {code}: {(folder / 'log.txt').read_text()[-2000:]}")
    return json.loads(text), wall, used.ru_utime + used.ru_stime, used.ru_maxrss / 1e6


def rows(machine: Machine, answer: dict[str, Any]) -> list[str]:
    """Return what is known of a machine beside what was answered, a line each."""
    causes = {one["effect"]: one["parameters"] for one in answer["causes"]}
    lines = []
    for known in machine.known:
        text, judged = "not among the causes", "MISSED"
        for found in causes.get(known.cause, {}).values():
            low, high = found["interval90"]
            text = f"{found['value']:.4g} ({low:.4g} to {high:.4g})"
            judged = "right" if known.low <= found["value"] <= known.high else "WRONG SIZE"
        lines.append(f"  {known.cause:24} {known.source:38} {text:30} {judged}")
    lines += [
        f"  {name:24} {'weighed; must not be a cause':38} {'in the answer':30} WRONG"
        for name in machine.never
        if name in causes
    ]
    more = sorted(set(causes) - {one.cause for one in machine.known} - set(machine.never))
    lines += [f"  {name:24} {'not known to be there':38} {causes[name]}" for name in more]
    return lines


def main(arguments: Sequence[str] | None = None) -> int:
    """Diagnose the machines whose data are there, and print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--data", type=Path, required=True, help="folder of the checkouts")
    parser.add_argument("--only", nargs="+", choices=sorted(MACHINES), default=list(MACHINES))
    parser.add_argument("--keep", type=Path, help="folder that rigs and answers are kept in")
    given = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as temporary:
        for name in given.only:
            machine = MACHINES[name]
            repository, commit = machine.source.split()
            checkout = given.data / repository.split("/")[1]
            if not checkout.is_dir():
                print(
                    f"{name}: left out, {checkout} is not there; git clone "
                    f"https://github.com/{repository} {checkout} && git -C {checkout} checkout "
                    f"{commit}"
                )
                continue
            folder = (given.keep or Path(temporary)) / name
            folder.mkdir(parents=True, exist_ok=True)
            machine.prepare(checkout, folder)
            answer, wall, processor, memory = diagnosed(folder)
            print(f"{name}: {answer['answer']}: {answer['reason']}")
            print("\n".join(rows(machine, answer)))
            error = answer["rmse_mm"]
            print(
                f"  held out: base {error['base']:.4g}, extended {error['extended']:.4g}, noise "
                f"{error['noise_floor']:.4g}; own fit: {machine.ours}"
            )
            print(f"  {wall:.0f} s, {processor:.0f} CPU s, {memory:.2f} GB", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
