"""What the cameras of the virtual bench see is what the true robot did."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from workbench.hw import draw_current
from workbench.motion import FOOT, PITCH, ROTOR, ROTOR_ANGLE, ROTOR_SPEED, TOP, position, release
from workbench.run import load_bench
from workbench.run.virtual import film, let_go, move, true_robot
from workbench.schemas import BenchFile, VirtualSection, load_model, load_shape
from workbench.sim import Condition, make_robot
from workbench.timeseries import TimeSeries
from workbench.tracking import (
    Axes,
    BodyNames,
    SampleStatus,
    guess_bodies,
    make_track,
    raw_points,
    read_take,
    write_motive,
    write_row,
)


@pytest.fixture(scope="module")
def bench() -> BenchFile:
    return load_bench("virtual").content


def section(bench: BenchFile, **changed: object) -> VirtualSection:
    assert bench.virtual is not None
    return bench.virtual.model_copy(update=changed)


def seeded(seed: int = 3) -> np.random.Generator:
    return np.random.default_rng(seed)


@pytest.fixture(scope="module")
def motion(bench: BenchFile, tmp_path_factory: pytest.TempPathFactory) -> TimeSeries:
    """A true robot at rest for 1 s, then driven at 4.52 V."""
    here = tmp_path_factory.mktemp("here")
    values = load_model("thesis", here).content.values()
    robot = make_robot(values, load_shape("thesis-initial", here).content)
    return move(robot, "hop", [(-1.0, 0.0), (1.0, 4.52)], 4.0, section(bench))


def test_a_noiseless_take_gives_the_true_motion_back(bench: BenchFile, motion: TimeSeries) -> None:
    take = film(motion, bench.tracking, section(bench, noise=0.0, gap_share=0.0), seeded())
    cameras = bench.tracking
    track = make_track(
        take,
        bodies=BodyNames("Foot", "T", "Rotor"),
        axes=Axes(up=cameras.axes.up, forward=cameras.axes.forward),
        markers={name: np.array(places) for name, places in cameras.markers.items()},
        recipe="default",
    )
    seen = track.motion.between(-0.5, 2.5)
    true = motion.shifted(-track.zero_in_take_s).at(seen.times)
    for point in (FOOT, TOP, ROTOR):
        apart = position(seen, point) - position(true, point)
        assert np.sqrt(np.mean(apart**2)) < 3e-4  # the recipe's low pass is all that differs
    tilt = true[PITCH] - true[PITCH][0]
    assert np.ptp(tilt) > 0.05
    assert seen[PITCH] == pytest.approx(tilt, abs=0.01)
    assert track.start_angle_rad == pytest.approx(np.pi / 2, abs=1e-3)


def test_noise_and_gaps_are_as_the_bench_file_says(bench: BenchFile, motion: TimeSeries) -> None:
    quiet = film(motion, bench.tracking, section(bench, noise=0.0, gap_share=0.0), seeded())
    noisy = film(motion, bench.tracking, section(bench, noise=0.0002, gap_share=0.05), seeded())
    foot, true = noisy.bodies["Foot"], quiet.bodies["Foot"]
    error = foot.measured - true.measured
    assert np.nanstd(error) == pytest.approx(0.0002, rel=0.05)
    hidden = np.mean([np.isnan(b.measured).mean() for b in noisy.bodies.values()])
    assert 0.01 < hidden < 0.1
    lost = foot.missing == SampleStatus.LOST
    assert np.isfinite(foot.solved).all()  # frozen while lost, as the tracker leaves them
    assert np.isnan(foot.position[lost]).all()


@pytest.mark.parametrize("places_given", [True, False])
@pytest.mark.parametrize("version", ["row 1.0", "row 1.1", "motive 1.21", "motive 1.25"])
def test_hidden_markers_move_no_body(
    bench: BenchFile, motion: TimeSeries, tmp_path: Path, version: str, places_given: bool
) -> None:
    cameras = bench.tracking
    axes = Axes(up=cameras.axes.up, forward=cameras.axes.forward)
    places = {name: np.array(p) for name, p in cameras.markers.items()} if places_given else None
    take = film(motion, cameras, section(bench, gap_share=0.1), seeded(4))
    flavour, number = version.split()
    write = write_row if flavour == "row" else write_motive
    write(take, tmp_path / "x.csv", number)  # type: ignore[arg-type]
    exact = film(motion, cameras, section(bench, noise=0.0, gap_share=0.0), seeded(4))
    seen = raw_points(read_take(tmp_path / "x.csv"), BodyNames(), axes, places)
    true = raw_points(exact, BodyNames(), axes, places)
    assert seen.warnings == ()
    for role, body in seen.bodies.items():
        off = np.linalg.norm(body.position - true.bodies[role].position, axis=1)
        assert np.nanmax(off) < 1.2e-3, role
        told = np.isfinite(off)
        assert told[take.bodies[body.name].seen].all()
        assert np.array_equal(told, body.missing == SampleStatus.SEEN)
    if flavour == "motive":  # row formats give no markers of a body that the tracker lost
        assert seen.top.bridged.sum() > 5
    assert guess_bodies(take) == BodyNames()


def test_the_motor_follows_the_terminals_with_its_lag(motion: TimeSeries) -> None:
    before, after = motion.between(0, 0.9), motion.between(2.5, 4.0)
    assert np.ptp(before[ROTOR_ANGLE]) < 1e-3
    assert np.mean(after[ROTOR_SPEED]) == pytest.approx(4.38 * 4.52 - 2.87, abs=0.3)
    halfway = np.interp(1.05, motion.times, motion[ROTOR_ANGLE]) - np.pi / 2
    lagging = 16.93 * (0.05 - 0.05 * (1 - np.exp(-1)))  # integral of a first-order rise
    assert halfway == pytest.approx(lagging, rel=0.1)


def test_no_voltage_draws_no_current() -> None:
    assert draw_current(0.0) == 0.0
    assert 0.2 < draw_current(4.5) < 0.5


def test_a_person_lets_go_a_moment_after_being_asked(bench: BenchFile) -> None:
    here = Path()
    model, shape = load_model("thesis", here).content, load_shape("thesis-initial", here).content
    robot = true_robot(model, shape, section(bench, increments=24))
    assert len(robot.hinges) == 24
    held = Condition("decay", np.zeros(0), pull=0.39)
    motion = let_go(robot, held, asked=1.0, duration=4.0, rng=seeded())
    assert motion.times[-1] == pytest.approx(4.0)
    way = motion[TOP[0]] - motion[TOP[0]][0]
    assert np.abs(way[motion.times < 1.2]).max() == 0  # pulled and still
    assert np.abs(way[motion.times > 2.4]).max() > 0.02
    again = let_go(robot, held, asked=1.0, duration=4.0, rng=np.random.default_rng(4))
    found = [release(m.times, position(m, TOP)) or 0.0 for m in (motion, again)]
    assert all(1.2 < zero < 2.2 for zero in found)
    assert abs(found[0] - found[1]) > 0.01
