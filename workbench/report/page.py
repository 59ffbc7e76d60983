"""A page of the workbench: one HTML file that needs nothing beside it, on screen and on paper."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from markupsafe import Markup

from workbench.report import palette

if TYPE_CHECKING:
    import jinja2

__all__ = ["code", "figure", "folded", "picture", "table", "warning_list", "write_page"]


def write_page(
    path: Path, title: str, subtitle: str, verdict: str, sections: Iterable[tuple[str, Markup]]
) -> None:
    """Write a page; the same content gives the same bytes.

    Args:
        path: the `.html` file; one that is there is replaced.
        title: headline in people's words.
        subtitle: what it is about, below.
        verdict: the result in one sentence.
        sections: (title, body); one whose body is empty is left out.
    """
    page = _template().render(
        title=title,
        run=subtitle,
        verdict=verdict,
        sections=[(title, body) for title, body in sections if body],
        real=palette.REAL,
        twin=palette.TWIN,
    )
    path.write_text(page, encoding="utf-8", newline="\n")


def warning_list(warnings: Iterable[str]) -> Markup:
    """Return warnings as a list, empty when there are none."""
    items = Markup().join(Markup("<li>{}</li>").format(_coded(text)) for text in warnings)
    return Markup('<ul class="warnings">{}</ul>').format(items) if items else items


def _coded(text: str) -> Markup:
    """Return text whose parts in backticks are set as what is typed."""
    parts = text.split("`")
    if len(parts) % 2 == 0:
        return Markup("{}").format(text)
    marked = ("<code>{}</code>" if k % 2 else "{}" for k in range(len(parts)))
    return Markup().join(
        Markup(form).format(part) for form, part in zip(marked, parts, strict=True)
    )


def figure(svg: str, caption: str) -> Markup:
    """Return a figure with its caption."""
    return Markup("<figure>{}<figcaption>{}</figcaption></figure>").format(Markup(svg), caption)


def picture(jpeg: bytes | None, caption: str) -> Markup:
    """Return a picture, kept in the page itself, with its caption; nothing of None."""
    if jpeg is None:
        return Markup()
    source = f"data:image/jpeg;base64,{base64.b64encode(jpeg).decode()}"
    return Markup('<figure><img src="{}" alt="{}"><figcaption>{}</figcaption></figure>').format(
        source, caption, caption
    )


def code(text: str) -> Markup:
    """Return text as it is typed, such as a command."""
    return Markup("<pre>{}</pre>").format(text)


def folded(summary: str, body: Markup) -> Markup:
    """Return what a reader opens by a click; on paper it is open. Nothing of nothing."""
    if not body:
        return body
    return Markup("<details><summary>{}</summary>{}</details>").format(summary, body)


def table(rows: Iterable[Sequence[str]], heads: Sequence[str] = (), css: str = "numbers") -> Markup:
    """Return a table; the first cell of a row is its heading.

    Args:
        rows: cells as text.
        heads: of the columns.
        css: `numbers` aligns right, `facts` and `runs` left; `compared` adds the inks of real and
            twin to the second and third column, `spreads` leaves the second one left.
    """
    head = Markup("<thead><tr>{}</tr></thead>").format(_cells(heads, "th")) if heads else ""
    body = Markup().join(Markup("<tr>{}</tr>").format(_row(row)) for row in rows)
    return Markup('<div class="wide"><table class="{}">{}<tbody>{}</tbody></table></div>').format(
        css, head, body
    )


def _row(row: Sequence[str]) -> Markup:
    return Markup('<th scope="row">{}</th>{}').format(row[0], _cells(row[1:], "td"))


def _cells(texts: Sequence[str], tag: str) -> Markup:
    return Markup().join(Markup(f"<{tag}>{{}}</{tag}>").format(text) for text in texts)


def _template() -> jinja2.Template:
    import jinja2

    rooms = jinja2.PackageLoader("workbench.report", package_path="")
    environment = jinja2.Environment(
        loader=rooms, autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True
    )
    return environment.get_template("report.html.j2")
