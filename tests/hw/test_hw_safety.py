"""The rules around an output: how it may come on, what ends a run, and that it always goes off."""

from __future__ import annotations

import itertools
import json
from dataclasses import replace
from decimal import Decimal

import pytest
from hw_stub import AtOnce

from workbench.errors import HardwareError, InputError, SafetyStop
from workbench.hw import (
    Connection,
    Limits,
    Reading,
    SimulatedClock,
    SimulatedFault,
    Supply,
    check_scale,
    open_supply,
    prepare,
    serve,
    switch_on,
    watch,
)
from workbench.hw.simulated import SimulatedRiden
from workbench.hw.transport import Transport


def written(wire: list[str]) -> list[int]:
    """Return the registers written, in order."""
    frames = [
        bytes.fromhex(line["bytes"]) for line in map(json.loads, wire) if line["way"] == "sent"
    ]
    return [frame[3] for frame in frames if frame[1] == 6]


def start(supply: Supply, limits: Limits, volts: str = "4.5") -> None:
    prepare(supply, limits, model="RD6006")
    switch_on(supply, Decimal(volts))


def test_prepare_switches_off_then_limits_then_zeroes(
    device: SimulatedRiden, supply: Supply, limits: Limits, wire: list[str]
) -> None:
    prepared = prepare(supply, limits, model="RD6006", serial="12345678", firmware="1.41")
    assert prepared.identity.model == "RD6006"
    assert written(wire) == [18, 82, 83, 9, 8]
    assert device.read(80, 4) == [0, 1000, 650, 1200]


@pytest.mark.parametrize(
    ("named", "words"),
    [
        ({"model": "RD6006P"}, "model is RD6006, the bench names RD6006P; nothing was set"),
        ({"model": "RD6006", "serial": "7"}, "serial is 12345678, the bench names 7"),
        ({"model": "RD6006", "firmware": "1.28"}, r"firmware is 1\.41, the bench names 1\.28"),
    ],
)
def test_another_supply_than_named_is_refused_before_any_write(
    supply: Supply, limits: Limits, wire: list[str], named: dict[str, str], words: str
) -> None:
    with pytest.raises(HardwareError, match=words):
        prepare(supply, limits, **named)
    assert written(wire) == []


def test_an_rd6006p_where_the_bench_names_an_rd6006_is_refused(
    clock: SimulatedClock, limits: Limits, wire: list[str]
) -> None:
    device = SimulatedRiden(clock=clock, model="RD6006P")
    with (
        serve(device) as address,
        open_supply(
            Connection("rtu-over-tcp", address), clock=clock, wire_log=wire.append
        ) as supply,
        pytest.raises(HardwareError, match="model is RD6006P, the bench names RD6006; nothing was"),
    ):
        prepare(supply, limits, model="RD6006")
    assert written(wire) == [18]  # only off, at the block's end


def test_an_output_found_on_is_lowered_in_steps_and_told(
    device: SimulatedRiden, supply: Supply, limits: Limits
) -> None:
    device.write(8, [120])
    device.write(18, [1])
    assert prepare(supply, limits, model="RD6006").found.output
    assert [volts for _, volts in device.history] == pytest.approx([0, 1.2, 0.7, 0.2, 0])


def test_a_supply_that_powers_up_on_is_refused(
    device: SimulatedRiden, supply: Supply, limits: Limits
) -> None:
    device.write(68, [1])
    with pytest.raises(SafetyStop, match=r"switch its output on by itself.*register 68"):
        prepare(supply, limits, model="RD6006")


def test_terminals_that_stay_live_are_refused(
    device: SimulatedRiden, supply: Supply, limits: Limits, monkeypatch: pytest.MonkeyPatch
) -> None:
    device.write(8, [450])
    device.write(18, [1])
    device.fail(SimulatedFault.FALSE_OFF)
    monkeypatch.setattr(supply, "ramp_down", lambda: None)
    with pytest.raises(SafetyStop, match=r"it says off but measures 4\.5 V .*; OUTPUT MAY BE ON"):
        prepare(supply, limits, model="RD6006")
    assert device.read(18, 1) == [0]  # the flag alone would have been believed
    assert device.history[-1][1] == 4.5


def test_nothing_can_be_set_before_limits_are_armed(supply: Supply, wire: list[str]) -> None:
    with pytest.raises(SafetyStop, match="no limits are armed"):
        supply.set_voltage(Decimal(1))
    with pytest.raises(SafetyStop, match="no limits are armed"):
        supply.set_output(True)
    assert written(wire) == []


