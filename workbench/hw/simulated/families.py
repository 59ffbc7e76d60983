"""Which simulated device belongs to which family."""

from __future__ import annotations

from collections.abc import Callable

from workbench.hw.clock import Clock
from workbench.hw.models import Family, model_named
from workbench.hw.simulated.device import Load, SimulatedSupply, no_load
from workbench.hw.simulated.dps import SimulatedDps
from workbench.hw.simulated.hanmatek import SimulatedHanmatek
from workbench.hw.simulated.korad import SimulatedKorad
from workbench.hw.simulated.riden import SimulatedRiden
from workbench.hw.simulated.scpi import SimulatedScpi

__all__ = ["DEVICES", "simulated_supply"]

DEVICES: dict[Family, Callable[..., SimulatedSupply]] = {
    "riden": SimulatedRiden,
    "dps": SimulatedDps,
    "hanmatek": SimulatedHanmatek,
    "korad": SimulatedKorad,
    "scpi": SimulatedScpi,
}


def simulated_supply(
    model: str, *, clock: Clock, load: Load = no_load, serial: int | None = None, channel: int = 1
) -> SimulatedSupply:
    """Return a simulated supply of a model.

    Args:
        model: a name from the model table.
        clock: stamps its history.
        load: what hangs on the output.
        serial: serial number of a Riden, the only ones here that may differ.
        channel: the one that the load hangs on, where there are several.

    Raises:
        InputError: when there is no such model.
    """
    family = model_named(model).family
    options = {} if serial is None or family != "riden" else {"serial": serial}
    options |= {"channel": channel} if family == "scpi" else {}
    return DEVICES[family](model=model, clock=clock, load=load, **options)
