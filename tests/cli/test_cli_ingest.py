"""`workbench ingest` of one export and of a folder: a table, and nothing that a table needs not."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import Command

STORED = Path(__file__).parents[1] / "data" / "tracking"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in ("hop_motive_1.23.csv", "hop_row_1.0.csv"):
        (tmp_path / name).write_bytes((STORED / name).read_bytes())
    (tmp_path / "notes.csv").write_text("a,b\n1,2\n")
    (tmp_path / "readme.txt").write_text("no export")
    return tmp_path


def test_a_folder_of_takes_is_one_table(workbench: Command, folder: Path) -> None:
    shown = workbench("ingest", str(folder)).out
    for words in ("hop_motive_1.23.csv", "hop_row_1.0.csv", "Foot 7.5 %", "120"):
        assert words in shown
    assert "note: " in shown
    assert "notes.csv:1: the first cell is 'a', which starts no known export" in shown
    found = workbench("ingest", str(folder), "--json").json["takes"]
    assert found["hop_row_1.0.csv"]["bodies"]["Rotor"]["missing"] == 12
    assert "starts no known export" in found["notes.csv"]["error"]


def test_a_folder_without_an_export_is_refused(workbench: Command, tmp_path: Path) -> None:
    (tmp_path / "notes.csv").write_text("a,b\n1,2\n")
    answer = workbench("ingest", str(tmp_path))
    assert (answer.code, "no export in it can be read: " in answer.err) == (2, True)
    assert workbench("ingest", str(tmp_path), "--into", "1").code == 2


def test_markers_alone_are_a_table_of_what_is_there(workbench: Command, tmp_path: Path) -> None:
    rows = "".join(
        f"frame,{k},{k / 100:.2f},0,1,{0.1 + 1e-3 * k},0.2,0.3,{7 if k < 5 else 9}\n"
        for k in range(10)
    )
    (tmp_path / "x.csv").write_text(f"comment,x\ninfo,framecount,10\n{rows}")
    shown = workbench("ingest", str(tmp_path / "x.csv")).out
    assert "7, 9" in shown
    assert "make rigid bodies Foot, T and Rotor in Motive" in " ".join(shown.split())


def test_a_table_of_one_export_loads_no_simulation() -> None:
    code = (
        "import sys; from workbench.cli.app import app; "
        f"app(args=['ingest', {str(STORED / 'hop_row_1.0.csv')!r}, '--json'],"
        " standalone_mode=False);"
        "print([m for m in ('mujoco', 'numba', 'workbench.sim', 'workbench.twin', 'workbench.fit')"
        " if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    head, _, loaded = done.stdout.rstrip().rpartition("\n")
    assert json.loads(head)["frames"] == 40
    assert loaded == "[]"
