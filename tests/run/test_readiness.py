"""Port, exports and disk are looked at before the operator is asked to do anything."""

from __future__ import annotations

import socket
from pathlib import Path

import pytest

from tests.conftest import ROOT, Command
from workbench.errors import HardwareError, InputError
from workbench.hw import Connection, require_reachable
from workbench.run.readiness import require_room


def bench_at(folder: Path, place: str) -> Path:
    text = (ROOT / "docs" / "examples" / "lab-bench.yaml").read_text(encoding="utf-8")
    serial = text[text.index("{kind: serial") : text.index("baud: 115200}") + 13]
    bench = folder / "lab.yaml"
    bench.write_text(
        text.replace(serial, place).replace("takes: exports", f"takes: {folder / 'exports'}")
    )
    (folder / "exports").mkdir()
    return bench


def test_a_supply_that_is_not_there_is_told_before_any_prompt(
    workbench: Command, tmp_path: Path
) -> None:
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    bench = bench_at(tmp_path, f"{{kind: tcp, address: '127.0.0.1:{port}'}}")
    runs = tmp_path / "runs"
    answer = workbench("run", ROOT / "protocols" / "hop-17.yaml", "--bench", bench, "--runs", runs)
    assert answer.code == 3
    assert f"127.0.0.1:{port} not reachable: nothing accepts a connection there" in answer.err
    assert "Stand the robot" not in answer.err
    assert not runs.exists(), "no run was begun"


def test_a_port_that_is_there_is_opened_and_nothing_is_sent() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        require_reachable(Connection("tcp", f"127.0.0.1:{server.getsockname()[1]}"))
        link, _ = server.accept()
        with link:
            link.settimeout(5)
            assert link.recv(1) == b""
    with pytest.raises(HardwareError, match="there is no such port; is the cable in"):
        require_reachable(Connection("serial", "/dev/no-such-port"))


def test_a_folder_that_takes_no_run_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    require_room(tmp_path / "new" / "runs")
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match=r"file/: no run can be written here: .*\(--runs"):
        require_room(tmp_path / "file")
    monkeypatch.setattr("workbench.run.readiness.free_gb", lambda folder: 0.02)
    with pytest.raises(InputError, match="20 MB free, at least 100 MB are needed; make room"):
        require_room(tmp_path)
