"""Values that the operator types in."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pytest

from workbench.bundle import AnswerFact, events, sentence
from workbench.errors import FileFaults, InputError
from workbench.run import QuietOperator
from workbench.run.prompting import ask
from workbench.run.takes import AnsweredAt
from workbench.schemas import PlannedPrompt, Protocol, load


class Typist(QuietOperator):
    present = True
    answered_at: AnsweredAt = "terminal"

    def __init__(self, *typed: str) -> None:
        self.typed, self.heard = list(typed), []

    def show_text(self, text: str) -> None:
        self.heard.append(text)

    def ask(self, text: str, default: str, choices: Sequence[str] = ()) -> str:
        self.heard.append(text)
        return self.typed.pop(0)


def prompt(folder: Path, value: str, extra: str = "") -> PlannedPrompt:
    path = folder / "p.yaml"
    head = "schema: workbench/protocol-1\ntitle: T\nsteps:\n"
    path.write_text(f"{head}  - prompt: {{text: Tell me., value: {value}{extra}}}\n")
    (step,) = load(path, Protocol).content.steps
    assert step.prompt is not None
    return PlannedPrompt(step.prompt.text, None, step.prompt.value)


def test_a_quantity_is_asked_until_it_is_one_and_kept_in_si(tmp_path: Path) -> None:
    asked = prompt(tmp_path, "{name: far, quantity: length, low: 0 m, high: 2 m}")
    operator = Typist("", "12", "3 m", "12.5 cm")
    one = ask(operator, asked)
    assert one.fact() == {"far": AnswerFact(value=0.125, unit="m")}
    event = events.PromptAnswered(text="Tell me.", name="far", answer=0.125, where="terminal")
    assert one.event(None) == event
    assert one.event(2.5).asked_s == 2.5
    assert operator.heard[0] == "Tell me. [far: length in m or cm or mm from 0 m to 2 m]"
    assert operator.heard[1] == "not taken: '' is not a number with a unit; known units: m, cm, mm"
    assert operator.heard[3] == "not taken: 12 has no unit; write for example '12 mm'"
    assert operator.heard[5] == (
        "not taken: 3 m is not allowed; it must be at least 0 m, at most 2 m"
    )


def test_words_are_taken_as_listed_and_after_five_tries_it_ends(tmp_path: Path) -> None:
    asked = prompt(tmp_path, "{name: floor, one_of: [wood, rubber]}")
    assert ask(Typist("wood"), asked).answer == "wood"
    operator = Typist(*["ruber"] * 5)
    with pytest.raises(InputError, match="floor: 5 answers were not taken; wood, rubber is needed"):
        ask(operator, asked)
    assert operator.heard[1] == (
        "not taken: 'ruber' is not one of wood, rubber; did you mean 'rubber'?"
    )


def test_nobody_types_on_a_bench_without_an_operator(tmp_path: Path) -> None:
    one = ask(QuietOperator(), prompt(tmp_path, "{name: remark}"))
    assert one.fact() == {"remark": AnswerFact(value=None, unit=None)}


@pytest.mark.parametrize(
    ("value", "words"),
    [
        ("{name: Far}", "name: 'Far' is not allowed; it must be small letters"),
        ("{name: a, low: 1 m}", "low and high belong to a quantity"),
        ("{name: a, quantity: length, low: 2 m, high: 1 m}", "low 2 m is not below high 1 m"),
        ("{name: a, quantity: length, low: 2 s}", "unknown unit 's' in '2 s'; known units: m"),
        ("{name: a, quantity: mass, one_of: [b, c]}", "either a quantity or one_of some words"),
    ],
)
def test_a_question_that_makes_no_sense_is_refused(tmp_path: Path, value: str, words: str) -> None:
    with pytest.raises(FileFaults, match=words):
        prompt(tmp_path, value)


@pytest.mark.parametrize("value", ["", "{name: far, quantity: length}"])
def test_a_prompt_that_nobody_saw_is_not_said_to_be_confirmed(tmp_path: Path, value: str) -> None:
    asked = prompt(tmp_path, value) if value else PlannedPrompt("Tell me.")
    event = ask(QuietOperator(), asked).event(None)
    assert (event.answer, event.where) == (None, "nobody")
    said = "nobody was asked for far" if value else "nobody was asked, nobody confirmed"
    assert sentence(event) == f"{said}: Tell me."


def test_a_record_of_before_that_names_nobody_is_not_read_as_confirmed() -> None:
    before = events.PromptAnswered(text="Clamp the foot.", answer="confirmed", where="nobody")
    assert sentence(before) == "nobody was asked, nobody confirmed: Clamp the foot."
    seen = events.PromptAnswered(text="Clamp the foot.", answer="confirmed")
    assert sentence(seen) == "operator confirmed: Clamp the foot."
