"""Runs behind a guardian: what is recorded, what latches, what a full disk and signals do."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.bundles import guardian_of, journal_of, manifest_of
from tests.conftest import Command
from tests.hw.guardian_rig import OUTPUT, Device, DeviceProcess, device_process, wait_for
from tests.killing import Client, lab_file
from workbench.bundle import Bundle, Event, Record, verify
from workbench.errors import InputError, Interrupted, RecordError, SafetyStop, WorkbenchError
from workbench.hw import LeaseClock, SimulatedFault
from workbench.output import Ledger, ledgers
from workbench.run import (
    QuietOperator,
    RealBench,
    carry_out,
    load_bench,
    make_bench,
    read_experiment,
)

pytestmark = pytest.mark.xdist_group("alone")  # leases are timed

PROTOCOL = """\
schema: workbench/protocol-1
title: Guarded
steps:
  - run: {mode: clamped, speed: 17 rad/s, rest: 0.5 s, duration: 1 s}
"""
DECAY = PROTOCOL.replace("mode: clamped, speed: 17 rad/s", "mode: decay, pull: 0.39 N")
full_disk = pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a full disk")
posix = pytest.mark.skipif(sys.platform == "win32", reason="needs POSIX signals")

NO_TAKE = "no take in this test"
At = Callable[[Bundle], object]


@pytest.fixture(scope="module")
def devices() -> Iterator[DeviceProcess]:
    with device_process() as found:
        yield found


@pytest.fixture
def device(devices: DeviceProcess) -> Device:
    return devices.new()


def no_take(*words: object) -> Path:
    raise InputError(NO_TAKE)


def run(folder: Path, device: Device, at_event: dict[str, At]) -> Bundle:
    """Carry out a run and do something at events of its journal; return its bundle."""
    (folder / "p.yaml").write_text(PROTOCOL)
    lab = load_bench(str(lab_file(folder, device)))
    bench = make_bench(lab.content)
    vars(bench)["keep_trying_s"] = 2.0
    bench.collect = no_take  # type: ignore[method-assign]
    asked = read_experiment(folder / "p.yaml", lab, bench.voltage_step)
    keep = Record.journal

    def journal(record: Record, event: Event, time_s: float) -> None:
        keep(record, event, time_s)
        at_event.pop(event.event, lambda bundle: None)(newest(folder))

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Record, "journal", journal)
        list(carry_out(asked, bench, folder / "runs", QuietOperator(), lambda text: None))
    return newest(folder)


def newest(folder: Path) -> Bundle:
    return Bundle.open(max((folder / "runs").iterdir()))


def test_a_real_bench_is_guarded_and_its_bundle_holds_the_guardian_s_record(
    tmp_path: Path, device: Device
) -> None:
    bench = make_bench(load_bench(str(lab_file(tmp_path, device))).content)
    assert isinstance(bench, RealBench)
    assert isinstance(bench.clock, LeaseClock)
    with pytest.raises(InputError, match=NO_TAKE):
        run(tmp_path, device, {})
    bundle = newest(tmp_path)
    names = [line["event"] for line in guardian_of(bundle)]
    # off when prepared, at the drive's end and at the block's end
    seen_off = ["off", "terminals"]
    ends = [*seen_off, *seen_off, "left"]
    checked = ["output_on", *seen_off]  # the scale, as this supply is new here
    assert names == ["guarding", "taken", *seen_off, "armed", *checked, "output_on", *ends]
    assert manifest_of(bundle)["output_off"] == bundle.record.output_off == "confirmed"
    assert [e["event"] for e in journal_of(bundle)][-2:] == ["output_off", "failed"]
    assert (
        "01 06 00 08 01 c4" in bundle.record.wire_log.read_text()
    )  # 4.52 V, written by the guardian
    assert verify(bundle.path) == []
    assert len(bundle.series.read("supply")) > 3
    volts = [v for _, v in device.history if v > 0]
    assert volts == [0.5, 1.0, 1.7, 2.41, 3.11, 3.82, 4.52]
    with pytest.raises(InputError, match=NO_TAKE):
        run(tmp_path, device, {})  # the second time it is known
    again = [v for _, v in device.history if v > 0][len(volts) :]
    assert again == volts[1:]


@pytest.mark.parametrize("fault", [SimulatedFault.TIMES_TEN, SimulatedFault.A_TENTH])
def test_a_supply_of_another_scale_is_stopped_at_half_a_volt(
    tmp_path: Path, device: Device, fault: SimulatedFault
) -> None:
    device.fail(fault)
    words = r"(5|0\.05) V where 0\.5 V was set, a factor of ten: scaling fault.*confirmed"
    with pytest.raises(SafetyStop, match=words):
        run(tmp_path, device, {})
    assert max(volts for _, volts in device.history) <= 5
    assert newest(tmp_path).record.output.state == "off"
    assert "output_on" not in [event["event"] for event in journal_of(newest(tmp_path))]


def test_a_trip_latches_until_somebody_has_looked(
    tmp_path: Path, device: Device, workbench: Command
) -> None:
    trip: dict[str, At] = {
        "voltage": lambda bundle: device.write(82, 50)
    }  # its OVP is turned down to 0.5 V
    with pytest.raises(SafetyStop, match=r"over-voltage protection \(OVP\) tripped"):
        run(tmp_path, device, trip)
    assert manifest_of(newest(tmp_path))["status"] == "safety-stop"

    words = r"(?s)is latched since 20.*OVP.*nothing was switched on; .* then type: (workbench .*)"
    with pytest.raises(SafetyStop, match=words) as told:
        run(tmp_path, device, {})
    assert len(list((tmp_path / "runs").iterdir())) == 1

    command = re.search(words, str(told.value))
    assert command is not None
    typed = command[1].replace("NAME", "Ada").split()[1:]
    answer = workbench(*typed)
    assert answer.code == 0
    assert "acknowledged by Ada: " in answer.out
    assert "OVP" in answer.out
    again = workbench(*typed)
    assert again.code == 2
    assert "no stop is waiting for an acknowledgement" in again.err
    with pytest.raises(InputError, match=NO_TAKE):
        run(tmp_path, device, {})
    (ledger,) = ledgers()
    assert any(line.get("name") == "Ada" for line in ledger.events())


def test_a_latched_bench_still_does_what_needs_no_supply(tmp_path: Path, device: Device) -> None:
    bench = make_bench(load_bench(str(lab_file(tmp_path, device))).content)
    Ledger("RD6006_12345678").write("trip", reason="made for this test", place=device.address)
    assert [ledger.latch() is None for ledger in bench.ledgers()] == [False]
    (tmp_path / "p.yaml").write_text(DECAY)
    lab = load_bench(str(tmp_path / "lab.yaml"))
    bench.collect = no_take  # type: ignore[method-assign]
    asked = read_experiment(tmp_path / "p.yaml", lab, bench.voltage_step)
    with pytest.raises(InputError, match=NO_TAKE):
        list(carry_out(asked, bench, tmp_path / "runs", QuietOperator(), lambda text: None))


def test_a_virtual_bench_never_latches(tmp_path: Path, workbench: Command) -> None:
    assert make_bench(load_bench("virtual").content).ledgers() == []
    answer = workbench("supply", "acknowledge", "--bench", "virtual", "--name", "Ada")
    assert answer.code == 2
    assert "has no real supply" in answer.err


def test_an_output_that_stays_on_is_unconfirmed_in_the_bundle(
    tmp_path: Path, device: Device
) -> None:
    stick: dict[str, At] = {"voltage": lambda bundle: device.fail(SimulatedFault.STUCK_OUTPUT)}
    with pytest.raises(WorkbenchError, match="OUTPUT MAY BE ON") as told:
        run(tmp_path, device, stick)
    assert told.value.exit_code == SafetyStop.exit_code
    bundle = newest(tmp_path)
    assert bundle.record.output_off == "unconfirmed"
    assert manifest_of(bundle)["status"] == "safety-stop"
    assert device.on()


@full_disk
def test_a_full_disk_switches_off_and_is_told(tmp_path: Path, device: Device) -> None:
    def fill(bundle: Bundle) -> None:
        journal = bundle.path / "journal.jsonl"
        journal.rename(tmp_path / "before.jsonl")
        journal.symlink_to("/dev/full")

    words = r"journal\.jsonl: cannot be written \(No space left.*\n.*the output is off, confirmed"
    with pytest.raises(RecordError, match=words):
        run(tmp_path, device, {"voltage": fill})
    assert not device.on()
    assert newest(tmp_path).record.output_off == "confirmed"
    assert '"event": "voltage"' in (tmp_path / "before.jsonl").read_text()


@posix
def test_a_signal_while_switching_off_is_answered_after_it(tmp_path: Path, device: Device) -> None:
    def interrupt(bundle: Bundle) -> None:
        os.kill(os.getpid(), signal.SIGINT)
        os.kill(os.getpid(), signal.SIGINT)
        assert not device.on()

    with pytest.raises(Interrupted, match="the output is off, confirmed"):
        run(tmp_path, device, {"output_off": interrupt})
    assert manifest_of(newest(tmp_path))["status"] == "interrupted"


@posix
def test_two_ctrl_c_in_a_row_end_with_the_output_off_confirmed(
    tmp_path: Path, device: Device
) -> None:
    client = Client(tmp_path, device)
    client.heard_until("output_on")
    wait_for(lambda: device.volts > 1)
    client.kill("SIGINT")
    client.kill("SIGINT")
    assert client.end() == 130
    assert not device.on()
    assert "the output is off, confirmed" in client.err.read_text()
    assert manifest_of(client.bundle)["output_off"] == "confirmed"


@posix
def test_a_killed_run_tells_what_its_guardian_left(
    tmp_path: Path, device: Device, workbench: Command
) -> None:
    client = Client(tmp_path, device)
    client.heard_until("voltage")
    device.fail(SimulatedFault.STUCK_OUTPUT)
    client.kill("SIGKILL")
    client.end()
    wait_for(lambda: client.bundle.record.output.cause != "")  # its guardian has tried
    assert client.bundle.record.output_off == "unconfirmed"
    answer = workbench("runs", "verify", client.bundle.path)
    assert answer.code == 1
    assert "the run was cut off (status failed); OUTPUT MAY BE ON (its" in answer.out
    device.mend()
    wait_for(lambda: client.bundle.record.output_off == "confirmed")
    assert "output off" in workbench("runs", "show", client.bundle.path).out


def test_supply_off_and_read_go_through_a_guardian(
    tmp_path: Path, device: Device, workbench: Command
) -> None:
    lab = lab_file(tmp_path, device)
    device.write(8, 300)
    device.write(OUTPUT, 1)
    assert workbench("supply", "read", "--bench", lab, "--json").json["voltage_V"] == 3.0
    assert device.on()  # looking changes nothing
    answer = workbench("supply", "off", "--bench", lab)
    assert answer.code == 0
    assert answer.out == "output off, confirmed\n"
    assert not device.on()
    device.write(OUTPUT, 1)
    device.fail(SimulatedFault.STUCK_OUTPUT)
    stuck = workbench("supply", "off", "--bench", lab)
    assert stuck.code == 4
    assert "OUTPUT MAY BE ON" in stuck.err


def test_no_wall_clock_decides_anything_about_an_output(root: Path) -> None:
    stamps = {"records.py"}  # for people
    for path in sorted((root / "workbench" / "hw").rglob("*.py")):
        text = path.read_text()
        assert "time.time(" not in text, path
        assert "datetime.now" not in text or path.name in stamps, path


def test_no_thread_renews_in_the_background(tmp_path: Path, device: Device) -> None:
    seen: list[str] = []

    def look(bundle: Bundle) -> None:
        seen.extend(thread.name for thread in threading.enumerate())
        time.sleep(0.8)  # the main thread hangs

    with pytest.raises(SafetyStop, match=r"its client hangs: no progress for 0\.5 s"):
        run(tmp_path, device, {"voltage": look})
    assert not [name for name in seen if "renew" in name or "lease" in name]
    assert not device.on()


def test_a_voltage_is_driven_by_hand_within_the_limits_and_switched_off(
    tmp_path: Path, device: Device, workbench: Command
) -> None:
    lab = lab_file(tmp_path, device)
    answer = workbench("supply", "set", "2,5 V", "--bench", lab, "--for", "0.5 s", "--json")
    assert answer.code == 0, answer.err
    assert answer.json["voltage_V"] == 2.5
    assert answer.json["output"] is False
    assert max(volts for _, volts in device.history) == 2.5
    assert not device.on()
    assert [ledger.latch() for ledger in ledgers()] == [None]
    beyond = workbench("supply", "set", "9 V", "--bench", lab)
    assert beyond.code == 2
    assert "voltage 9 V is outside the bench's limits, above 0 to 5.5 V" in beyond.err
    without = workbench("supply", "set", "3", "--bench", lab)
    assert without.code == 2
    assert "3 has no unit; write for example '3 V'" in without.err


def test_a_voltage_driven_by_hand_stops_as_a_run_does(
    tmp_path: Path, device: Device, workbench: Command
) -> None:
    lab = lab_file(tmp_path, device)
    threading.Timer(2.0, lambda: device.fail(SimulatedFault.PANEL_VOLTAGE)).start()
    answer = workbench("supply", "set", "2 V", "--bench", lab)
    assert answer.code == 4
    assert "somebody changed it at the panel" in answer.err
    assert not device.on()
    again = workbench("supply", "set", "2 V", "--bench", lab)
    assert again.code == 4
    assert "is latched since" in again.err


def test_supply_off_stops_whoever_drives(
    tmp_path: Path, device: Device, workbench: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    client = Client(tmp_path, device)
    client.heard_until("output_on")
    wait_for(lambda: device.volts > 1)
    monkeypatch.setenv("WORKBENCH_STATE", str(client.state))
    second = workbench("supply", "set", "2 V", "--bench", tmp_path / "lab.yaml")
    assert second.code == 3
    assert "another program is driving it; nothing was set" in second.err
    assert device.volts > 1
    answer = workbench("supply", "off", "--bench", tmp_path / "lab.yaml")
    assert (answer.code, answer.out) == (0, "output off, confirmed\n"), answer.err
    assert not device.on()
    assert client.end() == 4
    assert "somebody asked for it with `workbench supply off`" in client.err.read_text()


@posix
def test_a_dozen_ctrl_c_end_a_voltage_driven_by_hand_as_one_does(
    tmp_path: Path, device: Device
) -> None:
    code = "from workbench.cli import main; main()"
    words = ["supply", "set", "2 V", "--bench", str(lab_file(tmp_path, device))]
    process = subprocess.Popen(
        [sys.executable, "-c", code, *words],
        stderr=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    wait_for(lambda: device.volts == 2.0, 30)
    for _ in range(12):
        process.send_signal(signal.SIGINT)
        time.sleep(0.02)
    _, err = process.communicate(timeout=20)
    assert process.returncode == 130, err
    assert "stopped by the user; the output is off, confirmed" in err
    assert not device.on()
