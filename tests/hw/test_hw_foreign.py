"""Each driver against a stub that shares no table with it: what was asked is at the terminals."""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from decimal import Decimal
from pathlib import Path

import pytest
from foreign import (
    E36312A,
    Dp832,
    Dps5005,
    Foreign,
    Hm305p,
    Hmp4040,
    Ka3005p,
    Rd6006,
    Spd3303xE,
    Spe6103,
    served,
)

from workbench.errors import HardwareError, SafetyStop
from workbench.hw import (
    Connection,
    Limits,
    ModbusModel,
    SimulatedClock,
    Supply,
    korad,
    model_named,
    open_supply,
    prepare,
    switch_on,
    watch,
)
from workbench.hw.korad import KoradSupply
from workbench.hw.line import Line

LOW = Limits(Decimal("4.5"), Decimal("0.9"), Decimal("4.9"), Decimal("0.95"))
QUICK_S = 0.1

Make = Callable[[], Foreign]

STUBS: dict[str, tuple[str, Make]] = {
    "RD6006": ("RD6006", Rd6006),
    "RD6006 of 2020": ("RD6006", lambda: Rd6006(60061)),
    "RD6006P": ("RD6006P", lambda: Rd6006(60065, 1000, 10000)),
    "RK6006": ("RK6006", lambda: Rd6006(60066)),
    "RD6012": ("RD6012", lambda: Rd6006(60121, 100, 100)),
    "RD6012P": ("RD6012P", lambda: Rd6006(60125, 1000, 10000)),
    "RD6018": ("RD6018", lambda: Rd6006(60181, 100, 100)),
    "RD6024": ("RD6024", lambda: Rd6006(60241, 100, 100)),
    "RD6030": ("RD6030", lambda: Rd6006(60301, 100, 100)),
    "DPS5005": ("DPS5005", Dps5005),
    "HM305P": ("HM305P", Hm305p),
    "KA3005P": ("KA3005P", Ka3005p),
    "72-2540, stray digit": ("72-2540", lambda: Ka3005p(b"TENMA72-2540V2.0", b"7")),
    "72-2540, stray letter": ("72-2540", lambda: Ka3005p(b"TENMA 72-2540 V2.1", b"K")),
    "HMP4040": ("HMP4040", Hmp4040),
    "E36312A": ("E36312A", E36312A),
    "DP832": ("DP832", Dp832),
    "SPE6103": ("SPE6103", Spe6103),
    "SPD3303X-E": ("SPD3303X-E", Spd3303xE),
}
SEVERAL = ("HMP4040", "E36312A", "DP832", "SPD3303X-E")


@contextmanager
def opened(
    stub: Foreign, model: str, clock: SimulatedClock, channel: int = 1, wait_s: float = 0.5
) -> Iterator[Supply]:
    row = model_named(model)
    kind = "rtu-over-tcp" if isinstance(row, ModbusModel) else "tcp"
    with served(stub) as address:
        place = Connection(kind, address, timeout_s=wait_s, channel=channel)
        supply = open_supply(place, clock=clock, wire_log=lambda line: None, family=row.family)
        try:
            yield supply
        finally:
            supply.close()


@pytest.mark.parametrize("name", STUBS)
def test_what_is_asked_is_at_the_terminals(clock: SimulatedClock, name: str) -> None:
    model, make = STUBS[name]
    stub = make()
    with opened(stub, model, clock) as supply:
        ready = prepare(supply, LOW, model=model)
        assert ready.identity.model == model
        reading = switch_on(supply, Decimal("2.93"))
        now = stub.terminals()
        assert (now.live, now.drawn) == pytest.approx((2.93, 0.293))
        assert now.amps == pytest.approx(0.9)
        assert reading.voltage_V == pytest.approx(2.93, abs=0.0005)
        assert reading.current_A == pytest.approx(0.293, abs=0.0051)
        supply.set_voltage(Decimal("4.35"))
        assert stub.terminals().live == pytest.approx(4.35)
        assert watch(supply).set_voltage_V == 4.35
        stub.put(4.4, on=True)
        with pytest.raises(SafetyStop, match=r"setpoint is 4\.4 V.*the output is off, confirmed"):
            watch(supply)
        assert (stub.terminals().on, stub.terminals().live) == (False, 0)
        assert supply.terminals_dead()


@pytest.mark.parametrize("model", SEVERAL)
@pytest.mark.parametrize("channel", [1, 2])
def test_whatever_is_selected_meanwhile_the_chosen_channel_is_meant(
    clock: SimulatedClock, model: str, channel: int
) -> None:
    stub = STUBS[model][1]()
    assert isinstance(stub, (Hmp4040, E36312A, Dp832, Spd3303xE))
    other = stub.channels[3 - channel]
    other.volts, other.on = 3.3, True
    with opened(stub, model, clock, channel) as supply:
        stub.selected = 3 - channel
        assert not prepare(supply, LOW, model=model).found.output
        stub.selected = 3 - channel
        assert switch_on(supply, Decimal("2.93")).voltage_V == 2.93
        stub.selected = 3 - channel
        assert watch(supply).voltage_V == 2.93
        stub.selected = 3 - channel
        assert supply.off()
        assert stub.channels[channel].live == 0
        assert other.live == 3.3
    assert stub.errors == []


