"""The Tab key in bash: it is installed by the command itself, and offers what there is."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import ROOT
from workbench.cli.completion import bench_names, protocol_files, run_names, shape_names

MAIN = "from workbench.cli import main; main()"


@pytest.fixture
def desk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with two runs, a protocol and a bench."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("WORKBENCH_RUNS", raising=False)
    for name in ("2026-11-20_100000_hop-17", "2026-11-21_100000_hop-18"):
        (tmp_path / "runs" / name).mkdir(parents=True)
        (tmp_path / "runs" / name / "manifest.json").write_text("{}")
    (tmp_path / "protocols").symlink_to(ROOT / "protocols")
    shutil.copyfile(ROOT / "docs" / "examples" / "lab-bench.yaml", tmp_path / "lab.yaml")
    return tmp_path


@pytest.mark.usefixtures("desk")
def test_names_are_offered_by_kind(monkeypatch: pytest.MonkeyPatch) -> None:
    assert run_names("") == ["2026-11-21_100000_hop-18", "2026-11-20_100000_hop-17"]
    assert run_names("2026-11-20") == ["2026-11-20_100000_hop-17"]
    assert bench_names("") == ["virtual", "lab.yaml"]
    assert protocol_files("protocols/hop-1") == ["protocols/hop-17.yaml"]
    assert "protocols/hop-17.yaml" in protocol_files("")
    assert protocol_files("lab") == []
    assert shape_names("thesis-i") == ["thesis-initial"]
    monkeypatch.setenv("WORKBENCH_RUNS", "elsewhere")
    assert run_names("") == []


@pytest.mark.skipif(shutil.which("bash") is None, reason="needs bash")
def test_bash_completes_verbs_files_and_runs_once_it_is_installed(desk: Path) -> None:
    program = desk / "bin" / "workbench"
    program.parent.mkdir()
    program.write_text(f'#!/bin/sh\nexec {sys.executable} -c "{MAIN}" "$@"\n')
    program.chmod(0o755)
    here = os.environ | {
        "HOME": str(desk),
        "PATH": f"{program.parent}:{os.environ['PATH']}",
        "PYTHONPATH": str(ROOT),
        "_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION": "1",
    }
    installed = subprocess.run(
        [program, "--install-completion", "bash"], env=here, capture_output=True, text=True
    )
    assert installed.returncode == 0, installed.stderr
    assert "workbench" in (desk / ".bashrc").read_text()
    asked = [
        ("workbench", "cali"),
        ("workbench", "run", "protocols/hop-1"),
        ("workbench", "review", "2026-11-20"),
        ("workbench", "runs", "show", "2026-11-21"),
    ]
    script = "shopt -s expand_aliases; source ~/.bashrc\n" + "\n".join(
        f"COMP_WORDS=({' '.join(words)}); COMP_CWORD={len(words) - 1}; COMPREPLY=(); "
        '_workbench_completion workbench; echo "${COMPREPLY[@]}"'
        for words in asked
    )
    done = subprocess.run(
        ["bash", "-c", script], env=here, cwd=desk, capture_output=True, text=True, timeout=120
    )
    assert done.stdout.splitlines() == [
        "calibrate",
        "protocols/hop-17.yaml",
        "2026-11-20_100000_hop-17",
        "2026-11-21_100000_hop-18",
    ], done.stderr
