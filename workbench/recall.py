"""What a bundle keeps of a run as a `Comparison`: nothing is tracked or simulated again.

A bundle that was cut off, or one whose files are damaged, still shows what is there. What is not is
named, and the whole is marked.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from workbench.bundle import Bundle, Series, find_folder, sha256, verify
from workbench.errors import InputError, did_you_mean
from workbench.motion import DRIVEN, FOOT, ROTOR, ROTOR_ANGLE, ROTOR_SPEED, TOP, Misfit, Summary
from workbench.protocol import ModelFile, ShapeFile, load, load_model, load_shape
from workbench.review import Comparison, Figure, Phase, Predicted
from workbench.review.condition import condition
from workbench.review.journal import sentence
from workbench.review.phases import phases, with_prompts
from workbench.ringdown import RingDown
from workbench.timeseries import TimeSeries

__all__ = ["recall", "recall_damaged", "recall_whatever", "runs_named"]

_NAN = float("nan")
_CHANNELS = (*FOOT, *TOP, *ROTOR, ROTOR_ANGLE, ROTOR_SPEED, "hinge_0_rad")
_NOTHING = TimeSeries.of([], {name: [] for name in _CHANNELS})
"""Stands for a motion that there is none of."""


class _Kept(NamedTuple):
    """The series of a bundle, with what is wrong with it."""

    real: TimeSeries
    twin: TimeSeries
    supply: TimeSeries | None
    state: TimeSeries | None
    warnings: Sequence[str]
    mark: str | None = None


def recall(bundle: Bundle) -> Comparison:
    """Return a finished run beside its twin, from the bundle's own series and manifest.

    Raises:
        InputError: when a file of it is missing or damaged; `recall_damaged` shows the rest.
    """
    if "command" not in bundle.manifest:
        raise InputError(
            f"{bundle.path}: was never compared with its twin; its status is "
            f"{bundle.manifest['status']!r}"
        )
    supply = bundle.read_series("supply") if bundle.has("supply") else None
    kept = _Kept(
        bundle.read_series("track"),
        bundle.read_series("twin"),
        supply,
        bundle.read_series("state") if bundle.has("state") else None,
        bundle.manifest["warnings"],
    )
    return _comparison(bundle, kept)


def recall_damaged(bundle: Bundle) -> Comparison:
    """Return what is left of a run that was cut off or damaged, marked as such.

    A series that cannot be read is shown as nothing; the warnings name the file.
    """
    wrong = _wrong(bundle)
    real, twin = (_series(bundle, kind, wrong) for kind in ("track", "twin"))
    supply, state = (_series(bundle, kind, wrong) for kind in ("supply", "state"))
    warnings = [*dict.fromkeys(wrong), *bundle.manifest.get("warnings", ())]
    mark = _mark(bundle, wrong)
    kept = _Kept(real or _NOTHING, twin or _NOTHING, supply, state, warnings, mark)
    return _comparison(bundle, kept)


def recall_whatever(bundle: Bundle) -> Comparison:
    """Return a run as `recall` does where it is whole, else what is left of it, marked."""
    finished = bundle.manifest["status"] == "complete" and bundle.is_closed()
    whole = finished and not _wrong(bundle)
    return recall(bundle) if whole else recall_damaged(bundle)


def runs_named(words: Sequence[Path], root: Path) -> list[Bundle]:
    """Return bundles by path or name, those in a folder, or those of an experiment.

    A protocol, by its file's name, stands for the newest experiment that carried it out; so does
    the id of an experiment for its runs.

    Raises:
        InputError: when a word is none of these.
    """
    found: list[Bundle] = []
    for word in words:
        if word.is_dir() or (root / word).is_dir():
            found += _of_folder(word, root)
        else:
            found += _of_experiment(word, root)
    return found


def _of_folder(word: Path, root: Path) -> list[Bundle]:
    """Return the bundles of a folder; one whose manifest is damaged with what can be read of it."""
    try:
        return Bundle.find_all([word], root)
    except InputError:
        folder = find_folder(word, root)
        verify(folder)  # raises where it is no bundle at all
        return [Bundle.recover(folder)[0]]


def _of_experiment(word: Path, root: Path) -> list[Bundle]:
    """Return the runs of an experiment in the order in which they were begun."""
    every = [b for b in _readable(root) if "experiment" in b.manifest]
    ids = {bundle.manifest["experiment"] for bundle in every}
    protocols = {b.manifest["experiment"]: Path(b.manifest["protocol"]).stem for b in every}
    chosen = max((one for one in ids if word.stem == protocols[one]), default=word.name)
    runs = [bundle for bundle in every if bundle.manifest["experiment"] == chosen]
    if runs:
        return runs
    known = sorted(set(protocols.values()))
    there = f"; there are the protocols {', '.join(known)}" if known else ""
    raise InputError(
        f"{word}: no run, folder of runs, protocol or experiment of that name in {root}"
        f"{did_you_mean(word.stem, known) or there}; `workbench runs list` shows all runs"
    )


def _readable(root: Path) -> Iterator[Bundle]:
    """Yield the bundles of a folder by name; one whose manifest is damaged belongs to nothing."""
    for folder in sorted(root.iterdir()) if root.is_dir() else ():
        with suppress(InputError, NotADirectoryError):
            yield Bundle.open(folder)


def _wrong(bundle: Bundle) -> list[str]:
    """Return what is wrong with the files of a finished run; its views are made anew anyway."""
    views = tuple(bundle.view(kind).name for kind in ("recording", "report"))
    problems = verify(bundle.path) if bundle.is_closed() else []
    return [problem for problem in problems if not problem.startswith(views)]


def _series(bundle: Bundle, kind: Series, wrong: list[str]) -> TimeSeries | None:
    """Return a series that is there and whole; of another one the reason is added to `wrong`."""
    if not bundle.has(kind):
        return None
    try:
        return bundle.read_series(kind)
    except InputError as error:
        wrong.append(str(error))
        return None


def _mark(bundle: Bundle, wrong: Sequence[str]) -> str:
    """Return in words why a run is not to be taken for a whole one."""
    status, error = bundle.manifest["status"], bundle.manifest.get("error")
    reason = f": {str(error).splitlines()[0]}" if error else ""
    if status == "complete" and wrong:
        return f"DAMAGED, {len(wrong)} of its files are not as they were written"
    if not bundle.is_closed():
        return "ABORTED, the program was killed or the computer stopped"
    return f"{'INTERRUPTED' if status == 'interrupted' else 'ABORTED'} ({status}){reason}"


def _comparison(bundle: Bundle, kept: _Kept) -> Comparison:
    """Put series and manifest together; what a run that was cut off lacks is NaN or empty."""
    facts = bundle.manifest
    model, shape = _robot(bundle)
    values, release = model.values(), facts.get("release") or {}
    begin = float(kept.real.times[0]) if len(kept.real) else -(facts.get("rest_s") or 0.0)
    command = facts.get("command") or _sent(bundle)
    return Comparison(
        title=facts["title"],
        run=facts["id"],
        mode=facts["mode"],
        real=kept.real,
        twin=kept.twin,
        duration_s=command["duration_s"],
        phases=_phases(bundle, begin, command),
        floor_m=-release.get("height_m", 0.0),
        figure=_figure(values, shape),
        real_summary=_summary(facts, "real"),
        twin_summary=_summary(facts, "twin"),
        misfit=Misfit(*(facts.get(f"error{part}_mm", _NAN) for part in ("_foot", "_top", ""))),
        supply=None if kept.supply is None else kept.supply.shifted(-_zero(bundle)),
        facts=_table(bundle, model, shape),
        log=_log(bundle),
        warnings=tuple(kept.warnings),
        noise=_noise(facts),
        label=_label(facts, shape),
        protocol=_protocol(bundle),
        mark=kept.mark,
        estimate=kept.state,
        predictions=_predictions(facts),
    )


def _predictions(facts: dict[str, Any]) -> tuple[Predicted, ...]:
    """Return the errors of predictions from the estimated state, of those that were made."""
    errors = facts.get("prediction_mm") or {}
    told = [Predicted(float(ahead), mm) for ahead, mm in errors.items() if mm is not None]
    driven = facts.get("measured_input_mm")
    return (*told, *([Predicted(math.inf, driven)] if driven is not None else ()))


def _robot(bundle: Bundle) -> tuple[ModelFile, ShapeFile]:
    """Return model and shape; where one cannot be read, the thesis' stands for the drawing."""
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


