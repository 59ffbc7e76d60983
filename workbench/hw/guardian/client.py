"""The supply that a client holds: the same contract, carried out by its guardian."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from decimal import Decimal
from typing import Any

from workbench.errors import HardwareError, SafetyStop, WorkbenchError
from workbench.hw.connection import Connection
from workbench.hw.guardian.lease import ACKNOWLEDGE_S, UNSET_ACKNOWLEDGE_S, LeaseClock
from workbench.hw.guardian.messages import KEEP_TRYING_S, NO_RECORDS, Records, SupplyBusyError, Task
from workbench.hw.guardian.process import GuardianLost, GuardianProcess, GuardianTripped
from workbench.hw.supply import DECAY_S, Identity, Limits, Reading, Setpoint, Supply
from workbench.output import BY_HAND, MAY_BE_ON

__all__ = ["GuardedSupply", "open_guarded"]

AT_ONCE_S = 1.0  # for a guardian that tripped to switch off, before it is said
VERDICT_S = 1.0  # more for it, once, when the client ends
TAKE_OVER_S = 6.0  # for another guardian to get the port and switch off
TERMINALS_S = DECAY_S + 3.0
SPARES = 2  # guardians that take the place of one that dies while it tries


def open_guarded(
    connection: Connection,
    *,
    clock: LeaseClock,
    records: Records = NO_RECORDS,
    family: str = "riden",
    keep_trying_s: float = KEEP_TRYING_S,
    force: bool = False,
) -> GuardedSupply:
    """Start a guardian and let it open the supply at a place; nothing is changed yet.

    Args:
        connection: where it is.
        clock: what the client waits with; waiting renews the lease.
        records: where the guardian writes.
        family: which driver to use.
        keep_trying_s: how long it tries to switch off a supply that does not confirm it [s].
        force: switch off even what another program drives.

    Raises:
        InputError: when there is no such family.
        HardwareError: when it cannot be reached, does not answer, or is of an unknown model.
    """
    task = Task(connection, family, records, keep_trying_s=keep_trying_s, force=force)
    return GuardedSupply(task, clock)


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
        self._owned = False
        self._gone: str | None = None  # how the guardian ended
        self._patience_s = VERDICT_S
        self._spares = SPARES
        self._guardian = GuardianProcess(task)
        try:
            self.name, *identity = self._ask("open")
            self._task = replace(task, identity=tuple(identity))
        except BaseException:
            self._guardian.kill()
            raise

    @property
    def guardian_pid(self) -> int:
        """Process id of the guardian."""
        return self._guardian.pid

    def identify(self) -> Identity:
        """Ask for model, serial and firmware. Raises as every call: see the class."""
        return Identity(*self._ask("identify"))

    def measure(self) -> Reading:
        """Read the whole state in one exchange.

        The time is the guardian's `time.monotonic()`, which is one for all processes of a host.
        """
        return Reading(**self._ask("measure"))

    def measure_power_on_output(self) -> bool | None:
        """Return whether the output comes on with the power; None when it cannot be asked."""
        return self._ask("measure_power_on_output")

    def arm(self, limits: Limits) -> None:
        """Write the limits through the guardian, which holds to them whatever a client asks."""
        self._limits = None
        self._ask_as_owner("arm", *(str(value) for value in vars(limits).values()))
        self._limits = limits
        self.setpoint = Setpoint(Decimal(0), self.clock.now())

    def ramp_down(self) -> None:
        """Lower a running output to 0 V in small steps."""
        self._ask_as_owner("ramp_down")

    def off(self) -> bool:
        """Switch off; True when read back as off. A guardian that could not goes on trying.

        A Ctrl-C meanwhile costs one try: see `interrupted`.

        Raises:
            SupplyBusyError: when another program drives it; nothing was set.
        """
        self.interrupted = False
        for _ in range(2):
            try:
                if self._gone is not None:
                    seconds, self._patience_s = self._patience_s, 0.0
                    self.not_off = self._gone
                    return self._verdict(seconds)
                if self._ask_as_owner("off"):
                    self._lease.rest()
                    return True
            except SupplyBusyError:  # its output is somebody else's
                raise
            except (Exception, KeyboardInterrupt) as error:
                self.interrupted |= isinstance(error, KeyboardInterrupt)
        self.not_off = self._gone or self.not_off
        return self._gone is not None and self._guardian.off

    def try_off(self) -> None:
        """Switch off, or raise; the guardian tries as often as it has to."""
        if not self.off():
            raise SafetyStop(self._state_text())

    def terminals_dead(self) -> bool:
        """Wait for the voltage at the terminals to decay after `off`; return whether it did.

        A guardian that switched off by itself looks by itself.
        """
        if self._gone is None:
            dead: bool | None = None
            with suppress(WorkbenchError):
                dead = bool(self._ask("terminals_dead"))
                if not dead:
                    self._ask("measure")  # it steps in, and says why
            self.not_dead = self._gone or self.not_dead
            if dead is not None or self._gone is None:
                return bool(dead)
        return self._verdict(TERMINALS_S if self._guardian.off else 0.0, dead=True)

    @property
    def connected(self) -> bool:
        """Whether its guardian is there."""
        return self._gone is None

    def reach(self, connection: Connection) -> None:
        """Leave that to the guardian."""
        raise NotImplementedError("a guardian looks for its supply by itself")

    def close(self) -> None:
        """End the guardian; one that still has the output on switches it off."""
        self._lease.rest()
        self._guardian.end(owned=self._owned)

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        """Switch off and close; a safety stop latches. Raises as `Supply.__exit__`.

        A supply that was only looked at, or that another program drives, stays as it is.
        """
        if not self._owned:
            self.close()
            return
        if isinstance(error, SafetyStop) and self._gone is None:
            with suppress(WorkbenchError):
                self._ask("latch", str(error))
        super().__exit__(kind, error, trace)

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
        if on:
            self._lease.hold(self._renew)
        self._ask_as_owner("set_output", on)
        if not on:
            self._lease.rest()

    def _renew(self, seconds: float) -> None:
        try:
            self._guardian.renew(seconds)
        except (GuardianLost, GuardianTripped) as end:
            raise self._ended(end) from None

    def _ask_as_owner(self, call: str, *arguments: str | bool) -> Any:
        """Ask for more than to look. Raises as `_ask`."""
        before, self._owned = self._owned, True
        try:
            return self._ask(call, *arguments)
        except SupplyBusyError:
            self._owned = before
            raise

    def _ask(self, call: str, *arguments: str | bool) -> Any:
        if self._gone is not None:
            raise SafetyStop(self._state_text())
        try:
            timeout_s = ACKNOWLEDGE_S if self._owned else UNSET_ACKNOWLEDGE_S
            return self._guardian.ask(call, *arguments, timeout_s=timeout_s)
        except (GuardianLost, GuardianTripped) as end:
            raise self._ended(end) from None

    def _ended(self, end: GuardianLost | GuardianTripped) -> WorkbenchError:
        """Do what remains to be done without this guardian, and return what to raise."""
        self._lease.rest()
        if isinstance(end, GuardianTripped):
            self._gone = f"its guardian stepped in: {end}"
            self._verdict(AT_ONCE_S)
        else:
            self._guardian.kill()
            self._gone = f"its guardian {end}"
            if not self._owned:
                return HardwareError(f"{self.name}: {self._gone}; nothing was set")
            self._off_through_another()
        return SafetyStop(self._state_text())

    def _state_text(self) -> str:
        if self._guardian.off and self._guardian.dead is not False:
            return f"{self.name}: {self._gone}; the output is off, confirmed"
        trying = "; nobody tries to switch it off any more"
        if self._guardian.trying:
            trying = f"; its guardian tries on for {self._task.keep_trying_s:g} s"
        return f"{self.name}: {self._gone}; {MAY_BE_ON}, {BY_HAND}{trying}"

    def _verdict(self, seconds: float, *, dead: bool = False) -> bool:
        """Wait for what a guardian that tripped says; one that died meanwhile is replaced."""
        confirmed = self._guardian.verdict(seconds, dead=dead)
        if not self._guardian.died or not self._spares:
            return confirmed
        self._spares -= 1
        self._guardian.kill()
        self._off_through_another()
        return self._guardian.verdict(0.0, dead=dead)

    def _off_through_another(self) -> None:
        """Let a new guardian open the port, as soon as it is free, and switch off."""
        try:
            self._guardian = GuardianProcess(replace(self._task, after=self._gone or ""))
        except HardwareError as error:
            self._gone = f"{self._gone}; another could not be started ({error})"
            return
        with suppress(GuardianTripped, GuardianLost):
            self._guardian.await_trip(TAKE_OVER_S)
        self._guardian.verdict(TAKE_OVER_S)
