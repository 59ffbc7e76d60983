"""A simulated RD6006 on a loopback port, and a stub that plays bytes from a script."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack
from decimal import Decimal
from pathlib import Path

import pytest
from guardian_rig import DeviceProcess, device_process
from hw_stub import QUICK_S, Play, played

from workbench.hw import Connection, Limits, Records, SimulatedClock, Supply, open_supply, serve
from workbench.hw.simulated import SimulatedRiden


@pytest.fixture
def clock() -> SimulatedClock:
    return SimulatedClock()


@pytest.fixture
def limits() -> Limits:
    return Limits(Decimal(6), Decimal(1), Decimal("6.5"), Decimal("1.2"))


@pytest.fixture
def wire() -> list[str]:
    return []


@pytest.fixture
def device(clock: SimulatedClock) -> SimulatedRiden:
    return SimulatedRiden(clock=clock, load=lambda volts: 0.05 * volts)


@pytest.fixture
def connection(device: SimulatedRiden) -> Iterator[Connection]:
    with serve(device) as address:
        yield Connection("rtu-over-tcp", address, timeout_s=QUICK_S)


@pytest.fixture
def supply(connection: Connection, clock: SimulatedClock, wire: list[str]) -> Iterator[Supply]:
    opened = open_supply(connection, clock=clock, wire_log=wire.append)
    yield opened
    opened.close()


@pytest.fixture
def play() -> Iterator[Play]:
    with ExitStack() as stack:
        yield lambda script: stack.enter_context(played(script))


@pytest.fixture(scope="session")
def devices() -> Iterator[DeviceProcess]:
    with device_process() as found:
        yield found


@pytest.fixture
def records(tmp_path: Path) -> Records:
    return Records(tmp_path / "wire.log", tmp_path / "guardian.jsonl")
