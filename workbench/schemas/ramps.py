"""Even voltage steps from level to level."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from decimal import ROUND_HALF_EVEN, Decimal
from itertools import pairwise

from workbench.schemas.plan import Level

__all__ = ["RAMP_STEP_S", "Ramps"]

RAMP_STEP_S = 0.1
"""Time between two voltages of a ramp: a supply on a serial line takes some 20 a second."""

Steps = tuple[tuple[float, Decimal], ...]


class Ramps:
    """How a supply gets from one voltage to another.

    Args:
        lowest: where the first ramp begins [V]: below it the motor may not turn.
        voltage_step: smallest step of the supply [V].
        slew: fastest change allowed [V/s].
    """

    def __init__(self, lowest: float, voltage_step: Decimal, slew: float) -> None:
        self._lowest = Decimal(repr(lowest)).quantize(voltage_step)
        self._step = voltage_step
        self._slew = slew

    def through(self, levels: Sequence[Level], first: float, between: float) -> Steps:
        """Return the steps through some levels, each ramp within the slew.

        Args:
            levels: in the order of their `since`.
            first: time of the ramp from the lowest voltage to the first level [s].
            between: time of each further ramp [s].
        """
        steps = list(
            self._ramp(0.0, min(self._lowest, levels[0].voltage), levels[0].voltage, first)
        )
        for before, level in pairwise(levels):
            ramp = list(self._ramp(level.since, before.voltage, level.voltage, between))
            steps += ramp[1:] or ramp
        return tuple(steps)

    def _ramp(
        self, since: float, start: Decimal, end: Decimal, ramp: float
    ) -> Iterator[tuple[float, Decimal]]:
        ramp = max(ramp, float(abs(end - start)) / self._slew)
        count = math.ceil(round(ramp / RAMP_STEP_S, 9))
        if start == end or count == 0:
            yield since, end
            return
        for i in range(count + 1):
            volts = (start + (end - start) * i / count).quantize(self._step, ROUND_HALF_EVEN)
            yield since + ramp * i / count, volts
