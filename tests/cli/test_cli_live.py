"""`workbench live`: what is printed, what is written, how it ends."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.conftest import Command
from tests.tracking.natnet_stub import STREAMS, StubServer, packets
from workbench.tracking import read_take


@pytest.fixture
def sent() -> list[bytes]:
    return packets((STREAMS / "hop_4.1.bin").read_bytes())


def test_a_stream_is_recorded_told_and_written(
    workbench: Command, sent: list[bytes], tmp_path: Path
) -> None:
    out = tmp_path / "take.csv"
    with StubServer(sent) as server:
        words = ("--command-port", server.port, "--seconds", 0.4, "--out", out)
        found = workbench("live", *words, "--json").json
    assert (found["format"], found["version"], found["frames"]) == ("natnet", "4.1", 40)
    assert found["bodies"]["Foot"]["missing"] == 3
    assert found["out"] == str(out)
    assert len(read_take(out)) == 40
    again = workbench("live", *words)
    assert again.code == 2
    assert "take.csv: exists, and a take is never overwritten; give another --out" in again.err


def test_people_get_the_quality_of_the_stream(workbench: Command, sent: list[bytes]) -> None:
    with StubServer(sent) as server:
        answer = workbench("live", "--command-port", server.port, "--seconds", 0.4)
    assert answer.code == 0
    assert f"127.0.0.1:{server.port}: NatNet 4.1, 40 frames at 120 Hz" in answer.out
    assert "Rotor" in answer.out


def test_a_bench_whose_cameras_do_not_stream_has_nothing_to_watch(
    workbench: Command, root: Path, tmp_path: Path
) -> None:
    protocol = root / "protocols" / "hop-17.yaml"
    answer = workbench("run", protocol, "--watch", "--runs", tmp_path / "runs")
    assert answer.code == 2
    assert "--watch needs cameras that stream, and bench 'virtual' has no" in answer.err


def test_no_server_ends_with_3(workbench: Command) -> None:
    answer = workbench("live", "--local", "192.0.2.1", "--seconds", 1)
    assert answer.code == 3
    assert "is streaming on in Motive" in answer.err
    assert "Traceback" not in answer.err


@pytest.mark.skipif(sys.platform == "win32", reason="Windows sends no SIGINT to one process")
def test_ctrl_c_ends_the_recording_and_keeps_it(
    root: Path, sent: list[bytes], tmp_path: Path
) -> None:
    out = tmp_path / "take.csv"
    main = [sys.executable, "-c", "from workbench.cli import main; main()"]
    with StubServer(sent) as server:
        process = subprocess.Popen(
            [*main, "live", "--command-port", str(server.port), "--out", str(out)],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            cwd=root,
            env=os.environ | {"NO_COLOR": "1"},
        )
        try:
            assert process.stderr is not None
            assert "Ctrl-C ends it" in process.stderr.readline()
            time.sleep(0.5)
            process.send_signal(signal.SIGINT)
            _, told = process.communicate(timeout=30)
        finally:
            process.kill()
            process.wait()
    assert process.returncode == 0, told
    assert len(read_take(out)) == 40
