"""The pendulum of the examples, also in short, so that a diagnosis takes a moment."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

__all__ = ["PENDULUMS", "rig_of"]

WHOLE = Path(__file__).resolve().parents[1] / "examples" / "pendulum"
PENDULUMS = ["short", pytest.param("whole", marks=pytest.mark.long)]
_KEPT = 0.5
"""Of each run's samples; one small run is left out."""
_LEFT_OUT = "  - {data: release-0.2.csv, mode: swing, begins: 1 s, start: {pivot: held}}\n"


def rig_of(name: str, folder: Path) -> Path:
    """Return the rig file of one of `PENDULUMS`; a short one is written into the folder."""
    if name == "whole":
        return WHOLE / "rig.yaml"
    short = folder / "pendulum"
    shutil.copytree(WHOLE, short)
    for data in short.glob("*.csv"):
        lines = data.read_text(encoding="utf-8").splitlines(keepends=True)
        data.write_text("".join(lines[: round(_KEPT * len(lines))]), encoding="utf-8")
    file = short / "rig.yaml"
    text = file.read_text(encoding="utf-8")
    assert _LEFT_OUT in text
    file.write_text(text.replace(_LEFT_OUT, ""), encoding="utf-8")
    return file
