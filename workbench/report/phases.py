"""The states of a run's phase bar: rest, ramp, hold, off, and prompts where somebody was asked."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from workbench.motion import DRIVEN, Mode
from workbench.report.comparison import Phase

__all__ = ["phases", "with_prompts"]

_HOLD_S = 0.3  # a speed that is constant for longer is held; ramps step every tenth of a second
_RELEASED = {"decay": "ring-down", "drop": "drop"}


def phases(
    mode: Mode, begin: float, steps: Sequence[tuple[float, float]], duration: float
) -> tuple[Phase, ...]:
    """Return what the robot was put through, in order of time.

    Args:
        mode: of the run.
        begin: of the recording [s].
        steps: (time [s], rotor speed [rad/s]) as commanded, the last one to zero; none where a
            drive never began.
        duration: end of the drive, or of the time after the release [s].
    """
    if mode not in DRIVEN:
        return (Phase(begin, "rest"), Phase(0.0, _RELEASED[mode]))
    if not steps:
        return (Phase(begin, "rest"),)
    ends = [time for time, _ in steps[1:]]
    driven = list(zip(steps[:-1], ends, strict=True))
    levels = sum(end - since > _HOLD_S for (since, _), end in driven)
    phases = [Phase(begin, "rest")]
    for (since, speed), end in driven:
        name = "ramp"
        if end - since > _HOLD_S:
            name = f"hold {speed:.2f} rad/s" if levels > 1 else "hold"
        if phases[-1].name != name:
            phases.append(Phase(max(since, 0.0), name))
    return (*phases, Phase(duration, "off"))


def with_prompts(
    states: Sequence[Phase], prompts: Iterable[tuple[float, float]]
) -> tuple[Phase, ...]:
    """Return the states with `prompt` while the operator was asked, and what was on after that.

    Args:
        states: of `phases`.
        prompts: (asked, answered) [s] in order of time; one that took no time is left out.
    """
    phases_now = list(states)
    for asked, answered in prompts:
        if answered <= asked or not phases_now or answered <= phases_now[0].time_s:
            continue
        after = [state for state in phases_now if state.time_s <= answered][-1]
        kept = [state for state in phases_now if not asked <= state.time_s <= answered]
        phases_now = sorted([*kept, Phase(asked, "prompt"), Phase(answered, after.name)])
    return tuple(phases_now)
