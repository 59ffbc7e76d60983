"""Pair a measured run with its twin: from a bundle's raw take to track, twin, comparison and views.

Everything here is made from the bundle alone, so it can be made again from it at any time.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass
from typing import Any, Literal, TypeVar

import numpy as np

from workbench.bundle import Bundle, sha256
from workbench.errors import InputError, WorkbenchError
from workbench.motion import ROTOR_ANGLE, TOP, first_motion, last_motion, misfit, summarize
from workbench.protocol import (
    BenchFile,
    Calibration,
    Cameras,
    Mode,
    ModelFile,
    ShapeFile,
    Sheet,
    load,
)
from workbench.review import Comparison, Figure, Phase, write_recording, write_report
from workbench.sim import (
    Condition,
    Robot,
    make_robot,
    require_stable,
    sample_times,
    settle,
    simulate,
    staircase,
    unloaded,
)
from workbench.timeseries import TimeSeries
from workbench.tracking import (
    Axes,
    BodyNames,
    Track,
    clock_fit,
    delay,
    make_track,
    mean_speed,
    noise_floor,
    read_take,
)

__all__ = ["check_twin", "make_twin", "pair"]

_LEAST_REST_S = 0.6  # what first_motion needs to know the rotor at rest
_MOST_REST_S = 5.0
_AFTER_S = 0.5
_STEADY_S = 1.0
_TOGETHER_S = 2.0

_T = TypeVar("_T")


@dataclass(frozen=True)
class Command:
    """What the motor was told.

    Args:
        steps: (time since the output came on [s], rotor speed [rad/s]), ending with speed 0.
        duration: time with the output on [s].
    """

    steps: tuple[tuple[float, float], ...]
    duration: float


def pair(bundle: Bundle) -> Comparison:
    """Track the take, simulate its twin, compare, draw; write all of it into the bundle.

    Raises:
        TakeError: when the take cannot be read.
        InputError: when a body or a file is missing, or the robot cannot be simulated.
        WorkbenchError: when the rotor never moved in the take.
    """
    cameras, calibration = _settings(bundle)
    model = load(bundle.document("model"), ModelFile).content
    shape = load(bundle.document("shape"), ShapeFile).content
    track = _track(bundle, cameras)
    command = _command(bundle, calibration, track)
    twin, outcome = make_twin(bundle.manifest["mode"], model, shape, command, track)
    made_from = {
        "take": track.take_sha256,
        "model": sha256(bundle.document("model")),
        "shape": sha256(bundle.document("shape")),
    }
    bundle.write_series("track", track.motion, {"take": track.take_sha256})
    bundle.write_series("raw", track.raw, {"take": track.take_sha256})
    bundle.write_series("twin", twin, made_from)
    comparison = _compare(bundle, track, twin, command, model, shape, outcome)
    _note(bundle, comparison, track, outcome)
    bundle.note(_signals(bundle, track, twin, command))
    write_recording(comparison, bundle.view("recording"))
    write_report(comparison, bundle.view("report"))
    return comparison


def check_twin(model: ModelFile, shape: ShapeFile, modes: Iterable[Mode]) -> None:
    """Find out before anything is switched whether this robot can be simulated.

    Raises:
        InputError: when it cannot be built, does not stand, has effects, or its step is too long.
    """
    for mode in sorted(set(modes)):
        foot = Condition(_driven(mode), np.zeros(1)).foot
        require_stable(*settle(unloaded(_robot(model, shape)), foot, np.pi / 2))


def make_twin(
    mode: Mode,
    model: ModelFile,
    shape: ShapeFile,
    command: Command,
    track: Track,
) -> tuple[TimeSeries, str]:
    """Simulate exactly the run that was measured.

    The twin gets the same commands and starts with the rotor where the track saw it; its time zero
    is found by the same estimator as the track's.

    Returns:
        The motion with time zero at the first rotor motion, and the simulation's outcome.

    Raises:
        InputError: when the model has effects, which cannot be simulated yet, or does not stand.
    """
    rest = float(np.clip(track.rest_s, _LEAST_REST_S, _MOST_REST_S))
    speed = staircase(sample_times(command.duration + _AFTER_S), command.steps)
    condition = Condition(_driven(mode), speed, track.start_angle_rad, rest)
    result = simulate(_robot(model, shape), condition)
    zero = first_motion(result.motion.times, result.motion[ROTOR_ANGLE]) or 0.0
    return result.motion.shifted(-zero), result.outcome


def _robot(model: ModelFile, shape: ShapeFile) -> Robot:
    if model.effects:
        names = ", ".join(effect.name for effect in model.effects)
        raise InputError(
            f"model {model.name!r} has effects ({names}); they cannot be simulated yet"
        )
    return make_robot(model.values(), shape)


def _driven(mode: Mode) -> Literal["hop", "clamped"]:
    if mode not in ("hop", "clamped"):
        raise InputError(f"mode {mode!r} has no twin yet; modes that have: hop, clamped")
    return mode


def _settings(bundle: Bundle) -> tuple[Cameras, Calibration]:
    """Return how the cameras see the robot, and the calibration, from bench or sheet."""
    if bundle.document("sheet").exists():
        sheet = load(bundle.document("sheet"), Sheet).content
        cameras = Cameras(
            axes=sheet.tracking,
            bodies=sheet.bodies,
            markers=sheet.markers,
            cleaning=sheet.cleaning,
        )
        return cameras, sheet.calibration
    bench = load(bundle.document("bench"), BenchFile).content
    return bench.tracking, bench.calibration


def _track(bundle: Bundle, cameras: Cameras) -> Track:
    track = make_track(
        read_take(bundle.take()),
        bodies=BodyNames(cameras.bodies.foot, cameras.bodies.top, cameras.bodies.rotor),
        axes=Axes(up=cameras.axes.up, forward=cameras.axes.forward),
        markers={name: np.array(places) for name, places in cameras.markers.items()},
        recipe=cameras.cleaning,
    )
    if first_motion(track.motion.times, track.motion[ROTOR_ANGLE]) is None:
        raise WorkbenchError(
            f"{bundle.take().name}: the rotor never moves in this take; "
            "was the motor connected, and is the body name of the rotor right?"
        )
    return track


def _command(bundle: Bundle, calibration: Calibration, track: Track) -> Command:
    """Return the commanded speeds: of the voltages that were sent, or of what the sheet says."""
    sent = bundle.manifest.get("sent")
    if sent is not None:
        on = sent[0][0]
        steps = tuple((t - on, calibration.speed(volts)) for t, volts in sent)
        return Command(steps, sent[-1][0] - on)
    asked = bundle.manifest
    duration = asked["duration_s"] or last_motion(track.motion)
    speed, ramp = asked["speed_rad_s"], asked["ramp_s"]
    count = max(1, round(ramp / 0.1))
    rise = [(ramp * k / count, speed * (k + 1) / (count + 1)) for k in range(count)]
    return Command((*(rise if ramp else ()), (ramp, speed), (duration, 0.0)), duration)


def _compare(
    bundle: Bundle,
    track: Track,
    twin: TimeSeries,
    command: Command,
    model: ModelFile,
    shape: ShapeFile,
    outcome: str,
) -> Comparison:
    values = model.values()
    warnings = list(track.warnings)
    if outcome != "completed":
        warnings.append(f"the twin {outcome} after {twin.times[-1]:.2f} s")
    return Comparison(
        title=bundle.manifest["title"],
        run=bundle.manifest["id"],
        real=track.motion,
        twin=twin,
        duration_s=command.duration,
        phases=_phases(track, command),
        figure=Figure(
            foot_length=values["foot_length"],
            foot_width=values["foot_width"],
            beam_length=shape.length,
            beam_root=values["beam_root"],
            rotor_radius=values["rotor_radius"],
        ),
        real_summary=summarize(track.motion, command.duration),
        twin_summary=summarize(twin, command.duration),
        misfit=misfit(track.motion, twin, command.duration),
        supply=_supply(bundle),
        facts=_table(bundle, track, model, shape),
        log=_log(bundle),
        warnings=tuple(warnings),
    )


def _phases(track: Track, command: Command) -> tuple[Phase, ...]:
    begin = float(track.motion.times[0])
    ramp_end = command.steps[-2][0] if len(command.steps) > 1 else 0.0
    ramp = (
        (Phase(0.0, "ramp"), Phase(ramp_end, "drive")) if ramp_end > 0 else (Phase(0.0, "drive"),)
    )
    return (Phase(begin, "rest"), *ramp, Phase(command.duration, "off"))


def _supply(bundle: Bundle) -> TimeSeries | None:
    """Return the supply's readings with time zero where its output came on."""
    if not bundle.has("supply"):
        return None
    return bundle.read_series("supply").shifted(-bundle.manifest["sent"][0][0])


