"""Simulated supplies that answer the real bytes.

What lives here: devices that hold registers or understand words as the real ones do, with faults
to switch on, and the servers that put one on a loopback port or a pseudo terminal. What does not:
anything that a driver uses. To add a supply: one file with a class below `SimulatedRegisters` or
`SimulatedText`, and its entry in `families.DEVICES`.
"""

from typing import TYPE_CHECKING

from workbench.hw.simulated.device import Load, SimulatedSupply
from workbench.hw.simulated.dps import SimulatedDps
from workbench.hw.simulated.families import DEVICES, simulated_supply
from workbench.hw.simulated.faults import SimulatedFault
from workbench.hw.simulated.hanmatek import SimulatedHanmatek
from workbench.hw.simulated.korad import SimulatedKorad
from workbench.hw.simulated.motor import draw_current
from workbench.hw.simulated.riden import SimulatedRiden
from workbench.hw.simulated.scpi import SimulatedScpi
from workbench.hw.simulated.serving import serve, serve_terminal
from workbench.room_exports import exports

if not TYPE_CHECKING:  # a type checker reads the imports
    __getattr__, __dir__, __all__ = exports(__name__)
