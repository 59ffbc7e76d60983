"""Runs on the virtual bench, good ones and those that are cut off; the output always ends off."""

from __future__ import annotations

from collections.abc import Iterator
from decimal import Decimal
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from tests.bundles import journal_of, manifest_of, report_of
from workbench.bundle import Bundle, verify
from workbench.errors import HardwareError, InputError, Interrupted, SafetyStop, WorkbenchError
from workbench.hw import SimulatedFault
from workbench.run import Experiment, QuietOperator, carry_out, load_bench
from workbench.run.bench import VirtualBench
from workbench.schemas import Protocol, load, load_model, load_shape, make_plan

STEPS = "  - prompt: Ready?\n  - run: {mode: hop, speed: 17 rad/s, rest: 1 s, duration: 2 s}\n"
DECAY = "  - run: {mode: decay, pull: 0.39 N, rest: 1 s, duration: 3 s}\n"


def experiment(folder: Path, steps: str = STEPS) -> Experiment:
    path = folder / "p.yaml"
    path.write_text(f"schema: workbench/protocol-1\ntitle: Test\nsteps:\n{steps}")
    protocol, bench = load(path, Protocol), load_bench("virtual")
    plan = make_plan(protocol, bench.content, Decimal("0.01"))
    model, shape = load_model("thesis", folder), load_shape("thesis-initial", folder)
    return Experiment(protocol, bench, model, shape, plan)


@pytest.fixture
def bench() -> VirtualBench:
    return VirtualBench(load_bench("virtual").content)


def runs(
    folder: Path, bench: VirtualBench, steps: str = STEPS, operator: QuietOperator | None = None
) -> Iterator[Bundle]:
    asked = experiment(folder, steps)
    return carry_out(asked, bench, folder / "runs", operator or QuietOperator(), lambda text: None)


def only_bundle(folder: Path) -> Bundle:
    (path,) = (folder / "runs").iterdir()
    return Bundle.open(path)


def events(bundle: Bundle) -> list[str]:
    return [e["event"] for e in journal_of(bundle) if e["event"] != "reading"]


class After:
    """A clock's sleep that does something once, some time into the run."""

    def __init__(self, bench: VirtualBench, seconds: float, action: object) -> None:
        self.bench, self.until, self.action = bench, seconds, action
        self.sleep = bench.clock.sleep
        bench.clock.sleep = self  # type: ignore[method-assign]

    def __call__(self, seconds: float) -> None:
        self.sleep(seconds)
        if self.bench.clock.now() >= self.until and callable(self.action):
            action, self.action = self.action, None
            action()


def interrupt() -> None:
    raise KeyboardInterrupt


class Finished(NamedTuple):
    """A complete run, to be read only, and the bench that it was carried out on."""

    bundle: Bundle
    bench: VirtualBench


@pytest.fixture(scope="module")
def hop(tmp_path_factory: pytest.TempPathFactory) -> Finished:
    bench = VirtualBench(load_bench("virtual").content)
    (bundle,) = runs(tmp_path_factory.mktemp("hop"), bench)
    return Finished(bundle, bench)


@pytest.fixture(scope="module")
def decay(tmp_path_factory: pytest.TempPathFactory) -> Finished:
    """A ring-down on a bench whose supply must not be opened."""

    def opened(wire_log: object) -> object:
        raise AssertionError("the supply was opened")

    bench = VirtualBench(load_bench("virtual").content)
    bench.supply = opened  # type: ignore[method-assign, assignment]
    (bundle,) = runs(tmp_path_factory.mktemp("decay"), bench, DECAY)
    return Finished(bundle, bench)


def test_a_run_leaves_a_complete_bundle_with_the_output_off(hop: Finished) -> None:
    bundle, bench = hop
    assert manifest_of(bundle)["status"] == "complete"
    assert manifest_of(bundle)["output_off"] == "confirmed"
    assert verify(bundle.path) == []
    assert not bench.device.output.on
    assert bench.device.history[-1][1] == 0
    assert events(bundle) == [
        "asked", "prompt", "prepared", "cameras", "output_on",
        *["voltage"] * 5, "output_off", "take_accepted", "complete",
    ]  # fmt: skip


