"""What the doctor finds, and what it says to do; and that it changes nothing."""

from __future__ import annotations

import errno
import os
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from serial.tools.list_ports_common import ListPortInfo

from tests.conftest import ROOT, Command
from workbench.doctor import clock, disk, examine, packages, ports, viewer
from workbench.doctor.ports import exports
from workbench.errors import WorkbenchError
from workbench.hw import SimulatedSupply, SystemClock, draw_current, serve, simulated_supply
from workbench.hw.simulated.device import DeviceOutput, Wire

LAB = (ROOT / "docs" / "examples" / "lab-bench.yaml").read_text("utf-8")


READ_REGISTERS = 3  # function code of Modbus


def silent(_: str) -> None:
    """Nobody looks."""


@pytest.fixture
def supply() -> SimulatedSupply:
    return simulated_supply("RD6006", clock=SystemClock(), load=draw_current)


@pytest.fixture
def bench(supply: SimulatedSupply, tmp_path: Path) -> Iterator[Path]:
    """A bench file whose supply answers."""
    head, _, tail = LAB.partition("  connection:")
    with serve(supply, framing="rtu") as address:
        path = tmp_path / "lab.yaml"
        place = f"{{kind: rtu-over-tcp, address: '{address}'}}"
        path.write_text(f"{head}  connection: {place}\n" + tail.split("\n", 1)[1])
        yield path


def test_this_computer_is_ready(tmp_path: Path) -> None:
    told: list[str] = []
    found = {one.name: one for one in examine(tmp_path / "runs", None, told.append)}
    assert {one.name: one.found for one in found.values() if one.state == "failed"} == {}
    assert len(told) == len(found) == 9
    assert not (tmp_path / "runs").exists()


class Overheard(Wire):
    """A conversation that is written down.

    Args:
        wire: the device's own.
        heard: takes what came in.
    """

    def __init__(self, wire: Wire, heard: list[bytes]) -> None:
        self._wire, self._heard = wire, heard

    def receive(self, data: bytes) -> list[DeviceOutput]:
        self._heard.append(data)
        return self._wire.receive(data)


