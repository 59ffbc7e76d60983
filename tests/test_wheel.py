"""The built wheel carries everything that a run needs."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]


@pytest.mark.long
def test_a_run_works_from_the_wheel_alone(tmp_path: Path) -> None:
    build = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(tmp_path)]
    subprocess.run([*build, str(ROOT)], check=True, capture_output=True, timeout=300)
    (wheel,) = tmp_path.glob("*.whl")
    site = tmp_path / "site"
    zipfile.ZipFile(wheel).extractall(site)
    page = site / "workbench" / "panel" / "page"
    assert {path.name for path in page.iterdir()} >= {"index.html", "panel.css", "panel.js"}
    assert (site / "workbench" / "constraints.txt").is_file()  # for `workbench doctor`
    protocol = tmp_path / "p.yaml"
    protocol.write_text(
        "schema: workbench/protocol-1\ntitle: From the wheel\nsteps:\n"
        "  - run: {mode: hop, speed: 17 rad/s, rest: 1 s, duration: 2 s}\n"
    )
    program = (
        "import sys, workbench; sys.stderr.write(workbench.__file__);"
        "from workbench.cli import main; main()"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, "run", str(protocol), "--json"],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(site)},
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr.startswith(str(site))
    assert json.loads(done.stdout)["status"] == "complete"
