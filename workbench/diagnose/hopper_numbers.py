"""The numbers of the hopping robot that may be other than stated: of its base, causes and runs."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from workbench.diagnose.rig import Cause, Unknown
from workbench.fit import MeasuredRun
from workbench.protocol import UNITS, ModelFile
from workbench.sim import EFFECTS, Effect

__all__ = ["LAG_S", "ON_FLOOR", "base_numbers", "causes_of", "felt", "own_numbers", "seen_only"]

_BEAM = (
    "hinge_stiffness", "root_stiffness", "hinge_damping", "root_damping", "top_mass", "beam_mass",
    "rotor_mass", "rotor_radius",
)  # fmt: skip
_FLOOR = ("foot_mass", "ground_stiffness", "ground_damping", "friction_slide", "friction_stick")
ON_FLOOR = ("hop", "drop")
_RELEASES = {
    "hinge_stiffness": ("hinge_stiffness",),
    "root_stiffness": ("root_stiffness",),
    "hinge_damping": ("hinge_damping",),
    "root_damping": ("root_damping",),
    "top_mass": ("top_mass",),
    "foot_mass": ("foot_mass",),
    "rotor_unbalance": ("rotor_radius",),
    "ground_stiffness": ("ground_stiffness",),
    "ground_damping": ("ground_damping",),
    "friction_level": ("friction_slide", "friction_stick"),
}
"""Effect -> the base numbers whose tolerance it leaves."""

_OWN_STEPS = ("time_step", "motor_droop")  # what changes or upsets the simulation's steps
_STEP = 1e-4  # of a base number, as a share
LAG_S = 0.05
_DELAY_S = 0.01
_LEAST_N = 0.05
_WEAK_N = 0.25  # a release from a weaker pull is found less well, as the pull is weaker
_GAIN = 1e-3  # how well a supply repeats a speed, as a share
_ANGLE_RAD = 5e-3
_PULL, _HEIGHT_M = 0.03, 1e-3
_PLACE_M = 3e-3  # how well a technician places T's marker, and the shape file the strip
_RUN_PLACE_M = 2e-4  # how well the origin is found again in each run
_WARMTH = 1e-3  # share of the stiffness: aluminium's falls by about 5e-4 a degree


def base_numbers(
    model: ModelFile, modes: Collection[str], places: Mapping[str, float]
) -> tuple[Unknown, ...]:
    """Return the numbers of the model that runs of some modes feel, and where T's marker sits.

    Args:
        model: with tolerances; numbers without one are certain.
        modes: of the runs.
        places: where T's marker was found to sit, by base number [m].
    """
    names = _BEAM + (("beam_root", *_FLOOR) if set(modes) & set(ON_FLOOR) else ())
    values = model.values()
    return tuple(
        _parameter(name, values[name], getattr(model.parameters, name).tolerance)
        for name in names
        if getattr(model.parameters, name).tolerance > 0
    ) + tuple(_place(f"top_{axis}_m place", places) for axis in "xz")


def causes_of(modes: Collection[str], present: Collection[str]) -> tuple[Cause, ...]:
    """Return the causes that runs of some modes feel, but for those that the robot has already."""
    return tuple(
        _cause(effect)
        for effect in EFFECTS.values()
        if set(modes) & set(effect.excited_by) and effect.name not in present
    )


def own_numbers(measured: MeasuredRun) -> list[Unknown]:
    """Return what a run keeps to itself: delay, stiffness, motor, release and places.

    A strip is not equally stiff from run to run: it warms, and its clamp sits anew.
    """
    weak = _WEAK_N / max(measured.pull, _LEAST_N) if measured.mode == "decay" else 1.0
    unknowns = [
        Unknown("delay", "s", 0.0, _DELAY_S * max(weak, 1.0), -0.1, 0.1, 1e-4),
        Unknown("stiffness", "1", 0.0, _WARMTH, -0.1, 0.1, 1e-5),
    ]
    if measured.driven:
        unknowns += [
            Unknown("lag", "s", LAG_S, LAG_S, 1e-3, 1.0, 1e-3),
            Unknown("gain", "1", 0.0, _GAIN, -0.1, 0.1, 1e-5),
            Unknown("start angle", "rad", 0.0, _ANGLE_RAD, -0.1, 0.1, 1e-4),
        ]
    elif measured.mode == "decay":
        unknowns.append(Unknown("pull", "1", 0.0, _PULL, -0.5, 0.5, 1e-4))
    else:
        unknowns.append(Unknown("height", "m", 0.0, _HEIGHT_M, -0.05, 0.05, 1e-5))
    return [
        *unknowns,
        *(Unknown(f"place {name}", "m", 0.0, _RUN_PLACE_M, -0.01, 0.01, 1e-5)
          for name in measured.places),
    ]  # fmt: skip


def felt(name: str, mode: str) -> bool:
    """Tell whether the motion of a run of this mode depends on an unknown."""
    effect, dot, _ = name.partition(".")
    if dot:
        return mode in EFFECTS[effect].excited_by and not seen_only(effect)
    if name in _FLOOR:
        return mode in ON_FLOOR
    return name != "delay" and not name.startswith("place ") and not name.endswith(" place")


def seen_only(effect: str) -> bool:
    """Tell whether an effect acts on the cameras alone."""
    one = EFFECTS[effect]
    return one.alter is None and one.build is None and one.drive is None


def _parameter(name: str, value: float, tolerance: float) -> Unknown:
    step = _STEP * abs(value)
    return Unknown(name, UNITS[name], value, tolerance, 1e-3 * value, 1e3 * value, step)


def _place(name: str, places: Mapping[str, float]) -> Unknown:
    return Unknown(name, "m", places.get(name, 0.0), _PLACE_M, -0.1, 0.1, 1e-5)


def _cause(effect: Effect) -> Cause:
    return Cause(
        name=effect.name,
        group=effect.group,
        sentence=effect.sentence,
        unknowns=tuple(
            Unknown(
                f"{effect.name}.{q.name}",
                q.unit,
                0.0,
                q.tolerance,
                q.low,
                q.high,
                q.step,
                exact=effect.name in _OWN_STEPS,
            )
            for q in effect.quantities
        ),
        shows_in=tuple(effect.excited_by),
        confused_with=effect.confused_with,
        separated_by=effect.separated_by,
        replaces=_RELEASES.get(effect.name, ()),
        dear=effect.dear,
    )
