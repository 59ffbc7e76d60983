"""Which runs a diagnosis may trust: what shows a fault before anything is fitted.

Checks that need nothing but samples stand here; what a kind of system knows of itself, the rig
tells (`Rig.faults`). A run at fault is left out, whatever else it may tell: a fit would explain it
with a cause. What all runs have alike is left to the engine, for that is what a cause looks like.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from workbench.diagnose.answer import Answer
from workbench.diagnose.rig import Fault, Observed, Rig
from workbench.errors import DataFault, InputError

__all__ = ["Soundness", "refused", "soundness", "told", "with_faults"]

_LEAST_TRAIN, _LEAST_HELD = 2, 1
_MOST_FAULTY = 1 / 3  # of all runs: a set with more faults is not believed elsewhere either
_LEAST_SEEN = 0.5  # of a channel's samples
_LEAST_SAMPLES = 60  # half a second


@dataclass(frozen=True)
class Soundness:
    """The runs that may be trusted, and why others may not.

    Args:
        train: indices of the sound runs to fit.
        held_out: of the sound runs to judge by.
        faults: of all others, in the order of the runs.
        evidence: the faults in words.
    """

    train: tuple[int, ...]
    held_out: tuple[int, ...]
    faults: tuple[Fault, ...]
    evidence: tuple[tuple[str, str], ...]


def soundness(rig: Rig) -> Soundness:
    """Return which runs are sound.

    Raises:
        InputError: too few runs to fit or to judge by, or a channel that was never seen.
        DataFault: too many runs at fault.
    """
    runs = rig.runs
    _require_roles(runs)
    _require_seen(runs)
    found = [*_unseen(runs), *_copies(runs), *rig.faults()]
    faults = tuple(sorted(found, key=lambda fault: fault.run))
    bad = {fault.run for fault in faults}
    train, held = (
        tuple(k for k, run in enumerate(runs) if run.role == role and k not in bad)
        for role in ("train", "held_out")
    )
    evidence = tuple((runs[fault.run].name, fault.evidence) for fault in faults)
    too_few = len(train) < _LEAST_TRAIN or len(held) < _LEAST_HELD
    if too_few or len(bad) > _MOST_FAULTY * len(runs):
        raise DataFault(_refusal(runs, bad, evidence, too_few), evidence)
    return Soundness(train, held, faults, evidence)


def with_faults(answer: Answer, sound: Soundness) -> Answer:
    """Return what sound runs say as the answer to all of them.

    With a run at fault it is DATA_FAULT: whoever wrote one line of a sheet wrongly may have written
    another, and what the others say stands in the reason, with their causes.
    """
    if not sound.faults:
        return answer
    left_out = "; ".join(f"{run} is left out: {text}" for run, text in sound.evidence)
    others = len(sound.train) + len(sound.held_out)
    reason = f"{left_out}. The other {others} runs alone answer {answer.kind}: {answer.reason}"
    return replace(answer, kind="DATA_FAULT", reason=reason)


def refused(fault: DataFault) -> dict[str, object]:
    """Return what the command line prints of runs of which too few are sound to fit anything."""
    return {
        "answer": "DATA_FAULT",
        "reason": str(fault),
        "faults": told(fault.evidence),
        "causes": [],
        "rivals": [],
        "rmse_mm": {"noise_floor": None, "base": None, "extended": None},
        "removable_removed": None,
        "adequate": None,
        "held_out_runs": [],
        "extended_model": None,
        "next_protocol": None,
        "seconds": None,
    }


def told(evidence: Sequence[tuple[str, str]]) -> list[dict[str, str]]:
    """Return the evidence of faults as the command line prints it."""
    return [{"run": run, "evidence": text} for run, text in evidence]


def _refusal(
    runs: Sequence[Observed], bad: set[int], evidence: Sequence[tuple[str, str]], too_few: bool
) -> str:
    others = len(runs) - len(bad)
    why = (
        f"the other {others} are too few to fit and to judge by"
        if too_few
        else f"so the other {others} are not believed either"
    )
    texts = "; ".join(f"{name}: {text}" for name, text in evidence)
    return f"{len(bad)} of {len(runs)} runs are not what they are said to be, and {why}. {texts}"


def _require_roles(runs: Sequence[Observed]) -> None:
    train = sum(run.role == "train" for run in runs)
    held = len(runs) - train
    if train < _LEAST_TRAIN or held < _LEAST_HELD:
        raise InputError(
            f"{train} run(s) with role train and {held} with role held_out; a diagnosis "
            f"needs at least {_LEAST_TRAIN} to fit and one to judge by. Give more runs, or another "
            "role to one of them"
        )


def _require_seen(runs: Sequence[Observed]) -> None:
    for name in dict.fromkeys(channel for run in runs for channel in run.channels):
        having = [run for run in runs if name in run.channels]
        if not any(run.valid[:, run.channels.index(name)].any() for run in having):
            raise InputError(
                f"{name} was seen in none of {', '.join(run.name for run in having)}; a diagnosis "
                "cannot do without it. Were its markers there, and is the body's name right?"
            )


def _unseen(runs: Sequence[Observed]) -> Iterator[Fault]:
    for k, run in enumerate(runs):
        if len(run.times) < _LEAST_SAMPLES:
            yield Fault(k, f"it has only {len(run.times)} samples; {_LEAST_SAMPLES} are the least")
            continue
        shares = zip(run.channels, run.valid.mean(axis=0), strict=True)
        poor = [f"{name} ({100 * share:.0f} %)" for name, share in shares if share < _LEAST_SEEN]
        if poor:
            yield Fault(k, f"most of it was not seen: {', '.join(poor)} of its samples are there")


def _copies(runs: Sequence[Observed]) -> Iterator[Fault]:
    """Find runs with the samples of another: noise never comes twice."""
    for k, run in enumerate(runs):
        for other in runs[:k]:
            if len(run.times) and _same(run, other):
                yield Fault(
                    k, f"its samples are those of {other.name}: one take was given twice, perhaps "
                    "under two conditions",
                )  # fmt: skip
                break


def _same(run: Observed, other: Observed) -> bool:
    if run.channels != other.channels:
        return False
    count = min(len(run.times), len(other.times))
    return bool(
        np.array_equal(run.valid[:count], other.valid[:count])
        and np.array_equal(run.values[:count], other.values[:count])
    )