def test_the_supply_really_gave_the_voltages_that_were_asked(hop: Finished) -> None:
    bundle, bench = hop
    volts = [v for _, v in bench.device.history if v > 0]
    assert volts == [1.0, 1.7, 2.41, 3.11, 3.82, 4.52]
    on = next(t for t, v in bench.device.history if v > 0)
    assert bench.device.history[-1][0] - on == pytest.approx(2.0, abs=0.01)
    assert [v for _, v in manifest_of(bundle)["sent"]] == [*volts, 0.0]
    told = report_of(bundle)
    assert "asked for hop-16.99: 1.0 s rest, then 1.00 V to 4.52 V" in told
    assert "RD6006 12345678 prepared: limits set, output off" in told
    assert "output off, confirmed" in told
    wire = (bundle.path / "wire.log").read_text()
    assert "01 06 00 08 01 c4" in wire  # write register 8: 452 = 4.52 V


def test_the_twin_is_near_and_time_zero_is_shared(hop: Finished) -> None:
    bundle, _ = hop
    assert manifest_of(bundle)["real"]["speed_rad_s"] == pytest.approx(16.93, abs=0.3)
    assert manifest_of(bundle)["twin"]["speed_rad_s"] == pytest.approx(16.99, abs=0.3)
    assert 0.1 < manifest_of(bundle)["error_mm"] < 15
    assert manifest_of(bundle)["track"]["zero_in_take_s"] == pytest.approx(1.0, abs=0.15)
    # two markers of 0.2 mm noise on T, four on the foot
    assert manifest_of(bundle)["noise_mm"]["top_y_m"]["white"] == pytest.approx(0.141, rel=0.25)
    assert manifest_of(bundle)["noise_mm"]["foot_y_m"]["rest"] == pytest.approx(0.1, rel=0.35)
    assert set(manifest_of(bundle)["alignment"]) == {"twin_delay", "clocks"}
    raw = bundle.series.read("raw")
    assert raw.names == bundle.series.read("track").names
    assert not raw.valid.all()
    assert bundle.series.read("twin").times[0] < -0.5


def test_the_same_seed_gives_the_same_take(
    tmp_path: Path, bench: VirtualBench, hop: Finished
) -> None:
    (again,) = runs(tmp_path, bench)
    assert again.take().read_bytes() == hop.bundle.take().read_bytes()


def test_ctrl_c_in_the_drive_switches_off_and_keeps_what_there_is(
    tmp_path: Path, bench: VirtualBench
) -> None:
    After(bench, 2.2, interrupt)
    with pytest.raises(Interrupted, match=r"stopped by the user\nthe output is off, confirmed"):
        list(runs(tmp_path, bench))
    assert not bench.device.output.on
    assert bench.device.history[-1][1] == 0
    bundle = only_bundle(tmp_path)
    assert manifest_of(bundle)["status"] == "interrupted"
    assert events(bundle)[-2:] == ["output_off", "interrupted"]
    assert len(bundle.series.read("supply")) > 3
    assert verify(bundle.path) == []


def test_a_trip_of_the_supply_is_a_safety_stop(tmp_path: Path, bench: VirtualBench) -> None:
    def trip() -> None:
        bench.device.change(over_voltage=1.0)  # somebody turns the over-voltage trip down to 1 V

    After(bench, 2.0, trip)
    with pytest.raises(SafetyStop, match=r"over-voltage protection \(OVP\) tripped"):
        list(runs(tmp_path, bench))
    assert bench.device.history[-1][1] == 0
    assert manifest_of(only_bundle(tmp_path))["status"] == "safety-stop"


def test_an_output_switched_off_by_hand_ends_the_run(tmp_path: Path, bench: VirtualBench) -> None:
    After(bench, 2.0, lambda: bench.device.fail(SimulatedFault.PANEL_OFF))
    with pytest.raises(SafetyStop, match="its output went off, not by this program"):
        list(runs(tmp_path, bench))


