"""Each thing that can happen on the wire or at the supply while a run drives.

What is looked at: the voltage at the terminals, the exit code, the journal and the message.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.bundles import journal_of, manifest_of
from tests.conftest import Answer, Command
from workbench.bundle import Bundle, verify
from workbench.hw import SimulatedFault, SimulatedSupply
from workbench.hw.simulated import SimulatedRiden, SimulatedScpi
from workbench.run import bench as bench_module
from workbench.run import load_bench
from workbench.run.bench import VirtualBench

pytestmark = pytest.mark.usefixtures("without_views")

PROTOCOL = """\
schema: workbench/protocol-1
title: Faults
steps:
  - run: {mode: hop, speed: 17 rad/s, rest: 1 s, duration: 2 s}
"""
DURING_S = 2.0  # the output is on from 1 s to 3 s
SWITCHED_ON_V = 1.5  # above the voltage that it comes on with

SAFETY, HARDWARE = 4, 3
OFF, LIVE = "the output is off, confirmed", "OUTPUT MAY BE ON"

Happen = Callable[[SimulatedSupply], None]


def fault(which: SimulatedFault, **how: float) -> Happen:
    return lambda device: device.fail(which, **how)  # type: ignore[arg-type]


def swap(device: SimulatedSupply) -> None:
    """Put another supply at the same port: the first link dies, another device answers."""
    assert isinstance(device, SimulatedRiden)
    device._words[2] ^= 1  # of the serial number
    device.fail(SimulatedFault.UNPLUGGED)


# two late answers are sometimes got over: it hangs on which of them meets the question asked again
# model, what happens, exit code, message, state that is told, whether the terminals end live
silent_for_long, late = (
    fault(SimulatedFault.SILENT, times=3),
    fault(SimulatedFault.LATE_REPLY, times=6, delay_s=0.7),
)
busy, damaged = (
    fault(SimulatedFault.EXCEPTION, times=1, code=6),
    fault(SimulatedFault.BAD_CRC, times=3),
)
short, foreign = (
    fault(SimulatedFault.SHORT_REPLY, times=3),
    fault(SimulatedFault.WRONG_UNIT, times=3),
)
errors = fault(SimulatedFault.EXCEPTION, times=3)
refusals = [fault(SimulatedFault.EXCEPTION, times=1, code=code) for code in range(1, 5)]

CASES = {
    "silent": ("RD6006", fault(SimulatedFault.SILENT), SAFETY, "did not confirm off", LIVE, False),
    "silent for long": ("RD6006", silent_for_long, HARDWARE, "no answer", OFF, False),
    "late": ("RD6006", late, HARDWARE, "no answer|answered with 4 registers", OFF, False),
    "bad CRC": ("RD6006", damaged, HARDWARE, "answer damaged", OFF, False),
    "short": ("RD6006", short, HARDWARE, "cut short", OFF, False),
    "wrong unit": ("RD6006", foreign, HARDWARE, "unit 2 answered", OFF, False),
    "busy": ("RD6006", busy, HARDWARE, "exception 6, busy", OFF, False),
    "exception 1": ("RD6006", refusals[0], HARDWARE, "exception 1", OFF, False),
    "exception 2": ("RD6006", refusals[1], HARDWARE, "exception 2", OFF, False),
    "exception 3": ("RD6006", refusals[2], HARDWARE, "exception 3", OFF, False),
    "exception 4": ("RD6006", refusals[3], HARDWARE, "exception 4", OFF, False),
    "OVP": (
        "RD6006",
        fault(SimulatedFault.OVP_TRIP),
        SAFETY,
        r"protection \(OVP\) tripped at",
        OFF,
        False,
    ),
    "OCP": ("RD6006", fault(SimulatedFault.OCP_TRIP), SAFETY, r"\(OCP\) tripped at", OFF, False),
    "panel off": (
        "RD6006",
        fault(SimulatedFault.PANEL_OFF),
        SAFETY,
        "not by this program",
        OFF,
        False,
    ),
    "panel volts": (
        "RD6006",
        fault(SimulatedFault.PANEL_VOLTAGE),
        SAFETY,
        "changed it at",
        OFF,
        False,
    ),
    "power cycle": (
        "RD6006",
        fault(SimulatedFault.POWER_CYCLE),
        SAFETY,
        "not by this program",
        OFF,
        False,
    ),
    "times ten": ("RD6006", fault(SimulatedFault.TIMES_TEN), SAFETY, "a factor of ten", OFF, False),
    "a tenth": ("RD6006", fault(SimulatedFault.A_TENTH), SAFETY, "a factor of ten", OFF, False),
    "stuck output": ("RD6006", fault(SimulatedFault.STUCK_OUTPUT), SAFETY, "MAY BE ON", LIVE, True),
    "false off": (
        "RD6006",
        fault(SimulatedFault.FALSE_OFF),
        SAFETY,
        "its terminals are live",
        LIVE,
        True,
    ),
    "frozen": (
        "RD6006",
        fault(SimulatedFault.FROZEN_READING),
        SAFETY,
        "did not confirm off",
        LIVE,
        False,
    ),
    "unplugged": (
        "RD6006",
        fault(SimulatedFault.UNPLUGGED),
        SAFETY,
        "did not confirm off",
        LIVE,
        True,
    ),
    "swapped": ("RD6006", swap, SAFETY, "did not confirm off", LIVE, True),
    "DPS, OVP": ("DPS5005", fault(SimulatedFault.OVP_TRIP), SAFETY, r"\(OVP\) tripped", OFF, False),
    "Hanmatek, OCP": (
        "HM305P",
        fault(SimulatedFault.OCP_TRIP),
        SAFETY,
        r"\(OCP\) tripped",
        OFF,
        False,
    ),
    "Korad, trip": (
        "KA3005P",
        fault(SimulatedFault.OCP_TRIP),
        SAFETY,
        "not by this|stay on",
        OFF,
        False,
    ),
    "Korad, silent": (
        "KA3005P",
        fault(SimulatedFault.SILENT),
        SAFETY,
        "not confirm off",
        LIVE,
        False,
    ),
    "SCPI, OVP": (
        "E36312A",
        fault(SimulatedFault.OVP_TRIP),
        SAFETY,
        r"\(OVP\) tripped",
        OFF,
        False,
    ),
    "SCPI, error": ("DP832", errors, HARDWARE, "no answer to it|does not answer", OFF, False),
}


def bench_with(model: str, folder: Path) -> Path:
    """Write the virtual bench with another supply."""
    own = Path(bench_module.__file__).with_name("bench-virtual.yaml").read_text(encoding="utf-8")
    assert "model: RD6006" in own
    path = folder / "lab.yaml"
    path.write_text(own.replace("model: RD6006", f"model: {model}"), encoding="utf-8")
    return path


class Watched(VirtualBench):
    """A virtual bench on which something happens while the output is on."""

    def let_happen(self, happen: Happen) -> None:
        sleep, pending = self.clock.sleep, [happen]

        def slept(seconds: float) -> None:
            sleep(seconds)
            driven = self.device.output.voltage > SWITCHED_ON_V
            if pending and self.clock.now() >= DURING_S and driven:
                pending.pop()(self.device)

        self.clock.sleep = slept  # type: ignore[method-assign]


def run_on(
    bench: VirtualBench, lab: Path, workbench: Command, monkeypatch: pytest.MonkeyPatch
) -> Answer:
    """Carry the protocol out on a bench; the bundle lies in `runs` beside its file."""
    monkeypatch.setattr("workbench.run.bench.make_bench", lambda content: bench)
    protocol = lab.with_name("p.yaml")
    protocol.write_text(PROTOCOL)
    return workbench("run", protocol, "--bench", lab, "--runs", lab.with_name("runs"))


def test_one_late_answer_is_dropped_and_the_run_goes_on(
    tmp_path: Path, workbench: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    lab = bench_with("RD6006", tmp_path)
    bench = Watched(load_bench(str(lab)).content)
    bench.let_happen(fault(SimulatedFault.LATE_REPLY, times=1, delay_s=0.7))
    answer = run_on(bench, lab, workbench, monkeypatch)
    assert answer.code == 0, answer.err
    wire = next((tmp_path / "runs").glob("*/wire.log")).read_text(encoding="utf-8")
    lines = [json.loads(line) for line in wire.splitlines()]
    dropped = [line["bytes"] for line in lines if line["way"] == "discarded"]
    assert any(one.startswith("01 03") for one in dropped)
    assert not bench.device.output.on


@pytest.mark.parametrize("name", CASES)
def test_a_fault_while_the_output_is_on(
    name: str, tmp_path: Path, workbench: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    model, happen, code, words, state, live = CASES[name]
    lab = bench_with(model, tmp_path)
    bench = Watched(load_bench(str(lab)).content)
    bench.let_happen(happen)
    answer = run_on(bench, lab, workbench, monkeypatch)
    told = " ".join(answer.err.split())
    assert answer.code == code, told
    assert re.search(words, told), told
    assert state in told, told
    assert (bench.device.history[-1][1] > 0) == live
    bundle = Bundle.open(next((tmp_path / "runs").glob("*hop*")))
    assert verify(bundle.path) == []
    assert manifest_of(bundle)["status"] == ("safety-stop" if code == SAFETY else "failed")
    assert manifest_of(bundle)["output_off"] == ("unconfirmed" if state == LIVE else "confirmed")
    events = {event["event"]: event for event in journal_of(bundle)}
    assert events["output_off"]["confirmed"] == (state == OFF)
    assert "output_on" in events
    assert (bundle.path / "wire.log").stat().st_size > 0


@pytest.mark.parametrize("model", ["DPS5005", "HM305P", "KA3005P", "E36312A", "SPE6103"])
def test_a_run_with_each_family_ends_with_the_output_off(
    model: str, tmp_path: Path, workbench: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    lab = bench_with(model, tmp_path)
    bench = VirtualBench(load_bench(str(lab)).content)
    answer = run_on(bench, lab, workbench, monkeypatch)
    assert answer.code == 0, answer.err
    assert max(volts for _, volts in bench.device.history) == pytest.approx(4.5225, abs=0.003)
    assert bench.device.history[-1][1] == 0


def test_another_channel_selected_at_the_front_changes_nothing(
    tmp_path: Path, workbench: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    lab = bench_with("HMP4040", tmp_path)
    bench = Watched(load_bench(str(lab)).content)
    bench.let_happen(fault(SimulatedFault.PANEL_CHANNEL))
    answer = run_on(bench, lab, workbench, monkeypatch)
    assert answer.code == 0, answer.err
    assert isinstance(bench.device, SimulatedScpi)
    assert bench.device.history[-1][1] == 0
    assert bench.device.channels[2].history[1:] == []
    bundle = Bundle.open(next((tmp_path / "runs").glob("*hop*")))
    assert manifest_of(bundle)["output_off"] == "confirmed"
