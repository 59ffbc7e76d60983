"""A recorded stream as the export of a run."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from workbench.bundle import Bundle
    from workbench.tracking import Recorder

__all__ = ["write_stream"]


def write_stream(recorder: Recorder, bundle: Bundle) -> Path:
    """Stop a recorder and write what it has into a bundle, as Motive would export it.

    Raises:
        HardwareError: when too few frames came.
        RecordError: when it cannot be written.
    """
    from workbench.tracking import write_motive

    take = recorder.stop()
    name = f"live {take.began[0]:%Y-%m-%d %H.%M.%S}.csv"
    return bundle.write_take(name, lambda path: write_motive(take, path, version="1.24"))
