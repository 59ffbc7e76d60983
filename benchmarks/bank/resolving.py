"""Do the runs that a diagnosis asks for resolve ties, and sooner than runs drawn at random?

    python -m benchmarks.bank.resolving --seed 3 --cases 10

Each case is a constructed tie. Two ways go on from its first answer: in each round runs are asked
for, the case's own robot makes them, and all runs so far are diagnosed, until the answer is no set
any more or three rounds are over. One way asks what the diagnosis proposes; the other draws clamped
runs and ring-downs from the same menu, each made as often, until they take as long on the bench as
the first proposal. Lines are kept as those of the bank are.
"""

from __future__ import annotations

import argparse
import os
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from benchmarks.bank.cases import Case, Made, draw_case, plan_of
from benchmarks.bank.kept import keep_all, kept
from benchmarks.bank.make import further_runs, make_case
from benchmarks.bank.one_case import Line, engine
from benchmarks.bank.size import UnreachableError
from benchmarks.bank.write import measured
from workbench.diagnose import Diagnosis, HopperRig, diagnose
from workbench.errors import DataFault
from workbench.investigate import MENU, ProposedRun, minutes_of, propose
from workbench.investigate.proposed import TIMES
from workbench.schemas import load_model, load_shape

__all__ = ["ROUNDS", "rounds_of", "ties_of", "wrongly"]

ROUNDS = 3
_FIRST = 500  # of a seed's thousand: ties of their own, not those of the bank's draw
_PLAIN = [trial for trial in MENU if trial.mode in ("clamped", "decay")]

Ask = Callable[[Diagnosis], Sequence[ProposedRun]]


def resolve(case: Case) -> Line:
    """Return what became of a tie, both ways."""
    line: Line = {"seed": case.seed, "engine": engine()}
    try:
        made = make_case(case)
        found = _diagnosed(made)
        proposed = _rounds(made, found, _proposed)
        random: list[Line] = []
        if proposed:
            random = _rounds(made, found, _at_random(case, proposed[0]["minutes"]))
        rounds = {"proposed": proposed, "random": random}
        return line | {"label": made.label, "first": _said(found), "rounds": rounds}
    except (ValueError, DataFault) as error:
        return line | {"failed": str(error)}


def ties_of(folder: Path) -> list[Line]:
    """Return the lines that are kept in a folder, of ties that were answered as such at first."""
    lines = [one for log in sorted(folder.glob("ties-*.jsonl")) for one in kept(log).values()]
    return [one for one in lines if "failed" not in one and one["first"]["answer"] == "SET"]


def rounds_of(line: Line, way: str) -> int:
    """Return how many rounds a tie took one way; one more than there are where it stayed one."""
    rounds = line["rounds"][way]
    return len(rounds) if rounds and _right(line, rounds[-1]) else ROUNDS + 1


def wrongly(line: Line, way: str) -> bool:
    """Tell whether a name came in the end that is not the truth."""
    rounds = line["rounds"][way]
    return bool(rounds) and rounds[-1]["answer"] == "NAMED" and not _right(line, rounds[-1])


def _right(line: Line, said: Line) -> bool:
    return said["answer"] == "NAMED" and said["causes"] == list(line["label"]["effects"])


def _rounds(made: Made, found: Diagnosis, ask: Ask) -> list[Line]:
    rounds: list[Line] = []
    while found.kind == "SET" and len(rounds) < ROUNDS:
        asked = ask(found)
        if not asked:
            break
        first = len(made.runs)
        rng = made.case.rng(6, first)
        plans = [plan_of(trial, first + k, rng) for k, trial in enumerate(TIMES * tuple(asked))]
        runs = [[trial.mode, trial.amount] for trial in asked]
        spent = {"runs": runs, "minutes": minutes_of(TIMES * tuple(asked))}
        try:
            made = replace(made, runs=(*made.runs, *further_runs(made, plans)))
            found = _diagnosed(made)
        except (UnreachableError, DataFault) as fault:
            return [*rounds, spent | {"answer": "DATA_FAULT", "causes": [], "why": str(fault)}]
        rounds.append(_said(found) | spent)
    return rounds


def _proposed(found: Diagnosis) -> Sequence[ProposedRun]:
    proposal = propose(found, MENU)
    return () if proposal is None else proposal.trials


def _at_random(case: Case, minutes: float) -> Ask:
    rng = case.rng(7)

    def ask(_: Diagnosis) -> Sequence[ProposedRun]:
        drawn: list[ProposedRun] = []
        while minutes_of(TIMES * tuple(drawn)) < minutes:
            drawn.append(_PLAIN[rng.integers(len(_PLAIN))])
        return drawn

    return ask


def _diagnosed(made: Made) -> Diagnosis:
    model, shape = load_model("thesis", Path()), load_shape("thesis-initial", Path())
    rig = HopperRig(measured(made), model, shape.content)
    with tempfile.TemporaryDirectory() as folder:
        return diagnose(rig, Path(folder), threads=1)


def _said(found: Diagnosis) -> Line:
    return {"answer": found.kind, "causes": [one.name for one in found.causes]}


def main() -> None:
    """Resolve the ties that the command line asks for."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.bank.resolving", description=__doc__
    )
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--cases", type=int, default=10)
    parser.add_argument("--kept", type=Path, default=Path("docs/reference/bank"))
    parser.add_argument("--processes", type=int, default=os.cpu_count() or 1)
    asked = parser.parse_args()
    cases = [draw_case(1000 * asked.seed + _FIRST + k, "tie", k) for k in range(asked.cases)]
    log = asked.kept / f"ties-{asked.seed}.jsonl"
    for line in keep_all(cases, log, resolve, asked.processes, kept(log)):
        print(f"case {line['seed']}: {line.get('failed') or line['rounds']}", flush=True)


if __name__ == "__main__":
    main()
