"""Which runs a diagnosis trusts, on a rig that is written down: told, left out, or refused."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tests.conftest import Command
from workbench.data_quality.facts import Facts, Fault
from workbench.data_quality.sound_runs import soundness
from workbench.errors import DataFault, InputError

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "hardening_spring"


def facts(count: int = 4) -> list[Facts]:
    """Runs of one channel, the last of them held out."""
    rng = np.random.default_rng(0)
    return [
        Facts(f"run_{k}", "swing", "held_out" if k == count - 1 else "train", ("x_m",),
              rng.normal(size=(600, 1)))
        for k in range(count)
    ]  # fmt: skip


def rig(runs: Sequence[Facts], *faults: Fault) -> Any:
    """A rig of some runs."""
    return SimpleNamespace(facts=runs, faults=lambda: list(faults))


def unseen(run: Facts) -> Facts:
    values = run.values.copy()
    values[200:] = np.nan
    return replace(run, values=values)


def changed(change: Callable[[Facts], Facts], *runs: int) -> Any:
    return rig([change(run) if k in runs else run for k, run in enumerate(facts())])


def test_honest_runs_are_all_trusted() -> None:
    sound = soundness(rig(facts()))
    assert (sound.count, sound.faults) == (4, ())


def test_a_run_that_says_little_is_left_out() -> None:
    evidence = r"most of it was not seen: x_m \(33 %\) of its samples are there"
    sound = soundness(changed(unseen, 1))
    assert sound.count == 3
    assert [run for run, _ in sound.evidence] == ["run_1"]
    with pytest.raises(DataFault, match=f"run_1: {evidence}"):
        soundness(changed(unseen, 1, 2))


def test_a_few_gaps_are_no_fault() -> None:
    def gaps(run: Facts) -> Facts:
        values = run.values.copy()
        values[::7] = np.nan
        return replace(run, values=values)

    assert soundness(changed(gaps, 0, 1, 2, 3)).faults == ()


def test_one_take_given_twice_is_told() -> None:
    first, other, third, held = facts()
    sound = soundness(rig([first, replace(other, values=first.values), third, held]))
    assert [fault.run for fault in sound.faults] == [1]
    assert "its samples are those of run_0" in sound.evidence[0][1]


def test_a_channel_that_was_never_seen_is_refused() -> None:
    never = [replace(run, values=np.full_like(run.values, np.nan)) for run in facts()]
    with pytest.raises(InputError, match="x_m was seen in none of run_0, run_1, run_2, run_3"):
        soundness(rig(never))


def test_what_sound_runs_say_stands_behind_the_faults() -> None:
    sound = soundness(rig(facts(), Fault(1, "the sheet says 2 cm, but it was 5")))
    told = sound.before("NAMED", "creep")
    assert told == (
        "run_1 is left out: the sheet says 2 cm, but it was 5. The other 3 runs alone answer "
        "NAMED: creep"
    )


@pytest.mark.parametrize(
    ("faulty", "why"),
    [
        ((0, 1), "the other 2 are too few to fit and to judge by"),
        ((3,), "the other 3 are too few to fit and to judge by"),
    ],
)
def test_too_few_sound_runs_are_not_diagnosed(faulty: tuple[int, ...], why: str) -> None:
    lies = [Fault(k, f"lie {k}") for k in faulty]
    with pytest.raises(DataFault, match=why) as refused:
        soundness(rig(facts(), *lies))
    assert refused.value.evidence == tuple((f"run_{k}", f"lie {k}") for k in faulty)


def test_where_many_runs_are_at_fault_the_others_are_not_believed() -> None:
    runs = facts(8)
    assert soundness(rig(runs, Fault(0, "a"), Fault(1, "b"))).count == 6
    with pytest.raises(DataFault, match=r"3 of 8 runs .* so the other 5 are not believed either"):
        soundness(rig(runs, Fault(0, "a"), Fault(1, "b"), Fault(4, "c")))


def test_the_command_answers_with_the_evidence(workbench: Command, tmp_path: Path) -> None:
    folder = tmp_path / "spring"
    shutil.copytree(EXAMPLE, folder)
    for copy in ("sweep-strong.csv", "sweep-middle.csv"):
        shutil.copy(folder / "sweep-weak.csv", folder / copy)
    words = ("diagnose", "--rig", folder / "rig.yaml", "--out", tmp_path / "out")
    answer = workbench(*words, "--json")
    assert answer.code == 0, answer.err
    assert answer.json["answer"] == "DATA_FAULT"
    assert answer.json["causes"] == []
    assert [fault["run"] for fault in answer.json["faults"]] == ["sweep-strong", "sweep-middle"]
    assert "its samples are those of sweep-weak" in answer.json["reason"]
    people = workbench(*words)
    assert people.code == 0
    assert "DATA_FAULT: 2 of 4 runs are not what they are said to be" in people.err
