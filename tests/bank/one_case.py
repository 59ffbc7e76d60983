"""One case of a draw: made, answered by a process of its own, one line of the log."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

from tests.bank.cases import Case
from tests.bank.make import make_case
from tests.bank.write import write_case

__all__ = ["Line", "run_case"]

Line = dict[str, Any]
"""`seed`, and either `failed` in words or what `tests.bank.answering` prints with the `label`."""

_ANSWERING = [sys.executable, "-m", "tests.bank.answering"]
_MOST_S = 3600
_WORDS = 300  # of an error that are kept


def run_case(case: Case, work: Path, turned: str | None = None) -> Line:
    """Make a case, have it answered, and return one line of the log.

    Args:
        case: drawn.
        work: folder of the draw.
        turned: effect that the answering twin has with the wrong sign.
    """
    line: Line = {"seed": case.seed}
    try:
        folder = work / "cases" / case.name
        label = work / "sealed" / f"{case.name}.json"
        if not label.exists():
            write_case(make_case(case), work / "cases", work / "sealed")
        line |= _answered(folder, *(["--flip", turned] if turned else []))
        line["label"] = json.loads(label.read_bytes())
    except (ValueError, RuntimeError, subprocess.TimeoutExpired) as error:
        line["failed"] = str(error)[-_WORDS:]
    return line


def _answered(*words: str | Path) -> Line:
    done = subprocess.run(
        [*_ANSWERING, *map(str, words)],
        capture_output=True, text=True, timeout=_MOST_S, check=False,
    )  # fmt: skip
    if done.returncode:
        raise RuntimeError(done.stderr.strip()[-_WORDS:])
    return json.loads(done.stdout)
