"""Stub supplies that share nothing with the product: ids, scales, registers and words of their own.

Driver and simulator read one table of models; a wrong line there is right for both. These were
written from what makers and others print, and import nothing of `workbench`:

- Riden: register list of Baldanos/rd6006; scales of libsigrok rdtech-dps.
- DPS: RuiDeng's "DPS5005 communication protocol".
- Hanmatek: register list of the HM310P by eTommens.
- Korad: "KA3005P remote control syntax V2.0".
- HMP4040: R&S HMP series, SCPI programmers manual. E36312A: Keysight E36300 series programming
  guide. DP832: Rigol DP800 programming guide. SPE6103: OWON SPE series programming manual.
  SPD3303X-E: Siglent SPD3303X quick start.

`receive` is one conversation in process; `served` puts a supply on a TCP port.
"""

from __future__ import annotations

import re
import socket
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import ClassVar

__all__ = [
    "E36312A",
    "Dp832",
    "Dps5005",
    "Foreign",
    "Hm305p",
    "Hmp4040",
    "Ka3005p",
    "Rd6006",
    "Spd3303xE",
    "Spe6103",
    "served",
]

OHMS = 10.0
CHUNK, POLL_S = 999, 0.05


@dataclass
class Terminals:
    """What is truly at one pair of terminals."""

    volts: float = 0.0
    amps: float = 1.0
    on: bool = False
    trip_volts: float = 99.0
    trip_amps: float = 99.0
    fuse: bool = False

    @property
    def live(self) -> float:
        """Volts across the resistor that hangs there."""
        return min(self.volts, self.amps * OHMS) if self.on else 0.0

    @property
    def drawn(self) -> float:
        """Amperes through it."""
        return self.live / OHMS


class Foreign(ABC):
    """One stub.

    Attributes:
        heard: every complete request.
    """

    def __init__(self) -> None:
        self.heard: list[bytes] = []

    @abstractmethod
    def terminals(self, channel: int = 1) -> Terminals:
        """Return what is at a channel."""

    @abstractmethod
    def receive(self, data: bytes) -> list[bytes]:
        """Take bytes and return the answers, in order."""

    @abstractmethod
    def put(self, volts: float, on: bool) -> None:
        """Turn channel 1 by hand."""

    def meddle(self) -> None:  # noqa: B027  most have one channel
        """Select channel 2 and drive it, where there is one."""


def crc(data: bytes) -> bytes:
    """Return Modbus' checksum, low byte first."""
    rest = 0xFFFF
    for byte in data:
        rest ^= byte
        for _ in range(8):
            rest = rest >> 1 ^ 0xA001 if rest & 1 else rest >> 1
    return bytes([rest & 255, rest >> 8])


class _Registers(Foreign):
    """Holding registers of unit 1 behind RTU frames; functions 3 and 6."""

    V_SET, A_SET, ON = 0, 1, 9
    per_volt, per_amp = 100.0, 1000.0

    def __init__(self, words: dict[int, int]) -> None:
        super().__init__()
        self.words = words
        self._waiting = b""

    @abstractmethod
    def measured(self) -> dict[int, int]:
        """Return the registers that follow from what is at the terminals."""

    def terminals(self, channel: int = 1) -> Terminals:
        words = self.words
        volts, amps = words[self.V_SET] / self.per_volt, words[self.A_SET] / self.per_amp
        return Terminals(volts, amps, words[self.ON] == 1)

    def put(self, volts: float, on: bool) -> None:
        self.words[self.V_SET], self.words[self.ON] = round(volts * self.per_volt), int(on)

    def receive(self, data: bytes) -> list[bytes]:
        self._waiting += data
        answers = []
        while len(self._waiting) >= 8:
            frame, self._waiting = self._waiting[:8], self._waiting[8:]
            if crc(frame[:6]) == frame[6:] and frame[0] == 1:
                self.heard.append(frame)
                answer = self._answer(frame)
                answers.append(answer + crc(answer))
        return answers

    def _answer(self, frame: bytes) -> bytes:
        function, first, last = frame[1], *(frame[i] << 8 | frame[i + 1] for i in (2, 4))
        if function == 6 and first in self.words:
            self.words[first] = last
            return frame[:6]
        seen = self.words | self.measured()
        wanted = range(first, first + last)
        if function == 3 and all(place in seen for place in wanted):
            body = b"".join(seen[place].to_bytes(2, "big") for place in wanted)
            return bytes([1, 3, len(body)]) + body
        return bytes([1, function | 0x80, 2 if function in (3, 6) else 1])


