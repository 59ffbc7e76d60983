"""Runs whose takes are recorded from a stream, without anyone at the tracking PC."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from decimal import Decimal
from pathlib import Path

import pytest

from tests.bundles import manifest_of
from tests.tracking.natnet_stub import StubServer, packets, recording
from workbench.bundle import Bundle, verify
from workbench.errors import FileFaults, HardwareError, Interrupted
from workbench.hw import SystemClock, serve
from workbench.hw.simulated import SimulatedRiden
from workbench.run import Experiment, QuietOperator, RealBench, carry_out, load_bench
from workbench.run.bench import VirtualBench
from workbench.schemas import BenchFile, Document, Protocol, load, load_model, load_shape, make_plan
from workbench.tracking import read_take

pytestmark = [
    pytest.mark.xdist_group("alone")  # frames come in real time
]

STEPS = "  - run: {mode: hop, speed: 17 rad/s, rest: 0.8 s, duration: 1.2 s}\n"
FRAME_S = 1 / 120


def experiment(folder: Path, bench: Document[BenchFile]) -> Experiment:
    path = folder / "p.yaml"
    path.write_text(f"schema: workbench/protocol-1\ntitle: Test\nsteps:\n{STEPS}")
    protocol = load(path, Protocol)
    plan = make_plan(protocol, bench.content, Decimal("0.01"))
    model, shape = load_model("thesis", folder), load_shape("thesis-initial", folder)
    return Experiment(protocol, bench, model, shape, plan)


@pytest.fixture
def film(tmp_path: Path) -> list[bytes]:
    """The stream of such a run, filmed on the virtual bench."""
    file = load_bench("virtual")
    assert file.content.virtual is not None
    motive = file.content.virtual.model_copy(update={"export": "motive-1.23"})
    bench = VirtualBench(file.content.model_copy(update={"virtual": motive}))
    asked = experiment(tmp_path, file)
    (bundle,) = carry_out(asked, bench, tmp_path / "virtual", QuietOperator(), lambda text: None)
    return packets(recording(read_take(bundle.take()), (4, 1)))


@pytest.fixture
def supply() -> Iterator[str]:
    """The address of a simulated supply."""
    with serve(SimulatedRiden(clock=SystemClock()), framing="rtu") as address:
        yield address


def lab(root: Path, folder: Path, supply: str, live: str) -> Document[BenchFile]:
    text, _, _ = (
        (root / "workbench" / "run" / "bench-virtual.yaml").read_text().partition("virtual:\n")
    )
    place = f"{{kind: rtu-over-tcp, address: '{supply}'}}"
    path = folder / "lab.yaml"
    path.write_text(text.replace("{kind: simulated}", place) + f"  live: {live}\n")
    return load(path, BenchFile)


def runs(folder: Path, file: Document[BenchFile]) -> Iterator[Bundle]:
    bench = RealBench(file.content, SystemClock())
    bench.streams = False  # nothing is observed; tests/live does that
    return carry_out(
        experiment(folder, file), bench, folder / "runs", QuietOperator(), lambda text: None
    )


def test_a_run_is_recorded_and_its_take_kept_as_an_export(
    root: Path, tmp_path: Path, film: list[bytes], supply: str
) -> None:
    with StubServer(film, pause_s=FRAME_S) as server:
        live = f"{{server: 127.0.0.1, command_port: {server.port}}}"
        (bundle,) = runs(tmp_path, lab(root, tmp_path, supply, live))
    assert manifest_of(bundle)["status"] == "complete"
    assert verify(bundle.path) == []
    take = read_take(bundle.take())
    assert take.version == "1.24"
    assert len(take) > 2.0 / FRAME_S * 0.8
    # 17 rad/s are not reached in 1.2 s of drive; the film's and the twin's motor agree
    real, twin = manifest_of(bundle)["real"], manifest_of(bundle)["twin"]
    assert real["speed_rad_s"] == pytest.approx(twin["speed_rad_s"], abs=0.5)
    assert "natnet recorder" not in [thread.name for thread in threading.enumerate()]


def test_an_interrupted_run_leaves_no_recorder(
    root: Path, tmp_path: Path, film: list[bytes], supply: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupt(clock: SystemClock, seconds: float) -> None:
        assert "natnet recorder" in [thread.name for thread in threading.enumerate()]
        raise KeyboardInterrupt

    with StubServer(film, pause_s=FRAME_S) as server:
        live = f"{{server: 127.0.0.1, command_port: {server.port}}}"
        started = runs(tmp_path, lab(root, tmp_path, supply, live))
        monkeypatch.setattr(RealBench, "start_cameras", _then(interrupt, monkeypatch))
        with pytest.raises(Interrupted, match="the output is off, confirmed"):
            list(started)
    assert "natnet recorder" not in [thread.name for thread in threading.enumerate()]


def _then(interrupt: object, monkeypatch: pytest.MonkeyPatch) -> object:
    """Return `start_cameras` after which the next wait is interrupted."""
    real = RealBench.start_cameras

    def start(bench: RealBench, operator: QuietOperator) -> None:
        real(bench, operator)
        monkeypatch.setattr(SystemClock, "sleep", interrupt)

    return start


def test_a_stream_that_does_not_come_ends_the_run_before_the_motor_turns(
    root: Path, tmp_path: Path, supply: str
) -> None:
    live = "{server: 127.0.0.1, local: 192.0.2.1}"
    with pytest.raises(
        HardwareError, match=r"no NatNet server answers (.|\n)*output is off, confirmed"
    ):
        list(runs(tmp_path, lab(root, tmp_path, supply, live)))


def test_takes_come_one_way_only(root: Path, tmp_path: Path, supply: str) -> None:
    with pytest.raises(FileFaults, match="from the folder `takes` or from `live`, not from both"):
        lab(root, tmp_path, supply, "{server: 127.0.0.1}\n  takes: exports")
