"""A proposal as a file: valid, of the same robot, within what the bench allows."""

from __future__ import annotations

from dataclasses import replace
from datetime import datetime
from pathlib import Path

import pytest

from workbench.bundle import Bundle
from workbench.errors import InputError
from workbench.investigate import MENU, Following, Proposal, ProposedRun
from workbench.investigate.next_protocol import bench_of, menu_of, name_for, write_next
from workbench.investigate.proposed import Separation
from workbench.run import load_bench, make_bench
from workbench.schemas import ModelFile, PlannedPrompt, Protocol, load, load_model, make_plan

TRIALS = (
    ProposedRun("decay", 0.4, 8.0, 2.0),
    ProposedRun("drop", 0.02, 8.0, 2.0),
    ProposedRun("clamped", 13.0, 8.0, 2.0),
    ProposedRun("hop", 17.0, 8.0, 2.0),
)
PROPOSAL = Proposal(TRIALS, 12.4, (Separation("air_drag", "root_play", 6.3, 0.93),), 0.93)


def test_the_file_is_a_protocol_that_the_bench_carries_out_as_proposed(tmp_path: Path) -> None:
    path = tmp_path / "new" / "april-next.yaml"
    written = write_next(path, "april", PROPOSAL, "thesis", "thesis-initial")
    read = load(path, Protocol)
    assert read.content == written.content
    assert "if air_drag is true, root_play stays 6.3 sigma off" in read.text
    lab = load_bench("virtual").content
    plan = make_plan(read, lab, make_bench(lab).voltage_step)
    # speeds are those of the nearest voltage that the supply can set
    told = {(run.mode, run.action.name, run.rest, run.duration, run.role) for run in plan.runs}
    assert told == {
        ("clamped", "12.98", 2.0, 8.0, "train"),
        ("hop", "16.99", 2.0, 8.0, "train"),
        ("decay", "0.4N", 2.0, 8.0, "train"),
        ("drop", "20mm", 2.0, 8.0, "train"),
    }
    assert plan.warnings == ()
    prompts = [item.text for item in plan.items if isinstance(item, PlannedPrompt)]
    assert prompts[0].startswith("Clamp the foot")


def test_a_protocol_is_never_written_over(tmp_path: Path) -> None:
    path = tmp_path / "april-next.yaml"
    write_next(path, "april", PROPOSAL, "thesis", "thesis-initial")
    with pytest.raises(InputError, match=r"april-next\.yaml: exists; a protocol is never changed"):
        write_next(path, "april", PROPOSAL, "thesis", "thesis-initial")


def test_a_name_with_signs_of_yaml_is_a_title(tmp_path: Path) -> None:
    name = 'it\'s: "odd" # {' + "long " * 40
    document = write_next(tmp_path / "odd.yaml", name, PROPOSAL, "thesis", "thesis-initial")
    assert document.content.title.startswith('Next experiment of it\'s: "odd" # {')


def test_the_menu_holds_only_what_the_bench_allows() -> None:
    lab = load_bench("virtual")
    assert menu_of(None) == list(MENU)
    assert menu_of(lab) == list(MENU)
    limits = lab.content.supply.limits.model_copy(update={"voltage": 4.0})
    weak = lab.content.supply.model_copy(update={"limits": limits})
    document = load_bench("virtual")
    object.__setattr__(document, "content", lab.content.model_copy(update={"supply": weak}))
    speeds = [trial.amount for trial in menu_of(document) if trial.mode == "clamped"]
    assert speeds == [6.0, 7.0, 11.0, 12.0, 13.0, 14.0]  # 4.4 rad/s/V * 4 V - 2.9 rad/s = 14.7
    assert sum(trial.mode == "decay" for trial in menu_of(document)) == 6


def test_the_bench_is_that_of_the_last_run_that_has_one(tmp_path: Path) -> None:
    bundles = [Bundle.create(tmp_path, name, datetime(2026, 11, 21)) for name in ("sheet", "bench")]
    assert bench_of(bundles) is None
    bundles[0].write_document("bench", load_bench("virtual").text)
    found = bench_of(bundles)
    assert found is not None
    assert found.content.name == "virtual"


def test_a_model_is_named_so_that_the_new_file_finds_the_very_same(tmp_path: Path) -> None:
    text = load_model("thesis", Path()).text
    same, other = tmp_path / "a" / "model.yaml", tmp_path / "b" / "model.yaml"
    for path, content in ((same, text), (other, text + "\n# another\n")):
        path.parent.mkdir()
        path.write_bytes(content.encode())
    assert name_for(same, ModelFile, tmp_path) == "thesis"
    (tmp_path / "out").mkdir()
    name = name_for(other, ModelFile, tmp_path / "out")
    assert name == "../b/model.yaml"
    assert load_model(name, tmp_path / "out").text.endswith("# another\n")


def test_the_sentence_tells_runs_minutes_and_the_pairs_that_part(tmp_path: Path) -> None:
    hopeless = Separation("root_play", "air_drag", 0.2, 0.03)
    proposal = replace(PROPOSAL, separations=(hopeless, *PROPOSAL.separations))
    document = write_next(tmp_path / "n.yaml", "n", proposal, "thesis", "thesis-initial")
    assert Following(proposal, document).sentence == (
        "decay 0.4 N, drop 20 mm, clamped 13 rad/s, hop 17 rad/s, each 2 times, about 12 min: "
        "probability of rejecting a wrong cause 93 % "
        "(if air_drag is true, root_play is 6.3 sigma off)"
    )
