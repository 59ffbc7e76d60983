"""What the documentation quotes is run or compared; what it shows exists.

A block of a page is one of these: `console` and `sh`, which are typed (those of README and tutorial
by `tests/test_first_hour.py`); `pycon`, which is typed into Python; any other below a comment
`<!-- file: PATH -->`, whose text stands in that file; below `<!-- part of: KIND -->`, some keys of
such a file, which are checked in one; or below `<!-- not run: WHY -->`.
"""

from __future__ import annotations

import doctest
import os
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
import typer.main
from ruamel.yaml import YAML

from tests.quoting import commands, squeezed
from workbench.cli.app import app
from workbench.schemas import SCHEMAS, load

ROOT = Path(__file__).resolve().parents[1]
PAGES = sorted([ROOT / "README.md", *(ROOT / "docs").rglob("*.md")])
FIRST_HOUR = (ROOT / "README.md", ROOT / "docs" / "tutorial.md")
"""Pages whose commands `tests/test_first_hour.py` types."""

MAIN = [sys.executable, "-c", "from workbench.cli import main; main()"]
LINKED = ("docs", "examples", "models", "protocols", "workbench")
NAMED = ("benchmarks", "docs", "tests", "workbench/[a-z_]+")
"""Folders that are the checkout's alone, whose files sentences name."""
WHOLE = {
    "bench": ROOT / "docs" / "examples" / "lab-bench.yaml",
    "model": ROOT / "models" / "thesis.yaml",
}
"""A whole file of each kind that pages quote parts of."""


@dataclass(frozen=True)
class Block:
    """A block of a page that nobody types.

    Args:
        page: its page.
        kind: its language.
        mark: what the comment above it says that it is, empty where there is none.
        about: of which file, or why.
        text: of it.
    """

    page: Path
    kind: str
    mark: str
    about: str
    text: str

    def __str__(self) -> str:
        return f"{self.page.relative_to(ROOT)}: {self.text.strip().splitlines()[0]}"


def blocks() -> Iterator[Block]:
    """Yield the blocks of all pages that are not typed."""
    pattern = r"(?:^<!-- ([a-z ]+): ([^\n]*) -->\n)?^```(\w+)\n(.*?)^```"
    for page in PAGES:
        found = re.findall(pattern, page.read_text("utf-8"), re.DOTALL | re.MULTILINE)
        for mark, about, kind, text in found:
            if kind not in ("console", "sh", "pycon"):
                yield Block(page, kind, mark, about, text)


BLOCKS = list(blocks())


def marked(mark: str) -> list[Block]:
    return [block for block in BLOCKS if block.mark == mark]


@pytest.fixture
def desk(tmp_path: Path) -> Path:
    """A folder that looks like the checkout, where commands may leave what they make."""
    for name in LINKED:
        (tmp_path / name).symlink_to(ROOT / name)
    return tmp_path


@pytest.mark.long
@pytest.mark.parametrize(
    "page",
    [p for p in PAGES if p not in FIRST_HOUR and "```console" in p.read_text("utf-8")],
    ids=lambda p: str(p.relative_to(ROOT)),
)
def test_every_quoted_command_works_in_order(page: Path, desk: Path) -> None:
    here = {k: v for k, v in os.environ.items() if not k.startswith("WORKBENCH_")}
    here |= {"NO_COLOR": "1", "COLUMNS": "300"}
    for quoted in commands(page.read_text("utf-8")):
        line = quoted.line.replace("RUN", _newest(desk / "runs", "*", "RUN"))
        words = shlex.split(line.replace("TEMPLATE", _newest(desk / "templates", "*.pdf", "")))
        assert words[0] == "workbench"
        done = subprocess.run(
            [*MAIN, *words[1:]], cwd=desk, env=here, capture_output=True, text=True, timeout=180
        )
        assert done.returncode == 0, f"{line}\n{done.stderr}"
        told = squeezed(done.stdout + done.stderr)
        for expected in quoted.sees:
            assert expected in told, f"{line}\n{told}"


@pytest.mark.long  # as the commands: a fit, a diagnosis and a search
@pytest.mark.parametrize(
    "page",
    [p for p in PAGES if "```pycon" in p.read_text("utf-8")],
    ids=lambda p: str(p.relative_to(ROOT)),
)
def test_every_quoted_line_of_python_answers_as_shown(
    page: Path, desk: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(desk)
    typed = "\n".join(re.findall(r"^```pycon\n(.*?)^```", page.read_text("utf-8"), re.S | re.M))
    test = doctest.DocTestParser().get_doctest(typed, {}, page.stem, str(page), 0)
    told: list[str] = []
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE)
    runner.run(test, out=told.append)
    assert test.examples
    assert not told, "".join(told)


