"""Rules that hold over the whole tree."""

from __future__ import annotations

import importlib
import os
import re
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
ROOMS = sorted(p.parent.name for p in (ROOT / "workbench").glob("*/__init__.py"))
SOURCES = sorted((ROOT / "workbench").rglob("*.py"))
LONGEST_FILE = 400


@pytest.mark.parametrize("room", ROOMS)
def test_a_room_says_what_it_is_and_exports_what_exists(room: str) -> None:
    module = importlib.import_module(f"workbench.{room}")
    assert module.__doc__ is not None
    assert len(module.__doc__) > 150
    assert sorted(set(module.__all__)) == sorted(module.__all__)
    for name in module.__all__:
        assert hasattr(module, name), name


def test_a_file_is_one_room_s_size_and_names_what_it_exports() -> None:
    texts = {str(path.relative_to(ROOT)): path.read_text(encoding="utf-8") for path in SOURCES}
    assert [name for name, text in texts.items() if len(text.splitlines()) > LONGEST_FILE] == []
    inside = {name: text for name, text in texts.items() if name.count(os.sep) > 1}
    assert len(inside) > 400
    assert [name for name, text in inside.items() if "__all__" not in text] == []


def test_no_file_names_a_machine_s_path() -> None:
    pattern = re.compile(r"(/home/[a-z]|/Users/|/root/|[A-Z]:\\Users)")
    for name in _git("ls-files").splitlines():
        path = ROOT / name
        if path.suffix in (".py", ".md", ".yaml", ".toml", ".txt", ".json") and path.exists():
            found = pattern.search(path.read_text(encoding="utf-8"))
            assert not found or path == Path(__file__), f"{name}: {found}"


def test_git_ignores_what_commands_write_and_nothing_that_it_keeps() -> None:
    cli = "".join(path.read_text("utf-8") for path in (ROOT / "workbench" / "cli").glob("*.py"))
    named = set(re.findall(r'Path\(\s*"([\w.-]+)"', cli)) - {"protocols"}  # which are read
    assert {"runs", "diagnoses", "models", "as-bent.yaml"} <= named
    written = [name if "." in name else f"{name}/any.html" for name in named - {"models"}]
    written += [
        "models/thesis-2026-11-27.yaml",
        "models/thesis-2026-11-27.html",
        "as-bent.html",
        "runs.live/a",
    ]
    ignored = _git("check-ignore", *written)
    assert sorted(ignored.split()) == sorted(written)
    assert _git("ls-files", "--cached", "--ignored", "--exclude-standard") == ""


def _git(*words: str) -> str:
    done = subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode > 1:
        pytest.skip("not a git checkout")
    return done.stdout
