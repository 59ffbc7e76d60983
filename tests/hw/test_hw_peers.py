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
from collections.abc import Iterator
from contextlib import contextmanager
from decimal import Decimal

import pytest

from workbench.hw import Connection, Limits, SimulatedClock, open_supply, prepare, switch_on
from workbench.hw.simulated import SimulatedRiden, serve

needs_pty = pytest.mark.skipif(sys.platform == "win32", reason="needs a pseudo terminal")


@contextmanager
def pty_to(address: str) -> Iterator[str]:
    """Join a pseudo terminal and a TCP port, as a serial bridge does; yield the port's name."""
    import tty

    host, _, port = address.rpartition(":")
    ours, theirs = os.openpty()
    tty.setraw(theirs)
    stop_here, stop_there = socket.socketpair()
    with socket.create_connection((host, int(port))) as link, stop_here, stop_there:
        thread = threading.Thread(target=_pump, args=(ours, link, stop_there))
        thread.start()
        try:
            yield os.ttyname(theirs)
        finally:
            stop_here.sendall(b"x")
            thread.join(10)
            os.close(ours)
            os.close(theirs)


def _pump(terminal: int, link: socket.socket, stop: socket.socket) -> None:
    while True:
        ready, _, _ = select.select([terminal, link, stop], [], [])
        if stop in ready:
            return
        if terminal in ready:
            link.sendall(os.read(terminal, 4096))
        if link in ready:
            os.write(terminal, link.recv(4096))


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
        assert mbpoll(port, 0)[0] == 60060
        mbpoll(port, 8, value=450)
        assert device.read(10, 1) == [450]


@needs_pty
def test_rd6006_from_pypi_drives_the_simulated_supply(device: SimulatedRiden) -> None:
    foreign = pytest.importorskip("rd6006", reason="PyPI rd6006 is not installed")
    with serve(device) as address, pty_to(address) as port:
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


@needs_pty
def test_our_driver_runs_over_a_serial_port(
    device: SimulatedRiden, clock: SimulatedClock, limits: Limits
) -> None:
    with (
        serve(device) as address,
        pty_to(address) as port,
        open_supply(Connection("serial", port), clock=clock, wire_log=lambda line: None) as supply,
    ):
        prepare(supply, limits, model="RD6006")
        assert switch_on(supply, Decimal("4.35")).voltage_V == 4.35
    assert [volts for _, volts in device.history] == [0, 4.35, 0]
