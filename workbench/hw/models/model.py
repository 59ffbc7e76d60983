"""What a row of the model table holds, and the rule by which a value becomes a register word.

The rounding rule lives here because it is the other half of a scale: a value enters a register as
the nearest whole number of steps, a tie goes to the even one. Nothing truncates.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from decimal import ROUND_HALF_EVEN, Decimal
from typing import Any, Literal, NamedTuple, get_args

from workbench.errors import InputError

__all__ = [
    "Block",
    "Dialect",
    "Family",
    "KoradModel",
    "ModbusModel",
    "Model",
    "Protection",
    "Rating",
    "Registers",
    "ScpiModel",
    "TextModel",
    "from_word",
    "rounded",
    "to_word",
]

Family = Literal["riden", "dps", "hanmatek", "korad", "scpi"]
Protection = Literal["none", "OVP", "OCP", "OPP", "OTP", "SCP"]

PROTECTIONS: tuple[Protection, ...] = get_args(Protection)
STAYS_ON = "none: the output stays as it is"


@dataclass(frozen=True, kw_only=True)
class Model:
    """One model: what it calls itself, how it counts, what it may do.

    Args:
        name: as printed on the front, and as the bench file names it.
        family: which driver speaks to it.
        voltage_max_V: highest voltage that it can be set to.
        current_max_A: highest current that it can be set to.
        voltage_step_V: one count of a voltage.
        current_steps_A: one count of a current, by current range.
        baud: serial speed that it leaves the factory with, 8N1.
        on_lost_link: what the supply itself does when the link dies.
        quirks: what bites, in a sentence each.
        also: other names that the same device is sold under.
        source: where these facts come from.
    """

    name: str
    family: Family
    voltage_max_V: Decimal
    current_max_A: Decimal
    voltage_step_V: Decimal
    current_steps_A: tuple[Decimal, ...]
    baud: int = 9600
    on_lost_link: str = STAYS_ON
    quirks: tuple[str, ...] = ()
    also: tuple[str, ...] = ()
    source: str

    @property
    def identity(self) -> str:
        """What it answers when asked who it is, for people."""
        raise NotImplementedError


@dataclass(frozen=True)
class Block:
    """Registers that are read in one exchange.

    Args:
        start: address of the first.
        count: how many are needed.
        spare: how many more may be read along, so that successive answers differ in length and
            a late or repeated one cannot pass for the one asked for.
    """

    start: int
    count: int
    spare: int = 0


@dataclass(frozen=True, kw_only=True)
class Registers:
    """Where a Modbus family keeps its things: addresses of holding registers.

    Args:
        identity: read first, and again to see that it is still the same supply.
        status: all blocks of one reading, in the order in which they are read.
        voltage_set: setpoint, V.
        current_set: current limit, A.
        voltage: measured, V.
        current: measured, A.
        output: the output's switch.
        protection: which protection tripped.
        mode: 0 for CV, 1 for CC; None where it cannot be read reliably.
        input_voltage: measured at its own input, always in 10 mV; None where there is none.
        current_range: index into `current_steps_A`; None with one range.
        trips: block with both trip levels.
        over_voltage: trip level, V.
        over_current: trip level, A.
        power_on: block with the output's state at power-up.
        power_on_output: 0 when the output stays off at power-up.
    """

    identity: Block
    status: tuple[Block, ...]
    voltage_set: int
    current_set: int
    voltage: int
    current: int
    output: int
    protection: int
    mode: int | None
    input_voltage: int | None
    current_range: int | None
    trips: Block
    over_voltage: int
    over_current: int
    power_on: Block
    power_on_output: int

    @property
    def marks(self) -> tuple[tuple[int, int], ...]:
        """Start and length of two blocks that no other read has the length of."""
        blocks = self.identity, self.power_on
        return tuple((block.start, block.count) for block in blocks)

    @property
    def writable(self) -> frozenset[int]:
        """The only registers that are ever written: calibration and boot loader are not among."""
        return frozenset(
            {self.voltage_set, self.current_set, self.output, self.over_voltage, self.over_current}
        )


@dataclass(frozen=True, kw_only=True)
class ModbusModel(Model):
    """A model that is known by a number in a register.

    Args:
        ids: values of its model register, each named by a manual or a maintained client.
        registers: where it keeps its things.
    """

    ids: tuple[int, ...]
    registers: Registers = field(repr=False)

    @property
    def identity(self) -> str:
        """The ids."""
        return ", ".join(map(str, self.ids))


@dataclass(frozen=True, kw_only=True)
class TextModel(Model):
    """A model that is known by its answer to `*IDN?`.

    Args:
        pattern: of the whole answer; its groups `serial` and `firmware` are optional.
    """

    pattern: str

    @property
    def identity(self) -> str:
        """The pattern."""
        return self.pattern


@dataclass(frozen=True, kw_only=True)
class KoradModel(TextModel):
    """A model that speaks Korad's text.

    Args:
        gap_s: least time between two commands; one that comes earlier is dropped silently.
        over_current_bit: of STATUS?, set while over-current protection is armed; None where
            sources disagree, as then nothing is concluded from it.
        over_voltage_bit: the same for over-voltage protection.
    """

    gap_s: float = 0.05
    over_current_bit: int | None = None
    over_voltage_bit: int | None = None


@dataclass(frozen=True, kw_only=True)
class Dialect:
    """What a maker's SCPI says; `{}` is replaced by the number, `{channel}` by the channel's.

    Args:
        start: sent once after opening.
        on: switches the output on.
        off: switches it off.
        select: selects the channel; goes out before every command, in one message with it. Empty
            where the commands themselves name their channel, or where there is one only.
        voltage: sets it.
        voltage_ask: asks for the setpoint.
        current: sets the current limit.
        current_ask: asks for it.
        measured_voltage: asks for it.
        measured_current: asks for it.
        output_ask: asks whether the output is on.
        output_bits: bits of its hexadecimal answer that say so, by channel; empty where it answers
            with 0 or 1.
        apart: which bits of that answer have to be what: the outputs are then neither in series nor
            in parallel.
        over_voltage: sets the trip level; empty where there is none.
        over_voltage_ask: asks for it.
        over_current: sets the trip level; empty where it trips at the current limit.
        over_current_ask: asks for it.
        enable: arms protections: what is sent, and what must then answer 1.
        tripped: what to ask whether a protection tripped; all answer 1 or YES when it did.
        complaint: asks for the oldest error.
    """

    start: tuple[str, ...]
    on: tuple[str, ...]
    off: tuple[str, ...]
    select: str = ""
    voltage: str = "VOLT {}"
    voltage_ask: str = "VOLT?"
    current: str = "CURR {}"
    current_ask: str = "CURR?"
    measured_voltage: str = "MEAS:VOLT?"
    measured_current: str = "MEAS:CURR?"
    output_ask: str = "OUTP?"
    output_bits: tuple[int, ...] = ()
    apart: tuple[int, int] = (0, 0)
    over_voltage: str = ""
    over_voltage_ask: str = ""
    over_current: str = ""
    over_current_ask: str = ""
    enable: tuple[tuple[str, str], ...] = ()
    tripped: tuple[tuple[Protection, str], ...] = ()
    complaint: str = "SYST:ERR?"

    def on_channel(self, channel: int) -> Dialect:
        """Return what is said to one channel."""
        return replace(self, **{name: _filled(part, channel) for name, part in vars(self).items()})

    @property
    def commands(self) -> frozenset[str]:
        """All that may ever be sent, with `{}` for a number: nothing that calibrates or recalls."""
        return frozenset({"*IDN?", *_said(tuple(vars(self).values()))} - {"", *PROTECTIONS})


def _filled(part: Any, channel: int) -> Any:
    if isinstance(part, tuple):
        return tuple(_filled(one, channel) for one in part)
    return part.replace("{channel}", str(channel)) if isinstance(part, str) else part


def _said(part: object) -> list[str]:
    if isinstance(part, tuple):
        return [text for one in part for text in _said(one)]
    return [part] if isinstance(part, str) else []


class Rating(NamedTuple):
    """What a channel can be set to.

    Args:
        voltage_max_V: highest voltage.
        current_max_A: highest current.
    """

    voltage_max_V: Decimal
    current_max_A: Decimal


@dataclass(frozen=True, kw_only=True)
class ScpiModel(TextModel):
    """A model that speaks SCPI; the limits above are those of its channel 1.

    Args:
        dialect: what its maker says.
        more: what channels 2 and up can be set to.
        gap_s: least time between two commands.
    """

    dialect: Dialect = field(repr=False)
    more: tuple[Rating, ...] = ()
    gap_s: float = 0.02

    @property
    def ratings(self) -> tuple[Rating, ...]:
        """What each channel can be set to, from channel 1 on."""
        return Rating(self.voltage_max_V, self.current_max_A), *self.more

    @property
    def channels(self) -> int:
        """How many there are that can be driven."""
        return len(self.ratings)

    def on_channel(self, channel: int) -> ScpiModel:
        """Return the model as its channel is: with the limits and the commands of that one.

        Raises:
            InputError: when there is no such channel.
        """
        if not 1 <= channel <= self.channels:
            raise InputError(
                f"{self.name} has no channel {channel} that can be driven; "
                + ("its only one is 1" if self.channels == 1 else f"there are 1 to {self.channels}")
            )
        volts, amps = self.ratings[channel - 1]
        dialect = self.dialect.on_channel(channel)
        if self.channels == 1:
            dialect = replace(dialect, select="")
        return replace(self, voltage_max_V=volts, current_max_A=amps, dialect=dialect)


def to_word(value: Decimal, step: Decimal) -> int:
    """Return the register word nearest to a value, ties to even; exact in decimals."""
    return int((value / step).to_integral_value(ROUND_HALF_EVEN))


def from_word(word: int, step: Decimal) -> Decimal:
    """Return the value of a register word, exactly."""
    return word * step


def rounded(value: Decimal, step: Decimal) -> Decimal:
    """Return the value that a supply of such steps is sent, for one that takes text."""
    return from_word(to_word(value, step), step)
