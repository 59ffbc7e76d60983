"""The whole diagnosis: runs of a rig in, an answer with its proof out.

1. Runs that are not what they are said to be are left out (`soundness`).
2. The base is fitted within its tolerances, and the process noise that it asks for tells whether a
   force is missing (`fits`).
3. One Jacobian of all candidates says what each promises; those that promise most are fitted, then
   a second beside the best (`linear`, `fits`). The drive is judged by the rotor's angle (`drive`).
4. The runs' seconds decide (`decide`), for robot and drive each by itself.
5. The model is written, read back and judged on runs held out (`validate`).
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from workbench.diagnose.candidates import Candidate
from workbench.diagnose.decide import Kind, Part, Scored, decide, versus
from workbench.diagnose.drive import DRIVE, DriveFits
from workbench.diagnose.fits import Fits, Hypothesis, Promise
from workbench.diagnose.linear import Solved
from workbench.diagnose.rigs import Rig
from workbench.diagnose.rules import RULES, Rules
from workbench.diagnose.sound import soundness
from workbench.diagnose.validate import Errors, removed
from workbench.diagnose.wording import Amount, digits
from workbench.motion import ROTOR_ANGLE
from workbench.progress import Progress
from workbench.sim import EFFECTS

__all__ = ["Cause", "Diagnosis", "Found", "Refit", "Rival", "diagnose"]

Array = NDArray[np.float64]

_T90 = 1.645


@dataclass(frozen=True)
class Found(Amount):
    """One quantity of a cause, SI, with its 90 % interval and its standard error."""

    error: float

    def as_json(self) -> dict[str, Any]:
        """Return value, interval and unit."""
        return {"value": self.value, "interval90": [self.low, self.high], "unit": self.unit}


@dataclass(frozen=True)
class Cause:
    """A cause that an answer lists.

    Args:
        name: canonical.
        quantities: what was found of each.
        sentence: what a technician is told, with its numbers.
    """

    name: str
    quantities: Mapping[str, Found]
    sentence: str


@dataclass(frozen=True)
class Rival:
    """A candidate that was not taken, and why."""

    name: str
    why_not: str


@dataclass(frozen=True)
class Refit:
    """A number of the model as stated and as the fit has it, SI.

    Args:
        name: of the number.
        stated: before.
        now: after.
        low: of its 90 % interval.
        high: of its 90 % interval.
        unit: of all.
        share: of its tolerance by which it moved.
    """

    name: str
    stated: float
    now: float
    low: float
    high: float
    unit: str
    share: float

    def as_json(self) -> dict[str, Any]:
        """Return it as the command line prints it."""
        return {"stated": self.stated, "now": self.now, "interval90": [self.low, self.high],
                "unit": self.unit, "share_of_tolerance": self.share}  # fmt: skip


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """What is wrong with a model, why, how surely, and what the extension gains.

    Args:
        rig: with its runs.
        kind: of the answer.
        causes: named, or all of a set.
        reason: in a sentence.
        rivals: what was not taken.
        base: the base as fitted.
        best: the hypothesis of the observer that holds; the base where none does.
        tried: all that were fitted.
        promises: of each candidate, seen from the base.
        parts: what the observer says, and the drive, by name.
        refit: what the fit changed of the model's own numbers.
        held_out: names of the runs that judged.
        errors: of the refitted base on those.
        extended_errors: of the model that was written; those of the base where it is that.
        extended: rig as read back from the file that was written; None where none was.
        faults: (run, evidence) of runs that were left out.
        rules: that decided.
        seconds: that it took.
        fits: that can fit more.
    """

    rig: Rig
    kind: Kind
    causes: tuple[Cause, ...]
    reason: str
    rivals: tuple[Rival, ...]
    base: Hypothesis
    best: Hypothesis
    tried: tuple[Hypothesis, ...]
    promises: tuple[Promise, ...]
    parts: Mapping[str, Part]
    refit: tuple[Refit, ...]
    held_out: tuple[str, ...]
    errors: Errors | None
    extended_errors: Errors | None
    extended: Rig | None
    faults: tuple[tuple[str, str], ...]
    rules: Rules
    seconds: float
    fits: Fits

    def as_json(self) -> dict[str, Any]:
        """Return what the command line prints."""
        base, after = self.errors, self.extended_errors
        return {
            "answer": self.kind,
            "reason": self.reason,
            "faults": [{"run": run, "evidence": text} for run, text in self.faults],
            "causes": [
                {
                    "effect": one.name,
                    "sentence": one.sentence,
                    "parameters": {key: q.as_json() for key, q in one.quantities.items()},
                }
                for one in self.causes
            ],
            "rivals": [{"effect": one.name, "why_not": one.why_not} for one in self.rivals],
            "explained": {name: part.explained for name, part in self.parts.items()},
            "missing": {name: part.lack for name, part in self.parts.items()},
            "process_noise": {"base": dict(self.base.estimator.noise),
                              "best": dict(self.best.estimator.noise)},
            "refit": {one.name: one.as_json() for one in self.refit},
            "rmse_mm": {
                "noise_floor": None if base is None else base.noise_floor,
                "base": None if base is None else base.rmse,
                "extended": None if after is None else after.rmse,
            },
            "prediction_mm": {
                "base": None if base is None else dict(base.ahead),
                "extended": None if after is None else dict(after.ahead),
            },
            "removable_removed": self.removed,
            "held_out_runs": list(self.held_out),
            "extended_model": None if self.extended is None else str(self.extended.source),
            "next_protocol": None,
            "rules": asdict(self.rules),
            "seconds": self.seconds,
        }  # fmt: skip

    @property
    def removed(self) -> float | None:
        """Return the share of the removable error that the extension removes; None where unjudged."""
        if self.errors is None or self.extended_errors is None:
            return None
        return removed(self.errors, self.extended_errors)


def diagnose(
    rig: Rig,
    out: Path,
    name: str = "diagnosis",
    tell: Progress = lambda text: None,
    rules: Rules = RULES,
    threads: int = 0,
) -> Diagnosis:
    """Find what a rig's model gets wrong.

    Args:
        rig: with runs to fit and runs held out.
        out: folder that the model is written into.
        name: of the diagnosis.
        tell: is told each stage.
        rules: that decide.
        threads: of the simulation; 0 takes all cores.

    Raises:
        InputError: when there are too few runs to fit, none to judge by, or a channel in none.
        DataFault: when so many runs are at fault that the others cannot be judged.
    """
    begin = time.perf_counter()
    tell("look for faults in the runs")
    sound = soundness(rig)
    fits = Fits(rig, rules, tell, threads, {fault.run for fault in sound.faults})
    tell("fit the base within its tolerances")
    base = fits.base()
    observer = _observer(fits, base)
    tell("judge the drive by the rotor's angle")
    drive = _drive(fits, observer.best)
    parts = {"observer": observer.part}
    if drive is not None:
        parts["drive"] = drive.part
    kind, reason = _together(parts)
    causes = [*observer.causes, *(() if drive is None else drive.causes)]
    groups = {fits.candidates[one.name].group for one in observer.causes}
    if causes and groups == {"sensor"} and kind == "NAMED" and len(causes) == len(observer.causes):
        kind = "DATA_FAULT"
    if sound.faults:
        kind, reason = "DATA_FAULT", sound.before(kind, reason)
    tell("write the model and judge it by the runs held out")
    effects = {one.name: {key: (q.value, q.error) for key, q in one.quantities.items()}
               for one in causes if one.name in _taken(parts) and one.quantities
               and not fits.frees(one.name)}  # fmt: skip
    values = {p.name: observer.best.values[p.name] for p in rig.base}
    out.mkdir(parents=True, exist_ok=True)
    extended = rig.extend(out / f"{name}-model", values, effects, name)
    angles = (None, None) if drive is None else drive.angles
    before = {p.name: base.values[p.name] for p in rig.base}
    return Diagnosis(
        rig, kind, tuple(causes), reason, _rivals(fits, parts), base, observer.best,
        observer.tried, observer.promises, parts, observer.refit,
        tuple(rig.names[k] for k in fits.held),
        rig.errors(fits.held, before, angles[0], threads),
        extended.errors(fits.held, None, angles[1], threads),
        extended, sound.evidence, rules, time.perf_counter() - begin, fits,
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class _Judged:
    """What one kind of evidence gives."""

    part: Part
    causes: tuple[Cause, ...]


@dataclass(frozen=True, eq=False)
class _Observed(_Judged):
    best: Hypothesis
    tried: tuple[Hypothesis, ...]
    promises: tuple[Promise, ...]
    refit: tuple[Refit, ...]


@dataclass(frozen=True, eq=False)
class _Driven(_Judged):
    angles: tuple[list[Array | None], list[Array | None]]


def _observer(fits: Fits, base: Hypothesis) -> _Observed:
    """Return what the observer says of the candidates."""
    rules, tell = fits.rules, fits.tell
    tell("see what each candidate promises")
    promises = fits.promises(base)
    least = max(rules.promising * promises[0].gain, rules.suspected) if promises else np.inf
    short = [one for one in promises if one.gain >= least][: rules.shortlist]
    singles = []
    for one in short:
        tell(f"fit {one.name}")
        singles.append(fits.refit((one.name,), base, one))
    singles = _weighed(fits, base, singles)
    pairs: list[Hypothesis] = []
    near = promises
    if singles and base.cost - singles[0].cost > rules.worth:
        first = singles[0]
        tell(f"see what each candidate promises beside {first.names[0]}")
        near = fits.promises(first)
        added = [one for one in near if one.gain > rules.worth][: rules.seconds]
        for one in added:
            tell(f"fit {first.names[0]} with {one.name}")
            pairs.append(fits.refit((*first.names, one.name), first, one))
        pairs = _weighed(fits, first, pairs)
    tried = [*singles, *pairs]
    tell("judge by the runs held out")
    scored = {one.names: _scored(fits, one) for one in (base, *tried)}
    part = decide(
        scored[()], [scored[one.names] for one in tried], fits.samples(), rules, fits.repeats()
    )
    by_names = {one.names: one for one in (base, *tried)}
    best = by_names[part.best.names]
    causes: list[Cause] = []
    for alike in part.alike:
        holder = by_names[alike.names]
        for name in alike.names:
            if name not in {one.name for one in causes}:
                causes.append(_cause(fits.candidates[name], holder, fits))
    return _Observed(
        part, tuple(causes), best, tuple(tried), tuple(promises), _refit(fits, best)
    )


def _weighed(fits: Fits, base: Hypothesis, found: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Return hypotheses, best first; the process noise of those that lead is weighed anew."""
    if not found:
        return []
    gain = max(base.cost - one.cost for one in found)
    reach = max((1 - fits.rules.near) * gain, fits.rules.worth)
    weighed = [
        fits.weighed(one) if gain > fits.rules.worth and base.cost - one.cost > gain - reach else one
        for one in found
    ]  # fmt: skip
    return sorted(weighed, key=lambda one: one.cost)


