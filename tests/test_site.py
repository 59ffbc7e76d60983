"""The pages as a site: complete, and searched in a browser without a network."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from docs.conf import PARTS, loaded_from_elsewhere
from tests.panel.chromium import browser

ROOT = Path(__file__).resolve().parents[1]
PAGES = ["README.md", *(p.relative_to(ROOT).as_posix() for p in (ROOT / "docs").rglob("*.md"))]
TECHNICIANS = re.compile(r"README\.md|docs/tutorial\.md|docs/how-to/.*")


@pytest.mark.parametrize("page", [page for page in PAGES if TECHNICIANS.fullmatch(page)])
def test_a_technician_s_page_links_no_decision(page: str) -> None:
    text = (ROOT / page).read_text("utf-8")
    assert re.findall(r"\]\(([^)]*decisions/[^)]*)\)", text) == []


def test_every_page_has_a_place_in_the_navigation() -> None:
    listed = {"README.md"}
    for pattern in "\n".join(PARTS.values()).split("\n"):
        listed |= {path.relative_to(ROOT).as_posix() for path in ROOT.glob(f"{pattern}.md")}
    assert set(PAGES) - listed == set()


@pytest.mark.parametrize(
    "text",
    [
        '<script async src="https://cdn.example/mathjax.js"></script>',
        '<link rel="stylesheet" href="//fonts.example/css?family=Inter"/>',
        "<img alt='' src='http://example/badge.svg'>",
        "@font-face { src: url(https://fonts.example/inter.woff2) }",
        '@import "https://fonts.example/inter.css";',
    ],
)
def test_what_a_network_would_have_to_answer_is_found(text: str) -> None:
    (found,) = loaded_from_elsewhere(text)
    assert "example/" in found


def test_links_and_what_lies_beside_a_page_load_nothing() -> None:
    text = (
        '<a href="https://rerun.io">r</a><img src="_images/a.png"> url(data:image/svg+xml;http://)'
    )
    assert loaded_from_elsewhere(text) == []


@pytest.mark.long
def test_the_site_is_built_without_warnings_and_searched_from_its_folder(tmp_path: Path) -> None:
    site = tmp_path / "site"
    words = ["-m", "sphinx", "--quiet", "--fail-on-warning", "--fresh-env", "-c", "docs"]
    done = subprocess.run(
        [sys.executable, *words, "-d", tmp_path / "doctrees", ROOT, site],
        cwd=ROOT, capture_output=True, text=True, timeout=600,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    built = {path.relative_to(site).with_suffix(".md").as_posix() for path in site.rglob("*.html")}
    assert set(PAGES) - built == set()
    with browser() as chromium:
        page = chromium.open(f"{(site / 'index.html').as_uri()}")
        assert page.text("h1") == "Hopping workbench"
        page = chromium.open(f"{(site / 'search.html').as_uri()}?q=ramp_down")
        page.wait_for("document.querySelectorAll('#search-results li').length > 1")
        assert "Supply.ramp_down" in page.text("#search-results")
        assert {url.split(":")[0] for url in page.requests()} <= {"file", "data"}
        assert page.complaints() == []
