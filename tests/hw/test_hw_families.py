"""What every family of supplies does alike, held over all models of the table."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from decimal import Decimal

import pytest

from workbench.errors import HardwareError, InputError, SafetyStop
from workbench.hw import (
    MODELS,
    Connection,
    Limits,
    ModbusModel,
    Model,
    SimulatedClock,
    SimulatedFault,
    SimulatedSupply,
    Supply,
    model_named,
    open_supply,
    prepare,
    serve,
    simulated_supply,
    switch_on,
    watch,
)
from workbench.hw.models import from_word, rounded, to_word
from workbench.hw.simulated import SimulatedDps, SimulatedHanmatek, SimulatedKorad

QUICK_S = 0.25  # silence costs a test little, and a busy computer answers in time
ONE_EACH = ("RD6006", "DPS5005", "HM305P", "KA3005P", "72-2540", "E36312A", "DP832", "HMC8043")
LIMITS = Limits(Decimal("5.5"), Decimal(1), Decimal(6), Decimal("1.2"))

every_model = pytest.mark.parametrize("model", MODELS, ids=lambda model: model.name)
each_family = pytest.mark.parametrize("name", ONE_EACH)


def reached(model: Model, address: str, timeout_s: float = 0.5) -> Connection:
    kind = "rtu-over-tcp" if isinstance(model, ModbusModel) else "tcp"
    return Connection(kind, address, timeout_s=timeout_s)


@contextmanager
def opened(
    device: SimulatedSupply, clock: SimulatedClock, wire: list[str], timeout_s: float = 0.5
) -> Iterator[Supply]:
    with serve(device) as address:
        supply = open_supply(
            reached(device.model, address, timeout_s),
            clock=clock,
            wire_log=wire.append,
            family=device.model.family,
        )
        try:
            yield supply
        finally:
            supply.close()


def measure_until_it_fails(supply: Supply) -> None:
    """Measure until the cut of a cable has reached this end."""
    for _ in range(100):
        supply.measure()


def driving(volts: float) -> float:
    return 0.1 * volts


@pytest.mark.parametrize(
    ("step", "highest"),
    sorted({(model.voltage_step_V, model.voltage_max_V) for model in MODELS}),
    ids=str,
)
def test_every_voltage_step_of_every_model_survives_decimal_word_decimal_exactly(
    step: Decimal, highest: Decimal
) -> None:
    for count in range(int(highest / step) + 1):
        volts = count * step
        text = str(volts)
        assert to_word(Decimal(text), step) == count
        assert Decimal(str(float(volts))) == volts == from_word(count, step)
        assert str(rounded(Decimal(text), step)) == text  # as a supply that speaks text gets it


@pytest.mark.parametrize(
    ("step", "highest"),
    sorted({(step, model.current_max_A) for model in MODELS for step in model.current_steps_A}),
    ids=str,
)
def test_every_current_step_survives_too(step: Decimal, highest: Decimal) -> None:
    for count in range(0, int(highest / step) + 1, 7):
        assert to_word(Decimal(str(count * step)), step) == count


@every_model
def test_each_model_puts_the_asked_voltage_on_its_terminals(
    clock: SimulatedClock, model: Model
) -> None:
    device = simulated_supply(model.name, clock=clock, load=driving)
    wire: list[str] = []
    with opened(device, clock, wire) as supply:
        prepare(supply, LIMITS, model=model.name)
        reading = switch_on(supply, Decimal("4.35"))
        assert reading.voltage_V == 4.35  # what published drivers make 4.34
        assert reading.current_A == pytest.approx(0.435, abs=0.006)
        assert reading.input_voltage_V is None or reading.input_voltage_V > 30
        watch(supply)
        assert supply.off()
        assert supply.terminals_dead()
    assert [volts for _, volts in device.history] == [0, 4.35, 0]
    ways = {json.loads(line)["way"] for line in wire}
    assert ways == {"sent", "received"}


@every_model
def test_a_name_that_it_is_sold_under_means_the_same_model(model: Model) -> None:
    for name in (model.name, *model.also):
        assert model_named(name) is model


@each_family
def test_a_limit_event_is_a_safety_stop(clock: SimulatedClock, name: str) -> None:
    for event in (
        SimulatedFault.OVP_TRIP,
        SimulatedFault.OCP_TRIP,
        SimulatedFault.PANEL_OFF,
        SimulatedFault.POWER_CYCLE,
    ):
        device = simulated_supply(name, clock=clock, load=driving)
        with opened(device, clock, []) as supply:
            prepare(supply, LIMITS, model=name)
            switch_on(supply, Decimal("4.5"))
            device.fail(event)
            with pytest.raises(SafetyStop, match=r"tripped at|its output went off, not by this"):
                watch(supply)
        assert device.history[-1][1] == 0


@each_family
def test_a_hand_at_the_front_panel_ends_the_run(clock: SimulatedClock, name: str) -> None:
    device = simulated_supply(name, clock=clock, load=driving)
    with opened(device, clock, []) as supply:
        prepare(supply, LIMITS, model=name)
        switch_on(supply, Decimal("3.5"))
        device.fail(SimulatedFault.PANEL_VOLTAGE)
        assert device.history[-1][1] == 4.5
        words = r"its setpoint is 4\.5 V, this program set 3\.5 V; somebody changed.*off, confirm"
        with pytest.raises(SafetyStop, match=words):
            watch(supply)
    assert device.history[-1][1] == 0


@each_family
def test_an_output_switched_on_by_hand_is_lowered_before_it_is_used(
    clock: SimulatedClock, name: str
) -> None:
    device = simulated_supply(name, clock=clock, load=driving)
    device.fail(SimulatedFault.PANEL_VOLTAGE)
    device.fail(SimulatedFault.PANEL_ON)
    with opened(device, clock, []) as supply:
        assert prepare(supply, LIMITS, model=name).found.output
    assert [volts for _, volts in device.history] == pytest.approx([0, 1, 0.5, 0])


@each_family
@pytest.mark.parametrize(
    ("fault", "words"),
    [(SimulatedFault.TIMES_TEN, r"measures \d+"), (SimulatedFault.A_TENTH, r"measures 0\.\d+")],
)
def test_a_factor_of_ten_switches_off_at_once(
    clock: SimulatedClock, name: str, fault: SimulatedFault, words: str
) -> None:
    device = simulated_supply(name, clock=clock)
    with opened(device, clock, []) as supply:
        prepare(supply, LIMITS, model=name)
        device.fail(fault)
        before = clock.now()
        match = f"{words} V where 1.2 V was set, a factor of ten: scaling.*off, confirmed"
        with pytest.raises(SafetyStop, match=match):
            switch_on(supply, Decimal("1.2"))
        if name == "RD6006":  # text needs a pause between questions
            assert clock.now() - before <= 0.26
    assert device.history[-1][1] == 0


@each_family
def test_a_factor_of_ten_while_it_runs_switches_off_too(clock: SimulatedClock, name: str) -> None:
    device = simulated_supply(name, clock=clock)
    with opened(device, clock, []) as supply:
        prepare(supply, LIMITS, model=name)
        switch_on(supply, Decimal("1.2"))
        watch(supply)
        device.fail(SimulatedFault.TIMES_TEN)
        with pytest.raises(SafetyStop, match="a factor of ten: scaling fault"):
            watch(supply)
    assert device.history[-1][1] == 0


@each_family
def test_current_limiting_is_told_from_cv(clock: SimulatedClock, name: str) -> None:
    device = simulated_supply(name, clock=clock, load=lambda volts: volts / 2)
    with opened(device, clock, []) as supply:
        prepare(supply, LIMITS, model=name)
        words = r"current limiting \(CC\)|did not come on and stay on"  # some trip instead
        with pytest.raises(SafetyStop, match=words):
            switch_on(supply, Decimal(5))
    assert device.history[-1][1] == 0


@each_family
def test_a_setting_that_is_not_applied_is_told(clock: SimulatedClock, name: str) -> None:
    device = simulated_supply(name, clock=clock)
    with opened(device, clock, []) as supply:
        prepare(supply, LIMITS, model=name)
        device.fail(SimulatedFault.IGNORED_WRITE)
        with pytest.raises(HardwareError, match=r"asked 4\.35 V.*(read back 0|it holds .*0)"):
            supply.set_voltage(Decimal("4.35"))
        with pytest.raises(HardwareError, match="output asked on"):
            supply.set_output(True)


@each_family
def test_readings_that_stand_still_are_noticed_when_the_voltage_should_change(
    clock: SimulatedClock, name: str
) -> None:
    device = simulated_supply(name, clock=clock)
    with opened(device, clock, []) as supply:
        prepare(supply, LIMITS, model=name)
        switch_on(supply, Decimal(3))
        device.fail(SimulatedFault.FROZEN_READING)
        with pytest.raises(HardwareError, match=r"asked 5 V"):
            supply.set_voltage(Decimal(5))
        assert not supply.off()  # it goes on saying on: not confirmed
    assert device.history[-1][1] == 0


@each_family
def test_off_that_its_terminals_belie_is_not_believed(clock: SimulatedClock, name: str) -> None:
    device = simulated_supply(name, clock=clock)
    with opened(device, clock, []) as supply:
        prepare(supply, LIMITS, model=name)
        switch_on(supply, Decimal(3))
        device.fail(SimulatedFault.FALSE_OFF)
        assert supply.off()
        assert not supply.terminals_dead()
        assert device.history[-1][1] == 3


WIRE = {
    SimulatedFault.SILENT: f"no answer within {QUICK_S} s",
    SimulatedFault.BAD_CRC: "answer damaged|which is no answer to it|does not answer",
    SimulatedFault.SHORT_REPLY: "answer cut short|no answer|does not answer",
    SimulatedFault.LATE_REPLY: f"no answer within {QUICK_S} s|does not answer",
    SimulatedFault.EXCEPTION: (
        "exception 4, device failure|which is no answer to it|does not answer"
    ),
}


@each_family
@pytest.mark.parametrize("fault", WIRE, ids=str)
def test_a_fault_on_the_wire_is_told_and_then_over(
    clock: SimulatedClock, name: str, fault: SimulatedFault
) -> None:
    device = simulated_supply(name, clock=clock)
    with opened(device, clock, [], QUICK_S) as supply:
        device.fail(fault, delay_s=1.7 * QUICK_S)
        with pytest.raises(HardwareError, match=WIRE[fault]):
            supply.measure()
        device.mend()
        device.fail(SimulatedFault.PANEL_VOLTAGE)
        assert supply.measure().set_voltage_V == 1.0


@each_family
@pytest.mark.parametrize(
    "fault",
    [
        SimulatedFault.SILENT,
        SimulatedFault.BAD_CRC,
        SimulatedFault.SHORT_REPLY,
        SimulatedFault.JUNK,
        SimulatedFault.REPEATED_REPLY,
    ],
    ids=str,
)
def test_one_bad_answer_never_changes_a_reading(
    clock: SimulatedClock, name: str, fault: SimulatedFault
) -> None:
    device = simulated_supply(name, clock=clock)
    with opened(device, clock, [], QUICK_S) as supply:
        for turn in range(1, 4):
            device.fail(SimulatedFault.PANEL_VOLTAGE)
            device.fail(fault, times=1)
            assert supply.measure().set_voltage_V == turn
            device.mend()


@each_family
def test_a_pulled_cable_is_told_and_the_same_supply_is_switched_off_after(
    clock: SimulatedClock, name: str
) -> None:
    device = simulated_supply(name, clock=clock)
    with opened(device, clock, [], QUICK_S) as supply:
        prepare(supply, LIMITS, model=name)
        switch_on(supply, Decimal(3))
        device.fail(SimulatedFault.UNPLUGGED)
        with pytest.raises(HardwareError, match="connection was lost"):
            measure_until_it_fails(supply)
        assert not supply.off()
        assert device.history[-1][1] == 3  # nothing software could do
        device.mend()
        assert supply.off()
    assert device.history[-1][1] == 0


@pytest.mark.parametrize(
    ("make", "family", "words"),
    [
        (lambda clock: SimulatedDps(clock=clock), "riden", "model id 0 is not known"),
        (lambda clock: SimulatedHanmatek(clock=clock), "dps", "exception 2|not known"),
        (lambda clock: SimulatedDps(clock=clock), "hanmatek", "class 0 and decimals|are not those"),
        (lambda clock: SimulatedKorad(clock=clock), "scpi", "'KORADKA3005PV2.0', which is no kno"),
        (
            lambda clock: simulated_supply("DP832", clock=clock),
            "korad",
            "no answer within",
        ),  # no LF
    ],
)
def test_a_supply_of_another_family_is_refused_and_nothing_is_set(
    clock: SimulatedClock,
    make: Callable[[SimulatedClock], SimulatedSupply],
    family: str,
    words: str,
) -> None:
    device = make(clock)
    device.fail(SimulatedFault.PANEL_ON)
    before = device.output
    modbus = family in ("riden", "dps", "hanmatek")
    with serve(device) as address:
        place = Connection("rtu-over-tcp" if modbus else "tcp", address, timeout_s=QUICK_S)
        with pytest.raises(HardwareError, match=words):
            open_supply(place, clock=clock, wire_log=lambda line: None, family=family)
    assert device.output == before


@pytest.mark.parametrize("family", ["korad", "scpi"])
def test_text_is_not_sent_in_rtu_frames(clock: SimulatedClock, family: str) -> None:
    with pytest.raises(InputError, match="speaks text and no RTU frames; its kind is serial, or"):
        open_supply(
            Connection("rtu-over-tcp", "127.0.0.1:1"),
            clock=clock,
            wire_log=lambda line: None,
            family=family,
        )
