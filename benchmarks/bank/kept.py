"""Answers that are kept as lines of JSON, so that a draw may stop and go on on another machine."""

from __future__ import annotations

import json
import multiprocessing
from collections.abc import Callable, Container, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path

from benchmarks.bank.cases import Case
from benchmarks.bank.one_case import Line

__all__ = ["keep_all", "kept"]


def keep_all(
    cases: Sequence[Case],
    log: Path,
    answered: Callable[[Case], Line],
    processes: int,
    known: Container[int],
) -> Iterator[Line]:
    """Yield a line for every case that is not known yet, and keep it in a log.

    Args:
        cases: of the draw.
        log: file of lines.
        answered: makes the line of a case, in a process of its own.
        processes: that work at once.
        known: seeds of cases that need no answer.
    """
    fresh = multiprocessing.get_context("spawn")
    missing = [case for case in cases if case.seed not in known]
    log.parent.mkdir(parents=True, exist_ok=True)
    with ProcessPoolExecutor(processes, mp_context=fresh) as pool:
        for future in as_completed([pool.submit(answered, one) for one in missing]):
            line = future.result()
            with log.open("a", encoding="utf-8") as file:
                file.write(json.dumps(line) + "\n")
            yield line


def kept(log: Path) -> dict[int, Line]:
    """Return the last line of each case, by its seed: one with an answer, where there is any."""
    if not log.exists():
        return {}
    read = [json.loads(line) for line in log.read_text(encoding="utf-8").splitlines()]
    answered = {line["seed"]: line for line in read if "failed" not in line}
    return {line["seed"]: line for line in read} | answered
