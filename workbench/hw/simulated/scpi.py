"""A simulated supply that speaks SCPI as its maker's instruments do, without any wire."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

from workbench.hw.clock import Clock
from workbench.hw.models import Protection, ScpiModel
from workbench.hw.simulated.device import Load, Output, no_load
from workbench.hw.simulated.text import SimulatedText

__all__ = ["SimulatedScpi"]

MOST_BYTES = 500
NO_ERROR, UNDEFINED = '0,"No error"', '-113,"Undefined header"'


@dataclass(frozen=True)
class Maker:
    """How one maker's instruments talk.

    Args:
        identity: with `{}` for the model.
        over_voltage: header of the trip level.
        over_current: header of the trip level; empty where it trips at the current limit.
        switches: headers that arm something; the last one arms over-current protection.
        trips: headers that ask whether a protection tripped.
        number: writes a number.
        truth: writes no and yes.
        quiet: headers that need no answer and do nothing here.
        channel: stands in front of numbers and behind questions.
    """

    identity: str
    over_voltage: str
    over_current: str = ""
    switches: tuple[str, ...] = ()
    trips: dict[str, Protection] = field(default_factory=dict)
    number: Callable[[float], str] = "{:.3f}".format
    truth: tuple[str, str] = ("0", "1")
    quiet: tuple[str, ...] = ("SYST:REM", "INST:NSEL")
    channel: str = ""


KEYSIGHT = Maker(
    "Keysight Technologies,{},MY61000001,2.1.0-1.0.4",
    "VOLT:PROT",
    switches=("CURR:PROT:STAT",),
    trips={"VOLT:PROT:TRIP": "OVP", "CURR:PROT:TRIP": "OCP"},
    number="{:+.8E}".format,
)
WATCHED = replace(KEYSIGHT, switches=("OUTP:PROT:WDOG", "CURR:PROT:STAT"), trips={})
RIGOL = Maker(
    "RIGOL TECHNOLOGIES,{},DP8C123456789,00.01.16",
    "OUTP:OVP:VAL",
    "OUTP:OCP:VAL",
    switches=("OUTP:OVP", "OUTP:OCP"),
    trips={"OUTP:OVP:QUES": "OVP", "OUTP:OCP:QUES": "OCP"},
    truth=("OFF", "ON"),
    quiet=("SYST:REMOTE", "INST:NSEL"),
    channel="CH1",
)
ROHDE = Maker(
    "Rohde&Schwarz,{},100500,01.400",
    "VOLT:PROT:LEV",
    switches=("VOLT:PROT:STAT", "FUSE:STAT"),
    trips={"VOLT:PROT:TRIP": "OVP", "FUSE:TRIP": "OCP"},
)
OWON = Maker("OWON,{},2210001,FV:V3.7.0", "VOLT:LIM", "CURR:LIM", truth=("OFF", "ON"))

MAKERS = {
    "E363": KEYSIGHT,
    "N6951A": WATCHED,
    "DP7": replace(RIGOL, channel=""),
    "DP8": RIGOL,
    "HM": ROHDE,
    "P4": replace(OWON, quiet=()),
    "SPE": OWON,
    "DC310S": replace(OWON, identity="KIPRIM,{},2210001,FV:V3.7.0"),
}


class SimulatedScpi(SimulatedText):
    """One supply that speaks SCPI; see `SimulatedSupply`.

    Args:
        clock: stamps the history, and runs its watchdog where it has one.
        model: a name from the model table.
        load: what hangs on the output.
    """

    terminator = b"\n"

    def __init__(self, *, clock: Clock, model: str = "E36312A", load: Load = no_load) -> None:
        self._armed: dict[str, bool] = {}
        super().__init__(clock=clock, model=model, load=load)
        if not isinstance(self.model, ScpiModel):
            raise TypeError(f"{model} is no SCPI model")
        self._maker = next(m for start, m in MAKERS.items() if self.model.name.startswith(start))
        self._complaint = NO_ERROR
        self._watchdog_s, self._fed = 60.0, clock.now()

    def at_power_up(self) -> Output:
        """Return 0 V, 1 A, trip levels at the model's limits and nothing armed."""
        self._armed = {}
        volts, amps = float(self.model.voltage_max_V), float(self.model.current_max_A)
        return Output(over_voltage=volts * 1.1, over_current=amps * 1.1)

    def commands(self, waiting: bytes) -> tuple[list[str], bytes]:
        """Return the lines that are complete."""
        *lines, rest = waiting[-MOST_BYTES:].split(b"\n")
        told = [line.decode("ascii", "replace").strip() for line in lines]
        return [line for line in told if line], rest

    def obey(self, command: str) -> bytes | None:
        """Carry out a line."""
        self._watch()
        header, _, rest = command.removeprefix(":").partition(" ")
        words = [word for word in rest.split(",") if word and word != self._maker.channel]
        header = header.upper()
        if header.endswith("?"):
            answer = self._asked(header[:-1])
            return None if answer is None else answer.encode("ascii")
        if header not in self._maker.quiet and not self._told(header, words):
            self._complaint = UNDEFINED
        return None

    def update(self) -> None:
        """Let the output settle; armed over-current protection trips where CC would begin."""
        super().update()
        if self.output.mode == "CC" and not self._maker.over_current and self._fused():
            self.output = replace(self.output, on=False, protection="OCP")
            super().update()

    def _fused(self) -> bool:
        return self._armed.get(self._maker.switches[-1], False)

    def _asked(self, header: str) -> str | None:
        now, maker = self.shown, self._maker
        number = maker.number
        answers: dict[str, str] = {
            "*IDN": maker.identity.format(self.model.name),
            "VOLT": number(now.set_voltage),
            "CURR": number(now.current_limit),
            "MEAS:VOLT": number(now.voltage),
            "MEAS:CURR": number(now.current),
            "OUTP": maker.truth[now.on],
            maker.over_voltage: number(now.over_voltage),
            maker.over_current: number(now.over_current),
        }
        yes_no = ("NO", "YES") if maker.truth == ("OFF", "ON") else maker.truth
        answers |= {trip: yes_no[now.protection == what] for trip, what in maker.trips.items()}
        answers |= {name: maker.truth[self._armed.get(name, False)] for name in maker.switches}
        if header == "SYST:ERR":
            told, self._complaint = self._complaint, NO_ERROR
            return told
        if header not in answers:
            self._complaint = UNDEFINED
        return answers.get(header)

    def _told(self, header: str, words: list[str]) -> bool:
        maker, word = self._maker, words[0] if words else ""
        on = word in ("1", "ON")
        if header == "VOLT":
            self.change(set_voltage=min(float(word), float(self.model.voltage_max_V)))
        elif header == "CURR":
            self.change(current_limit=min(float(word), float(self.model.current_max_A)))
        elif header == maker.over_voltage:
            self.change(over_voltage=float(word))
        elif header == maker.over_current:
            self.change(over_current=float(word))
        elif header == "OUTP":
            self.switch(on)
        elif header == "OUTP:PROT:WDOG:DEL" and maker is WATCHED:
            self._watchdog_s = float(word)
        elif header in maker.switches:
            self._armed[header] = on
            self.update()
        else:
            return False
        return True

    def _watch(self) -> None:
        """Let the watchdog do what it did since the last command."""
        now, due = self._clock.now(), self._fed + self._watchdog_s
        self._fed = now
        if self._armed.get("OUTP:PROT:WDOG") and self.output.on and now > due:
            self.output = replace(self.output, on=False)
            super().update()
            self.history[-1] = (due, 0.0)