class Rd6006(_Registers):
    """A Riden that counts as it is told to; an RD6006 when it is told nothing.

    Args:
        model: of register 0.
        per_volt: counts of a volt, as set and as tripped at.
        per_amp: counts of an ampere.
        measured_per_volt: counts of a measured volt, when they are others.
    """

    V_SET, A_SET, ON = 8, 9, 18

    def __init__(
        self,
        model: int = 60062,
        per_volt: float = 100.0,
        per_amp: float = 1000.0,
        measured_per_volt: float | None = None,
    ) -> None:
        super().__init__(dict.fromkeys(range(120), 0))
        self.per_volt, self.per_amp = per_volt, per_amp
        self._measured_per_volt = measured_per_volt or per_volt
        self.words |= {0: model, 1: 188, 2: 24910, 3: 128, 5: 27, 7: 80, 14: 6512, 80: 500}
        self.words |= {9: round(per_amp), 82: round(62 * per_volt), 83: round(6.2 * per_amp)}

    def measured(self) -> dict[int, int]:
        now = self.terminals()
        watts = round(now.live * now.drawn * 100)
        return {
            10: round(now.live * self._measured_per_volt),
            11: round(now.drawn * self.per_amp),
            12: watts >> 16,
            13: watts & 0xFFFF,
            17: int(now.live < now.volts and now.on),
        }


class Dps5005(_Registers):
    """A DPS5005: 10 mV and 1 mA."""

    def __init__(self, model: int = 5005) -> None:
        named = [*range(0x0D), 0x23, *range(0x50, 0x58)]
        super().__init__(dict.fromkeys(named, 0))
        self.words |= {1: 1000, 5: 5210, 0x0A: 4, 0x0B: model, 0x0C: 17}
        self.words |= {0x52: 5100, 0x53: 5200, 0x54: 2550}

    def measured(self) -> dict[int, int]:
        now = self.terminals()
        limited = int(now.live < now.volts and now.on)
        watts = round(now.live * now.drawn * 100)
        return {2: round(now.live * 100), 3: round(now.drawn * 1000), 4: watts, 8: limited}


class Hm305p(_Registers):
    """An HM305P: volts with two decimals, amperes with three, and it says so in a register.

    Args:
        decimals: one digit each for volts, amperes and watts.
    """

    V_SET, A_SET, ON = 0x30, 0x31, 0x01

    def __init__(self, decimals: int = 0x233) -> None:
        super().__init__(dict.fromkeys([1, 2, 0x20, 0x21, 0x22, 0x23, 0x30, 0x31, 0x32, 0x8801], 0))
        self.per_volt, self.per_amp = 10.0 ** (decimals >> 8), 10.0 ** (decimals >> 4 & 15)
        self.words |= {3: 305, 4: 0x4B50, 5: decimals, 0x31: round(self.per_amp)}
        self.words |= {0x20: round(33 * self.per_volt), 0x21: round(5.1 * self.per_amp)}

    def measured(self) -> dict[int, int]:
        now = self.terminals()
        watts = round(now.live * now.drawn * 1000)
        volts, amps = round(now.live * self.per_volt), round(now.drawn * self.per_amp)
        return {0x10: volts, 0x11: amps, 0x12: watts >> 16, 0x13: watts & 0xFFFF}


