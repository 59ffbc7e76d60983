"""Two ways: foreign clients read our simulated supply, and our driver reads a foreign-made port.

A driver and a simulator by one hand may share a mistake; a client by another hand does not.
"""

from __future__ import annotations

import os
import re
import select
import shutil
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from decimal import Decimal
from pathlib import Path
from types import ModuleType

import pytest

from workbench.hw import (
    Connection,
    Limits,
    SimulatedClock,
    SystemClock,
    open_supply,
    prepare,
    serve,
    serve_terminal,
    switch_on,
    watch,
)
from workbench.hw.simulated import SimulatedDps, SimulatedHanmatek, SimulatedKorad, SimulatedRiden

HERE = Path(__file__).parent
LOW = Limits(Decimal("5.5"), Decimal(1), Decimal(6), Decimal("1.2"))

needs_pty = pytest.mark.skipif(sys.platform == "win32", reason="needs a pseudo terminal")


@contextmanager
def null_modem() -> Iterator[tuple[str, str]]:
    """Join two pseudo terminals; yield their names."""
    import tty

    pairs = [os.openpty(), os.openpty()]
    for _, theirs in pairs:
        tty.setraw(theirs)
    stop_here, stop_there = socket.socketpair()
    (one, _), (two, _) = pairs
    with stop_here, stop_there:
        thread = threading.Thread(target=_pump, args=(one, two, stop_there))
        thread.start()
        try:
            yield os.ttyname(pairs[0][1]), os.ttyname(pairs[1][1])
        finally:
            stop_here.sendall(b"x")
            thread.join(10)
            for ends in pairs:
                for end in ends:
                    os.close(end)


def _pump(one: int, two: int, stop: socket.socket) -> None:
    while True:
        ready, _, _ = select.select([one, two, stop], [], [])
        if stop in ready:
            return
        for source, sink in ((one, two), (two, one)):
            if source in ready:
                os.write(sink, os.read(source, 4096))


@contextmanager
def program(*words: str) -> Iterator[None]:
    """Run a server that prints `ready`, for as long as the block lasts."""
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            assert process.stdout.readline() == "ready\n"
            yield
        finally:
            process.kill()


@contextmanager
def listening(port: int) -> Iterator[None]:
    """Wait until something accepts connections there."""
    end = time.monotonic() + 10
    while True:
        try:
            socket.create_connection(("127.0.0.1", port), 1.0).close()
            break
        except OSError:
            assert time.monotonic() < end, f"nothing listens at port {port}"
            time.sleep(0.02)
    yield


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        return listener.getsockname()[1]


def needs(package: str) -> ModuleType:
    """Import a published client, or skip the test."""
    return pytest.importorskip(package, reason=f"PyPI's {package} (extra `peers`) is not installed")


def mbpoll(port: int, first: int, *, count: int = 1, value: int | None = None) -> dict[int, int]:
    """Let mbpoll read, or write a value, over Modbus TCP; return the registers that it prints."""
    program = shutil.which("mbpoll")
    if program is None:
        pytest.skip("mbpoll (Debian package of that name) is not installed")
    flags = f"-m tcp -p {port} -a 1 -t 4 -0 -1 -r {first} -c {count} 127.0.0.1".split()
    if value is not None:  # mbpoll allows no -c when it writes
        flags = f"-m tcp -p {port} -a 1 -t 4 -0 -r {first} 127.0.0.1 {value}".split()
    done = subprocess.run([program, *flags], capture_output=True, text=True, timeout=10, check=True)
    return {int(k): int(v) for k, v in re.findall(r"^\[(\d+)\]:\s+(\d+)", done.stdout, re.M)}


def test_mbpoll_reads_and_writes_the_simulated_supply(device: SimulatedRiden) -> None:
    device.write(8, [435])
    device.write(18, [1])
    with serve(device, framing="tcp") as address:
        port = int(address.rpartition(":")[2])
        assert mbpoll(port, 8, count=4) == {8: 435, 9: 1000, 10: 435, 11: 218}
        assert mbpoll(port, 0)[0] == 60061
        mbpoll(port, 8, value=450)
        assert device.read(10, 1) == [450]


