"""A verb parses, calls and prints: none imports another, and what they share is listed here."""

from __future__ import annotations

import ast
from pathlib import Path

import workbench.cli
from workbench.cli.app import VERBS
from workbench.cli.runs import RUNS

CLI = Path(workbench.cli.__file__).parent
FILES = sorted(CLI.glob("*.py"))
VERB_FILES = {one.module for one in (*VERBS.values(), *RUNS.values())}
ROOT = {"__init__", "app"}
HELPERS = {
    "completion": "what the Tab key offers",
    "diagnosis_output": "prints a diagnosis",
    "dry_run": "prints a rehearsal, for `run`",
    "global_options": "options before any verb",
    "lazy": "verbs that are imported when they are called",
    "number_option": "a number that may have a unit",
    "plain_output": "options and columns without a terminal library",
    "progress": "the line of progress",
    "quality": "prints a take's quality",
    "console": "tables, notes, the console",
    "template": "the group that `template_photo` adds its commands to",
    "terminal": "this terminal as an operator's console",
    "views": "draws the views of a run, and prints what could not be drawn",
}
"""Modules of `cli` that others may import -> what they print or parse."""


def imported(path: Path) -> set[str]:
    """Return the modules of `cli` that a file imports, at its top or in a function."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.module is not None:
            names = [f"{node.module}.{alias.name}" for alias in node.names]
        elif isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        else:
            continue
        found |= {name.split(".")[2] for name in names if name.startswith("workbench.cli.")}
    return found


def test_every_file_is_a_verb_or_a_helper() -> None:
    assert {path.stem for path in FILES} == VERB_FILES | HELPERS.keys() | ROOT
    assert not VERB_FILES & HELPERS.keys()


def test_no_verb_is_imported_by_another() -> None:
    wrong = {
        path.stem: sorted(others)
        for path in FILES
        if path.stem not in ROOT and (others := imported(path) - HELPERS.keys())
    }
    assert wrong == {}
