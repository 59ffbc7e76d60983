"""Read supplies over a wire that loses, delays, repeats and spoils: is one wrong reading accepted?

    python benchmarks/wire.py            100,000 register reads, and 5,000 readings a family
    python benchmarks/wire.py --quick    a fiftieth of it

The bytes are those of the simulated devices; time is simulated, so that nothing waits. Like a
serial line or a TCP stream the wire keeps the order of what it delivers.
"""

from __future__ import annotations

import argparse
import collections
import random
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

from workbench.errors import HardwareError
from workbench.hw import Connection, SimulatedClock
from workbench.hw import korad as korad_driver
from workbench.hw import scpi as scpi_driver
from workbench.hw.dps import DpsSupply
from workbench.hw.hanmatek import HanmatekSupply
from workbench.hw.korad import KoradSupply
from workbench.hw.line import Line
from workbench.hw.modbus import ModbusSupply
from workbench.hw.models import RIDEN_REGISTERS, Registers
from workbench.hw.riden import RidenSupply
from workbench.hw.scpi import ScpiSupply
from workbench.hw.simulated import SimulatedRiden, SimulatedSupply, simulated
from workbench.hw.supply import Supply
from workbench.hw.transport import Transport

__all__ = ["NoisyWire", "Score", "read_registers", "read_supply"]

REGISTER_READS, READINGS = 100_000, 5_000
FAULT_SHARE = 0.25  # of answers
LONGEST_S = 8.0  # that an answer is late, sixteen timeouts
TRAVEL_S = 0.004
PLACE = Connection("rtu-over-tcp", "127.0.0.1:1")
SEED = 8
MODELS = ("RD6006", "DPS5005", "HM305P", "KA3005P", "E36312A")  # one a family


@dataclass(frozen=True)
class Score:
    """What came of so many reads.

    Args:
        accepted: readings that were taken.
        refused: reads that ended with an error.
        wrong: readings that were taken and are not the device's.
        faults: what the wire did, and how often.
    """

    accepted: int
    refused: int
    wrong: int
    faults: dict[str, int]


class NoisyWire:
    """A wire to a simulated device; serves as a channel.

    Args:
        device: answers.
        clock: arrival times are by it.
        rng: decides what goes wrong.
        text: whether no answer has a checksum: characters are then spoilt out of their range, as a
            digit that turns into another one could be noticed by nobody.
        asked: called with each request before the device gets it.
    """

    def __init__(
        self,
        device: SimulatedSupply,
        clock: SimulatedClock,
        rng: random.Random,
        *,
        text: bool,
        asked: Callable[[], None] = lambda: None,
    ) -> None:
        self._wire = device.wire("rtu")
        self._clock, self._rng, self._text, self._asked = clock, rng, text, asked
        self._coming: collections.deque[tuple[float, bytes]] = collections.deque()
        self._last = b""
        self.faults: collections.Counter[str] = collections.Counter()
        self.quiet = False

    def send(self, data: bytes) -> None:
        """Let the device answer, and let something happen to the answer."""
        self._asked()
        for answer in self._wire.receive(data):
            if self.quiet or self._rng.random() > FAULT_SHARE:
                self._deliver(answer.data)
            else:
                self._spoil(answer.data)
            self._last = answer.data

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
        self._coming.append((max(self._clock.now() + late_s, before), data))

    def _spoil(self, data: bytes) -> None:
        rng = self._rng
        kinds = ["lost", "late", "cut", "spoilt", "junk", "repeated", "split", "foreign"]
        kind = rng.choice(kinds)
        self.faults[kind] += 1
        match kind:
            case "lost":
                pass
            case "late":
                self._deliver(data, rng.uniform(0.1, LONGEST_S))
            case "cut":
                self._deliver(data[: rng.randrange(len(data))])
            case "spoilt":
                at = rng.randrange(len(data))
                mask = 0x80 if self._text else rng.randrange(1, 256)
                self._deliver(data[:at] + bytes([data[at] ^ mask]) + data[at + 1 :])
            case "junk":
                low = 0x80 if self._text else 0
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


