"""How `make site` builds these pages, and the pages of each room's public names, into build/site.

Sphinx reads the pages where they are; nothing is loaded from the network, neither here nor by the
built pages, whose search works from the folder. The pages of the rooms are written anew each time.
"""

from __future__ import annotations

import importlib
import pkgutil
import re
import shutil
from importlib import metadata
from pathlib import Path
from typing import Any

from docutils import nodes
from sphinx import addnodes
from sphinx.application import Sphinx
from sphinx.errors import ExtensionError

import workbench

ROOT = Path(__file__).resolve().parents[1]
ROOMS = ROOT / "docs" / "reference" / "api"  # git ignores it
PARTS = {
    "Start": "docs/tutorial\ndocs/README",
    "How to": "docs/how-to/*",
    "Explanation": "docs/explanation/*",
    "Reference": "docs/reference/*",
    "Python": "docs/reference/api/*",
    "Development": "CONTRIBUTING\nCHANGELOG\ndocs/decisions/README\ndocs/decisions/0*",
}
"""Captions of the navigation, and the pages below each."""

project = "Hopping workbench"
version = release = metadata.version("hopping-workbench")
html_title = project
root_doc = "README"
include_patterns = ["*.md", "docs/**.md", "docs/reference/api/*.rst"]
exclude_patterns = [".*", "build", "tests", "workbench"]
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
myst_heading_anchors = 4
html_theme = "furo"
html_static_path = ["site.css"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sphinx = html_show_copyright = False
html_show_search_summary = False  # a page opened from a folder may not read its neighbours
napoleon_use_ivar = True
default_role = "literal"
autodoc_typehints_format = "short"
python_use_unqualified_type_names = True
toc_object_entries = False  # of 2,500 names in the navigation of each page
python_maximum_signature_line_length = 80


def add_navigation(app: Sphinx, page: str, source: list[str]) -> None:
    """Append to the start page what Sphinx makes the navigation of."""
    if page == root_doc:
        for caption, pages in PARTS.items():
            options = f":hidden:\n:glob:\n:caption: {caption}"
            source[0] += f"\n```{{toctree}}\n{options}\n\n{pages}\n```\n"


def write_rooms(app: Sphinx) -> None:
    """Write a page for each room, of what it exports and no other room does before it."""
    shutil.rmtree(ROOMS, ignore_errors=True)
    ROOMS.mkdir(parents=True)
    for found in pkgutil.iter_modules(workbench.__path__, "workbench."):
        room = importlib.import_module(found.name)
        exported = {name: getattr(room, name) for name in getattr(room, "__all__", ())}
        vars(room).update(exported)  # what is imported only when it is asked for
        names = [name for name, value in exported.items() if _is_from(value, found.name)]
        if names:
            links = ", ".join(f":py:obj:`{name} <{found.name}.{name}>`" for name in names)
            text = f"{found.name}\n{'=' * len(found.name)}\n\nExports {links}.\n\n"
            text += f".. automodule:: {found.name}\n   :members: {', '.join(names)}\n"
            (ROOMS / f"{found.name}.rst").write_text(text, "utf-8")


def _is_from(value: object, room: str) -> bool:
    """Tell whether a room defines a value that it exports; a number says nothing of where."""
    return f"{getattr(value, '__module__', room)}.".startswith(f"{room}.")


def loaded_from_elsewhere(text: str) -> list[str]:
    """Return the addresses in a network that a page or a style sheet would load; links are none."""
    tags = r"<(?:script|link|img|iframe|source|video)\b[^>]*\s(?:src|href)=[\"']?"
    return re.findall(rf"(?:{tags}|url\([\"']?|@import\s+[\"'])((?:https?:)?//[^\"'\s>)]+)", text)


def finish(app: Sphinx, fault: Exception | None) -> None:
    """Let a browser that opens the folder find the start page; refuse pages that need a network."""
    if not fault:
        shutil.copyfile(app.outdir / f"{root_doc}.html", app.outdir / "index.html")
        for path in [*app.outdir.rglob("*.html"), *app.outdir.rglob("*.css")]:
            if found := loaded_from_elsewhere(path.read_text("utf-8")):
                raise ExtensionError(f"{path} would load {found[0]} from a network")


def show_examples(
    app: Sphinx, kind: str, name: str, value: object, options: object, lines: list[str]
) -> None:
    """Show what a room's docstring indents as it is: lines to type, a tree."""
    if kind == "module":
        block = r"\1.. code-block:: none\n\n"
        lines[:] = re.sub(r"(?m)(^\S.*\n\n)(?=    )", block, "\n".join(lines)).split("\n")


def name_arrays(app: Sphinx, *rest: Any) -> tuple[str | None, ...]:
    """Write the type of an array as the source does."""
    array = r"~numpy\.ndarray\[tuple\[~typing\.Any, \.\.\.\], ~numpy\.dtype\[(.*?)\]\]"
    return tuple(text and re.sub(array, r"NDArray[\1]", text) for text in rest[-2:])


def look_up_exactly(app: Sphinx, doctree: nodes.document) -> None:
    """Take away what makes Sphinx compare the type of each argument with the end of each name."""
    for node in doctree.findall(addnodes.pending_xref):
        node.attributes.pop("refspecific", None)


def setup(app: Sphinx) -> None:
    """Connect what is made at each stage of a build."""
    app.connect("builder-inited", write_rooms)
    app.connect("source-read", add_navigation)
    app.connect("autodoc-process-docstring", show_examples)
    app.connect("autodoc-process-signature", name_arrays)
    app.connect("doctree-read", look_up_exactly)
    app.connect("build-finished", finish)
