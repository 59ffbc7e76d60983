"""Pair a measured run with its twin: from a bundle's raw take to track, twin and comparison.

Everything here is made from the bundle alone, so it can be made again from it at any time. Nothing
is drawn: whoever shows a run does that from its bundle.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict
from typing import NamedTuple, TypeVar

import numpy as np

from workbench.bundle import (
    Alignment,
    Bundle,
    ChannelFacts,
    Clocks,
    CommandFacts,
    Compared,
    DelayFacts,
    Driven,
    FloorFacts,
    ObserverFacts,
    Released,
    ReleaseFacts,
    RotorSpeedFacts,
    SignalFacts,
    Swung,
    TrackFacts,
    sha256,
)
from workbench.errors import InputError, WorkbenchError
from workbench.fit import MeasuredRun, estimate
from workbench.motion import (
    DRIVEN,
    FOOT,
    RELEASED,
    ROTOR_ANGLE,
    TOP,
    ClampedResponse,
    Misfit,
    Mode,
    RingDown,
    Summary,
    last_motion,
    misfit,
    summarize,
    summarize_clamped,
    summarize_release,
    time_zero,
)
from workbench.schemas import (
    BenchFile,
    CameraSettings,
    ModelFile,
    MotorLine,
    ShapeFile,
    Sheet,
    load,
    with_calibration,
)
from workbench.timeseries import TimeSeries
from workbench.tracking import (
    Axes,
    BodyNames,
    Exchange,
    Overrides,
    Track,
    clock_fit,
    delay,
    make_track,
    mean_speed,
    noise_floor,
    read_take,
    with_overrides,
)
from workbench.twin.twin import Command, Release, find_release, make_twin, robot_of

__all__ = ["OtherTwin", "compare_with_twin", "other_twin", "settings"]

_STILL: dict[Mode, str] = {
    "decay": "T never moves in this take; was it released while the cameras recorded, and is the "
    "body name of T right?",
    "drop": "the foot never moves in this take; was it let go while the cameras recorded, and is "
    "the body name of the foot right?",
}
_NOT_DRIVEN = (
    "the rotor never moves in this take; was the motor connected, and is the body name "
    "of the rotor right?"
)
_STEADY_S = 1.0
_TOGETHER_S = 2.0

_T = TypeVar("_T")


class _TrackAndTwin(NamedTuple):
    """A run as tracked, and its twin as simulated."""

    track: Track
    twin: TimeSeries
    command: Command
    release: Release | None
    model: ModelFile
    shape: ShapeFile
    outcome: str


class OtherTwin(NamedTuple):
    """What the twin of another model did in a run.

    Args:
        motion: of it.
        summary: of the motion.
        misfit: between the measured robot and it.
        warnings: what a reader should know of it.
    """

    motion: TimeSeries
    summary: Summary | ClampedResponse | RingDown
    misfit: Misfit
    warnings: tuple[str, ...]


def compare_with_twin(bundle: Bundle) -> None:
    """Track the take, simulate its twin, compare; write series and facts into the bundle.

    Raises:
        TakeError: when the take cannot be read.
        InputError: when a body or a file is missing, or the robot cannot be simulated.
        WorkbenchError: when what the mode begins with never happened in the take.
    """
    made = _made(bundle)
    track, twin = made.track, made.twin
    made_from = {
        "take": track.take_sha256,
        "model": sha256(bundle.document("model")),
        "shape": sha256(bundle.document("shape")),
    }
    bundle.series.write("track", track.motion, {"take": track.take_sha256})
    bundle.series.write("raw", track.raw, {"take": track.take_sha256})
    bundle.series.write("twin", twin, made_from)
    _note(bundle, made)
    _observe(bundle, made, made_from)
    bundle.record.note(_signals(bundle, track, twin, made.command))


def _observe(bundle: Bundle, made: _TrackAndTwin, made_from: Mapping[str, str]) -> None:
    """Estimate the run's state and how well the model predicts it; where it cannot be, say why."""
    track, command, release = made.track, made.command, made.release or Release()
    run = MeasuredRun(
        name=bundle.path.name,
        mode=bundle.asked.mode,
        motion=track.raw.between(-np.inf, command.duration),
        steps=command.steps,
        start_angle=track.start_angle_rad,
        pull=release.pull,
        height=release.height,
    )
    try:
        found = estimate(robot_of(made.model, made.shape), run)
    except InputError as error:
        bundle.record.note(ObserverFacts(state=str(error)))
        return
    bundle.series.write("state", found.state, made_from)
    apart = misfit(run.motion, made.twin, found.compared_s)
    facts = ObserverFacts(
        state="estimated",
        prediction_mm=dict(found.prediction_mm),
        compared_s=found.compared_s,
        commanded_mm=_finite(apart.both_mm if FOOT[0] in run.places else apart.top_mm),
        measured_input_mm=found.measured_input_mm,
        measured_start_mm=found.measured_start_mm,
        noise_floor_mm=found.noise_mm,
    )
    bundle.record.note(facts)


