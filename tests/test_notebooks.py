"""The notebooks of `examples/notebooks` run from top to bottom, and keep no outputs.

Their cells are plain Python, so they are executed here in one namespace, as a kernel would, without
the twenty packages that a kernel needs. What a cell ends with is shown as a notebook would show it,
and must be short enough to be read.
"""

from __future__ import annotations

import ast
import json
from pathlib import Path
from typing import Any

import matplotlib as mpl
import matplotlib.pyplot as plt
import pytest

FOLDER = Path(__file__).resolve().parents[1] / "examples" / "notebooks"
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))
MOST_LINES = 20
LONG = pytest.mark.long  # a fit, a diagnosis and a search: half a minute of processor time


def cells(path: Path) -> list[dict[str, Any]]:
    return json.loads(path.read_text("utf-8"))["cells"]


def executed(path: Path) -> dict[str, Any]:
    """Execute the code of a notebook, and return its names."""
    names: dict[str, Any] = {"__name__": "__main__"}
    for cell in cells(path):
        if cell["cell_type"] == "code":
            shown = _shown("".join(cell["source"]), cell["id"], names)
            assert len(shown.splitlines()) <= MOST_LINES, f"{cell['id']} shows\n{shown}"
    return names


def _shown(source: str, name: str, names: dict[str, Any]) -> str:
    """Execute a cell and return the text of what it ends with."""
    tree = ast.parse(source, name)
    last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(tree, name, "exec"), names)
    if not isinstance(last, ast.Expr):
        return ""
    found = eval(compile(ast.Expression(last.value), name, "eval"), names)
    return "" if found is None else repr(found)


@pytest.fixture
def at_notebooks(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(FOLDER)
    monkeypatch.setattr("tempfile.mkdtemp", lambda: str(tmp_path))
    mpl.use("Agg")


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_keeps_no_output_and_is_of_the_present_format(path: Path) -> None:
    notebook = json.loads(path.read_text("utf-8"))
    assert (notebook["nbformat"], notebook["nbformat_minor"]) == (4, 5)
    ids = [cell["id"] for cell in notebook["cells"]]
    assert len(set(ids)) == len(ids) > 0
    for cell in notebook["cells"]:
        assert cell.get("outputs", []) == []
        assert cell.get("execution_count") is None
    assert path.stem in {"run", "beam"}, "a new notebook needs a test below"


@pytest.mark.usefixtures("at_notebooks")
def test_a_run_beside_its_twin() -> None:
    found = executed(FOLDER / "run.ipynb")
    noise = found["corrected"].noise_mm
    assert found["as_commanded"] > found["nominal"].rms_mm > 5 * noise
    assert found["corrected"].rms_mm < 1.1 * noise
    plt.close("all")


@LONG
@pytest.mark.usefixtures("at_notebooks")
def test_the_hidden_cause_is_found_and_a_shape_optimised_with_it() -> None:
    found = executed(FOLDER / "beam.ipynb")
    assert found["answer"].found.kind == "NAMED"
    assert found["cause"].name == "hinge_cubic_stiffness"
    assert found["found"].low < found["truth"] < found["found"].high
    errors = found["errors"]
    assert errors["nominal"] > 3 * errors["fitted"] > 3 * errors["extended"]
    assert found["after"].summary["distance_m"] > found["before"].summary["distance_m"]
