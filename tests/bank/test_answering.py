"""What the bank does around an answer: dumb engines, an effect turned round, several draws."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from benchmarks.bank import __main__ as bank
from benchmarks.bank import one_case
from benchmarks.bank.__main__ import reported_of
from benchmarks.bank.answering import behind, flip
from benchmarks.bank.baselines import bic, single
from benchmarks.bank.cases import draw_cases
from benchmarks.bank.one_case import engine
from benchmarks.bank.score import judge, scores
from benchmarks.bank.tables import page
from tests.pendulum import PENDULUMS, rig_of
from workbench.diagnose import diagnose
from workbench.mechanism import load_mechanism
from workbench.sim import EFFECTS
from workbench.sim.effects.effect import Values

pytestmark = pytest.mark.long  # a benchmark tests itself


@pytest.mark.parametrize("name", PENDULUMS)
def test_two_plain_engines_name_what_a_pendulum_has(name: str, tmp_path: Path) -> None:
    found = diagnose(load_mechanism(rig_of(name, tmp_path)), tmp_path / "out")
    assert single(found)["causes"] == [{"effect": "pivot_coulomb_friction", "parameters": {}}]
    listed: Any = bic(found)["causes"]
    assert listed[0]["effect"] == "pivot_coulomb_friction"
    rests = behind(found)
    assert rests["promises"][0][0] == "pivot_coulomb_friction"
    assert rests["motion"]["compared"][0][1] > 8
    json.dumps(rests)


def test_an_effect_that_is_turned_does_the_opposite(monkeypatch: pytest.MonkeyPatch) -> None:
    name, seen = "speed_scale", list[dict[str, float]]()

    def drive(condition: Any, values: Values) -> Any:
        seen.append(dict(values))
        return condition

    monkeypatch.setitem(EFFECTS, name, replace(EFFECTS[name], drive=drive))
    flip(name)
    turned = EFFECTS[name].drive
    assert turned is not None
    turned(SimpleNamespace(), {"share": 0.02})  # pyright: ignore[reportArgumentType]
    assert seen == [{"share": -0.02}]


def test_the_page_tells_of_all_draws_that_were_run(tmp_path: Path) -> None:
    label = {"block": "null", "generator": "twin", "effects": {}, "kind": "", "drawn_sizes": [],
             "expected": {"answers": ["CLEAN"], "listed": [], "named": []}}  # fmt: skip
    said = {"answer": "CLEAN", "causes": [], "seconds": 1.0}
    line = {"answer": said, "label": label, "plain": {"bic": said}, "screening": 2.0, "peak": 3.0}
    for seed in (1, 2):
        line["engine"] = f"state {seed}"
        lines = [{"seed": 1000 * seed, "failed": "at first"}, {"seed": 1000 * seed} | line]
        lines += [{"seed": 1000 * seed + 1, "failed": "no rest"}] * 2
        text = "\n".join(json.dumps(one) for one in lines)
        (tmp_path / f"seed-{seed}.jsonl").write_text(text + "\n", encoding="utf-8")
    turned = json.dumps({"seed": 1000} | line)
    (tmp_path / "seed-1-flip-tether.jsonl").write_text(turned + "\n", encoding="utf-8")
    reported = reported_of(tmp_path)
    assert (reported.drawn, len(reported.judged), reported.seeds) == (4, 2, (1, 2))
    assert reported.failed == ["case 1001: no rest", "case 2001: no rest"]
    assert len(reported.plain["bic"]) == 2
    assert reported.judged[0].screening == 2.0
    assert reported.engines == {"state 1": 1, "state 2": 1}
    assert [(one.effect, len(one.after)) for one in reported.turned] == [("tether", 1)]
    assert "seeds 1, 2: 4 cases drawn, 2 judged by 2 states of the engine." in page(reported)


@pytest.mark.parametrize(
    ("after", "same"),
    [
        ('"""Other words."""\n\nSENTENCES = (\n    "a", "b"\n)  # in short\n', True),
        ('SENTENCES = ("a", "b")\n"""What they say."""\n', True),
        ('SENTENCES = ("a", "c")\n', False),
        ('if True:\n    SENTENCES = ("a", "b")\n', False),
    ],
)
def test_a_state_of_the_engine_is_its_code_not_its_words(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, after: str, same: bool
) -> None:
    monkeypatch.setattr(one_case.workbench, "__file__", str(tmp_path / "__init__.py"))
    (tmp_path / "sim").mkdir()
    source = tmp_path / "sim" / "one.py"
    source.write_text('"""Words."""\n\nSENTENCES = ("a", "b")\n', encoding="utf-8")
    before = engine()
    source.write_text(after, encoding="utf-8")
    assert (engine() == before) == same


@pytest.mark.parametrize("alike", [False, True])
def test_the_page_judges_the_engine_as_it_is_on_its_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, alike: bool
) -> None:
    before = frozenset({"earlier"}) if alike else frozenset[str]()
    monkeypatch.setattr(one_case, "_ALIKE", {engine(): before})
    lines = []
    states = [("long ago", "NONE"), ("earlier", "NONE"), (engine(), "CLEAN")]
    for seed, (state, said) in enumerate(states):
        label = {"seed": seed, "block": "null", "generator": "twin", "effects": {}, "kind": "",
                 "expected": {"answers": ["CLEAN"], "listed": [], "named": []}}  # fmt: skip
        answer = {"answer": said, "causes": [], "seconds": 100.0 * (seed + 1)}
        lines.append(
            json.dumps(
                {"seed": seed, "engine": state, "answer": answer, "label": label, "plain": {}}
            )
        )
    (tmp_path / "seed-1.jsonl").write_text("\n".join(lines) + "\n", encoding="utf-8")
    text = page(reported_of(tmp_path))
    now, _, all_states = text.partition("## By all its states: 3 cases")
    assert f"## The engine as it is: {'2 cases' if alike else '1 case'}\n" in now
    assert ("With those by earlier, which answers alike." in now) == alike
    assert f"| slowest case [s] | 300 of {1 + alike} |" in now
    assert "| slowest case [s] | 300 of 3 |" in all_states


@pytest.mark.parametrize("again", [False, True])
def test_what_an_earlier_engine_answered_is_asked_again_by_its_label(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, again: bool
) -> None:
    monkeypatch.setattr(one_case, "_ALIKE", {engine(): frozenset({"alike"})})
    label = {"block": "null", "generator": "twin", "effects": {}, "kind": "",
             "expected": {"answers": ["CLEAN"], "listed": [], "named": []}}  # fmt: skip
    said = {"answer": {"answer": "CLEAN", "causes": [], "seconds": 1.0}, "plain": {}}
    states = enumerate(["earlier", "alike", engine()], start=1000)
    lines = [
        {"seed": n, "engine": state, "label": {"seed": n} | label} | said for n, state in states
    ]
    lines.append({"seed": 1003, "failed": "no rest"})
    log = tmp_path / "seed-1.jsonl"
    log.write_text("\n".join(map(json.dumps, lines)) + "\n", encoding="utf-8")
    asked = list[tuple[list[int], list[int]]]()

    def keep(cases: Any, file: Path, task: Any, processes: int, known: Any) -> list[Any]:
        assert file == log
        open_cases = sorted(case.seed for case in cases if case.seed not in known)
        asked.append((open_cases, sorted(task.keywords["labels"])))
        return []

    monkeypatch.setattr(bank, "keep_all", keep)
    words = ["bank", "--seed=1", "--cases=5", f"--kept={tmp_path}", f"--page={tmp_path / 'page'}"]
    monkeypatch.setattr("sys.argv", [*words, *(["--again"] if again else [])])
    bank.main()
    assert asked == [([1000], [1000]) if again else ([1004], [])]


def test_a_line_keeps_what_is_scored_and_no_place(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    case = draw_cases(1, 40)[0]
    (tmp_path / "sealed").mkdir()
    (tmp_path / "sealed" / f"{case.name}.json").write_text('{"block": "single"}')
    cause = {"effect": "tether", "confidence": 0.9, "parameters": {}, "sentence": "a cable pulls"}
    said = {"answer": "NAMED", "causes": [cause], "extended_model": str(tmp_path), "seconds": 1.0}
    monkeypatch.setattr(one_case, "_answered", lambda *words: {"answer": said, "plain": {}})
    stopped = tmp_path / "cases" / case.name / "answer" / "answer-model.yaml"
    stopped.parent.mkdir(parents=True)
    stopped.touch()
    line = one_case.run_case(case, tmp_path)
    assert not stopped.exists()
    assert line["answer"]["causes"] == [{"effect": "tether", "confidence": 0.9, "parameters": {}}]
    assert (line["label"], line["engine"]) == ({"block": "single"}, one_case.engine())
    assert str(tmp_path) not in json.dumps(line)


def test_a_case_that_is_not_answered_in_time_counts_as_wrong_and_tells_no_place(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    case = draw_cases(1, 40)[0]
    (tmp_path / "sealed").mkdir()
    label = {"block": "null", "effects": {}, "kind": "",
             "expected": {"answers": ["CLEAN"], "listed": [], "named": []}}  # fmt: skip
    (tmp_path / "sealed" / f"{case.name}.json").write_text(json.dumps(label))
    monkeypatch.setattr(one_case, "_MOST_S", 0.01)
    line = one_case.run_case(case, tmp_path)
    assert line == {
        "seed": case.seed,
        "plain": {},
        "engine": engine(),
        "label": label,
        "answer": {"answer": "LATE", "seconds": 0.01, "causes": []},
    }
    judged = judge(line["answer"], line["label"], line)
    assert not judged.right
    assert not judged.names
    assert {one.name: one.value for one in scores([judged])}["slowest case [s]"] == 0.01