def _scored(fits: Fits, one: Hypothesis) -> Scored:
    blocks = np.concatenate(one.blocks)
    return Scored(one.names, one.prior, blocks, fits.judged(one), fits.lack(one))


def _cause(candidate: Candidate, holder: Hypothesis, fits: Fits) -> Cause:
    """Return a candidate with what was found of its quantities, or of the numbers that it frees."""
    errors = fits.deviations(holder)
    values, quantities = holder.values, dict[str, Found]()
    for key, parameter in candidate.quantities.items():
        value, error = values[parameter.name], errors[parameter.name]
        quantities[key] = _found(value, error, parameter.low, parameter.high, parameter.unit)
    if candidate.frees:
        stated = {p.name: p.nominal for p in fits.rig.base}
        shares = [values[name] / stated[name] - 1 for name in candidate.frees]
        spreads = [errors[name] / stated[name] for name in candidate.frees]
        share, error = float(np.mean(shares)), float(np.mean(spreads))
        key, unit = candidate.freed
        scale = 1.0 if unit == "1" else stated[candidate.frees[0]]
        quantities[key] = _found(scale * share, scale * error, -np.inf, np.inf, unit)
    return Cause(candidate.name, quantities, candidate.sentence.format_map(quantities))


def _found(value: float, error: float, low: float, high: float, unit: str) -> Found:
    wide = _T90 * error
    return Found(value, max(value - wide, low), min(value + wide, high), unit, error)