class Ka3005p(Foreign):
    """A Korad: commands without an end.

    Args:
        identity: its whole answer to `*IDN?`; an empty one is never given.
        stray: what follows the answer to `ISET1?`.
    """

    SAYS = re.compile(rb"\*IDN\?|STATUS\?|[VI](?:SET|OUT)1(?:\?|:[\d.]+)|(?:OUT|BEEP|OVP|OCP)[01]")

    def __init__(self, identity: bytes = b"KORADKA3005PV2.0", stray: bytes = b"") -> None:
        super().__init__()
        self.identity, self.stray = identity, stray
        self.now = Terminals()
        self._ovp = False

    def terminals(self, channel: int = 1) -> Terminals:
        return self.now

    def put(self, volts: float, on: bool) -> None:
        self.now.volts, self.now.on = volts, on

    def receive(self, data: bytes) -> list[bytes]:
        answers = []
        for found in self.SAYS.finditer(data):
            self.heard.append(found[0])
            if answer := self._answer(found[0].decode()):
                answers.append(answer)
        return answers

    def _answer(self, said: str) -> bytes:
        now = self.now
        match said.partition(":"):
            case ("*IDN?", _, _):
                return self.identity
            case ("STATUS?", _, _):  # CV, beep, lock, output, OVP
                steady = now.live == now.volts or not now.on
                return bytes([steady | 0x10 | now.fuse << 5 | now.on << 6 | self._ovp << 7])
            case ("VSET1?", _, _):
                return b"%05.2f" % now.volts
            case ("ISET1?", _, _):
                return b"%.3f" % now.amps + self.stray
            case ("VOUT1?", _, _):
                return b"%05.2f" % now.live
            case ("IOUT1?", _, _):
                return b"%.3f" % now.drawn
            case ("VSET1", _, number):
                now.volts = float(number)
            case ("ISET1", _, number):
                now.amps = float(number)
            case (("OUT0" | "OUT1") as word, _, _):
                now.on = word == "OUT1"
            case (("OVP0" | "OVP1") as word, _, _):
                self._ovp = word == "OVP1"
            case (("OCP0" | "OCP1") as word, _, _):
                now.fuse = word == "OCP1"
        return b""


class _Lines(Foreign):
    """An instrument that takes lines; one that it does not know is an error and no answer.

    Attributes:
        channels: by number.
        selected: the one that is meant when none is named.
    """

    identity = ""
    count = 1
    number = "%.3f"
    truth = ("0", "1")

    def __init__(self) -> None:
        super().__init__()
        self.channels = {n: Terminals() for n in range(1, self.count + 1)}
        self.selected = 1
        self.errors: list[str] = []
        self._waiting = b""

    @abstractmethod
    def carry_out(self, said: str) -> str | None:
        """Carry out a line and return its answer; raise KeyError when there is no such line."""

    def terminals(self, channel: int = 1) -> Terminals:
        return self.channels[channel]

    def put(self, volts: float, on: bool) -> None:
        self.channels[1].volts, self.channels[1].on = volts, on

    def meddle(self) -> None:
        if self.count > 1:
            self.selected = 2
            self.channels[2].volts, self.channels[2].on = 9.9, True

    def receive(self, data: bytes) -> list[bytes]:
        *lines, self._waiting = (self._waiting + data).split(b"\n")
        answers = []
        for line in lines:
            self.heard.append(line)
            said = line.decode("ascii", "replace").strip()
            try:
                answer = self.identity if said == "*IDN?" else self.carry_out(said)
            except (KeyError, ValueError):
                self.errors.append(said)
                continue
            if answer is not None:
                answers.append(answer.encode() + b"\n")
        return answers

    def told(self, now: Terminals, what: str, word: str) -> None:
        """Set one thing."""
        match what:
            case "volts" | "amps" | "trip_volts" | "trip_amps":
                setattr(now, what, float(word))
            case "on" | "fuse":
                setattr(now, what, {"ON": True, "1": True, "OFF": False, "0": False}[word])
            case _:
                raise KeyError(what)

    def asked(self, now: Terminals, what: str) -> str:
        """Return one thing as it is written."""
        value = getattr(now, what)
        return self.truth[value] if isinstance(value, bool) else self.number % value


