"""Which runs a diagnosis may trust: what shows a fault before anything is fitted.

Checks that need nothing but samples stand here; what a kind of system knows of itself, the rig
says (`Recorded.faults`). A run at fault is left out, whatever else it may say: a fit would explain
it with a cause. What all runs have alike is left to the engine, for that is what a cause looks
like.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from workbench.data_quality.facts import Facts, Fault
from workbench.errors import DataFault, InputError

__all__ = ["Recorded", "Soundness", "faults_as_json", "refused", "soundness"]

_LEAST_TRAIN, _LEAST_HELD = 2, 1
_MOST_FAULTY = 1 / 3  # of all runs: a set with more faults is not believed elsewhere either
_LEAST_SEEN = 0.5  # of a channel's samples


class Recorded(Protocol):
    """Some runs and what is known of them without a fit; a rig of a diagnosis is one."""

    @property
    def facts(self) -> Sequence[Facts]:
        """Return what was measured of each run."""
        ...

    def faults(self) -> Sequence[Fault]:
        """Return the runs that are not what they are said to be."""
        ...


@dataclass(frozen=True)
class Soundness:
    """The runs that may be trusted, and why others may not.

    Args:
        count: of the sound runs.
        faults: of all others, in the order of the runs.
        evidence: the faults in words, (run, sentence).
    """

    count: int
    faults: tuple[Fault, ...]
    evidence: tuple[tuple[str, str], ...]

    def before(self, kind: str, reason: str) -> str:
        """Return the reason of an answer to all runs: the faults, then what sound runs say."""
        left_out = "; ".join(f"{run} is left out: {text}" for run, text in self.evidence)
        return f"{left_out}. The other {self.count} runs alone answer {kind}: {reason}"


def soundness(rig: Recorded) -> Soundness:
    """Return which runs are sound.

    Raises:
        InputError: too few runs to fit or to judge by, or a channel that was never seen.
        DataFault: too many runs at fault.
    """
    runs = rig.facts
    _require_roles(runs)
    _require_seen(runs)
    found = [*_unseen(runs), *_copies(runs), *rig.faults()]
    faults = tuple(sorted(found, key=lambda fault: fault.run))
    bad = {fault.run for fault in faults}
    sound = [run for k, run in enumerate(runs) if k not in bad]
    evidence = tuple((runs[fault.run].name, fault.evidence) for fault in faults)
    train = sum(run.role == "train" for run in sound)
    too_few = train < _LEAST_TRAIN or len(sound) - train < _LEAST_HELD
    if too_few or len(bad) > _MOST_FAULTY * len(runs):
        raise DataFault(_refusal(runs, bad, evidence, too_few), evidence)
    return Soundness(len(sound), faults, evidence)


def refused(fault: DataFault) -> dict[str, object]:
    """Return what the command line prints of runs of which too few are sound to fit anything."""
    return {
        "answer": "DATA_FAULT",
        "reason": str(fault),
        "faults": faults_as_json(fault.evidence),
        "causes": [],
        "rivals": [],
        "rmse_mm": {"noise_floor": None, "base": None, "extended": None},
        "removable_removed": None,
        "held_out_runs": [],
        "extended_model": None,
        "next_protocol": None,
        "seconds": None,
    }


def faults_as_json(evidence: Sequence[tuple[str, str]]) -> list[dict[str, str]]:
    """Return the evidence of faults as the command line prints it."""
    return [{"run": run, "evidence": text} for run, text in evidence]


def _refusal(
    runs: Sequence[Facts], bad: set[int], evidence: Sequence[tuple[str, str]], too_few: bool
) -> str:
    others = len(runs) - len(bad)
    why = (
        f"the other {others} are too few to fit and to judge by"
        if too_few
        else f"so the other {others} are not believed either"
    )
    texts = "; ".join(f"{name}: {text}" for name, text in evidence)
    return f"{len(bad)} of {len(runs)} runs are not what they are said to be, and {why}. {texts}"


def _require_roles(runs: Sequence[Facts]) -> None:
    train = sum(run.role == "train" for run in runs)
    held = len(runs) - train
    if train < _LEAST_TRAIN or held < _LEAST_HELD:
        raise InputError(
            f"{train} run(s) with role train and {held} with role held_out; a diagnosis "
            f"needs at least {_LEAST_TRAIN} to fit and one to judge by. Give more runs, or another "
            "role to one of them"
        )


def _require_seen(runs: Sequence[Facts]) -> None:
    for name in dict.fromkeys(channel for run in runs for channel in run.channels):
        having = [run for run in runs if name in run.channels]
        if not any(np.isfinite(run.values[:, run.channels.index(name)]).any() for run in having):
            raise InputError(
                f"{name} was seen in none of {', '.join(run.name for run in having)}; a diagnosis "
                "cannot do without it. Were its markers there, and is the body's name right?"
            )


def _unseen(runs: Sequence[Facts]) -> Iterator[Fault]:
    for k, run in enumerate(runs):
        shares = zip(run.channels, np.isfinite(run.values).mean(axis=0), strict=True)
        poor = [f"{name} ({100 * share:.0f} %)" for name, share in shares if share < _LEAST_SEEN]
        if poor:
            yield Fault(k, f"most of it was not seen: {', '.join(poor)} of its samples are there")


def _copies(runs: Sequence[Facts]) -> Iterator[Fault]:
    """Find runs with the samples of another: noise never comes twice."""
    for k, run in enumerate(runs):
        for other in runs[:k]:
            if len(run.values) and _same(run, other):
                yield Fault(
                    k,
                    f"its samples are those of {other.name}: one take was given twice, perhaps "
                    "under two conditions",
                )
                break


def _same(run: Facts, other: Facts) -> bool:
    if run.channels != other.channels:
        return False
    count = min(len(run.values), len(other.values))
    return bool(np.array_equal(run.values[:count], other.values[:count], equal_nan=True))
