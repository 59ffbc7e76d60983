"""A panel in this process, a browser, supplies in another one."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.conftest import ROOT
from tests.hw.guardian_rig import Device, DeviceProcess, device_process
from tests.panel.chromium import Browser
from tests.panel.chromium import browser as start_browser
from workbench.panel import Panel, Protocols, Starter, Watcher

PRACTICE = ROOT / "docs" / "examples" / "practice-bench.yaml"


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    with start_browser() as found:
        yield found


@pytest.fixture(scope="session")
def devices() -> Iterator[DeviceProcess]:
    with device_process() as found:
        yield found


@pytest.fixture
def device(devices: DeviceProcess) -> Device:
    return devices.new()


@pytest.fixture
def starter(tmp_path: Path) -> Iterator[Starter]:
    """What starts the protocols of `tmp_path / "protocols"` on the practice bench."""
    made = Starter(Protocols(tmp_path / "protocols", str(PRACTICE)), tmp_path / "runs")
    yield made
    made.close()


@pytest.fixture
def panel(tmp_path: Path, starter: Starter) -> Iterator[Panel]:
    with Watcher(tmp_path / "runs", starter.facts_of) as watcher:
        served = Panel(watcher, starter)
        thread = threading.Thread(target=served.serve)
        thread.start()
        yield served
        served.stop()
        thread.join(10)
        assert not thread.is_alive()