def test_a_supply_that_falls_silent_is_told_loudly(tmp_path: Path, bench: VirtualBench) -> None:
    After(bench, 2.0, lambda: bench.device.fail(SimulatedFault.SILENT))
    with pytest.raises(SafetyStop, match=r"OUTPUT MAY BE ON"):
        list(runs(tmp_path, bench))
    bundle = only_bundle(tmp_path)
    assert manifest_of(bundle)["output_off"] == "unconfirmed"
    assert manifest_of(bundle)["status"] == "safety-stop"


def test_another_supply_than_the_bench_names_is_refused(tmp_path: Path) -> None:
    bench = VirtualBench(load_bench("virtual").content)
    bench.device = type(bench.device)(clock=bench.clock, model="RD6006P")
    with pytest.raises(HardwareError, match=r"model is RD6006P, the bench names RD6006"):
        list(runs(tmp_path, bench))
    assert [v for _, v in bench.device.history] == [0.0]


def test_a_run_whose_take_is_unusable_fails_and_keeps_the_take(
    tmp_path: Path, bench: VirtualBench, monkeypatch: pytest.MonkeyPatch
) -> None:
    def collect(*words: object) -> Path:
        path = tmp_path / "empty.csv"
        path.write_text("")
        return path

    monkeypatch.setattr(bench, "collect", collect)
    with pytest.raises(InputError, match=r"run 1 \(hop-16.99\): .*empty"):
        list(runs(tmp_path, bench))
    bundle = only_bundle(tmp_path)
    assert manifest_of(bundle)["status"] == "failed"
    assert "empty" in manifest_of(bundle)["error"]
    assert bundle.take().name == "empty.csv"
    assert verify(bundle.path) == []


def test_a_crash_of_our_own_is_written_down_and_the_output_is_off(
    tmp_path: Path, bench: VirtualBench
) -> None:
    def crash() -> None:
        raise ZeroDivisionError("made for this test")

    After(bench, 2.0, crash)
    with pytest.raises(ZeroDivisionError, match="made for this test"):
        list(runs(tmp_path, bench))
    assert not bench.device.output.on
    assert "made for this test" in manifest_of(only_bundle(tmp_path))["error"]


def test_a_motor_that_is_not_connected_is_found_in_the_take(tmp_path: Path) -> None:
    file = load_bench("virtual").content
    section = file.virtual
    assert section is not None
    dead = section.model_copy(update={"motor_slope": 0.0, "motor_offset": 0.0})
    bench = VirtualBench(file.model_copy(update={"virtual": dead}))
    with pytest.raises(WorkbenchError, match="the rotor never moves in this take; was the motor"):
        list(runs(tmp_path, bench))


def test_a_sweep_makes_one_bundle_a_run(tmp_path: Path, bench: VirtualBench) -> None:
    steps = "  - sweep: {mode: clamped, speeds: [14 rad/s, 19 rad/s], rest: 1 s, duration: 1.5 s}\n"
    found = list(runs(tmp_path, bench, steps))
    assert [manifest_of(b)["number"] for b in found] == [1, 2]
    assert [b.path.name.split("_", 2)[2] for b in found] == ["clamped-14.00", "clamped-19.01"]
    assert all("distance_m" not in manifest_of(b)["real"] for b in found)


def test_a_motive_export_serves_as_well(tmp_path: Path) -> None:
    file = load_bench("virtual").content
    assert file.virtual is not None
    other = file.virtual.model_copy(update={"export": "motive-1.23"})
    bench = VirtualBench(file.model_copy(update={"virtual": other}))
    (motive,) = runs(tmp_path, bench)
    assert motive.take().read_text(encoding="utf-8-sig").startswith("Format Version,1.23")
    assert 0.1 < manifest_of(motive)["error_mm"] < 15


