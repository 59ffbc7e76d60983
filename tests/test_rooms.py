"""Rules that hold over the whole tree."""

from __future__ import annotations

import ast
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
    for name in module.__all__:
        assert hasattr(module, name), name


FACES = [
    p for p in (ROOT / "workbench").rglob("__init__.py") if "import exports" in p.read_text("utf-8")
]


@pytest.mark.parametrize("path", FACES, ids=lambda path: path.parent.name)
def test_a_face_names_each_export_once_as_an_import(path: Path) -> None:
    tree = ast.parse(path.read_text("utf-8"))
    imports = [n for n in ast.walk(tree) if isinstance(n, ast.ImportFrom)]
    ours = [n for n in imports if str(n.module).startswith("workbench.")]
    assert not any(one.asname for n in ours for one in n.names)
    names = [one.name for n in ours for one in n.names if n.module != "workbench.room_exports"]
    module = importlib.import_module(".".join(path.relative_to(ROOT).parent.parts))
    assert module.__all__ == sorted(names) == dir(module)
    assert len(set(names)) == len(names) > 0


def test_a_file_is_one_room_s_size_and_names_what_it_exports() -> None:
    texts = {str(path.relative_to(ROOT)): path.read_text(encoding="utf-8") for path in SOURCES}
    assert [name for name, text in texts.items() if len(text.splitlines()) > LONGEST_FILE] == []
    inside = {name: text for name, text in texts.items() if name.count(os.sep) > 1}
    assert len(inside) > 400
    assert [name for name, text in inside.items() if "__all__" not in text] == []


def test_rooms_import_from_each_other_what_their_faces_export() -> None:
    faces = {f"workbench.{room}" for room in ROOMS}
    behind: list[str] = []
    for path in SOURCES:
        own = path.relative_to(ROOT / "workbench").parts[0]
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            match node:
                case ast.ImportFrom(module=str(module)):
                    named = (
                        [module]
                        if module not in faces
                        else [
                            f"{module}.{one.name}"
                            for one in node.names
                            if one.name not in importlib.import_module(module).__all__
                        ]
                    )
                case ast.Import(names=names):
                    named = [one.name for one in names]
                case _:
                    continue
            behind += [
                f"{path.relative_to(ROOT)}:{node.lineno} imports {one}"
                for one in named
                if one.count(".") > 1 and one.startswith("workbench.") and one.split(".")[1] != own
            ]
    assert behind == []


OF_THE_RECORD = re.compile(
    r"(manifest\.json|journal\.jsonl|guardian\.jsonl|wire\.log|compare\.rrd|remarks\.jsonl"
    r"|(supply|raw|track|twin|state)\.parquet)"
)
READERS = ("workbench/bundle/", "workbench/output/", "workbench/hw/guardian/")
"""What knows the files and keys of a run: the record, and who writes the supply's own logs."""
EXPLAINS = {"workbench/catalogue/exported.py"}  # which explains to people what lies in an export


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: path.stem)
def test_only_the_record_knows_its_files_and_keys(path: Path) -> None:
    name = path.relative_to(ROOT).as_posix()
    if name.startswith(READERS) or name in EXPLAINS:
        return
    tree = ast.parse(path.read_text(encoding="utf-8"))
    prose = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in prose:
            assert not OF_THE_RECORD.search(node.value), f"{name}:{node.lineno} names a file"
            assert node.value != "event", f"{name}:{node.lineno} reads a journal by its keys"
        of = node.value if isinstance(node, ast.Subscript) else _got_from(node)
        if isinstance(of, ast.Call):  # manifest.flat()
            assert not _named(of.func, "flat"), f"{name}: reads a manifest by a key"
        assert not _named(of, "manifest"), f"{name}: reads a manifest by a key"


def _got_from(node: ast.AST) -> ast.AST | None:
    """What `.get` is called of, where it is."""
    if isinstance(node, ast.Call) and _named(node.func, "get"):
        return getattr(node.func, "value", None)
    return None


def _named(node: ast.AST | None, name: str) -> bool:
    return isinstance(node, ast.Attribute) and node.attr == name


def test_no_file_names_a_machine_s_path() -> None:
    pattern = re.compile(r"(/home/[a-z]|/Users/|/root/|[A-Z]:\\Users)")
    for name in _git("ls-files").splitlines():
        path = ROOT / name
        if path.suffix in (".py", ".md", ".yaml", ".toml", ".txt", ".json") and path.exists():
            found = pattern.search(path.read_text(encoding="utf-8"))
            assert not found or path == Path(__file__), f"{name}: {found}"


def test_git_ignores_what_commands_write_and_nothing_that_it_keeps() -> None:
    verbs = [
        path for path in SOURCES if path.parent.name in ("api", "cli", "identification", "identify")
    ]
    text = "".join(path.read_text("utf-8") for path in verbs)
    named = set(re.findall(r'Path\(\s*"([\w.-]+)"', text)) - {"protocols"}  # which are read
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