def _log(bundle: Bundle) -> tuple[tuple[float, str], ...]:
    on = bundle.manifest.get("sent", [[0.0]])[0][0]
    return tuple(
        (event["time_s"] - on, _sentence(event))
        for event in bundle.read_journal()
        if event["event"] != "reading"
    )


def _sentence(event: Mapping[str, Any]) -> str:
    """Tell a journal event in words; one that is not known here is told as it stands."""
    match event:
        case {"event": "asked", "run": run, "rest_s": rest, "steps": [[_, first], *_, [_, last]]}:
            return f"asked for {run}: {rest} s rest, then {first} V to {last} V"
        case {"event": "prompt", "text": text, "answer": answer}:
            return f"operator {answer}: {text}"
        case {"event": "prepared", "identity": {"model": model, "serial": serial}}:
            return f"{model} {serial} prepared: limits set, output off"
        case {"event": "cameras"}:
            return "cameras record"
        case {"event": "output_on", "volts": volts}:
            return f"output on at {volts} V"
        case {"event": "voltage", "read_back": volts}:
            return f"{volts} V set and read back"
        case {"event": "output_off", "confirmed": confirmed}:
            return "output off, confirmed" if confirmed else "OUTPUT MAY BE ON, not confirmed"
    return ", ".join(f"{key} {value}" for key, value in event.items() if key != "time_s")


