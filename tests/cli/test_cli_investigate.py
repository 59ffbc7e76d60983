"""The closed loop on a virtual bench whose robot has something that its model lacks."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from tests.bundles import manifest_of
from workbench.bundle import Bundle
from workbench.cli.app import app
from workbench.investigate import ProposedRun, next_protocol
from workbench.run import load_bench
from workbench.schemas import Protocol, load

CUBIC = 60.0  # [N m/rad^3]; ring-downs of one small size take it for stiffness
FIRST = """\
schema: workbench/protocol-1
title: Ring-downs of one size
steps:
  - run: {mode: decay, pull: 0.4 N, rest: 1 s, duration: 3 s, repeats: 2}
  - run: {mode: decay, pull: 0.4 N, rest: 1 s, duration: 3 s, role: held_out}
"""
MENU = (ProposedRun("decay", 0.4, 3.0, 1.0), ProposedRun("decay", 1.2, 3.0, 1.0))


def loop(folder: Path, budget: str) -> Result:
    words = ["investigate", "first.yaml", "--bench", "bench.yaml", "--budget", budget, "--json"]
    places = [str(folder / word) if word.endswith(".yaml") else word for word in words]
    return CliRunner().invoke(app, [*places, "--out", str(folder / "out")])


@pytest.fixture
def lab(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a protocol and a bench whose beam hardens."""
    monkeypatch.setattr(next_protocol, "MENU", MENU)
    known = "parameters: {hinge_stiffness: 9.31, hinge_damping: 0.0036, top_mass: 0.089, "
    told = load_bench("virtual").text
    assert known in told
    hidden = f"effects: {{hinge_cubic_stiffness: {{k3: {CUBIC}}}}}\n  parameters: {{"
    (tmp_path / "bench.yaml").write_text(told.replace(known, hidden))
    (tmp_path / "first.yaml").write_text(FIRST)
    return tmp_path


@pytest.mark.long
def test_a_cause_that_the_first_runs_cannot_show_is_found_by_those_proposed(lab: Path) -> None:
    """The first runs exist already, as after an interruption: the loop goes on from them."""
    words = ["run", "first.yaml", "--bench", "bench.yaml"]
    places = [str(lab / word) if word.endswith(".yaml") else word for word in words]
    made = CliRunner().invoke(app, [*places, "--runs", str(lab / "out" / "runs")])
    assert made.exit_code == 0, made.output
    before = {path.name for path in (lab / "out" / "runs").iterdir() if path.is_dir()}

    ended = loop(lab, "30min")
    assert ended.exit_code == 0, ended.output
    found = json.loads(ended.stdout)
    assert [(one["round"], one["answer"]) for one in found["rounds"]] == [
        (1, "CLEAN"),
        (2, "NAMED"),
    ]
    words = r"CLEAN: .*nothing is missing above what the noise accounts for"
    assert re.search(words, " ".join(ended.stderr.split()))
    first = found["rounds"][0]
    assert first["minutes"] == pytest.approx((3 * (1 + 3 + 90) + 180) / 60)
    proposed = load(Path(first["next_protocol"]), Protocol).content
    assert [step.run.pull for step in proposed.steps if step.run is not None] == [1.2]
    assert first["next_experiment"]["separations"]
    assert found["ended"] == "one cause remains"
    cause = found["causes"][0]
    assert cause["effect"] == "hinge_cubic_stiffness"
    low, high = cause["parameters"]["k3"]["interval90"]
    assert low < CUBIC < high
    after = {path.name for path in (lab / "out" / "runs").iterdir() if path.is_dir()}
    facts = [manifest_of(Bundle.open(lab / "out" / "runs" / name)) for name in after - before]
    assert [one["protocol"] for one in facts] == 2 * ["round-1-next.yaml"]
    assert all((lab / "out" / "runs" / name / "report.html").exists() for name in after)


def test_a_budget_that_the_first_protocol_exceeds_starts_nothing(lab: Path) -> None:
    result = loop(lab, "5min")
    assert "takes about 8 min of bench time" in str(result.exception)
    assert not (lab / "out").exists()
    assert "--budget: 30 has no unit" in str(loop(lab, "30").exception)
