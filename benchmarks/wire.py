"""Read supplies over a wire that loses, delays, repeats and spoils: is one wrong reading accepted?

    python benchmarks/wire.py                  100,000 disturbed exchanges a family
    python benchmarks/wire.py --quick          a fiftieth of it
    python benchmarks/wire.py --only korad     one family

The bytes are those of stubs that share no table with the drivers (`tests/hw/foreign.py`); time is
simulated, so that nothing waits. Like a serial line or a TCP stream the wire keeps the order of
what it delivers. The supply is in another state at every reading, and somebody selects another
channel where there are several; every tenth turn it is switched off as well, and off that is
confirmed while its terminals are live counts as a wrong reading.
"""

from __future__ import annotations

import argparse
import collections
import random
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from tests.hw.foreign import (
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
)
from workbench.errors import HardwareError
from workbench.hw import Connection, Reading, SimulatedClock, Supply
from workbench.hw import korad as korad_driver
from workbench.hw import scpi as scpi_driver
from workbench.hw.dps import DpsSupply
from workbench.hw.hanmatek import HanmatekSupply
from workbench.hw.korad import KoradSupply
from workbench.hw.line import Line
from workbench.hw.modbus import ModbusSupply
from workbench.hw.riden import RidenSupply
from workbench.hw.scpi import ScpiSupply
from workbench.hw.transport import Transport

__all__ = ["STUBS", "DisturbedWire", "Score", "read_supply"]

FAULTS = 100_000
SHARES = (0.05, 0.1, 0.25)  # of exchanges that are disturbed, in turn
LONGEST_S = 8.0  # that an answer is late, sixteen timeouts
TRAVEL_S = 0.004
PLACE = Connection("rtu-over-tcp", "127.0.0.1:1")
SEED = 8
KINDS = ("unheard", "lost", "late", "cut", "spoilt", "junk", "repeated", "split", "foreign")
MODBUS: dict[str, type[ModbusSupply]] = {
    "riden": RidenSupply,
    "dps": DpsSupply,
    "hanmatek": HanmatekSupply,
}
STUBS: dict[str, tuple[str, Callable[[], Foreign]]] = {
    "RD6006": ("riden", Rd6006),
    "DPS5005": ("dps", Dps5005),
    "HM305P": ("hanmatek", Hm305p),
    "KA3005P": ("korad", Ka3005p),
    "72-2540": ("korad", lambda: Ka3005p(b"TENMA72-2540V2.0", b"7")),
    "HMP4040": ("scpi", Hmp4040),
    "E36312A": ("scpi", E36312A),
    "DP832": ("scpi", Dp832),
    "SPE6103": ("scpi", Spe6103),
    "SPD3303X-E": ("scpi", Spd3303xE),
}
"""Model -> family and stub."""


@dataclass(frozen=True)
class Score:
    """What came of so many readings.

    Args:
        accepted: readings that were taken, and offs that were confirmed.
        refused: those that ended with an error, or unconfirmed.
        wrong: those that were taken and are not the stub's.
        exchanges: questions and commands that went out.
        faults: what the wire did, and how often.
    """

    accepted: int
    refused: int
    wrong: int
    exchanges: int
    faults: dict[str, int]


class DisturbedWire:
    """A channel to a stub; see `workbench.hw.channel.Channel`.

    Args:
        stub: answers.
        clock: arrival times are by it.
        rng: decides what goes wrong.
        checked: whether answers have a checksum. Without, characters are spoilt out of their range,
            as a digit that turns into another one could be noticed by nobody.
    """

    def __init__(
        self, stub: Foreign, clock: SimulatedClock, rng: random.Random, *, checked: bool
    ) -> None:
        self._stub, self._clock, self._rng, self._checked = stub, clock, rng, checked
        self._coming: collections.deque[tuple[float, bytes]] = collections.deque()
        self._last = b""
        self.faults: collections.Counter[str] = collections.Counter()
        self.exchanges = 0
        self.share = 0.0

    def send(self, data: bytes) -> None:
        """Let the stub answer, and let something happen to request or answer."""
        self.exchanges += 1
        kind = self._rng.choice(KINDS) if self._rng.random() < self.share else ""
        if kind == "unheard":
            self.faults[kind] += 1
            return
        for answer in self._stub.receive(data):
            if kind:
                self.faults[kind] += 1
            self._deliver_as(kind, answer)
            self._last = answer

    def receive(self, seconds: float) -> bytes:
        """Return what arrives next within so many simulated seconds."""
        if self._coming and self._coming[0][0] <= self._clock.now() + seconds:
            arrival, data = self._coming.popleft()
            self._clock.sleep(arrival - self._clock.now())
            return data
        self._clock.sleep(seconds)
        return b""

    def close(self) -> None:
        """Forget what is under way."""
        self._coming.clear()

    def _deliver(self, data: bytes, late_s: float = TRAVEL_S) -> None:
        before = self._coming[-1][0] if self._coming else 0.0
        if data:
            self._coming.append((max(self._clock.now() + late_s, before), data))

    def _deliver_as(self, kind: str, data: bytes) -> None:
        rng = self._rng
        match kind:
            case "lost":
                pass
            case "late":
                self._deliver(data, rng.uniform(0.1, LONGEST_S))
            case "cut":
                self._deliver(data[: rng.randrange(len(data))])
            case "spoilt":
                at = rng.randrange(len(data))
                mask = rng.randrange(1, 256) if self._checked else 0x80
                self._deliver(data[:at] + bytes([data[at] ^ mask]) + data[at + 1 :])
            case "junk":
                low = 0 if self._checked else 0x80
                junk = bytes(rng.randrange(low, 256) for _ in range(rng.randrange(2, 9)))
                self._deliver(junk + data)
            case "repeated":
                self._deliver(data)
                self._deliver(data, rng.uniform(TRAVEL_S, LONGEST_S))
            case "split":
                at = rng.randrange(len(data))
                self._deliver(data[:at])
                self._deliver(data[at:], rng.uniform(TRAVEL_S, 0.4))
            case "foreign":  # the answer to what was asked before
                self._deliver(self._last or data)
            case _:
                self._deliver(data)


