"""Real clients killed at random instants: the supply itself tells how long its output stayed on."""

from __future__ import annotations

import os
import signal
import sys
from pathlib import Path

import pytest

from tests.bundles import guardian_of, manifest_of
from tests.hw.guardian_rig import device_process, wait_for
from tests.killing import (
    BAR_S,
    SIGNALS,
    BothKilled,
    Client,
    Killed,
    both_table,
    kill_both_many,
    kill_many,
    random_instants,
    table,
)

pytestmark = [
    pytest.mark.xdist_group("alone"),
    pytest.mark.skipif(sys.platform == "win32", reason="needs POSIX signals and fork"),
]

KILLS = 100
CODES = {"SIGKILL": {-9}, "SIGSTOP": {4, 130}, "SIGTERM": {130}, "SIGHUP": {130}}
STATUS = {"SIGTERM": "interrupted", "SIGHUP": "interrupted", "SIGKILL": "failed"}


def check(found: list[Killed]) -> None:
    """A second, and as much more as the kernel let them wait for a processor: idle, nothing."""
    for killed in found:
        assert killed.lost == 0
        assert killed.off_s < BAR_S + killed.waited_s, killed
        assert killed.code in CODES[killed.signal], killed
        if killed.was_on:
            assert killed.confirmed_s is not None
            assert killed.confirmed_s < BAR_S + killed.waited_s, killed
            assert killed.bundle.record.output_off == "confirmed"
            wanted = STATUS.get(killed.signal, "safety-stop")
            assert manifest_of(killed.bundle)["status"] == wanted


def test_the_output_is_off_within_a_second_of_each_signal(tmp_path: Path) -> None:
    found = kill_many(SIGNALS, (1.8, 2.2, 2.6, 3.0), tmp_path)
    print(table(found))
    assert [killed.was_on for killed in found].count(True) >= 2
    check(found)


@pytest.mark.long
def test_the_output_is_off_within_a_second_at_a_hundred_random_instants(tmp_path: Path) -> None:
    names = [SIGNALS[i % len(SIGNALS)] for i in range(KILLS)]
    found = kill_many(names, random_instants(KILLS, seed=8), tmp_path)
    print(table(found))
    assert [killed.was_on for killed in found].count(True) >= KILLS // 2
    check(found)


def check_both(found: list[BothKilled]) -> None:
    print(both_table(found))
    assert [one for one in found if not one.right] == []
    assert {one.live for one in found} == {True, False}


def test_what_is_said_after_both_are_killed_is_so(tmp_path: Path) -> None:
    check_both(kill_both_many(8, 3, tmp_path))


@pytest.mark.long
def test_what_is_said_after_both_are_killed_is_so_at_two_hundred_instants(tmp_path: Path) -> None:
    check_both(kill_both_many(200, 8, tmp_path))


@pytest.mark.parametrize("name", ["SIGKILL", "SIGSTOP"])
def test_a_run_whose_guardian_is_killed_ends_as_a_safety_stop(tmp_path: Path, name: str) -> None:
    with device_process() as devices:
        device = devices.new()
        client = Client(tmp_path, device)
        client.heard_until("output_on")
        wait_for(lambda: device.volts > 0)
        guardian = guardian_of(client.bundle)[0]["pid"]
        os.kill(guardian, getattr(signal, name))
        wait_for(lambda: not device.on(), 5)
        assert client.end() == 4
        told = client.err.read_text()
        assert "its guardian" in told
        assert "the output is off, confirmed" in told
        assert manifest_of(client.bundle)["status"] == "safety-stop"
        assert manifest_of(client.bundle)["output_off"] == "confirmed"
        assert "its guardian" in manifest_of(client.bundle)["error"]
        assert guardian_of(client.bundle)[-1]["event"] == "left"
        standing = client.standing()
        assert standing is not None
        assert "its guardian" in standing.reason

        again = Client(tmp_path, device)
        assert again.end() == 4
        assert "workbench supply acknowledge --bench" in client.err.read_text()
        assert len(list(client.runs.iterdir())) == 1
