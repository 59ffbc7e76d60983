"""The file that a search goes on from: written whole, or not at all."""

from __future__ import annotations

import hashlib
import json
import math
import os
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from workbench.errors import InputError
from workbench.optimize.algorithm import Algorithm, State
from workbench.optimize.evaluation import Evaluation, candidate_key
from workbench.optimize.history import Generation, History, Trial

__all__ = ["Checkpoint", "CheckpointFile"]

_SCHEMA = "workbench/search-1"
_HELP = "take another file, or delete it and search anew"
_LONGEST = 60  # characters of a value in a message
_SHORT_S = 0.2  # of writing, which nobody minds after each generation
_PAUSE = 20  # times what writing takes beyond that: 5 % of a long search at most


@dataclass(frozen=True)
class Checkpoint:
    """State of a search.

    Args:
        problem_id: of the objective.
        history: all generations.
        state: the algorithm's, after the last of them.
    """

    problem_id: str
    history: History
    state: State

    def write(self, path: Path, algorithm: Algorithm) -> None:
        """Write the file so that a crash at any moment leaves the old one or the new one."""
        content = _identity(self.problem_id, algorithm) | {
            "state": self.state,
            "generations": [_generation(self.problem_id, g) for g in self.history.generations],
            "trials": _trials(self.problem_id, self.history),
        }
        draft = path.with_name(f"{path.name}.new")
        path.parent.mkdir(parents=True, exist_ok=True)
        with draft.open("w", encoding="utf-8") as file:
            json.dump(content | {"checksum": _checksum(content)}, file, allow_nan=False)
            file.flush()
            os.fsync(file.fileno())
        os.replace(draft, path)

    @classmethod
    def read(cls, path: Path, problem_id: str, algorithm: Algorithm) -> Checkpoint:
        """Read the file of this very search.

        Raises:
            InputError: when the file is torn, edited or of another search; names what differs.
        """
        content = _read(path)
        _check_same(path, content, _identity(problem_id, algorithm))
        try:
            return cls(problem_id, _history(content), content["state"])
        except (KeyError, TypeError, ValueError) as error:
            raise InputError(f"{path}: incomplete, {error!r}; {_HELP}") from None


class CheckpointFile:
    """The file of a running search: written after each generation while that is a short matter.

    The file of 30 000 candidates has 30 MB. So writes that take long are farther apart; `flush`
    writes what is left.

    Args:
        path: of the file; None keeps nothing.
        problem_id: of the objective.
        algorithm: that searches.
    """

    def __init__(self, path: Path | None, problem_id: str, algorithm: Algorithm) -> None:
        self._path, self._problem_id, self._algorithm = path, problem_id, algorithm
        self._unwritten: Checkpoint | None = None
        self._due = -math.inf

    def keep(self, history: History) -> None:
        """Take the state after a generation, and write it unless the last write was just now."""
        if self._path is None:
            return
        self._unwritten = Checkpoint(self._problem_id, history, self._algorithm.state())
        if time.monotonic() >= self._due:
            self.flush()

    def flush(self) -> None:
        """Write the last state that was taken, if it is not in the file."""
        if self._path is None or self._unwritten is None:
            return
        begin = time.monotonic()
        self._unwritten.write(self._path, self._algorithm)
        self._unwritten = None
        end = time.monotonic()
        self._due = end + _PAUSE * max(end - begin - _SHORT_S, 0.0)


def _identity(problem_id: str, algorithm: Algorithm) -> dict[str, Any]:
    """Return what must be the same for a search to go on."""
    return {
        "schema": _SCHEMA,
        "problem": problem_id,
        "space": algorithm.space.describe(),
        "algorithm": algorithm.name,
        "options": algorithm.options,
    }


def _generation(problem_id: str, generation: Generation) -> dict[str, Any]:
    keys = [candidate_key(problem_id, trial.candidate) for trial in generation.trials]
    return {"keys": keys, "evaluated": generation.evaluated, "seconds": generation.seconds}


def _trials(problem_id: str, history: History) -> dict[str, Any]:
    return {
        candidate_key(problem_id, trial.candidate): {
            "candidate": trial.candidate.tolist(),
            "fitness": list(trial.evaluation.fitness),
            "numbers": {k: _number(v) for k, v in trial.evaluation.numbers.items()},
            "failure": trial.evaluation.failure,
        }
        for trial in history.trials
    }


def _number(value: float) -> float | str:
    """Return a number as JSON has it; JSON has no word for NaN and infinity, `float` reads it."""
    return float(value) if math.isfinite(value) else str(float(value))


def _history(content: dict[str, Any]) -> History:
    trials = {
        key: Trial(
            np.array(one["candidate"], dtype=np.float64),
            Evaluation(
                tuple(one["fitness"]),
                {name: float(value) for name, value in one["numbers"].items()},
                one["failure"],
            ),
        )
        for key, one in content["trials"].items()
    }
    generations = tuple(
        Generation(tuple(trials[key] for key in one["keys"]), one["evaluated"], one["seconds"])
        for one in content["generations"]
    )
    return History(tuple(content["space"]["names"]), generations)


def _checksum(content: dict[str, Any]) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def _read(path: Path) -> dict[str, Any]:
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path}: cannot be read, {error.strerror}") from None
    except (ValueError, RecursionError) as error:  # neither UTF-8 nor JSON, or nested without end
        raise InputError(f"{path}: not whole, {error}; {_HELP}") from None
    if not isinstance(content, dict) or content.get("schema") != _SCHEMA:
        raise InputError(f"{path}: no search of this workbench ({_SCHEMA}); {_HELP}")
    if content.pop("checksum", None) != _checksum(content):
        raise InputError(f"{path}: changed since it was written, its checksum differs; {_HELP}")
    return content


def _check_same(path: Path, found: dict[str, Any], wanted: dict[str, Any]) -> None:
    faults = list(_differences("", found, json.loads(json.dumps(wanted))))
    if faults:
        raise InputError(f"{path}: of another search: {'; '.join(faults)}; {_HELP}")


def _differences(name: str, found: Any, wanted: Any) -> Iterator[str]:
    if isinstance(wanted, dict) and isinstance(found, dict):
        for key in wanted:
            yield from _differences(f"{name} {key}".strip(), found.get(key), wanted[key])
    elif found != wanted:
        yield f"{name} is {_short(found)} there and {_short(wanted)} here"


def _short(value: Any) -> str:
    text = json.dumps(value)
    return text if len(text) <= _LONGEST else f"{text[: _LONGEST - 4]} ..."