@needs_pty
def test_rd6006_from_pypi_drives_the_simulated_supply(device: SimulatedRiden) -> None:
    foreign = needs("rd6006")
    with serve_terminal(device) as port:
        theirs = foreign.RD6006(port)
        try:
            assert (theirs.sn, theirs.fw) == (12345678, 1.41)
            theirs.voltage = 4.35
            theirs.enable = 1
            assert device.history[-1][1] == 4.34  # it truncates; ours does not
            assert theirs.measvoltage == 4.34
            theirs.status()  # one read of 84 registers
        finally:
            theirs.instrument.serial.close()


def test_mbpoll_reads_and_writes_the_other_modbus_families(clock: SimulatedClock) -> None:
    dps, hanmatek = SimulatedDps(clock=clock), SimulatedHanmatek(clock=clock)
    with serve(dps, framing="tcp") as address:
        port = int(address.rpartition(":")[2])
        mbpoll(port, 0, value=435)
        mbpoll(port, 9, value=1)
        assert mbpoll(port, 0, count=13)[2] == 435
        assert mbpoll(port, 11) == {11: 5005}
    with serve(hanmatek, framing="tcp") as address:
        port = int(address.rpartition(":")[2])
        mbpoll(port, 0x30, value=435)
        mbpoll(port, 1, value=1)
        assert mbpoll(port, 0x10) == {0x10: 435}
        assert mbpoll(port, 3, count=3) == {3: 305, 4: 19280, 5: 0x0233}


@needs_pty
def test_mbpoll_reads_the_simulated_supply_over_a_serial_port(device: SimulatedRiden) -> None:
    tool = shutil.which("mbpoll")
    if tool is None:
        pytest.skip("mbpoll (Debian package of that name) is not installed")
    with serve_terminal(device) as port:
        flags = f"-m rtu -b 115200 -P none -a 1 -t 4 -0 -1 -r 0 -c 4 {port}".split()
        done = subprocess.run([tool, *flags], capture_output=True, text=True, timeout=10)
    assert re.findall(r"^\[\d+\]:\s+(\d+)", done.stdout, re.M)[0] == "60061", done.stderr


@needs_pty
def test_hanmatek_psu_from_pypi_drives_the_simulated_supply(clock: SimulatedClock) -> None:
    foreign = needs("hanmatek")
    device = SimulatedHanmatek(clock=clock, model="HM310P", load=lambda volts: 0.1 * volts)
    with serve_terminal(device) as port:
        theirs = foreign.HM3xxP(port)
        try:
            assert theirs.info() == "KP3010"
            theirs.write("voltage:set", 4.5)
            theirs.write("ovp", 6)
            theirs.write("output", True)
            assert device.history[-1][1] == 4.5
            assert (theirs.read("voltage"), theirs.read("current")) == (4.5, 0.45)
            assert theirs.read("power") == pytest.approx(2.025)
            assert theirs.read("ovp") == 6
            theirs.write("output", False)
            assert device.history[-1][1] == 0
        finally:
            theirs.instrument.serial.close()


@needs_pty
def test_koradctl_from_pypi_drives_the_simulated_supply() -> None:
    needs("koradctl")
    from koradctl.port import get_port
    from koradctl.psu import PowerSupply

    device = SimulatedKorad(
        clock=SystemClock(),
        model="72-2540",
        load=lambda volts: 0.1 * volts,
        padding=b"\0",
        deaf_s=0,  # it sends every other command too soon: its pause begins before its own wait
    )
    with serve_terminal(device) as name, get_port(name) as port:
        theirs = PowerSupply(port)
        assert theirs.get_identity() == "TENMA 72-2540 V2.1"
        assert theirs.is_tested()
        theirs.set_voltage_setpoint(4.35)
        theirs.set_current_setpoint(0.5)
        theirs.set_ocp_state(True)
        theirs.set_output_state(True)
        assert theirs.get_output_state()
        assert theirs.get_ovp_ocp_state()
        assert (theirs.get_voltage_setpoint().value, theirs.get_current_setpoint().value) == (
            4.35,
            0.5,
        )
        assert theirs.get_output_voltage().value == 4.35
        assert theirs.get_output_current().value == pytest.approx(0.435, abs=0.0006)
        theirs.set_output_state(False)
        assert not theirs.get_output_state()
    assert [volts for _, volts in device.history] == [0, 4.35, 0]