def test_the_supply_is_asked_for_its_model_and_goes_on_as_it_was(
    supply: SimulatedSupply, bench: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    heard: list[bytes] = []
    wire = supply.wire
    monkeypatch.setattr(supply, "wire", lambda framing: Overheard(wire(framing), heard))
    supply.switch(True)
    before = supply.output
    found = ports.supply(str(bench))
    assert found.state == "ok", found.found
    assert found.found.startswith("RD6006 answers, serial number ")
    assert heard
    assert {frame[1] for frame in heard} == {READ_REGISTERS}
    assert supply.output == before


def test_another_supply_than_the_bench_names_is_a_failure(bench: Path) -> None:
    bench.write_text(bench.read_text().replace("model: RD6006", "model: RD6012"))
    found = ports.supply(str(bench))
    assert found.state == "failed"
    assert found.found.endswith("; the bench names RD6012")


def test_a_supply_that_is_not_there_says_how_to_look_for_one(tmp_path: Path) -> None:
    bench = tmp_path / "lab.yaml"
    bench.write_text(LAB)
    found = ports.supply(str(bench))
    assert found.state == "failed"
    assert "there is no such port" in found.found
    assert found.to_do == "see what answers at all: workbench supply probe"


def test_a_virtual_bench_has_no_supply_to_ask() -> None:
    assert ports.supply("virtual").found == "simulated: this bench has no real one"


def test_packages_that_differ_from_the_tested_ones_are_named(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert packages.packages().state == "ok"
    tested = packages.tested_versions() | {"numpy": "1.0", "not-installed": "7"}
    monkeypatch.setattr(packages, "tested_versions", lambda: tested)
    found = packages.packages()
    assert found.state == "note"
    assert "1 of" in found.found
    assert "(tested: 1.0)" in found.found
    assert "pip install -c constraints.txt" in found.to_do


def test_a_viewer_of_another_version_or_none_is_a_failure(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("workbench.report.viewer.viewer_version", lambda: "0.1.0")
    assert "rerun 0.1.0, but its SDK is" in viewer.viewer().found

    def broken() -> str:
        raise WorkbenchError("rerun's viewer does not start: no such file")

    monkeypatch.setattr("workbench.report.viewer.viewer_version", broken)
    found = viewer.viewer()
    assert (found.state, found.found) == ("failed", "rerun's viewer does not start: no such file")
    assert "pip install --force-reinstall" in found.to_do


def test_a_port_that_this_user_may_not_open_says_which_group_to_join(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(ports, "comports", list)
    assert ports.serial_ports().found == "none"
    monkeypatch.setattr(ports, "comports", lambda: [ListPortInfo("/dev/ttyUSB7")])
    monkeypatch.setattr(os, "access", lambda place, mode: False)
    found = ports.serial_ports()
    if sys.platform != "win32":
        assert "this user may not open /dev/ttyUSB7" in found.found
        assert "usermod -aG dialout" in found.to_do


def test_a_folder_that_cannot_be_written_and_a_disk_that_is_full_fail(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "file").write_text("")
    assert disk.writable(tmp_path / "deep" / "runs").state == "ok"

    def refused(dir: Path) -> None:
        raise PermissionError(errno.EACCES, "Permission denied", str(dir))

    monkeypatch.setattr(tempfile, "TemporaryFile", refused)
    found = disk.writable(tmp_path)
    assert found.state == "failed"
    assert "Permission denied; this user may not" in found.found
    assert "WORKBENCH_RUNS" in found.to_do
    monkeypatch.undo()
    monkeypatch.setattr(disk, "LEAST_FREE_GB", 1e9)
    assert "GB free, at least 1e+09 GB are needed" in disk.disk_space(tmp_path).found


@pytest.mark.parametrize(
    ("off", "words"), [(-3600.0, "are stamped -3600 s"), (+3600.0, "are stamped +3600 s")]
)
def test_a_disk_whose_times_are_not_the_clock_s_fails(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, off: float, words: str
) -> None:
    monkeypatch.setattr(clock, "_file_time", lambda folder: time.time() + off)
    found = clock.system_clock(tmp_path)
    assert found.state == "failed"
    assert words in found.found


def test_a_clock_before_the_installation_or_without_a_server_is_told(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(clock, "_synchronised", lambda: False)
    found = clock.system_clock(tmp_path)
    assert found.state == "note"
    assert "timedatectl set-ntp true" in found.to_do
    monkeypatch.setattr(clock.time, "time", lambda: 0.0)
    monkeypatch.setattr(clock, "_file_time", lambda folder: 0.0)
    assert "before the workbench was installed" in clock.system_clock(tmp_path).found


def test_a_check_that_breaks_is_a_finding_and_the_others_go_on(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(packages, "tested_versions", lambda: 1 / 0)
    found = {one.name: one for one in examine(tmp_path, None, silent)}
    assert found["packages"].state == "failed"
    assert "ZeroDivisionError" in found["packages"].found
    assert found["disk"].state == "ok"


def test_the_command_prints_what_to_do_and_ends_with_1_when_something_failed(
    workbench: Command, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(disk, "LEAST_FREE_GB", 1e9)
    answer = workbench("doctor", "--runs", tmp_path)
    assert answer.code == 1
    assert "FAILED" in answer.out
    assert "disk: make room, or name a folder on another disk" in answer.out
    found = workbench("doctor", "--runs", tmp_path, "--json").json
    assert found["ok"] is False
    assert found["checks"]["disk"]["state"] == "failed"
    assert found["checks"]["python"]["ok"] is True


def test_a_folder_of_exports_that_is_not_there_is_a_failure(tmp_path: Path) -> None:
    text = (ROOT / "docs" / "examples" / "lab-bench.yaml").read_text(encoding="utf-8")
    bench = tmp_path / "lab.yaml"
    bench.write_text(text.replace("takes: exports", f"takes: {tmp_path / 'gone'}"))
    found = exports(str(bench))
    assert (found.state, "takes: no such folder" in found.found) == ("failed", True)
    (tmp_path / "gone").mkdir()
    assert exports(str(bench)).state == "ok"
    assert exports("virtual").state == "ok"
