"""Answer one case in a process of its own; what the dumb engines say stands beside it.

    python -m benchmarks.bank.answering FOLDER [--flip EFFECT]

The sheet is ingested and the bundles are diagnosed as the command line does, but for the views of
each run, which took a fifth of the time of a reduced case.
One JSON object is printed. With `--flip` the twin has the named effect with its sign turned: an
answer that is as good as before would show that the bank cannot tell.
"""

from __future__ import annotations

import argparse
import json
import resource
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

from benchmarks.bank.baselines import plain_answers
from workbench.bundle import Bundle
from workbench.data_quality import refused
from workbench.diagnose import Diagnosis, diagnose, robot_of
from workbench.errors import DataFault, WorkbenchError
from workbench.run import ingest_sheet
from workbench.schemas import Sheet, load
from workbench.sim import EFFECTS

__all__ = ["answer", "flip"]

_SCREENING = "see what each candidate promises"
_FEW = 5


def answer(folder: Path) -> dict[str, Any]:
    """Return what is answered to the case in a folder.

    Returns:
        `answer` as `workbench diagnose --json` prints it, `plain` those of the plain engines, what
        is `behind` it, `screening` [s] that it took to see what each candidate promises,
        `processor` [s] and `peak` [MB].

    Raises:
        WorkbenchError: when the sheet is refused.
    """
    sheet = load(folder / "sheet.yaml", Sheet)
    done = [one.path for one in ingest_sheet(sheet, folder / "runs", lambda text: None)]
    rig, _ = robot_of([Bundle.open(one) for one in done], lambda text: None)
    begin, times = time.perf_counter(), list[tuple[str, float]]()
    spent = time.process_time()

    def heard(stage: str) -> None:
        times.append((str(stage), time.perf_counter()))

    try:
        found = diagnose(rig, folder / "answer", "answer", heard)
    except DataFault as fault:
        return _spent({"answer": refused(fault), "plain": {}}, spent)
    said = found.as_json()
    known = {"answer": said, "plain": plain_answers(found), "behind": behind(found)}
    seconds = time.perf_counter() - begin
    screening = sum(b - a for (stage, a), (_, b) in pairwise(times) if stage == _SCREENING)
    return _spent(known | {"screening": screening, "seconds": seconds}, spent)


def behind(found: Diagnosis) -> dict[str, Any]:
    """Return what an answer rests on, so that thresholds can be studied on lines that are kept.

    Returns:
        `promises`: the best few with their gain; for held runs, hops and drive what is `missing`
        and the best hypotheses with their gain, fitted and held out, and how sure they are.
    """
    promises = [[one.name, round(one.gain, 2)] for one in found.observer.promises[:_FEW]]
    parts = {
        name: {
            "missing": part.missing,
            "compared": [
                [*one.names, round(gains.gain, 2), round(gains.held, 2), round(gains.sure, 2)]
                for one, gains in part.compared[:_FEW]
            ],
        }
        for name, part in found.parts.items()
    }
    return {"promises": promises, **parts}


def _spent(said: dict[str, Any], before: float) -> dict[str, Any]:
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return said | {"processor": time.process_time() - before, "peak": peak}


def flip(name: str) -> None:
    """Give the twin of this process an effect with the sign of its quantities turned."""
    effect = EFFECTS[name]
    hooks = ("alter", "build", "drive", "observe")
    there = {hook: getattr(effect, hook) for hook in hooks}
    turned = {hook: _turned(act) for hook, act in there.items() if act is not None}
    EFFECTS[name] = replace(effect, **turned)


def _turned(act: Callable[..., Any]) -> Callable[..., Any]:
    """Return an effect's function that takes the opposite of its last argument, the values."""

    def opposite(*given: Any) -> Any:
        values: Mapping[str, float] = given[-1]
        return act(*given[:-1], {key: -value for key, value in values.items()})

    return opposite


def main() -> None:
    """Answer the case that the command line names."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.bank.answering", description=__doc__
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("--flip", choices=list(EFFECTS))
    asked = parser.parse_args()
    if asked.flip:
        flip(asked.flip)
    try:
        print(json.dumps(answer(asked.folder)))
    except WorkbenchError as refusal:
        parser.exit(1, f"{refusal}\n")


if __name__ == "__main__":
    main()
