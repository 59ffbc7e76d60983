"""Of a supply with several channels only the chosen one is driven, read and confirmed off."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from decimal import Decimal

import pytest
from hw_stub import QUICK_S

from workbench.errors import HardwareError, InputError, SafetyStop
from workbench.hw import (
    NO_RECORDS,
    Connection,
    Limits,
    SimulatedClock,
    SimulatedFault,
    Supply,
    open_supply,
    prepare,
    serve,
    switch_on,
    watch,
    written,
)
from workbench.hw.guardian.messages import Task
from workbench.hw.models import SCPI
from workbench.hw.simulated import SimulatedScpi

SEVERAL = [model.name for model in SCPI if model.channels > 1]
LOW = Limits(Decimal("4.5"), Decimal("0.9"), Decimal("4.9"), Decimal("0.95"))

each_model = pytest.mark.parametrize("model", SEVERAL)


@contextmanager
def opened(
    device: SimulatedScpi,
    clock: SimulatedClock,
    wire: list[str] | None = None,
    channel: int = 1,
    timeout_s: float = 0.5,
) -> Iterator[Supply]:
    with serve(device) as address:
        supply = open_supply(
            Connection("tcp", address, channel=channel, timeout_s=timeout_s),
            clock=clock,
            wire_log=[].append if wire is None else wire.append,
            family="scpi",
        )
        try:
            yield supply
        finally:
            supply.close()


@each_model
def test_off_reaches_and_is_confirmed_from_the_chosen_channel(
    clock: SimulatedClock, model: str
) -> None:
    device = SimulatedScpi(clock=clock, model=model, load=lambda volts: 0.1 * volts)
    with opened(device, clock) as supply:
        prepare(supply, LOW, model=model)
        switch_on(supply, Decimal("2.9"))
        device.fail(SimulatedFault.PANEL_CHANNEL)
        assert device.selected == 2
        reading = watch(supply)  # of channel 1 all the same
        assert (reading.voltage_V, reading.set_voltage_V, reading.output) == (2.9, 2.9, True)
        device.fail(SimulatedFault.PANEL_CHANNEL)
        assert supply.off()
        assert supply.terminals_dead()
    assert [volts for _, volts in device.history] == [0, 2.9, 0]
    for number, other in device.channels.items():
        assert number == 1 or other.history[1:] == []


@each_model
def test_a_live_channel_2_is_neither_read_nor_touched(clock: SimulatedClock, model: str) -> None:
    device = SimulatedScpi(clock=clock, model=model)
    device.channels[2].change(set_voltage=3.3, on=True)
    device.selected = 2
    with opened(device, clock) as supply:
        ready = prepare(supply, LOW, model=model)
        assert not ready.found.output
        assert supply.measure().voltage_V == 0
        assert supply.off()
    assert device.channels[2].output.voltage == 3.3


@each_model
def test_the_channel_of_the_bench_file_is_driven(clock: SimulatedClock, model: str) -> None:
    device = SimulatedScpi(clock=clock, model=model, channel=2)
    with opened(device, clock, channel=2) as supply:
        prepare(supply, LOW, model=model)
        device.fail(SimulatedFault.PANEL_CHANNEL)
        assert switch_on(supply, Decimal("2.9")).voltage_V == 2.9
        assert supply.name.startswith(f"channel 2 of {model} at ")
        assert supply.off()
    assert [volts for _, volts in device.history] == [0, 2.9, 0]
    assert device.channels[1].output.set_voltage == 0


@pytest.mark.parametrize("model", ["HMP4040", "HMC8042"])
def test_where_commands_name_no_channel_it_is_selected_in_the_same_message(
    clock: SimulatedClock, model: str
) -> None:
    device, wire = SimulatedScpi(clock=clock, model=model), list[str]()
    with opened(device, clock, wire, channel=2) as supply:
        prepare(supply, LOW, model=model)
        supply.off()
    lines = [json.loads(line) for line in wire]
    sent = [bytes.fromhex(line["bytes"]) for line in lines if line["way"] == "sent"]
    asked = [message for message in sent if message != b"*IDN?\n"]
    assert asked
    for message in asked:
        assert re.fullmatch(rb"INST:NSEL 2\n[^\n;]+\n", message), message
    assert b"INST:NSEL 2\nOUTP OFF\n" in sent


@pytest.mark.parametrize(
    ("model", "channel", "words"),
    [
        ("DP832", 4, "DP832 has no channel 4 that can be driven; there are 1 to 3"),
        ("HMC8041", 2, "HMC8041 has no channel 2 that can be driven; its only one is 1"),
        ("SPD3303X", 3, "SPD3303X has no channel 3 that can be driven; there are 1 to 2"),
        ("E36311A", 3, "E36311A has no channel 3 that can be driven"),
    ],
)
def test_a_channel_that_there_is_not_is_refused(
    clock: SimulatedClock, model: str, channel: int, words: str
) -> None:
    device = SimulatedScpi(clock=clock, model=model)
    with pytest.raises(InputError, match=words), opened(device, clock, channel=channel):
        pass


def test_limits_are_those_of_the_channel(clock: SimulatedClock) -> None:
    device = SimulatedScpi(clock=clock, model="DP832", channel=3)
    high = Limits(Decimal(12), Decimal(1), Decimal(13), Decimal("1.2"))
    with opened(device, clock, channel=3) as supply:
        match = "13 V is more than this model's 5 V; nothing was sent"
        with pytest.raises(InputError, match=match):
            supply.arm(high)


@each_model
def test_another_supply_does_not_confirm_off(clock: SimulatedClock, model: str) -> None:
    device = SimulatedScpi(clock=clock, model=model)
    # each question that is asked again waits for two time-outs of silence
    with opened(device, clock, timeout_s=QUICK_S) as supply:
        prepare(supply, LOW, model=model)
        switch_on(supply, Decimal("2.9"))
        device._maker = replace(device._maker, identity="Somebody,{},4711,1.0")
        assert not supply.off()


@pytest.mark.parametrize(
    ("model", "said", "asked"),
    [
        ("E36312A", "VOLT 5,(@2)", "VOLT? (@2)"),
        ("DP832", "SOUR2:VOLT 5", "SOUR2:VOLT?"),
        ("SPD3303X", "CH2:VOLT 5", "CH2:VOLT?"),
    ],
)
def test_the_simulated_supply_knows_its_maker_s_channels(
    clock: SimulatedClock, model: str, said: str, asked: str
) -> None:
    device = SimulatedScpi(clock=clock, model=model)
    assert device.obey(said) is None
    assert device.channels[2].output.set_voltage == 5
    assert device.output.set_voltage == 0
    assert float(device.obey(asked) or b"") == 5
    assert float(device.obey("VOLT?") or b"") == 0  # of the selected one
    device.fail(SimulatedFault.PANEL_CHANNEL)
    assert float(device.obey("VOLT?") or b"") == 5


def test_the_simulated_supply_honours_what_was_selected(clock: SimulatedClock) -> None:
    device = SimulatedScpi(clock=clock, model="HMP4040")
    for line in ("INST:NSEL 3", "VOLT 5", "OUTP ON"):
        assert device.obey(line) is None
    assert device.channels[3].output.voltage == 5
    assert (device.output.on, device.obey("INST:NSEL?")) == (False, b"3")
    device.obey("INST:NSEL 5")  # there is none
    assert device.selected == 3
    device.fail(SimulatedFault.POWER_CYCLE)
    assert (device.selected, device.channels[3].output.voltage) == (1, 0)


def test_a_siglent_tells_its_outputs_by_bits(clock: SimulatedClock) -> None:
    device = SimulatedScpi(clock=clock, model="SPD3303X-E")
    assert (device.obey("SYST:STAT?"), device.obey("OUTP?")) == (b"0x0004", None)
    device.obey("OUTP CH2,ON")
    assert device.obey("SYST:STAT?") == b"0x0024"
    device.obey("OUTP CH1,ON")
    assert device.obey("SYST:STAT?") == b"0x0034"
    with opened(device, clock) as supply:
        assert supply.off()
    assert (device.output.on, device.channels[2].output.on) == (False, True)


def test_no_channel_selects_itself_where_there_is_one_only(clock: SimulatedClock) -> None:
    device = SimulatedScpi(clock=clock, model="P4305", load=lambda volts: 0.1 * volts)
    with opened(device, clock) as supply:
        prepare(supply, LOW, model="P4305")
        switch_on(supply, Decimal("2.9"))
        device.fail(SimulatedFault.PANEL_CHANNEL)
        assert watch(supply).voltage_V == 2.9
        with pytest.raises(SafetyStop, match=r"4\.5 V, the limits of this run"):
            supply.set_voltage(Decimal(20))


def test_a_supply_that_never_tells_its_name_is_hinted_at(clock: SimulatedClock) -> None:
    device = SimulatedScpi(clock=clock, model="P4305")
    device.fail(SimulatedFault.SILENT)
    words = r"no answer within 0\.5 s.*model that is not known here, as some never answer \*IDN\?"
    with pytest.raises(HardwareError, match=words), opened(device, clock):
        pass


def test_the_guardian_is_told_the_channel() -> None:
    place = Connection("tcp", "127.0.0.1:5025", channel=2)
    task = Task(place, "scpi", NO_RECORDS)
    assert Task.from_json(task.to_json()).connection == place


def test_a_selection_is_told_with_what_was_written() -> None:
    assert written(b"INST:NSEL 2\nVOLT 2.930\n") == "INST:NSEL 2; VOLT 2.930"
    assert written(b"INST:NSEL 2\nVOLT?\n") is None
