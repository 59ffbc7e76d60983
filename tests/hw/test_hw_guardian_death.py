"""Clients that die in a process of their own; the guardian is all that is left."""

from __future__ import annotations

import os
import re
import signal
import socket
import subprocess
import sys
import textwrap
import threading
import time
from decimal import Decimal
from pathlib import Path

import pytest
from guardian_rig import OUTPUT, Device, DeviceProcess, off_after, standing, told, wait_for

from workbench.errors import SafetyStop
from workbench.hw import (
    LeaseClock,
    Limits,
    Records,
    SimulatedFault,
    open_guarded,
    prepare,
    switch_on,
)
from workbench.hw.guardian import GuardedSupply
from workbench.hw.guardian.messages import Task

pytestmark = pytest.mark.xdist_group("alone")  # deaths are timed

posix = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such signal")
BAR_S = 1.0


@pytest.fixture
def device(devices: DeviceProcess) -> Device:
    return devices.new()


@pytest.fixture
def clock() -> LeaseClock:
    return LeaseClock()


CLIENT = """
    import os, signal, sys, time
    from decimal import Decimal
    from pathlib import Path
    from workbench.hw import Connection, Limits, prepare, switch_on
    from workbench.hw.guardian import LeaseClock, Records, open_guarded
    address, folder = sys.argv[1], Path(sys.argv[2])
    clock = LeaseClock()
    records = Records(folder / "wire.log", folder / "guardian.jsonl")
    connection = Connection("rtu-over-tcp", address, timeout_s=0.2)
    supply = open_guarded(connection, clock=clock, records=records)
    prepare(supply, Limits(*map(Decimal, ("6", "1", "6.5", "1.2"))), model="RD6006")
    switch_on(supply, Decimal("4.5"))
    print(supply.guardian_pid, flush=True)
    {body}
"""


