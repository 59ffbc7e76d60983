"""Simulated supplies that answer the real bytes.

What lives here: devices that hold registers as the real ones do, with faults to switch on, and
the server that puts one on a loopback port. What does not: anything that a driver uses. To add a
supply: one file with a class that reads and writes words, as `SimulatedRiden` does.
"""

from workbench.hw.simulated.faults import Fault
from workbench.hw.simulated.riden import Load, SimulatedRiden
from workbench.hw.simulated.serving import serve

__all__ = ["Fault", "Load", "SimulatedRiden", "serve"]
