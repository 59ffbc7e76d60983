"""Run a draw of the bank: make each case, let the command line diagnose it, score, write the page.

    python -m tests.bank --seed 1 --cases 40 --work build/bank

One line of JSON is kept for each case; a later call goes on where one was stopped. Cases lie in
`cases`, their labels in `sealed`; the engine is given the case's folder only.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path

from tests.bank.cases import Case, draw_cases
from tests.bank.make import make_case
from tests.bank.score import judge
from tests.bank.tables import page
from tests.bank.write import write_case

__all__ = ["diagnose_case", "run_case"]

_MAIN = [sys.executable, "-c", "from workbench.cli import main; main()"]
_MOST_S = 3600
_WORDS = 300  # of an error that are kept


def diagnose_case(folder: Path) -> dict[str, object]:
    """Return what the command line says of a case: ingest its sheet, diagnose its bundles.

    Raises:
        RuntimeError: when a command fails; with its last words.
    """
    runs = folder / "runs"
    told = _command("ingest", str(folder / "sheet.yaml"), "--runs", str(runs), "--json")
    bundles = told["bundles"]
    assert isinstance(bundles, list)
    out = str(folder / "answer")
    return _command(
        "diagnose", *map(str, bundles), "--out", out, "--no-next", "--no-picture", "--json"
    )


def run_case(case: Case, work: Path) -> dict[str, object]:
    """Make a case, diagnose it, and return one line of the log."""
    line: dict[str, object] = {"seed": case.seed}
    try:
        folder = work / "cases" / case.name
        label = work / "sealed" / f"{case.name}.json"
        if not label.exists():
            write_case(make_case(case), work / "cases", work / "sealed")
        line["answer"] = diagnose_case(folder)
        line["label"] = json.loads(label.read_bytes())
    except (ValueError, RuntimeError, subprocess.TimeoutExpired) as error:
        line["failed"] = str(error)[-_WORDS:]
    return line


def _command(*words: str) -> dict[str, object]:
    done = subprocess.run(
        [*_MAIN, *words], capture_output=True, text=True, timeout=_MOST_S, check=False
    )
    try:
        return json.loads(done.stdout)
    except json.JSONDecodeError:
        raise RuntimeError(f"workbench {words[0]}: {done.stderr.strip()[-_WORDS:]}") from None


def _lines(cases: Sequence[Case], work: Path, log: Path, processes: int) -> Iterator[dict]:
    """Return a line for every case, those in the log first."""
    known = _kept(log)
    yield from (known[case.seed] for case in cases if case.seed in known)
    fresh = multiprocessing.get_context("spawn")
    missing = [case for case in cases if case.seed not in known]
    with ProcessPoolExecutor(processes, mp_context=fresh) as pool:
        for future in as_completed([pool.submit(run_case, case, work) for case in missing]):
            line = future.result()
            with log.open("a", encoding="utf-8") as file:
                file.write(json.dumps(line) + "\n")
            yield line


def _kept(log: Path) -> dict[int, dict]:
    if not log.exists():
        return {}
    read = [json.loads(line) for line in log.read_text(encoding="utf-8").splitlines()]
    return {line["seed"]: line for line in read if "answer" in line}


def main() -> None:
    """Run the draw that the command line asks for."""
    parser = argparse.ArgumentParser(prog="python -m tests.bank", description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--cases", type=int, default=40)
    parser.add_argument("--work", type=Path, default=Path("build/bank"))
    parser.add_argument("--page", type=Path, default=Path("docs/reference/bank.md"))
    parser.add_argument("--processes", type=int, default=os.cpu_count() or 1)
    asked = parser.parse_args()
    work = asked.work / f"seed-{asked.seed}"
    work.mkdir(parents=True, exist_ok=True)
    cases = draw_cases(asked.seed, asked.cases)
    judged, failed = [], []
    for line in _lines(cases, work, work / "log.jsonl", asked.processes):
        said = line.get("failed") or line["answer"].get("answer")
        print(f"case {line['seed']}: {said}", flush=True)
        if "answer" in line:
            judged.append(judge(line["answer"], line["label"]))
        else:
            failed.append(f"case {line['seed']}: {line['failed']}".replace("\n", " "))
    asked.page.write_text(page(judged, len(cases), failed, asked.seed), encoding="utf-8")
    print(f"{len(judged)} of {len(cases)} cases answered; the page is {asked.page}")


if __name__ == "__main__":
    main()