class Hmp4040(_Lines):
    """Commands go to the channel that was selected last, here or at the front."""

    identity = "HAMEG,HMP4040,100500,HW50020001/SW2.40"
    count = 4
    MEANS: ClassVar = {
        "VOLT": "volts",
        "CURR": "amps",
        "OUTP": "on",
        "VOLT:PROT:LEV": "trip_volts",
        "FUSE:STAT": "fuse",
        "MEAS:VOLT": "live",
        "MEAS:CURR": "drawn",
    }

    def carry_out(self, said: str) -> str | None:
        header, _, word = said.partition(" ")
        now = self.channels[self.selected]
        match header:
            case "SYST:REM":
                return None
            case "INST:NSEL":
                self.selected = int(word)
                _ = self.channels[self.selected]
                return None
            case "SYST:ERR?":
                return '0,"No error"'
            case "VOLT:PROT:TRIP?" | "FUSE:TRIP?":
                return "0"
        if header.endswith("?"):
            return self.asked(now, self.MEANS[header[:-1]])
        self.told(now, self.MEANS[header], word)
        return None


class E36312A(_Lines):
    """Commands end in a list of channels; without one they go to the selected channel."""

    identity = "Keysight Technologies,E36312A,MY59001234,2.1.0-1.0.4-1.12"
    count = 3
    number = "%+.8E"
    MEANS: ClassVar = {
        "VOLT": "volts",
        "CURR": "amps",
        "OUTP": "on",
        "VOLT:PROT": "trip_volts",
        "CURR:PROT:STAT": "fuse",
        "MEAS:VOLT": "live",
        "MEAS:CURR": "drawn",
    }

    def carry_out(self, said: str) -> str | None:
        found = re.fullmatch(r"([A-Z:]+)(\??)(?: ([^(]*?))?,?(?: ?\(@(\d)\))?", said)
        if not found:
            raise KeyError(said)
        header, asks, word, channel = found.groups()
        if header == "SYST:REM":
            return None
        if header == "INST:NSEL":
            self.selected = int(word)
            return None
        if header == "SYST:ERR":
            return '+0,"No error"'
        now = self.channels[int(channel or self.selected)]
        if header in ("VOLT:PROT:TRIP", "CURR:PROT:TRIP"):
            return "0"
        if asks:
            return self.asked(now, self.MEANS[header])
        self.told(now, self.MEANS[header], word)
        return None


class Dp832(_Lines):
    """The source subsystem carries the channel's number, the others its name."""

    identity = "RIGOL TECHNOLOGIES,DP832,DP8C180500123,00.01.14"
    count = 3
    truth = ("OFF", "ON")
    MEANS: ClassVar = {
        "OUTP": "on",
        "OUTP:OVP:VAL": "trip_volts",
        "OUTP:OCP:VAL": "trip_amps",
        "OUTP:OCP": "fuse",
        "MEAS:VOLT": "live",
        "MEAS:CURR": "drawn",
    }

    def __init__(self) -> None:
        super().__init__()
        self._ovp = False

    def carry_out(self, said: str) -> str | None:
        header, _, rest = said.partition(" ")
        asks, header = header.endswith("?"), header.rstrip("?")
        if found := re.fullmatch(r"SOUR([123])?:(VOLT|CURR)", header):
            now = self.channels[int(found[1] or self.selected)]
            what = "volts" if found[2] == "VOLT" else "amps"
            return self.asked(now, what) if asks else self.told(now, what, rest)
        if header in ("SYST:REMOTE", "SYST:ERR"):
            return '0,"No error"' if asks else None
        if header == "INST:NSEL":
            self.selected = int(rest)
            return None
        named = re.fullmatch(r"CH([123]),?(.*)", rest)
        now = self.channels[int(named[1]) if named else self.selected]
        word = named[2] if named else rest
        if header in ("OUTP:OVP:QUES", "OUTP:OCP:QUES"):
            return "NO"
        if header == "OUTP:OVP":
            self._ovp = self._ovp if asks else word == "ON"
            return self.truth[self._ovp] if asks else None
        if asks:
            return self.asked(now, self.MEANS[header])
        return self.told(now, self.MEANS[header], word)