def _summary(facts: dict[str, Any], who: str) -> Summary | RingDown:
    kind = Summary if facts["mode"] in DRIVEN else RingDown
    told = facts.get(who) or {}
    return kind(**{name: told.get(name, _NAN) for name in kind.__dataclass_fields__})


def _label(facts: dict[str, Any], shape: ShapeFile) -> tuple[str, ...]:
    """Return what tells a run from the others of its protocol: condition, beam, repeat."""
    speed, pull, height = (facts.get(key) for key in ("speed_rad_s", "pull_N", "height_m"))
    return (
        str(facts["mode"]),
        *([f"{speed:.3g} rad/s"] if speed is not None else ()),
        *([f"{pull:g} N"] if pull is not None else ()),
        *([f"{1000 * height:g} mm"] if height is not None else ()),
        shape.name,
        *([f"repeat {facts['repeat']}"] if "repeat" in facts else ()),
    )


def _noise(facts: dict[str, Any]) -> dict[str, float]:
    """Return each channel's noise at rest, SI; its white part where there was too little rest."""
    told: dict[str, float] = {}
    for unit, scale in (("mm", 1e-3), ("rad", 1.0)):
        for name, parts in facts.get(f"noise_{unit}", {}).items():
            sigma = parts["rest"] if parts["rest"] is not None else parts["white"]
            if sigma is not None:
                told[name] = scale * sigma
    return told


