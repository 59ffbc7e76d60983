"""A run of our own making: a hopping robot and a twin that is a little too fast and too high."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rerun.chunk import Chunk, RrdReader

from workbench.errors import WorkbenchError
from workbench.motion import CORNER_FORCES, misfit, rotor_angle, rotor_speed, summarize
from workbench.report import Comparison, Extended, Figure, HeadlessViewer, Phase
from workbench.timeseries import TimeSeries

FIGURE = Figure(
    foot_length=0.275, foot_width=0.25, beam_length=0.615, beam_root=0.0575, rotor_radius=0.035
)
REST = np.concatenate([[-2.558], np.full(5, 0.12), np.full(6, 0.31), np.full(4, 0.17)])
DURATION_S = 10.0
NOISE_M = 2e-4
WEIGHT_N = 2.5


def make_motion(rate_hz: float, advance_m: float, hop_m: float, speed: float) -> TimeSeries:
    """Hop forward with the rotor's turns from time zero on; the beam nods once a turn."""
    t = np.arange(-2.0, 12.0, 1 / rate_hz)
    driven = np.clip(t, 0.0, DURATION_S)
    phase = speed * np.clip(driven - 0.25 * (1 - np.exp(-4 * driven)), 0.0, None)
    swing = np.minimum(driven, 1.0) * np.where(t < DURATION_S, 1.0, np.exp(DURATION_S - t))
    nod = 0.012 * swing * np.sin(phase)
    hinges = REST + nod[:, None]
    angle = np.cumsum(hinges, axis=1)
    step = FIGURE.beam_length / len(REST)
    foot_x = advance_m * driven / DURATION_S + 0.004 * swing * np.sin(phase)
    foot_z = hop_m * swing * np.clip(np.sin(phase), 0.0, None) ** 2
    pitch = 0.03 * swing * np.sin(phase + 0.5)
    angle += pitch[:, None]
    top_x = foot_x + FIGURE.beam_root * np.cos(pitch) + step * np.cos(angle).sum(axis=1)
    top_z = foot_z - FIGURE.beam_root * np.sin(pitch) - step * np.sin(angle).sum(axis=1)
    turn = phase + 0.8
    still = np.zeros_like(t)
    top = np.column_stack([top_x, still, top_z])
    arm = FIGURE.rotor_radius * np.column_stack([np.cos(turn), still, -np.sin(turn)])
    turned = rotor_angle(top, top + arm)
    columns = {"foot_x_m": foot_x, "foot_y_m": still, "foot_z_m": foot_z, "foot_pitch_rad": pitch}
    columns |= _point("top", top) | _point("rotor", top + arm)
    columns |= {"rotor_angle_rad": turned, "rotor_speed_rad_s": rotor_speed(t, turned)}
    columns |= {f"hinge_{k}_rad": hinges[:, k] for k in range(len(REST))}
    return TimeSeries.of(t, columns)


def _point(name: str, path: np.ndarray) -> dict[str, np.ndarray]:
    return {f"{name}_{axis}_m": path[:, i] for i, axis in enumerate("xyz")}


def as_measured(motion: TimeSeries, seed: int = 7) -> TimeSeries:
    """Leave what cameras see, with 0.2 mm of noise; T is lost for 0.4 s, the foot for 0.1 s."""
    seen = motion.select(motion.names[: motion.names.index("hinge_0_rad")])
    noise = np.random.default_rng(seed).normal(0.0, NOISE_M, seen.values.shape)
    columns = {name: seen[name].copy() for name in seen.names}
    for i, name in enumerate(seen.names):
        columns[name] += noise[:, i] if name.endswith("_m") else 0.0
        lost = {"top": (4.0, 4.4), "foot": (6.0, 6.1)}.get(name.split("_")[0])
        if lost is not None:
            columns[name][(seen.times >= lost[0]) & (seen.times < lost[1])] = np.nan
    return TimeSeries.of(seen.times, columns)


