"""A simulated Korad KA3005P or clone: its text, without any wire."""

from __future__ import annotations

import re
from dataclasses import replace

from workbench.hw.clock import Clock, SystemClock
from workbench.hw.models import KoradModel
from workbench.hw.simulated.device import Load, Output, no_load
from workbench.hw.simulated.text import SimulatedText

__all__ = ["SimulatedKorad"]

DEAF_S = 0.03  # a command that comes sooner after the last one is dropped without a word
BEEP, OCP_BIT, OUTPUT_BIT, OVP_BIT = 0x10, 0x20, 0x40, 0x80
COMMAND = re.compile(
    rb"\*IDN\?|STATUS\?|[VI](?:SET|OUT)1\?|[VI]SET1:[0-9.]+|(?:OUT|OVP|OCP|BEEP)[01]"
)
ANSWERS = {
    "KA3005P": "KORADKA3005PV2.0",
    "KD3005P": "KORAD KD3005P V2.0",
    "KD6005P": "KORAD KD6005P V2.2",
    "72-2535": "TENMA 72-2535 V2.1",
    "72-2540": "TENMA 72-2540 V2.1",
    "72-2550": "TENMA72-2550V2.0",
    "72-2705": "TENMA 72-2705 V2.0",
    "72-2710": "TENMA 72-2710 V2.0",
    "RND 320-KA3005P": "RND 320-KA3005P V5.5",
    "RND 320-KD3005P": "RND 320-KD3005P V4.2 SN:59834414",
    "PS3005D": "VELLEMANPS3005DV2.0",
    "LABPS3005D": "VELLEMANLABPS3005DV2.0",
    "S-LS-31": "S-LS-31 V2.0",
}
BOTH_ON_BIT_7 = ("72-2540",)


class SimulatedKorad(SimulatedText):
    """A Korad, Tenma, RND, Velleman or Stamos; see `SimulatedSupply`.

    Its protections have no level: over-current protection, once armed, trips where the current
    limit would act.

    Args:
        clock: stamps the history, and shows when a command comes too soon.
        model: a name from the model table.
        load: what hangs on the output.
        padding: what follows its identity, as on some units.
        stray: what follows the answer to ISET1?, as with some firmware.
        deaf_s: for how long after a command it ignores others [s]; by default as the real ones on a
            clock that runs by itself, and not at all on a simulated one, which is stopped while
            bytes travel.
    """

    def __init__(
        self,
        *,
        clock: Clock,
        model: str = "KA3005P",
        load: Load = no_load,
        padding: bytes = b"",
        stray: bytes = b"",
        deaf_s: float | None = None,
    ) -> None:
        super().__init__(clock=clock, model=model, load=load)
        if not isinstance(self.model, KoradModel):
            raise TypeError(f"{model} is no Korad model")
        self._identity = ANSWERS[self.model.name].encode() + padding
        self._stray = stray
        self._armed = {"OVP": False, "OCP": False, "BEEP": True}
        by_default = DEAF_S if isinstance(clock, SystemClock) else 0.0
        self._deaf_s = by_default if deaf_s is None else deaf_s
        self._last = -1.0

    def at_power_up(self) -> Output:
        """Return 0 V and 1 A with the output off."""
        return Output()

    def commands(self, waiting: bytes) -> tuple[list[str], bytes]:
        """Return the commands that were received; one too soon after the last is not."""
        received: list[str] = []
        for found in COMMAND.finditer(waiting):
            now = self._clock.now()
            if now - self._last >= self._deaf_s:
                received.append(found.group().decode("ascii"))
                self._last = now
        return received, b""  # the device takes a pause for the end

    def obey(self, command: str) -> bytes | None:
        """Carry out a command."""
        now = self.reported
        match command.rstrip("?").partition(":"):
            case ("*IDN", _, _):
                return self._identity
            case ("STATUS", _, _):
                return bytes([self._status()])
            case ("VOUT1", _, _):
                return f"{now.voltage:05.2f}".encode()
            case ("IOUT1", _, _):
                return f"{now.current:.3f}".encode()
            case ("VSET1", "", _):
                return f"{now.set_voltage:05.2f}".encode()
            case ("ISET1", "", _):
                return f"{now.current_limit:.3f}".encode() + self._stray
            case ("VSET1", _, number):
                self.change(set_voltage=min(float(number), float(self.model.voltage_max_V)))
            case ("ISET1", _, number):
                self.change(current_limit=min(float(number), float(self.model.current_max_A)))
            case (("OUT1" | "OUT0") as word, _, _):
                self.switch(word == "OUT1")
            case (word, _, _):
                self._armed[word[:-1]] = word[-1] == "1"
        return None

    def update(self) -> None:
        """Let the output settle; armed over-current protection trips where CC would begin."""
        super().update()
        if self.output.mode == "CC" and self._armed["OCP"]:
            self.output = replace(self.output, on=False, protection="OCP")
            super().update()

    def _status(self) -> int:
        now, armed = self.reported, self._armed
        both = self.model.name in BOTH_ON_BIT_7
        over_voltage = armed["OVP"] or (both and armed["OCP"])
        return (
            int(now.mode == "CV")
            | BEEP * armed["BEEP"]
            | OCP_BIT * (armed["OCP"] and not both)
            | OUTPUT_BIT * now.on
            | OVP_BIT * over_voltage
        )