class Spe6103(_Lines):
    """One channel, and trip levels that are called limits."""

    identity = "OWON,SPE6103,2224567,FV:V2.1.0"
    truth = ("OFF", "ON")
    MEANS: ClassVar = {
        "VOLT": "volts",
        "CURR": "amps",
        "OUTP": "on",
        "VOLT:LIM": "trip_volts",
        "CURR:LIM": "trip_amps",
        "MEAS:VOLT": "live",
        "MEAS:CURR": "drawn",
    }

    def carry_out(self, said: str) -> str | None:
        header, _, word = said.partition(" ")
        if header == "SYST:REM":
            return None
        if header.endswith("?"):
            return self.asked(self.channels[1], self.MEANS[header[:-1]])
        return self.told(self.channels[1], self.MEANS[header], word)


class Spd3303xE(_Lines):
    """A channel's name stands in front; outputs are told by bits, and nothing trips.

    Attributes:
        joined: 0 for apart, 1 for in series, 2 for in parallel.
    """

    identity = "Siglent Technologies,SPD3303X-E,SPD3XJGD6R1234,1.01.01.02.07R2,V3.0"
    count = 2
    number = "%.2f"
    MEANS: ClassVar = {"MEAS:VOLT": "live", "MEAS:CURR": "drawn"}
    joined = 0

    def carry_out(self, said: str) -> str | None:
        header, _, rest = said.partition(" ")
        if header == "SYST:STAT?":
            mode = (4, 12, 8)[self.joined]
            return f"0x{mode | self.channels[1].on << 4 | self.channels[2].on << 5:x}"
        if header == "SYST:ERR?":
            return "0  No Error"
        if found := re.fullmatch(r"(?:CH([12]):)?(VOLT|CURR)(\??)", header):
            now = self.channels[int(found[1] or self.selected)]
            what = "volts" if found[2] == "VOLT" else "amps"
            return self.asked(now, what) if found[3] else self.told(now, what, rest)
        if header == "INST":
            self.selected = int(rest.removeprefix("CH"))
            return None
        if header == "OUTP":
            channel, _, word = rest.partition(",")
            return self.told(self.channels[int(channel.removeprefix("CH"))], "on", word)
        now = self.channels[int(rest.removeprefix("CH") or self.selected)]
        return self.asked(now, self.MEANS[header.removesuffix("?")])


@contextmanager
def served(supply: Foreign) -> Iterator[str]:
    """Serve a stub until the block ends; yield `host:port`."""
    stop = threading.Event()
    with socket.create_server(("127.0.0.1", 0)) as listener:
        listener.settimeout(POLL_S)
        threads = [threading.Thread(target=_accept, args=(listener, supply, stop))]
        threads[0].start()
        try:
            yield f"127.0.0.1:{listener.getsockname()[1]}"
        finally:
            stop.set()
            threads[0].join()


def _accept(listener: socket.socket, supply: Foreign, stop: threading.Event) -> None:
    clients: list[threading.Thread] = []
    while not stop.is_set():
        try:
            link, _ = listener.accept()
        except TimeoutError:
            continue
        clients.append(threading.Thread(target=_converse, args=(link, supply, stop.is_set)))
        clients[-1].start()
    for client in clients:
        client.join()


def _converse(link: socket.socket, supply: Foreign, over: Callable[[], bool]) -> None:
    with link:
        link.settimeout(POLL_S)
        while not over():
            try:
                data = link.recv(CHUNK)
            except TimeoutError:
                continue
            except OSError:
                return
            if not data:
                return
            for answer in supply.receive(data):
                link.sendall(answer)
