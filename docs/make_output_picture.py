"""Draw the states of an output and the events between them.

    python docs/make_output_picture.py OUT

Writes `output.svg`. Each arrow is compared with the fold of `workbench.output` before it is drawn.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any, NamedTuple

from workbench.output import State, after, fold

Event = dict[str, Any]

TAKEN, ON, OFF = {"event": "taken"}, {"event": "output_on"}, {"event": "off", "confirmed": True}
NOT_OFF = {"event": "off", "confirmed": False}
DEAD, LIVE = {"event": "terminals", "dead": True}, {"event": "terminals", "dead": False}
LOST, REGAINED = {"event": "lost", "cause": "no answer"}, {"event": "regained"}
TRIP = {"event": "trip", "reason": "its client is dead"}
DAMAGED = {"event": "damaged", "cause": "a line cannot be read"}
SIGNED = {"event": "acknowledged", "name": "NAME"}

REACHED: dict[State, tuple[Event, ...]] = {
    "untouched": (),
    "unknown": (TAKEN,),
    "off": (TAKEN, OFF, DEAD),
    "on": (TAKEN, OFF, DEAD, ON),
}
"""Events that lead to each state."""


class Box(NamedTuple):
    """A state: its centre, its colour, and what is said below its name."""

    x: int
    y: int
    colour: str
    text: str


class Arrow(NamedTuple):
    """An arrow from one state to another.

    Args:
        start: state that it leaves.
        end: state that it leads to.
        ways: event after event; each way alone leads there.
        line: x and y of its two ends.
        label: x, y and anchor of its words.
        words: lines of it; what is between backticks is an event.
    """

    start: State
    end: State
    ways: tuple[tuple[Event, ...], ...]
    line: tuple[int, int, int, int]
    label: tuple[int, int, str]
    words: tuple[str, ...]


WIDTH, HEIGHT = 1000, 500
BOX_WIDTH, BOX_HEIGHT = 244, 76
FONT = "DejaVu Sans, Verdana, Arial, sans-serif"
NAME_PX, TEXT_PX, LINE_PX = 20, 14, 19
BOXES: dict[State, Box] = {
    "untouched": Box(145, 80, "#eceff1", "no program changed anything"),
    "unknown": Box(500, 80, "#ffcdd2", "said as OUTPUT MAY BE ON"),
    "off": Box(200, 360, "#c8e6c9", "read back, terminals dead"),
    "on": Box(800, 360, "#fff3c4", "while a guardian watches it"),
}
ARROWS = (
    Arrow(
        "untouched", "unknown", ((TAKEN,),), (269, 80, 375, 80), (322, 70, "middle"),
        ("`taken`",),
    ),
    Arrow(
        "unknown", "off", ((OFF, DEAD),), (415, 120, 195, 318), (286, 205, "end"),
        ("`off` read back,", "then `terminals` dead"),
    ),
    Arrow(
        "off", "unknown", ((TAKEN,), (NOT_OFF,), (LIVE,), (DAMAGED,)), (235, 320, 455, 122),
        (342, 252, "start"),
        ("`taken`, by the next program,", "`off` not read back,", "`terminals` live,",
         "a line that cannot be read"),
    ),
    Arrow(
        "on", "unknown", ((LOST,), (TRIP,), (NOT_OFF,), (LIVE,), (DAMAGED,)), (805, 318, 585, 120),
        (722, 190, "start"),
        ("`lost`, `trip`,", "`off` not read back, `terminals` live,", "a line that cannot be read"),
    ),
    Arrow(
        "unknown", "on", ((LOST, REGAINED),), (545, 122, 765, 320), (648, 262, "end"),
        ("`regained`",),
    ),
    Arrow("off", "on", ((ON,),), (324, 350, 675, 350), (499, 341, "middle"), ("`output_on`",)),
    Arrow(
        "on", "off", ((OFF, DEAD),), (676, 372, 325, 372), (499, 393, "middle"),
        ("`off` read back, then `terminals` dead",),
    ),
)  # fmt: skip
NOTES = (
    "`taken` and `output_on` are written before the deed, `off` and `terminals` after it:",
    "a crash in between leaves “may be on”, never “off”. Once no guardian watches, on is said as",
    "OUTPUT MAY BE ON too. In the ledger `acknowledged` leads from each state to untouched.",
)


def main() -> None:
    parser = argparse.ArgumentParser(description="Draw output.svg.")
    parser.add_argument("out", type=Path, help="folder for the picture")
    out = parser.parse_args().out
    out.mkdir(parents=True, exist_ok=True)
    (out / "output.svg").write_text(picture(), encoding="utf-8")


def picture() -> str:
    """Return the picture as SVG.

    Raises:
        ValueError: when an arrow is not what the fold says.
    """
    for arrow in ARROWS:
        _require_true(arrow)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" '
        f'width="{WIDTH}" height="{HEIGHT}" font-family="{FONT}" font-size="{TEXT_PX}">',
        "<title>States of an output and the events between them</title>",
        '<defs><marker id="tip" viewBox="0 0 10 10" refX="9" refY="5" markerWidth="9" '
        'markerHeight="9" markerUnits="userSpaceOnUse" orient="auto">'
        '<path d="M0 0 L10 5 L0 10 z" fill="#333"/></marker></defs>',
        f'<rect width="{WIDTH}" height="{HEIGHT}" fill="#fff"/>',
        *map(_arrow, ARROWS),
        *(_box(name, box) for name, box in BOXES.items()),
        _lines(NOTES, 40, 440, "start"),
        "</svg>",
    ]
    return "\n".join(parts) + "\n"


def _require_true(arrow: Arrow) -> None:
    for way in arrow.ways:
        known = fold(REACHED[arrow.start])
        for event in way:
            known = after(known, event)
        if known.state != arrow.end or fold([*REACHED[arrow.start], SIGNED]).state != "untouched":
            raise ValueError(f"{arrow.start}: {way} leads to {known.state}, not to {arrow.end}")


def _arrow(arrow: Arrow) -> str:
    x, y, to_x, to_y = arrow.line
    line = f'<path d="M{x} {y} L{to_x} {to_y}" stroke="#333" stroke-width="1.6" '
    return line + 'fill="none" marker-end="url(#tip)"/>\n' + _lines(arrow.words, *arrow.label)


def _box(name: str, box: Box) -> str:
    left, top = box.x - BOX_WIDTH // 2, box.y - BOX_HEIGHT // 2
    return (
        f'<rect x="{left}" y="{top}" width="{BOX_WIDTH}" height="{BOX_HEIGHT}" rx="12" '
        f'fill="{box.colour}" stroke="#333" stroke-width="1.6"/>\n'
        f'<text x="{box.x}" y="{box.y - 4}" text-anchor="middle" font-size="{NAME_PX}" '
        f'font-weight="bold">{name}</text>\n' + _lines((box.text,), box.x, box.y + 20, "middle")
    )


def _lines(words: tuple[str, ...], x: int, y: int, anchor: str) -> str:
    """Return lines of text, one below another; events in bold."""
    lines = []
    for number, line in enumerate(words):
        spans = line.split("`")
        spans[1::2] = [f'<tspan font-weight="bold">{event}</tspan>' for event in spans[1::2]]
        place = f'x="{x}" y="{y + LINE_PX * number}" text-anchor="{anchor}"'
        lines.append(f"<text {place}>{''.join(spans)}</text>")
    return "\n".join(lines)


if __name__ == "__main__":
    main()
