"""Verbs are loaded when called; help and completion are whole all the same."""

from __future__ import annotations

import os
import subprocess
import sys
from typing import Any

import pytest
import typer

from tests.conftest import Command
from workbench.cli.app import VERBS, app
from workbench.cli.lazy import Verb
from workbench.cli.runs import RUNS, runs

GROUPS = [(app, VERBS), (runs, RUNS)]


@pytest.mark.parametrize(
    ("group", "name", "verb"),
    [(group, name, verb) for group, verbs in GROUPS for name, verb in verbs.items()],
    ids=[name for _, verbs in GROUPS for name in verbs],
)
def test_the_sentence_in_the_list_is_the_verb_s_own(
    group: typer.Typer, name: str, verb: Verb
) -> None:
    whole: Any = typer.main.get_command(group)
    context = whole.make_context("workbench", [name], resilient_parsing=True)
    found, command, rest = whole.resolve_command(context, [name, "x"])
    assert (found, rest) == (name, ["x"])
    assert " ".join(command.help.split("\n\n")[0].split()) == verb.help


def test_help_lists_every_verb_with_its_sentence(
    workbench: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    shown = workbench("--help").out
    for name, verb in VERBS.items():
        assert f" {name} " in shown
        assert verb.help.split("`")[0] in shown
    assert "--exact" not in shown
    assert "--speed" in workbench("runs", "list", "--help").out
    assert "--driven" in workbench("modes", "--help").out


def test_a_verb_that_is_none_is_answered_with_the_nearest(workbench: Command) -> None:
    answer = workbench("rns")
    assert answer.code == 2
    assert "Did you mean 'runs'" in answer.err


@pytest.mark.parametrize(
    ("words", "offered"),
    [
        ("workbench in", {"ingest", "investigate"}),
        ("workbench runs re", {"rebuild"}),
        ("workbench runs list --op", {"--operator"}),
        ("workbench modes --dri", {"--driven"}),
    ],
)
def test_completion_goes_down_to_the_options_of_a_verb(words: str, offered: set[str]) -> None:
    asked = {
        "_WORKBENCH_COMPLETE": "complete_bash",
        "COMP_WORDS": words,
        "COMP_CWORD": str(len(words.split()) - 1),
    }
    text = "import sys; sys.argv = ['workbench']; from workbench.cli import main; main()"
    done = subprocess.run(
        [sys.executable, "-c", text], env=os.environ | asked, capture_output=True, text=True
    )
    assert offered <= set(done.stdout.split())
