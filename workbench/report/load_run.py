"""What a bundle keeps of a run as a `Comparison`: nothing is tracked or simulated again.

A bundle that was cut off, or one whose files are damaged, still shows what is there. What is not is
named, and the whole is marked.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from workbench.bundle import (
    Asked,
    Bundle,
    CommandFacts,
    Compared,
    Driven,
    Logged,
    ObserverFacts,
    Released,
    Series,
    SignalFacts,
    Swung,
    condition_words,
    events,
    judgements,
    sentence,
    sha256,
    verify,
)
from workbench.errors import InputError
from workbench.motion import (
    FOOT,
    RELEASED,
    ROTOR,
    ROTOR_ANGLE,
    ROTOR_SPEED,
    TOP,
    ClampedResponse,
    Misfit,
    Mode,
    RingDown,
    Summary,
    summarize_clamped,
)
from workbench.report.comparison import Comparison, ErrorSources, Figure, Phase, PredictionError
from workbench.report.condition import condition
from workbench.report.phases import phases, with_prompts
from workbench.schemas import ModelFile, ShapeFile, load, load_model, load_shape
from workbench.timeseries import TimeSeries

__all__ = ["load_any", "load_comparison", "load_damaged"]

_NAN = float("nan")
_CHANNELS = (*FOOT, *TOP, *ROTOR, ROTOR_ANGLE, ROTOR_SPEED, "hinge_0_rad")
_NOTHING = TimeSeries.of([], {name: [] for name in _CHANNELS})
"""In place of a motion that there is none of."""


class _Kept(NamedTuple):
    """The series of a bundle, with what is wrong with it."""

    real: TimeSeries
    twin: TimeSeries
    supply: TimeSeries | None
    state: TimeSeries | None
    warnings: Sequence[str]
    mark: str | None = None


def load_comparison(bundle: Bundle) -> Comparison:
    """Return a finished run beside its twin, from the bundle's own series and manifest.

    Raises:
        InputError: when a file of it is missing or damaged; `recall_damaged` shows the rest.
    """
    compared = bundle.manifest.compared
    if compared is None or compared.command is None:
        raise InputError(
            f"{bundle.path}: was never compared with its twin; its status is "
            f"{bundle.manifest.status!r}"
        )
    supply = bundle.series.read("supply") if bundle.series.has("supply") else None
    kept = _Kept(
        bundle.series.read("track"),
        bundle.series.read("twin"),
        supply,
        bundle.series.read("state") if bundle.series.has("state") else None,
        compared.warnings,
    )
    return _comparison(bundle, kept)


def load_damaged(bundle: Bundle) -> Comparison:
    """Return what is left of a run that was cut off or damaged, marked as such.

    A series that cannot be read is shown as nothing; the warnings name the file.
    """
    wrong = _wrong(bundle)
    real, twin = (_series(bundle, kind, wrong) for kind in ("track", "twin"))
    supply, state = (_series(bundle, kind, wrong) for kind in ("supply", "state"))
    compared = bundle.manifest.compared
    warnings = [*dict.fromkeys(wrong), *(() if compared is None else compared.warnings)]
    mark = _mark(bundle, wrong)
    kept = _Kept(real or _NOTHING, twin or _NOTHING, supply, state, warnings, mark)
    return _comparison(bundle, kept)


def load_any(bundle: Bundle) -> Comparison:
    """Return a run as `recall` does where it is whole, else what is left of it, marked."""
    finished = bundle.manifest.status == "complete" and bundle.is_closed()
    whole = finished and not _wrong(bundle)
    return load_comparison(bundle) if whole else load_damaged(bundle)


def _wrong(bundle: Bundle) -> list[str]:
    """Return what is wrong with the files of a finished run; its views are made anew anyway."""
    views = tuple(bundle.view(kind).name for kind in ("recording", "report"))
    problems = verify(bundle.path) if bundle.is_closed() else []
    return [problem for problem in problems if not problem.startswith(views)]


def _series(bundle: Bundle, kind: Series, wrong: list[str]) -> TimeSeries | None:
    """Return a series that is there and whole; of another one the reason is added to `wrong`."""
    if not bundle.series.has(kind):
        return None
    try:
        return bundle.series.read(kind)
    except InputError as error:
        wrong.append(str(error))
        return None


def _mark(bundle: Bundle, wrong: Sequence[str]) -> str:
    """Return in words why a run is not to be taken for a whole one."""
    status, error = bundle.manifest.status, bundle.manifest.error
    reason = f": {error.splitlines()[0]}" if error else ""
    if status == "complete" and wrong:
        return f"DAMAGED, {len(wrong)} of its files are not as they were written"
    if not bundle.is_closed():
        return "ABORTED, the program was killed or the computer stopped"
    return f"{'INTERRUPTED' if status == 'interrupted' else 'ABORTED'} ({status}){reason}"


def _comparison(bundle: Bundle, kept: _Kept) -> Comparison:
    """Put series and manifest together; what an interrupted run does not have is NaN or empty."""
    asked, compared = bundle.asked, bundle.manifest.compared
    model, shape = _robot(bundle)
    release = None if compared is None else compared.release
    begin = float(kept.real.times[0]) if len(kept.real) else -(asked.rest_s or 0.0)
    command = (None if compared is None else compared.command) or _sent(bundle)
    length = command.duration_s
    return Comparison(
        title=asked.title,
        run=bundle.manifest.id,
        mode=asked.mode,
        real=kept.real,
        twin=kept.twin,
        duration_s=length,
        phases=_phases(bundle, begin, command),
        floor_m=0.0 if release is None else -release.height_m,
        figure=_figure(model.values(), shape),
        real_summary=_summary(asked.mode, compared and compared.real, kept.real, length),
        twin_summary=_summary(asked.mode, compared and compared.twin, kept.twin, length),
        misfit=_misfit(compared),
        supply=None if kept.supply is None else kept.supply.shifted(-_zero(bundle)),
        facts=_table(bundle, model, shape),
        log=_log(bundle),
        warnings=tuple(kept.warnings),
        noise=_noise(bundle.manifest.signals),
        label=_label(asked, shape),
        protocol=_protocol(bundle),
        mark=kept.mark,
        estimate=kept.state,
        predictions=_predictions(bundle.manifest.observed),
        judged=judgements(bundle.manifest),
        sources=_sources(bundle.manifest.observed),
        unestimated=_unestimated(bundle, kept.state),
    )


def _predictions(observed: ObserverFacts | None) -> tuple[PredictionError, ...]:
    """Return the errors of predictions from the estimated state, of those that were made."""
    if observed is None:
        return ()
    errors = observed.prediction_mm.items()
    found = [PredictionError(float(ahead), mm) for ahead, mm in errors if mm is not None]
    driven = None if observed.compared_s is not None else observed.measured_input_mm
    return (*found, *([PredictionError(math.inf, driven)] if driven is not None else ()))


def _sources(observed: ObserverFacts | None) -> ErrorSources | None:
    """Return what the twin's error comes from, where no free simulation ended early."""
    if observed is None:
        return None
    until, commanded = observed.compared_s, observed.commanded_mm
    started, noise = observed.measured_start_mm, observed.noise_floor_mm
    if until is None or commanded is None or started is None or noise is None:
        return None
    return ErrorSources(until, commanded, observed.measured_input_mm, started, noise)


