"""The driver: what it sends, what it reads back, and what it refuses."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from decimal import Decimal

import pytest
from hw_stub import QUICK_S, Play

from workbench.errors import HardwareError, InputError, SafetyStop
from workbench.hw import (
    Connection,
    Identity,
    Limits,
    Model,
    Reading,
    SimulatedClock,
    SimulatedFault,
    Supply,
    open_supply,
    serve,
    switch_on,
    watch,
)
from workbench.hw.models.riden import RIDEN
from workbench.hw.simulated import SimulatedRiden

WHO = "01 03 00 00 00 04 44 09"
RD6006 = "01 03 08 ea 9d 00 bc 61 4e 00 8d b9 7c"
STATE = "01 03 00 08 00 0d 05 cd"
RUNNING = (
    "01 03 1a 01 b3 03 e8 01 b2 01 5e 00 00 00 98 19 64 00 00 00 00 00 00 00 01 00 00 00 00 2c 00"
)
PROTECTION_7 = (
    "01 03 1a 01 b3 03 e8 01 b2 01 5e 00 00 00 98 19 64 00 00 00 07 00 00 00 01 00 00 00 00 0a 30"
)


def sent(wire: list[str]) -> list[str]:
    lines = [json.loads(line) for line in wire]
    return [line["bytes"] for line in lines if line["way"] == "sent"]


@contextmanager
def reached(device: SimulatedRiden, clock: SimulatedClock) -> Iterator[Supply]:
    """A device of a model of its own, and the driver that reaches it."""
    with (
        serve(device) as address,
        open_supply(
            Connection("rtu-over-tcp", address), clock=clock, wire_log=lambda line: None
        ) as supply,
    ):
        yield supply


def test_a_status_block_becomes_a_reading(play: Play, wire: list[str]) -> None:
    link = play([(WHO, RD6006), (STATE, RUNNING)])
    supply = open_supply(link, clock=SimulatedClock(3.0), wire_log=wire.append)
    assert supply.measure() == Reading(
        time_s=3.0,
        set_voltage_V=4.35,
        voltage_V=4.34,
        current_A=0.35,
        output=True,
        mode="CV",
        protection="none",
        input_voltage_V=65.0,
        current_limit_A=1.0,
    )
    supply.close()


def test_a_state_that_no_source_describes_is_refused(play: Play, clock: SimulatedClock) -> None:
    link = play([(WHO, RD6006), (STATE, PROTECTION_7)])
    supply = open_supply(link, clock=clock, wire_log=lambda line: None)
    with pytest.raises(HardwareError, match="protection 7 and mode 0 are no state"):
        supply.measure()
    supply.close()


def test_identity_is_model_serial_and_firmware(supply: Supply) -> None:
    assert supply.identify() == Identity("RD6006", "12345678", "1.41")


def test_opening_writes_nothing(supply: Supply, wire: list[str]) -> None:
    supply.measure()
    assert sent(wire) == [WHO, STATE]


def test_an_unknown_model_id_is_refused(play: Play, clock: SimulatedClock) -> None:
    link = play([(WHO, "01 03 08 eb 28 00 00 00 07 00 8c c2 4a")])
    with pytest.raises(HardwareError, match=r"model id 60200 is not known.*known riden ids: RD60"):
        open_supply(link, clock=clock, wire_log=lambda line: None)


def test_an_unknown_family_is_refused(connection: Connection, clock: SimulatedClock) -> None:
    with pytest.raises(InputError, match="no driver for family 'volta'; there are riden"):
        open_supply(connection, clock=clock, wire_log=lambda line: None, family="volta")


def test_435_hundredths_go_out_as_435(supply: Supply, limits: Limits, wire: list[str]) -> None:
    supply.arm(limits)
    assert supply.set_voltage(Decimal("4.35")) == Decimal("4.35")
    assert "01 06 00 08 01 b3 48 2d" in sent(wire)  # 0x01b3 = 435


def test_what_is_returned_is_what_was_applied(supply: Supply, limits: Limits) -> None:
    supply.arm(limits)
    assert supply.set_voltage(Decimal("4.5227")) == Decimal("4.52")
    assert supply.set_current_limit(Decimal("0.2504")) == Decimal("0.250")
    assert supply.set_protection(Decimal("5.999"), Decimal("1.1")) == (Decimal(6), Decimal("1.1"))


@pytest.mark.parametrize("model", RIDEN, ids=lambda model: model.name)
def test_each_model_puts_the_asked_voltage_on_its_terminals(
    clock: SimulatedClock, limits: Limits, model: Model
) -> None:
    device = SimulatedRiden(clock=clock, model=model.name, load=lambda volts: 0.1 * volts)
    with reached(device, clock) as supply:
        supply.arm(limits)
        supply.set_voltage(Decimal("4.35"))
        supply.set_output(True)
        reading = supply.measure()
    assert (reading.voltage_V, reading.current_A) == pytest.approx((4.35, 0.435), abs=0.006)
    assert [volts for _, volts in device.history] == [0, 4.35, 0]


def test_the_current_scale_follows_the_range_register(
    clock: SimulatedClock, limits: Limits
) -> None:
    device = SimulatedRiden(clock=clock, model="RD6012P")
    with reached(device, clock) as supply:
        supply.arm(limits)
        assert device.read(9, 1) == [10000]  # 1 A in 0.1 mA
        device.write(20, [1])
        supply.set_current_limit(Decimal(1))
        assert device.read(9, 1) == [1000]  # 1 A in 1 mA
        device.write(20, [2])
        with pytest.raises(HardwareError, match="current range 2 in register 20; known are 0 to 1"):
            supply.measure()
        device.write(20, [0])


def test_a_current_limit_that_is_raised_on_the_way_ends_the_run(
    clock: SimulatedClock, limits: Limits
) -> None:
    device = SimulatedRiden(clock=clock, model="RD6012P")
    with reached(device, clock) as supply:
        supply.arm(limits)
        switch_on(supply, Decimal("4.5"))
        device.change(current_limit=5.0)  # by hand, or with another current range
        with pytest.raises(SafetyStop, match="its current limit is 5 A, allowed 1 A; somebody"):
            watch(supply)
        assert not device.output.on


def test_a_current_beyond_the_register_is_refused(clock: SimulatedClock) -> None:
    device = SimulatedRiden(clock=clock, model="RD6012P")
    large = Limits(Decimal(6), Decimal(8), Decimal(7), Decimal(8))
    with (
        reached(device, clock) as supply,
        pytest.raises(InputError, match=r"8 A is 80000 steps of 0.0001 A, more than a register"),
    ):
        supply.arm(large)


def test_a_write_that_is_not_applied_is_told_with_all_three_numbers(
    device: SimulatedRiden, supply: Supply, limits: Limits
) -> None:
    supply.arm(limits)
    device.fail(SimulatedFault.IGNORED_WRITE)
    words = r"asked 4\.35 V, wrote 435 to register 8, read back 0, which is 0\.00 V"
    with pytest.raises(HardwareError, match=words):
        supply.set_voltage(Decimal("4.35"))
    with pytest.raises(HardwareError, match="output asked on, wrote 1 to register 18, read back 0"):
        supply.set_output(True)


def test_limits_beyond_the_model_are_refused_before_any_write(
    supply: Supply, wire: list[str]
) -> None:
    before = len(sent(wire))
    with pytest.raises(InputError, match="61 V is more than this model's 60 V; nothing was sent"):
        supply.arm(Limits(Decimal(6), Decimal(1), Decimal(61), Decimal(1)))
    assert len(sent(wire)) == before
    with pytest.raises(SafetyStop, match="no limits are armed"):
        supply.set_output(True)


def test_off_is_confirmed_over_a_new_connection(
    device: SimulatedRiden, clock: SimulatedClock, limits: Limits
) -> None:
    with serve(device) as address:
        supply = open_supply(
            Connection("rtu-over-tcp", address, timeout_s=QUICK_S),
            clock=clock,
            wire_log=lambda line: None,
        )
        supply.arm(limits)
        supply.set_output(True)
    with pytest.raises(HardwareError, match="the connection was lost"):
        supply.measure()
    with serve(device, port=int(address.rpartition(":")[2])):
        assert supply.off()
        supply.close()
    assert device.read(18, 1) == [0]


def test_another_device_after_a_new_connection_is_not_taken_for_the_first(
    device: SimulatedRiden, clock: SimulatedClock
) -> None:
    with serve(device) as address:
        supply = open_supply(
            Connection("rtu-over-tcp", address, timeout_s=QUICK_S),
            clock=clock,
            wire_log=lambda line: None,
        )
    with pytest.raises(HardwareError, match="the connection was lost"):
        supply.measure()
    other = SimulatedRiden(clock=clock, serial=7)
    other.write(18, [1])
    with serve(other, port=int(address.rpartition(":")[2])):
        with pytest.raises(HardwareError, match=r"serial 00000007, before 60061 serial 12345678"):
            supply._apply_output(False)
        assert not supply.off()
        supply.close()
    assert other.read(18, 1) == [1]