@pytest.mark.parametrize("volts", ["6.001", "45", "-0.01", "NaN", "Infinity"])
def test_a_voltage_outside_the_limits_sends_nothing(
    supply: Supply, limits: Limits, wire: list[str], volts: str
) -> None:
    supply.arm(limits)
    before = written(wire)
    with pytest.raises(SafetyStop, match=f"voltage {volts} V is outside 0 to 6 V, the limits"):
        supply.set_voltage(Decimal(volts))
    assert written(wire) == before


def test_a_current_or_trip_level_outside_the_limits_is_refused(
    supply: Supply, limits: Limits
) -> None:
    supply.arm(limits)
    with pytest.raises(SafetyStop, match="current limit 2 A is outside 0 to 1 A"):
        supply.set_current_limit(Decimal(2))
    with pytest.raises(SafetyStop, match=r"over-voltage 7 V is outside 0 to 6\.5 V"):
        supply.set_protection(Decimal(7), Decimal(1))


@pytest.mark.parametrize(
    ("levels", "words"),
    [
        (("6", "1", "5", "1"), "over_voltage_V 5 V is below voltage_max_V 6 V"),
        (("6", "1", "7", "0.5"), r"over_current_A 0\.5 A is below current_max_A 1 A"),
        (("0", "1", "7", "1"), "limit voltage_max_V is 0; it must be above 0"),
    ],
)
def test_limits_that_cannot_work_are_refused(levels: tuple[str, ...], words: str) -> None:
    with pytest.raises(InputError, match=words):
        Limits(*map(Decimal, levels))


def test_switching_on_returns_the_voltage_that_arrived(
    device: SimulatedRiden, supply: Supply, limits: Limits
) -> None:
    prepare(supply, limits, model="RD6006")
    assert switch_on(supply, Decimal("4.5")).voltage_V == 4.5
    assert device.history[-1][1] == 4.5


@pytest.mark.parametrize(("factor", "seconds"), [(10, 0), (0.1, 0.2)])
def test_a_factor_of_ten_at_the_terminals_is_a_scaling_fault(
    device: SimulatedRiden,
    supply: Supply,
    limits: Limits,
    clock: SimulatedClock,
    monkeypatch: pytest.MonkeyPatch,
    factor: float,
    seconds: float,
) -> None:
    prepare(supply, limits, model="RD6006")
    true_measure = supply.measure

    def scaled():
        reading = true_measure()
        return type(reading)(**{**vars(reading), "voltage_V": factor * reading.voltage_V})

    monkeypatch.setattr(supply, "measure", scaled)
    with pytest.raises(SafetyStop, match=r"where 4\.5 V was set.*scaling fault.*off, confirmed"):
        switch_on(supply, Decimal("4.5"))
    assert device.read(18, 1) == [0]
    assert clock.now() == pytest.approx(seconds, abs=0.06)  # too much is not waited for


def test_a_voltage_that_does_not_arrive_ends_the_run(
    device: SimulatedRiden,
    supply: Supply,
    limits: Limits,
    clock: SimulatedClock,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    prepare(supply, limits, model="RD6006")
    true_measure = supply.measure

    def sagging() -> Reading:
        reading = true_measure()
        return replace(reading, voltage_V=3.0) if reading.output else reading

    monkeypatch.setattr(supply, "measure", sagging)
    before = clock.now()
    with pytest.raises(SafetyStop, match=r"measures 3 V where 4\.5 V was set, allowed 0\.05 V"):
        switch_on(supply, Decimal("4.5"))
    assert 1.0 <= clock.now() - before < 1.2


@pytest.mark.parametrize(
    ("register", "level", "words"),
    [
        (82, 400, r"over-voltage protection \(OVP\) tripped at 6\.5 V; the output is off, confirm"),
        (83, 100, r"over-current protection \(OCP\) tripped at 1\.2 A; the output is off, confirm"),
        (
            9,
            100,
            r"current limiting \(CC\) at 0\.1 A, allowed 1 A; the voltage fell to 2 V of 4\.5",
        ),
        (18, 0, "its output went off, not by this program"),
    ],
)
def test_a_limit_event_is_a_safety_stop(
    device: SimulatedRiden, supply: Supply, limits: Limits, register: int, level: int, words: str
) -> None:
    start(supply, limits)
    device.write(register, [level])
    with pytest.raises(SafetyStop, match=words):
        watch(supply)
    assert device.read(18, 1) == [0]


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt, SystemExit])
def test_the_output_is_off_after_any_exception_in_the_block(
    device: SimulatedRiden, supply: Supply, limits: Limits, error: type[BaseException]
) -> None:
    start(supply, limits)
    assert device.read(18, 1) == [1]
    with pytest.raises(error, match="in the middle"), supply:
        raise error("in the middle")
    assert device.read(18, 1) == [0]
    assert device.history[-1][1] == 0