def _refit(fits: Fits, best: Hypothesis) -> tuple[Refit, ...]:
    """Return what the fit changed of the model's own numbers."""
    errors, values = fits.deviations(best), best.values
    return tuple(
        Refit(p.name, p.nominal, values[p.name], values[p.name] - _T90 * errors[p.name],
              values[p.name] + _T90 * errors[p.name], p.unit,
              (values[p.name] - p.nominal) / p.deviation)
        for p in fits.rig.base
    )  # fmt: skip


def _drive(fits: Fits, best: Hypothesis) -> _Driven | None:
    """Return what the rotor's angle says of the drive; None where nothing is driven."""
    regressions = fits.drive(best)
    if regressions is None:
        return None
    fitted, held = regressions
    names = [name for name in DRIVE if name in fitted.quantities]
    every = [(), *((name,) for name in names), *combinations(names, 2)]
    solved = {one: fitted.solved(one) for one in every}
    samples = len(fitted.linear.residuals)

    def scored(names: tuple[str, ...]) -> Scored:
        found = solved[names]
        own = found.cost - float(found.blocks.sum())
        lack = float(np.sqrt(found.blocks.sum() / samples)) / fits.rules.whole
        judged = tuple(held.by_run(held.like(fitted, found))) if fits.held else ()
        return Scored(names, own, found.blocks, judged, lack)

    tried = [scored(one) for one in every if one]
    part = decide(scored(()), tried, samples, fits.rules, fits.repeats(ROTOR_ANGLE))
    causes: dict[str, Cause] = {}
    for alike in part.alike:
        for name in alike.names:
            found = fitted.values(solved[alike.names], name)
            effect = EFFECTS[name]
            quantities = {
                q.name: _found(*found[q.name], q.low, q.high, q.unit) for q in effect.quantities
            }
            causes.setdefault(
                name, Cause(name, quantities, effect.sentence.format_map(quantities))
            )
    angles = tuple(_angles(fits, fitted, held, solved[one]) for one in ((), part.best.names))
    return _Driven(part, tuple(causes.values()), (angles[0], angles[1]))


