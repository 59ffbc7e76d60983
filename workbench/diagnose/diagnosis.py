"""The whole diagnosis: runs of a rig in, an answer with its proof out."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from workbench.diagnose.answer import LEAST_SIZE, Answer, decide
from workbench.diagnose.confidence import confidence
from workbench.diagnose.hypotheses import Refits, refit_all
from workbench.diagnose.intervals import spread
from workbench.diagnose.judging import Hypothesis
from workbench.diagnose.layout import Layout
from workbench.diagnose.noise import Noise, noise_of
from workbench.diagnose.one_run import with_carriers
from workbench.diagnose.problem import Problem
from workbench.diagnose.proof import MOST, Errors, Proof, errors_of
from workbench.diagnose.rig import Effects, Rig
from workbench.diagnose.soundness import Soundness, soundness, told, with_faults
from workbench.diagnose.wording import Amount, digits
from workbench.progress import Progress

__all__ = ["Diagnosis", "Found", "diagnose"]

_SURE = ("NAMED", "DATA_FAULT")
_WINDOWED = "hops told it in short windows that begin while the foot stands, not from rest"


@dataclass(frozen=True)
class Found(Amount):
    """One quantity of a cause, SI, with its 90 % interval and its standard error."""

    error: float

    def as_json(self) -> dict[str, Any]:
        """Return value, interval and unit."""
        return {"value": self.value, "interval90": [self.low, self.high], "unit": self.unit}


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """What is wrong with a model, why, how surely, and what the extension gains.

    Args:
        rig: with its runs.
        layout: of its unknowns.
        noise: by run.
        answer: of the engine.
        refits: behind it.
        quantities: cause -> quantity -> what was found.
        held_out: names of the runs that judged.
        errors: of the base on those.
        proof: of the extension, where there is one.
        extended: its rig, as read back from the file.
        seconds: that it took.
        seed: of its draws.
        sound: which runs were trusted.
        shortened: runs that were compared only for as long as the base follows them, and for how
            long [s].
    """

    rig: Rig
    layout: Layout
    noise: Sequence[Noise]
    answer: Answer
    refits: Refits
    quantities: Mapping[str, Mapping[str, Found]]
    held_out: tuple[str, ...]
    errors: Errors
    proof: Proof | None
    extended: Rig | None
    seconds: float
    seed: int
    sound: Soundness
    shortened: tuple[tuple[str, float], ...]

    @property
    def removed(self) -> float:
        """Return the share of the removable error that the extension removes."""
        return 0.0 if self.proof is None else self.proof.removed

    @property
    def adequate(self) -> bool | None:
        """Tell whether the causes make up for most of the misfit; None where there is none.

        Causes whose extension runs held out refuse do not.
        """
        if not self.answer.causes:
            return None
        return self.proof is not None and self.proof.adequate

    @property
    def worst_held_out(self) -> str:
        """Return the name of the run held out that the base misses most."""
        return max(self.held_out, key=lambda name: self.errors.by_run[name])

    def confidence(self, cause: str) -> float:
        """Return how often a cause of an answer like this one was a true one, 0 to 1."""
        return confidence(self.answer.kind, self.answer.weights.get(cause, 0.0))

    @property
    def in_part(self) -> str | None:
        """Return in words which runs were compared in part; None where all were compared whole."""
        if not self.shortened:
            return None
        ends = ", ".join(f"{run} for {digits(end)} s" for run, end in self.shortened)
        return f"compared only for as long as the base follows them: {ends}"

    def sentence(self, cause: str) -> str:
        """Return a cause in words, with its numbers."""
        return self.layout.causes[cause].sentence.format_map(self.quantities.get(cause, {}))

    def as_json(self) -> dict[str, Any]:
        """Return what the command line prints."""
        answer = self.answer
        extended = self.errors.rmse if self.proof is None else self.proof.extended.rmse
        return {
            "answer": answer.kind,
            "reason": answer.reason,
            "faults": told(self.sound.evidence),
            "shortened": [{"run": run, "seconds": end} for run, end in self.shortened],
            "causes": [
                {
                    "effect": name,
                    "confidence": round(self.confidence(name), 3),
                    "weight": round(answer.weights.get(name, 0.0), 4),
                    "sentence": self.sentence(name),
                    "parameters": {
                        key: one.as_json() for key, one in self.quantities.get(name, {}).items()
                    },
                }
                for name in answer.causes
            ],
            "rivals": [{"effect": r.name, "why_not": r.why_not} for r in answer.rivals],
            "rmse_mm": {
                "noise_floor": self.errors.noise_floor,
                "base": self.errors.rmse,
                "extended": extended,
            },
            "removable_removed": self.removed,
            "adequate": self.adequate,
            "held_out_runs": list(self.held_out),
            "extended_model": None if self.extended is None else str(self.extended.source),
            "next_protocol": None,
            "seconds": self.seconds,
        }


def diagnose(
    rig: Rig, out: Path, name: str = "diagnosis", tell: Progress = lambda text: None, seed: int = 0
) -> Diagnosis:
    """Find what a rig's model gets wrong.

    Args:
        rig: with runs to fit and runs held out.
        out: folder that the extended model is written into.
        name: of the diagnosis.
        tell: is told each stage.
        seed: of the draws; the same seed gives the same answer.

    Raises:
        InputError: when there are too few runs to fit, none to judge by, or a channel in none.
        DataFault: when so many runs are at fault that the others cannot be judged.
    """
    begin = time.perf_counter()
    tell("look for faults in the runs")
    sound = soundness(rig)
    held = sound.held_out
    layout, noise = Layout(rig), noise_of(rig.runs, (*sound.train, *held))
    refits = refit_all(Problem(rig, layout, noise, sound.train), tell, seed)
    errors, answer = _judged(refits, held, tell)
    if answer.kind not in _SURE:
        found = _in_windows(refits, held, tell, seed)
        refits, errors, answer = found or (refits, errors, answer)
    whole, rig = rig, refits.problem.rig
    answer = with_faults(answer, sound)
    quantities = _quantities(layout, refits, answer)
    proof, extended = None, None
    if answer.causes:
        values = _base_values(layout, answer.best)
        effects = _effects(layout, answer.best, refits.doubt)
        out.mkdir(parents=True, exist_ok=True)
        extended = rig.extend(out / f"{name}-model", values, effects, name)
        proof = Proof(errors, errors_of(extended, noise, held))
        if proof.harms:
            extended.source.unlink()
            answer, extended, proof = _refuted(answer, proof), None, None
        elif not proof.adequate:
            answer = _in_part(answer, proof)
    names = tuple(rig.runs[k].name for k in held)
    return Diagnosis(
        rig, layout, noise, answer, refits, quantities, names, errors, proof, extended,
        time.perf_counter() - begin, seed, sound, _shortened(whole, rig),
    )  # fmt: skip


def _judged(refits: Refits, held: Sequence[int], tell: Progress) -> tuple[Errors, Answer]:
    """Return what the base errs by on the runs held out, and the answer."""
    problem = refits.problem
    tell("judge by the runs held out")
    errors = errors_of(problem.rig, problem.noise, held, refits.base.fit.z)

    def shown(one: Hypothesis) -> bool:
        return _shown(refits, held, errors, one)

    def adding(one: Hypothesis, pairs: Sequence[Hypothesis]) -> list[Hypothesis]:
        return _adding(refits, held, one, pairs)

    answer = decide(refits, problem.layout, shown, adding)
    return errors, with_carriers(answer, refits, problem)


def _shown(refits: Refits, held: Sequence[int], errors: Errors, one: Hypothesis) -> bool:
    """Tell whether what a hypothesis explains is of practical size in runs held out."""
    extended = errors_of(refits.problem.rig, refits.problem.noise, held, one.fit.z)
    return Proof(errors, extended).size > LEAST_SIZE


def _adding(
    refits: Refits, held: Sequence[int], one: Hypothesis, pairs: Sequence[Hypothesis]
) -> list[Hypothesis]:
    """Return the pairs that make up for most of what one cause leaves of the runs held out.

    What they explain must be of practical size, and no run held out may speak against it.
    """
    rig, noise = refits.problem.rig, refits.problem.noise
    before, added = errors_of(rig, noise, held, one.fit.z), []
    for pair in pairs:
        after = errors_of(rig, noise, held, pair.fit.z)
        proof = Proof(before, after)
        worse = any(after.by_run[name] > before.by_run[name] for name in before.by_run)
        if proof.removed >= MOST and proof.size > LEAST_SIZE and not worse:
            added.append(pair)
    return added


def _in_windows(
    refits: Refits, held: Sequence[int], tell: Progress, seed: int
) -> tuple[Refits, Errors, Answer] | None:
    """Return what hops tell in windows where they name a cause; None where they do not.

    How a window begins is free, which hides some of what a model gets wrong. So a name must show in
    runs held out, which are compared from rest.
    """
    problem = refits.problem.in_windows(refits.base.fit.z)
    if problem is None:
        return None
    tell("compare hops in windows as well")
    again = refit_all(problem, tell, seed, refits)
    errors, answer = _judged(again, held, tell)
    if answer.kind not in _SURE or not _shown(again, held, errors, answer.best):
        return None
    return again, errors, replace(answer, reason=f"{answer.reason}; {_WINDOWED}")


def _shortened(whole: Rig, rig: Rig) -> tuple[tuple[str, float], ...]:
    """Return which runs were compared for a part of what they could be, and for how long [s]."""
    pairs = zip(whole.runs, rig.runs, strict=True)
    cut = [short for run, short in pairs if len(short.times) < len(run.times)]
    return tuple((run.name, float(run.times[-1])) for run in cut)


def _refuted(answer: Answer, proof: Proof) -> Answer:
    """Return an answer that names no cause for sure: runs held out speak against its extension."""
    unit, base = proof.base.unit, digits(proof.base.rmse)
    reason = (
        f"{answer.reason}; but on runs held out the extension errs by "
        f"{digits(proof.extended.rmse)} {unit} where the base errs by {base} {unit}, so no model "
        "is written"
    )
    kind = "SET" if answer.kind == "NAMED" else answer.kind
    return replace(answer, kind=kind, reason=reason)


def _in_part(answer: Answer, proof: Proof) -> Answer:
    """Return an answer that tells that its causes are not all that is wrong."""
    unit = proof.base.unit
    reason = (
        f"{answer.reason}; but on runs held out the extension still errs by "
        f"{digits(proof.extended.rmse)} of {digits(proof.base.rmse)} {unit}, where noise makes "
        f"{digits(proof.base.noise_floor)} {unit}, so something else is wrong as well, or instead"
    )
    return replace(answer, reason=reason)


def _quantities(layout: Layout, refits: Refits, answer: Answer) -> dict[str, dict[str, Found]]:
    """Return the quantities of each cause in the best hypothesis that has it."""
    found: dict[str, dict[str, Found]] = {}
    same = refits.with_as_many(len(answer.best.causes))
    for cause in answer.causes:
        holder = next(one for one in same if cause in one.causes)
        found[cause] = _found(layout, holder, cause, refits.doubt)
    return found


def _found(layout: Layout, holder: Hypothesis, cause: str, doubt: float) -> dict[str, Found]:
    found, told = {}, spread(holder, cause, doubt)
    for i, deviation, wide in zip(layout.of_cause[cause], *told, strict=True):
        unknown = layout.unknowns[i]
        value, wide = layout.value(int(i), float(holder.fit.z[i])), float(wide) * unknown.tolerance
        low, high = max(value - wide, unknown.low), min(value + wide, unknown.high)
        error = float(deviation) * unknown.tolerance
        found[unknown.name.split(".", 1)[1]] = Found(value, low, high, unknown.unit, error)
    return found


def _effects(layout: Layout, best: Hypothesis, doubt: float) -> Effects:
    found = {cause: _found(layout, best, cause, doubt) for cause in best.causes}
    return {
        cause: {key: (one.value, one.error) for key, one in named.items()}
        for cause, named in found.items()
    }


def _base_values(layout: Layout, best: Hypothesis) -> dict[str, float]:
    return {
        layout.unknowns[i].name: layout.value(int(i), float(best.fit.z[i])) for i in layout.base
    }
