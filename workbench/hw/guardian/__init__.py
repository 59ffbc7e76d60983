"""The guardian: a process that owns the supply's port and switches off when its client dies.

What lives here: the process (`service.py`, started as `python -m workbench.hw.guardian`), its
hold on the supply and the clock of that (`held.py`, `waiting.py`), the supply that a client holds
in place of the real one (`client.py`, over `process.py`), the lease that ties the output to the
progress of the client (`lease.py`), what they say to each other (`messages.py`), and what the
guardian writes down (`records.py`); a trip latches the supply in its ledger (`workbench.output`).
What does not: drivers, and the order of operations around an output; both are those of `hw`.

    clock = LeaseClock()
    with open_guarded(connection, clock=clock, records=Records(events=path)) as supply:
        prepare(supply, limits, model="RD6006")
        switch_on(supply, Decimal("4.52"))   # from here on the lease runs
        clock.sleep(10)                      # renews it; a hang of half a second switches off

To add a call: one row in `service.CALLS`, one method of `GuardedSupply`, one test.
"""

from typing import TYPE_CHECKING

from workbench.hw.guardian.client import GuardedSupply, open_guarded
from workbench.hw.guardian.lease import LeaseClock
from workbench.hw.guardian.messages import KEEP_TRYING_S, NO_RECORDS, Records
from workbench.room_exports import exports

if not TYPE_CHECKING:  # a type checker reads the imports
    __getattr__, __dir__, __all__ = exports(__name__)
