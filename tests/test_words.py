"""Plain words: names and sentences that only this project would understand do not come back.

What the glossary explains is what pages say.
"""

from __future__ import annotations

import ast
import re
import tokenize
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
WORKBENCH = ROOT / "workbench"
NAMES = {
    "told|tell|tells|telling": "what it returns or does: report, text, send_command, description",
    "heard|hear": "received",
    "worth": "score, fitness, gain",
    "proof": "validation",
    "rival|rivals": "alternative",
    "carrier": "influential run",
    "desk": "control server",
    "card|cards": "session file",
    "visitor|visitors": "client",
    "recall": "load",
    "pairing": "twin comparison",
    "pole|poles": "sinusoid",
    "misled|taught|imagined|sluggish|liar|liars|clutter|dear|amiss": "the field's word",
}
"""Parts of a name -> what to write."""
SENTENCES = {
    r"told|tells?|telling": "reports, says, is given, is determined",
    r"heard|hears?": "received",
    r"worth": "fitness, score, gain",
    r"lacks?(?! of)|lacking": "misses, has no",
    r"amiss": "wrong",
    r"hand(s|ed)? on": "export, pass on",
    r"hangs? together": "are correlated, are connected",
    r"noise deviations?": "sigma",
    r"desks?|(?<!graphics )cards?": "control server, session file",
    r"clutter|dearer?|foretells?|misled|rivals?|carriers?|visitors?": "the field's word",
    r"(falls|fell) silent": "sends nothing more",
    r"stands? (for|in|behind|there)": "means, replaces, follows, is there",
}
ASK_AND_TELL = "optimize"  # the field's own words of an optimiser's interface
OTHERS = {"bank.md", "search.md"}
"""A page that a program writes from answers of long ago, and that of ask and tell."""


def _sources() -> Iterator[Path]:
    yield from sorted(WORKBENCH.rglob("*.py"))


def _wrong(words: dict[str, str], text: str, path: Path) -> str | None:
    for private, plain in words.items():
        found = re.search(rf"(?<![a-z])({private})(?![a-z])", text, re.IGNORECASE)
        if found and not (ASK_AND_TELL in path.parts and re.match("tell|told", found[0].lower())):
            return f"{found[0]!r}: say {plain}"
    return None


def _names(tree: ast.AST) -> Iterator[tuple[int, str]]:
    for node in ast.walk(tree):
        match node:
            case ast.FunctionDef(name=name) | ast.ClassDef(name=name) | ast.arg(arg=name):
                yield node.lineno, name
            case ast.Name(id=name, ctx=ast.Store()) | ast.Attribute(attr=name, ctx=ast.Store()):
                yield node.lineno, name


def test_names_are_the_field_s() -> None:
    wrong: list[str] = []
    for path in _sources():
        names = list(_names(ast.parse(path.read_text("utf-8"))))
        for line, name in [(1, path.stem), *names]:
            parts = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name)
            if why := _wrong(NAMES, parts, path):
                wrong.append(f"{path.relative_to(ROOT)}:{line} {name}: {why}")
    assert not wrong, "\n".join(wrong)


def test_sentences_are_plain() -> None:
    wrong: list[str] = []
    for path in _sources():
        with tokenize.open(path) as file:
            for token in tokenize.generate_tokens(file.readline):
                said = token.string if token.type in (tokenize.STRING, tokenize.COMMENT) else ""
                for line, text in enumerate(said.splitlines(), start=token.start[0]):
                    if " " in text.strip() and (why := _wrong(SENTENCES, text, path)):
                        wrong.append(f"{path.relative_to(ROOT)}:{line}: {why}")
    assert not wrong, "\n".join(wrong)


def test_pages_are_plain() -> None:
    pages = [path for path in (ROOT / "docs").rglob("*.md") if path.parent.name != "decisions"]
    lines = [
        (path, number, line)
        for path in [ROOT / "README.md", *pages]
        if path.name not in OTHERS
        for number, line in enumerate(path.read_text("utf-8").splitlines(), start=1)
    ]
    assert len(lines) > 1000
    found = [(path.name, number, _wrong(SENTENCES, line, path)) for path, number, line in lines]
    assert [one for one in found if one[2]] == []


def test_a_public_class_name_has_one_meaning() -> None:
    found: dict[str, list[str]] = defaultdict(list)
    for path in sorted(WORKBENCH.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                found[node.name].append(f"{path.relative_to(WORKBENCH)}")
    assert {name: at for name, at in found.items() if len(at) > 1} == {}


def test_every_word_of_the_glossary_is_used() -> None:
    glossary = ROOT / "docs" / "reference" / "glossary.md"
    pages = {ROOT / "README.md", *(ROOT / "docs").rglob("*.md")} - {glossary}
    said = "\n".join(path.read_text("utf-8") for path in [*pages, *WORKBENCH.rglob("*.py")]).lower()
    words = re.findall(r"^\| ([^|]+) \|", glossary.read_text("utf-8"), re.MULTILINE)[1:]
    terms = [term.strip("` ") for row in words for term in row.split(",")]
    assert len(terms) > 30
    assert [term for term in terms if term.lower() not in said] == []
