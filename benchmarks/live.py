"""The live twin on a stream of 120 Hz: latency, losses, processor time, and how soon a fault stops.

    python -m benchmarks.live                 ten minutes, and ten faults
    python -m benchmarks.live --minutes 1     shorter
    python -m benchmarks.live --quick         ten seconds and one fault

from the top folder. A stub sends recorded packets in real time; see `tests/streaming.py` for what
they show. Latencies are from a frame's arrival at this computer. Faults are stopped through the
engine, the guardian and a simulated supply, whose terminals tell when the output went off.
"""

from __future__ import annotations

import argparse
import os
import socket
import subprocess
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import rerun_cli

from tests.streaming import RATE_HZ, fallen, filmed, lab, slipped, task
from tests.tracking.natnet_stub import StubServer, frames, models, server_info
from workbench.errors import SafetyStop
from workbench.hw import SystemClock, serve
from workbench.hw.simulated import SimulatedRiden
from workbench.live import LiveTwin
from workbench.loopback import HERE
from workbench.report import LiveViewer
from workbench.run import QuietOperator, carry_out, load_bench, make_bench, read_experiment
from workbench.schemas import StopWhen
from workbench.tracking import Recorder, Stream, Take

__all__: list[str] = []

ROOT = Path(__file__).resolve().parents[1]
LATENCY_BAR_MS, REACTION_BAR_S = 50.0, 0.3
LIMIT = StopWhen(0.005, 0.2)
REST_S = 2.0
FAULT_S = 2.6  # after the first frame
PROTOCOL = """schema: workbench/protocol-1
title: Fault
steps:
  - run: {{mode: {mode}, speed: {speed} rad/s, rest: 1 s, duration: 3 s, stop_when: {words}}}
"""


