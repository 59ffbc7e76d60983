"""The pages that tell how to add something are followed, in a copy of the tree, to the word."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
HOW_TO = ROOT / "docs" / "how-to"
COPIED = ("workbench", "tests", "benchmarks", "docs", "models", "protocols", "examples")


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """A copy of the tree to work in."""
    unneeded = shutil.ignore_patterns("__pycache__", "pictures")
    for name in COPIED:
        shutil.copytree(ROOT / name, tmp_path / name, ignore=unneeded)
    for name in ("pyproject.toml", "constraints.txt"):
        shutil.copyfile(ROOT / name, tmp_path / name)
    return tmp_path


@pytest.mark.long
def test_another_model_of_a_known_family_is_a_row_and_an_identity(copy: Path) -> None:
    rows = copy / "workbench" / "hw" / "models" / "korad.py"
    device = copy / "workbench" / "hw" / "simulated" / "korad.py"
    add(rows, "KORAD = (\n", '    _row("KA6003P", "KORAD ?KA6003P", amps=3, volts=60),\n')
    add(device, "ANSWERS = {\n", '    "KA6003P": "KORADKA6003PV2.0",\n')
    page = HOW_TO / "new-supply.md"
    for command in re.findall(r"^    python (.*)$", page.read_text("utf-8"), re.MULTILINE):
        words = command.split()
        if "pytest" in words:  # of a family's many tests, those of the new row
            words += ["-q", "-k", "KA6003P", "-p", "no:cacheprovider"]
        told = python(copy, *words)
        assert "pytest" not in words or re.search(r"[1-9]\d* passed", told)
    assert "KA6003P" in (copy / "docs" / "reference" / "supplies.md").read_text("utf-8")


@pytest.mark.long
def test_another_effect_is_the_page_s_entry_named_where_it_says(copy: Path) -> None:
    page = (HOW_TO / "new-effect.md").read_text("utf-8")
    (entry,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    file = copy / "workbench" / "sim" / "effects" / "dissipation.py"
    another = entry.replace("AIR_DRAG", "HEAD_WIND").replace('"air_drag"', '"head_wind"')
    add(file, entry, f"\n{another}")
    add(file, "HINGE_QUADRATIC_DAMPING, AIR_DRAG", ", HEAD_WIND")  # in `EFFECTS`
    add(file, ' "air_drag",', ' "head_wind",')  # what is confused with the one, is with the other
    names = copy / "tests" / "sim" / "test_effects_library.py"
    add(names, "hinge_quadratic_damping air_drag", " head_wind")
    reference = copy / "docs" / "reference" / "effects.md"
    python(copy, "docs/make_effects.py", str(reference))
    assert "`head_wind`" in reference.read_text("utf-8")
    model = (copy / "models" / "thesis.yaml").read_text("utf-8")
    named = "effects: [{name: head_wind, parameters: {c: 0.05}}]"
    (copy / "windy.yaml").write_text(model.replace("effects: []", named), "utf-8")
    told = python(
        copy,
        "-c",
        "from workbench.cli import main; main()",
        *["simulate", "--mode", "decay", "--duration", "2", "--model", "windy.yaml"],
    )
    assert "completed" in told
    words = f"-m pytest -q -k head_wind -p no:cacheprovider {names.relative_to(copy)}"
    assert re.search(r"[1-9]\d* passed", python(copy, *words.split()))


def add(file: Path, after: str, text: str) -> None:
    """Put a text after each place where another stands."""
    written = file.read_text("utf-8")
    assert after in written, f"{file.name} has no {after!r}"
    file.write_text(written.replace(after, after + text), "utf-8")


def python(where: Path, *words: str) -> str:
    """Return what a Python says that knows the copy alone."""
    here = os.environ | {"PYTHONPATH": str(where), "COLUMNS": "300"}
    done = subprocess.run(
        [sys.executable, *words], cwd=where, env=here, capture_output=True, text=True, timeout=250
    )
    assert done.returncode == 0, f"{' '.join(words)}\n{done.stdout}\n{done.stderr}"
    return done.stdout