def test_the_output_is_off_after_a_block_that_went_well(
    device: SimulatedRiden, supply: Supply, limits: Limits
) -> None:
    with supply:
        start(supply, limits)
    assert device.history[-1][1] == 0


@pytest.mark.parametrize(
    "fault",
    [
        SimulatedFault.SILENT,
        SimulatedFault.BAD_CRC,
        SimulatedFault.EXCEPTION,
        SimulatedFault.STUCK_OUTPUT,
    ],
)
def test_off_tries_again_until_it_is_confirmed(
    device: SimulatedRiden, supply: Supply, limits: Limits, fault: SimulatedFault
) -> None:
    start(supply, limits)
    device.fail(fault, times=3 if fault is not SimulatedFault.STUCK_OUTPUT else 2)
    assert supply.off()
    assert device.read(18, 1) == [0]


def test_off_that_is_never_confirmed_is_told_loudly(
    device: SimulatedRiden, supply: Supply, limits: Limits
) -> None:
    start(supply, limits)
    device.fail(SimulatedFault.STUCK_OUTPUT)
    assert not supply.off()
    with (
        pytest.raises(
            SafetyStop, match=r"it did not confirm off: .*; OUTPUT MAY BE ON, switch it off by"
        ),
        supply,
    ):
        pass


def test_an_output_that_is_on_after_off_is_not_waited_for(
    device: SimulatedRiden, supply: Supply, limits: Limits, clock: SimulatedClock
) -> None:
    start(supply, limits)
    assert supply.off()
    device.fail(SimulatedFault.PANEL_ON)
    before = clock.now()
    assert not supply.terminals_dead()
    assert supply.not_dead == "it was read back as off, but its output is on"
    assert clock.now() == before
    assert supply.off()
    assert supply.terminals_dead()


def test_a_ctrl_c_during_off_costs_one_try(
    supply: Supply, limits: Limits, monkeypatch: pytest.MonkeyPatch
) -> None:
    start(supply, limits)
    true_apply = supply._apply_output
    tries: list[bool] = []

    def interrupted(on: bool) -> None:
        tries.append(on)
        if len(tries) == 1:
            raise KeyboardInterrupt
        true_apply(on)

    monkeypatch.setattr(supply, "_apply_output", interrupted)
    assert supply.off()
    assert tries == [False, False]


def test_a_ctrl_c_at_any_message_ends_what_makes_a_supply_ready(
    device: SimulatedRiden, clock: SimulatedClock, limits: Limits, monkeypatch: pytest.MonkeyPatch
) -> None:
    left = 0

    def press(line: str) -> None:
        nonlocal left
        left -= 1
        if left == 0:
            raise KeyboardInterrupt

    monkeypatch.setattr("workbench.hw.channel._Socket", lambda connection: AtOnce(device))
    place = Connection("rtu-over-tcp", "127.0.0.1:1")
    with open_supply(place, clock=clock, wire_log=press) as supply:
        for message in itertools.count(1):
            left = message
            try:
                prepare(supply, limits, model="RD6006")
                check_scale(supply)
            except KeyboardInterrupt:
                assert supply.off(), message
                assert not supply.interrupted
            else:
                assert left > 0, f"lost at message {message}"
                assert message > 40
                break


def test_a_full_disk_stops_setting_but_not_switching_off(
    device: SimulatedRiden, connection: Connection, clock: SimulatedClock, limits: Limits
) -> None:
    full: list[bool] = []

    def log(line: str) -> None:
        if full:
            raise OSError("no space left on device")

    with open_supply(connection, clock=clock, wire_log=log) as supply:
        start(supply, limits)
        full.append(True)
        watch(supply)
        with pytest.raises(HardwareError, match=r"not sent, as the wire log failed .no space left"):
            supply.set_voltage(Decimal(5))
        assert device.history[-1][1] == 4.5
        assert supply.off()
    assert device.history[-1][1] == 0


def test_off_reaches_the_device_at_once_after_a_lost_answer(
    device: SimulatedRiden,
    supply: Supply,
    limits: Limits,
    wire: list[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    drained = '{"way": "drained"}'
    monkeypatch.setattr(Transport, "_clear_suspect", lambda link, what: wire.append(drained))
    start(supply, limits)
    device.fail(SimulatedFault.SILENT, times=2)
    with pytest.raises(HardwareError, match="no answer"):
        supply.measure()
    del wire[:]
    assert supply.off()
    assert written(wire) == [18]  # the very first try
    assert wire[0] != drained  # without waiting for the line to fall silent
