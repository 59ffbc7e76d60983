"""Which runs a diagnosis trusts, on a rig that is written down: told, left out, or refused."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.conftest import Command
from tests.diagnose.paper import PaperRig, measured
from workbench.diagnose import diagnose
from workbench.diagnose.rig import Fault, Observed
from workbench.diagnose.soundness import soundness
from workbench.errors import DataFault, InputError

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "hardening_spring"


def rig_with(change: Callable[[Observed], Observed], *runs: int) -> PaperRig:
    """A rig of four runs, three of them to fit and one held out, some of them changed."""
    rig = measured(1)
    changed = [change(run) if k in runs else run for k, run in enumerate(rig.runs)]
    return replace(rig, runs=tuple(changed))


def unseen(run: Observed) -> Observed:
    valid = run.valid.copy()
    valid[200:] = False
    return replace(run, valid=valid)


def never_seen(run: Observed) -> Observed:
    return replace(run, valid=np.zeros_like(run.valid))


def cut(run: Observed) -> Observed:
    kept = slice(0, 40)
    return replace(run, times=run.times[kept], values=run.values[kept], valid=run.valid[kept])


def test_honest_runs_are_all_trusted() -> None:
    sound = soundness(measured(1))
    assert (sound.train, sound.held_out, sound.faults) == ((0, 1, 2), (3,), ())


@pytest.mark.parametrize(
    ("change", "evidence"),
    [
        (unseen, r"most of it was not seen: x_m \(33 %\) of its samples are there"),
        (cut, "it has only 40 samples; 60 are the least"),
    ],
)
def test_a_run_that_says_little_is_left_out(
    change: Callable[[Observed], Observed], evidence: str
) -> None:
    sound = soundness(rig_with(change, 1))
    assert (sound.train, sound.held_out) == ((0, 2), (3,))
    assert [run for run, _ in sound.evidence] == ["run_1"]
    with pytest.raises(DataFault, match=f"run_1: {evidence}"):
        soundness(rig_with(change, 1, 2))


def test_a_few_gaps_are_no_fault() -> None:
    def gaps(run: Observed) -> Observed:
        valid = run.valid.copy()
        valid[::7] = False
        return replace(run, valid=valid)

    assert soundness(rig_with(gaps, 0, 1, 2, 3)).faults == ()


def test_one_take_given_twice_is_told() -> None:
    rig = measured(1)
    first, other, third, held = rig.runs
    copy = replace(other, values=first.values, valid=first.valid)
    sound = soundness(replace(rig, runs=(first, copy, third, held)))
    assert sound.train == (0, 2)
    assert sound.evidence[0][0] == "run_1"
    assert "its samples are those of run_0" in sound.evidence[0][1]


def test_a_channel_that_was_never_seen_is_refused() -> None:
    with pytest.raises(InputError, match="x_m was seen in none of run_0, run_1, run_2, run_3"):
        soundness(rig_with(never_seen, 0, 1, 2, 3))


def test_with_a_run_at_fault_the_others_are_diagnosed_and_no_cause_is_named(
    tmp_path: Path,
) -> None:
    rig = measured(1, {"creep": 0.2})
    run = rig.runs[1]
    broken = replace(run, values=run.values + 0.05 * np.sin(3 * run.times)[:, None])
    lying = replace(
        rig,
        runs=(rig.runs[0], broken, *rig.runs[2:]),
        told=(Fault(1, "the sheet says 2 cm, but it was 5"),),
    )
    found = diagnose(lying, tmp_path)
    answer = found.answer
    assert answer.kind == "DATA_FAULT"
    assert answer.causes == ("creep",)
    assert answer.reason.startswith("run_1 is left out: the sheet says 2 cm, but it was 5. The ot")
    assert "The other 3 runs alone answer NAMED: creep" in answer.reason
    quantity = found.quantities["creep"]["amount"]
    assert quantity.low < 0.2 < quantity.high
    words = found.as_json()
    assert words["faults"] == [{"run": "run_1", "evidence": "the sheet says 2 cm, but it was 5"}]
    assert json.dumps(words)
    believed = diagnose(replace(lying, told=()), tmp_path / "believed")
    assert believed.answer.causes != ("creep",)  # so leaving it out is what found the cause


def test_the_noise_of_a_run_at_fault_does_not_count(tmp_path: Path) -> None:
    rig = measured(1)
    run = rig.runs[1]
    shaken = replace(run, rest=100 * run.rest)
    found = diagnose(
        replace(rig, runs=(rig.runs[0], shaken, *rig.runs[2:]), told=(Fault(1, "it was shaken"),)),
        tmp_path,
    )
    plain = diagnose(replace(rig, told=(Fault(1, "it was shaken"),)), tmp_path / "plain")
    assert found.noise[0].sigma == plain.noise[0].sigma
    assert found.answer.reason.endswith(plain.answer.reason[-20:])


@pytest.mark.parametrize(
    ("faulty", "why"),
    [
        ((0, 1), "the other 2 are too few to fit and to judge by"),
        ((3,), "the other 3 are too few to fit and to judge by"),
    ],
)
def test_too_few_sound_runs_are_not_diagnosed(faulty: tuple[int, ...], why: str) -> None:
    rig = replace(measured(1), told=tuple(Fault(k, f"lie {k}") for k in faulty))
    with pytest.raises(DataFault, match=why) as refused:
        soundness(rig)
    assert refused.value.evidence == tuple((f"run_{k}", f"lie {k}") for k in faulty)


def test_where_many_runs_are_at_fault_the_others_are_not_believed() -> None:
    rig = measured(1)
    again = tuple(replace(run, name=f"more_{k}", values=run.values + 1e-9)
                  for k, run in enumerate(rig.runs))  # fmt: skip
    twice = replace(rig, runs=(*rig.runs, *again))
    one_lies = replace(twice, told=(Fault(0, "a"), Fault(1, "b")))
    assert soundness(one_lies).train == (2, 4, 5, 6)
    many_lie = replace(twice, told=(Fault(0, "a"), Fault(1, "b"), Fault(4, "c")))
    with pytest.raises(DataFault, match=r"3 of 8 runs .* so the other 5 are not believed either"):
        soundness(many_lie)


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