@pytest.mark.parametrize("page", PAGES, ids=lambda p: str(p.relative_to(ROOT)))
def test_every_link_to_a_file_leads_somewhere(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    for target, heading in re.findall(r"\]\((?!https?:)([^)#]*)(?:#([^)]+))?\)", text):
        place = page.parent / target if target else page
        assert place.exists(), target
        assert not heading or heading in _headings(place), f"{target}#{heading}"


@pytest.mark.parametrize("page", PAGES, ids=lambda p: str(p.relative_to(ROOT)))
def test_every_file_and_module_that_a_sentence_names_exists(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    spans = re.sub(r"<[a-z]+>", "*", " ".join(re.findall(r"`([^`\n]+)`", text)))
    for name in re.findall(rf"(?<![\w/.-])(?:{'|'.join(NAMED)})/[\w*/.-]*[\w*/]", spans):
        assert any(ROOT.glob(name.rstrip("/"))), name
    for module in re.findall(r"python -m ((?:benchmarks|tests|workbench)\b[\w.]*)", spans):
        place = ROOT / module.replace(".", "/")
        assert place.is_dir() or place.with_suffix(".py").exists(), module


def test_every_page_is_found_from_the_index() -> None:
    index = (ROOT / "docs" / "README.md").read_text("utf-8")
    listed = {(ROOT / "docs" / link).resolve() for link in re.findall(r"\]\(([^)#]+)\)", index)}
    pages = {page for page in PAGES if page.name != "README.md" and "decisions" not in page.parts}
    assert pages - listed == set()


@pytest.mark.parametrize("block", BLOCKS, ids=str)
def test_every_block_says_why_it_is_not_typed(block: Block) -> None:
    assert block.mark in ("file", "part of", "not run"), "give it `<!-- not run: WHY -->`"
    assert len(block.about.split()) > (block.mark == "not run"), "a reason has more than a word"


@pytest.mark.parametrize("block", marked("file"), ids=str)
def test_a_quoted_file_is_the_file(block: Block) -> None:
    assert block.text in (ROOT / block.about).read_text("utf-8")


@pytest.mark.parametrize("block", marked("part of"), ids=str)
def test_quoted_keys_are_accepted_in_a_whole_file(block: Block, tmp_path: Path) -> None:
    yaml = YAML()
    whole: Any = yaml.load(WHOLE[block.about].read_text("utf-8"))
    for key, value in YAML().load(block.text).items():
        if isinstance(value, dict) and isinstance(whole.get(key), dict):
            whole[key].pop("takes", None)  # exports of a folder, or a stream
            whole[key].update(value)
        else:
            whole[key] = value
    path = tmp_path / "whole.yaml"
    yaml.dump(whole, path)
    load(path, SCHEMAS[block.about])


@pytest.mark.parametrize(
    "block", [b for b in marked("not run") if re.search(r"^workbench ", b.text, re.M)], ids=str
)
def test_a_command_that_cannot_be_run_here_has_verbs_and_options_that_exist(block: Block) -> None:
    for line in re.findall(r"^workbench (.*)$", block.text, re.M):
        _require_known(shlex.split(line.replace("\\", "/")))


def test_the_mistake_of_the_tutorial_is_answered_as_it_shows(desk: Path, workbench: Any) -> None:
    (shown,) = [b.text for b in BLOCKS if "unknown key 'sped'" in b.text]
    text = (ROOT / "docs" / "examples" / "speeds.yaml").read_text("utf-8")
    wrong = desk / "speeds.yaml"
    wrong.write_text(text.replace("speeds:", "sped:", 1))
    told = workbench("run", wrong).err.replace(str(wrong), wrong.name)
    assert squeezed(shown) in squeezed(told)


def _require_known(words: list[str]) -> None:
    """Require that a command's verbs and options exist."""
    command: Any = typer.main.get_command(app)
    for word in words:
        if word in getattr(command, "commands", {}):  # perhaps a stand-in, imported when resolved
            _, command, _ = command.resolve_command(typer.Context(command), [word])
    assert not getattr(command, "commands", {}) or words[0] == "template", f"no verb in {words}"
    each = (command, *getattr(command, "commands", {}).values())
    known = {option for one in each for parameter in one.params for option in parameter.opts}
    unknown = [w for w in words if w.startswith("--") and w not in {*known, "--quiet", "--help"}]
    assert not unknown, f"{' '.join(words)}: {unknown}"


def _headings(page: Path) -> set[str]:
    """Return the names that a page's headings have in links."""
    lines = re.findall(r"^#+ (.*)$", page.read_text("utf-8"), re.M)
    return {re.sub(r"[^\w\- ]", "", line).strip().lower().replace(" ", "-") for line in lines}


def _newest(folder: Path, pattern: str, otherwise: str) -> str:
    found = sorted(folder.glob(pattern)) if folder.exists() else []
    return str(found[-1]) if found else otherwise