def _unestimated(bundle: Bundle, state: TimeSeries | None) -> str:
    """Return why a run has no estimated pose; empty where it has one."""
    if state is not None:
        return ""
    outcome = bundle.manifest.observed and bundle.manifest.observed.state
    if outcome == "estimated":
        return "the file of its estimated state is missing or damaged"
    return outcome or "the run was not observed"


def _robot(bundle: Bundle) -> tuple[ModelFile, ShapeFile]:
    """Return model and shape; where one cannot be read, the thesis' is drawn."""
    try:
        model = load(bundle.document("model"), ModelFile).content
    except InputError:
        model = load_model("thesis", Path()).content
    try:
        shape = load(bundle.document("shape"), ShapeFile).content
    except InputError:
        shape = load_shape("thesis-initial", Path()).content
    return model, shape


def _figure(values: dict[str, float], shape: ShapeFile) -> Figure:
    return Figure(
        foot_length=values["foot_length"],
        foot_width=values["foot_width"],
        beam_length=shape.length,
        beam_root=values["beam_root"],
        rotor_radius=values["rotor_radius"],
    )


def _summary(
    mode: Mode, found: Driven | Swung | Released | None, motion: TimeSeries, duration: float
) -> Summary | ClampedResponse | RingDown:
    kind = RingDown if mode in RELEASED else ClampedResponse if mode == "clamped" else Summary
    if kind is ClampedResponse and isinstance(found, Driven):  # an early record
        return summarize_clamped(motion, duration)
    known = {} if found is None else found.model_dump()
    return kind(**{name: known.get(name, _NAN) for name in kind.__dataclass_fields__})


def _misfit(compared: Compared | None) -> Misfit:
    if compared is None:
        return Misfit(_NAN, _NAN, _NAN)
    return Misfit(compared.error_foot_mm, compared.error_top_mm, compared.error_mm)


def _label(asked: Asked, shape: ShapeFile) -> tuple[str, ...]:
    """Return what distinguishes a run from others of its protocol: condition, beam, repeat."""
    repeat = (f"repeat {asked.repeat}",) if asked.repeat is not None else ()
    return (*condition_words(asked), shape.name, *repeat)


