"""The default recipe against motions of the twin, filmed with noise, gaps and glitches."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np
import pytest

from workbench.motion import FOOT, ROTOR, ROTOR_ANGLE, TOP
from workbench.run import load_bench
from workbench.run.virtual import film, move
from workbench.schemas import load_model, load_shape
from workbench.sim import make_robot
from workbench.tracking import Axes, BodyNames, SampleStatus, make_track, mean_speed

NOISE_M = 2e-4
WITHIN = 1.2
SPEED_WITHIN = 1e-3


@pytest.mark.parametrize(("mode", "speed"), [("hop", 17.0), ("clamped", 17.0)])
def test_positions_and_speed_stay_within_the_bars(
    mode: Literal["hop", "clamped"], speed: float, tmp_path_factory: pytest.TempPathFactory
) -> None:
    bench, here = load_bench("virtual").content, tmp_path_factory.mktemp("here")
    assert bench.virtual is not None
    section = bench.virtual.model_copy(update={"noise": NOISE_M, "gap_share": 0.02, "seed": 4})
    values = load_model("thesis", here).content.values()
    robot = make_robot(values, load_shape("thesis-initial", here).content)
    volts = (speed - section.motor_offset) / section.motor_slope
    truth = move(robot, mode, [(-1.0, 0.0), (1.0, volts)], 8.0, section)
    rng = np.random.default_rng(4)
    take = film(truth, bench.tracking, section, rng)
    bodies = dict(take.bodies)
    for name, body in take.bodies.items():
        aside = np.zeros((len(take), 3))
        for start, length, size in ((300, 1, 0.006), (500, 2, 0.03), (700, 1, 0.3), (850, 4, 0.01)):
            way = rng.normal(size=3)
            aside[start : start + length] = size * way / np.linalg.norm(way)
        bodies[name] = replace(
            body, measured=body.measured + aside[:, None], solved=body.solved + aside[:, None]
        )
    cameras = bench.tracking
    track = make_track(
        replace(take, bodies=bodies),
        bodies=BodyNames(),
        axes=Axes(up=cameras.axes.up, forward=cameras.axes.forward),
        markers={name: np.array(places) for name, places in cameras.markers.items()},
    )
    for role, names in (("foot", FOOT), ("top", TOP), ("rotor", ROTOR)):
        apart = track.motion.select(names).values - truth.select(names).values
        apart -= np.median(apart[:100], axis=0)
        valid = track.motion.validity(names[0])
        assert np.mean(valid) > 0.95
        assert np.sqrt(np.mean(apart[valid] ** 2)) < WITHIN * NOISE_M
        rejected = np.flatnonzero(track.raw_missing[role] == SampleStatus.GLITCH)
        seen = track.raw_missing[role] != SampleStatus.LOST
        glitches = [i for i in (300, 500, 501, 700, 850, 851, 852, 853) if seen[i]]
        assert set(glitches) <= set(rejected.tolist())
    found = mean_speed(track.motion.times, track.motion[ROTOR_ANGLE], 2.0)
    assert found.value == pytest.approx(speed, rel=SPEED_WITHIN)
    assert track.warnings == ()