def test_a_decay_asks_the_operator_and_leaves_the_supply_closed(decay: Finished) -> None:
    bundle, bench = decay
    assert events(bundle) == [
        "asked",
        "no_drive",
        "prompt",
        "cameras",
        "prompt",
        "take_accepted",
        "complete",
    ]
    ready, now = (e for e in journal_of(bundle) if e["event"] == "prompt")
    assert ready["text"].startswith("Clamp the foot. Pull T forward with 0.39 N")
    assert now["text"] == "Burn or cut the thread now, then confirm."
    assert now["time_s"] == pytest.approx(1.0)  # after the rest
    assert manifest_of(bundle)["output_off"] == "supply not opened"
    assert not {"sent", "supply"} & set(manifest_of(bundle))
    assert not (bundle.path / "wire.log").exists()
    assert not bundle.series.has("supply")
    assert [volts for _, volts in bench.device.history] == [0.0]
    assert verify(bundle.path) == []


def test_a_decay_and_its_twin_ring_from_the_moment_of_release(decay: Finished) -> None:
    bundle, _ = decay
    facts = manifest_of(bundle)
    assert 1.2 <= facts["track"]["zero_in_take_s"] <= 2.2  # a person needs a moment
    release = {"pull_N": 0.39, "pull_up_N": 0.0, "height_m": 0.0, "standard_error": None}
    assert facts["release"] == release
    for who in ("real", "twin"):
        assert facts[who]["displacement_m"] == pytest.approx(0.0158, abs=0.0005)
        assert facts[who]["ring_hz"] == pytest.approx(1.64, abs=0.03)
    track = bundle.series.read("track")
    assert track.times[-1] > 3.0  # what was asked for is there after the release
    held = track.between(-1.0, -0.05)["top_x_m"]
    assert np.nanstd(held) < 0.0005
    told = report_of(bundle)
    assert "this mode has no drive: the supply was not opened" in told
    assert "asked for decay-0.39N: 1.0 s rest" in told
    assert "decay, T pulled forward with 0.39 N" in told


def test_repeats_differ_in_noise_and_moment_of_release(tmp_path: Path, bench: VirtualBench) -> None:
    one, two = runs(tmp_path, bench, DECAY.replace("3 s}", "1 s, repeats: 2}"))
    assert one.take().read_bytes() != two.take().read_bytes()
    zeros = [manifest_of(bundle)["track"]["zero_in_take_s"] for bundle in (one, two)]
    assert abs(zeros[0] - zeros[1]) > 0.01


def test_a_drop_falls_by_what_was_asked(tmp_path: Path, bench: VirtualBench) -> None:
    steps = "  - run: {mode: drop, height: 20 mm, rest: 1 s, duration: 3 s}\n"
    (bundle,) = runs(tmp_path, bench, steps)
    assert manifest_of(bundle)["real"]["displacement_m"] == pytest.approx(0.0245, abs=0.0005)
    assert manifest_of(bundle)["twin"]["displacement_m"] == pytest.approx(0.0245, abs=0.0003)
    assert manifest_of(bundle)["warnings"] == []


def test_ctrl_c_in_a_ring_down_says_that_the_supply_was_not_opened(
    tmp_path: Path, bench: VirtualBench
) -> None:
    After(bench, 1.5, interrupt)
    with pytest.raises(Interrupted, match="this mode has no drive, the supply was not opened"):
        list(runs(tmp_path, bench, DECAY))
    assert manifest_of(only_bundle(tmp_path))["status"] == "interrupted"


def test_a_robot_that_was_never_let_go_is_found_in_the_take(
    tmp_path: Path, bench: VirtualBench, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("workbench.run.virtual._HAND_S", (30.0, 31.0))
    with pytest.raises(WorkbenchError, match="T never moves in this take; was it released while"):
        list(runs(tmp_path, bench, DECAY))


def test_a_true_robot_of_forty_increments_rings_like_its_twin_of_sixteen(tmp_path: Path) -> None:
    file = load_bench("virtual").content
    assert file.virtual is not None
    fine = file.virtual.model_copy(update={"increments": 40, "parameters": {}})
    bench = VirtualBench(file.model_copy(update={"virtual": fine}))
    (bundle,) = runs(tmp_path, bench, DECAY)
    real, twin = manifest_of(bundle)["real"]["ring_hz"], manifest_of(bundle)["twin"]["ring_hz"]
    assert real == pytest.approx(twin, rel=0.01)
    assert real != pytest.approx(twin, rel=1e-5)