@pytest.mark.parametrize(
    ("model", "make", "words"),
    [
        ("RD6018", lambda: Rd6006(60185, 1000, 1000), "model id 60185 is not known.*RD6018 60181"),
        ("RD6012", lambda: Rd6006(60122, 100, 1000), "model id 60122 is not known"),
        ("DPS5005", lambda: Dps5005(5099), "model id 5099 is not known"),
        ("HM305P", lambda: Hm305p(0x333), "decimals 0x0333 are not those of a known Hanmatek"),
        ("KA3005P", lambda: Ka3005p(b"KORAD KA9000P V1.0"), "is no known model"),
    ],
)
def test_one_that_counts_in_other_steps_is_refused(
    clock: SimulatedClock, model: str, make: Make, words: str
) -> None:
    stub = make()
    with pytest.raises(HardwareError, match=words), opened(stub, model, clock):
        pass
    assert not stub.terminals().on


@pytest.mark.parametrize("measured", [1000.0, 10.0])
def test_a_set_and_a_measured_scale_that_differ_stop_it(
    clock: SimulatedClock, measured: float
) -> None:
    stub = Rd6006(measured_per_volt=measured)
    with opened(stub, "RD6006", clock) as supply:
        prepare(supply, LOW, model="RD6006")
        match = "a factor of ten: scaling fault, its model or its scale.*is off, confirmed"
        with pytest.raises(SafetyStop, match=match):
            switch_on(supply, Decimal("1.2"))
    assert not stub.terminals().on


@pytest.mark.parametrize("joined", [1, 2])
def test_channels_that_are_joined_at_the_front_are_not_driven(
    clock: SimulatedClock, joined: int
) -> None:
    stub = Spd3303xE()
    with opened(stub, "SPD3303X-E", clock) as supply:
        stub.joined = joined
        with pytest.raises(HardwareError, match="which multiplies what is set; make them indep"):
            prepare(supply, LOW, model="SPD3303X-E")
        stub.joined = 0
        prepare(supply, LOW, model="SPD3303X-E")
        stub.joined = joined
        match = "channels are joined in series or in parallel.*the output is off, confirmed"
        with pytest.raises(SafetyStop, match=match):
            switch_on(supply, Decimal("2.93"))
    assert not stub.terminals().on


class Mumbling(Spe6103):
    """An Owon that garbles its name so many times."""

    garbled = 0

    def receive(self, data: bytes) -> list[bytes]:
        if data == b"*IDN?\n" and self.garbled:
            self.garbled -= 1
            return [b"OW?N\n"]
        return super().receive(data)


def test_a_garbled_name_keeps_no_output_from_coming_on_but_no_off_is_confirmed_by_it(
    clock: SimulatedClock,
) -> None:
    stub = Mumbling()
    with opened(stub, "SPE6103", clock) as supply:
        prepare(supply, LOW, model="SPE6103")
        stub.garbled = 1
        assert switch_on(supply, Decimal("2.93")).output
        stub.garbled = 1
        with pytest.raises(HardwareError, match=r"IDN\?: answered b'OW\?N\\n', which is no answer"):
            supply._apply_output(False)
        assert supply.off()
        stub.garbled = 100
        assert not supply.off()
    assert not stub.terminals().on


class LateStray:
    """A channel to a Korad whose byte behind `ISET1?` comes when `STATUS?` is asked next."""

    def __init__(self, stub: Ka3005p) -> None:
        self._stub, self._stray, self._held = stub, stub.stray, b""
        stub.stray = b""
        self._coming: list[bytes] = []

    def send(self, data: bytes) -> None:
        if data == b"STATUS?" and self._held:
            self._coming.append(self._held)
            self._held = b""
        self._coming += self._stub.receive(data)
        if data == b"ISET1?":
            self._held = self._stray

    def receive(self, seconds: float) -> bytes:
        return self._coming.pop(0) if self._coming else b""

    def close(self) -> None:
        self._coming.clear()


class Stuck(Ka3005p):
    """A Korad that stays on."""

    def receive(self, data: bytes) -> list[bytes]:
        return [] if data == b"OUT0" else super().receive(data)


def test_a_stray_byte_that_comes_late_is_no_state(clock: SimulatedClock) -> None:
    stub = Stuck(b"TENMA72-2540V2.0", b"1")  # read as a status it says off
    line = Line(
        Connection("tcp", "127.0.0.1:1"),
        terminator=korad.TERMINATOR,
        may_send=korad.MAY_SEND,
        gap_s=korad.GAP_S,
        clock=clock,
        wire_log=lambda line: None,
        opened=lambda connection: LateStray(stub),
    )
    supply = KoradSupply(line, clock)
    stub.put(2.93, on=True)
    assert line.ask("ISET1?", korad.AMPS) == b"1.000"
    with pytest.raises(HardwareError, match=r"b'.' came that nobody asked for|no answer to it"):
        supply._apply_output(False)
    stub.put(2.93, on=True)
    with pytest.raises(HardwareError, match="within one reading"):
        supply.measure()


def test_one_that_never_tells_its_name_is_hinted_at(clock: SimulatedClock) -> None:
    match = r"no answer within 0\.1 s.*as some never answer \*IDN\?; or its family is another one"
    with (
        pytest.raises(HardwareError, match=match),
        opened(Ka3005p(b""), "KA3005P", clock, wait_s=QUICK_S),
    ):
        pass


def test_the_stubs_share_nothing_with_the_product() -> None:
    source = Path(__file__).with_name("foreign.py").read_text(encoding="utf-8")
    names = [
        name
        for node in ast.walk(ast.parse(source))
        if isinstance(node, (ast.Import, ast.ImportFrom))
        for name in (
            [node.module or ""]
            if isinstance(node, ast.ImportFrom)
            else [alias.name for alias in node.names]
        )
    ]
    assert names
    assert not [name for name in names if name.partition(".")[0] in ("workbench", "pymodbus")]
