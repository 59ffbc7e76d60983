"""The answer of a diagnosis as a file, and the diagnosis that knows a run."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

from workbench.bundle import sha256

__all__ = ["extended_model_of", "read_answer", "write_answer"]

_SCHEMA = "workbench/diagnosis-1"


def write_answer(
    path: Path,
    answer: Mapping[str, Any],
    files: Mapping[str, Path],
    following: Mapping[str, Any] = MappingProxyType({}),
) -> None:
    """Write an answer with the files that it rests on.

    Args:
        path: of the `.json` file; one that is there is replaced.
        answer: `Diagnosis.as_json`.
        files: what it was made from; a run's take stands under the name of its bundle.
        following: what is said of the next experiment.
    """
    rests_on = {name: sha256(file) for name, file in files.items()}
    written = {"schema": _SCHEMA, **answer, **following, "files": rests_on}
    text = json.dumps(written, indent=2, ensure_ascii=False, default=str) + "\n"
    path.write_text(text, encoding="utf-8")


def extended_model_of(run: str, take: Path, folder: Path) -> Path | None:
    """Return the extended model of the newest diagnosis of a run, None where there is none.

    Args:
        run: name of its bundle.
        take: its export; a diagnosis of another one under that name does not count.
        folder: of all diagnoses, each in a folder of its own.
    """
    digest = sha256(take)
    for path in sorted(folder.glob("*/*.json"), key=lambda one: -one.stat().st_mtime):
        answer = read_answer(path)
        if answer.get("files", {}).get(run) != digest:
            continue
        model = answer.get("extended_model")
        return path.parent / Path(model).name if model else None
    return None


def read_answer(path: Path) -> dict[str, Any]:
    """Return an answer, nothing of a file that is none."""
    try:
        answer = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return answer if isinstance(answer, dict) and answer.get("schema") == _SCHEMA else {}
