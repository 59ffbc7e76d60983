"""The supply contract: what every motor power supply can do, and what none of them may do."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from decimal import Decimal
from typing import Literal, NamedTuple, Self

from workbench.errors import InputError, SafetyStop, WorkbenchError
from workbench.hw.clock import Clock
from workbench.hw.connection import Connection
from workbench.hw.models import Protection
from workbench.output import BY_HAND, MAY_BE_ON

__all__ = ["NOT_REPORTED", "Identity", "Limits", "Mode", "Reading", "Setpoint", "Supply"]

Mode = Literal["CV", "CC"]

OFF_TRIES = 4
OFF_PAUSE_S = 0.1
RAMP_STEP_V = Decimal("0.5")
RAMP_PAUSE_S = 0.1
DEAD_V, DECAY_S = 0.2, 5.0  # a coasting motor feeds its voltage back for a while
DECAY_POLL_S = 0.05
FALSE_OFF = "it says off, but its terminals are live"
ON_AGAIN = "it was read back as off, but its output is on"


NOT_REPORTED = "not reported"
"""Serial number or firmware of a supply that does not report it."""


class Identity(NamedTuple):
    """Who a supply says it is."""

    model: str
    serial: str
    firmware: str

    @property
    def known_serial(self) -> str | None:
        """The serial number; None where the supply reports none."""
        return None if self.serial == NOT_REPORTED else self.serial


@dataclass(frozen=True)
class Reading:
    """The state of a supply at one time.

    Args:
        time_s: host time when the answer was complete, by the injected monotonic clock.
        set_voltage_V: the voltage setpoint that the supply holds.
        voltage_V: measured output voltage.
        current_A: measured output current.
        output: whether the supply says that its output is on.
        mode: constant voltage, or constant current when the current limit acts.
        protection: which protection tripped.
        input_voltage_V: measured at the supply's own input; None where it does not report it.
        current_limit_A: the current limit that it holds; None where it is not among the rest.
    """

    time_s: float
    set_voltage_V: float
    voltage_V: float
    current_A: float
    output: bool
    mode: Mode
    protection: Protection
    input_voltage_V: float | None
    current_limit_A: float | None = None


class Setpoint(NamedTuple):
    """The voltage that a supply was set to last.

    Args:
        volts: as it holds it [V].
        time_s: when it was confirmed, by the supply's clock.
    """

    volts: Decimal
    time_s: float


@dataclass(frozen=True)
class Limits:
    """What a run may ask of its supply.

    Args:
        voltage_max_V: highest setpoint.
        current_max_A: highest current limit.
        over_voltage_V: where the supply itself trips; not below `voltage_max_V`.
        over_current_A: where the supply itself trips; not below `current_max_A`.

    Raises:
        InputError: when a limit is not positive, or a trip level lies below its setpoint,
            which would trip at once (instruments survey 1.2).
    """

    voltage_max_V: Decimal
    current_max_A: Decimal
    over_voltage_V: Decimal
    over_current_A: Decimal

    def __post_init__(self) -> None:
        """Refuse limits that cannot work."""
        for name, value in vars(self).items():
            if not (value.is_finite() and value > 0):
                raise InputError(f"limit {name} is {value}; it must be above 0")
        if self.over_voltage_V < self.voltage_max_V:
            raise InputError(
                f"over_voltage_V {self.over_voltage_V} V is below voltage_max_V "
                f"{self.voltage_max_V} V: the supply would trip at its own setpoint"
            )
        if self.over_current_A < self.current_max_A:
            raise InputError(
                f"over_current_A {self.over_current_A} A is below current_max_A "
                f"{self.current_max_A} A: the supply would trip at its own setpoint"
            )


class Supply(ABC):
    """A motor power supply that never leaves a `with` block with its output on.

    The public setters refuse whatever lies outside the limits before a byte leaves; the
    underscored methods, one set a driver, then carry it out and read it back. Until `arm` has
    written the limits nothing can be set and the output cannot be switched on.

    Args:
        name: model, serial and place; opens every message.
        clock: what time stamps and waits are made with.

    Attributes:
        setpoint: the voltage that was set last through this object.
        not_off: why the last `off` was not confirmed, if it was not.
        not_dead: why the terminals were not seen dead, if they were not.
        interrupted: whether a Ctrl-C came during the last `off`, which does not raise it.
    """

    def __init__(self, name: str, clock: Clock) -> None:
        self.name = name
        self.clock = clock
        self._limits: Limits | None = None
        self.setpoint: Setpoint | None = None
        self.not_off = "it did not confirm off"
        self.not_dead = FALSE_OFF
        self.interrupted = False

    @abstractmethod
    def identify(self) -> Identity:
        """Ask the supply who it is."""

    @abstractmethod
    def measure(self) -> Reading:
        """Read the whole state in one exchange."""

    @abstractmethod
    def measure_power_on_output(self) -> bool | None:
        """Return whether the output comes on with the power; None when it cannot be asked."""

    @property
    @abstractmethod
    def connected(self) -> bool:
        """Whether its link is open, as far as is known."""

    @abstractmethod
    def reach(self, connection: Connection) -> None:
        """Look for it at another place; where another supply answers, the link stays closed.

        Raises:
            HardwareError: when it is not there.
        """

    @abstractmethod
    def close(self) -> None:
        """Release the link; the output stays as it is."""

    @abstractmethod
    def _apply_voltage(self, volts: Decimal) -> Decimal: ...

    @abstractmethod
    def _apply_current_limit(self, amps: Decimal) -> Decimal: ...

    @abstractmethod
    def _apply_protection(
        self, over_voltage: Decimal, over_current: Decimal
    ) -> tuple[Decimal, Decimal]: ...

    @abstractmethod
    def _apply_output(self, on: bool) -> None: ...

    @property
    def limits(self) -> Limits:
        """The limits that were armed.

        Raises:
            SafetyStop: when none were.
        """
        if self._limits is None:
            raise SafetyStop(f"{self.name}: no limits are armed, so nothing may be set; prepare it")
        return self._limits

    def arm(self, limits: Limits) -> None:
        """Write trip levels, current limit and 0 V, each read back; from here on it can be set.

        Raises:
            InputError: when the model cannot do what a limit says; nothing was sent of it.
            HardwareError: when the supply does not hold what was written.
        """
        self._limits = limits
        try:
            self.set_protection(limits.over_voltage_V, limits.over_current_A)
            self.set_current_limit(limits.current_max_A)
            self.set_voltage(Decimal(0))
        except BaseException:
            self._limits = None
            raise

    def set_voltage(self, volts: Decimal) -> Decimal:
        """Set the voltage [V]; return what the supply really holds, half a step off at most.

        Raises:
            SafetyStop: when it lies outside the limits; nothing was sent.
            HardwareError: when the supply does not hold it.
        """
        self._refuse_outside("voltage", volts, self.limits.voltage_max_V, "V")
        applied = self._apply_voltage(volts)
        self.setpoint = Setpoint(applied, self.clock.now())
        return applied

    def set_current_limit(self, amps: Decimal) -> Decimal:
        """Set the current limit [A]; return what the supply really holds. Raises as above."""
        self._refuse_outside("current limit", amps, self.limits.current_max_A, "A")
        return self._apply_current_limit(amps)

    def set_protection(
        self, over_voltage: Decimal, over_current: Decimal
    ) -> tuple[Decimal, Decimal]:
        """Set the trip levels [V], [A]; return those that the supply holds. Raises as above."""
        self._refuse_outside("over-voltage", over_voltage, self.limits.over_voltage_V, "V")
        self._refuse_outside("over-current", over_current, self.limits.over_current_A, "A")
        return self._apply_protection(over_voltage, over_current)

    def set_output(self, on: bool) -> bool:
        """Switch the output; return the state read back.

        Switching on needs armed limits and is never retried; `off` is.

        Raises:
            SafetyStop: when it is to go on without armed limits.
            HardwareError: when the supply does not follow.
        """
        if on:
            _ = self.limits
        self._apply_output(on)
        return on

    def ramp_down(self) -> None:
        """Lower a running output to 0 V in small steps from what it measures; a jump would kick.

        Needs no limits, as it never raises the voltage.

        Raises:
            HardwareError: when the supply does not follow.
        """
        volts = Decimal(str(self.measure().voltage_V))
        while volts > 0:
            volts = max(volts - RAMP_STEP_V, Decimal(0))
            self._apply_voltage(volts)
            self.clock.sleep(RAMP_PAUSE_S)

    def try_off(self) -> None:
        """Send off once and read it back from the same supply; a lost link is opened again.

        Raises:
            HardwareError: when it is not read back; it may have been carried out.
        """
        self._apply_output(False)

    def off(self) -> bool:
        """Switch the output off, trying again where needed; True when read back as off.

        Never raises: it is called where something else has failed already. A Ctrl-C meanwhile
        costs one try; whoever does not end after that raises it: see `interrupted`.
        """
        first, self.interrupted = "", False
        for attempt in range(OFF_TRIES):
            try:
                if attempt:
                    self.clock.sleep(OFF_PAUSE_S)
                self.try_off()
                return True
            except (Exception, KeyboardInterrupt) as error:
                self.interrupted |= isinstance(error, KeyboardInterrupt)
                first = first or str(error)
        self.not_off = f"it did not confirm off: {first}"
        return False

    def terminals_dead(self) -> bool:
        """Wait for the voltage at the terminals to decay after `off`; return whether it did.

        The output's flag alone may lie; where it says on, nothing is waited for, as off has to be
        sent again. Never raises: where nothing can be measured it is not dead.
        """
        self.not_dead = FALSE_OFF
        deadline = self.clock.now() + DECAY_S
        try:
            while (reading := self.measure()).output or reading.voltage_V > DEAD_V:
                if reading.output:
                    self.not_dead = ON_AGAIN
                if reading.output or self.clock.now() >= deadline:
                    return False
                self.clock.sleep(DECAY_POLL_S)
        except WorkbenchError as error:
            self.not_dead = f"it says off, but its terminals could not be measured: {error}"
            return False
        return True

    def __enter__(self) -> Self:
        """Return the supply; the block's end switches it off."""
        return self

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        """Switch off and close, whatever happened.

        Raises:
            SafetyStop: when off could not be confirmed.
        """
        why = self.not_off
        try:
            off = self.off()
            dead = off and self.terminals_dead()
            why = "" if dead else self.not_dead if off else self.not_off
        finally:
            self.close()
        if why and MAY_BE_ON not in str(error):  # else it was said with its cause
            first = f"{error}; " if isinstance(error, WorkbenchError) else f"{self.name}: "
            raise SafetyStop(f"{first}{why}; {MAY_BE_ON}, {BY_HAND}") from error

    def _refuse_outside(self, what: str, value: Decimal, highest: Decimal, unit: str) -> None:
        if not (value.is_finite() and 0 <= value <= highest):
            raise SafetyStop(
                f"{self.name}: {what} {value} {unit} is outside 0 to {highest} {unit}, "
                "the limits of this run; nothing was sent"
            )
