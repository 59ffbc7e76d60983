"""The simulated device: what it does with its registers, and what its faults look like outside."""

from __future__ import annotations

import threading

import pytest

from workbench.errors import HardwareError, InputError
from workbench.hw import Connection, SimulatedClock, SimulatedFault, Supply, serve
from workbench.hw.simulated import SimulatedRiden
from workbench.hw.simulated.faults import RequestError


def test_the_output_follows_the_setpoint_only_while_on(device: SimulatedRiden) -> None:
    device.write(8, [435])
    assert device.read(10, 2) == [0, 0]
    device.write(18, [1])
    assert device.read(10, 2) == [435, 218]  # 0.05 A/V, 1 mA steps
    device.write(18, [0])
    assert device.read(10, 2) == [0, 0]


def test_history_is_the_voltage_at_the_terminals(
    device: SimulatedRiden, clock: SimulatedClock
) -> None:
    for second, (register, word) in enumerate([(8, 400), (18, 1), (8, 450), (8, 450), (18, 0)]):
        clock.sleep(1)
        device.write(register, [word])
        assert clock.now() == second + 1
    assert device.history == [(0, 0), (2, 4.0), (3, 4.5), (5, 0)]


def test_the_current_limit_lowers_the_voltage(clock: SimulatedClock) -> None:
    device = SimulatedRiden(clock=clock, load=lambda volts: volts / 2)
    device.write(8, [500])
    device.write(9, [1000])
    device.write(18, [1])
    assert device.read(10, 2) == [200, 1000]
    assert device.read(17, 1) == [1]


@pytest.mark.parametrize(("register", "level", "code"), [(82, 400, 1), (83, 200, 2)])
def test_a_trip_switches_off_and_says_why_until_switched_on(
    device: SimulatedRiden, register: int, level: int, code: int
) -> None:
    normal = device.read(register, 1)
    device.write(8, [435])
    device.write(18, [1])
    device.write(register, [level])
    assert device.read(16, 3) == [code, 0, 0]
    device.write(register, normal)
    device.write(18, [1])
    assert device.read(16, 3) == [0, 0, 1]


def test_a_preset_is_loaded_and_register_19_reads_0(device: SimulatedRiden) -> None:
    device.write(88, [330, 400, 700, 900])  # M2
    device.write(19, [2])
    assert device.read(8, 2) == [330, 400]
    assert device.read(80, 4) == [330, 400, 700, 900]
    assert device.read(19, 1) == [0]


@pytest.mark.parametrize("address", [0, 3, 10, 14, 16, 17, 120, 256])
def test_what_cannot_be_written_answers_exception_2(device: SimulatedRiden, address: int) -> None:
    with pytest.raises(RequestError, match="Modbus exception 2"):
        device.write(address, [1])


def test_what_does_not_exist_answers_exception_2(device: SimulatedRiden) -> None:
    with pytest.raises(RequestError, match="Modbus exception 2"):
        device.read(119, 2)


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        (SimulatedFault.SILENT, "no answer within 0.1 s"),
        (SimulatedFault.BAD_CRC, "answer damaged"),
        (SimulatedFault.SHORT_REPLY, r"answer cut short, \d+ of \d+ bytes"),
        (SimulatedFault.WRONG_UNIT, "unit 2 answered, unit 1 was asked"),
        (SimulatedFault.LATE_REPLY, r"no answer within 0\.1 s|answered with \d+ registers"),
        (SimulatedFault.EXCEPTION, "exception 4, device failure"),
    ],
)
def test_a_fault_is_told_in_words_and_then_over(
    device: SimulatedRiden, supply: Supply, fault: SimulatedFault, words: str
) -> None:
    device.fail(fault, delay_s=0.15)  # as long as it lasts; once or twice is survived
    with pytest.raises(HardwareError, match=words):
        supply.measure()
    device.mend()
    assert supply.measure().input_voltage_V == 65.0


def test_one_bad_answer_is_survived(device: SimulatedRiden, supply: Supply) -> None:
    for fault in (
        SimulatedFault.SILENT,
        SimulatedFault.BAD_CRC,
        SimulatedFault.SHORT_REPLY,
        SimulatedFault.WRONG_UNIT,
    ):
        device.fail(fault, times=1)
        assert supply.measure().input_voltage_V == 65.0


def test_a_damaged_modbus_tcp_header_is_told(device: SimulatedRiden, clock: SimulatedClock) -> None:
    from workbench.hw import open_supply

    with serve(device, framing="tcp") as address:
        device.fail(SimulatedFault.BAD_CRC)
        with pytest.raises(HardwareError, match="its checksum or header does not fit"):
            open_supply(
                Connection("tcp", address, timeout_s=0.1), clock=clock, wire_log=lambda line: None
            )


def test_serving_leaves_no_thread_and_frees_the_port(device: SimulatedRiden) -> None:
    before = threading.active_count()
    with serve(device) as address:
        port = int(address.rpartition(":")[2])
    with serve(device, port=port) as again:
        assert again == address
        with (
            pytest.raises(InputError, match="no simulated supply can listen"),
            serve(device, port=port),
        ):
            pass
    assert threading.active_count() == before
