"""One case of a draw: made, answered by a process of its own, one line of the log."""

from __future__ import annotations

import hashlib
import json
import shutil
import subprocess
import sys
import tokenize
from collections.abc import Iterator, Mapping
from io import StringIO
from pathlib import Path
from typing import Any

import workbench
from benchmarks.bank.cases import Case
from benchmarks.bank.make import make_case
from benchmarks.bank.score import LATE
from benchmarks.bank.write import write_case

__all__ = ["Line", "alike", "engine", "run_case"]

Line = dict[str, Any]
"""`seed`, and either `failed` in words or what `answering` printed with the `label`; of the answer
what is scored, so that lines stay small and name no place of the machine."""

_ANSWERING = [sys.executable, "-m", "benchmarks.bank.answering"]
_MOST_S = 3600  # for an answer; what takes longer counts as none
_WORDS = 300  # of an error that are kept
_SCORED = ("answer", "reason", "rmse_mm", "removable_removed", "seconds")
_SCORED_OF_A_CAUSE = ("effect", "confidence", "weight", "parameters")
_ENGINE = ("data_quality", "diagnose", "fit", "sim", "tracking")
_OF_RIGS = ("mjcf",)  # begins of the names of sources that no case of the bank uses
_DIGITS = 8
_ALIKE: dict[str, frozenset[str]] = {}  # state of the engine -> those before it that do the same
_BLOCKS = (tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT)
_SILENT = (tokenize.COMMENT, tokenize.NL)


def run_case(
    case: Case, work: Path, turned: str | None = None, labels: Mapping[int, Line] | None = None
) -> Line:
    """Make a case, have it answered, and return one line of the log.

    Args:
        case: drawn.
        work: folder of the draw.
        turned: effect that the answering twin has with the wrong sign.
        labels: seed -> label of a case that was made before.
    """
    line: Line = {"seed": case.seed}
    try:
        folder = work / "cases" / case.name
        label = work / "sealed" / f"{case.name}.json"
        if not label.exists():
            made = make_case(case, (labels or {}).get(case.seed))
            write_case(made, work / "cases", work / "sealed")
        for left in (folder / "runs", folder / "answer"):  # of an answer that was stopped
            shutil.rmtree(left, ignore_errors=True)
        said = _answered(folder, *(["--flip", turned] if turned else []))
        line |= said | {"answer": _scored(said["answer"]), "engine": engine()}
        line["label"] = json.loads(label.read_bytes())
    except (ValueError, RuntimeError) as error:
        line["failed"] = str(error)[-_WORDS:]
    return line


def engine() -> str:
    """Return which state of the engine answers: the start of a hash of its sources.

    Comments, docstrings and layout answer nothing, so they may be mended without another state; nor
    do sources that other machines than the robot use.
    """
    root, digest = Path(workbench.__file__).parent, hashlib.sha256()
    for room in _ENGINE:
        for source in sorted((root / room).rglob("*.py")):
            if source.name.startswith(_OF_RIGS):
                continue
            code = "".join(_code(source.read_text(encoding="utf-8")))
            digest.update(f"{source.relative_to(root).as_posix()}\n{code}\n".encode())
    return digest.hexdigest()[:_DIGITS]


def alike(state: str) -> frozenset[str]:
    """Return the states before one whose innovations differ by less than a hundredth sigma."""
    return _ALIKE.get(state, frozenset())


def _code(source: str) -> Iterator[str]:
    """Yield the words of a source that do something, and where statements and blocks begin."""
    begins = True
    for token in tokenize.generate_tokens(StringIO(source).readline):
        docstring = begins and token.type == tokenize.STRING
        if token.type in _BLOCKS:
            if not (begins and token.type == tokenize.NEWLINE):  # after a docstring
                yield f"{token.type} "
            begins = True
        elif token.type not in _SILENT and not docstring:
            yield f"{token.string} "
            begins = False


def _scored(answer: Mapping[str, Any]) -> Line:
    causes = [
        {key: one[key] for key in _SCORED_OF_A_CAUSE if key in one} for one in answer["causes"]
    ]
    return {key: answer[key] for key in _SCORED if key in answer} | {"causes": causes}


def _answered(*words: str | Path) -> Line:
    try:
        done = subprocess.run(
            [*_ANSWERING, *map(str, words)],
            capture_output=True,
            text=True,
            timeout=_MOST_S,
            check=False,
        )
    except subprocess.TimeoutExpired:  # whose words are a command, with places of this machine
        return {"answer": {"answer": LATE, "causes": [], "seconds": _MOST_S}, "plain": {}}
    if done.returncode:
        last = done.stderr.strip().rpartition("\n")[2]  # those before name places of this machine
        raise RuntimeError(last[-_WORDS:])
    return json.loads(done.stdout)
