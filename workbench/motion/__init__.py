"""Motions, measured or simulated: channels, time zero, summaries, and how they ring and fade.

`motion` names the channels and holds what is asked of any motion. `clamped` is how T answers the
rotor while the foot is clamped, `ringdown` how a released robot rang, both by `damped_sinusoids`.
One estimator serves track and twin, so that its errors cancel in the difference. Nothing here knows
of files, cameras or the simulation. Names are loaded when they are used.
"""

from typing import TYPE_CHECKING

from workbench.room_exports import exports

if TYPE_CHECKING:
    from workbench.motion.clamped import (
        ORDERS,
        ClampedResponse,
        answer,
        factors,
        lag,
        steady_end,
        summarize_clamped,
        terms,
    )
    from workbench.motion.damped_sinusoids import (
        LEAST_SAMPLES,
        DampedSinusoid,
        SinusoidFit,
        fit_sinusoids,
    )
    from workbench.motion.motion import (
        CORNER_FORCES,
        DRIVEN,
        FOOT,
        FOOT_ERROR,
        PITCH,
        RELEASED,
        ROTOR,
        ROTOR_ANGLE,
        ROTOR_SPEED,
        TOP,
        TOP_ERROR,
        Misfit,
        Mode,
        Summary,
        first_motion,
        last_motion,
        misfit,
        position,
        release,
        rotor_angle,
        rotor_speed,
        seen_median,
        summarize,
        time_zero,
    )
    from workbench.motion.ringdown import RingDown, summarize_release

if not TYPE_CHECKING:  # a type checker reads the imports
    __getattr__, __dir__, __all__ = exports(__name__)
