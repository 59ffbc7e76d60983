"""A simulated supply that speaks SCPI as its maker's instruments do, without any wire.

One with several channels is what `SimulatedSupply` says in the one that its load hangs on; the
others lie beside it, and a command reaches whichever it names, or else the selected one.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Literal

from workbench.hw.clock import Clock
from workbench.hw.models import Protection, ScpiModel
from workbench.hw.simulated.device import Framing, Load, Output, SimulatedSupply, Wire, no_load
from workbench.hw.simulated.faults import SimulatedFault
from workbench.hw.simulated.text import SimulatedText

__all__ = ["SimulatedScpi"]

MOST_BYTES = 500
NO_ERROR, UNDEFINED, NO_CHANNEL = '0,"No error"', '-113,"Undefined header"', '-222,"Out of range"'
LIST = re.compile(r",?\s*\(@(\d)\)$")  # VOLT 5,(@1)
SOURCE = re.compile(r"SOUR(\d?):(.+)")  # SOUR1:VOLT 5
PREFIX = re.compile(r"CH(\d):(.+)")  # CH1:VOLT 5
PARAMETER = re.compile(r"CH(\d)")  # OUTP CH1,ON
INDEPENDENT = 0x04  # of SYST:STAT?, where there are two to join
CHANNELS = {
    "E363": 3, "DP8": 3, "HMC8042": 2, "HMC8043": 3, "HMP2020": 2, "HMP2030": 3, "HMP4040": 4,
    "SPD3303X": 3,
}  # fmt: skip


@dataclass(frozen=True)
class Maker:
    """How one maker's instruments talk.

    Args:
        identity: with `{}` for the model.
        over_voltage: header of the trip level; empty where there is none.
        over_current: header of the trip level; empty where it trips at the current limit.
        switches: headers that arm something; the last one arms over-current protection.
        trips: headers that ask whether a protection tripped.
        number: writes a number.
        truth: writes no and yes.
        quiet: headers that need no answer and do nothing here.
        names: how a command may name its channel; without, it is the selected one's.
        status: whether SYST:STAT? reports which outputs are on, and OUTP? nothing.
    """

    identity: str
    over_voltage: str
    over_current: str = ""
    switches: tuple[str, ...] = ()
    trips: dict[str, Protection] = field(default_factory=dict)
    number: Callable[[float], str] = "{:.3f}".format
    truth: tuple[str, str] = ("0", "1")
    quiet: tuple[str, ...] = ("SYST:REM",)
    names: Literal["", "list", "source", "prefix"] = ""
    status: bool = False


KEYSIGHT = Maker(
    "Keysight Technologies,{},MY61000001,2.1.0-1.0.4",
    "VOLT:PROT",
    switches=("CURR:PROT:STAT",),
    trips={"VOLT:PROT:TRIP": "OVP", "CURR:PROT:TRIP": "OCP"},
    number="{:+.8E}".format,
    names="list",
)
WATCHED = replace(KEYSIGHT, switches=("OUTP:PROT:WDOG", "CURR:PROT:STAT"), trips={}, names="")
RIGOL = Maker(
    "RIGOL TECHNOLOGIES,{},DP8C123456789,00.01.16",
    "OUTP:OVP:VAL",
    "OUTP:OCP:VAL",
    switches=("OUTP:OVP", "OUTP:OCP"),
    trips={"OUTP:OVP:QUES": "OVP", "OUTP:OCP:QUES": "OCP"},
    truth=("OFF", "ON"),
    quiet=("SYST:REMOTE",),
    names="source",
)
ROHDE = Maker(
    "Rohde&Schwarz,{},100500,01.400",
    "VOLT:PROT:LEV",
    switches=("VOLT:PROT:STAT", "FUSE:STAT"),
    trips={"VOLT:PROT:TRIP": "OVP", "FUSE:TRIP": "OCP"},
)
OWON = Maker("OWON,{},2210001,FV:V3.7.0", "VOLT:LIM", "CURR:LIM", truth=("OFF", "ON"))
SIGLENT = Maker(
    "Siglent Technologies,{},SPD3XJGX804123,1.01.01.02.07R2,V3.0",
    "",
    quiet=(),
    names="prefix",
    status=True,
)

MAKERS = {
    "E363": KEYSIGHT,
    "N6951A": WATCHED,
    "DP7": replace(RIGOL, names=""),
    "DP8": RIGOL,
    "HM": ROHDE,
    "P4": replace(OWON, quiet=()),
    "SPE": OWON,
    "DC310S": replace(OWON, identity="KIPRIM,{},2210001,FV:V3.7.0"),
    "SPD": SIGLENT,
}


class _Channel(SimulatedSupply):
    """One output with protections that can be armed; see `SimulatedSupply`."""

    fuse = ""  # what arms over-current protection that trips where CC would begin

    def __init__(self, *, clock: Clock, model: str, load: Load = no_load) -> None:
        self.armed: dict[str, bool] = {}
        super().__init__(clock=clock, model=model, load=load)

    def at_power_up(self) -> Output:
        """Return 0 V, 1 A, trip levels at the model's limits and nothing armed."""
        self.armed = {}
        volts, amps = float(self.model.voltage_max_V), float(self.model.current_max_A)
        return Output(over_voltage=volts * 1.1, over_current=amps * 1.1)

    def update(self) -> None:
        """Let the output settle; an armed fuse trips where CC would begin."""
        super().update()
        if self.output.mode == "CC" and self.armed.get(self.fuse):
            self.output = replace(self.output, on=False, protection="OCP")
            super().update()


