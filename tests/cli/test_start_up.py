"""What a command loads before it answers: heavy libraries only where they are used."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from workbench.cli.app import VERBS

ROOT = Path(__file__).resolve().parents[2]
SCIPY = {f"scipy.{part}" for part in ("interpolate", "linalg", "optimize", "signal", "spatial")}
HEAVY = SCIPY | {
    "PIL", "cv2", "distributed", "ezdxf", "fastapi", "jinja2", "matplotlib", "mujoco", "numba",
    "numpy", "pyarrow", "rerun", "reportlab", "scipy.stats", "sklearn", "uvicorn",
    "workbench.schemas",
}  # fmt: skip
FILES = {"numpy", "workbench.schemas"}
ENGINE = {*FILES, "mujoco", "numba"}
DRAWING = {"rerun", "matplotlib", "jinja2", "PIL"}
BUDGETS = (
    (set[str](), "run"),
    (FILES, "ingest live panel schema doctor runs supply"),
    (
        ENGINE,
        "calibrate identify resonances simulate modes diagnose investigate review optimize thesis",
    ),
    (ENGINE | {"PIL", "ezdxf", "reportlab"}, "template"),
)
"""Heavy libraries that the help of these verbs may load."""

ASK = """\
import sys
try:
    {call}
except SystemExit:
    pass
import json
print(json.dumps(sorted(set({heavy}) & set(sys.modules))))
"""


def loaded(call: str, cwd: Path) -> set[str]:
    """Return which heavy libraries a new interpreter has loaded after a call."""
    done = subprocess.run(
        [sys.executable, "-c", ASK.format(call=call, heavy=sorted(HEAVY))],
        cwd=cwd,
        capture_output=True,
        text=True,
        check=True,
    )
    return set(json.loads(done.stdout.splitlines()[-1]))


def loaded_by(cwd: Path, *words: str) -> set[str]:
    """Return which heavy libraries a command loads."""
    return loaded(f"sys.argv = {['workbench', *words]}; import workbench.cli as c; c.main()", cwd)


def test_every_verb_has_a_budget() -> None:
    assert sorted(verb for _, verbs in BUDGETS for verb in verbs.split()) == sorted(VERBS)


@pytest.mark.parametrize(
    ("budget", "verbs"), BUDGETS, ids=["nothing", "files", "engine", "template"]
)
def test_help_loads_no_more_than_its_budget(budget: set[str], verbs: str, tmp_path: Path) -> None:
    modules = [f"workbench.cli.{VERBS[verb].module}" for verb in verbs.split()]
    assert loaded(f"import {', '.join(modules)}", tmp_path) - budget == set()


def test_a_misspelt_key_is_reported_before_the_robot_and_the_formats_load(tmp_path: Path) -> None:
    right = (ROOT / "protocols" / "hop-17.yaml").read_text("utf-8")
    (tmp_path / "wrong.yaml").write_text(right.replace("speed:", "sped:"), "utf-8")
    assert loaded_by(tmp_path, "run", "wrong.yaml") == FILES


def test_a_take_is_read_without_the_simulation(tmp_path: Path) -> None:
    take = ROOT / "tests" / "data" / "tracking" / "hop_motive_1.23.csv"
    found = loaded_by(tmp_path, "ingest", str(take))
    assert found <= {*FILES, "pyarrow", "scipy.linalg", "scipy.spatial"}


def test_what_a_run_needs_draws_nothing(tmp_path: Path) -> None:
    """Carrying one out up to its seal loads none of them either: `tests/report/test_views.py`."""
    rooms = "run.bench, run.engine, run.ingest, twin.comparison, run.rehearsal, run.attended, "
    rooms += "cli.run, cli.terminal, cli.ingest"
    found = loaded(f"import {', '.join(f'workbench.{r}' for r in rooms.split(', '))}", tmp_path)
    assert "mujoco" in found
    assert not found & DRAWING


def test_a_run_loads_no_viewer_before_it_is_over(tmp_path: Path) -> None:
    protocol = ROOT / "protocols" / "hop-17.yaml"
    found = loaded_by(tmp_path, "run", str(protocol), "--dry-run")
    assert "mujoco" in found
    assert not found & DRAWING


def test_the_force_laws_are_compiled_when_a_robot_is_built(tmp_path: Path) -> None:
    call = (
        "import workbench.sim.passive_forces as p; sys.exit() if not p._kept else print('compiled')"
    )
    done = subprocess.run(
        [sys.executable, "-c", f"import sys; {call}"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout == ""


def test_python_loads_each_library_when_it_is_used(tmp_path: Path) -> None:
    call = "import workbench as wb; [getattr(wb, name) for name in wb.__all__]"
    assert loaded(call, tmp_path) == set()
    take = ROOT / "tests" / "data" / "tracking" / "hop_motive_1.23.csv"
    found = loaded(f"import workbench as wb; wb.read_take({str(take)!r})", tmp_path)
    assert not found & {*DRAWING, "mujoco"}