def other_twin(bundle: Bundle, model: ModelFile) -> OtherTwin:
    """Simulate the twin that a run has by another model; nothing is written.

    It gets the same commands. Where the pull or height was found in the data, it is found anew with
    this model.

    Args:
        bundle: of the run.
        model: in place of the bundle's own.

    Raises:
        TakeError, InputError, WorkbenchError: as `pair`.
    """
    made = _made(bundle, model)
    duration = made.command.duration
    return OtherTwin(
        made.twin,
        _summary(bundle.asked.mode, made.twin, duration),
        misfit(made.track.motion, made.twin, duration),
        tuple(_unfinished("extended twin", made.twin, made.outcome)),
    )


def _made(bundle: Bundle, model: ModelFile | None = None) -> _TrackAndTwin:
    """Track the take and simulate its twin, by the bundle's own model where none is given."""
    cameras, calibration = settings(bundle)
    model = model or load(bundle.document("model"), ModelFile).content
    shape = load(bundle.document("shape"), ShapeFile).content
    track = _track(bundle, cameras)
    command = _command(bundle, calibration, track)
    mode = bundle.asked.mode
    release = _release(bundle, track, command, model, shape)
    twin, outcome = make_twin(mode, model, shape, command, track, release)
    return _TrackAndTwin(track, twin, command, release, model, shape, outcome)


def settings(bundle: Bundle) -> tuple[CameraSettings, MotorLine]:
    """Return how the cameras see the robot, and the calibration, from bench or sheet."""
    if bundle.document("sheet").exists():
        sheet = load(bundle.document("sheet"), Sheet).content
        cameras = CameraSettings(
            axes=sheet.tracking, bodies=sheet.bodies, markers=sheet.markers, cleaning=sheet.cleaning
        )
        # what is in SI already is not read once more as text with a unit
        return cameras.model_copy(update={"limits": sheet.limits}), sheet.calibration
    bench = load(bundle.document("bench"), BenchFile)
    kept = with_calibration(bench, bundle.document("calibration")).content
    return kept.tracking, kept.line


def _track(bundle: Bundle, cameras: CameraSettings) -> Track:
    mode = bundle.asked.mode
    take = with_overrides(read_take(bundle.take()), _stated(bundle, cameras))
    axes = Axes(up=cameras.axes.up, forward=cameras.axes.forward)
    if take.axes is not None and not cameras.axes.model_fields_set & {"up", "forward"}:
        axes = take.axes
    track = make_track(
        take,
        bodies=BodyNames(cameras.bodies.foot, cameras.bodies.top, cameras.bodies.rotor),
        axes=axes,
        markers={name: np.array(positions) for name, positions in cameras.markers.items()},
        recipe=cameras.cleaning,
        mode=mode,
    )
    if time_zero(mode, track.motion) is None:
        raise WorkbenchError(f"{bundle.take().name}: {_STILL.get(mode, _NOT_DRIVEN)}")
    return track


def _stated(bundle: Bundle, cameras: CameraSettings) -> Overrides:
    """Return what bench or sheet say of the take besides its axes and names."""
    exchanged: tuple[Exchange, ...] = ()
    if bundle.document("sheet").exists():
        runs = load(bundle.document("sheet"), Sheet).content.runs
        found = runs[bundle.asked.number - 1].exchanged
        exchanged = tuple(Exchange(one.bodies, *(one.frames or (None, None))) for one in found)
    return Overrides(cameras.axes.unit, cameras.axes.rate, exchanged, cameras.limits)


def _command(bundle: Bundle, calibration: MotorLine, track: Track) -> Command:
    """Return the commanded speeds: of the voltages that were sent, or of what the sheet says."""
    sent = bundle.manifest.measured.sent
    if sent is not None:
        on = sent[0][0]
        steps = tuple((t - on, calibration.speed(volts)) for t, volts in sent)
        return Command(steps, sent[-1][0] - on)
    asked = bundle.asked
    if asked.mode not in DRIVEN:
        return Command((), asked.duration_s or float(track.motion.times[-1]))
    duration = asked.duration_s or last_motion(track.motion)
    speed, ramp = asked.speed_rad_s or 0.0, asked.ramp_s or 0.0
    count = max(1, round(ramp / 0.1))
    rise = [(ramp * k / count, speed * (k + 1) / (count + 1)) for k in range(count)]
    return Command((*(rise if ramp else ()), (ramp, speed), (duration, 0.0)), duration)