def client(device: Device, folder: Path, body: str = "clock.sleep(30)") -> subprocess.Popen[str]:
    """Return a client in a process of its own once its output is on."""
    code = textwrap.dedent(CLIENT).replace("{body}", body)
    process = subprocess.Popen(
        [sys.executable, "-c", code, device.address, str(folder)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    assert process.stdout.readline().strip().isdigit()
    return process


def test_a_client_that_dies_leaves_its_output_off_confirmed_and_latched(
    device: Device, tmp_path: Path, records: Records
) -> None:
    process = client(device, tmp_path)
    killed = time.monotonic()
    process.kill()
    _, err = process.communicate(timeout=10)  # the guardian holds it until it has ended
    assert 0 < off_after(device.history, killed) < BAR_S
    (off,) = [e for e in told(records, "off") if "seconds" in e]
    assert off["confirmed"] is True
    assert told(records, "terminals")[0]["dead"] is True
    why = "(the link to it closed|another parent took its place)"  # whichever is seen first
    assert re.search(f"its client is dead: {why}; the output is off, confirmed", err)
    assert "its client is dead" in standing()


@posix
def test_a_child_that_holds_the_link_open_does_not_keep_a_dead_client_s_output_on(
    device: Device, tmp_path: Path, records: Records
) -> None:
    body = "os.fork() or (print(0, flush=True), time.sleep(2), os._exit(0)); clock.sleep(30)"
    process = client(device, tmp_path, body)
    assert process.stdout is not None
    assert process.stdout.readline().strip().isdigit()  # the child is there
    killed = time.monotonic()
    process.kill()
    process.wait()
    wait_for(lambda: told(records, "trip"), 3)
    assert off_after(device.history, killed) < BAR_S
    assert "another parent took its place" in str(told(records, "trip"))
    process.communicate(timeout=10)


@posix
def test_a_crash_of_the_client_switches_off(device: Device, tmp_path: Path) -> None:
    process = client(device, tmp_path, "os.abort()")
    process.communicate(timeout=10)
    wait_for(lambda: not device.on(), BAR_S)


def test_an_output_that_stays_on_is_told_loudly_and_written_down(
    device: Device, tmp_path: Path, records: Records
) -> None:
    process = client(device, tmp_path)
    device.fail(SimulatedFault.STUCK_OUTPUT)
    process.kill()
    wait_for(lambda: [e for e in told(records, "off") if not e["confirmed"]])
    assert device.on()
    device.mend()  # the guardian is still trying
    _, err = process.communicate(timeout=10)
    words = r"OUTPUT MAY BE ON \(its client is dead[^)]*read back 1\); switch it off by hand"
    assert re.search(words, err), err
    assert "the output is off, confirmed" in err.splitlines()[-1]
    assert [e["confirmed"] for e in told(records, "off")][-2:] == [False, True]
    assert not device.on()


@posix
def test_a_guardian_that_dies_while_it_tries_is_replaced(
    device: Device, clock: LeaseClock, limits: Limits, records: Records
) -> None:
    supply = open_guarded(device.connection, clock=clock, records=records)
    killed = threading.Thread(target=_kill_when_it_tries, args=(supply.guardian_pid, records))
    with pytest.raises(SafetyStop, match=r"OUTPUT MAY BE ON.*its guardian tries on"):
        _lose(supply, device, limits, killed)
    killed.join()
    device.mend()
    wait_for(lambda: not device.on())
    wait_for(lambda: len(told(records, "left")) == 1)


def _lose(supply: GuardedSupply, device: Device, limits: Limits, killed: threading.Thread) -> None:
    with supply:
        prepare(supply, limits, model="RD6006")
        switch_on(supply, Decimal(3))
        device.fail(SimulatedFault.STUCK_OUTPUT)
        killed.start()
        supply.set_output(False)


def _kill_when_it_tries(pid: int, records: Records) -> None:
    wait_for(lambda: [e for e in told(records, "off") if not e["confirmed"]])
    os.kill(pid, signal.SIGKILL)


@posix
def test_a_client_that_leaves_does_not_end_a_guardian_that_tries(
    device: Device, clock: LeaseClock, limits: Limits, records: Records
) -> None:
    supply = open_guarded(device.connection, clock=clock, records=records, force=True)
    device.write(8, 300)
    device.write(OUTPUT, 1)
    device.fail(SimulatedFault.FALSE_OFF)
    assert supply.off()
    assert not supply.terminals_dead()
    supply.close()  # as `workbench supply off` ends
    assert device.volts > 0
    device.mend()
    wait_for(lambda: device.volts == 0)
    wait_for(lambda: told(records, "left"))


@posix
def test_when_both_die_the_output_stays_on_and_the_next_run_lowers_it_and_is_refused(
    device: Device, tmp_path: Path, clock: LeaseClock, limits: Limits
) -> None:
    process = client(device, tmp_path, "os.kill(supply.guardian_pid, signal.SIGKILL); os.abort()")
    process.communicate(timeout=10)
    time.sleep(1.2)
    assert device.on()  # no software is left; its trip levels are armed
    assert device.read(82, 2) == [650, 1200]
    words = r"is latched since .*: its program and its guardian ended before off was confirmed"
    with (
        pytest.raises(SafetyStop, match=f"{words}; the output is off, confirmed"),
        open_guarded(device.connection, clock=clock) as supply,
    ):
        prepare(supply, limits, model="RD6006")
    down = [volts for _, volts in device.history][-10:]
    assert down == [4.5, 4.0, 3.5, 3.0, 2.5, 2.0, 1.5, 1.0, 0.5, 0.0]


@posix
def test_a_guardian_whose_client_died_before_it_began_switches_off_all_the_same(
    device: Device, tmp_path: Path
) -> None:
    device.write(8, 300)
    device.write(OUTPUT, 1)
    records = Records(events=tmp_path / "guardian.jsonl")
    task = Task(device.connection, "riden", records, after="its guardian ended")
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
    done = subprocess.run(
        [sys.executable, "-m", "workbench.hw.guardian"],
        input=f"{port} token {task.to_json()}\n",
        capture_output=True,
        text=True,
        timeout=30,
        check=False,
    )
    assert not device.on()
    assert (done.returncode, "Traceback" in done.stderr) == (0, False)
    assert "its guardian ended; the output is off, confirmed" in done.stderr