def test_our_driver_runs_against_a_libmodbus_server(tmp_path: Path) -> None:
    compiler, server = shutil.which("gcc"), str(tmp_path / "server")
    source = str(HERE / "libmodbus_server.c")
    if compiler is None:
        pytest.skip("gcc is not installed")
    words = [compiler, source, "-o", server, "-I/usr/include/modbus", "-lmodbus"]
    built = subprocess.run(words, capture_output=True, text=True, timeout=60)
    if "modbus.h" in built.stderr:
        pytest.skip("libmodbus (Debian package libmodbus-dev) is not installed")
    assert built.returncode == 0, built.stderr
    port = free_port()
    with (
        program(server, str(port)),
        open_supply(
            Connection("tcp", f"127.0.0.1:{port}"), clock=SystemClock(), wire_log=lambda line: None
        ) as supply,
    ):
        ready = prepare(supply, LOW, model="RD6006", serial="00004711")
        assert ready.identity.firmware == "1.41"
        assert switch_on(supply, Decimal("4.35")).voltage_V == 4.35
        for count in range(50):
            supply.set_voltage(Decimal(count) / 100)
            assert watch(supply).set_voltage_V == count / 100
        assert supply.off()


@needs_pty
@pytest.mark.filterwarnings("ignore:isSet\\(\\) is deprecated")
def test_our_driver_runs_against_a_modbus_tk_slave(clock: SimulatedClock) -> None:
    needs("modbus_tk")
    import serial
    from modbus_tk import defines, modbus_rtu

    with null_modem() as (ours, theirs), serial.Serial(theirs, 9600) as port:
        server = modbus_rtu.RtuServer(port)
        slave = server.add_slave(1)
        slave.add_block("all", defines.HOLDING_REGISTERS, 0, 0x60)
        slave.set_values("all", 0, [0, 1000, 0, 0, 0, 2400])
        slave.set_values("all", 0x0B, [5005, 14])
        server.start()
        try:
            place = Connection("serial", ours, baud=9600)
            with open_supply(
                place, clock=clock, wire_log=lambda line: None, family="dps"
            ) as supply:
                prepare(supply, LOW, model="DPS5005")
                assert slave.get_values("all", 0x52, 2) == (600, 1200)
                assert supply.set_voltage(Decimal("4.35")) == Decimal("4.35")
                assert slave.get_values("all", 0, 2) == (435, 1000)
                supply.set_output(True)
                assert slave.get_values("all", 9, 1) == (1,)
            assert slave.get_values("all", 9, 1) == (0,)
        finally:
            server.stop()


@needs_pty  # its package needs them
def test_our_driver_runs_against_sinstruments() -> None:
    needs("sinstruments")
    port = free_port()
    with (
        program(sys.executable, str(HERE / "sinstruments_supply.py"), str(port)),
        listening(port),  # it says ready before it listens
        open_supply(
            Connection("tcp", f"127.0.0.1:{port}"),
            clock=SystemClock(),
            wire_log=lambda line: None,
            family="scpi",
        ) as supply,
    ):
        ready = prepare(supply, LOW, model="SPE6103", serial="2102345")
        assert ready.identity.firmware == "FV:V2.1.0"
        reading = switch_on(supply, Decimal("4.35"))
        assert (reading.voltage_V, reading.current_A) == (4.35, 0.435)
        assert supply.off()
        assert supply.terminals_dead()


@needs_pty
def test_our_driver_runs_over_a_serial_port(
    device: SimulatedRiden, clock: SimulatedClock, limits: Limits
) -> None:
    with (
        serve_terminal(device) as port,
        open_supply(Connection("serial", port), clock=clock, wire_log=lambda line: None) as supply,
    ):
        prepare(supply, limits, model="RD6006")
        assert switch_on(supply, Decimal("4.35")).voltage_V == 4.35
    assert [volts for _, volts in device.history] == [0, 4.35, 0]
