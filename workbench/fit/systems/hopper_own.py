"""What only single runs of the hopping robot know, as parameters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from workbench.fit.measured import MeasuredRun
from workbench.fit.parameters import Acts, Parameter, Scope

__all__ = ["Own", "own_of"]

_LEAST_LEAD_S = 1e-3
_LATE_S = {"decay": 0.02, "drop": 4e-3}  # see `hopper_seen`
_PLACE_M, _UNSEEN_M = 3e-4, 3e-3  # T's place on a ring-down: its rest seen in other runs, or not
_HEIGHT_M = 1e-3


@dataclass(frozen=True)
class Own:
    """What one run alone knows.

    Args:
        stiffer: share by which its beam is stiffer; a strip warms, and a clamp sits anew.
        late: instant of its release.
        place: of T where it was held, forward and up.
        height: of its fall.
        phase: how far the rotor may stand ahead of its smoothed angle, constant and growing from
            minus to plus over the run.
    """

    stiffer: Parameter | None = None
    late: Parameter | None = None
    place: tuple[Parameter, ...] = ()
    height: Parameter | None = None
    phase: tuple[Parameter, ...] = ()

    @property
    def every(self) -> tuple[Parameter, ...]:
        """Return all of them."""
        ones = (self.stiffer, self.late, self.height)
        return (*(one for one in ones if one is not None), *self.place, *self.phase)


def own_of(
    run: MeasuredRun, k: int, first_s: float, phase_rad: float, warmth: float, stood: bool
) -> Own:
    """Return what a run alone knows.

    Args:
        run: as measured.
        k: its number.
        first_s: time of its first observed sample [s].
        phase_rad: standard deviation of the mean of the rotor's angle.
        warmth: standard deviation of `Own.stiffer`; zero leaves it out.
        stood: whether other runs show where T rests without a pull.
    """
    name = run.name

    def one(words: str, unit: str, deviation: float, acts: Acts) -> Parameter:
        return Parameter(f"{words} {name}", unit, 0.0, deviation, scope=Scope.RUN, acts=acts, run=k)

    stiffer = None
    if warmth:
        stiffer = Parameter(
            f"stiffness of {name}", "1", 0.0, warmth, -0.1, 0.1, Scope.RUN, Acts.MODEL, k
        )
    if run.driven:
        phase = (
            one("rotor ahead in", "rad", phase_rad, Acts.DRIVE),
            one("rotor gains in", "rad", float(np.sqrt(3)) * phase_rad, Acts.DRIVE),
        )
        return Own(stiffer, phase=phase)
    latest = first_s - _LEAST_LEAD_S
    late = Parameter(
        f"release of {name}", "s", 0.0, _LATE_S[run.mode], -latest, latest, Scope.RUN, Acts.START, k
    )
    if run.mode == "decay":
        deviation = _PLACE_M if stood else _UNSEEN_M
        place = tuple(
            Parameter(f"T of {name} {axis}", "m", 0.0, deviation, scope=Scope.RUN,
                      acts=Acts.OBSERVATION, run=k)
            for axis in ("forward", "up")
        )  # fmt: skip
        return Own(stiffer, late, place)
    height = Parameter(
        f"height of {name}", "m", run.height, _HEIGHT_M, 0.0, np.inf, Scope.RUN, Acts.START, k
    )
    return Own(stiffer, late, height=height)
