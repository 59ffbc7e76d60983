"""The whole diagnosis: runs of a rig in, an answer with its validation out.

1. Runs that are not what they are said to be are left out (`soundness`).
2. The base is fitted within its tolerances, and the process noise that it asks for says whether a
   force is missing (`fits`).
3. One Jacobian of all candidates says what each promises; those that promise most are fitted, then
   a second beside the best (`screening`, `fits`): runs whose foot is held first, then hops
   (`observer_parts`). The drive is judged by the rotor's angle (`drive`).
4. The runs' seconds decide (`decide`), for held runs, hops and drive each by itself.
5. The model is written, read back and judged on runs held out (`validate`).
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from collections.abc import Set as AbstractSet
from dataclasses import asdict, dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from workbench.data_quality import soundness
from workbench.diagnose.confidence import Confidence, confidence_in
from workbench.diagnose.decide import Kind, Part, versus
from workbench.diagnose.drive_part import DrivePart, drive_part
from workbench.diagnose.findings import Alternative, Cause
from workbench.diagnose.fits import Fits
from workbench.diagnose.hypothesis import noise_of
from workbench.diagnose.observer_parts import ObserverParts, observer_parts
from workbench.diagnose.rig import HopperRig, Rig
from workbench.diagnose.rules import Rules
from workbench.diagnose.validate import Errors, removed
from workbench.diagnose.wording import digits, together
from workbench.errors import InputError
from workbench.progress import Progress, Stage

__all__ = ["Diagnosis", "both", "diagnose"]


@dataclass(frozen=True, eq=False, repr=False)
class Diagnosis:
    """What is wrong with a model, why, how surely, and what the extension gains.

    Args:
        rig: with its runs.
        kind: of the answer.
        causes: named, or all of a set.
        reason: in a sentence.
        alternatives: what was not taken.
        observer: what the observer says, with all hypotheses.
        drive: what the rotor's angle says of the drive; None where nothing is driven.
        held_out: names of the runs that judged.
        errors: of the refitted base on those.
        extended_errors: of the model that was written; those of the base where it is that.
        extended: rig as read back from the file that was written; None where none was.
        faults: (run, evidence) of runs that were left out.
        rules: that decided.
        seconds: that it took.
    """

    rig: Rig
    kind: Kind
    causes: tuple[Cause, ...]
    reason: str
    alternatives: tuple[Alternative, ...]
    observer: ObserverParts
    drive: DrivePart | None
    held_out: tuple[str, ...]
    errors: Errors | None
    extended_errors: Errors | None
    extended: Rig | None
    faults: tuple[tuple[str, str], ...]
    rules: Rules
    seconds: float

    def __repr__(self) -> str:
        """Return the answer and its causes, a line each."""
        return "\n  ".join([f"{self.kind}: {self.reason}", *(one.sentence for one in self.causes)])

    def as_json(self) -> dict[str, Any]:
        """Return what the command line prints."""
        base, after, sure = self.errors, self.extended_errors, self.confidence
        observers = self.observer.parts.values()
        return {
            "answer": self.kind,
            "reason": self.reason,
            "confidence": None if sure is None else sure.as_json(),
            "faults": [{"run": run, "evidence": text} for run, text in self.faults],
            "causes": [
                {
                    "effect": one.name,
                    "confidence": None if sure is None else round(sure.share, 3),
                    "sentence": one.sentence,
                    "parameters": {key: q.as_json() for key, q in one.quantities.items()},
                }
                for one in self.causes
            ],
            "rivals": [{"effect": one.name, "why_not": one.why_not} for one in self.alternatives],
            "explained": {name: part.explained for name, part in self.parts.items()},
            "missing": {name: part.missing for name, part in self.parts.items()},
            "process_noise": {
                "base": noise_of(one.base for one in observers),
                "best": noise_of(one.compared for one in observers),
            },
            "refit": {one.name: one.as_json() for one in self.observer.refit},
            "rmse_mm": {
                "noise_floor": None if base is None else base.noise_floor,
                "base": None if base is None else base.rmse,
                "extended": None if after is None else after.rmse,
            },
            "prediction_mm": {
                "base": None if base is None else dict(base.ahead),
                "extended": None if after is None else dict(after.ahead),
            },
            "errors_by_run": self._errors_by_run(),
            "drive_compared": bool("drive" in self.parts and self.parts["drive"].best.names),
            "removable_removed": self.removed,
            "held_out_runs": list(self.held_out),
            "extended_model": None if self.extended is None else str(self.extended.source),
            "next_protocol": None,
            "rules": asdict(self.rules),
            "seconds": self.seconds,
        }

    @cached_property
    def parts(self) -> dict[str, Part]:
        """Return what observer and drive say, each by itself, by name."""
        return _parts(self.observer, self.drive)

    @property
    def confidence(self) -> Confidence | None:
        """Return how often such an answer is right; None for a rig that none was learnt on."""
        return confidence_in(self.kind) if isinstance(self.rig, HopperRig) else None

    def _errors_by_run(self) -> dict[str, Any]:
        """Return of each run held out what `rmse_mm` and `prediction_mm` are the means of."""
        base, after = self.errors, self.extended_errors
        if base is None or after is None:
            return {}
        both = {"base": base, "extended": after}
        return {
            run: {"noise_floor": base.noise[run]} | {
                who: {"rmse": one.by_run[run], "ahead": dict(one.predicted.get(run, {}))}
                for who, one in both.items()
            }
            for run in self.held_out
        }  # fmt: skip

    @property
    def worst_held_out(self) -> str:
        """Return the name of the run held out that the base misses most."""
        by_run = {} if self.errors is None else self.errors.by_run
        return max(self.held_out, key=lambda name: by_run.get(name, 0.0))

    @property
    def removed(self) -> float | None:
        """Return the share of the removable error that the extension removes, if it was judged."""
        if self.errors is None or self.extended_errors is None:
            return None
        return removed(self.errors, self.extended_errors)


def diagnose(
    rig: Rig,
    out: Path,
    name: str = "diagnosis",
    progress: Progress = lambda text: None,
    rules: Rules | None = None,
    threads: int = 0,
) -> Diagnosis:
    """Find what a rig's model gets wrong.

    Args:
        rig: with runs to fit and runs held out.
        out: folder that the model is written into.
        name: of the diagnosis.
        progress: called at each stage.
        rules: that decide; None takes those of the rig.
        threads: of the simulation; 0 takes all cores.

    Raises:
        InputError: when there are too few runs to fit, none to judge by, or a channel in none; or
            when the model's file exists.
        DataFault: when so many runs are at fault that the others cannot be judged.
    """
    begin, rules = time.perf_counter(), rules or rig.rules
    for taken in out.glob(f"{name}-model.*"):  # known before minutes of work, not after
        raise InputError(f"{taken}: exists; a model is never changed, give another --out")
    progress(Stage("look for faults in the runs", 0.0))
    sound = soundness(rig)
    observer = observer_parts(
        Fits(rig, rules, progress, threads, {one.run for one in sound.faults})
    )
    fits, base, best = observer.fits, observer.base, observer.best
    rig = fits.rig
    drive = drive_part(fits, best)
    parts = _parts(observer, drive)
    kind, reason = _together(parts)
    causes = [*observer.causes, *(() if drive is None else drive.causes)]
    groups = {fits.candidates[one.name].group for one in observer.causes}
    if causes and groups == {"sensor"} and kind == "NAMED" and len(causes) == len(observer.causes):
        kind = "DATA_FAULT"
    if sound.faults:
        kind, reason = "DATA_FAULT", sound.before(kind, reason)
    progress(Stage("write the model and judge it by the runs held out", 0.9))
    effects = {
        one.name: {key: (q.value, q.error) for key, q in one.quantities.items()}
        for one in causes
        if one.name in _taken(parts) and one.quantities and not fits.candidates.frees(one.name)
    }
    values = {p.name: best.values[p.name] for p in rig.base}
    out.mkdir(parents=True, exist_ok=True)
    extended = rig.extend(out / f"{name}-model", values, effects, name)
    # as the rotor was seen to turn, unless it is the drive that an extension changes
    turned = drive is not None and bool(drive.part.best.names)
    angles = drive.angles if drive is not None and turned else (None, None)
    before = {p.name: base.values[p.name] for p in rig.base}
    errors = rig.errors(fits.held, before, angles[0], threads)
    if kind == "CLEAN" and errors is not None and errors.rmse > rig.whole * errors.noise_floor:
        times = digits(errors.rmse / errors.noise_floor)
        kind = "NONE"
        reason = f"simulated freely, the runs held out are {times} times their noise off"
        reason += ", and no known cause explains it"
    return Diagnosis(
        rig, kind, tuple(causes), reason, _alternatives(fits, parts), observer, drive,
        tuple(rig.names[k] for k in fits.held),
        errors,
        extended.errors(fits.held, None, angles[1], threads),
        extended, sound.evidence, rules, time.perf_counter() - begin,
    )  # fmt: skip


def _parts(observer: ObserverParts, drive: DrivePart | None) -> dict[str, Part]:
    """Return the parts of an answer by their names."""
    parts = {name: one.part for name, one in observer.parts.items()}
    return parts if drive is None else parts | {"drive": drive.part}


def _taken(parts: Mapping[str, Part]) -> set[str]:
    """Return the names of the causes that the model which is written has."""
    return {name for part in parts.values() for name in part.best.names}


def both(kinds: AbstractSet[Kind]) -> Kind:
    """Return one answer of what held runs, hops and drive say each by itself.

    Where one of them has something left, the answer is partial, however sure the other is.
    """
    if kinds & {"PARTIAL", "NONE"}:
        return "PARTIAL" if kinds - {"NONE", "CLEAN"} else "NONE"
    if "SET" in kinds:
        return "SET"
    return "NAMED" if "NAMED" in kinds else "CLEAN"


def _together(parts: Mapping[str, Part]) -> tuple[Kind, str]:
    """Return one answer of what held runs, hops and drive say each by itself."""
    kind, saying = both({part.kind for part in parts.values()}), dict[str, list[str]]()
    for name, part in parts.items():
        saying.setdefault(part.reason, []).append(name)
    if len(parts) == 1:
        return kind, next(iter(saying))
    names = {
        reason: " and ".join([*([", ".join(first)] if first else []), last])
        for reason, (*first, last) in saying.items()
    }
    return kind, "; ".join(f"{names[reason]}: {reason}" for reason in saying)


def _alternatives(fits: Fits, parts: Mapping[str, Part]) -> tuple[Alternative, ...]:
    """Return what was fitted and not taken, and why."""
    found = []
    for part in parts.values():
        listed = {name for one in part.alike for name in one.names}
        for one, gained in part.compared:
            name = together(one.names)
            if len(one.names) > 1 or name in listed:
                continue
            against = "the base" if part.best.names == () else together(part.best.names)
            behind = versus(part.best, one)
            why = (
                f"its log-likelihood is {digits(behind.gain + behind.held)} below that of {against}"
                if part.best.names
                else f"gain {digits(gained.gain)} in the runs fitted and {digits(gained.held)} in "
                "those held out: no more than chance, or of no practical size"
            )
            found.append(Alternative(name, why))
    return tuple(found)
