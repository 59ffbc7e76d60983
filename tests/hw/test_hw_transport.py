"""The link against bytes from a script; the CRCs were worked out apart from pymodbus."""

from __future__ import annotations

import json
import re
import socket
import time
from collections.abc import Callable, Iterator

import pytest
from hw_stub import PAUSE_S, QUICK_S, Play

from workbench.errors import HardwareError, InputError, SafetyStop
from workbench.hw import Connection, SimulatedClock, SimulatedFault, serve
from workbench.hw.models import RIDEN_REGISTERS
from workbench.hw.simulated import SimulatedRiden
from workbench.hw.transport import Transport

ONE = "01 03 00 08 00 01 05 c8"  # read register 8
ONE_IS_111 = "01 03 02 00 6f f8 68"
BLOCK = "01 03 00 08 00 0d 05 cd"  # read registers 8 to 20
SET = "01 06 00 08 01 b3 48 2d"  # write 435 to register 8

Open = Callable[[Connection], Transport]


@pytest.fixture
def open_link(wire: list[str]) -> Iterator[Open]:
    links: list[Transport] = []

    def start(connection: Connection) -> Transport:
        links.append(
            Transport(
                connection,
                writable=RIDEN_REGISTERS.writable,
                clock=SimulatedClock(12.5),
                wire_log=wire.append,
            )
        )
        return links[-1]

    yield start
    for link in links:
        link.close()


def test_a_read_and_a_write_have_the_bytes_of_the_norm(play: Play, open_link: Open) -> None:
    link = open_link(play([(ONE, ONE_IS_111), (SET, SET)]))
    assert link.read(8, 1) == [111]
    link.write(8, 435)


def test_every_message_is_logged_once_with_time_way_and_bytes(
    play: Play, open_link: Open, wire: list[str]
) -> None:
    open_link(play([(ONE, ONE_IS_111)])).read(8, 1)
    assert [json.loads(line) for line in wire] == [
        {"time_s": 12.5, "way": "sent", "bytes": ONE},
        {"time_s": 12.5, "way": "received", "bytes": ONE_IS_111},
    ]


@pytest.mark.parametrize(
    ("reply", "words"),
    [
        ("01 83 01 80 f0", "exception 1, illegal function"),
        ("01 83 02 c0 f1", "exception 2, illegal address: it has no such register"),
        ("01 83 03 01 31", "exception 3, illegal value"),
        ("01 83 04 40 f3", "exception 4, device failure"),
        ("01 83 06 c1 32", "exception 6, busy"),
    ],
)
def test_an_exception_reply_is_told_in_words_and_not_asked_again(
    play: Play, open_link: Open, reply: str, words: str
) -> None:
    link = open_link(play([(ONE, reply)]))
    with pytest.raises(HardwareError, match=f"read of 1 registers from 8: {words}"):
        link.read(8, 1)


@pytest.mark.parametrize(
    ("reply", "words"),
    [
        ("01 03 02 00 6f f8 69", "answer damaged, its checksum or header does not fit: 01 03 02"),
        ("01 03 02 00 6f", "answer cut short, 5 of 7 bytes: 01 03 02 00 6f"),
        ("07 03 02 00 6f 70 68", "unit 7 answered, unit 1 was asked"),
        ("01 04 02 00 6f f9 1c", "answered function 4, not 3"),
        ("01 86 02 c3 a1", "answered function 134, not 3"),
        ("", r"no answer within 0.1 s; is it on.*unit id 1 and 115200 baud right"),
    ],
)
def test_a_bad_answer_is_asked_for_once_more_and_then_told(
    play: Play, open_link: Open, reply: str, words: str
) -> None:
    link = open_link(play([(ONE, reply), (ONE, reply)]))
    with pytest.raises(HardwareError, match=words):
        link.read(8, 1)


def test_a_good_answer_after_a_bad_one_counts(play: Play, open_link: Open) -> None:
    link = open_link(play([(ONE, "01 03 02 00 6f f8 69"), (ONE, ONE_IS_111)]))
    assert link.read(8, 1) == [111]


def test_a_short_answer_with_a_right_checksum_is_refused(play: Play, open_link: Open) -> None:
    link = open_link(play([(BLOCK, ONE_IS_111), (BLOCK, ONE_IS_111)]))
    with pytest.raises(HardwareError, match="read of 13 registers from 8: answered with 1 regis"):
        link.read(8, 13)


