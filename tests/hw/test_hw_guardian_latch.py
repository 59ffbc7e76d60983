"""The latch's file, and the lease by a clock that is set by hand."""

from __future__ import annotations

import threading
import time
from pathlib import Path

import pytest

from workbench.errors import InputError
from workbench.hw import SimulatedClock
from workbench.hw.guardian import Latch, LeaseClock
from workbench.hw.guardian.lease import LEASE_S, RENEW_S, Lease


@pytest.fixture
def latch(tmp_path: Path) -> Latch:
    return Latch.beside(tmp_path / "runs", "/dev/serial/by-id/usb 1a86-if00")


def test_it_lies_beside_the_runs_and_is_named_after_the_port(latch: Latch, tmp_path: Path) -> None:
    assert latch.path == tmp_path / "runs.latch" / "dev_serial_by-id_usb_1a86-if00.jsonl"
    assert latch.standing() is None
    assert not latch.path.parent.exists()


def test_two_places_have_two_latches_however_the_folder_is_written(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert Latch.beside(Path("runs"), "COM4").path == Latch.beside(tmp_path / "runs", "COM4").path
    assert Latch.beside(Path("runs"), "COM4").path != Latch.beside(Path("runs"), "COM5").path


def test_it_stands_until_it_is_acknowledged_with_a_name(latch: Latch) -> None:
    latch.trip("OVP tripped", "run")
    latch.trip("the client is dead", "guardian")
    standing = latch.standing()
    assert standing is not None
    assert (standing.reason, standing.told_by) == ("the client is dead", "guardian")
    with pytest.raises(InputError, match="needs the name of a person: --name NAME"):
        latch.acknowledge(" ")
    assert latch.acknowledge("Ada").reason == "the client is dead"
    assert latch.standing() is None
    with pytest.raises(InputError, match="no trip is waiting for an acknowledgement"):
        latch.acknowledge("Ada")
    latch.trip("again", "run")
    assert latch.standing() is not None
    assert len(latch.path.read_text().splitlines()) == 4  # nothing is ever taken out


@pytest.mark.parametrize("tail", ['{"trip": {"wall": "2026-', '{"acknowled', "\x00\x00", "[1]\n"])
def test_a_last_line_that_a_crash_cut_counts_as_a_trip(latch: Latch, tail: str) -> None:
    latch.trip("first", "run")
    latch.acknowledge("Ada")
    with latch.path.open("a") as file:
        file.write(tail)
    standing = latch.standing()
    assert standing is not None
    assert "last line cannot be read" in standing.reason
    latch.acknowledge("Grace")
    assert latch.standing() is None


def test_a_lease_expires_without_progress_and_rests_while_off() -> None:
    clock = SimulatedClock()
    lease = Lease(clock)
    clock.sleep(10)
    assert not lease.expired
    lease.begin()
    clock.sleep(LEASE_S)
    assert not lease.expired
    clock.sleep(0.001)
    assert lease.expired
    lease.renew()
    assert not lease.expired
    clock.sleep(10)
    lease.rest()
    assert not lease.expired


def test_waiting_renews_several_times_within_a_lease_and_only_in_the_holder_s_thread() -> None:
    clock = LeaseClock()
    renewed: list[int] = []

    def renew(seconds: float) -> None:
        renewed.append(threading.get_ident())
        time.sleep(seconds)

    clock.hold(renew)
    beside = threading.Thread(target=clock.sleep, args=(LEASE_S,))
    beside.start()
    clock.sleep(LEASE_S)
    beside.join()
    assert set(renewed) == {threading.get_ident()}
    assert 3 <= len(renewed) <= LEASE_S / RENEW_S + 2
    clock.rest()
    clock.sleep(RENEW_S)
    assert len(renewed) <= LEASE_S / RENEW_S + 2


def test_what_renewing_raises_ends_the_wait() -> None:
    def lost(seconds: float) -> None:
        raise RuntimeError("its guardian is gone")

    clock = LeaseClock()
    clock.hold(lost)
    before = clock.now()
    with pytest.raises(RuntimeError, match="its guardian is gone"):
        clock.sleep(10)
    assert clock.now() - before < 1
