"""Between two runs: go on, skip, repeat, end; each is kept with the run it was chosen after."""

from __future__ import annotations

from collections.abc import Sequence
from decimal import Decimal
from pathlib import Path

import pytest

from tests.bundles import manifest_of
from workbench.bundle import Bundle, read_remarks
from workbench.hw import SimulatedClock
from workbench.run import (
    Experiment,
    Operator,
    QuietOperator,
    carry_out_with_control,
    load_bench,
    pause,
    read_experiment,
    resume,
    session_files,
)
from workbench.run.bench import CameraSpan, SimulatedBench, Subject
from workbench.run.takes import AnsweredAt

TEXT = """\
schema: workbench/protocol-1
title: Three runs
steps:
  - prompt: Clamp the foot.
  - sweep:
      {mode: clamped, voltages: [3 V, 3.5 V, 4 V], rest: 0.5 s, ramp: 0.1 s, duration: 0.5 s}
"""


class Unfilmed(SimulatedBench):
    """A bench without cameras."""

    def start_cameras(self, operator: Operator) -> None:
        """Film nothing."""

    def collect(
        self, subject: Subject, span: CameraSpan, bundle: Bundle, operator: Operator
    ) -> None:
        """Film nothing."""


class Chooser(QuietOperator):
    """Somebody who is there and gives these answers."""

    present = True
    answered_at: AnsweredAt = "terminal"

    def __init__(self, *replies: str) -> None:
        self.replies = list(replies)
        self.asked: list[tuple[str, Sequence[str]]] = []
        self.told: list[str] = []
        self.confirmed = 0

    def confirm(self, text: str) -> None:
        self.confirmed += 1

    def show_text(self, text: str) -> None:
        self.told.append(text)

    def ask(self, text: str, default: str, choices: Sequence[str] = ()) -> str:
        self.asked.append((text, choices))
        return self.replies.pop(0)


def asked(folder: Path) -> Experiment:
    (folder / "p.yaml").write_text(TEXT)
    return read_experiment(folder / "p.yaml", load_bench("virtual"), Decimal("0.01"))


def made(folder: Path, operator: QuietOperator, always: bool = True) -> list[Bundle]:
    lab = Unfilmed(load_bench("virtual").content, SimulatedClock())
    experiment = asked(folder)
    done = carry_out_with_control(
        experiment,
        lab,
        folder / "runs",
        lambda *at: operator,
        lambda text: None,
        lambda bundle, progress: [],
        pause=always,
    )
    return [bundle for bundle, _ in done]


def numbers(bundles: Sequence[Bundle]) -> list[tuple[int, int]]:
    return [(manifest_of(one)["number"], manifest_of(one)["attempt"]) for one in bundles]


def notes(bundle: Bundle) -> list[str]:
    return [note.text for note in read_remarks(bundle.path).notes]


def test_a_run_is_repeated_with_its_prompts_and_the_next_is_skipped(tmp_path: Path) -> None:
    operator = Chooser("repeat", "SKIP RUN 2", "go", "end")
    bundles = made(tmp_path, operator)
    assert numbers(bundles) == [(1, 1), (1, 2), (3, 1)]
    assert operator.confirmed == 2
    first, second, third, last = operator.asked
    assert first[0].startswith("Paused after run 1 of 3, clamped-10.30; next is clamped-12.50.")
    assert first[1] == ("go on with run 2", "skip run 2", "repeat run 1", "end here")
    assert third[1] == ("go on with run 3", "skip run 3", "repeat run 1", "end here")
    assert last[1] == ("end", "repeat run 3")
    assert second[0] == first[0]
    assert notes(bundles[0]) == ["paused after this run, then: repeat run 1"]
    assert notes(bundles[1]) == [
        "paused after this run, then: skip run 2",
        "paused after this run, then: go on with run 3",
    ]
    # what was skipped is left, and made when the experiment is resumed
    course = resume(bundles[0].path, tmp_path / "runs", asked(tmp_path).inputs())
    assert course.done == {1, 3}


def test_an_end_leaves_the_rest_and_what_is_no_choice_is_told(tmp_path: Path) -> None:
    operator = Chooser("what", "", "end")
    assert numbers(made(tmp_path, operator)) == [(1, 1)]
    assert operator.told[0].startswith("not taken: 'what' is not one of go on with run 2, skip")


def test_without_a_wish_nobody_is_asked(tmp_path: Path) -> None:
    operator = Chooser()
    assert len(made(tmp_path, operator, always=False)) == 3
    assert operator.asked == []


def test_where_nobody_is_there_a_pause_is_passed(tmp_path: Path) -> None:
    assert len(made(tmp_path, QuietOperator())) == 3


def test_a_pause_that_is_wanted_from_elsewhere_is_made_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    operator = Chooser("go on")

    def confirm(text: str) -> None:
        (card,) = session_files(tmp_path / "runs")
        assert pause(card, True)
        assert not pause(card, False)
        assert pause(card, True)

    monkeypatch.setattr(operator, "confirm", confirm)
    assert len(made(tmp_path, operator, always=False)) == 3
    assert len(operator.asked) == 1
