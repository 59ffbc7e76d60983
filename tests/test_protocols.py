"""Every protocol of the project runs on the virtual bench; long ones in part and shorter."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from _pytest.mark import ParameterSet

from tests.bundles import manifest_of
from workbench.bundle import verify
from workbench.run import QuietOperator, carry_out, load_bench, read_experiment
from workbench.run.bench import VirtualBench
from workbench.schemas import Item, Plan, PlannedDrive, PlannedPrompt, PlannedRun

ROOT = Path(__file__).resolve().parents[1]
PROTOCOLS = sorted((ROOT / "protocols").glob("*.yaml"))
EXAMPLES = [ROOT / "docs" / "examples" / "speeds.yaml"]
ALWAYS = ("hop-17", "clamped-sweep", "free-decay")
"""Carried out in the first tier; all others in the second."""
SHORT_S = 2.0


def ends(plan: Plan) -> Plan:
    """The prompts, the first and the last run, none longer than a moment."""
    kept = {1, len(plan.runs)}
    items = [
        short(item) if isinstance(item, PlannedRun) else item
        for item in plan.items
        if not isinstance(item, PlannedRun) or item.number in kept
    ]
    return replace(plan, items=tuple(items))


def short(run: PlannedRun) -> PlannedRun:
    """A run of a moment; a staircase comes to its second level."""
    action, duration = run.action, SHORT_S
    if isinstance(action, PlannedDrive) and len(action.levels) > 1:
        first, second = action.levels[:2]
        steps = [(t - max(0, min(t - SHORT_S, second.since - SHORT_S)), v) for t, v in action.steps]
        kept = tuple(step for step in steps if step[0] < 2 * SHORT_S)
        levels = (first, second._replace(since=SHORT_S))
        action, duration = PlannedDrive(levels, kept), 2 * SHORT_S
    return replace(run, action=action, duration=duration, rest=1.0)


def prompts(item: Item) -> list[str]:
    if isinstance(item, PlannedRun):
        return [one.text for one in (*item.before, *item.after)]
    return [item.text] if isinstance(item, PlannedPrompt) else []


@pytest.mark.parametrize("path", [*PROTOCOLS, *EXAMPLES], ids=lambda p: p.stem)
def test_a_protocol_is_read_and_planned(path: Path) -> None:
    bench = load_bench("virtual")
    plan = read_experiment(path, bench, VirtualBench(bench.content).voltage_step).plan
    assert len(plan.runs) > 0
    assert plan.warnings == (), "what is meant for every run is asked before every run"
    asked = [text for item in plan.items for text in prompts(item)]
    assert [text for text in asked if not text[0].isupper() or text[-1] not in ".?"] == [], (
        "a comma in an unquoted list makes two prompts of one sentence"
    )


def carried_out(path: Path) -> ParameterSet:
    return pytest.param(path, id=path.stem, marks=() if path.stem in ALWAYS else pytest.mark.long)


@pytest.mark.parametrize("path", [carried_out(path) for path in PROTOCOLS])
def test_a_protocol_runs_on_the_virtual_bench(path: Path, tmp_path: Path) -> None:
    bench = load_bench("virtual")
    device = VirtualBench(bench.content)
    asked = read_experiment(path, bench, device.voltage_step)
    plan = ends(asked.plan)
    asked = replace(asked, plan=plan)
    done = list(carry_out(asked, device, tmp_path, QuietOperator(), lambda text: None))
    assert len(done) == len(plan.runs)
    for bundle in done:
        assert manifest_of(bundle)["status"] == "complete"
        assert 0 < manifest_of(bundle)["error_mm"] < 20
        assert verify(bundle.path) == []


def test_the_clamped_sweep_goes_up_and_down() -> None:
    bench = load_bench("virtual")
    path = ROOT / "protocols" / "clamped-sweep.yaml"
    device = VirtualBench(bench.content)
    plan = read_experiment(path, bench, device.voltage_step).plan
    names = [run.name for run in plan.runs]
    assert names == names[::-1]
    assert names[0] == "clamped-5.99"
    assert len(names) == 18
