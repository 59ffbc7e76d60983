"""The colours of a review, the same in the recording, the plots and the report.

Orange and blue differ in lightness too, so that they survive a grey print and colour-blind eyes.
"""

from __future__ import annotations

__all__ = ["EXTENDED", "PHASES", "REAL", "RUNS", "SHADES", "TWIN", "rgb", "run_color"]

REAL = "#e8710a"
TWIN = "#2b7be4"
EXTENDED = "#149a4c"
SHADES = {
    "sky": "#20262e",  # between the viewer's dark panels and the ground
    "ground": "#39424e",
    "grid": "#566170",
    "scale": "#aab4c0",
    "marks": "#ffffff",
    "force": "#e0457b",
    "missing": "#a566cc",
    "noise": "#b9c1cb",
    "foot": "#14a08c",
    "top": "#9b6ad6",
    "set_volts": "#8f99a5",
    "volts": "#c79a16",
    "amps": "#c2413c",
}
PHASES = ("#aeb9c7", "#f0c36a", "#7fbf95", "#9bb3e0", "#d79bb4", "#b6a6d9", "#9ecad1", "#cfb99a")
"""One colour a phase name in the order of first use; after eight they repeat."""

RUNS = ("#0b6e99", "#d1495b", "#6a994e", "#8f5fbf", "#c98a1b", "#3d5a80", "#b5179e", "#7f5539")
"""One colour a run where several are drawn together; after eight they repeat."""


def run_color(number: int) -> str:
    """Return the colour of a run by its number, from 1."""
    return RUNS[(number - 1) % len(RUNS)]


def rgb(color: str) -> tuple[int, int, int]:
    """Return `#rrggbb` as three bytes, the form that rerun takes."""
    red, green, blue = bytes.fromhex(color.removeprefix("#"))
    return red, green, blue
