"""The supply that a guardian holds: opened, known, held against other programs, found again."""

from __future__ import annotations

from contextlib import ExitStack, suppress

from workbench.errors import HardwareError, SafetyStop
from workbench.hw.clock import Clock
from workbench.hw.connect import open_supply
from workbench.hw.guardian.messages import SupplyBusyError, Task
from workbench.hw.guardian.records import EventRecorder
from workbench.hw.health import Health
from workbench.hw.ports import Adapter
from workbench.hw.supply import Identity, Supply
from workbench.output import Ledger

__all__ = ["Held"]

TAKE_OVER_S = 5.0  # for a dead guardian's hold on the supply to be released


class Held:
    """One supply, from its opening to its close.

    Args:
        task: what its guardian was started for.
        recorder: of the guardian; receives whose ledger it writes.
        clock: what the supply waits with.

    Attributes:
        health: how the exchanges with it go.
        owned: somebody asked for more than to look.
    """

    def __init__(self, task: Task, recorder: EventRecorder, clock: Clock) -> None:
        self._task, self._recorder, self._clock = task, recorder, clock
        self._adapter = Adapter.at(task.connection)
        self._lock = ExitStack()
        self._supply: Supply | None = None
        self._identity: Identity | None = None
        self.health = Health()
        self.owned = False
        self._know(Identity(*task.identity) if task.identity else None)

    def open(self) -> list[str]:
        """Open the supply, return its name and identity; its output stays as it is."""
        self._supply = open_supply(
            self._task.connection,
            clock=self._clock,
            wire_log=self._recorder.wire,
            family=self._task.family,
            health=self.health,
        )
        identity = self._supply.identify()
        self._know(identity)
        return [self._supply.name, *identity]

    def close(self) -> None:
        """Close the link and let the supply go."""
        if self._supply is not None:
            self._supply.close()
        self._lock.close()

    @property
    def name(self) -> str:
        """Model and place, as far as they are known."""
        if self._supply is not None:
            return self._supply.name
        model = self._identity.model if self._identity else "supply"
        return f"{model} at {self._task.connection.address}"

    @property
    def supply(self) -> Supply:
        """The open supply."""
        if self._supply is None:
            raise SafetyStop("the guardian was asked for something before it opened the supply")
        return self._supply

    @property
    def owned_supply(self) -> Supply:
        """The open supply, which is not left from here on without its output off.

        Raises:
            SupplyBusyError: when another program drives it, or it cannot be held against one.
        """
        supply = self.supply
        if not self.owned and not self._take(0.0) and not self._task.force:
            raise SupplyBusyError(
                f"{supply.name}: another program is driving it; nothing was set. Wait for its "
                "end, or stop it with `workbench supply off`"
            )
        self.owned = True
        return supply

    def take_over(self) -> None:
        """Hold it after another guardian; whoever holds it, off is never refused."""
        self._take(TAKE_OVER_S)
        self.owned = True

    def try_off(self) -> str:
        """Switch off once, wherever the supply is now; return what went wrong, or nothing."""
        try:
            if self._supply is None:
                self.open()
                if self._task.identity and self._identity != Identity(*self._task.identity):
                    self._forget()
                    return f"another supply answers at {self._task.connection.address}"
            self.supply.try_off()
        except Exception as error:
            self._find_again()
            return str(error)
        return ""

    def _know(self, identity: Identity | None) -> None:
        """Note who the supply is; its ledger hangs on that."""
        self._identity = identity
        address = self._recorder.address = self._task.connection.resolved_address
        if identity is not None:
            key = Ledger.key_of(identity.model, identity.known_serial, address)
            self._recorder.ledger = Ledger(key)

    def _take(self, seconds: float) -> bool:
        """Hold the supply against other programs; return whether it is held."""
        ledger = self._recorder.ledger
        if ledger is not None:
            try:
                if not self._lock.enter_context(ledger.hold(seconds)):
                    return False
                ledger.asked_for_off()  # what was asked of the holder before is not for this one
            except OSError as error:
                if not (self._task.force or self._task.after):  # off needs no lock
                    raise SupplyBusyError(
                        f"{self.name}: not taken, as {ledger.path.parent} cannot be written "
                        f"({error.strerror}); nothing was set. Set WORKBENCH_STATE to a folder "
                        "that can"
                    ) from error
        self._recorder.event("taken")
        return True

    def _forget(self) -> None:
        """Leave a supply that is another one."""
        if self._supply is not None:
            self._supply.close()
        self._supply = None
        self._know(Identity(*self._task.identity))

    def _find_again(self) -> None:
        """Look at other ports for a supply whose cable came back under another name."""
        supply = self._supply
        if supply is None or supply.connected:
            return
        for connection in self._adapter.elsewhere(self._task.connection):
            with suppress(HardwareError):
                supply.reach(connection)
                self._recorder.event("found", address=connection.address)
                return
