"""The supply that a client holds: the same contract, carried out by its guardian."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from decimal import Decimal
from typing import Any

from workbench.errors import HardwareError, SafetyStop, WorkbenchError
from workbench.hw.connection import Connection
from workbench.hw.guardian.lease import SILENT_S, UNSET_SILENT_S, LeaseClock
from workbench.hw.guardian.messages import NO_RECORDS, Records, Task
from workbench.hw.guardian.process import GuardianLost, GuardianProcess, GuardianTripped
from workbench.hw.supply import Identity, Limits, Reading, Setpoint, Supply

__all__ = ["GuardedSupply", "open_guarded"]

TAKE_OVER_S = 5.0  # for a dead guardian's lock on the port to be released


def open_guarded(
    connection: Connection,
    *,
    clock: LeaseClock,
    records: Records = NO_RECORDS,
    family: str = "riden",
) -> GuardedSupply:
    """Start a guardian and let it open the supply at a place; nothing is changed yet.

    Args:
        connection: where it is.
        clock: what the client waits with; waiting renews the lease.
        records: where the guardian writes.
        family: which driver to use.

    Raises:
        InputError: when there is no such family.
        HardwareError: when it cannot be reached, does not answer, or is of an unknown model.
    """
    return GuardedSupply(Task(connection, family, records), clock)


class GuardedSupply(Supply):
    """A supply behind a guardian.

    From `set_output(True)` to a confirmed `off` the lease runs: the thread that switched on has to
    ask for something, or to wait with `clock`, at least every half second. When the guardian
    switched off by itself, or is gone, the next sign of progress raises `SafetyStop`; a guardian
    that is gone has then been replaced by another one, which switched off.

    Args:
        task: what the guardian is started for.
        clock: see `open_guarded`.

    Raises:
        HardwareError: as `open_guarded`.
    """

    def __init__(self, task: Task, clock: LeaseClock) -> None:
        super().__init__(f"supply at {task.connection.address}", clock)
        self._task, self._lease = task, clock
        self._identity: list[str] | None = None
        self._owned = False
        self._gone: str | None = None  # how the guardian ended
        self._confirmed = False  # off, after it ended
        self._guardian = GuardianProcess(task)
        try:
            self.name = self._ask("open")
        except BaseException:
            self._guardian.kill()
            raise

    @property
    def guardian_pid(self) -> int:
        """Process id of the guardian."""
        return self._guardian.pid

    def identify(self) -> Identity:
        """Ask for model, serial and firmware. Raises as every call: see the class."""
        words: list[str] = self._ask("identify")
        self._identity = words
        return Identity(*words)

    def measure(self) -> Reading:
        """Read the whole state in one exchange.

        The time is the guardian's `time.monotonic()`, which is one for all processes of a host.
        """
        return Reading(**self._ask("measure"))

    def measure_power_on_output(self) -> bool | None:
        """Tell whether the output comes on with the power; None when it cannot be asked."""
        return self._ask("measure_power_on_output")

    def arm(self, limits: Limits) -> None:
        """Write the limits through the guardian, which holds to them whatever a client asks."""
        self._limits = None
        self._owned = True
        self._ask("arm", *(str(value) for value in vars(limits).values()))
        self._limits = limits
        self.setpoint = Setpoint(Decimal(0), self.clock.now())

    def ramp_down(self) -> None:
        """Lower a running output to 0 V in small steps."""
        self._owned = True
        self._ask("ramp_down")

    def off(self) -> bool:
        """Switch off, through another guardian when this one is gone; True when read back as off.

        Never raises; a Ctrl-C meanwhile costs one try.
        """
        self._owned = True
        for _ in range(2):
            with suppress(Exception, KeyboardInterrupt):
                if self._confirmed:
                    return True
                if self._gone is None and self._ask("off"):
                    self._lease.rest()
                    return True
                if self._gone is not None and self._off_through_another():
                    return True
        return self._confirmed

    def terminals_dead(self) -> bool:
        """Wait for the voltage at the terminals to decay after `off`; tell whether it did.

        A guardian that switched off by itself looks by itself, and ends with its verdict.
        """
        if self._gone is None:
            with suppress(WorkbenchError):
                return bool(self._ask("terminals_dead"))
        return self._confirmed and self._guardian.end() == 0

    def close(self) -> None:
        """End the guardian; one that still has the output on switches it off."""
        self._lease.rest()
        self._guardian.end()

    def _apply_voltage(self, volts: Decimal) -> Decimal:
        return Decimal(self._ask("set_voltage", str(volts)))

    def _apply_current_limit(self, amps: Decimal) -> Decimal:
        return Decimal(self._ask("set_current_limit", str(amps)))

    def _apply_protection(
        self, over_voltage: Decimal, over_current: Decimal
    ) -> tuple[Decimal, Decimal]:
        volts, amps = self._ask("set_protection", str(over_voltage), str(over_current))
        return Decimal(volts), Decimal(amps)

    def _apply_output(self, on: bool) -> None:
        self._owned = True
        if on:
            self._lease.hold(self._renew)
        self._ask("set_output", on)
        if not on:
            self._lease.rest()

    def _renew(self, seconds: float) -> None:
        try:
            self._guardian.renew(seconds)
        except (GuardianLost, GuardianTripped) as end:
            raise self._ended(end) from None

    def _ask(self, call: str, *arguments: str | bool) -> Any:
        if self._gone is not None:
            raise SafetyStop(self._told())
        try:
            silent = SILENT_S if self._owned else UNSET_SILENT_S
            return self._guardian.ask(call, *arguments, silent=silent)
        except (GuardianLost, GuardianTripped) as end:
            raise self._ended(end) from None

    def _ended(self, end: GuardianLost | GuardianTripped) -> WorkbenchError:
        """Do what remains to be done without this guardian, and return what to raise."""
        self._lease.rest()
        if isinstance(end, GuardianTripped):
            self._confirmed = end.confirmed
            self._gone = f"its guardian switched off: {end}"
        else:
            self._guardian.kill()
            self._gone = f"its guardian {end}"
            if not self._owned:
                return HardwareError(f"{self.name}: {self._gone}; nothing was set")
            self._off_through_another()
        return SafetyStop(self._told())

    def _told(self) -> str:
        state = "the output is off, confirmed" if self._confirmed else "OUTPUT MAY BE ON"
        return f"{self.name}: {self._gone}; {state}"

    def _off_through_another(self) -> bool:
        """Let a new guardian open the port, as soon as it is free, and switch off."""
        self._guardian.end()
        task = replace(self._task, patience_s=TAKE_OVER_S, after=self._gone or "")
        try:
            self._guardian = GuardianProcess(task)
            self._guardian.ask("open")
            off = self._guardian.ask("off") and self._guardian.ask("terminals_dead")
            same = self._identity in (None, self._guardian.ask("identify"))
            self._confirmed = off and same  # another supply's off confirms nothing
        except (WorkbenchError, GuardianLost, GuardianTripped):
            self._confirmed = False
        finally:
            self._guardian.end()
        return self._confirmed