def _events(bundle: Bundle) -> Iterable[dict[str, Any]]:
    """Yield the journal on the cameras' clock; what came before them stands at their start."""
    events = [e for e in bundle.read_journal() if {"event", "time_s"} <= e.keys()]
    started = next((k for k, e in enumerate(events) if e.get("event") == "cameras"), 0)
    for k, event in enumerate(events):
        yield event if k >= started else event | {"time_s": 0.0, "asked_s": 0.0}


def _zero(bundle: Bundle) -> float:
    """Return time zero on the clock of the cameras: where the output came on, else the release."""
    sent = bundle.manifest.get("sent")
    if sent is not None:
        return float(sent[0][0])
    on = (event["time_s"] for event in _events(bundle) if event["event"] == "output_on")
    return float(next(on, bundle.manifest.get("track", {}).get("zero_in_take_s", 0.0)))


def _sent(bundle: Bundle) -> dict[str, Any]:
    """Return what the journal tells of the command of a run that was cut off; speeds are asked."""
    zero, speed = _zero(bundle), bundle.manifest.get("speed_rad_s") or 0.0
    events = list(_events(bundle))
    times = [e["time_s"] - zero for e in events if e["event"] in ("output_on", "voltage")]
    last = max((e["time_s"] - zero for e in events), default=0.0)
    steps = [(time, speed) for time in times] + ([(last, 0.0)] if times else [])
    return {"steps": steps, "duration_s": max(last, 0.0)}


def _phases(bundle: Bundle, begin: float, command: dict[str, Any]) -> tuple[Phase, ...]:
    zero = _zero(bundle)
    prompts = [
        (event["asked_s"] - zero, event["time_s"] - zero)
        for event in _events(bundle)
        if event["event"] == "prompt" and "asked_s" in event
    ]
    bar = phases(bundle.manifest["mode"], begin, command["steps"], command["duration_s"])
    return with_prompts(bar, prompts)


def _log(bundle: Bundle) -> tuple[tuple[float, str], ...]:
    zero = _zero(bundle)
    told = (event for event in _events(bundle) if event["event"] != "reading")
    return tuple((event["time_s"] - zero, sentence(event)) for event in told)


def _protocol(bundle: Bundle) -> str:
    """Return the protocol, or the sheet, as it was given; empty where neither is there."""
    files = (bundle.document("protocol"), bundle.document("sheet"))
    return next(
        (file.read_text(encoding="utf-8", errors="replace") for file in files if file.exists()), ""
    )


def _table(bundle: Bundle, model: ModelFile, shape: ShapeFile) -> dict[str, str]:
    """Return the rows of the report that say what the run was made with."""
    facts, track = bundle.manifest, bundle.manifest.get("track", {})
    told = {
        "condition": condition(facts),
        "role": facts["role"],
        "model": f"{model.name} ({_digest(bundle.document('model'))})",
        "shape": f"{shape.name}, angles of the {shape.state} beam",
        "take": _take(bundle),
        "cleaning": track.get("recipe", "never tracked"),
    }
    if "start_angle_rad" in track:
        angle = np.degrees(track["start_angle_rad"])
        told["rotor at rest"] = f"{angle:.1f} deg from forward, towards down"
    told |= {
        name: f"{answer['value']} {answer['unit'] or ''}".rstrip()
        for name, answer in facts.get("answers", {}).items()
    }
    return told | {
        "supply": " ".join(str(v) for v in facts.get("supply", {}).values()) or "not recorded",
        "output at the end": bundle.output_off or "not driven by the workbench",
        **(
            {"estimated pose": facts["state"]}
            if facts.get("state", "estimated") != "estimated"
            else {}
        ),
        "versions": ", ".join(f"{k} {v}" for k, v in facts.get("versions", {}).items()),
    }


def _digest(path: Path) -> str:
    return sha256(path)[:12] if path.exists() else "lost"


def _take(bundle: Bundle) -> str:
    if not bundle.has_take():
        return "none"
    take = bundle.take()
    return f"{take.name} ({sha256(take)[:12]})"