def read_supply(model: str, faults: int, seed: int = SEED) -> Score:
    """Take readings of a stub until so many exchanges were disturbed."""
    family, make = STUBS[model]
    clock, rng, stub = SimulatedClock(), random.Random(seed), make()
    wire = DisturbedWire(stub, clock, rng, checked=family in MODBUS)
    supply = _opened(family, clock, wire)
    accepted = wrong = turn = 0
    while wire.faults.total() < faults:
        turn += 1
        volts, on, off = (100 + turn * 7 % 400) / 100, turn % 3 > 0, turn % 10 == 0
        stub.put(volts, on or off)
        stub.meddle()
        wire.share = SHARES[turn % len(SHARES)]
        if off:
            if supply.off() and supply.terminals_dead():
                accepted += 1
                wrong += stub.terminals().live > 0
            continue
        try:
            reading = supply.measure()
        except HardwareError:
            continue
        accepted += 1
        wrong += not _is_true(reading, stub)
    return Score(accepted, turn - accepted, wrong, wire.exchanges, dict(wire.faults))


def _is_true(reading: Reading, stub: Foreign) -> bool:
    """Tell whether a reading is the stub's state, as far as its digits go."""
    now = stub.terminals()
    pairs = (
        (reading.set_voltage_V, now.volts, 0.0051),
        (reading.voltage_V, now.live, 0.0051),
        (reading.current_A, now.drawn, 0.0051),
    )
    return reading.output == now.on and all(abs(a - b) < near for a, b, near in pairs)


def _opened(family: str, clock: SimulatedClock, wire: DisturbedWire) -> Supply:
    if family in MODBUS:
        driver, own = MODBUS[family], MODBUS[family].registers
        link = Transport(
            PLACE,
            writable=own.writable,
            clock=clock,
            wire_log=lambda line: None,
            marks=own.marks,
            opened=lambda connection: wire,
            now=clock.now,
        )
        return driver(link, clock)
    speaks, text = (korad_driver, KoradSupply) if family == "korad" else (scpi_driver, ScpiSupply)
    line = Line(
        PLACE,
        terminator=speaks.TERMINATOR,
        may_send=speaks.MAY_SEND,
        gap_s=speaks.GAP_S,
        clock=clock,
        wire_log=lambda line: None,
        opened=lambda connection: wire,
    )
    return text(line, clock)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--only", default="", help="a family")
    given = parser.parse_args()
    rows = [name for name, (family, _) in STUBS.items() if given.only in ("", family)]
    every = collections.Counter(STUBS[name][0] for name in rows)
    shares = f"{SHARES[0]:.0%} to {SHARES[-1]:.0%}"
    print(f"{shares} of exchanges disturbed, answers up to {LONGEST_S:g} s late, seed {SEED}")
    print("readings of a     faults  exchanges  accepted   refused  wrong  processor s")
    for name in rows:
        family = STUBS[name][0]
        began = time.process_time()
        score = read_supply(name, FAULTS // every[family] // (50 if given.quick else 1))
        spent = time.process_time() - began
        print(
            f"{name:15} {sum(score.faults.values()):8} {score.exchanges:10} {score.accepted:9} "
            f"{score.refused:9} {score.wrong:6} {spent:12.1f}"
        )
        print("    " + ", ".join(f"{kind} {score.faults.get(kind, 0)}" for kind in KINDS))


if __name__ == "__main__":
    main()
