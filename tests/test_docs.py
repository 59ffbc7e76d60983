"""What the documentation quotes is run; what it shows exists."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
PAGES = sorted([ROOT / "README.md", *(ROOT / "docs").rglob("*.md")])
MAIN = [sys.executable, "-c", "from workbench.cli import main; main()"]


def commands(page: Path) -> list[str]:
    """The `$ workbench ...` lines of a page's console blocks, in order."""
    blocks = re.findall(r"```console\n(.*?)```", page.read_text(encoding="utf-8"), re.DOTALL)
    return [line[2:] for block in blocks for line in block.splitlines() if line.startswith("$ w")]


@pytest.mark.check
@pytest.mark.parametrize(
    "page", [p for p in PAGES if commands(p)], ids=lambda p: str(p.relative_to(ROOT))
)
def test_every_quoted_command_works_in_order(page: Path, tmp_path: Path) -> None:
    runs, templates = tmp_path / "runs", tmp_path / "templates"
    folders = {"RUNS": runs, "TEMPLATES": templates, "SEARCHES": tmp_path / "searches"}
    here = os.environ | {f"WORKBENCH_{name}": str(path) for name, path in folders.items()}
    here |= {"NO_COLOR": "1"}
    for command in commands(page):
        command = command.replace("RUN", _newest(runs, "*", "RUN"))
        words = shlex.split(command.replace("TEMPLATE", _newest(templates, "*.pdf", "TEMPLATE")))
        assert words[0] == "workbench"
        done = subprocess.run(
            [*MAIN, *words[1:]], cwd=ROOT, env=here, capture_output=True, text=True, timeout=120
        )
        assert done.returncode == 0, f"{command}\n{done.stderr}"


@pytest.mark.parametrize("page", PAGES, ids=lambda p: str(p.relative_to(ROOT)))
def test_every_link_to_a_file_leads_somewhere(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    for target in re.findall(r"\]\((?!https?:)([^)#]+)", text):
        assert (page.parent / target).exists(), target


def _newest(folder: Path, pattern: str, otherwise: str) -> str:
    found = sorted(folder.glob(pattern)) if folder.exists() else []
    return str(found[-1]) if found else otherwise
