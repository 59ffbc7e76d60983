"""A rig in a folder: its file, its model and what was recorded of its runs."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

__all__ = ["write_rig"]


def write_rig(
    folder: Path, rig: str, model: str, head: str, runs: Iterable[NDArray[np.float64]]
) -> Path:
    """Write `rig.yaml`, `model.xml` and `run-0.csv` and on, and return the rig's file.

    Args:
        folder: that exists.
        rig: text of the rig's file.
        model: MJCF.
        head: names of the columns, a comma between two.
        runs: (n, columns) each.
    """
    for k, rows in enumerate(runs):
        np.savetxt(folder / f"run-{k}.csv", rows, "%.9g", ",", header=head, comments="")
    (folder / "model.xml").write_text(model)
    (folder / "rig.yaml").write_text(rig)
    return folder / "rig.yaml"