def _table(bundle: Bundle, track: Track, model: ModelFile, shape: ShapeFile) -> dict[str, str]:
    """Return the rows of the report that say what the run was made with."""
    facts = bundle.manifest
    asked = f"{facts['mode']}, {facts['speed_rad_s']:.2f} rad/s"
    if facts.get("voltage_V") is not None:
        asked += f" = {facts['voltage_V']:g} V by calibration {facts['calibration']}"
    return {
        "asked": asked,
        "role": facts["role"],
        "model": f"{model.name} ({sha256(bundle.document('model'))[:12]})",
        "shape": f"{shape.name}, angles of the {shape.state} beam",
        "take": f"{bundle.take().name} ({track.take_sha256[:12]})",
        "cleaning": track.recipe,
        "rotor at rest": f"{np.degrees(track.start_angle_rad):.1f} deg from forward, towards down",
        "supply": " ".join(str(v) for v in facts.get("supply", {}).values()) or "not recorded",
        "output at the end": facts.get("output_off", "not driven by the workbench"),
        "versions": ", ".join(f"{k} {v}" for k, v in facts["versions"].items()),
    }


def _signals(bundle: Bundle, track: Track, twin: TimeSeries, command: Command) -> dict[str, Any]:
    """Return noise, rotor speed, floor and clocks for the manifest; null where they are not told.

    The delay to the twin is that of T's height over the first two seconds, before hops diverge.
    Clocks are compared only with steps that the bench sent itself.
    """
    noise = noise_floor(track.raw, stop=command.duration)
    driven = track.raw.between(_STEADY_S, command.duration)
    late = _told(lambda: delay(track.raw, twin, TOP[2], 0.0, _TOGETHER_S))
    sent = "sent" in bundle.manifest
    clocks = _told(lambda: clock_fit(track.raw, command.steps)) if sent else None
    speed = _told(
        lambda: mean_speed(
            driven.times, np.where(driven.validity(ROTOR_ANGLE), driven[ROTOR_ANGLE], np.nan)
        )
    )
    return {
        "noise_mm": {n: v.as_json(1e3) for n, v in noise.items() if n.endswith("_m")},
        "noise_rad": {n: v.as_json() for n, v in noise.items() if n.endswith("_rad")},
        "rotor_speed_rad_s": speed and asdict(speed),
        "floor": track.floor and track.floor.as_json(),
        "alignment": {"twin_delay": late and asdict(late), "clocks": clocks and asdict(clocks)},
    }


def _told(tell: Callable[[], _T]) -> _T | None:
    """Return what a measurement tells, None where the run is too short or too poor for it."""
    try:
        return tell()
    except InputError:
        return None


def _note(bundle: Bundle, comparison: Comparison, track: Track, outcome: str) -> None:
    bundle.note(
        {
            "real": comparison.real_summary.as_json(),
            "twin": comparison.twin_summary.as_json() | {"outcome": outcome},
            "error_mm": comparison.misfit.both_mm,
            "error_foot_mm": comparison.misfit.foot_mm,
            "error_top_mm": comparison.misfit.top_mm,
            "track": {
                "recipe": track.recipe,
                "zero_in_take_s": track.zero_in_take_s,
                "start_angle_rad": track.start_angle_rad,
                "rest_s": track.rest_s,
                "cleaning": track.report,
            },
            "warnings": list(comparison.warnings),
        }
    )
