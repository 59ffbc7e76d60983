"""A client and its guardian: the contract, a hang of the one, the death of the other."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from decimal import Decimal
from pathlib import Path
from typing import Any

import pytest
from guardian_rig import QUICK_S, Device, DeviceProcess, events, off_after, standing, told

from workbench.errors import HardwareError, InputError, SafetyStop
from workbench.hw import (
    FAMILIES,
    MODELS,
    Connection,
    Family,
    LeaseClock,
    Limits,
    Records,
    SimulatedFault,
    check_scale,
    open_guarded,
    prepare,
    serve,
    simulated_supply,
    switch_on,
    watch,
)
from workbench.hw.guardian import GuardedSupply
from workbench.hw.guardian.process import GuardianProcess, _accept
from workbench.loopback import MessageLine

pytestmark = pytest.mark.xdist_group("alone")  # leases and hangs are timed

posix = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no such signal")
BAR_S = 1.0
NOTICED_S = 0.5  # a guardian that is dead or hangs, by its client


@pytest.fixture
def device(devices: DeviceProcess) -> Device:
    return devices.new()


@pytest.fixture
def clock() -> LeaseClock:
    return LeaseClock()


@pytest.fixture
def supply(device: Device, clock: LeaseClock, records: Records) -> Iterator[GuardedSupply]:
    found = open_guarded(device.connection, clock=clock, records=records)
    yield found
    found.off()
    found.close()


def start(supply: GuardedSupply, limits: Limits, volts: str = "4.5") -> None:
    prepare(supply, limits, model="RD6006")
    switch_on(supply, Decimal(volts))


def test_a_guarded_supply_does_what_every_supply_does(
    device: Device, clock: LeaseClock, records: Records, limits: Limits
) -> None:
    with open_guarded(device.connection, clock=clock, records=records) as supply:
        prepared = prepare(supply, limits, model="RD6006", serial="12345678", firmware="1.41")
        assert prepared.identity.model == "RD6006"
        assert supply.name == f"RD6006 at {device.address}"
        before = clock.now()
        assert switch_on(supply, Decimal("4.5")).voltage_V == 4.5
        assert before <= supply.measure().time_s <= clock.now()
        assert supply.set_voltage(Decimal("5.005")) == Decimal("5.00")  # ties to even
        assert device.volts == 5.0
        assert supply.set_current_limit(Decimal("0.5")) == Decimal("0.500")
        assert supply.set_protection(Decimal(6), Decimal(1)) == (6, 1)
        clock.sleep(0.7)  # longer than the lease
        assert device.on()
        watch(supply)
    assert not device.on()
    names = [e["event"] for e in events(records.events or Path())]
    seen_off = ["off", "terminals"]
    assert names == ["guarding", "taken", *seen_off, "armed", "output_on", *seen_off, "left"]
    assert '"way": "sent"' in (records.wire or Path()).read_text()
    assert standing() == ""


def test_what_the_supply_or_its_rules_refuse_is_told_as_without_a_guardian(
    device: Device, supply: GuardedSupply, limits: Limits
) -> None:
    with pytest.raises(SafetyStop, match="no limits are armed, so nothing may be set"):
        supply.set_voltage(Decimal(1))
    prepare(supply, limits, model="RD6006")
    with pytest.raises(SafetyStop, match="voltage 7 V is outside 0 to 6 V, the limits of this run"):
        supply.set_voltage(Decimal(7))
    device.fail(SimulatedFault.EXCEPTION)
    with pytest.raises(HardwareError, match="exception 4, device failure"):
        supply.measure()
    device.mend()


def test_the_guardian_itself_holds_to_the_limits(supply: GuardedSupply, limits: Limits) -> None:
    prepare(supply, limits, model="RD6006")
    with pytest.raises(SafetyStop, match="voltage 45 V is outside 0 to 6 V"):
        supply._apply_voltage(Decimal(45))  # as a client that forgot its own


def test_a_place_where_nothing_answers_is_told(clock: LeaseClock) -> None:
    with pytest.raises(HardwareError, match=r"127\.0\.0\.1:9 not reachable"):
        open_guarded(Connection("tcp", "127.0.0.1:9"), clock=clock)
    with pytest.raises(InputError, match="no driver for family 'abacus'"):
        open_guarded(Connection("tcp", "127.0.0.1:9"), clock=clock, family="abacus")


def test_a_hang_of_half_a_second_switches_off_and_ends_the_run(
    device: Device, supply: GuardedSupply, clock: LeaseClock, records: Records, limits: Limits
) -> None:
    start(supply, limits)
    hung = time.monotonic()
    time.sleep(1.5)  # not with the clock: no progress
    assert 0.3 < off_after(device.history, hung) < BAR_S
    words = "its client hangs: no progress for 0.5 s with the output on"
    with pytest.raises(SafetyStop, match=f"{words}; the output is off, confirmed"):
        watch(supply)
    with pytest.raises(SafetyStop, match="its guardian stepped in: its client hangs"):
        supply.set_output(True)
    assert supply.off()
    assert not device.on()
    assert [trip["reason"] for trip in told(records, "trip")] == [words]
    assert words in standing()


def test_a_thread_that_waits_beside_the_work_is_no_sign_of_progress(
    device: Device, supply: GuardedSupply, clock: LeaseClock, limits: Limits
) -> None:
    start(supply, limits)
    beside = threading.Thread(target=clock.sleep, args=(1.2,))
    beside.start()
    time.sleep(1.2)
    beside.join()
    assert not device.on()


def test_the_lease_rests_while_the_output_is_off(
    device: Device, supply: GuardedSupply, records: Records, limits: Limits
) -> None:
    prepare(supply, limits, model="RD6006")
    time.sleep(0.8)  # an operator thinks
    assert switch_on(supply, Decimal("4.5")).output
    assert supply.off()
    time.sleep(0.8)
    assert supply.measure().output is False
    assert told(records, "trip") == []


def test_a_supply_that_was_only_looked_at_stays_as_it_is(
    device: Device, clock: LeaseClock, records: Records
) -> None:
    device.write(8, 450)
    device.write(18, 1)
    supply = open_guarded(device.connection, clock=clock, records=records)
    assert supply.measure().output
    supply.close()
    assert device.on()
    supply = open_guarded(device.connection, clock=clock, records=records)
    supply._guardian._line.close()  # as when its client dies
    supply._guardian._process.wait(10)
    assert device.on()
    assert standing() == ""


def test_a_client_that_leaves_with_the_output_on_does_not(
    device: Device, clock: LeaseClock, limits: Limits
) -> None:
    supply = open_guarded(device.connection, clock=clock)
    start(supply, limits)
    supply.close()
    assert not device.on()


@posix
@pytest.mark.parametrize("number", ["SIGKILL", "SIGSTOP"])
def test_a_guardian_that_dies_or_hangs_is_noticed_and_replaced_to_switch_off(
    device: Device,
    supply: GuardedSupply,
    clock: LeaseClock,
    records: Records,
    limits: Limits,
    number: str,
) -> None:
    start(supply, limits)
    noticed: list[float] = []
    another = supply._off_through_another

    def note() -> None:
        noticed.append(time.monotonic())
        another()

    supply._off_through_another = note  # type: ignore[method-assign]
    killed = time.monotonic()
    os.kill(supply.guardian_pid, getattr(signal, number))
    words = r"its guardian (ended|hangs: .* 0\.4 s); the output is off, confirmed"
    with pytest.raises(SafetyStop, match=words):
        clock.sleep(10)
    assert noticed[0] - killed < NOTICED_S
    assert not device.on()
    assert told(records, "guarding")[1]["after"] in (
        "its guardian ended",
        "its guardian hangs: it acknowledged nothing for 0.4 s",
    )
    assert supply.off()


@posix
def test_before_anything_was_set_a_busy_computer_costs_no_run(supply: GuardedSupply) -> None:
    os.kill(supply.guardian_pid, signal.SIGSTOP)
    busy = threading.Timer(1.0, os.kill, (supply.guardian_pid, signal.SIGCONT))
    busy.start()
    assert not supply.measure().output
    busy.join()


@posix
def test_the_off_of_another_supply_confirms_nothing(
    devices: DeviceProcess, device: Device, clock: LeaseClock, limits: Limits
) -> None:
    other = devices.new(serial=7)
    supply = open_guarded(device.connection, clock=clock, keep_trying_s=1)
    start(supply, limits)
    supply._task = replace(supply._task, connection=other.connection)  # as after a replug
    os.kill(supply.guardian_pid, signal.SIGKILL)
    with pytest.raises(SafetyStop, match="its guardian ended; OUTPUT MAY BE ON"):
        clock.sleep(10)
    assert not supply.off()
    assert device.on()
    assert not other.on()
    supply.close()


@pytest.mark.parametrize("family", FAMILIES)
def test_every_family_is_switched_off_when_its_client_hangs(
    family: Family, clock: LeaseClock
) -> None:
    model = next(row for row in MODELS if row.family == family)
    device = simulated_supply(model.name, clock=clock)
    limits = Limits(*map(Decimal, ("5", "1", "5.5", "1.2")))  # the smallest goes to 6 V
    with (
        serve(device, framing="tcp") as address,
        open_guarded(
            Connection("tcp", address, timeout_s=QUICK_S), clock=clock, family=family
        ) as supply,
    ):
        prepare(supply, limits, model=model.name)
        switch_on(supply, Decimal("4.5"))
        assert device.output.voltage == 4.5
        time.sleep(0.9)
        assert not device.output.on
        with pytest.raises(SafetyStop, match=r"its client hangs.*the output is off, confirmed"):
            watch(supply)


@posix
def test_a_guardian_that_is_told_to_end_switches_off_first(
    device: Device, supply: GuardedSupply, clock: LeaseClock, limits: Limits
) -> None:
    start(supply, limits)
    for number in (signal.SIGINT, signal.SIGHUP):  # of the client's terminal, not its business
        os.kill(supply.guardian_pid, number)
    clock.sleep(0.2)
    assert device.on()
    os.kill(supply.guardian_pid, signal.SIGTERM)
    with pytest.raises(SafetyStop, match=r"asked to end .SIGTERM.; the output is off, confirmed"):
        clock.sleep(10)
    assert not device.on()


@posix
def test_the_guardian_is_out_of_reach_of_the_client_s_terminal(supply: GuardedSupply) -> None:
    assert os.getsid(supply.guardian_pid) != os.getsid(0)
    assert os.getpgid(supply.guardian_pid) != os.getpgid(0)


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a full disk to write to")
def test_an_output_that_cannot_be_recorded_is_not_switched_on(
    device: Device, clock: LeaseClock, limits: Limits, tmp_path: Path
) -> None:
    (tmp_path / "full").symlink_to("/dev/full")
    records = Records(events=tmp_path / "full")
    with (
        open_guarded(device.connection, clock=clock, records=records) as supply,
        pytest.raises(SafetyStop, match=r"not switched on, as .* cannot write .*full .No space"),
    ):
        start(supply, limits)
    assert [volts for _, volts in device.history] == [0.0]


def test_a_call_that_ctrl_c_cut_leaves_its_answer_to_nobody(
    supply: GuardedSupply, limits: Limits, monkeypatch: pytest.MonkeyPatch
) -> None:
    prepare(supply, limits, model="RD6006")
    true_receive = MessageLine.receive

    def interrupted(line: MessageLine, timeout: float) -> object:
        monkeypatch.setattr(MessageLine, "receive", true_receive)
        raise KeyboardInterrupt

    monkeypatch.setattr(MessageLine, "receive", interrupted)
    with pytest.raises(KeyboardInterrupt):
        supply.identify()
    assert supply.measure_power_on_output() is False
    assert supply.set_voltage(Decimal(2)) == 2


def made_ready(supply: GuardedSupply, limits: Limits) -> None:
    prepare(supply, limits, model="RD6006")


def scale_checked(supply: GuardedSupply, limits: Limits) -> None:
    check_scale(supply)


@pytest.mark.parametrize("step", [made_ready, scale_checked])
def test_a_ctrl_c_while_off_is_asked_for_ends_what_makes_a_supply_ready(
    device: Device,
    supply: GuardedSupply,
    limits: Limits,
    monkeypatch: pytest.MonkeyPatch,
    step: Callable[[GuardedSupply, Limits], None],
) -> None:
    true_ask = GuardianProcess.ask

    def interrupted(guardian: GuardianProcess, call: str, *words: Any, **options: Any) -> Any:
        if call == "off":
            monkeypatch.setattr(GuardianProcess, "ask", true_ask)
            raise KeyboardInterrupt
        return true_ask(guardian, call, *words, **options)

    made_ready(supply, limits)
    monkeypatch.setattr(GuardianProcess, "ask", interrupted)
    with pytest.raises(KeyboardInterrupt):
        step(supply, limits)
    assert not device.on()


def test_a_stranger_without_the_token_is_turned_away(supply: GuardedSupply) -> None:
    process = supply._guardian._process
    with socket.create_server(("127.0.0.1", 0)) as listener:
        address = listener.getsockname()
        with (
            socket.create_connection(address) as stranger,
            socket.create_connection(address) as own,
        ):
            stranger.sendall(b'{"token": "guess"}\n')
            own.sendall(b'{"token": "secret"}\n')
            line = _accept(listener, "secret", process)
            assert stranger.recv(1) == b""
            line.close()


def test_a_guardian_is_not_started_by_hand() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "workbench.hw.guardian"],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    assert "started by the workbench, not by hand" in done.stderr


def test_a_supply_that_another_program_prepared_is_refused_and_not_called_on(
    device: Device, supply: GuardedSupply, limits: Limits
) -> None:
    prepare(supply, limits, model="RD6006")  # its output is off, but it is taken
    with (
        pytest.raises(HardwareError, match="another program is driving it; nothing was set"),
        open_guarded(device.connection, clock=LeaseClock()) as second,
    ):
        prepare(second, limits, model="RD6006")