def read_registers(reads: int, seed: int = SEED) -> Score:
    """Read the status block of a Riden whose setpoint is another one at every request."""
    clock, rng, asked = SimulatedClock(), random.Random(seed), [0]
    device = SimulatedRiden(clock=clock)

    def count() -> None:
        asked[0] += 1
        device.write(8, [asked[0] % 6000])

    wire = NoisyWire(device, clock, rng, text=False, asked=count)
    link = Transport(
        PLACE,
        writable=frozenset(),
        clock=clock,
        wire_log=lambda line: None,
        mark=_mark(RIDEN_REGISTERS),
        opened=lambda connection: wire,
        now=clock.now,
    )
    block = RIDEN_REGISTERS.status[0]
    accepted = wrong = 0
    for _ in range(reads):
        try:
            words = link.read(block.start, block.count, spare=block.spare)
        except HardwareError:
            continue
        accepted += 1
        wrong += words[0] != asked[0] % 6000
    return Score(accepted, reads - accepted, wrong, dict(wire.faults))


def read_supply(model: str, readings: int, seed: int = SEED) -> Score:
    """Take readings of a supply whose state is another one at every reading."""
    clock, rng = SimulatedClock(), random.Random(seed)
    device = simulated(model, clock=clock, load=lambda volts: 0.01 * volts)
    text = device.model.family in ("korad", "scpi")
    wire = NoisyWire(device, clock, rng, text=text)
    supply = _opened(device, clock, wire)
    accepted = wrong = 0
    for turn in range(readings):
        centivolts = 100 + turn * 7 % 400
        device.change(set_voltage=centivolts / 100, on=turn % 3 > 0)
        try:
            reading = supply.measure()
        except HardwareError:
            continue
        accepted += 1
        now = device.output
        found = (reading.set_voltage_V, reading.voltage_V, reading.output)
        wrong += found != (now.set_voltage, now.voltage, now.on)
    return Score(accepted, readings - accepted, wrong, dict(wire.faults))


def _mark(registers: Registers) -> tuple[int, int]:
    return registers.identity.start, registers.identity.count


def _opened(device: SimulatedSupply, clock: SimulatedClock, wire: NoisyWire) -> Supply:
    drivers: dict[str, type[ModbusSupply]] = {
        "riden": RidenSupply,
        "dps": DpsSupply,
        "hanmatek": HanmatekSupply,
    }
    wire.quiet = True
    family = device.model.family
    if family in drivers:
        link = Transport(
            PLACE,
            writable=frozenset(),
            clock=clock,
            wire_log=lambda line: None,
            mark=_mark(drivers[family].registers),
            opened=lambda connection: wire,
            now=clock.now,
        )
        supply: Supply = drivers[family](link, clock)
    else:
        speaks, driver = (
            (korad_driver, KoradSupply) if family == "korad" else (scpi_driver, ScpiSupply)
        )
        line = Line(
            PLACE,
            terminator=speaks.TERMINATOR,
            may_send=speaks.MAY_SEND,
            gap_s=speaks.GAP_S,
            clock=clock,
            wire_log=lambda line: None,
            opened=lambda connection: wire,
        )
        supply = driver(line, clock)
    wire.quiet = False
    return supply


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true")
    share = 50 if parser.parse_args().quick else 1
    print(f"{FAULT_SHARE:.0%} of answers disturbed, up to {LONGEST_S:g} s late, seed {SEED}")
    print("what                       reads  accepted   refused  wrong  processor s")
    rows: list[tuple[str, Callable[[], Score]]] = [
        ("registers of an RD6006", lambda: read_registers(REGISTER_READS // share))
    ]
    for model in MODELS:
        rows.append((f"readings of a {model}", partial(read_supply, model, READINGS // share)))
    for name, run in rows:
        began = time.process_time()
        score = run()
        spent = time.process_time() - began
        reads = score.accepted + score.refused
        print(
            f"{name:24} {reads:7} {score.accepted:9} {score.refused:9} {score.wrong:6} {spent:8.1f}"
        )
        faults = ", ".join(f"{kind} {count}" for kind, count in sorted(score.faults.items()))
        print(f"    {faults}")


if __name__ == "__main__":
    main()