def on_ground(motion: TimeSeries) -> TimeSeries:
    """Add the ground's forces: the robot's weight on four corners, none while the foot is up."""
    down = motion["foot_z_m"] < 1e-4
    columns = {name: motion[name] for name in motion.names}
    columns |= {
        name: np.where(down, WEIGHT_N / 4, 0.0) if name.endswith("_z_N") else np.zeros(len(motion))
        for corner in CORNER_FORCES
        for name in corner
    }
    return TimeSeries.of(motion.times, columns)


def make_supply() -> TimeSeries:
    """Read a supply ten times a second: 4.52 V asked for during the drive."""
    t = np.arange(-2.0, 12.0, 0.1)
    asked = np.where((t > 0) & (t < DURATION_S), 4.52 * np.clip(t / 0.5, 0, 1), 0.0)
    current = 0.11 * asked / 4.52 + 0.01 * np.sin(9 * t) * (asked > 0)
    columns = {"set_voltage_V": asked, "voltage_V": asked - 0.03 * (asked > 0)}
    return TimeSeries.of(t, columns | {"current_A": current})


def make_comparison(title: str = "Initial shape at 17 rad/s") -> Comparison:
    """Return the whole story as the engine would hand it over."""
    real = as_measured(make_motion(120.0, 0.213, 0.016, 16.9))
    twin = on_ground(make_motion(200.0, 0.248, 0.019, 17.0))
    return Comparison(
        title=title,
        run="2026-11-21_0001_hop-17",
        mode="hop",
        real=real,
        twin=twin,
        duration_s=DURATION_S,
        phases=(Phase(-2, "rest"), Phase(0, "ramp"), Phase(0.5, "hold"), Phase(10, "off")),
        figure=FIGURE,
        real_summary=summarize(real, DURATION_S),
        twin_summary=summarize(twin, DURATION_S),
        misfit=misfit(real, twin, DURATION_S),
        supply=make_supply(),
        facts={
            "Protocol": "hop at 17 rad/s for 10 s",
            "Model": "thesis",
            "Shape": "thesis-initial (unloaded)",
            "Take": "hop_17.csv",
            "SHA-256": "9f2c44d1a0b5e7c8d6f1029384756aabbccddeeff00112233445566778899aabb",
        },
        log=((-2.0, "rest begins"), (0.0, "set 4.52 V, read back 4.52 V"), (10.0, "output off")),
        warnings=("T was not seen for 0.4 s",),
        noise=dict.fromkeys(("foot_x_m", "foot_z_m", "top_x_m", "top_z_m"), NOISE_M),
        label=("hop", "17 rad/s", "thesis-initial", "repeat 1"),
        protocol="schema: workbench/protocol-1\ntitle: Hop at 17 rad/s\n",
    )


@pytest.fixture(scope="session")
def comparison() -> Comparison:
    return make_comparison()


@pytest.fixture(scope="session")
def three() -> Comparison:
    """The same run with the twin of an extended model, which is nearer to the robot."""
    comparison = make_comparison()
    motion = make_motion(150.0, 0.216, 0.0165, 16.9)
    extended = Extended(
        model="sloped",
        motion=motion,
        summary=summarize(motion, DURATION_S),
        misfit=misfit(comparison.real, motion, DURATION_S),
    )
    return replace(comparison, extended=extended)


@pytest.fixture(scope="module")
def chunks(recording: Path) -> list[Chunk]:
    """What stands in the recording that a module makes."""
    return RrdReader(recording).stream().to_chunks()


@pytest.fixture(scope="module")
def viewer(recording: Path) -> Iterator[HeadlessViewer]:
    """The headless viewer with the recording that a module makes."""
    with ExitStack() as stack:
        try:
            headless = stack.enter_context(HeadlessViewer(width=1600, height=1000))
        except WorkbenchError as error:
            pytest.skip(f"no headless viewer here: {error}")
        headless.open(recording)
        yield headless