class _Beside(_Channel):
    """A channel that nothing hangs on."""

    def wire(self, framing: Framing) -> Wire:
        """Be reached through the supply that it belongs to."""
        raise NotImplementedError


class SimulatedScpi(_Channel, SimulatedText):
    """One supply that speaks SCPI; see `SimulatedSupply`.

    Args:
        clock: stamps the history, and runs its watchdog where it has one.
        model: a name from the model table.
        load: what hangs on the output.
        channel: the one that it hangs on, and that `output` and `history` are of.

    Attributes:
        channels: all of them by number.
        selected: the one that a command without a channel means.
    """

    terminator = b"\n"

    def __init__(
        self, *, clock: Clock, model: str = "E36312A", load: Load = no_load, channel: int = 1
    ) -> None:
        self.selected = 1
        self.channels: dict[int, _Channel] = {}
        super().__init__(clock=clock, model=model, load=load)
        if not isinstance(self.model, ScpiModel):
            raise TypeError(f"{model} is no SCPI model")
        self._maker = next(m for start, m in MAKERS.items() if self.model.name.startswith(start))
        count = next((n for start, n in CHANNELS.items() if self.model.name.startswith(start)), 1)
        self.channels = {
            number: self if number == channel else _Beside(clock=clock, model=model)
            for number in range(1, count + 1)
        }
        if self._maker.switches and not self._maker.over_current:
            for one in self.channels.values():
                one.fuse = self._maker.switches[-1]
        self._complaint = NO_ERROR
        self._watchdog_s, self._fed = 60.0, clock.now()

    def select_next_channel(self) -> None:
        """Select the next channel at the front."""
        self.selected = self.selected % len(self.channels) + 1

    def at_power_up(self) -> Output:
        """Return what a channel shows; channel 1 is selected, the others are off as well."""
        self.selected = 1
        for one in self.channels.values():
            if one is not self:
                one.fail(SimulatedFault.POWER_CYCLE)
        return super().at_power_up()

    def commands(self, waiting: bytes) -> tuple[list[str], bytes]:
        """Return the lines that are complete."""
        *lines, rest = waiting[-MOST_BYTES:].split(b"\n")
        commands = [line.decode("ascii", "replace").strip() for line in lines]
        return [line for line in commands if line], rest

    def obey(self, command: str) -> bytes | None:
        """Carry out a line."""
        self._watch()
        header, _, rest = command.removeprefix(":").partition(" ")
        header, words, number = self._addressed(header.upper(), rest)
        channel = self.channels.get(number)
        if channel is None:
            self._complaint = NO_CHANNEL
            return None
        if header.endswith("?"):
            answer = self._asked(channel, header[:-1])
            return None if answer is None else answer.encode("ascii")
        if header not in self._maker.quiet and not self._apply_setting(channel, header, words):
            self._complaint = UNDEFINED
        return None

    def _addressed(self, header: str, rest: str) -> tuple[str, list[str], int]:
        """Return header and words without the channel that they name, and its number."""
        names, number = self._maker.names, self.selected
        if names == "list" and (found := LIST.search(rest)):
            number, rest = int(found[1]), rest[: found.start()]
        in_front = {"source": SOURCE, "prefix": PREFIX}.get(names)
        if in_front and (found := in_front.fullmatch(header)):
            number, header = int(found[1] or self.selected), found[2]
        words = [word for word in rest.split(",") if word]
        if names in ("source", "prefix") and words and (found := PARAMETER.fullmatch(words[0])):
            number, words = int(found[1]), words[1:]
        return header, words, number

    def _asked(self, channel: _Channel, header: str) -> str | None:
        now, maker = channel.reported, self._maker
        number = maker.number
        answers: dict[str, str] = {
            "*IDN": maker.identity.format(self.model.name),
            "VOLT": number(now.set_voltage),
            "CURR": number(now.current_limit),
            "MEAS:VOLT": number(now.voltage),
            "MEAS:CURR": number(now.current),
            maker.over_voltage: number(now.over_voltage),
            maker.over_current: number(now.over_current),
        }
        if len(self.channels) > 1 and maker.names != "prefix":
            answers["INST:NSEL"] = str(self.selected)
        if maker.status:
            answers["SYST:STAT"] = f"0x{self._status():04x}"
        else:
            answers["OUTP"] = maker.truth[now.on]
        yes_no = ("NO", "YES") if maker.truth == ("OFF", "ON") else maker.truth
        answers |= {trip: yes_no[now.protection == what] for trip, what in maker.trips.items()}
        answers |= {name: maker.truth[channel.armed.get(name, False)] for name in maker.switches}
        if header == "SYST:ERR":
            error, self._complaint = self._complaint, NO_ERROR
            return error
        if header not in answers:
            self._complaint = UNDEFINED
        return answers.get(header)

    def _status(self) -> int:
        word = INDEPENDENT if len(self.channels) > 1 else 0
        for number in (1, 2):  # the third is fixed and has no bits
            if channel := self.channels.get(number):
                now = channel.reported
                word |= (now.mode == "CC") << number - 1 | now.on << number + 3
        return word

    def _apply_setting(self, channel: _Channel, header: str, words: list[str]) -> bool:
        maker, word = self._maker, words[0] if words else ""
        on = word in ("1", "ON")
        if header == "INST:NSEL" and maker.names != "prefix":
            self.selected = int(word) if int(word) in self.channels else self.selected
        elif header == "VOLT":
            channel.change(set_voltage=self._at_most(float(word), channel, "V"))
        elif header == "CURR":
            channel.change(current_limit=self._at_most(float(word), channel, "A"))
        elif header == maker.over_voltage:
            channel.change(over_voltage=float(word))
        elif header == maker.over_current:
            channel.change(over_current=float(word))
        elif header == "OUTP":
            channel.switch(on)
        elif header == "OUTP:PROT:WDOG:DEL" and maker is WATCHED:
            self._watchdog_s = float(word)
        elif header in maker.switches:
            channel.armed[header] = on
            channel.update()
        else:
            return False
        return True

    def _at_most(self, value: float, channel: _Channel, unit: str) -> float:
        """Return a value as it is held: no more than channel 1 can; the others are left open."""
        if channel is not self.channels[1]:
            return value
        highest = self.model.voltage_max_V if unit == "V" else self.model.current_max_A
        return min(value, float(highest))

    def _watch(self) -> None:
        """Let the watchdog do what it did since the last command."""
        now, due = self._clock.now(), self._fed + self._watchdog_s
        self._fed = now
        if self.armed.get("OUTP:PROT:WDOG") and self.output.on and now > due:
            self.output = replace(self.output, on=False)
            super().update()
            self.history[-1] = (due, 0.0)