def _noise(signals: SignalFacts | None) -> dict[str, float]:
    """Return each channel's noise at rest, SI; its white part where there was too little rest."""
    found: dict[str, float] = {}
    if signals is None:
        return found
    for channels, scale in ((signals.noise_mm, 1e-3), (signals.noise_rad, 1.0)):
        for name, parts in channels.items():
            sigma = parts.rest if parts.rest is not None else parts.white
            if sigma is not None:
                found[name] = scale * sigma
    return found


def _events(bundle: Bundle) -> list[Logged]:
    """Return the journal on the cameras' clock; what came before them is put at their start."""
    logged = bundle.record.events()
    started = next(
        (k for k, one in enumerate(logged) if isinstance(one.event, events.CamerasStarted)), 0
    )
    return [_at_start(one) for one in logged[:started]] + logged[started:]


def _at_start(one: Logged) -> Logged:
    event = one.event
    if isinstance(event, events.PromptAnswered):
        event = event.model_copy(update={"asked_s": 0.0})
    return Logged(0.0, event)


def _zero(bundle: Bundle) -> float:
    """Return time zero on the clock of the cameras: where the output came on, else the release."""
    sent, compared = bundle.manifest.measured.sent, bundle.manifest.compared
    if sent is not None:
        return sent[0][0]
    track = None if compared is None else compared.track
    on = (time for time, event in _events(bundle) if isinstance(event, events.OutputOn))
    return next(on, 0.0 if track is None else track.zero_in_take_s)


def _sent(bundle: Bundle) -> CommandFacts:
    """Return the command of a run that was cut off, as the journal has it; speeds are as asked."""
    zero, speed = _zero(bundle), bundle.asked.speed_rad_s or 0.0
    logged = _events(bundle)
    changes = events.OutputOn | events.Voltage
    times = [time - zero for time, event in logged if isinstance(event, changes)]
    last = max((time - zero for time, _ in logged), default=0.0)
    steps = [(time, speed) for time in times] + ([(last, 0.0)] if times else [])
    return CommandFacts(steps=tuple(steps), duration_s=max(last, 0.0))


def _phases(bundle: Bundle, begin: float, command: CommandFacts) -> tuple[Phase, ...]:
    zero = _zero(bundle)
    prompts = [
        (event.asked_s - zero, time - zero)
        for time, event in _events(bundle)
        if isinstance(event, events.PromptAnswered) and event.asked_s is not None
    ]
    bar = phases(bundle.asked.mode, begin, command.steps, command.duration_s)
    return with_prompts(bar, prompts)


def _log(bundle: Bundle) -> tuple[tuple[float, str], ...]:
    zero = _zero(bundle)
    logged = (one for one in _events(bundle) if not isinstance(one.event, events.SupplyReading))
    return tuple((time - zero, sentence(event)) for time, event in logged)


def _protocol(bundle: Bundle) -> str:
    """Return the protocol, or the sheet, as it was given; empty where neither is there."""
    files = (bundle.document("protocol"), bundle.document("sheet"))
    return next(
        (file.read_text(encoding="utf-8", errors="replace") for file in files if file.exists()), ""
    )


def _table(bundle: Bundle, model: ModelFile, shape: ShapeFile) -> dict[str, str]:
    """Return the rows of the report that say what the run was made with."""
    manifest, asked, compared = bundle.manifest, bundle.asked, bundle.manifest.compared
    track = None if compared is None else compared.track
    rows = {
        "condition": condition(asked, None if compared is None else compared.release),
        "role": asked.role,
        "model": f"{model.name} ({_digest(bundle.document('model'))})",
        "shape": f"{shape.name}, angles of the {shape.state} beam",
        "take": _take(bundle),
        "cleaning": "never tracked" if track is None else track.recipe,
    }
    if track is not None:
        angle = np.degrees(track.start_angle_rad)
        rows["rotor at rest"] = f"{angle:.1f} deg from forward, towards down"
    rows |= {
        name: f"{answer.value} {answer.unit or ''}".rstrip()
        for name, answer in manifest.measured.answers.items()
    }
    supply, state = manifest.measured.supply, manifest.observed and manifest.observed.state
    return rows | {
        "supply": "not recorded" if supply is None else supply.words,
        "output at the end": bundle.record.output_off or "not driven by the workbench",
        **({"estimated pose": state} if state not in (None, "estimated") else {}),
        "versions": ", ".join(f"{name} {version}" for name, version in asked.versions.items()),
    }


def _digest(path: Path) -> str:
    return sha256(path)[:12] if path.exists() else "lost"


def _take(bundle: Bundle) -> str:
    if not bundle.has_take():
        return "none"
    take = bundle.take()
    return f"{take.name} ({sha256(take)[:12]})"
