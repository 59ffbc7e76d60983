"""A run that is not what its sheet says is told by name; an honest neighbour never is."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from tests.diagnose.filmed import (
    CLAMPED,
    FREE,
    Array,
    Bodies,
    day,
    faults,
    mapped,
    named,
    spoiled,
    told,
)
from workbench.fit import MeasuredRun
from workbench.motion import ROTOR_ANGLE
from workbench.timeseries import TimeSeries

Runs = dict[str, MeasuredRun]


@pytest.fixture(scope="module")
def clamped() -> Runs:
    return day(CLAMPED)


@pytest.fixture(scope="module")
def free() -> Runs:
    return day(FREE)


HONEST_EFFECTS = {
    "nothing": {},
    "a fast, uneven motor": {
        "speed_scale": {"share": 0.02}, "speed_ripple": {"cos_1": 0.08, "sin_2": 0.08},
    },
    "a slow motor that warms up": {
        "speed_offset": {"offset": -0.3}, "speed_drift": {"rate": -0.01},
    },
    "a motor that droops": {"motor_droop": {"slope": 30.0}},
    "a motor that droops far more than expected": {"motor_droop": {"slope": 100.0}},
    "cameras": {
        "camera_tilt": {"tilt": 0.1}, "length_scale": {"share": 0.05},
        "marker_offset": {"forward": 0.01}, "time_offset": {"late": 0.02},
    },
    "another beam": {
        "rest_shape_drift": {"root": 0.06}, "root_play": {"gap": 0.02},
        "hinge_coulomb_friction": {"torque": 0.003}, "hinge_stiffness": {"share": -0.15},
    },
}  # fmt: skip
"""What the runs of one robot have alike, several times as large as is expected."""


@pytest.mark.parametrize("effects", HONEST_EFFECTS.values(), ids=HONEST_EFFECTS)
def test_what_all_runs_have_alike_is_no_fault(effects: dict[str, dict[str, float]]) -> None:
    assert faults(day(CLAMPED, effects, seed=2)) == []


@pytest.mark.parametrize(
    "effects", [{"motor_droop": {"slope": 30.0}}, {"ground_slope": {"slope": 0.05}}]
)
def test_hops_and_drops_of_one_robot_show_no_fault(effects: dict[str, dict[str, float]]) -> None:
    assert faults(day(FREE, effects, seed=2)) == []


def disturbed(run: MeasuredRun, noise: float, seed: int) -> MeasuredRun:
    """Noise on all bodies, 1 % in gaps of five samples, 0.5 % glitches of centimetres."""
    rng = np.random.default_rng(seed)

    def change(paths: Bodies, times: Array) -> Bodies:
        for path in paths.values():
            path += noise * rng.standard_normal(path.shape)
            path[rng.random(len(path)) < 0.005] += rng.uniform(-0.02, 0.02, 3)
            for start in rng.integers(60, len(path), max(1, len(path) // 500)):
                path[start : start + 5] = np.nan
        return paths

    return mapped(run, change)


@pytest.mark.parametrize("noise", [0.0, 1e-3])
def test_noise_gaps_and_glitches_are_no_fault(clamped: Runs, free: Runs, noise: float) -> None:
    for seed, runs in enumerate((clamped, clamped, clamped, free)):
        rough = {
            name: disturbed(run, noise, 10 * seed + k) for k, (name, run) in enumerate(runs.items())
        }
        assert faults(rough) == []


def said(speed: float) -> Callable[[MeasuredRun], MeasuredRun]:
    """The sheet says another speed than was driven."""
    return lambda run: replace(run, steps=((0.0, speed),))


def still(run: MeasuredRun) -> MeasuredRun:
    """The motor was not connected: what stood before time zero stands on."""
    index = np.arange(len(run.motion)) % int((run.motion.times < 0).sum())
    motion = run.motion
    return replace(
        run,
        motion=TimeSeries(motion.times, motion.values[index], motion.names, motion.valid[index]),
    )


def backwards(run: MeasuredRun) -> MeasuredRun:
    """The rotor turns the other way; T, which swings as before, does not tell."""
    turned = np.pi - run.motion[ROTOR_ANGLE]
    return replace(run, motion=run.motion.replaced({ROTOR_ANGLE: turned}))


def stalling(run: MeasuredRun) -> MeasuredRun:
    angle, times = run.motion[ROTOR_ANGLE].copy(), run.motion.times
    angle[times > 1.9] = angle[times > 1.9][0]
    return replace(run, motion=run.motion.replaced({ROTOR_ANGLE: angle}))


def later(seconds: float) -> Callable[[MeasuredRun], MeasuredRun]:
    return lambda run: replace(run, motion=run.motion.shifted(seconds))


def bodies(change: Callable[[Bodies, Array], object]) -> Callable[[MeasuredRun], MeasuredRun]:
    """Change the paths in place, or return others."""

    def apply(paths: Bodies, times: Array) -> Bodies:
        found = change(paths, times)
        return found if isinstance(found, dict) else paths

    return lambda run: mapped(run, apply)


def axes(order: list[int], signs: list[float]) -> Callable[[MeasuredRun], MeasuredRun]:
    return bodies(lambda p, t: {k: path[:, order] * signs for k, path in p.items()})


def exchanged(one: str, other: str, begin: float = -10) -> Callable[[MeasuredRun], MeasuredRun]:
    def change(paths: Bodies, times: Array) -> None:
        now = times > begin
        first = paths[one][now].copy()
        paths[one][now], paths[other][now] = paths[other][now], first
        if begin < -1:
            origin = np.median(paths["foot"][times < 0], axis=0)
            for path in paths.values():
                path -= origin

    return bodies(change)


def moves_foot(paths: Bodies, times: Array) -> None:
    paths["foot"][:, 0] += np.where(times > 0, 0.003 * np.sin(13 * times), 0.0)


def slips(paths: Bodies, times: Array) -> None:
    paths["top"][times > 1.7, 0] += 0.006


def slips_at_night(paths: Bodies, times: Array) -> None:
    paths["top"][:, 2] -= 0.007
    paths["rotor"][:, 2] -= 0.007


def late_rotor(paths: Bodies, times: Array) -> None:
    paths["rotor"][3:] = paths["rotor"][:-3].copy()


def grows(paths: Bodies, times: Array) -> None:
    swing = 0.05 * np.clip(times, 0, None) / 3 * np.sin(13 * times)
    for body in ("top", "rotor"):
        paths[body][:, 0] += swing


def pulled(newton: float) -> Callable[[MeasuredRun], MeasuredRun]:
    return lambda run: replace(run, pull=newton)


LIES = {
    "another speed": ("clamped_15", said(17.0), r"says 17 rad/s, .* turned at 1[45]\.\d\d rad/s"),
    "a little less": ("clamped_15", said(15.6), r"says 15\.6 rad/s, .* \(-[34]\.\d %\)"),
    "a hop's speed": ("hop_17", said(15.0), r"says 15 rad/s, but the rotor turned at 1[67]"),
    "turns a minute": ("clamped_13", said(124.1), "revolutions a minute and rad/s .* exchanged"),
    "a still motor": ("clamped_13", still, "the rotor never turns; was the motor connected"),
    "a reversed motor": ("clamped_13", backwards, "13 rad/s was commanded: the other way"),
    "a stall": ("clamped_15", stalling, "it stalled"),
    "a late take": ("clamped_13", later(0.4), r"begins to turn 0\.[34]\d s after time zero"),
    "an early take": ("clamped_13", later(-0.3), r"begins to turn 0\.\d+ s before time zero"),
    "a late release": ("decay_0.6", later(0.4), r"it is let go 0\.\d+ s after time zero"),
    "a late drop": ("drop_0.02", later(0.3), r"it is let go 0\.\d+ s after time zero"),
    "a loose foot": ("clamped_13", bodies(moves_foot), "said to be clamped but moves by 2"),
    "a hop said to be clamped": (
        "hop_17", lambda run: replace(run, mode="clamped"), "said to be clamped but moves",
    ),
    "a clamped run said to hop": (
        "clamped_17", lambda run: replace(run, mode="hop"), "said to hop but the foot moves by 0",
    ),
    "x and z": ("clamped_13", axes([2, 1, 0], [1, 1, 1]), "if x and z are exchanged"),
    "a mirrored x": ("decay_0.6", axes([0, 1, 2], [-1, 1, 1]), "if forward is backward"),
    "a mirrored z": ("hop_17", axes([0, 1, 2], [1, 1, -1]), "if up is down"),
    "x and y": ("clamped_11", axes([1, 0, 2], [1, 1, 1]), "forward and sideways are exchanged"),
    "T and foot": ("clamped_13", exchanged("top", "foot"), "if foot and T are exchanged"),
    "T and rotor": ("clamped_13", exchanged("top", "rotor"), "if T and rotor are exchanged"),
    "labels swapped on the way": ("clamped_13", exchanged("top", "rotor", 1.5), "T jumps by 3"),
    "labels swapped in a ring-down": ("decay_0.6", exchanged("top", "rotor", 1.5), "T jumps by 3"),
    "a marker that slips": ("clamped_13", bodies(slips), r"jumps by [4-6] mm or more at 1\.7"),
    "a marker that slips in a hop": ("hop_17", bodies(slips), r"jumps by [4-6] mm or more at 1\.7"),
    "a marker moved before": ("clamped_13", bodies(slips_at_night), r"T rests [67]\.\d mm from"),
    "a late rotor": ("clamped_15", bodies(late_rotor), r"seen 3 picture\(s\) \(25 ms\) after T"),
    "another pull": ("decay_0.6", pulled(0.9), r"pulled by 0\.9 N, but .* as 0\.6\d* N would"),
    "a pull in grams": ("decay_0.6", pulled(61.0), r"pulled by 61 N, but it was held"),
    "a swing that grows": ("decay_0.3", bodies(grows), "T swings ever more"),
    "a motor that ran": (
        "clamped_13", lambda run: replace(run, mode="decay", steps=(), pull=0.5), "the rotor turns",
    ),
    "another height": ("drop_0.02", lambda run: replace(run, height=0.05), "says it fell by 50 mm"),
}  # fmt: skip


@pytest.mark.parametrize(("name", "lie", "evidence"), LIES.values(), ids=LIES)
def test_a_run_that_is_not_what_it_is_said_to_be_is_told(
    clamped: Runs, free: Runs, name: str, lie: Callable[[MeasuredRun], MeasuredRun], evidence: str
) -> None:
    found = faults(spoiled(clamped if name in clamped else free, name, lie))
    assert named(found) == {name}

    assert re.search(evidence, told(found, name)), found


@pytest.mark.parametrize("seconds", [-0.09, 0.09])
def test_a_release_found_as_badly_as_lasting_noise_allows_is_no_fault(
    clamped: Runs, seconds: float
) -> None:
    assert faults(spoiled(clamped, "decay_0.3", later(seconds))) == []


def test_names_and_axes_exchanged_in_all_runs_are_told_of_all(clamped: Runs) -> None:
    for lie, evidence in (
        (exchanged("top", "rotor"), "T and rotor are exchanged"),
        (axes([2, 1, 0], [1, 1, 1]), "x and z are exchanged"),
        (bodies(late_rotor), "after T"),
    ):
        found = faults({name: lie(run) for name, run in clamped.items()})
        assert len(named(found)) > len(clamped) / 3  # so none of them is diagnosed
        assert all(evidence in text for _, text in found)
