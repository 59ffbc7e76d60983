"""The answer of a diagnosis on disk, and the run that finds it again."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from workbench.bundle import sha256
from workbench.diagnose import extended_model_of, write_answer


@pytest.fixture
def take(tmp_path: Path) -> Path:
    path = tmp_path / "take.csv"
    path.write_text("a take", encoding="utf-8")
    return path


def answer(folder: Path, take: Path, model: str | None, age_s: float = 0.0) -> Path:
    """Write an answer as `write_answer` does, some time ago."""
    folder.mkdir(parents=True)
    told = {
        "schema": "workbench/diagnosis-1",
        "extended_model": model,
        "files": {"shape": "0", "run-1": sha256(take)},
    }
    path = folder / f"{folder.name}.json"
    path.write_text(json.dumps(told), encoding="utf-8")
    os.utime(path, (1e9 - age_s, 1e9 - age_s))
    return folder / "model.yaml"


def test_an_answer_is_kept_with_what_it_rests_on(take: Path, tmp_path: Path) -> None:
    path = tmp_path / "april" / "april.json"
    path.parent.mkdir()
    written = {"answer": "NAMED", "extended_model": "elsewhere/april-model.yaml"}
    write_answer(path, written, {"run-1": take})
    told = json.loads(path.read_text(encoding="utf-8"))
    assert told == {"schema": "workbench/diagnosis-1", **written, "files": {"run-1": sha256(take)}}
    assert extended_model_of("run-1", take, tmp_path) == path.parent / "april-model.yaml"


def test_the_newest_diagnosis_of_a_run_counts(take: Path, tmp_path: Path) -> None:
    old = answer(tmp_path / "all" / "march", take, "elsewhere/model.yaml", age_s=100)
    assert extended_model_of("run-1", take, tmp_path / "all") == old
    new = answer(tmp_path / "all" / "april", take, "april/model.yaml")
    assert extended_model_of("run-1", take, tmp_path / "all") == new


def test_a_newer_answer_without_a_cause_takes_the_older_one_s_place(
    take: Path, tmp_path: Path
) -> None:
    answer(tmp_path / "all" / "march", take, "model.yaml", age_s=100)
    answer(tmp_path / "all" / "april", take, None)
    assert extended_model_of("run-1", take, tmp_path / "all") is None


def test_another_run_or_another_take_has_no_diagnosis(take: Path, tmp_path: Path) -> None:
    answer(tmp_path / "all" / "april", take, "model.yaml")
    assert extended_model_of("run-2", take, tmp_path / "all") is None
    take.write_text("another take", encoding="utf-8")
    assert extended_model_of("run-1", take, tmp_path / "all") is None


@pytest.mark.parametrize("text", ["", "[1]", '{"schema": "other"}', "\x00"])
def test_files_that_are_no_answers_are_passed_over(take: Path, tmp_path: Path, text: str) -> None:
    folder = tmp_path / "all" / "other"
    folder.mkdir(parents=True)
    (folder / "other.json").write_text(text, encoding="utf-8")
    assert extended_model_of("run-1", take, tmp_path / "all") is None
    assert extended_model_of("run-1", take, tmp_path / "none") is None
