"""Every protocol of the project runs on the virtual bench; long ones in part and shorter."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from workbench.bench import VirtualBench, load_bench
from workbench.bundle import verify
from workbench.cli.output import QuietOperator
from workbench.engine import carry_out
from workbench.experiment import Experiment
from workbench.protocol import (
    Plan,
    PlannedPrompt,
    Protocol,
    load,
    load_model,
    load_shape,
    make_plan,
)

ROOT = Path(__file__).resolve().parents[1]
PROTOCOLS = sorted((ROOT / "protocols").glob("*.yaml"))
SHORT_S = 2.0


def ends(plan: Plan) -> Plan:
    """The prompts, the first and the last run, none longer than a moment."""
    kept = {1, len(plan.runs)}
    items = tuple(
        item if isinstance(item, PlannedPrompt) else replace(item, duration=SHORT_S, rest=1.0)
        for item in plan.items
        if isinstance(item, PlannedPrompt) or item.number in kept
    )
    return replace(plan, items=items)


@pytest.mark.parametrize("path", PROTOCOLS, ids=lambda p: p.stem)
def test_a_protocol_runs_on_the_virtual_bench(path: Path, tmp_path: Path) -> None:
    protocol, bench = load(path, Protocol), load_bench("virtual")
    device = VirtualBench(bench.content)
    plan = ends(make_plan(protocol, bench.content, device.voltage_step))
    model, shape = load_model("thesis", tmp_path), load_shape("thesis-initial", tmp_path)
    asked = Experiment(protocol, bench, model, shape, plan)
    done = list(carry_out(asked, device, tmp_path, QuietOperator(), lambda text: None))
    assert len(done) == len(plan.runs)
    for bundle in done:
        assert bundle.manifest["status"] == "complete"
        assert 0 < bundle.manifest["error_mm"] < 20
        assert verify(bundle.path) == []


def test_the_clamped_sweep_goes_up_and_down() -> None:
    bench = load_bench("virtual").content
    path = ROOT / "protocols" / "clamped-sweep.yaml"
    device = VirtualBench(bench)
    plan = make_plan(load(path, Protocol), bench, device.voltage_step)
    names = [run.name for run in plan.runs]
    assert names == names[::-1]
    assert names[0] == "clamped-5.99"
    assert len(names) == 18