def _angles(
    fits: Fits, fitted: DriveFits, held: DriveFits, found: Solved
) -> list[Array | None]:
    """Return the rotor's angle of each run held out, as the drive is said to turn it."""
    judged = held.like(fitted, found)
    shared = [n for n, own in zip(fitted.linear.names, fitted.linear.own, strict=True) if not own]
    numbers = dict(zip(fitted.linear.names, found.x, strict=True))
    own = dict(zip(held.linear.names, judged.x, strict=True))
    whole = replace(judged, x=np.array([
        numbers[name] if name in shared else own[name] for name in held.linear.names
    ]))  # fmt: skip
    return [held.angle(whole, k) if k in held.runs else None for k in range(len(fits.held))]


def _taken(parts: Mapping[str, Part]) -> set[str]:
    """Return the names of the causes that the model which is written has."""
    return {name for part in parts.values() for name in part.best.names}


def _together(parts: Mapping[str, Part]) -> tuple[Kind, str]:
    """Return one answer of what robot and drive say each by itself."""
    kinds = {part.kind for part in parts.values()}
    reason = "; ".join(f"{name}: {part.reason}" for name, part in parts.items())
    order: tuple[Kind, ...] = ("SET", "PARTIAL")
    for kind in order:
        if kind in kinds:
            return kind, reason
    if "NAMED" in kinds:
        return ("PARTIAL" if "NONE" in kinds else "NAMED"), reason
    return ("NONE" if "NONE" in kinds else "CLEAN"), reason


def _rivals(fits: Fits, parts: Mapping[str, Part]) -> tuple[Rival, ...]:
    """Return what was fitted and not taken, and why."""
    found = []
    for part in parts.values():
        listed = {name for one in part.alike for name in one.names}
        for one, told in part.compared:
            if len(one.names) > 1 or one.names[0] in listed:
                continue
            against = "the base" if part.best.names == () else " with ".join(part.best.names)
            behind = versus(part.best, one, fits.repeats())
            why = (
                f"{against} makes the same seconds likelier by {digits(behind.gain + behind.held)}"
                if part.best.names
                else f"worth {digits(told.gain)} in the runs fitted and {digits(told.held)} in those "
                "held out: no more than chance, or of no practical size"
            )
            found.append(Rival(one.names[0], why))
    return tuple(found)