def main() -> None:
    """Stream, stop, and print both beside their bars."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--faults", type=int, default=10)
    parser.add_argument("--quick", action="store_true")
    asked = parser.parse_args()
    stream(10.0 if asked.quick else 60.0 * asked.minutes)
    if faults := 1 if asked.quick else asked.faults:
        stops(faults)


def stream(seconds: float) -> None:
    """Observe and draw a hop as it comes, and print how late and how complete."""
    sent = streamed(filmed(seconds - REST_S - 0.5, REST_S))
    with (
        StubServer(sent, pause_s=1 / RATE_HZ) as server,
        rerun_server() as port,
        LiveViewer(port) as viewer,
        ready(LiveTwin(task(rest=REST_S, stop_when=LIMIT, viewer=viewer.port))) as twin,
        Recorder(Stream(command_port=server.port)) as recorder,
    ):
        twin.follow(recorder)
        begun = time.process_time()
        time.sleep(REST_S)
        end = time.monotonic() + seconds - REST_S
        stopped = twin.wait(SystemClock(), seconds - REST_S - 0.7)
        time.sleep(max(end - time.monotonic(), 0.0) + 0.2)  # a run would have ended
        own = time.process_time() - begun
        came = recorder.since(0)
        take = recorder.stop()
    assert twin.summary is not None, twin.lost
    found, count = twin.summary, len(sent) - 2
    on_the_way = 1e3 * np.array(
        [one.arrived_s - server.sent_s[one.number - came[0].number] for one in came]
    )
    print(f"{count} frames at {RATE_HZ} Hz, {seconds:.0f} s")
    print(f"{'raw stream: frames lost':42} {count - len(take):8d}      bar 0")
    p50, p99 = np.percentile(on_the_way, [50, 99])
    row("stub to recorder", p50, p99, on_the_way.max())
    row("arrival to estimated state", *found.latency_ms, LATENCY_BAR_MS)
    if viewer.latency_ms is not None:
        row(f"arrival to drawn state, {viewer.frames} of them", *viewer.latency_ms, LATENCY_BAR_MS)
    print(f"{'observed, skipped, lost':42} {found.samples:8d} {found.skipped:8d} {found.lost:8d}")
    print(f"{'processor time of a sample [ms]':42} {found.cpu_ms:8.2f}      of {1e3 / RATE_HZ:.2f}")
    print(f"{'share of a core, worker':42} {100 * found.cpu_ms * RATE_HZ / 1e3:7.0f} %")
    print(f"{'share of a core, recorder and hand-over':42} {100 * own / seconds:7.0f} %")
    assert found.error_mm is not None
    root, most = found.error_mm
    print(f"{'prediction error: rms, greatest [mm]':42} {root:8.2f} {most:8.2f}")
    print(f"{'stopped without a fault':42} {stopped or 'no'}")


def streamed(take: Take) -> list[bytes]:
    """Return the packets that a stub sends of a take."""
    version = (4, 1)
    return [server_info(version), models(take, version), *frames(take, version)]


@contextmanager
def ready(twin: LiveTwin) -> Iterator[LiveTwin]:
    """Start a live twin and yield it when it takes frames, as a run does before its cameras."""
    with twin:
        twin.require_ready()
        yield twin


def row(name: str, p50: float, p99: float, most: float, bar: float | None = None) -> None:
    """Print a latency: median, 99th percentile and greatest."""
    limit = "" if bar is None else f"      bar {bar:g} at 99 %"
    print(f"{name + ': 50 %, 99 %, most [ms]':42} {p50:8.1f} {p99:8.1f} {most:8.1f}{limit}")


@contextmanager
def rerun_server() -> Iterator[str]:
    """Run what takes a recording over the network, without a window, and yield its port."""
    with socket.socket() as probe:
        probe.bind((HERE, 0))
        port = str(probe.getsockname()[1])
    program = Path(rerun_cli.__file__).parent / "rerun"
    command = [program, "--serve-grpc", "--bind", HERE, "--port", port]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        yield port
    finally:
        process.terminate()
        process.wait()


def stops(count: int) -> None:
    """Let runs go wrong and print how soon after the fault in the data the output is off."""
    kinds = [("hop", 17.0, "T's markers slip by 20 mm"), ("clamped", 8.5, "a clamp slips by 10 mm"),
             ("hop", 17.0, "the robot falls off its plate")]  # fmt: skip
    print(f"\nfault in the data to output off [s]{'':30} bar {REACTION_BAR_S}")
    for number in range(count):
        mode, speed, name = kinds[number % len(kinds)]
        film = filmed(3.0, mode=mode, speed=speed, seed=number)  # type: ignore[arg-type]
        wrong = {
            0: lambda film=film: slipped(film, "T", FAULT_S, 0.02),
            1: lambda film=film: slipped(film, "Foot", FAULT_S, 0.01),
            2: lambda film=film: fallen(film, FAULT_S),
        }[number % len(kinds)]()
        print(f"{name:42} {reaction(wrong, mode, speed):8.3f}")


def reaction(film: Take, mode: str, speed: float) -> float:
    """Return how long after the faulty frame was sent the terminals lost their voltage [s]."""
    sent = streamed(film)
    device = SimulatedRiden(clock=SystemClock())
    with (
        tempfile.TemporaryDirectory() as name,
        serve(device, framing="rtu") as supply,
        StubServer(sent, pause_s=1 / RATE_HZ) as server,
    ):
        folder = Path(name)
        os.environ["WORKBENCH_STATE"] = name  # a stop latches the supply, this one only
        path = folder / "fault.yaml"
        path.write_text(PROTOCOL.format(mode=mode, speed=speed, words=LIMIT.words))
        file = load_bench(str(lab(ROOT, folder, supply, server.port)))
        bench = make_bench(file.content)
        experiment = read_experiment(path, file, bench.voltage_step)
        try:
            list(carry_out(experiment, bench, folder / "runs", QuietOperator(), lambda text: None))
        except SafetyStop as error:
            if ": prediction error" not in str(error):
                raise
        off = [at for at, volts in device.history if volts == 0][-1]
        return off - server.sent_s[round(FAULT_S * RATE_HZ)]


if __name__ == "__main__":
    main()
