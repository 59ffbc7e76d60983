"""Every verb takes the same words for runs, and answers a wrong one in the same way."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import pytest

from tests.bundles import NOW, make_bundle
from tests.conftest import Command
from workbench.bundle import run_named, runs_named
from workbench.cli.app import VERBS
from workbench.cli.runs import RUNS
from workbench.errors import InputError

ONE = {
    "runs show": "cli.runs_show", "runs diff a": "cli.runs_diff", "runs tag": "cli.runs_remarks",
    "runs note": "cli.runs_remarks", "runs good": "cli.runs_remarks",
    "runs bad": "cli.runs_remarks",
    "ingest take.csv --into": "cli.ingest",
}  # fmt: skip
"""Verbs that take one run -> module that asks which; what the verb takes besides is in AFTER."""
SEVERAL = {
    "review": "cli.review", "diagnose": "cli.diagnose", "identify": "cli.identify",
    "calibrate": "cli.calibrate", "resonances": "cli.resonances", "runs verify": "cli.runs_show",
    "runs export --to x.zip": "cli.runs_export", "run hop.yaml --resume": "run.course",
}  # fmt: skip
AFTER = {"runs tag": ["paper"], "runs note": ["loose"]}
WITHOUT = {"run", "ingest", "live", "investigate", "simulate", "modes", "optimize", "thesis",
           "panel", "schema", "doctor", "runs", "supply", "template",
           "runs list", "runs rebuild"}  # fmt: skip
"""Verbs that take no run as they are; `run --resume` and `ingest --into` do."""
HOP = "schema: workbench/protocol-1\ntitle: Hop\nsteps:\n  - run: {mode: hop, speed: 17 rad/s}\n"


class Bench(NamedTuple):
    """A folder that commands are given in, and its runs."""

    first: Path
    others: list[Path]


@pytest.fixture
def bench(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Bench:
    """Three runs: a hop, and two of the protocol `scan`."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "hop.yaml").write_text(HOP, encoding="utf-8")
    first = make_bundle(Path("runs"), "a-hop", protocol="hop.yaml", experiment="20260312-e1")
    others = [
        make_bundle(Path("runs"), name, NOW.replace(minute=20 + k), protocol="scan.yaml",
                    experiment="20260312-e2")
        for k, name in enumerate(("a-drop", "a-decay"))
    ]  # fmt: skip
    return Bench(first.path, [one.path for one in others])


def test_every_verb_is_looked_at() -> None:
    known = {word for verb in (*ONE, *SEVERAL) for word in (verb, " ".join(verb.split()[:2]))}
    every = {*VERBS, *(f"runs {name}" for name in RUNS)}
    assert every - WITHOUT - known == set()


def meant_by(
    workbench: Command, monkeypatch: pytest.MonkeyPatch, verb: str, word: str
) -> list[Path]:
    """Return the runs that a verb takes a word for; it is stopped when it knows them."""
    several, meant = verb in SEVERAL, list[Path]()

    def asked(words: Any, root: Path) -> None:
        meant[:] = runs_named(words, root) if several else [run_named(words, root)]
        raise InputError("that is known now")

    name = "runs_named" if several else "run_named"
    monkeypatch.setattr(f"workbench.{(SEVERAL | ONE)[verb]}.{name}", asked)
    words = verb.replace("diff a", f"diff {word}").split()
    answer = workbench(*words, word, *AFTER.get(verb, ()))
    assert "that is known now" in answer.err
    return meant


@pytest.mark.parametrize("verb", [*ONE, *SEVERAL])
def test_a_run_is_meant_by_number_name_part_and_path(
    workbench: Command, monkeypatch: pytest.MonkeyPatch, bench: Bench, verb: str
) -> None:
    for word in ("1", bench.first.name, "a-ho", str(bench.first), "20260312-e1"):
        assert meant_by(workbench, monkeypatch, verb, word) == [bench.first], word


@pytest.mark.parametrize("verb", SEVERAL)
def test_several_are_meant_by_folder_protocol_and_experiment(
    workbench: Command, monkeypatch: pytest.MonkeyPatch, bench: Bench, verb: str
) -> None:
    assert meant_by(workbench, monkeypatch, verb, "runs") == [bench.first, *bench.others]
    for word in ("scan", "scan.yaml", "20260312-e2"):
        assert meant_by(workbench, monkeypatch, verb, word) == bench.others, word


@pytest.mark.parametrize("verb", [*ONE, *SEVERAL])
@pytest.mark.usefixtures("bench")
def test_a_wrong_word_is_answered_in_the_same_way(workbench: Command, verb: str) -> None:
    told = {
        "gone": "gone: no run, folder of runs, protocol or experiment of that name in runs, which "
        "holds 3 runs; there are the protocols hop, scan; `workbench runs list` shows them",
        "a-": "'a-' fits 3 runs in runs: 2026-03-12_102100_a-decay, 2026-03-12_102000_a-drop, "
        "2026-03-12_101500_a-hop; type more of the name, or its number in `workbench runs list`",
        "4": "run 4: runs holds 3 runs, numbered from 1",
    }
    for word, wrong in told.items():
        words = verb.replace("diff a", f"diff {word}").split()
        answer = workbench(*words, word, *AFTER.get(verb, ()))
        assert (answer.code, answer.out) == (2, "")
        assert answer.err == f"workbench: {wrong}\n"