def test_a_foreign_echo_is_refused_and_a_write_is_not_repeated(play: Play, open_link: Open) -> None:
    link = open_link(play([(SET, "01 06 00 09 01 b3 19 ed")]))
    with pytest.raises(HardwareError, match=r"write of 435 to register 8: echoed \[435\] to reg"):
        link.write(8, 435)


def test_a_connection_that_ends_is_lost_until_it_is_opened(
    device: SimulatedRiden, open_link: Open
) -> None:
    with serve(device) as address:
        link = open_link(Connection("rtu-over-tcp", address, timeout_s=QUICK_S))
        assert link.read(0, 1) == [60061]
    with pytest.raises(HardwareError, match="the connection was lost"):
        link.read(0, 1)
    assert not link.connected
    with pytest.raises(HardwareError, match="the connection is lost; reopen it and check who"):
        link.read(0, 1)
    with serve(device, port=link.connection.host_and_port[1]):
        link.open()
        assert link.read(0, 1) == [60061]


def test_a_late_reply_never_becomes_the_answer_to_another_question(
    device: SimulatedRiden, connection: Connection, open_link: Open, wire: list[str]
) -> None:
    link = open_link(connection)
    device.write(8, [111, 222])
    device.fail(SimulatedFault.LATE_REPLY, times=2, delay_s=1.7 * QUICK_S)
    with pytest.raises(HardwareError, match=r"no answer within 0\.1 s"):
        link.read(8, 1)
    assert link.read(9, 1) == [222]
    assert [json.loads(line)["way"] for line in wire].count("discarded") == 2


def test_a_late_echo_does_not_confirm_another_write(
    device: SimulatedRiden, connection: Connection, open_link: Open
) -> None:
    link = open_link(connection)
    device.fail(SimulatedFault.LATE_REPLY, times=1, delay_s=1.7 * QUICK_S)
    with pytest.raises(HardwareError, match="write of 100 to register 8: no answer"):
        link.write(8, 100)
    link.write(8, 200)
    assert link.read(8, 1) == [200]


def test_bytes_that_nobody_asked_for_are_dropped_before_asking(
    play: Play, open_link: Open, wire: list[str]
) -> None:
    link = open_link(play([(ONE, f"{ONE_IS_111} | 01 03 02 00 00 b8 44"), (ONE, ONE_IS_111)]))
    assert link.read(8, 1) == [111]
    time.sleep(5 * PAUSE_S)
    assert link.read(8, 1) == [111]
    assert json.loads(wire[2])["way"] == "discarded"


@pytest.mark.parametrize("register", [*range(54, 63), 68, 256])
def test_forbidden_registers_send_nothing(
    connection: Connection, open_link: Open, wire: list[str], register: int
) -> None:
    with pytest.raises(
        SafetyStop, match=f"register {register} is none of those that may be written"
    ):
        open_link(connection).write(register, 5633)
    assert wire == []


def test_more_than_20_registers_are_never_asked_for(
    connection: Connection, open_link: Open
) -> None:
    with pytest.raises(ValueError, match="21 registers asked for; 1 to 20"):
        open_link(connection).read(0, 21)


def test_a_closed_port_is_not_reachable_with_advice(open_link: Open) -> None:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        address = f"127.0.0.1:{listener.getsockname()[1]}"
    words = f"{re.escape(address)} not reachable: nothing accepts a connection there; check the"
    with pytest.raises(HardwareError, match=words):
        open_link(Connection("tcp", address))


def test_a_missing_serial_port_is_not_reachable_with_the_ports_present(open_link: Open) -> None:
    with pytest.raises(HardwareError, match=r"no-such-port not reachable: .*Ports present: "):
        open_link(Connection("serial", "no-such-port"))


@pytest.mark.parametrize("address", ["localhost", "127.0.0.1:", ":502", "host:70000", "host:x"])
def test_a_tcp_address_needs_host_and_port(address: str) -> None:
    with pytest.raises(InputError, match="is not host:port"):
        Connection("tcp", address)


@pytest.mark.parametrize("unit", [1, 7])
def test_only_the_right_unit_answers_over_modbus_tcp(
    device: SimulatedRiden, open_link: Open, unit: int
) -> None:
    with serve(device, framing="tcp") as address:
        link = open_link(Connection("tcp", address, unit=unit, timeout_s=QUICK_S))
        if unit == device.unit:
            assert link.read(0, 1) == [60061]
        else:
            with pytest.raises(HardwareError, match=r"no answer.*unit id 7"):
                link.read(0, 1)
