"""Motor power supplies: the only room that sends bytes to a device.

What lives here: the supply contract, the model table, one driver a family, the Modbus link and the
text line with their guards, the rules by which an output may come on, and simulated supplies that
answer the same bytes; in `guardian/` the process that owns the port of a real bench. What does not:
protocols, the order of a run, files. Nothing here prints or writes a file but the guardian, which
outlives whoever could; clock and wire log are passed in.

    with open_supply(Connection("serial", "COM4"), clock=SystemClock(), wire_log=log) as supply:
        prepare(supply, limits, model="RD6006")
        switch_on(supply, Decimal("4.52"))
        ...                                     # the block's end switches off, whatever happens

To add a model: one row below `models/`. To add a family: one driver file below `ModbusSupply` or
`TextSupply`, one entry in `connect.DRIVERS`, one device in `simulated/`; the steps are in
`docs/how-to/new-supply.md`.
"""

from typing import TYPE_CHECKING

from workbench.hw.clock import Clock, SimulatedClock, SystemClock
from workbench.hw.connect import open_supply
from workbench.hw.connection import Connection, require_reachable
from workbench.hw.models import FAMILIES, MODELS, Model, model_named
from workbench.hw.models.model import Family, ModbusModel, Rating, ScpiModel
from workbench.hw.safety import Prepared, check_scale, prepare, stop, switch_on, watch
from workbench.hw.supply import DEAD_V, Identity, Limits, Reading, Supply
from workbench.hw.wirelog import WireLog
from workbench.hw.words import written
from workbench.room_exports import exports

if TYPE_CHECKING:
    from workbench.hw.guardian.client import open_guarded
    from workbench.hw.guardian.lease import LeaseClock
    from workbench.hw.guardian.messages import KEEP_TRYING_S, NO_RECORDS, Records
    from workbench.hw.ports import find_supply, who_answers
    from workbench.hw.simulated.control import delayed_fault, obey
    from workbench.hw.simulated.device import SimulatedSupply
    from workbench.hw.simulated.families import simulated_supply
    from workbench.hw.simulated.faults import SimulatedFault
    from workbench.hw.simulated.motor import draw_current
    from workbench.hw.simulated.serving import serve, serve_terminal

if not TYPE_CHECKING:  # a type checker reads the imports
    __getattr__, __dir__, __all__ = exports(__name__)
