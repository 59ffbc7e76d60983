"""The lease by a clock that is set by hand."""

from __future__ import annotations

import threading
import time

import pytest

from workbench.hw import LeaseClock, SimulatedClock
from workbench.hw.guardian.lease import LEASE_S, RENEW_S, Lease


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