def _release(
    bundle: Bundle, track: Track, command: Command, model: ModelFile, shape: ShapeFile
) -> Release | None:
    """Return from where the robot was let go: as given, else as the data have it."""
    mode = bundle.asked.mode
    if mode in DRIVEN:
        return None
    asked = bundle.asked
    pull, height = asked.pull_N, asked.height_m
    if pull is None and height is None:
        return find_release(mode, model, shape, command, track)
    if pull is None:
        return Release(height=height or 0.0)
    if asked.pull_up_N is not None:
        return Release(pull=pull, pull_up=asked.pull_up_N)
    held = summarize_release(track.motion, mode, command.duration).displacement_m
    return Release(pull=-pull if held < 0 else pull)


def _summary(
    mode: Mode, motion: TimeSeries, duration: float
) -> Summary | ClampedResponse | RingDown:
    if mode in RELEASED:
        return summarize_release(motion, mode, duration)
    return (summarize_clamped if mode == "clamped" else summarize)(motion, duration)


def _signals(bundle: Bundle, track: Track, twin: TimeSeries, command: Command) -> SignalFacts:
    """Return noise, rotor speed, floor and clocks for the manifest; null where they are not known.

    The delay to the twin is that of T's height over the first two seconds, before hops diverge.
    Clocks are compared only with steps that the bench sent itself.
    """
    noise = noise_floor(track.raw, stop=command.duration)
    driven = track.raw.between(_STEADY_S, command.duration)
    late = _or_none(lambda: delay(track.raw, twin, TOP[2], 0.0, _TOGETHER_S))
    sent = bundle.manifest.measured.sent is not None
    clocks = _or_none(lambda: clock_fit(track.raw, command.steps)) if sent else None
    speed = _or_none(
        lambda: mean_speed(
            driven.times, np.where(driven.validity(ROTOR_ANGLE), driven[ROTOR_ANGLE], np.nan)
        )
    )
    return SignalFacts(
        noise_mm={n: ChannelFacts(**v.as_json(1e3)) for n, v in noise.items() if _in_metres(n)},
        noise_rad={n: ChannelFacts(**v.as_json()) for n, v in noise.items() if not _in_metres(n)},
        rotor_speed_rad_s=speed and RotorSpeedFacts(**asdict(speed)),
        floor=track.floor and FloorFacts(**asdict(track.floor)),
        alignment=Alignment(
            twin_delay=late and DelayFacts(**asdict(late)),
            clocks=clocks and Clocks(**asdict(clocks)),
        ),
    )


def _finite(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _in_metres(channel: str) -> bool:
    return channel.endswith("_m")


def _or_none(measure: Callable[[], _T]) -> _T | None:
    """Return what a measurement gives, None where the run is too short or too poor for it."""
    try:
        return measure()
    except InputError:
        return None


def _note(bundle: Bundle, made: _TrackAndTwin) -> None:
    """Write what robot and twin did into the manifest, of which the views are made."""
    track, command, mode = made.track, made.command, bundle.asked.mode
    error = misfit(track.motion, made.twin, command.duration)
    kind = Released if mode in RELEASED else Swung if mode == "clamped" else Driven
    real = _summary(mode, track.motion, command.duration)
    twin = _summary(mode, made.twin, command.duration)
    facts = Compared(
        release=made.release and _release_facts(made.release),
        command=CommandFacts(steps=tuple(command.steps), duration_s=command.duration),
        real=kind(**asdict(real)),
        twin=kind(**asdict(twin), outcome=made.outcome),
        error_mm=error.both_mm,
        error_foot_mm=error.foot_mm,
        error_top_mm=error.top_mm,
        track=TrackFacts(
            recipe=track.recipe,
            zero_in_take_s=track.zero_in_take_s,
            start_angle_rad=track.start_angle_rad,
            rest_s=track.rest_s,
            cleaning=track.report,
        ),
        warnings=tuple(_warnings(made)),
    )
    bundle.record.note(facts)


def _release_facts(release: Release) -> ReleaseFacts:
    return ReleaseFacts(
        pull_N=release.pull,
        pull_up_N=release.pull_up,
        height_m=release.height,
        standard_error=release.uncertainty,
    )


def _warnings(made: _TrackAndTwin) -> list[str]:
    backwards = made.release is not None and made.release.pull < 0
    return [
        *made.track.warnings,
        *(["T was pulled backwards, and so is the twin's"] if backwards else ()),
        *_unfinished("twin", made.twin, made.outcome),
    ]


def _unfinished(who: str, motion: TimeSeries, outcome: str) -> list[str]:
    """Return a warning where a simulation ended early."""
    done = outcome == "completed"
    return [] if done else [f"the {who} {outcome} after {motion.times[-1]:.2f} s"]
